"""Starts of a linear law fitted to the recovered force of a place before the whole model is: a few numbers on lines."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from femend import _core
from femend.diagnose.recovered import Recovered
from femend.physics import Physics

__all__ = ["followed"]

FloatArray = NDArray[np.float64]

# lines in all on which a law is fitted to the recovered force, steps of the fit
LINES, STEPS = 600, 12
# a step of a logarithm at most, and how far a parameter may leave its start
LARGEST, FARTHEST = 1.5, 12.0
# starts that end within this of each other (logarithms) are one
APART = 0.1


def followed(
    recovered: Recovered, entry: Physics, starts: Sequence[Mapping[str, float]], count: int
) -> list[dict[str, float]]:
    """The `count` best of the starts after a least-squares fit of the law's force to the recovered one.

    Lines are weighted by how well the sensors see a force at the joint. Only the law moves, the model stays.
    """
    lines = _lines(recovered)
    names, law = entry.parameter_names, entry.law or entry.name
    ends: list[tuple[float, FloatArray]] = []
    for start in starts:
        x = np.log([max(start[n], 1e-12) for n in names])
        ends.append(_fit(law, names, x, *lines))
    ends = sorted((e for e in ends if np.isfinite(e[0])), key=lambda e: e[0])
    kept: list[FloatArray] = []
    for _, x in ends:
        if len(kept) < count and all(np.abs(x - other).max() > APART for other in kept):
            kept.append(x)
    return [dict(zip(names, np.exp(x).tolist(), strict=True)) for x in kept]


_Lines = tuple[NDArray[np.complex128], NDArray[np.complex128], NDArray[np.complex128]]


def _lines(recovered: Recovered) -> _Lines:
    """s, and weighted motion and force against it, of all records and coordinates on every so many lines."""
    s, D, F = [], [], []
    for line, d, f, weight in zip(recovered.s, recovered.D, recovered.F, recovered.weight, strict=True):
        for j in range(d.shape[1]):
            root = np.sqrt(weight[:, j])
            s.append(line)
            D.append(root * d[:, j])
            F.append(root * f[:, j])
    step = max(1, sum(len(x) for x in s) // LINES)
    a, b, c = (np.concatenate(x)[::step] for x in (s, D, F))
    return np.asarray(a, dtype=np.complex128), b, c


def _fit(
    law: str,
    names: Sequence[str],
    x: FloatArray,
    s: NDArray[np.complex128],
    D: NDArray[np.complex128],
    F: NDArray[np.complex128],
) -> tuple[float, FloatArray]:
    """Levenberg-Marquardt in the logarithms of the law's parameters."""

    def at(x: FloatArray) -> tuple[float, NDArray[np.complex128], NDArray[np.complex128]]:
        values = np.exp(x)
        try:
            kappa, slopes = _core.law_dynamic_stiffness(law, dict(zip(names, values.tolist(), strict=True)), s)
        except ValueError:  # beyond what the law allows
            return np.inf, F, D[None]
        e = F - kappa * D
        return float((np.abs(e) ** 2).sum()), e, slopes * values[:, None] * D

    first, damping = x, 1e-2
    cost, e, J = at(x)
    for _ in range(STEPS):
        H = np.real(J.conj() @ J.T)
        g = np.real(J.conj() @ e)
        scale = np.diag(H) + 1e-12 * np.trace(H) + 1e-300
        if not (np.all(np.isfinite(H)) and np.all(np.isfinite(g))):
            break
        step = np.linalg.lstsq(H + damping * np.diag(scale), g, rcond=None)[0]
        new = np.clip(x + np.clip(step, -LARGEST, LARGEST), first - FARTHEST, first + FARTHEST)
        trial = at(new)
        if trial[0] < cost:
            done = cost - trial[0] < 1e-4 * cost
            x, (cost, e, J), damping = new, trial, max(damping * 0.2, 1e-9)
            if done:
                break
        else:
            damping *= 10.0
            if damping > 1e6:
                break
    return cost, x
