"""Resonances that are all off by one factor, told by shapes where the force was measured.

A digit too many in a modulus, a thickness in other units or a time axis at the wrong rate put all resonances elsewhere,
and leave their shapes. Responses to a measured force are held against the covariances of `exchanged`, as those of
`time_axis` are, at their frequencies times one factor after the other: with the modes driven as the force drives them,
and with all alike, since the force may be said to act where it does not. Both have to tell the factor, and so have
several modes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from femend.correlate.exchanged import FEWEST, Shapes, clear_lines
from femend.correlate.time_axis import FACTORS, line_gains, thinned

__all__ = ["TELLING", "Lines", "Off", "clear_lines_of", "common_factor", "explained"]

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

# a model may be off by this factor, or by its inverse: something that is missing shifts resonances by as much
LEAST = 1.7
NEAR = np.abs(np.log(FACTORS)) < np.log(LEAST)
# gain in mean log-likelihood from which resonances are elsewhere: of the 12 cases c01 to c13 that have forces, 24
# generated ones and 22 of a user's, none as it is comes above 0
TELLING = 1.5
# modes that have to tell it: one may look like any other that moves the sensors alike
SEVERAL = 2


@dataclass(frozen=True, eq=False)
class Lines:
    """Responses h (n_lines, n_out) to one force, with deviations `noise`, on lines `freq` (n_lines,) in Hz that stand
    clear of it; `alike` are the modes of the model, all driven alike, `driven` the same as the force drives them."""

    h: ComplexArray
    noise: FloatArray
    freq: FloatArray
    alike: Shapes
    driven: Shapes

    @cached_property
    def near(self) -> FloatArray:
        """Gains (n_near, 2, n_lines) with the frequencies times factors that a model may be off by, as `gains`."""
        return self._gains(FACTORS[NEAR])

    @cached_property
    def gains(self) -> FloatArray:
        """Gains (n_factors, 2, n_lines) in log-likelihood with the frequencies times each of `FACTORS`, modes driven as
        by the force and alike."""
        gains = np.empty((len(FACTORS), *self.near.shape[1:]))
        gains[NEAR], gains[~NEAR] = self.near, self._gains(FACTORS[~NEAR])
        return gains

    def _gains(self, factors: FloatArray) -> FloatArray:
        both = (self.driven, self.alike)
        return np.array([[line_gains(self.h, self.noise, self.freq * f, modes) for modes in both] for f in factors])

    def modes(self, factor: float) -> NDArray[np.int64]:
        """The mode (n_lines,) that has most of the response on every line, with the frequencies times a `factor`."""
        power = self.driven.powers(self.freq * factor) * (self.driven.out**2).sum(axis=0)
        return np.argmax(power, axis=1)


@dataclass(frozen=True, eq=False)
class Off:
    """Resonances that are elsewhere: the `factor` on their frequencies that makes them the model's, how many `modes`
    tell it, and the `gain` (2,) in mean log-likelihood, driven as by the force and alike."""

    factor: float
    modes: int
    gain: FloatArray


def clear_lines_of(H: ComplexArray, noise: FloatArray, freq: FloatArray, model: Shapes) -> list[Lines]:
    """What accelerances H (n_freq, n_out, n_in), with deviations `noise`, on lines `freq` (Hz) tell of frequencies, one
    item for every force; nothing of fewer than three sensors or 12 lines, nor of a force that drives no mode."""
    found = []
    for j, into in enumerate(model.into):
        h, own = H[:, :, j], noise[:, :, j]
        lines = clear_lines(h, own)
        if H.shape[1] < 3 or lines.size < FEWEST or not into.any() or not model.out.any():
            continue
        h, own, at, alike = thinned(h, own, freq, model, lines)
        found.append(Lines(h, own, at, alike, replace(alike, out=alike.out * np.abs(into))))
    return found


def common_factor(found: Sequence[Lines]) -> Off | None:
    """By which factor the frequencies of all lines `found` are off, with the modes that tell it; None where they are
    not, or where a factor below 1.7 would do."""
    if not found:
        return None
    gains = np.concatenate([one.gains for one in found], axis=2)
    mean = gains.mean(axis=2)
    k = int(np.argmax(mean[:, 0]))
    before = mean[NEAR].max(axis=0)
    if NEAR[k] or (mean[k] < before + TELLING).any():
        return None
    factor = float(FACTORS[k])
    best = int(np.flatnonzero(NEAR)[np.argmax(mean[NEAR, 0])])
    modes = _telling(np.concatenate([one.modes(factor) for one in found]), gains[k, 0] - gains[best, 0])
    return Off(factor, modes, mean[k] - before) if modes >= SEVERAL else None


def explained(found: Sequence[Lines]) -> FloatArray:
    """Mean gain (2,) in log-likelihood of all lines `found` with the model as it is, its frequencies off by up to 1.7,
    driven as by the force and alike."""
    return np.asarray(np.concatenate([one.near for one in found], axis=2).mean(axis=2).max(axis=0))


def _telling(modes: NDArray[np.int64], more: FloatArray) -> int:
    """How many of the `modes` that lines (n_lines,) belong to are likelier by `more` (n_lines,) in the mean."""
    return sum(float(more[modes == m].mean()) > TELLING for m in np.unique(modes))
