"""Noise of responses to one force that nobody recorded: what of each does not follow the others."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from femend.estimate.stretches import left_over, of_quieter, stretches_of

__all__ = ["noise_beside_others"]

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

# lines in a stretch whose power is compared, the share of the stretches that are taken for noise alone, and what these
# show of its power: the quantile they are would be 0.55 of it if all were, 0.75 if a fifth
STRETCH, QUIETEST, SHOWN = 15, 0.05, 0.65
# responses that the others are compared with, rounds in which the noise of all is told apart, and the fewest stretches
# that tell it
REFERENCES, ROUNDS, FEWEST = 12, 6, 10
# share of its own power that noise is taken for at least, while it is told apart
LEAST = 1e-12


def noise_beside_others(Y: ComplexArray, most: FloatArray) -> FloatArray:
    """Power (n_out,) of noise on a line of spectra Y (n_out, n_lines), `most` (n_out,) at most, which may be infinite.

    The quietest stretches of a spectrum hold no more than noise, unless the force has power everywhere. One force moves
    all sensors together, so that over a short stretch each is a smooth multiple of another, beside a transient (local
    polynomial method, Pintelon and Schoukens, System Identification, 2nd ed., ch. 7). What that leaves is the noise of
    both, the other's times the square of the multiple: each stretch is compared with the sensor whose noise shows least
    there, and the stretches count in which it shows least. Motion by a second force stays, but for quiet stretches.
    """
    most = np.minimum(most, _quietest(Y))
    stretches = stretches_of(1, Y.shape[1])
    if len(Y) < 2 or len(stretches) < FEWEST:
        return most
    told = np.argsort(-(np.abs(Y) ** 2).mean(axis=1) / np.maximum(most, 1e-300))[:REFERENCES]
    power = np.array([(np.abs(Y[:, part]) ** 2).mean(axis=1) for part in stretches])
    left = np.array([left_over(Y[j : j + 1], Y) for j in told])
    # square of the multiple; that of stretches in which both show noise alone is none
    square = np.maximum(power - left, 0.0) / np.maximum(power[:, told].T[:, :, None], 1e-300)
    least = np.maximum(LEAST * power.mean(axis=0), 1e-300)
    # to begin with, the same share of every sensor's motion
    noise = (np.abs(Y) ** 2).mean(axis=1)
    for _ in range(ROUNDS):
        # how many times its own noise a sensor shows of the other one's
        through = square * noise[told][:, None, None] / noise
        through[np.arange(len(told)), :, told] = np.inf
        best = np.argmin(through, axis=0)
        of_best, there = (np.take_along_axis(v, best[None], axis=0)[0] for v in (through, left))
        first = np.argsort(of_best, axis=0)[: -(-len(stretches) // 2)]
        alone = of_quieter(np.take_along_axis(there / (1.0 + of_best), first, axis=0))
        noise = np.maximum(np.minimum(alone, most), least)
    return np.minimum(noise, most)


def _quietest(Y: ComplexArray) -> FloatArray:
    """Power (n_out,) per line of white noise as the quietest stretches of the spectra show it."""
    whole = Y.shape[1] // STRETCH * STRETCH
    power = (np.abs(Y[:, :whole]) ** 2).reshape(len(Y), -1, STRETCH).mean(axis=2)
    return np.asarray(np.quantile(power, QUIETEST, axis=1) / SHOWN)
