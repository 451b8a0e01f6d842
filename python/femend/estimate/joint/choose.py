"""Which pairs of DOFs in which bands are worth fitting: what they tell of the unknowns, where the model is credible."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from femend.errors import LoadError
from femend.estimate.joint.frf_block import FrfBlock
from femend.estimate.joint.linearised import Linearised
from femend.estimate.joint.ods_block import OdsBlock
from femend.numerals import listed, plain

__all__ = ["DataChoice", "DataPart", "choose_data"]

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

# a band holds at least so many lines; modes closer than this share of their frequency share a band
FEWEST, CLOSE = 5, 0.05
# largest share of noise in a part; least likeness to the model, which may be off in frequency by up to SHIFT
NOISY, LIKE, SHIFT = 0.5, 0.5, 0.10
# share of the information of all credible parts at which choosing ends
ENOUGH = 0.99


@dataclass(frozen=True, slots=True)
class DataPart:
    """One pair of DOFs in one band: `pair` (output / input), `band` in Hz, `rows` its position (output, input).

    `information` in nats that the part has by itself (half the fall of ln det of the unknowns' covariance), `gain`
    what it added when it was chosen, or would add now; `noise` the share of noise, `likeness` (0 to 1) of measured and
    computed values over the band; `reason` why it is left out: "noise", "model", "adds nothing"; "" if it is used.
    """

    pair: str
    band: tuple[float, float]
    rows: tuple[int, int]
    information: float
    gain: float
    noise: float
    likeness: float
    reason: str

    @property
    def used(self) -> bool:
        """Whether the part is to be fitted."""
        return not self.reason


@dataclass(frozen=True, eq=False)
class DataChoice:
    """Every part with its fate, those used first in the order of choice; `mask` (K, n_out, n_in) of the values used,
    and their `information` in nats beside that of all `credible` parts together."""

    parts: tuple[DataPart, ...]
    mask: NDArray[np.bool_]
    information: float
    credible: float

    @property
    def left_out(self) -> tuple[DataPart, ...]:
        """Parts that are not used."""
        return tuple(part for part in self.parts if not part.used)

    def report(self) -> tuple[str, ...]:
        """What is left out, and why, in sentences: pairs by reason and band."""
        said = []
        words = {
            "noise": "noise",
            "model": "the model is not credible there",
            "adds nothing": "adds nothing to the others",
        }
        for reason, text in words.items():
            bands = sorted({part.band for part in self.left_out if part.reason == reason})
            for band in bands:
                pairs = [part.pair for part in self.left_out if part.reason == reason and part.band == band]
                said.append(f"{plain(band[0])} to {plain(band[1])} Hz: {listed(pairs, 6)} left out: {text}")
        return tuple(said)


def choose_data(
    block: FrfBlock | OdsBlock,
    p: FloatArray,
    outputs: Sequence[str],
    inputs: Sequence[str] = ("run",),
    *,
    noise: FloatArray | None = None,
    enough: float = ENOUGH,
) -> DataChoice:
    """Chooses pairs and bands of a `block` for an update from the unknowns `p` (n,); `outputs`, `inputs` name them.

    The band is cut half-way between neighbouring modes of the model. A part is left out where noise is more than half
    of it (`noise` (K, n_out, n_in) is the deviation of the measured values, that of the block if None), and where the
    computed values are unlike the measured ones in shape or size even when they may shift in frequency by a tenth: a
    signature scale factor (CSF over the band; Dascotte and Strobbe, IMAC XVII, 1999) below 0.5, which is a factor of
    3.7 in size alone, says that another mode answers there, and an update would be led astray (Grafe, Model Updating of
    Large Structural Dynamics Models Using Measured Response Functions, thesis, Imperial College 1998). Of the others
    the one with the largest gain of information about the unknowns, beside their prior and all chosen before, is taken
    (D-optimal; Fedorov, Theory of Optimal Experiments, 1972), until the share `enough` of what all credible ones tell
    is reached; the rest adds nothing.

    Raises LoadError for names that do not fit the block.
    """
    told = block.linearised(p)
    K, n_out, n_in = told.measured.shape
    if len(outputs) != n_out or len(inputs) != n_in:
        raise LoadError(f"{len(outputs)} outputs and {len(inputs)} inputs are named, the block has {n_out} and {n_in}")
    omega = np.abs(block.model.damped_modes(p)[0]) / (2 * np.pi)
    bands = _bands(told.freq, omega)
    deviation = told.sd if noise is None else noise
    parts, matrices, where = [], [], []
    prior = np.asarray(np.linalg.cholesky(block.model.unknowns.precision), dtype=np.float64)
    for lines in bands:
        for i in range(n_out):
            for j in range(n_in):
                part, F = _part(told, deviation, lines, i, j, block.weight, prior)
                where.append((lines, i, j))
                matrices.append(F)
                parts.append(DataPart(f"{outputs[i]} / {inputs[j]}", *part))
    order, gains, total = _greedy(parts, matrices, enough)
    mask = np.zeros((K, n_out, n_in), dtype=bool)
    for k in order:
        lines, i, j = where[k]
        mask[lines, i, j] = True
    return DataChoice(_told(parts, order, gains), mask, float(sum(gains[k] for k in order)), total)


def _bands(freq: FloatArray, modes: FloatArray) -> list[NDArray[np.int64]]:
    """Lines of every band: between the middles of neighbouring modes, with enough lines in each."""
    inside = np.sort(modes[(modes > freq[0]) & (modes < freq[-1])])
    cuts = [0.5 * (a + b) for a, b in pairwise(inside) if b - a > CLOSE * b]
    edges = np.searchsorted(freq, cuts)
    found: list[int] = [0]
    for edge in edges:
        if edge - found[-1] >= FEWEST and len(freq) - edge >= FEWEST:
            found.append(int(edge))
    return [np.arange(a, b) for a, b in zip(found, [*found[1:], len(freq)])]


def _part(
    told: Linearised, noise: FloatArray, lines: NDArray[np.int64], i: int, j: int, weight: float, prior: FloatArray
) -> tuple[tuple[tuple[float, float], tuple[int, int], float, float, float, float, str], FloatArray]:
    """Band, rows, information, gain, noise, likeness and reason of a part; and its information matrix (n, n) in units
    of the prior."""
    measured, sd = told.measured[lines, i, j], told.sd[lines, i, j]
    level = float(np.sqrt((noise[lines, i, j] ** 2).mean() / max(float((np.abs(measured) ** 2).mean()), 1e-300)))
    alike = _likeness(told.freq, told.predicted[:, i, j], told.measured[:, i, j], lines)
    J = told.slopes[:, lines, i, j] * np.sqrt(2.0 * weight) / sd
    full = np.zeros((len(prior), len(lines)), dtype=np.complex128)
    full[told.index] = J
    scaled = np.linalg.solve(prior, full)
    F = np.asarray((scaled.conj() @ scaled.T).real)
    own = 0.5 * float(np.linalg.slogdet(np.eye(len(F)) + F)[1])
    reason = "noise" if level > NOISY else "model" if alike < LIKE else ""
    band = (float(told.freq[lines[0]]), float(told.freq[lines[-1]]))
    return (band, (i, j), own, 0.0, level, alike, reason), F


def _likeness(freq: FloatArray, computed: ComplexArray, measured: ComplexArray, lines: NDArray[np.int64]) -> float:
    """Largest 2 |a^H b| / (a^H a + b^H b) of measured values on `lines` and computed ones shifted by up to a tenth."""
    own = measured[lines]
    best = 0.0
    for factor in np.linspace(1 - SHIFT, 1 + SHIFT, 41):
        x = freq[lines] * factor
        shifted = np.interp(x, freq, computed.real) + 1j * np.interp(x, freq, computed.imag)
        size = float((np.abs(own) ** 2).sum() + (np.abs(shifted) ** 2).sum())
        best = max(best, 2.0 * float(np.abs(np.vdot(own, shifted))) / max(size, 1e-300))
    return best


def _greedy(parts: list[DataPart], matrices: list[FloatArray], enough: float) -> tuple[list[int], list[float], float]:
    """Positions in the order of choice, the gain of every part (last one computed), and what all credible ones tell."""
    credible = [k for k, part in enumerate(parts) if not part.reason]
    gains = [0.0] * len(parts)
    n = len(matrices[0])
    total = 0.5 * float(np.linalg.slogdet(np.eye(n) + sum((matrices[k] for k in credible), np.zeros((n, n))))[1])
    A, reached, order = np.eye(n), 0.0, []
    # gains only fall as more is known: a part whose old gain is below the best new one need not be looked at
    bound = {k: parts[k].information for k in credible}
    while bound and reached < enough * total:
        best, level = -1, -np.inf
        base = float(np.linalg.slogdet(A)[1])
        for k in sorted(bound, key=lambda k: -bound[k]):
            if bound[k] <= level:
                break
            gains[k] = bound[k] = 0.5 * (float(np.linalg.slogdet(A + matrices[k])[1]) - base)
            if bound[k] > level:
                best, level = k, bound[k]
        order.append(best)
        A, reached = A + matrices[best], reached + level
        del bound[best]
    return order, gains, total


def _told(parts: list[DataPart], order: list[int], gains: list[float]) -> tuple[DataPart, ...]:
    def fate(k: int, reason: str) -> DataPart:
        a = parts[k]
        return DataPart(a.pair, a.band, a.rows, a.information, gains[k], a.noise, a.likeness, reason)

    chosen = set(order)
    rest = [k for k in range(len(parts)) if k not in chosen]
    return (*(fate(k, "") for k in order), *(fate(k, parts[k].reason or "adds nothing") for k in rest))
