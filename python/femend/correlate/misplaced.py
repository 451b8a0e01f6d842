"""Sensors that stand elsewhere than they are said to, told by shapes.

What a sensor shows follows from the others by the covariance that modes of the model give them (see `exchanged`), and
for another place that covariance is another one. With the responses h_o of the other sensors and their covariance C,
that of a place's response with theirs, c, and its own variance s, the place's response has the mean c C^-1 h_o and the
variance s - c C^-1 c; the level of all responses is not known. The gain in mean log-likelihood over all lines with
which one place explains a sensor better than its own says whether it stands there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from femend.correlate.exchanged import (
    MISTAKEN,
    ForceLines,
    Shapes,
    at_level,
    inverse_covariances,
    lines_of,
    rescaled,
)

__all__ = ["Misplaced", "misplaced"]

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

# gain in mean log-likelihood from which a sensor stands elsewhere: of 33 generated cases as they are none comes above
# 1.44, and of 75 with a sensor said to be at a random node every one above 1.5 is of that sensor
# (tests/blind/mistaken_channels.py)
TELLING = 3.0
# share of that gain from which a sensor whose level is off is in other units, and stands where it is: near a clamp all
# is small
OTHERWISE = 0.5
# lines that count at most
MOST = 100


@dataclass(frozen=True, slots=True)
class Misplaced:
    """Sensor number `sensor`, which shows what the model does at the place of number `place`; the `gain` in mean
    log-likelihood by that, and the share of what contradicts the shapes of the model that is `left` with it."""

    sensor: int
    place: int
    gain: float
    left: float


def misplaced(
    H: ComplexArray,
    noise: FloatArray,
    freq: FloatArray,
    model: Shapes,
    places: FloatArray,
    allowed: NDArray[np.bool_],
    scaled: Sequence[int] = (),
) -> list[Misplaced]:
    """Sensors that look as if they stood at one of the `places`, shapes (n_places, n_modes) of the model, of those
    `allowed` (n_out, n_places) for each; every third at most, the clearest first.

    H (n_freq, n_out, n_in) are measured accelerances with deviations `noise` on lines `freq` (Hz). A sensor that is
    better explained upside down or in other units stands where it is, and so does one of those `scaled`, whose level is
    off, that is explained nearly as well so. Nothing is told of fewer than four sensors: what three show hardly says
    where a fourth is.
    """
    every = [lines_of(H[:, :, j], noise[:, :, j], freq, model, j, MOST) for j in range(H.shape[2])]
    parts, out, n_out = [one for one in every if one is not None], np.array(model.out), H.shape[1]
    found: list[Misplaced] = []
    while n_out > 3 and len(places) and parts and len(found) < max(1, n_out // 3):
        gains = np.where(allowed, np.mean([_gains(one, out, places) for one in parts], axis=0), -np.inf)
        gains[[one.sensor for one in found]] = -np.inf
        i, j = (int(k) for k in np.unravel_index(np.argmax(gains), gains.shape))
        best = float(gains[i, j])
        if best < TELLING or _otherwise_mistaken(parts, out, i) > (OTHERWISE if i in scaled else 1.0) * best:
            break
        found.append(Misplaced(i, j, best, float(np.exp(-best / n_out))))
        out[i] = places[j]
    return found


def _gains(lines: ForceLines, out: FloatArray, places: FloatArray) -> FloatArray:
    """Gain (n_out, n_places) in mean log-likelihood with a sensor at each of the places in place of its own."""
    h, n_out = lines.h, len(out)
    power, floor = at_level(h, lines.noise, out, lines.power)
    gains = np.zeros((n_out, len(places)))
    for i in range(n_out):
        others = [k for k in range(n_out) if k != i]
        at = np.vstack([out[[i]], places])
        like = _likelihoods(h[:, i], h[:, others], out[others], at, power, floor)
        gains[i] = (like[1:] - like[0]).mean(axis=1)
    return gains


def _likelihoods(
    h: ComplexArray, h_others: ComplexArray, others: FloatArray, at: FloatArray, power: FloatArray, floor: FloatArray
) -> FloatArray:
    """Log-likelihood (n_at, n_lines), but for what all places have, of responses h (n_lines,) at places of shapes `at`
    (n_at, n_modes) beside those of `others` (n_lines, n_others), of shapes (n_others, n_modes)."""
    n = len(others)
    C = np.einsum("om,fm,pm->fop", others, power, others) + floor[:, None, None] * np.eye(n)
    inverse = np.linalg.inv(C)
    v = np.einsum("fop,fp->fo", inverse, h_others)
    squares = np.einsum("fo,fo->f", h_others.conj(), v).real
    c = np.einsum("am,fmo->afo", at, np.einsum("fm,om->fmo", power, others))
    w = np.einsum("afo,fop->afp", c, inverse)
    s = np.einsum("am,fm,am->af", at, power, at) + floor - np.einsum("afo,afo->af", w, c)
    left = np.abs(h - np.einsum("afo,fo->af", c, v)) ** 2
    return np.asarray(-np.log(s) - (n + 1) * np.log(squares + left / s))


def _otherwise_mistaken(parts: Sequence[ForceLines], out: FloatArray, i: int) -> float:
    """The gain with sensor i where it is, but upside down or in other units."""
    gains = [rescaled(one.h, inverse_covariances(one.h, one.noise, out, one.power), MISTAKEN)[:, i] for one in parts]
    return float(np.mean(gains, axis=0).max())
