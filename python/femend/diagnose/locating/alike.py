"""Places that the sensors cannot tell apart: a force at one of them moves every sensor as a force at another does."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from femend.diagnose.locating.classes import similarity
from femend.diagnose.locating.linear_costs import directions
from femend.diagnose.locating.locate import ALIKE, COMPARED_LINES, LINES, Located
from femend.diagnose.locating.receptances import at_sensors, on_lines
from femend.diagnose.settings import Settings
from femend.estimate import Lines, Problem
from femend.model import Place, ReducedModel

__all__ = ["Alike", "look_alikes", "with_look_alikes"]

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

# places from which those that a few lines tell apart are left out first, the lines for that, and the share of a force's
# strongest answer that may be left out of it there
MANY, TELLING, NEGLIGIBLE = 2000, (2, 10), 1e-5
# places whose motions agree to this (squared correlation) do the same for every law
TWINS = 0.999


def with_look_alikes(
    problem: Problem, reduced: ReducedModel, found: Sequence[Located], places: Sequence[Place], settings: Settings
) -> list[Located]:
    """The first places that do not move alike, `settings.places` of them, each with its look-alikes; then the first of
    every other kind that moves the sensors differently, up to `settings.kinds` kinds in all.

    Where two look-alikes move differently, a law at one does not do what it would do at the other, so that both are
    worth trying. A free force at a wrong place may leave a little less than one at the right place, since it also takes
    up what is wrong with the rest of the model; no law does that, so that the other kinds are tried too. Members and
    beddings, which have no force, are tried in any case.
    """
    kept: list[Located] = []
    twins: list[Place] = []
    kind = _kinds(problem, reduced, found)
    # several forces explain more than any one does, right or wrong: each kind has a reach of its own
    several = [one.place.n_w > 1 for one in found]
    least = {
        of: min((f.cost for f, s in zip(found, several, strict=True) if s is of), default=0.0) for of in (True, False)
    }
    reach = {of: cost * (1 + settings.further) + settings.reach for of, cost in least.items()}
    explained = any(
        one.place.n_w == 1 and one.fit.score <= settings.consistent and not settings.strains(one.fit.prior)
        for one in found
    )
    members = [one for one in found if one.place.scaled and not one.place.bed][: settings.members]
    members += [one for one in found if one.place.bed][: settings.beddings]
    for n, one in enumerate(found):
        near = one.cost < reach[several[n]]
        new = kind[n] not in kind[:n] and near and len(set(kind[: n + 1])) <= settings.kinds
        first = len(kept) < settings.places and (near or not explained)
        wanted = first or new or any(one is m for m in members)
        if any(one.place is p for p in twins) or not wanted:
            continue
        alike = look_alikes(problem, reduced, one, places, settings.margin)
        twins += [a.place for a in alike if a.together > TWINS]
        kept.append(replace(one, alike=tuple(a.place for a in alike)))
    return kept


def _kinds(problem: Problem, reduced: ReducedModel, found: Sequence[Located]) -> list[int]:
    """A number for each place, the same for those with one force that move the sensors alike."""
    kinds = list(range(len(found)))
    single = [i for i, one in enumerate(found) if one.place.n_w == 1]
    if single:
        few = problem.on(problem.records[:1]).thinned(COMPARED_LINES)
        p = found[single[0]].fit.p
        matrix = similarity(few, reduced, [found[i].place for i in single], p)
        for n, i in enumerate(single):
            kinds[i] = next((kinds[single[m]] for m in range(n) if matrix[n, m] > ALIKE), i)
    return kinds


@dataclass(frozen=True, eq=False)
class Alike:
    """A place that can stand in for another: the loss, and how much both move `together` (1: in proportion)."""

    place: Place
    loss: float
    together: float


def look_alikes(
    problem: Problem, reduced: ReducedModel, found: Located, places: Sequence[Place], margin: float
) -> list[Alike]:
    """Places with one force that could stand in for the one of `found`, in rising order of loss.

    The loss is what the cost of the law-free fit would rise by: the part of the free force's contribution to the
    tempered squares that no force at the other place can make, the model held. Places that lose more than `margin` are
    left out, and so are those with another number of forces.
    """
    if found.place.n_w != 1:
        return []
    others = [p for p in places if p.n_w == 1 and p is not found.place and p.kind != "base"]
    if not others:
        return []
    few = problem.sparing(LINES)
    answers, Q = _answers(few, reduced, found)
    own = found.place.w(reduced.V, reduced.V_a)[0] @ Q
    if len(others) > MANY:
        others = _not_beyond(answers, others, directions(reduced, others) @ Q, margin)
        if not others:
            return []
    W = np.array([p.w(reduced.V, reduced.V_a)[0] for p in others]) @ Q
    loss, power = np.zeros(len(others)), np.zeros((3, len(others)))
    for a in answers:
        line, s, g, made = a.line, a.s, a.g, a.made
        for rows in np.array_split(np.arange(len(others)), 1 + len(others) * line.Y.size // 2_000_000):
            # (place, line, sensor)
            h = np.einsum("kr,jr,sr->jks", s[:, None] ** 2 * g, W[rows], a.out, optimize=True) * line.weight
            along = np.abs(np.einsum("jks,ks->jk", h.conj(), made)) ** 2
            size = np.maximum((np.abs(h) ** 2).sum(axis=2), 1e-300)
            loss[rows] += line.share * ((np.abs(made) ** 2).sum(axis=1) - along / size).sum(axis=1)
        # how the coordinates move under the measured forces and the force at the place
        q = g * (line.U @ (reduced.rows(line.record.in_rows, line.record.in_signs) @ Q) + a.F * own)
        d, e = q @ own, q @ W.T
        power += [np.abs(d.conj() @ e), np.full(len(others), (np.abs(d) ** 2).sum()), (np.abs(e) ** 2).sum(axis=0)]
    together = power[0] ** 2 / np.maximum(power[1] * power[2], 1e-300)
    order = [int(i) for i in np.argsort(loss) if loss[i] < margin]
    return [Alike(others[i], float(loss[i]), float(together[i])) for i in order]


@dataclass(frozen=True, eq=False)
class _Answer:
    """What the free force F (K, 1) at a place does to the sensors on a record's lines, weighted, `made` (K, n_out);
    `s`, `g` and `out` as of `on_lines`."""

    line: Lines
    s: ComplexArray
    g: ComplexArray
    out: FloatArray
    F: ComplexArray
    made: ComplexArray


def _answers(problem: Problem, reduced: ReducedModel, found: Located) -> tuple[list[_Answer], FloatArray]:
    """The answers to the free force of a place on the lines of every record, and the modes Q (r, r) behind them."""
    lines = problem.lines(reduced)
    omega, zeta, Q = problem.modes(reduced, found.fit.p)
    own = found.place.w(reduced.V, reduced.V_a)[0] @ Q
    fitted = problem.fitted_lines(found.fit.hypothesis, found.fit.p, found.fit.x)
    answers = []
    for line, (_, _, forces) in zip(lines, fitted, strict=True):
        s, g, out = on_lines(line, reduced, omega, zeta, Q)
        F = forces[:, :1]
        answers.append(_Answer(line, s, g, out, F, s[:, None] ** 2 * ((g * own) @ out.T) * F * line.weight))
    return answers, Q


def _not_beyond(answers: Sequence[_Answer], others: Sequence[Place], W: FloatArray, margin: float) -> list[Place]:
    """Those of the places, with directions W (n, r) in the modes, that a few lines alone do not show to lose more than
    `margin`, as `look_alikes` has it: what is lost on other lines is never negative, so that none is left out wrongly.
    """
    telling = []
    for a in answers:
        for made, H in zip(a.made, at_sensors(a.s, a.g, a.out, a.line.weight), strict=True):
            telling.append((a.line.share * float((np.abs(made) ** 2).sum()), a.line.share, H, made))
    telling.sort(key=lambda line: -line[0])
    at = np.arange(len(others))
    size = np.maximum(np.abs(W).max(axis=0), 1e-12 * np.abs(W).max())
    loss = np.zeros(len(others))
    for first, last in pairwise((0, *TELLING)):
        for power, share, H, made in telling[first:last]:
            U, values, _ = np.linalg.svd(size[:, None] * H, full_matrices=False)
            strong = values > NEGLIGIBLE * values[0]
            h = W[at] @ (U[:, strong] * values[strong] / size[:, None])
            along = np.abs(W[at] @ (H @ made.conj())) ** 2
            loss[at] += power - share * along / np.maximum((np.abs(h) ** 2).sum(axis=1), 1e-300)
        at = at[loss[at] < margin]
    return [others[i] for i in at.tolist()]
