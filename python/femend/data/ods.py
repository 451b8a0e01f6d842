"""Operating deflection shapes: complex response shapes at frequencies."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from femend.data._arrays import frozen
from femend.data.bands import within_band
from femend.data.channel import Channel
from femend.data.frf import check_frequency_axis
from femend.dof import Dof
from femend.errors import RecordingError

__all__ = ["ODS", "ODS_KINDS"]

ODS_KINDS = ("ods", "ods-frf", "order", "one-sided")


@dataclass(frozen=True, slots=True, eq=False)
class ODS:
    """Shapes: `shapes` (n_ch, n_freq) complex at `freq` (n_freq,) in Hz, in the units of `channels`.

    `kind`: "ods" (peak amplitudes of one spectrum), "ods-frf" (magnitude of the response, phase from the reference),
    "order" (peak amplitudes of one order, phase against the tacho), "one-sided" (deconvolved, in FRF-like form).
    `reference` is the channel of phase 0, None for the tacho. `order` and `speed` (n_freq,) rev/s belong to kind
    "order". `sigma` (n_ch, n_freq) is the standard deviation of the complex values and `coherence` (n_ch, n_freq) that
    with the reference, where known. The sign of a sensor's DOF is not applied. Arrays are read-only. Raises
    RecordingError for shapes that do not fit, an unknown kind, NaN (naming channel and frequency) or an axis that does
    not increase.
    """

    name: str
    freq: NDArray[np.float64]
    shapes: NDArray[np.complex128]
    channels: tuple[Channel, ...]
    kind: str
    reference: Channel | None = None
    order: float | None = None
    speed: NDArray[np.float64] | None = None
    coherence: NDArray[np.float64] | None = None
    sigma: NDArray[np.float64] | None = None
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "freq", frozen(self.freq, np.float64))
        object.__setattr__(self, "shapes", frozen(self.shapes, np.complex128))
        object.__setattr__(self, "channels", tuple(self.channels))
        object.__setattr__(self, "notes", tuple(self.notes))
        check_frequency_axis(self.name, self.freq)
        shape = (len(self.channels), self.freq.size)
        wanted = {"shapes": shape, "speed": (self.freq.size,), "coherence": shape, "sigma": shape}
        for key, expected in wanted.items():
            value = getattr(self, key)
            if value is None:
                continue
            if key != "shapes":
                object.__setattr__(self, key, frozen(value, np.float64))
            if getattr(self, key).shape != expected:
                raise RecordingError(
                    f"operating shapes {self.name!r}: {key} of shape {np.shape(value)} is not {expected}",
                    recording=self.name,
                )
        if self.kind not in ODS_KINDS:
            raise RecordingError(
                f"operating shapes {self.name!r}: kind {self.kind!r} is none of {', '.join(ODS_KINDS)}",
                recording=self.name,
            )
        bad = ~np.isfinite(self.shapes)
        if bad.any():
            row, line = (int(i[0]) for i in np.nonzero(bad))
            raise RecordingError(
                f"operating shapes {self.name!r}: {self.channels[row].text} is not a number at "
                f"{self.freq[line]:.6g} Hz; leave the channel or the line out",
                recording=self.name,
                channel=self.channels[row].text,
            )

    @property
    def n_freq(self) -> int:
        """Number of frequency lines."""
        return int(self.freq.size)

    @property
    def dofs(self) -> tuple[Dof | None, ...]:
        """DOFs of the channels."""
        return tuple(c.dof for c in self.channels)

    def at(self, freq: float) -> NDArray[np.complex128]:
        """Shape (n_ch,) at the line nearest `freq` (Hz); raises RecordingError more than a step outside the axis."""
        step = float(np.diff(self.freq).max()) if self.n_freq > 1 else 0.0
        if not self.freq[0] - step <= freq <= self.freq[-1] + step:
            raise RecordingError(
                f"operating shapes {self.name!r} reach from {self.freq[0]:.6g} to {self.freq[-1]:.6g} Hz, not to "
                f"{freq:.6g} Hz",
                recording=self.name,
            )
        return self.shapes[:, int(np.argmin(np.abs(self.freq - freq)))]

    def lines(self, keep: NDArray[Any]) -> ODS:
        """The lines chosen by `keep`, a mask (n_freq,) or positions; raises RecordingError where none is left."""
        axes: dict[str, Any] = {
            k: None if (v := getattr(self, k)) is None else v[..., keep] for k in ("speed", "coherence", "sigma")
        }
        return replace(self, freq=self.freq[keep], shapes=self.shapes[:, keep], **axes)

    def band(self, low: float, high: float) -> ODS:
        """The lines with low <= f <= high in Hz; raises RecordingError where none lies between `low` and `high`."""
        return self.lines(within_band(self.freq, (low, high)))

    def select(self, rows: Sequence[int]) -> ODS:
        """The shapes of some channels, by position `rows`."""
        chosen = list(rows)
        parts: dict[str, Any] = {
            k: None if (v := getattr(self, k)) is None else v[chosen] for k in ("coherence", "sigma")
        }
        return replace(self, shapes=self.shapes[chosen], channels=tuple(self.channels[i] for i in chosen), **parts)

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON, without the shapes."""
        return {
            "name": self.name,
            "kind": self.kind,
            "order": self.order,
            "n_freq": self.n_freq,
            "band": [float(self.freq[0]), float(self.freq[-1])],
            "reference": None if self.reference is None else self.reference.to_dict(),
            "channels": [c.to_dict() for c in self.channels],
            "notes": list(self.notes),
        }

    def __repr__(self) -> str:
        against = "tacho" if self.reference is None else self.reference.text
        return (
            f"ODS({self.name!r}: {self.kind}, {len(self.channels)} channels, {self.n_freq} lines {self.freq[0]:.6g} to "
            f"{self.freq[-1]:.6g} Hz, phase against {against})"
        )
