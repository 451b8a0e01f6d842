"""Starts of a linear law fitted to the free force of a place before the whole model is: a few numbers on lines."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from femend import _core
from femend.diagnose.locating.free_force import FreeForce
from femend.physics import Physics

__all__ = ["followed"]

FloatArray = NDArray[np.float64]

# lines in all on which a law is fitted to the free force, steps of the fit
LINES, STEPS = 600, 12
# a step of a logarithm at most, and how far a parameter may leave its start
LARGEST, FARTHEST = 1.5, 12.0
# starts that end within this of each other (logarithms) are one
APART = 0.1


def followed(
    free: Sequence[FreeForce], entry: Physics, starts: Sequence[Mapping[str, float]], count: int
) -> list[dict[str, float]]:
    """The `count` best of the starts after a least-squares fit of the law to the free force on every record.

    Only the law moves, the model's other unknowns stay where the free force has them.
    """
    names, law = entry.parameter_names, entry.law or entry.name
    few = [one.thinned(max(1, LINES // (len(free) * one.D.shape[1]))) for one in free]
    ends: list[tuple[float, FloatArray]] = []
    for start in starts:
        x = np.log([max(start[n], 1e-12) for n in names])
        ends.append(_fit(law, names, x, few))
    ends = sorted((e for e in ends if np.isfinite(e[0])), key=lambda e: e[0])
    kept: list[FloatArray] = []
    for _, x in ends:
        if len(kept) < count and all(np.abs(x - other).max() > APART for other in kept):
            kept.append(x)
    return [dict(zip(names, np.exp(x).tolist(), strict=True)) for x in kept]


def _fit(law: str, names: Sequence[str], x: FloatArray, free: Sequence[FreeForce]) -> tuple[float, FloatArray]:
    """Levenberg-Marquardt in the logarithms of the law's parameters."""

    def at(x: FloatArray) -> tuple[float, NDArray[np.complex128], NDArray[np.complex128]]:
        values = np.exp(x)
        errors, slopes = [], []
        for one in free:
            try:
                kappa, by = _core.law_dynamic_stiffness(law, dict(zip(names, values.tolist(), strict=True)), one.s)
            except ValueError:  # beyond what the law allows
                return np.inf, np.zeros(0, dtype=complex), np.zeros((len(x), 0), dtype=complex)
            e, slope = one.errors(kappa[None])
            errors.append(e[0].ravel())
            slopes.append((by * values[:, None])[:, :, None] * slope)
        e, J = np.concatenate(errors), np.concatenate([a.reshape(len(x), -1) for a in slopes], axis=1)
        return float((np.abs(e) ** 2).sum()), e, J

    first, damping = x, 1e-2
    cost, e, J = at(x)
    for _ in range(STEPS):
        H = np.real(J.conj() @ J.T)
        g = -np.real(J.conj() @ e)
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
