"""Measured modes whose shape is a doubtful mate's and that all other modes contradict: wrong mates that would lead.

A mode that the model lacks, or the second pole of a resonance, is paired with whatever looks a little like it. Above
the MAC that is asked of a pair it counts, and where its frequency is many deviations off, the parameters follow it. Its
MAC alone does not tell: so low are honest modes of a deck that is still far off, and close ones that mix. What the
others say does: the search is made again without the mode, and the mode is looked at from there. It is contradicted
where its values are off by many of the deviations that the test and the parameters, as the others leave them, give it,
while the others are met; and where its shape is no clear mate's there. A mode that goes with what explains the others
is an honest one that led the search astray: it counts, and the search goes on from where the others have led.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from femend.errors import FemendError
from femend.estimate.updating.close_modes import reach
from femend.estimate.updating.lost_modes import EXPLAINED
from femend.estimate.updating.problem import Evaluation, Problem
from femend.estimate.updating.responses import Mates
from femend.estimate.updating.result import UpdateResult

__all__ = ["Contradiction", "Way", "better_way"]

FloatArray = NDArray[np.float64]

# a shape with this MAC is its mate's, whatever the frequency is
SURE = 0.9
# mean square in deviations of a mode's values, over that of all others, from which on it is contradicted: five of them
BEYOND = 25.0
# values that the others have to have beside those that the parameters take up: what leaves none contradicts nothing
SPARE = 1.0
# a mean square that fell to this share of what it was without the mode is explained too, as well as the model can
FALLEN = 0.1
# doubtful modes without which a search is made, those first whose absence would lower the squares most
TRIED = 4
# share by which an end with all modes has to cost less to be another one
LOWER = 0.01

# a search of a problem from p
Search = Callable[[Problem, FloatArray], UpdateResult]


@dataclass(frozen=True, slots=True)
class Contradiction:
    """Test mode `mode` (from 0) of `configuration` (from 0) seen from where all others lead: its values are `off` by so
    many deviations in the root mean square; `mac` is that with its best mate there. `told` is whether all others are
    explained without it, by parameters of which they tell more than they need."""

    configuration: int
    mode: int
    off: float
    mac: float
    told: bool


@dataclass(frozen=True, eq=False)
class Way:
    """A better end than a search had: its `result`, and the mode that was left `out` for it, None where all count."""

    result: UpdateResult
    out: Contradiction | None


def better_way(found: UpdateResult, start: FloatArray, search: Search) -> Way | None:
    """An end that is better than the one `found` from `start` (n,), where a doubtful mode leads; None where none does.

    `search` is made without each of the doubtful modes in turn, and the least of these ends looked at: the mode is left
    out where it is contradicted there, and comes back where it is not.
    """
    problem = found.problem
    ends = []
    for c, i in _doubtful(found)[:TRIED]:
        without = problem.without(c, i)
        try:
            ends.append((search(without, start), c, i))
        except (FemendError, ArithmeticError):
            continue  # too little is left without it
    for end, c, i in sorted(ends, key=lambda e: e[0].after.cost):
        seen = _seen_from(end, found, c, i)
        if seen is None:
            continue
        if seen.mac < SURE and seen.off**2 > BEYOND:
            if seen.told:
                return Way(end, seen)
            continue
        try:
            back = search(problem, end.p)
        except (FemendError, ArithmeticError):
            continue
        if len(back.unpaired()) <= len(found.unpaired()) and back.after.cost < (1 - LOWER) * found.after.cost:
            return Way(back, None)
    return None


def _doubtful(found: UpdateResult) -> list[tuple[int, int]]:
    """(configuration, test mode) of the modes that count and whose shape is not clearly their mate's, before or after,
    where the whole or the mode itself is not explained: those first without which the squares would fall most."""
    after, problem = found.after, found.problem
    if after.jacobian is None:
        return []
    explained = after.squares <= EXPLAINED * after.n_values
    covariance = np.linalg.pinv(after.jacobian.T @ after.jacobian + problem.unknowns.precision)
    out = []
    for c, (first, last) in enumerate(zip(found.before.mates, after.mates, strict=True)):
        test = problem.configurations[c].test
        if test is None or first is None or last is None:
            continue
        for i in np.flatnonzero(last.mate >= 0).tolist():
            if min(float(last.mac[i]), float(first.mac[i])) >= SURE:
                continue
            r, J = _values(problem, after, c, i)
            if r.size == 0 or (explained and float(r @ r) <= EXPLAINED * r.size):
                continue
            # what the squares would fall by without these values, to first order (a deletion residual)
            rest = np.eye(r.size) - J @ covariance @ J.T
            out.append((float(r @ np.linalg.lstsq(rest, r, rcond=None)[0]), c, i))
    return [(c, i) for _, c, i in sorted(out, reverse=True)]


def _seen_from(end: UpdateResult, found: UpdateResult, c: int, i: int) -> Contradiction | None:
    """The mode of what was `found` that was left out for `end`, with what the others told of the parameters and how
    well they are met; None where the model gives no values there."""
    problem, here = found.problem, end.after
    test = problem.configurations[c].test
    if here.jacobian is None or test is None:
        return None
    try:
        kinds, before = _kinds(problem, here, c, i), _kinds(problem, found.after, c, i)
    except (FemendError, ArithmeticError):
        return None
    covariance = np.linalg.pinv(here.jacobian.T @ here.jacobian + problem.unknowns.precision)
    taken_up = float(np.trace(here.jacobian @ covariance @ here.jacobian.T))
    own = sum(float(k.residual @ k.residual) for k in before)
    whole = (here.squares / max(here.n_values, 1), (found.after.squares - own) / max(here.n_values, 1))
    others = [whole, *((k.others, b.others) for k, b in zip(kinds, before, strict=True))]
    told = here.n_values - taken_up >= SPARE and all(now <= max(EXPLAINED, FALLEN * then) for now, then in others)
    off = 0.0
    for kind in kinds:
        expected = np.eye(kind.residual.size) + kind.jacobian @ covariance @ kind.jacobian.T
        square = float(kind.residual @ np.linalg.solve(expected, kind.residual)) / kind.residual.size
        off = max(off, square / max(kind.others, 1.0))
    return Contradiction(c, i, off**0.5, float(test.mates(here.states[c]).mac[i]), told)


@dataclass(frozen=True, eq=False)
class _Kind:
    """Residuals (m,) of one mode in one response, in deviations, their Jacobian (m, n), and the mean square of those of
    the `others` that count."""

    residual: FloatArray
    jacobian: FloatArray
    others: float


def _values(problem: Problem, here: Evaluation, c: int, i: int) -> tuple[FloatArray, FloatArray]:
    """Residuals (m,) of a mode in all responses, and their Jacobian (m, n), as `_kinds`."""
    kinds = _kinds(problem, here, c, i)
    return (
        np.concatenate([np.zeros(0), *(k.residual for k in kinds)]),
        np.vstack([np.zeros((0, here.p.size)), *(k.jacobian for k in kinds)]),
    )


def _kinds(problem: Problem, here: Evaluation, c: int, i: int) -> list[_Kind]:
    """Test mode `i` of configuration `c` beside the other modes that count `here`, response by response."""
    configuration, state = problem.configurations[c], here.states[c]
    test, now = configuration.test, here.mates[c]
    assert test is not None
    assert now is not None
    pairs = test.mates(state)
    count = now.mate >= 0
    count[i] = True
    before, upto = count & (np.arange(count.size) < i), count & (np.arange(count.size) <= i)

    def of(which: NDArray[np.bool_]) -> Mates:
        return replace(pairs, mate=np.where(which, pairs.mate, -1))

    state.need(reach(of(count).mate, state.value("freq")))
    chain = problem.chain(here.p, c)
    out = []
    for response in configuration.responses:
        if not hasattr(response, "n_modes"):
            continue  # what is not of modes says nothing of one
        first = response.compare(state, of(before), False).residual.size
        last = response.compare(state, of(upto), False).residual.size
        whole = response.compare(state, of(count), True)
        assert whole.slopes is not None
        rest = np.delete(whole.residual, np.s_[first:last])
        if last > first:
            others = float(rest @ rest) / max(rest.size, 1)
            out.append(_Kind(whole.residual[first:last], (chain @ whole.slopes).T[first:last], others))
    return out
