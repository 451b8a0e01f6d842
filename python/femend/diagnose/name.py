"""What is missing: every law of the catalogue at the best places, judged on a record that no fit has seen."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from femend.diagnose.candidates import Candidate, laws_for, starts
from femend.diagnose.joint import Joint, Recovered, open_joint, recover
from femend.diagnose.linear import fit_linear, fit_mass
from femend.diagnose.locate import Located
from femend.diagnose.nonlinear import fit_nonlinear, judge_nonlinear, refit_nonlinear
from femend.diagnose.settings import Settings
from femend.estimate import Fit, Problem
from femend.model import ReducedModel
from femend.model.places import mass_place

__all__ = ["Ranked", "Split", "name_physics", "score", "split_records"]

# starts of a nonlinear law that are followed
NONLINEAR_STARTS = 3
# starts within this factor of the best regression are followed, at most so many at a place
START_REACH, MOST_STARTS = 1.6, 9
# lines a record while laws are compared; the chosen one is fitted on all
NAMING_LINES = 500


@dataclass(frozen=True, eq=False)
class Split:
    """The fit recordings apart: `fitting` for estimates, `choosing` for the choice between laws, `whole` both."""

    whole: Problem
    fitting: Problem
    choosing: Problem


@dataclass(frozen=True, eq=False)
class Ranked:
    """A candidate with its place and score (tempered log posterior on unseen data, lower is better)."""

    candidate: Candidate
    located: Located | None
    score: float
    recovered: Recovered | None = None


def split_records(problem: Problem) -> Split:
    """Keeps the record of middle level for choosing; a single record is cut, its last third is kept."""
    problem = problem.thinned(NAMING_LINES)
    records = problem.records
    if len(records) > 1:
        order = np.argsort([r.u.std() for r in records])
        kept = int(order[(len(order) - 1) // 2 if len(order) < 3 else len(order) // 2])
        rest = [r for i, r in enumerate(records) if i != kept]
        return Split(problem, problem.on(rest), problem.on([records[kept]]))
    return Split(problem, problem, problem)


def score(candidate: Candidate, choosing: Problem, settings: Settings, n_values: float) -> float:
    """Tempered squares on unseen data, prior of the model's unknowns, and a price for every parameter of the law."""
    return n_values * float(np.log(max(candidate.chosen, 1e-12))) + candidate.prior + settings.price * candidate.n_law


def effective_values(choosing: Problem, reduced: ReducedModel) -> float:
    """Tempered number of values of the choosing records, as they count in the score."""
    return float(sum(line.share * line.Y.size for line in choosing.lines(reduced)))


def null_candidate(split: Split, null: Fit, name: str = "none") -> Candidate:
    """The model with its parameters alone (or a member's factor) as a candidate."""
    (fitted,) = split.fitting.fit([null.hypothesis], [(null.p, null.x)])
    fitted = null if fitted is None else fitted
    (seen,) = split.choosing.fit([fitted.hypothesis], [(fitted.p, fitted.x)], iterations=0)
    n_law = len(null.hypothesis.reduced.names) - len(null.hypothesis.reduced.model.parameters)
    mean, sd = split.fitting.prior(null.hypothesis.reduced)
    deviations = ((fitted.p - mean) / sd) ** 2
    own = slice(len(null.hypothesis.reduced.model.parameters), len(null.hypothesis.reduced.names))
    prior = float(deviations.sum() - deviations[own].sum())
    values = {"factor": float(np.exp(fitted.p[own][0]))} if n_law else {}
    chosen = np.inf if seen is None else seen.score
    return Candidate(None, name, None, values, fitted.p, fitted.x, n_law, prior, fitted.score, chosen)


