"""What one unit of every load does at the sensors: measured FRFs of a test, or those of a model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from femend.data import FRF, ODS, Channel
from femend.data._arrays import frozen
from femend.data.frf import check_frequency_axis
from femend.errors import LoadError
from femend.units import parse_unit

__all__ = ["UnitResponses", "from_frf", "matched"]

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

QUANTITY = {"receptance": "displacement", "mobility": "velocity", "accelerance": "acceleration"}
POWER = {"displacement": 0, "velocity": 1, "acceleration": 2}
# lines belong together when they are no farther apart than this share of a step
SAME_LINE = 0.01


@dataclass(frozen=True, eq=False)
class UnitResponses:
    """`H` (n_freq, n_out, n_loads) at `freq` (n_freq,) in Hz: the response at `outputs` to one unit of each load.

    `names` and `units` (n_loads,) of the loads; `sd` (n_freq, n_out, n_loads) the standard deviation of the complex
    values, or None; `credible` (n_freq,) the lines on which H is to be believed (`credible_lines`), None for all.
    Raises LoadError for shapes that do not fit.
    """

    freq: FloatArray
    H: ComplexArray
    outputs: tuple[Channel, ...]
    names: tuple[str, ...]
    units: tuple[str, ...]
    sd: FloatArray | None = None
    credible: NDArray[np.bool_] | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "freq", frozen(self.freq, np.float64))
        object.__setattr__(self, "H", frozen(self.H, np.complex128))
        check_frequency_axis("unit responses", self.freq)
        shape = (self.freq.size, len(self.outputs), len(self.names))
        deviations = None if self.sd is None else self.sd.shape
        if self.credible is not None and self.credible.shape != self.freq.shape:
            raise LoadError(f"{self.credible.shape} credible lines beside {self.freq.size} lines; say it of every line")
        if self.H.shape != shape or len(self.units) != len(self.names) or deviations not in (None, shape):
            raise LoadError(
                f"unit responses of shape {self.H.shape} with deviations {deviations} and {len(self.units)} units: "
                f"they must be (n_freq, n_out, n_loads) = {shape} with a unit for every load"
            )

    @property
    def n_loads(self) -> int:
        """Number of loads."""
        return len(self.names)

    def where(self, credible: NDArray[np.bool_]) -> UnitResponses:
        """The same, to be believed on the lines `credible` (n_freq,) only."""
        return replace(self, credible=credible)

    def select(self, loads: Sequence[int]) -> UnitResponses:
        """Some of the `loads`, by position."""
        at = list(loads)
        return UnitResponses(
            self.freq,
            self.H[:, :, at],
            self.outputs,
            tuple(self.names[i] for i in at),
            tuple(self.units[i] for i in at),
            None if self.sd is None else self.sd[:, :, at],
            self.credible,
        )

    def sensors(self, rows: Sequence[int]) -> UnitResponses:
        """The responses at some outputs, by position in `rows`."""
        at = list(rows)
        sd = None if self.sd is None else self.sd[:, at]
        outputs = tuple(self.outputs[i] for i in at)
        return UnitResponses(self.freq, self.H[:, at], outputs, self.names, self.units, sd, self.credible)


def from_frf(frf: FRF, *, n_averages: float | None = None, variance: FloatArray | None = None) -> UnitResponses:
    """The measured `frf` as responses to unit forces at its inputs, with deviations where they are known.

    `variance` (n_freq, n_out, n_in) of the complex values is `FrfEstimate.variance`; without it the coherence of the
    FRF over `n_averages` gives E|dH|^2 = |H|^2 (1 - g^2) / (g^2 n) (Bendat and Piersol, Random Data, 4th ed., section
    9.2: twice the square of the random error of the gain). With neither the deviations stay unknown. Raises LoadError
    for a variance of another shape.
    """
    sd: FloatArray | None = None
    if variance is not None:
        if np.shape(variance) != frf.H.shape:
            raise LoadError(f"variance of shape {np.shape(variance)} does not fit the FRFs {frf.H.shape}")
        sd = np.sqrt(np.maximum(variance, 0.0))
    elif frf.coherence is not None and n_averages is not None:
        g2 = np.clip(frf.coherence, 1e-6, 1.0)
        sd = np.abs(frf.H) * np.sqrt((1 - g2) / (g2 * n_averages))
    unit = _response_unit(frf)
    outputs = tuple(Channel(c.dof, QUANTITY[frf.kind], unit, c.name, c.label) for c in frf.outputs)
    names = tuple(c.name or str(c.dof) for c in frf.inputs)
    return UnitResponses(frf.freq, frf.H, outputs, names, tuple(c.unit or "N" for c in frf.inputs), sd)


def _response_unit(frf: FRF) -> str:
    """Unit of the responses: what stands above the last bar of the FRF's unit."""
    top, bar, _ = frf.unit.rpartition("/")
    text = top.strip() if bar else frf.unit.strip()
    return text[1:-1] if text.startswith("(") and text.endswith(")") else text


