"""Auto and cross spectra, spectra and power spectral densities of channels."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from femend.data._arrays import frozen
from femend.data.channel import Channel
from femend.data.frf import check_frequency_axis
from femend.errors import RecordingError

__all__ = ["SPECTRUM_KINDS", "Spectra"]

SPECTRUM_KINDS = ("spectrum", "autospectrum", "cross-spectrum", "psd", "esd", "coherence", "ordinary")


@dataclass(frozen=True, slots=True, eq=False)
class Spectra:
    """Values per frequency line: `values` (n_ch, n_freq) complex at `freq` (n_freq,) in Hz.

    `channels` label the rows; `references` the second channel of a cross spectrum (None otherwise); `kind` is one of
    spectrum, autospectrum, cross-spectrum, psd, esd, coherence. Arrays are read-only. Raises RecordingError for
    shapes that do not fit, an unknown kind, NaN, or an axis that does not increase.
    """

    name: str
    freq: NDArray[np.float64]
    values: NDArray[np.complex128]
    channels: tuple[Channel, ...]
    kind: str
    references: tuple[Channel | None, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "freq", frozen(self.freq, np.float64))
        object.__setattr__(self, "values", frozen(self.values, np.complex128))
        object.__setattr__(self, "channels", tuple(self.channels))
        object.__setattr__(self, "references", tuple(self.references) or (None,) * len(self.channels))
        check_frequency_axis(self.name, self.freq)
        if self.values.shape != (len(self.channels), self.freq.size) or len(self.references) != len(self.channels):
            raise RecordingError(
                f"recording {self.name!r}: spectra of shape {self.values.shape} do not fit {len(self.channels)} "
                f"channels and {self.freq.size} lines",
                recording=self.name,
            )
        if self.kind not in SPECTRUM_KINDS:
            raise RecordingError(
                f"recording {self.name!r}: {self.kind!r} is none of {', '.join(SPECTRUM_KINDS)}", recording=self.name
            )
        bad = ~np.isfinite(self.values)
        if bad.any():
            row, line = (int(i[0]) for i in np.nonzero(bad))
            raise RecordingError(
                f"recording {self.name!r}: the {self.kind} of {self.channels[row].text} is not a number at "
                f"{self.freq[line]:.6g} Hz; leave the channel or the line out",
                recording=self.name,
                channel=self.channels[row].text,
            )

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON, without the arrays."""
        return {
            "name": self.name,
            "kind": self.kind,
            "n_freq": int(self.freq.size),
            "channels": [c.to_dict() for c in self.channels],
            "references": [None if c is None else c.to_dict() for c in self.references],
        }

    def __repr__(self) -> str:
        return (
            f"Spectra({self.name!r}: {self.kind}, {len(self.channels)} channels, {self.freq.size} lines "
            f"{self.freq[0]:.6g} to {self.freq[-1]:.6g} Hz)"
        )