def name_physics(
    split: Split,
    reduced: ReducedModel,
    located: Sequence[Located],
    g_rows: list[int],
    settings: Settings,
    tell: Callable[[int], None] = lambda n: None,
) -> list[Ranked]:
    """Candidates of all laws at the best places, in rising order of score, the best fitted with everything free.

    Linear laws are tried at every place; nonlinear ones at the first places, and only where no linear law explains the
    choosing records to the noise or as well as a free force does. Places should not be look-alikes of each other.
    """
    n_values = effective_values(split.choosing, reduced)

    def rank(candidate: Candidate, found: Located, recovered: Recovered | None = None) -> Ranked:
        return Ranked(candidate, found, score(candidate, split.choosing, settings, n_values), recovered)

    ranked: list[Ranked] = []
    opened: list[tuple[Located, Joint, Recovered, float]] = []
    for found in located:
        tell(1)
        if found.place.kind == "member":
            ranked.append(rank(null_candidate(split, found.fit, "joint_stiffness"), found))
            continue
        joint = open_joint(found.place, reduced, split.whole.band[1], g_rows)
        recovered = recover(split.fitting, joint, found.fit.p)
        if recovered is None:
            continue
        reference = free_reference(split, joint, recovered)
        opened.append((found, joint, recovered, reference))
        ranked += [rank(c, found, recovered) for c in _linear_laws(split, joint, recovered, reference)]
        if found.place.kind == "ground":
            everywhere = open_joint(
                mass_place(reduced.model, found.place.nodes[0]), reduced, split.whole.band[1], g_rows
            )
            mass = fit_mass(split.fitting, split.choosing, everywhere, found.fit.p)
            ranked += [] if mass is None else [rank(replace(mass, reference=reference), found)]
    lowest = min((o[3] for o in opened), default=np.inf)
    enough = max(settings.linear_enough * lowest, settings.consistent)
    if not any(r.candidate.chosen < enough for r in ranked):
        for found, joint, recovered, reference in opened[: settings.nonlinear_places]:
            ranked += [rank(c, found, recovered) for c in _nonlinear_laws(split, joint, recovered, reference)]
    ranked = sorted((r for r in ranked if np.isfinite(r.score)), key=lambda r: r.score)
    return _refine(split, ranked, settings, n_values)


def free_reference(split: Split, joint: Joint, recovered: Recovered) -> float:
    """Misfit a free force at the joint leaves on the choosing records: what the right law can reach at best."""
    fit = recovered.fit
    (seen,) = split.choosing.fit([fit.hypothesis], [(fit.p, fit.x)], iterations=0)
    return np.inf if seen is None else seen.score


def _linear_laws(split: Split, joint: Joint, recovered: Recovered, reference: float) -> list[Candidate]:
    tried = [
        fit_linear(split.fitting, split.choosing, joint, recovered, name, entry)
        for name, entry in laws_for(joint.place.kind)
        if entry.kind == "linear"
    ]
    return [replace(c, reference=reference) for c in tried if c is not None]


def _nonlinear_laws(split: Split, joint: Joint, recovered: Recovered, reference: float) -> list[Candidate]:
    if any(r.frf is not None for r in split.whole.records):  # they show in time records alone
        return []
    s = [np.asarray(2j * np.pi * line.freq, dtype=np.complex128) for line in split.fitting.lines(joint.reduced)]
    begun = [
        (name, start)
        for name, entry in laws_for(joint.place.kind)
        if entry.kind == "nonlinear"
        for start in starts(entry, joint, recovered, s, NONLINEAR_STARTS)
    ]
    begun.sort(key=lambda item: item[1].left)
    worth = [b for b in begun if b[1].left < START_REACH * begun[0][1].left][:MOST_STARTS]
    tried = fit_nonlinear(split.fitting, split.choosing, joint, recovered, worth)
    return [replace(c, reference=reference) for c in tried]


def _refine(split: Split, ranked: list[Ranked], settings: Settings, n_values: float) -> list[Ranked]:
    """Fits the best nonlinear candidates with all unknowns; laws at the same place share where the model ends up."""
    nonlinear = [r for r in ranked if r.candidate.nonlinear]
    best = sorted(nonlinear, key=lambda r: r.candidate.chosen)[: settings.refined]
    out = [r for r in ranked if not any(r is b for b in best)]
    for r in best:
        candidate = judge_nonlinear(split.choosing, refit_nonlinear(split.fitting, r.candidate))
        out.append(replace(r, candidate=candidate, score=score(candidate, split.choosing, settings, n_values)))
    return sorted((r for r in out if np.isfinite(r.score)), key=lambda r: r.score)
