"""Frequency response functions as weighted lines: every input is one record with a force of one on every line."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from femend.data import FRF
from femend.errors import RecordingError

__all__ = ["COHERENT", "FrfLines", "coherent_band", "frf_lines_of", "useful_band"]

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

# powers of i omega that turn a kind into accelerance
ORDER = {"accelerance": 0, "mobility": 1, "receptance": 2}
# lines in a stretch of the noise estimate: two shared and three own unknowns a response are fitted to it
STRETCH = 16
# running mean, in lines, and power over noise, by which lines are told useful
REACH, USEFUL = 31, 10.0
# product of the power over noise of two lines side by side that are a resonance: where the power of the noise is
# estimated at half of what it is, chance makes it in one pair of ten million, at a quarter in one of sixteen hundred
PEAK = 300.0
# coherence of the better half of the responses, as a running median, below which the force explains less than half
COHERENT = 0.5
# what a window takes off or adds to a resonance, as a share of the second difference of its lines: the bins of a Hann
# window hold 1/6, 2/3 and 1/6 of the power of three lines, and H1 of noise is off by 0.8 to 1.4 times as much
BROADENED = 0.2
# the same, as a share of what the coherence says of one average, beyond which there is none: what leaks in and out of a
# window is not coherent, so that a fifth to a third of it was measured where it leaks, five times it of a multisine
LEAKS = 0.5
# share of an FRF that a model is not asked to explain (formulation, mesh, idealised joints), as of time records; more
# where no coherence tells what windows and averages made of it
MODEL_ALLOWANCE, UNKNOWN_WINDOW = 0.01, 0.03
# largest departure from an even axis, in steps
EVEN = 0.01


@dataclass(frozen=True, eq=False)
class FrfLines:
    """One column of an FRF: accelerance `H` (K, n_out) to a unit force at `freq` (K,) Hz, all above 0, with the
    standard deviation `noise` (K, n_out) of every value; `step` of an even axis in Hz, 0 for another; `allowance` is
    the share of H that a model is not asked to explain."""

    freq: FloatArray
    H: ComplexArray
    noise: FloatArray
    step: float
    allowance: float = UNKNOWN_WINDOW


def frf_lines_of(data: FRF, column: int) -> FrfLines:
    """The lines above 0 Hz of input `column`, as accelerances.

    Raises RecordingError where fewer lines than a stretch of the noise estimate are left.
    """
    keep = data.freq > 0
    freq = data.freq[keep]
    if len(freq) < STRETCH:
        raise RecordingError(
            f"recording {data.name!r} has {len(freq)} frequency lines above 0 Hz; the fit needs at least "
            f"{STRETCH}: take finer lines, or more of them",
            recording=data.name,
        )
    H = data.H[keep, :, column] * ((2j * np.pi * freq) ** ORDER[data.kind])[:, None]
    coherence = None if data.coherence is None else data.coherence[keep, :, column]
    step = float((freq[-1] - freq[0]) / (len(freq) - 1))
    at = freq / step
    even = bool(np.abs(at - np.rint(at[0]) - np.arange(len(at))).max() < EVEN)
    noise = _noise(freq, H, coherence)
    if coherence is None:
        return FrfLines(freq, H, noise, step if even else 0.0)
    if even:
        noise = np.hypot(noise, _leaked(H, coherence, noise))
    return FrfLines(freq, H, noise, step if even else 0.0, MODEL_ALLOWANCE)


def _leaked(H: ComplexArray, coherence: FloatArray, noise: FloatArray) -> FloatArray:
    """What the averages' window may have made of resonances that are no wider than a few lines (K, n_out): it smooths H
    over neighbouring lines, which no number of averages takes away (Bendat and Piersol, Random Data, 4th ed., 8.5.1).

    Nothing where the coherence is too high for that, as of periodic forces and of motion that has died away. Without
    one nothing tells: a smoothed resonance is nearly one of more damping.
    """
    bend = np.zeros(H.shape)
    bend[1:-1] = np.abs(H[2:] - 2 * H[1:-1] + H[:-2])
    bend[[0, -1]] = bend[[1, -2]]
    # second differences of noise alone have six times its power, three times as much by chance on one line in twenty
    leaked = BROADENED * np.sqrt(np.maximum(bend**2 - 18 * noise**2, 0.0))
    return np.where(leaked < LEAKS * _of_one_average(H, coherence), leaked, 0.0)


def _of_one_average(H: ComplexArray, coherence: FloatArray) -> FloatArray:
    """Standard deviation (K, n_out) of an FRF from one average, as the coherence g^2 tells it: |H| sqrt((1 - g^2)/g^2)
    (Bendat and Piersol, Random Data, 4th ed., ch. 9)."""
    g2 = np.clip(coherence, 1e-6, 1 - 1e-9)
    return np.asarray(np.abs(H) * np.sqrt((1 - g2) / g2))


def _noise(freq: FloatArray, H: ComplexArray, coherence: FloatArray | None) -> FloatArray:
    """Standard deviation (K, n_out) of every value.

    Over short stretches all responses share the poles: H (1 + a1 d + a2 d^2) = b0 + b1 d + b2 d^2 (local rational
    method, McKelvey and Guerin, SYSID 2012); what that leaves is noise. A coherence says how the noise goes from line
    to line (`_of_one_average`), and what is left how large it is, since the number of averages is not in the file.
    """
    K, n_out = H.shape
    middles, power = [], []
    for first in range(0, K - STRETCH + 1, STRETCH // 2):
        part = slice(first, first + STRETCH)
        middles.append(first + (STRETCH - 1) / 2)
        power.append(_left(freq[part], H[part]))
    found = np.array(power)
    if len(found) >= 3:  # a stretch that happens to fit is no stretch without noise
        padded = np.pad(found, ((1, 1), (0, 0)), "edge")
        found = np.median(np.stack([padded[:-2], padded[1:-1], padded[2:]]), axis=0)
    at = np.arange(K)
    sd = np.sqrt(np.column_stack([np.interp(at, middles, found[:, o]) for o in range(n_out)]))
    if coherence is not None:
        shape = _of_one_average(H, coherence)
        sd = shape * (np.median(sd, axis=0) / np.maximum(np.median(shape, axis=0), 1e-300))
    return np.asarray(np.maximum(sd, 1e-6 * np.sqrt((np.abs(H) ** 2).mean(axis=0))))


def _left(freq: FloatArray, H: ComplexArray) -> FloatArray:
    """Power (n_out,) a line that a local rational model with common poles leaves."""
    n, n_out = H.shape
    d = 2 * (freq - freq.mean()) / (freq[-1] - freq[0])
    powers = np.column_stack([np.ones(n), d, d**2])
    size = np.maximum(np.sqrt((np.abs(H) ** 2).mean(axis=0)), 1e-300)
    G = H / size
    # the numerators, three unknowns a response, take what lies in the powers; the shared two are left
    Q = np.linalg.qr(powers)[0]
    columns = np.stack([G, *(-G * power[:, None] for power in powers.T[1:])])
    columns = columns - Q @ (Q.T @ columns)
    beside = columns[1:].reshape(2, -1)
    a = np.linalg.lstsq(beside.T, columns[0].ravel(), rcond=None)[0]
    left = columns[0] - (a @ beside).reshape(n, n_out)
    # noise enters the equation times the denominator; dividing each line by it would blow up where it is small
    left /= np.sqrt((np.abs(1 + powers[:, 1:] @ a) ** 2).mean())
    freedom = n - 3 - 2 / n_out
    return np.asarray((np.abs(left) ** 2).sum(axis=0) / freedom * size**2)


def useful_band(lines: FrfLines) -> tuple[float, float]:
    """First and last line (Hz) around which the responses stand clear of their noise; all lines where none do.

    A narrow resonance among lines that do not, as the first of a lightly damped structure, counts with its flanks: two
    lines side by side that stand clear are no noise.
    """
    width = min(REACH, len(lines.freq) // 2 * 2 - 1)
    ratio = (np.abs(lines.H) ** 2 / lines.noise**2).mean(axis=1)
    clear = np.log10(np.maximum(ratio, 1e-6))
    smooth = np.convolve(np.pad(clear, width // 2, "edge"), np.ones(width) / width, "valid")
    peaks = np.flatnonzero(
        (np.minimum(clear[:-1], clear[1:]) > np.log10(USEFUL)) & (clear[:-1] + clear[1:] > np.log10(PEAK))
    )
    flanks = np.clip(np.concatenate([peaks - STRETCH // 2, peaks + 1 + STRETCH // 2]), 0, len(clear) - 1)
    good = np.union1d(np.flatnonzero(smooth > np.log10(USEFUL)), flanks)
    if good.size < 2:
        return float(lines.freq[0]), float(lines.freq[-1])
    return float(lines.freq[good[0]]), float(lines.freq[good[-1]])


def coherent_band(freq: FloatArray, coherence: FloatArray) -> tuple[float, float] | None:
    """First and last of the lines `freq` (n_freq,) in Hz around which the better half of the responses has a coherence
    of a half or more; None where no stretch has, and nothing can be told from `coherence` (n_freq, n_out).

    A running median passes over antiresonances, and over single lines that are coherent by chance.
    """
    from scipy.ndimage import median_filter

    n_out = coherence.shape[1]
    better = np.sort(np.nan_to_num(coherence), axis=1)[:, n_out // 2 :].mean(axis=1)
    smooth = median_filter(better, min(REACH, len(freq) // 2 * 2 - 1), mode="nearest")
    good = np.flatnonzero(smooth >= COHERENT)
    return (float(freq[good[0]]), float(freq[good[-1]])) if good.size > 1 else None
