"""Which sensor to add: where the places that the recordings cannot tell apart would move the structure differently."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from femend.diagnose.locating.locate import COMPARED_LINES, Located
from femend.diagnose.locating.receptances import receptances
from femend.estimate import Lines, Problem
from femend.model import Place, ReducedModel

__all__ = ["NextSensor", "next_sensor"]

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

AXES = "XYZ"
# values of one pass over candidate sensors (sensors x lines x places)
AT_ONCE = 4_000_000
# places that are told apart at most: those reported
MOST_PLACES = 8


@dataclass(frozen=True, slots=True)
class NextSensor:
    """A translation to record next to what is recorded: at `node` along `axis` of the node's output system.

    `information` is what it would be expected to tell about which of the places it is, in nats, of at most ln(1 +
    rivals); `apart` is how many of the `rivals` it would tell from the place that was found.
    """

    node: int
    axis: str
    information: float
    apart: int
    rivals: int


def next_sensor(
    problem: Problem, reduced: ReducedModel, found: Located, rivals: Sequence[Place], margin: float
) -> NextSensor | None:
    """The sensor that would best tell a place from its rivals, or None where none would tell any of them.

    At every rival acts the force that comes nearest to what the found one does to the sensors there are. What these
    forces do at the present sensors and at any other translation of the model, in units of the noise (the present
    sensors' median), gives the distances D_ij between the places; with all of them equally likely the sensors tell at
    least ln n - 1/n sum_i ln sum_j exp(-D_ij / 8) (Kolchinsky and Tracey, Entropy 19 (2017) 361, eq. 10 with the
    Bhattacharyya distance). A rival counts as told apart where D_0j is above `margin`. The forces and the model's
    unknowns are held, so that it is the most that a sensor can tell.
    """
    places = [found.place, *(p for p in rivals if p.n_w == 1 and not p.scaled)][:MOST_PLACES]
    if found.place.n_w != 1 or found.place.scaled or len(places) < 2:
        return None
    few = problem.thinned(COMPARED_LINES)
    nodes, rows = _translations(reduced, few)
    if not len(rows):
        return None
    D = np.zeros((len(rows), len(places), len(places)))
    omega, zeta, Q = few.modes(reduced, found.fit.p)
    W = np.array([p.w(reduced.V, reduced.V_a)[0] for p in places]) @ Q
    at = reduced.rows(rows) @ Q
    lines = few.lines(reduced)
    fitted = few.fitted_lines(found.fit.hypothesis, found.fit.p, found.fit.x)
    for line, (_, _, F) in zip(lines, fitted, strict=True):
        out = reduced.rows(line.record.out_rows, line.record.out_signs) @ Q
        moved, seen = _moved(line, (omega, zeta), W, out, np.asarray(F)[:, 0])
        D += line.share * _distances(seen)
        weight = np.median(line.weight, axis=1)
        for part in np.array_split(np.arange(len(rows)), 1 + len(rows) * moved[..., 0].size // AT_ONCE):
            y = np.einsum("jkr,sr->sjk", moved, at[part], optimize=True) * weight
            D[part] += line.share * _distances(y)
    information = _information(D)
    best = int(np.lexsort((-D[:, 0, 1:].min(axis=1), -np.round(information, 2)))[0])
    apart = int((D[best, 0, 1:] > margin).sum())
    if apart == 0:
        return None
    return NextSensor(int(nodes[best]), AXES[int(rows[best]) % 6], float(information[best]), apart, len(places) - 1)


def _translations(reduced: ReducedModel, problem: Problem) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Nodes and g-set rows of all translations that can move and have no sensor."""
    model = reduced.model
    taken = {int(r) for record in problem.records for r in record.out_rows}
    own = np.asarray(model.as_drawn.node_ids, dtype=np.int64)
    nodes = np.repeat(own, 3)
    rows = np.array([6 * i + c for i in range(len(own)) for c in range(3)], dtype=np.int64)
    size = np.abs(reduced.V[rows]).max(axis=1)
    free = (size > 1e-9 * size.max(initial=1e-300)) & ~np.isin(rows, list(taken))
    return nodes[free], rows[free]


def _moved(
    line: Lines, modes: tuple[FloatArray, FloatArray], W: FloatArray, out: FloatArray, F: ComplexArray
) -> tuple[ComplexArray, ComplexArray]:
    """What the force `F` (K,) at the first place does, and at the others the one that comes nearest to it at the
    sensors: modal accelerations (place, line, mode), and those of the sensors in units of the noise (1, place,
    values)."""
    s = line.s
    g = s[:, None] ** 2 * receptances(*modes, s)
    h = np.einsum("kr,jr,sr->jks", g, W, out, optimize=True) * line.weight
    made = h[0] * F[:, None]
    force = np.einsum("jks,ks->jk", h.conj(), made) / np.maximum((np.abs(h) ** 2).sum(axis=2), 1e-300)
    seen = (force[:, :, None] * h).reshape(1, len(W), -1)
    return np.asarray(force[:, :, None] * g[None] * W[:, None, :]), seen


def _distances(y: ComplexArray) -> FloatArray:
    """Squared distances (s, j, j) between rows of y (s, j, k)."""
    gram = np.einsum("sik,sjk->sij", y.conj(), y, optimize=True).real
    own = np.einsum("sii->si", gram)
    return np.asarray(np.maximum(own[:, :, None] + own[:, None, :] - 2 * gram, 0.0))


def _information(D: FloatArray) -> FloatArray:
    """Expected information (s,) on which of n equally likely places it is, from squared distances D (s, n, n)."""
    return np.asarray(np.log(D.shape[1]) - np.log(np.exp(-D / 8).sum(axis=2)).mean(axis=1))
