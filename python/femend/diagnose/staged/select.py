"""Which term a stage's recordings ask for: evidence of every rival, one after another."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from femend.diagnose.staged.places import screened
from femend.diagnose.staged.setup import Setup, carried
from femend.estimate.joint import Block, ModesBlock, Posterior, maximise
from femend.model.terms.configured import ConfiguredModel
from femend.model.terms.linear_terms import LinearTerm
from femend.model.terms.unknowns import Unknown, Unknowns

__all__ = ["NOT_TOLD", "Rival", "Round", "fit_terms", "select_terms"]

FloatArray = NDArray[np.float64]
Blocks = Callable[[ConfiguredModel], Sequence[Block]]

# starts of one unknown of a term, as ln of the factor on its guessed size; those of a support also with a direction
# that is so much stiffer than the others, since which modes are its own is open before it is found
SIZES = (0.0, -2.4, 2.4)
SUPPORT_SIZES, STIFFER = (-3.0, -2.0, -1.0, 0.0, 1.0, 2.0, 3.0), 1.5
# steps from every start, and starts that are followed to their end
FIRST_STEPS, FOLLOWED = 6, 3
# rivals that are listed with a decision, beside all without a term and places of the physics taken that are nearer
# than this in ln evidence: they are not told apart
LISTED, NOT_TOLD = 8, 3.0


@dataclass(frozen=True, eq=False)
class Rival:
    """A hypothesis of a stage: a term added, parameters alone (`term` None, `loose`), or nothing."""

    label: str
    physics: str
    term: LinearTerm | None
    posterior: Posterior
    score: float
    probability: float = 0.0


@dataclass(frozen=True, eq=False)
class Round:
    """One decision: the rivals by falling score, and the one taken (None: nothing was gained).

    `inflation` is what the best rival leaves, in units of what noise and the form of the model explain; `without` are
    the least squares that parameters alone leave. `refused` says that the best rival was taken back, since the samples
    behind the stage's data are not explained better.
    """

    rivals: tuple[Rival, ...]
    taken: Rival | None
    inflation: float
    without: float
    refused: bool = False


def fit_terms(
    setup: Setup,
    configuration: str,
    terms: Sequence[LinearTerm],
    before: Posterior | None,
    blocks: Blocks,
    *,
    loose: bool = False,
    new: LinearTerm | None = None,
    from_p: Posterior | None = None,
    more: Sequence[Unknown] = (),
    iterations: int = 40,
) -> Posterior:
    """The best fit of the stage's blocks with `terms`, and `new` behind them started at several sizes; `more` are
    unknowns of the blocks' own, those of loads."""
    everything = [*terms] if new is None else [*terms, new]
    unknowns = carried(setup, setup.unknowns(everything, more), before, loose)
    model = setup.model(configuration, unknowns, everything)
    own = blocks(model)
    base = unknowns.mean.copy()
    if from_p is not None:
        for name in from_p.unknowns.names:
            if name in unknowns.names:
                base[unknowns.index(name)] = from_p.p[from_p.unknowns.index(name)]
    if new is None:
        return maximise(unknowns, own, base, iterations=iterations)
    # which identified mode is which of the model's has to be found out; FRFs lead there by themselves
    pairing = any(isinstance(block, ModesBlock) for block in own)
    starts = _starts(unknowns, base, new, pairing)
    tried = [maximise(unknowns, own, p, iterations=FIRST_STEPS) for p in starts]
    tried.sort(key=lambda found: found.cost)
    followed = [maximise(unknowns, own, found.p, iterations=iterations) for found in tried[:FOLLOWED]]
    return min(followed, key=lambda found: found.cost)


def _starts(unknowns: Unknowns, base: FloatArray, new: LinearTerm, directions: bool) -> list[FloatArray]:
    """Points to start from: the term at several sizes, with `directions` a support also stiffer in one of them."""
    at = {u.name: unknowns.index(u.name) for u in new.unknowns if u.positive}
    if len(new.releases):
        axes = ("", "_z", "_y", "_x") if directions else ("",)
        sizes = [(size, axis) for size in SUPPORT_SIZES for axis in axes]
    elif len(new.unknowns) == 1:
        sizes = [(size, "") for size in SIZES]
    else:
        sizes = [(0.0, "")]
    found = []
    for size, axis in sizes:
        p = base.copy()
        for name, i in at.items():
            p[i] = unknowns.mean[i] + size + (STIFFER if axis and axis in name.split(": ")[-1] else 0.0)
        found.append(p)
    return found