def matched(given: UnitResponses, shapes: ODS) -> tuple[UnitResponses, tuple[int, ...], tuple[str, ...]]:
    """The unit responses on the lines and at the sensors of `shapes`, in the quantity and unit of every channel.

    Returns them, the rows of `shapes` they belong to, and the channels of `shapes` that have no counterpart in `given`.
    A sensor that stands the other way round changes sign; displacement, velocity and acceleration are brought to each
    other by i omega. Raises LoadError where a line has none within a hundredth of a step, where no sensor matches, and
    for a channel whose quantity is none of a motion.
    """
    lines = lines_of(given.freq, shapes.freq)
    known = {(c.dof.node, c.dof.component): i for i, c in enumerate(given.outputs) if c.dof is not None}
    rows, at, left_out = [], [], []
    for row, channel in enumerate(shapes.channels):
        key = None if channel.dof is None else (channel.dof.node, channel.dof.component)
        if key is None or key not in known:
            left_out.append(channel.text)
        else:
            rows.append(row)
            at.append(known[key])
    if not rows:
        raise LoadError(
            f"none of the {len(shapes.channels)} channels of {shapes.name!r} is an output of the FRFs (the first is "
            f"{shapes.channels[0].text}); give FRFs measured at the same DOFs",
            channel=shapes.channels[0].text,
        )
    factor = np.stack([_factor(given.outputs[i], shapes.channels[r], shapes.freq) for r, i in zip(rows, at)], axis=1)
    sd = None if given.sd is None else given.sd[lines][:, at] * np.abs(factor)[:, :, None]
    H = given.H[lines][:, at] * factor[:, :, None]
    channels = tuple(shapes.channels[r] for r in rows)
    credible = None if given.credible is None else given.credible[lines]
    found = UnitResponses(shapes.freq, H, channels, given.names, given.units, sd, credible)
    return found, tuple(rows), tuple(left_out)


def lines_of(there: FloatArray, wanted: FloatArray) -> NDArray[np.int64]:
    """Positions in `there` of the lines `wanted`."""
    at = (
        np.clip(np.searchsorted(there, wanted), 1, max(len(there) - 1, 1))
        if len(there) > 1
        else np.zeros(len(wanted), int)
    )
    if len(there) > 1:
        at = np.where(np.abs(there[at - 1] - wanted) < np.abs(there[at] - wanted), at - 1, at)
    step = float(np.diff(wanted).min()) if len(wanted) > 1 else 0.01 * float(wanted[0])
    apart = np.abs(there[at] - wanted)
    if (apart > SAME_LINE * step).any():
        k = int(np.argmax(apart > SAME_LINE * step))
        raise LoadError(
            f"the responses have a line at {wanted[k]:.6g} Hz, the FRFs' nearest is {there[at[k]]:.6g} Hz "
            f"({int((apart > SAME_LINE * step).sum())} of {len(wanted)} lines do not match); estimate both with the "
            "same resolution, or select the common lines",
            freq=float(wanted[k]),
        )
    return np.asarray(at, dtype=np.int64)


def _factor(have: Channel, want: Channel, freq: FloatArray) -> ComplexArray:
    """From the response of `have` to that of `want` (n_freq,): sign, derivative and unit."""
    for channel in (have, want):
        if channel.quantity not in POWER:
            raise LoadError(
                f"channel {channel.text} is neither displacement, velocity nor acceleration; leave it out",
                channel=channel.text,
            )
    sign = 1.0 if have.dof is None or want.dof is None else float(have.dof.sign * want.dof.sign)
    scale = 1.0 if have.unit == want.unit else parse_unit(have.unit).factor / parse_unit(want.unit).factor
    power = POWER[want.quantity] - POWER[have.quantity]
    if power == 0:
        return np.full(len(freq), sign * scale, dtype=np.complex128)
    if power < 0 and freq[0] <= 0:
        raise LoadError(f"channel {want.text}: the line at 0 Hz cannot be integrated; leave it out", freq=0.0)
    return np.asarray(sign * scale * (2j * np.pi * freq) ** power)
