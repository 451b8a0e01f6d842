"""A time axis that was mistaken, told by shapes where no force was measured.

Read at the wrong rate, all frequencies of a recording are off by one factor. Its principal responses are then far
likelier with the shapes that the model has at other frequencies: they are held against the covariances of
`exchanged` at the frequencies of the recording times one factor after the other.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from femend.correlate.exchanged import FEWEST, Shapes, clear_lines, held_against, inverse_covariances
from femend.correlate.misread import driven_covariances
from femend.correlate.mistaken_units import mistaken_as

__all__ = ["FACTORS", "KNOWN_RATES", "known_rate", "line_gains", "thinned", "time_factor"]

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

# factors that are tried on the frequencies, in steps of less than what the model's own are known to
FACTORS = np.exp(0.08 * np.arange(-96, 97))
# a model may be off by this factor, or by its inverse
LEAST = 1.5
# gain in mean log-likelihood from which the axis is mistaken, with all modes driven alike and with each as it seems to
# be: of 263 generated recordings as they are (tests/blind/ambient_cases.py, seeds up to 82) two come above 0.2 with the
# first alone, 3.0 and 5.4, driven at a single DOF, none of 200 with both
TELLING = 1.5
# lines and sensors, the liveliest ones of the model, that are enough to tell
LINES, SENSORS = 100, 24
# what a time axis is mistaken by, and how near a factor has to come to one of them
KNOWN_RATES = (
    (1000.0, "milliseconds and seconds"),
    (60.0, "minutes and seconds"),
    (2 * np.pi, "rad/s and Hz"),
    (2.0, "every second sample, or twice the rate"),
)
_NEAR = 1.2


def time_factor(h: ComplexArray, noise: FloatArray, freq: FloatArray, model: Shapes) -> float | None:
    """The factor on the frequencies `freq` (n_freq,) in Hz of responses h (n_freq, n_out), with what else they show,
    `noise`, that makes them the model's: that of `KNOWN_RATES` where one is near. None where 1 does, and for fewer than
    three sensors or 12 lines.

    Lines that a factor puts above the modes known count as shapes that nothing is known of.
    """
    lines = clear_lines(h, noise)
    if h.shape[1] < 3 or lines.size < FEWEST:
        return None
    h, noise, freq, model = thinned(h, noise, freq, model, lines)
    gains = np.array([_likelier(h, noise, freq * factor, model) for factor in FACTORS])
    as_it_is = np.abs(np.log(FACTORS)) < np.log(LEAST)
    factor = float(FACTORS[np.argmax(gains)])
    if gains.max() < gains[as_it_is].max() + TELLING:
        return None
    # what drives a single mode more than others may be why, too
    other = _likelier(h, noise, freq * factor, model, driven=True)
    if any(_likelier(h, noise, freq * f, model, driven=True) > other - TELLING for f in FACTORS[as_it_is]):
        return None
    rate = known_rate(factor)
    return factor if rate is None else rate


def thinned(
    h: ComplexArray, noise: FloatArray, freq: FloatArray, model: Shapes, lines: NDArray[np.int64]
) -> tuple[ComplexArray, FloatArray, FloatArray, Shapes]:
    """Of responses h (n_freq, n_out), their `noise`, `freq` (n_freq,) and `model` as many of the `lines`, and of the
    sensors the liveliest ones, as are enough to tell frequencies."""
    lines = lines[:: -(-lines.size // LINES)]
    rows = np.sort(np.argsort(-(model.out**2).sum(axis=1))[:SENSORS])
    return h[lines][:, rows], noise[lines][:, rows], freq[lines], replace(model, out=model.out[rows])


def known_rate(factor: float) -> float | None:
    """The factor of a time axis, one of `KNOWN_RATES` or the inverse of one, that comes near to `factor`."""
    rate = mistaken_as(factor, _NEAR, KNOWN_RATES)
    if rate is None:
        return None
    return rate[0] if factor > 1 else 1 / rate[0]


def _likelier(h: ComplexArray, noise: FloatArray, freq: FloatArray, model: Shapes, driven: bool = False) -> float:
    """How much likelier (mean log-likelihood) responses are with the model's shapes at `freq` than with any shapes;
    `driven` with modes driven as the responses ask for, not all alike."""
    return float(line_gains(h, noise, freq, model, driven).mean())


def line_gains(h: ComplexArray, noise: FloatArray, freq: FloatArray, model: Shapes, driven: bool = False) -> FloatArray:
    """By how much every line of responses h (n_freq, n_out), with what else they show, `noise`, is likelier with the
    model's shapes at `freq` (n_freq,) in Hz than with any shapes, as log-likelihood (n_freq,); 0 above the modes known.

    Modes are driven alike, or, `driven`, as the responses ask for; how a force drives them is for `model.out` to hold.
    """
    gains, known = np.zeros(len(freq)), freq < model.freq[-1]
    if not known.any():
        return gains
    h, noise = h[known], noise[known]
    covariances = driven_covariances if driven else inverse_covariances
    inverse = covariances(h, noise, model.out, model.powers(freq[known]))
    own, n_out = held_against(h, inverse)[1], h.shape[1]
    any_shape = n_out * np.log((np.abs(h) ** 2).sum(axis=1))
    gains[known] = np.linalg.slogdet(inverse)[1] - n_out * np.log(own) + any_shape
    return gains
