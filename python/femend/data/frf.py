"""Frequency response functions with labelled axes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from femend.data._arrays import frozen
from femend.data.bands import within_band
from femend.data.channel import Channel
from femend.dof import Dof
from femend.errors import RecordingError, UnitError
from femend.units import parse_unit

__all__ = ["FRF", "FRF_KINDS", "check_frequency_axis"]

FRF_KINDS = ("receptance", "mobility", "accelerance")
# by how much the digits of a file may put a coherence beyond 0 and 1
ROUNDED = 1e-4
# units of each per newton, as an example
_LIKE = {"receptance": "m/N", "mobility": "m/s/N", "accelerance": "m/s^2/N"}


def check_frequency_axis(name: str, freq: NDArray[np.float64]) -> None:
    """Raises RecordingError unless `freq` (n_freq,) is finite, not negative and increasing."""
    if freq.ndim != 1 or freq.size == 0:
        raise RecordingError(f"recording {name!r}: the frequency axis has shape {freq.shape}", recording=name)
    if not np.isfinite(freq).all() or freq[0] < 0 or (freq.size > 1 and np.diff(freq).min() <= 0):
        raise RecordingError(
            f"recording {name!r}: the {freq.size} frequency lines do not increase from 0 Hz on; sort the lines and "
            "drop repeated ones",
            recording=name,
        )


def _kind_of(unit: str) -> str | None:
    """The kind of FRF that a unit measures, of motions along or about an axis per force or moment; None where it cannot
    be read or is something else, such as that of uncalibrated channels."""
    try:
        length, mass, time, volt = parse_unit(unit).dims
    except UnitError:
        return None
    if mass != -1 or volt != 0 or length not in (0, -1, -2) or time not in (0, 1, 2):
        return None
    return FRF_KINDS[2 - time]


@dataclass(frozen=True, slots=True, eq=False)
class FRF:
    """Response per force: `H` (n_freq, n_out, n_in) complex at `freq` (n_freq,) in Hz, time convention exp(+i omega t).

    `outputs` and `inputs` are channels with a DOF each; the sign of the DOF is part of the sensor's direction and is
    not applied to `H`. `kind` is receptance, mobility or accelerance; `unit` the unit of `H`. `coherence`
    (n_freq, n_out, n_in) in [0, 1] (what is beyond by rounding is put to 0 or 1) or None. Arrays are read-only. Raises
    RecordingError for shapes that do not fit, an unknown kind, a unit that is another kind's, NaN or a coherence that
    is none (naming the pair and the frequency) or an axis that does not increase.
    """

    name: str
    freq: NDArray[np.float64]
    H: NDArray[np.complex128]
    outputs: tuple[Channel, ...]
    inputs: tuple[Channel, ...]
    kind: str
    unit: str
    coherence: NDArray[np.float64] | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "freq", frozen(self.freq, np.float64))
        object.__setattr__(self, "H", frozen(self.H, np.complex128))
        object.__setattr__(self, "outputs", tuple(self.outputs))
        object.__setattr__(self, "inputs", tuple(self.inputs))
        check_frequency_axis(self.name, self.freq)
        shape = (self.freq.size, len(self.outputs), len(self.inputs))
        if self.H.shape != shape:
            raise RecordingError(
                f"recording {self.name!r}: H of shape {self.H.shape} is not (n_freq, n_out, n_in) = {shape}",
                recording=self.name,
            )
        if self.kind not in FRF_KINDS:
            raise RecordingError(
                f"recording {self.name!r}: FRF kind {self.kind!r} is none of {', '.join(FRF_KINDS)}",
                recording=self.name,
            )
        shown = _kind_of(self.unit)
        if shown not in (None, self.kind):
            raise RecordingError(
                f"recording {self.name!r}: the unit of its FRFs, {self.unit}, is one of {shown}, and their kind is "
                f"said to be {self.kind}, whose unit is one such as {_LIKE[self.kind]}: correct the kind or the unit",
                recording=self.name,
            )
        if self.coherence is not None:
            coherence = np.asarray(self.coherence, dtype=np.float64)
            if coherence.shape != shape:
                raise RecordingError(
                    f"recording {self.name!r}: coherence of shape {coherence.shape} does not fit H {shape}",
                    recording=self.name,
                )
            self._refuse_coherence(coherence)
            object.__setattr__(self, "coherence", frozen(np.clip(coherence, 0.0, 1.0), np.float64))
        self._refuse_gaps()

    def _refuse_coherence(self, coherence: NDArray[np.float64]) -> None:
        bad = ~((coherence >= -ROUNDED) & (coherence <= 1 + ROUNDED))
        if not bad.any():
            return
        line, out, inp = (int(i[0]) for i in np.nonzero(bad))
        value, pair = float(coherence[line, out, inp]), f"{self.outputs[out].text} / {self.inputs[inp].text}"
        where = f"at {self.freq[line]:.6g} Hz ({int(bad.sum())} such values)"
        told = f"is not a number {where}; leave the line or the coherence out"
        if np.isfinite(value):
            told = (
                f"is {value:.6g} {where}, and one is between 0 and 1; export it as a share, not in per cent or dB, or "
                "leave it out"
            )
        raise RecordingError(
            f"recording {self.name!r}: the coherence of {pair} {told}", recording=self.name, channel=pair
        )

    def _refuse_gaps(self) -> None:
        bad = ~np.isfinite(self.H)
        if bad.any():
            line, out, inp = (int(i[0]) for i in np.nonzero(bad))
            pair = f"{self.outputs[out].text} / {self.inputs[inp].text}"
            raise RecordingError(
                f"recording {self.name!r}: the FRF {pair} is not a number at {self.freq[line]:.6g} Hz "
                f"({int(bad.sum())} such lines); leave the FRF or the line out",
                recording=self.name,
                channel=pair,
            )

    @property
    def n_freq(self) -> int:
        """Number of frequency lines."""
        return int(self.freq.size)

    @property
    def output_dofs(self) -> tuple[Dof | None, ...]:
        """DOFs of the outputs."""
        return tuple(c.dof for c in self.outputs)

    @property
    def input_dofs(self) -> tuple[Dof | None, ...]:
        """DOFs of the inputs."""
        return tuple(c.dof for c in self.inputs)

    def band(self, low: float, high: float) -> FRF:
        """The lines with low <= f <= high in Hz; raises RecordingError where none lies there."""
        keep = within_band(self.freq, (low, high))
        coherence = None if self.coherence is None else self.coherence[keep]
        return FRF(self.name, self.freq[keep], self.H[keep], self.outputs, self.inputs, self.kind, self.unit, coherence)

    def select(self, outputs: Sequence[int] | None = None, inputs: Sequence[int] | None = None) -> FRF:
        """The FRFs of some outputs and inputs, by position."""
        rows = list(range(len(self.outputs))) if outputs is None else list(outputs)
        columns = list(range(len(self.inputs))) if inputs is None else list(inputs)
        grid = np.ix_(range(self.n_freq), rows, columns)
        return FRF(
            self.name,
            self.freq,
            self.H[grid],
            tuple(self.outputs[i] for i in rows),
            tuple(self.inputs[i] for i in columns),
            self.kind,
            self.unit,
            None if self.coherence is None else self.coherence[grid],
        )

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON, without the arrays."""
        return {
            "name": self.name,
            "kind": self.kind,
            "unit": self.unit,
            "n_freq": self.n_freq,
            "band": [float(self.freq[0]), float(self.freq[-1])],
            "outputs": [c.to_dict() for c in self.outputs],
            "inputs": [c.to_dict() for c in self.inputs],
        }

    def __repr__(self) -> str:
        return (
            f"FRF({self.name!r}: {self.kind} [{self.unit}], {len(self.outputs)} outputs, {len(self.inputs)} inputs, "
            f"{self.n_freq} lines {self.freq[0]:.6g} to {self.freq[-1]:.6g} Hz)"
        )
