"""Noise of recorded responses: what does not follow the force, does not repeat, or is there without a force."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from femend.estimate.noise_alone import noise_beside_others
from femend.estimate.stretches import FIRST_LINE, left_over, of_quieter, width_of

__all__ = ["BLOCKS", "SILENT", "fewest_samples", "noise_in_silence", "noise_of"]

FloatArray = NDArray[np.float64]

# a repeating record's spectrum is also judged by its stretches where it has more lines than this
ENOUGH_LINES = 300
# a force is silent in a block, one of so many of a record, that holds no more than this share of its peak
BLOCKS, SILENT = 40, 0.02
# the fewest blocks that tell the noise together, by how many of its standard errors the noise of one may be above the
# quietest's, and the share of a block's samples that have to differ from the one before: what does not is filled in
FEWEST, ABOVE, ALIVE = 4, 4.0, 0.5


def fewest_samples(n_in: int) -> int:
    """Samples of a record with `n_in` forces of which `noise_of` can tell anything: one stretch of its spectrum."""
    return 2 * (width_of(n_in) + FIRST_LINE)


def noise_of(u: FloatArray, y: FloatArray, period: int) -> FloatArray:
    """Noise standard deviation (n_out,) of responses y (n_out, n) to forces u (n_in, n).

    Over short stretches of the spectrum response and transient are smooth multiples of the force and of one (local
    polynomial method, Pintelon and Schoukens, System Identification, 2nd ed., ch. 7); what they leave is noise and
    distortion, and since noise is white and distortion is not, the quieter stretches tell the noise. Repeating records
    also tell it by the difference of their last two periods, in which free decays may still show: the smaller holds.
    Without a recorded force (`u` (0, n)) one response stands for it, and the quietest stretches of the spectrum tell it
    as well, as far as it is white (`noise_alone`).
    """
    n = y.shape[1]
    U, Y = np.fft.rfft(u, axis=1), np.fft.rfft(y, axis=1)
    found = np.full(len(y), np.inf)
    repeats = bool(period) and n >= 2 * period
    if repeats:
        last, before = y[:, n - period :], y[:, n - 2 * period : n - period]
        found = (last - before).std(axis=1) / np.sqrt(2)
    if len(u) == 0:
        found = np.sqrt(noise_beside_others(Y, n * found**2) / n)
    elif not repeats or U.shape[1] > ENOUGH_LINES:
        found = np.minimum(found, np.sqrt(of_quieter(left_over(U, Y)) / n))
    silence = noise_in_silence(u, y)
    if silence is not None:
        found = np.minimum(found, silence)
    return np.asarray(np.maximum(found, 1e-6 * y.std(axis=1)))


def noise_in_silence(u: FloatArray, y: FloatArray) -> FloatArray | None:
    """Noise standard deviation (n_out,) of responses y (n_out, n) where the forces u (n_in, n) are silent and the
    structure is at rest: before a blow, or long after it; None where they are not for long enough.

    Distortion by a nonlinear structure, which a spectrum tells from noise by its unevenness alone, is none of it.
    """
    length = y.shape[1] // BLOCKS
    peak = float(np.abs(u).max(initial=0.0))
    if peak == 0.0 or length < 8:
        return None
    force = np.abs(u[:, : BLOCKS * length]).max(axis=0).reshape(BLOCKS, length)
    blocks = y[:, : BLOCKS * length].reshape(len(y), BLOCKS, length)
    alive = (np.diff(blocks, axis=2) != 0).mean(axis=2) > ALIVE
    usable = alive & (force.max(axis=1) < SILENT * peak)
    variance = np.where(usable, blocks.var(axis=2, ddof=1), np.inf)
    quietest = variance.min(axis=1, keepdims=True)
    near = usable & (variance <= quietest * (1 + ABOVE / np.sqrt(2 * length)) ** 2)
    if near.sum(axis=1).min() < FEWEST:
        return None
    return np.asarray(np.sqrt(np.where(near, variance, 0.0).sum(axis=1) / near.sum(axis=1)))
