"""What a diagnosis has settled while it is under way, so that an interrupted run need not lose it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from femend.diagnose.locating.locate import Located
from femend.diagnose.naming.ranked import Ranked
from femend.diagnose.recordings.recorded_off import RecordedOff

if TYPE_CHECKING:
    from femend.diagnose.deciding.outcome import Diagnosis
    from femend.diagnose.driven.unrecorded import Driven
    from femend.diagnose.updating.update import UpdatedModel

__all__ = ["SoFar"]


@dataclass(eq=False)
class SoFar:
    """Filled by a diagnosis as it goes.

    Attributes:
        start: the updated model; None before the update is done.
        off: what all recordings are off by, as of the updated model.
        located: places ranked so far, the likeliest first.
        ranked: laws judged so far, in no order.
        driven: where the force acts if nobody recorded it.
        decided: the diagnosis with one effect, while more are looked for.
        found: the diagnosis itself, once it has come to its end.
    """

    start: UpdatedModel | None = None
    off: RecordedOff | None = None
    located: list[Located] = field(default_factory=list)
    ranked: list[Ranked] = field(default_factory=list)
    driven: Driven | None = None
    decided: Diagnosis | None = None
    found: Diagnosis | None = None

    def places(self, start: UpdatedModel, located: Sequence[Located]) -> None:
        """The places `located` from the updated model `start`; laws judged before belong to another one."""
        self.start, self.located, self.ranked = start, list(located), []
