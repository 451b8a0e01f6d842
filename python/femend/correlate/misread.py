"""Sensors upside down or in other units where no force was measured, told by the shapes between the sensors.

Without a force responses have no level of their own, but between the sensors a structure moves as its modes do. The
principal responses of all sensors are held against the covariance that the modes of a model give them (`exchanged`,
with the angular central Gaussian distribution there); a factor on one sensor that makes them clearly likelier is what
that sensor was misread by.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from femend.correlate.exchanged import FEWEST, Shapes, clear_lines, held_against, inverse_covariances, rescaled

__all__ = ["Misread", "driven_covariances", "misread"]

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

# factors that are tried on a sensor, of either sign: ten a decade
FACTORS = 10.0 ** np.arange(-4.0, 4.05, 0.1)
_SIGNED = np.concatenate([FACTORS, -FACTORS])
# steps by which the modes' forces follow the responses
STEPS = 5
# gain in mean log-likelihood from which a sensor is reversed, and from which it is in other units: a direction that is
# hardly driven looks like the latter. Settled on generated recordings driven at all nodes and at one to three
# (tests/blind/ambient_cases.py, seeds 61 to 72), of which as they are none comes above 3.4 and 6.0
REVERSED, RESCALED = 4.0, 6.5
# a sensor of the right sign is told where it is off by this factor
LEAST = 3.0
# a sensor that the model moves by less than this share of the one it moves most is not judged: a support may be there
# that gives way
MOVES = 0.1


@dataclass(frozen=True, slots=True)
class Misread:
    """A sensor, by number, that shows `factor` times what the others do, each against the model; `left` is the share of
    what contradicts the shapes of the model that is left with the factor taken out (geometric mean over lines)."""

    sensor: int
    factor: float
    left: float


def misread(h: ComplexArray, noise: FloatArray, freq: FloatArray, model: Shapes) -> list[Misread]:
    """Sensors that are misread in responses h (n_freq, n_out) with what else they show, `noise`, on lines `freq` (Hz).

    The modes of `model` are driven as its `into` (1, n_modes) says, and a little more or less where the responses ask
    for it. At most every third sensor is told, nothing of fewer than three sensors or 12 lines.
    """
    n_out, lines = h.shape[1], clear_lines(h, noise)
    if n_out < 3 or lines.size < FEWEST:
        return []
    h, noise = h[lines], noise[lines]
    power = model.powers(freq[lines]) * model.into[0] ** 2
    size = np.sqrt((power @ (model.out**2).T).mean(axis=0))
    still = size < MOVES * size.max()
    found: list[Misread] = []
    while len(found) < max(1, n_out // 3):
        gains = _gains(h, noise, model.out, power)
        gains[:, [*np.flatnonzero(still), *(one.sensor for one in found)]] = 0.0
        k, i = (int(n) for n in np.unravel_index(np.argmax(gains), gains.shape))
        # the factor was put on to set the sensor right: it shows the inverse
        put = float(_SIGNED[k])
        if gains[k, i] < (REVERSED if put < 0 else RESCALED) or 1 / LEAST < put < LEAST:
            break
        found.append(Misread(i, 1 / put, float(np.exp(-gains[k, i] / n_out))))
        h, noise = _with(put, i, h, noise)
    return found


def _gains(h: ComplexArray, noise: FloatArray, out: FloatArray, power: FloatArray) -> FloatArray:
    """Gain (2 n_factors, n_out) in mean log-likelihood with a sensor times one of the factors, or its negative; the
    density of what was recorded has the square of the factor as its Jacobian."""
    inverse = driven_covariances(h, noise, out, power)
    gains = rescaled(h, inverse, _SIGNED) + 2 * np.log(np.abs(_SIGNED))[:, None]
    # how modes are driven was settled with the sensor as it was, which may hide what is wrong with it
    before, minus = _likelihood(h, inverse), int(np.argmin(np.abs(_SIGNED + 1)))
    for i in range(h.shape[1]):
        for k in {minus, int(np.argmax(gains[:, i]))}:
            put = _SIGNED[k]
            as_put, beside = _with(put, i, h, noise)
            after = _likelihood(as_put, driven_covariances(as_put, beside, out, power)) + 2 * np.log(abs(put))
            gains[k, i] = max(gains[k, i], after - before)
    return gains


def _with(put: float, i: int, h: ComplexArray, noise: FloatArray) -> tuple[ComplexArray, FloatArray]:
    """Responses and noise (n_lines, n_out) with the factor `put` on sensor `i`."""
    factor = np.ones(h.shape[1])
    factor[i] = put
    return h * factor, noise * np.abs(factor)


def _likelihood(h: ComplexArray, inverse: FloatArray) -> float:
    """Mean log-likelihood of responses h (n_lines, n) with inverse covariances (n_lines, n, n)."""
    own = held_against(h, inverse)[1]
    return float(np.mean(np.linalg.slogdet(inverse)[1] - inverse.shape[1] * np.log(own)))


def driven_covariances(h: ComplexArray, noise: FloatArray, out: FloatArray, power: FloatArray) -> FloatArray:
    """Inverse covariances (n_lines, n_out, n_out) with modes of shapes `out` (n_out, n_modes) driven as the responses h
    (n_lines, n_out), beside `noise`, ask for: a few steps of expectation and maximisation from where they are driven as
    `power` (n_lines, n_modes) says. More would take any sensor's word for what drives its direction."""
    level, n_out = np.mean(np.abs(h) ** 2, axis=1), h.shape[1]
    for _ in range(STEPS):
        inverse = inverse_covariances(h, noise, out, power)
        share = power * (level / np.maximum(power @ (out**2).mean(axis=0), np.finfo(float).tiny))[:, None]
        v, own = held_against(h, inverse)
        found = np.einsum("fm,fm->m", share * (n_out / own)[:, None], np.abs(v @ out) ** 2)
        expected = np.einsum("fm,fm->m", share, np.einsum("om,fop,pm->fm", out, inverse, out))
        power = power * np.sqrt(found / np.maximum(expected, np.finfo(float).tiny))
    return inverse_covariances(h, noise, out, power)