def select_terms(
    setup: Setup,
    configuration: str,
    terms: Sequence[LinearTerm],
    before: Posterior | None,
    blocks: Blocks,
    candidates: Callable[[Sequence[LinearTerm]], Sequence[LinearTerm]],
    *,
    more: Sequence[Unknown] = (),
    start: Posterior | None = None,
    rounds: int | None = None,
    enough: float = 0.0,
    elsewhere: Callable[[Sequence[LinearTerm]], Sequence[LinearTerm]] = lambda taken: (),
) -> tuple[list[LinearTerm], Posterior, list[Round]]:
    """Adds terms while one of the rivals is clearly better than parameters alone.

    Returns the terms, the stage's posterior with them, and every decision. `more` are unknowns of the blocks' own,
    `start` is where the fit without terms begins, `rounds` how many terms at most (None: as the settings say), `enough`
    the squares per value up to which nothing is missing; of the rivals that `elsewhere` gives only the most promising
    are fitted (`screened`). The evidence is divided by what the best hypothesis leaves
    above the noise, so that a model error common to all does not decide between them.
    """
    chosen, decisions = list(terms), []
    base = fit_terms(setup, configuration, chosen, before, blocks, more=more, from_p=start)
    for _ in range(setup.settings.rounds if rounds is None else rounds):
        rows: list[tuple[str, str, LinearTerm | None, Posterior]] = [("nothing", "", None, base)]
        if before is not None:
            # the rival that blames what the parameters are in this configuration
            wide = fit_terms(setup, configuration, chosen, before, blocks, loose=True, more=more, from_p=start)
            rows.append(("parameters of this configuration", "", None, wide))
        promising = screened(setup, configuration, chosen, base, blocks, elsewhere(chosen))
        for term in (*candidates(chosen), *promising):
            fitted = fit_terms(
                setup, configuration, chosen, before, blocks, new=term, from_p=base, more=more, iterations=15
            )
            rows.append((term.label or term.name, term.physics, term, fitted))
        decision = _decide(setup, rows, enough)
        decisions.append(decision)
        if decision.taken is None or decision.taken.term is None:
            break
        chosen.append(decision.taken.term)
        base = fit_terms(setup, configuration, chosen, before, blocks, from_p=decision.taken.posterior, more=more)
    return chosen, base, decisions


def _decide(setup: Setup, rows: list[tuple[str, str, LinearTerm | None, Posterior]], enough: float) -> Round:
    """The rivals by their evidence; the best is taken where it is clearly better than parameters alone, and where these
    leave more squares per value than `enough`: of many rivals one always explains some of what is noise and form."""
    s = setup.settings
    finite = [row for row in rows if np.isfinite(row[3].cost) and _has_stiffness(setup, row[2], row[3])]
    squares = [sum(row[3].squares.values()) for row in finite]
    inflation = max(1.0, min(squares) / max(finite[0][3].n_values, 1.0))
    rivals = [Rival(label, physics, term, fitted, _score(fitted, inflation)) for label, physics, term, fitted in finite]
    scores = np.array([r.score for r in rivals])
    weight = np.exp(np.clip(scores - scores.max(), -700, 0))
    rivals = [
        Rival(r.label, r.physics, r.term, r.posterior, r.score, float(w))
        for r, w in zip(rivals, weight / weight.sum(), strict=True)
    ]
    without = [(r, q) for r, q in zip(rivals, squares, strict=True) if r.term is None]
    level = max(r.score for r, _ in without)
    least = min(q for _, q in without)
    ranked = sorted(zip(rivals, squares, strict=True), key=lambda row: -row[0].score)
    best, own = ranked[0]
    lacks = least > enough * finite[0][3].n_values
    better = best.term is not None and best.score - level > s.gain and own < (1 - s.drop) * least
    taken = best if lacks and better else None
    return Round(_listed([r for r, _ in ranked], taken), taken, inflation, least)


def _has_stiffness(setup: Setup, term: LinearTerm | None, fitted: Posterior) -> bool:
    """Does a stiffness over speed stay one: is it positive at every speed? Others do."""
    if term is None or term.physics != "speed_stiffness":
        return True
    unknowns, values = fitted.unknowns, fitted.values
    base = term.base_parameter(setup.free.parameters) if term.size is not None else None
    rest = 1.0 if base is None else float(values[unknowns.index(base)])
    shares = np.linspace(0.0, 1.0, 21)
    powers = [shares ** (n + 1) * values[unknowns.index(u.name)] for n, u in enumerate(term.unknowns)]
    return bool((rest + np.sum(powers, axis=0) > 0.0).all())


def _listed(ranked: Sequence[Rival], taken: Rival | None) -> tuple[Rival, ...]:
    """The best rivals, what the fit is without any term, and all places that are not told from the one taken."""

    def told(rival: Rival) -> bool:
        alike = taken is not None and rival.physics == taken.physics and taken.score - rival.score < NOT_TOLD
        return alike or rival.term is None

    return tuple(r for i, r in enumerate(ranked) if i < LISTED or told(r))


def _score(fitted: Posterior, inflation: float) -> float:
    occam = fitted.log_evidence + 0.5 * fitted.cost
    return float(-0.5 * fitted.cost / inflation + occam)
