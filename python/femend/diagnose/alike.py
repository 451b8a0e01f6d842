"""Places that the sensors cannot tell apart: a force at one of them moves every sensor as a force at another does."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from femend import _core
from femend.diagnose.locate import LINES, Located
from femend.diagnose.settings import Settings
from femend.estimate import Problem
from femend.model import Place, ReducedModel

__all__ = ["look_alikes", "with_look_alikes"]

FloatArray = NDArray[np.float64]


def with_look_alikes(
    problem: Problem, reduced: ReducedModel, found: Sequence[Located], places: Sequence[Place], settings: Settings
) -> list[Located]:
    """The first places that are not look-alikes of each other, `settings.places` of them, each with its look-alikes."""
    kept: list[Located] = []
    for one in found:
        if len(kept) == settings.places:
            break
        if any(one.place is p for k in kept for p in k.alike):
            continue
        alike = look_alikes(problem, reduced, one, places, settings.margin)
        kept.append(replace(one, alike=tuple(p for _, p in alike)))
    return kept


def look_alikes(
    problem: Problem, reduced: ReducedModel, found: Located, places: Sequence[Place], margin: float
) -> list[tuple[float, Place]]:
    """(loss, place) of places with one force that could stand in for the one of `found`, in rising order of loss.

    The loss is what the cost of the law-free fit would rise by: the part of the free force's contribution to the
    tempered squares that no force at the other place can make, the model held. Places that lose more than `margin` are
    left out, and so are those with another number of forces.
    """
    if found.place.n_w != 1:
        return []
    others = [p for p in places if p.n_w == 1 and p is not found.place and p.kind != "base"]
    if not others:
        return []
    few = problem.thinned(LINES)
    loss = np.zeros(len(others))
    system, lines = few.system(reduced), few.lines(reduced)
    omega, zeta, Q = system.modal(found.fit.p)
    W = np.array([p.w(reduced.V, reduced.V_a)[0] for p in others]) @ Q
    fitted = _core.fitted_lines(
        system, found.fit.hypothesis.core(), [line.core for line in lines], found.fit.p, found.fit.x
    )
    own = found.place.w(reduced.V, reduced.V_a)[0] @ Q
    for line, (_, _, F) in zip(lines, fitted, strict=True):
        s = line.sigma + 2j * np.pi * line.freq
        g = s[:, None] ** 2 / (omega**2 + s[:, None] ** 2 + 2 * (zeta * omega) * s[:, None])
        out = reduced.rows(line.record.out_rows, line.record.out_signs) @ Q
        made = ((g * own) @ out.T) * F * line.weight
        for rows in np.array_split(np.arange(len(others)), 1 + len(others) * line.Y.size // 2_000_000):
            # (place, line, sensor)
            h = np.einsum("kr,jr,sr->jks", g, W[rows], out, optimize=True) * line.weight
            along = np.abs(np.einsum("jks,ks->jk", h.conj(), made)) ** 2
            power = np.maximum((np.abs(h) ** 2).sum(axis=2), 1e-300)
            loss[rows] += line.share * ((np.abs(made) ** 2).sum(axis=1) - along / power).sum(axis=1)
    order = [int(i) for i in np.argsort(loss) if loss[i] < margin]
    return [(float(loss[i]), others[i]) for i in order]
