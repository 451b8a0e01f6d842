"""How recordings came to their samples."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["Recorder"]


@dataclass(eq=False)
class Recorder:
    """What is known of the recorder, by all who look at its recordings.

    `filters` is whether it took out what lies above half its sampling rate before it sampled, as recorders do. Of a
    simulation's output samples may have been picked as they are, so that what laws excite up there is folded into the
    band; that is learnt while laws are fitted.
    """

    filters: bool = True

    @property
    def warnings(self) -> list[str]:
        """What to tell of it."""
        if self.filters:
            return []
        return [
            "recordings look as if they were sampled without a filter against aliasing: what a law excites above half "
            "the sampling rate is folded into the band, and was taken to be; record or export with such a filter"
        ]
