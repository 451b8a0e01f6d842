"""Time records of several channels on one even time axis."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from femend.data._arrays import frozen
from femend.data.channel import Channel
from femend.errors import RecordingError

__all__ = ["TimeData", "pick_channel"]


def pick_channel(channels: Sequence[Channel], text: str, recording: str) -> int:
    """Position of the one channel that answers to `text`: its exact name or DOF before the beginning of a label.

    Raises RecordingError where none or several do.
    """
    exact = [i for i, c in enumerate(channels) if text in (c.name, str(c.dof))]
    found = exact or [i for i, c in enumerate(channels) if c.answers_to(text)]
    if len(found) == 1:
        return found[0]
    there = ", ".join(c.text for c in channels[:12]) + (" …" if len(channels) > 12 else "")
    problem = f"{len(found)} channels answer to {text!r}" if found else f"no channel answers to {text!r}"
    raise RecordingError(
        f"recording {recording!r}: {problem}; its channels are {there}", recording=recording, channel=text
    )


@dataclass(frozen=True, slots=True, eq=False)
class TimeData:
    """Evenly sampled records: `values` (n_ch, n_samples) float64 in the units of `channels`, `dt` and `t0` in s.

    The array is read-only. Raises RecordingError for a step that is not positive, a row without channel, fewer than
    two samples, NaN or infinity (naming channel and time).

    >>> TimeData("r", 0.5, [[0.0, 1.0, 0.0]], [Channel(None, "force", "N")]).duration
    1.5
    """

    name: str
    dt: float
    values: NDArray[np.float64]
    channels: tuple[Channel, ...]
    t0: float = 0.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "values", frozen(self.values, np.float64))
        object.__setattr__(self, "channels", tuple(self.channels))
        if self.values.ndim != 2 or self.values.shape[0] != len(self.channels):
            raise RecordingError(
                f"recording {self.name!r}: values of shape {self.values.shape} do not fit {len(self.channels)} "
                "channels; they must be (n_ch, n_samples)",
                recording=self.name,
            )
        if not (np.isfinite(self.dt) and self.dt > 0):
            raise RecordingError(
                f"recording {self.name!r}: the time step {self.dt} s is not positive; state the step in the file",
                recording=self.name,
            )
        if self.values.shape[1] < 2:
            raise RecordingError(
                f"recording {self.name!r}: {self.values.shape[1]} samples are no record; at least 2 are needed",
                recording=self.name,
            )
        self._refuse_gaps()

    def _refuse_gaps(self) -> None:
        bad = ~np.isfinite(self.values)
        if not bad.any():
            return
        row = int(np.flatnonzero(bad.any(axis=1))[0])
        sample = int(np.flatnonzero(bad[row])[0])
        count = int(bad[row].sum())
        many = f"; {count} such samples" if count > 1 else ""
        channel = self.channels[row].text
        raise RecordingError(
            f"recording {self.name!r}: channel {channel} is {self.values[row, sample]} at "
            f"{self.t0 + sample * self.dt:.6g} s (sample {sample}{many}); "
            "cut the gap out of the recording or leave the channel out",
            recording=self.name,
            channel=channel,
        )

    @property
    def n_samples(self) -> int:
        """Number of samples of every channel."""
        return int(self.values.shape[1])

    @property
    def rate(self) -> float:
        """Sampling rate in Hz."""
        return 1.0 / self.dt

    @property
    def duration(self) -> float:
        """n_samples * dt in s."""
        return self.n_samples * self.dt

    @property
    def t(self) -> NDArray[np.float64]:
        """Sample times in s, (n_samples,)."""
        return self.t0 + self.dt * np.arange(self.n_samples, dtype=np.float64)

    def index(self, text: str) -> int:
        """Row of the channel named `text` (name, DOF text, or beginning of its id line); raises RecordingError."""
        return pick_channel(self.channels, text, self.name)

    def select(self, rows: Sequence[int]) -> TimeData:
        """The records of some rows, in that order."""
        chosen = list(rows)
        return TimeData(self.name, self.dt, self.values[chosen], tuple(self.channels[i] for i in chosen), self.t0)

    def rows(self, *quantities: str) -> list[int]:
        """Rows whose channel measures one of `quantities`."""
        return [i for i, c in enumerate(self.channels) if c.quantity in quantities]

    def with_values(self, values: NDArray[np.float64], *, name: str | None = None) -> TimeData:
        """The same channels and axis with other `values` (n_ch, n_samples) and perhaps another `name`."""
        return TimeData(self.name if name is None else name, self.dt, values, self.channels, self.t0)

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON, without the samples."""
        return {
            "name": self.name,
            "dt": self.dt,
            "t0": self.t0,
            "n_samples": self.n_samples,
            "channels": [c.to_dict() for c in self.channels],
        }

    def __repr__(self) -> str:
        return (
            f"TimeData({self.name!r}: {len(self.channels)} channels, {self.n_samples} samples at {self.rate:.6g} Hz, "
            f"{self.duration:.6g} s)"
        )
