"""Linear laws at a joint: fitted on the lines together with all parameters of the model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from femend.diagnose.fitting.candidates import Candidate, standard_deviations
from femend.diagnose.fitting.collapse import nearest_size
from femend.diagnose.fitting.followed import followed
from femend.diagnose.locating.equivalent import RUGGED, WINDOW, stiffness_scale
from femend.diagnose.locating.free_force import FreeForce
from femend.diagnose.locating.joint import Joint
from femend.diagnose.locating.oversized import oversized
from femend.diagnose.locating.recovered import Recovered
from femend.estimate import Fit, Hypothesis, Problem
from femend.physics import Physics, linear_sizes, physics
from femend.physics.causal import box_spectrum, springpot

FloatArray = NDArray[np.float64]

__all__ = ["closed_by", "companions_alone", "fit_linear", "fit_mass", "judge_linear", "refit_linear", "simple_alone"]

# ln standard deviation of a law's parameters around their start: they are free but for absurd values
LAW_SD = 3.0
# lines a record for trying starts, starts that are followed to the end, tunings of an absorber over the band
FEW_LINES, KEPT, TUNINGS, FINE_TUNINGS = 150, 1, 8, 60
# steps in which the followed one comes to its end: the two parameters of a spectrum may start a factor of 100 off
TO_THE_END, CLOSELY = 60, 1e-3
# fits of a law at a cut at most, each with the elements there as stiff as the one before had them, and relative change
# of that from which another follows
AS_STIFF, AS_SOFT = 3, 1e-3
# starts of a law race each other, then the laws: after so many steps those go on that leave at most this multiple of
# the least. On calibration cases the start that came out best was behind by 7 and 3 times then, laws that ended within
# twice the best by 2
OF_A_LAW, OF_ALL = ((4, 20.0), (6, 6.0)), ((2, 20.0), (6, 8.0))
# unseen misfit of the best law of one parameter, as a multiple of that of the best one of several, from which it is
# tried once more from where that one led
CLEARLY = 1.5
# how much further the start that hardly does anything goes than the smallest (or stiffest) of the others
IDLE = 10.0
# starts fitted to the free force that go on, and starts that go on as they are
FOLLOWED, UNFOLLOWED = 3, 1


def fit_linear(
    problem: Problem,
    choosing: Problem,
    joint: Joint,
    recovered: Recovered,
    laws: Sequence[tuple[str, Physics]],
    updated: FloatArray | None = None,
) -> list[Candidate]:
    """Laws (name as it is reported, entry) from their best starts, judged on the choosing problem; those that cannot be
    fitted at all are left out.

    A free force may move the model's unknowns to where the law alone would never come back from; so two starts are
    tried from the `updated` model's unknowns too, where they are given: the best one, and one that does hardly
    anything, from which no descent can end above the updated model.
    """
    begun = [_begun(problem, joint, recovered, entry, updated) for _, entry in laws]
    whose = [i for i, starts in enumerate(begun) for _ in starts]
    few, begin = problem.sparing(FEW_LINES), [start for starts in begun for start in starts]
    hypotheses = [_hypothesis(joint, laws[i][1], x) for i, (_, x) in zip(whose, begin, strict=True)]
    # where a force far above the noise acts that no spring or mass with a dashpot comes near, in a window too
    sigmas = [0.0, WINDOW * problem.scale()] if _far(recovered.equivalent.score, recovered) else [0.0]
    ranked: list[tuple[int, Fit]] = []
    for sigma in sigmas:
        tried = few.fit(hypotheses, begin, sigma=sigma, iterations=10, heats=OF_A_LAW, groups=whose)
        tries = list(zip(whose, tried, strict=True))
        for i in range(len(laws)):
            own = sorted((f for j, f in tries if j == i and f is not None), key=lambda f: f.cost)
            ranked += [(i, f) for f in own[:KEPT]]
    fits = problem.fit(
        [f.hypothesis for _, f in ranked], [(f.p, f.x) for _, f in ranked], iterations=TO_THE_END, tolerance=CLOSELY,
        heats=OF_ALL,
    )  # fmt: skip
    best: dict[int, Fit] = {}
    for (i, _), fit in zip(ranked, fits, strict=True):
        if fit is not None and (i not in best or fit.cost < best[i].cost):
            best[i] = fit
    return _judged(problem, choosing, joint, [(laws[i], best[i]) for i in sorted(best)])


def _begun(
    problem: Problem, joint: Joint, recovered: Recovered, entry: Physics, updated: FloatArray | None
) -> list[tuple[FloatArray, FloatArray]]:
    """Starts of a law: unknowns of the model and logarithms of the law's parameters."""
    all_starts = _linear_starts(problem, joint, recovered, entry)
    near = [*followed(recovered.free, entry, all_starts, FOLLOWED), *all_starts[:UNFOLLOWED]]
    begun = [(recovered.fit.p, v) for v in near]
    if updated is not None:
        begun += [(updated, near[0]), (updated, _idle(entry, all_starts, joint.place.release is not None))]
    return [(p, np.log([max(v[n], 1e-12) for n in entry.parameter_names])) for p, v in begun]


def _hypothesis(joint: Joint, entry: Physics, x: FloatArray) -> Hypothesis:
    """The joint closed by a law, free but for absurd values, with its start `x` (n_law,) in logarithms."""
    return joint.hypothesis((entry.law or entry.name,), x, np.full(len(x), LAW_SD))


def _far(misfit: float, recovered: Recovered) -> bool:
    """Whether a `misfit` at a place is far from what a free force there leaves, and from the noise."""
    return misfit > RUGGED * max(recovered.fit.score, 1.0)


def simple_alone(
    problem: Problem, choosing: Problem, tried: Sequence[Candidate], recovered: Recovered
) -> list[Candidate]:
    """Where of the laws `tried` at a place one of several parameters explains about as much as a free force, and leaves
    clearly less than all of one: those of one as that one has them, with the model's unknowns from where it brought
    them.

    Laws of more parameters find a way around the minima that a simpler one stops in, and would then be told in its
    place.
    """
    rich = min((c for c in tried if c.n_law > 1), key=lambda c: c.chosen, default=None)
    simple = [c for c in tried if c.n_law == 1]
    if rich is None or rich.joint is None or rich.physics is None or not simple:
        return []
    if _far(rich.fitted, recovered) or min(c.chosen for c in simple) < CLEARLY * rich.chosen:
        return []
    law, values = rich.physics.law or rich.physics.name, dict(rich.values)
    laws = {c.physics.law or c.physics.name: (c.name, c.physics) for c in simple if c.physics is not None}
    sized = [(*named, nearest_size(recovered, law, values, own)[0]) for own, named in laws.items()]
    return _from_there(problem, choosing, rich, sized)


def companions_alone(problem: Problem, choosing: Problem, beside: Candidate) -> list[Candidate]:
    """The spring and the dashpot `beside` a nonlinear law, those that are positive, each as the whole law at its place
    with the model's unknowns from where the nonlinear one brought them; judged on the choosing problem.

    A linear law that stopped short of its minimum would lose against a nonlinear one that does nothing, beside which
    its like went all the way.
    """
    beside_it = (("support_stiffness", beside.k), ("viscous_damper", beside.c))
    return _from_there(problem, choosing, beside, [(name, physics(name), value) for name, value in beside_it])


def _from_there(
    problem: Problem, choosing: Problem, led: Candidate, sized: Sequence[tuple[str, Physics, float]]
) -> list[Candidate]:
    """Laws of one parameter (name as it is reported, entry, size) at the place of a law, fitted from where that one
    `led` the model; those of positive size."""
    joint = led.joint
    assert joint is not None
    laws = [((name, entry), np.log([value])) for name, entry, value in sized if value > 0]
    hypotheses = [_hypothesis(joint, entry, x) for (_, entry), x in laws]
    fits = problem.fit(hypotheses, [(led.p, x) for _, x in laws], iterations=TO_THE_END, tolerance=CLOSELY)
    done = [(law, fit) for (law, _), fit in zip(laws, fits, strict=True) if fit is not None]
    return _judged(problem, choosing, joint, done)


def _judged(
    problem: Problem, choosing: Problem, joint: Joint, fitted: Sequence[tuple[tuple[str, Physics], Fit]]
) -> list[Candidate]:
    """Laws (name as it is reported, entry) at their fits, judged on the choosing problem."""
    made = []
    for (name, entry), fit in fitted:
        values = entry.values_at(fit.x)
        prior = _prior(problem, joint, entry, values, fit.p)
        made.append(Candidate(entry, name, joint, values, fit.p, fit.x, len(fit.x), prior, fit.score, np.nan))
    seen = choosing.fit([closed_by(c) for c in made], [(c.p, c.x) for c in made], iterations=0)
    return [replace(c, chosen=_left(fit)) for c, fit in zip(made, seen, strict=True)]


def _prior(problem: Problem, joint: Joint, entry: Physics, values: Mapping[str, float], p: FloatArray) -> float:
    """Prior cost of the model's unknowns beside a law, and of a mass that is much of the structure's."""
    return problem.prior_cost(joint.reduced, p) + oversized(joint.reduced.model, joint.place, entry, values)


def _left(seen: Fit | None) -> float:
    """Misfit of what was `seen` of a law; of one that breaks down infinite."""
    return np.inf if seen is None else seen.score


def _idle(entry: Physics, begun: Sequence[Mapping[str, float]], released: bool) -> dict[str, float]:
    """The start that changes the model least: the stiffest one where a connection was cut open, else the weakest, and
    still more so."""
    first, sign = entry.parameter_names[0], (1.0 if released else -1.0)
    most = max(begun, key=lambda v: sign * v[first])
    factor = IDLE**sign
    return {q.name: most[q.name] if q.shape else most[q.name] * factor for q in entry.parameters}


def _linear_starts(problem: Problem, joint: Joint, recovered: Recovered, entry: Physics) -> list[dict[str, float]]:
    """Sizes of a law that can matter at the joint: near the equivalent spring and dashpot, and the joint's
    stiffness."""
    scale, omega = stiffness_scale(problem, joint)
    k, c = np.exp(recovered.equivalent.x)
    if recovered.equivalent.hypothesis.laws and recovered.equivalent.hypothesis.laws[0] == "added_mass":
        k = 0.3 * scale
    low, high = 2 * np.pi * problem.band[0], 2 * np.pi * problem.band[1]
    k_all = [k, 0.03 * scale, 0.3 * scale, 3 * scale]
    match entry.law:
        case "support_stiffness":
            return [{"k": x} for x in k_all]
        case "viscous_damper":
            return [{"c": c}, *({"c": x / omega} for x in k_all[1:])]
        case "added_mass":
            return [{"m": x / omega**2} for x in (0.03 * scale, 0.3 * scale, 3 * scale)] + [
                {"m": 0.03 * scale / low**2}
            ]
        case "structural_damping":
            return [{"k": x, "eta": eta} for x in (k, 0.3 * scale) for eta in (0.03, 0.3)]
        case "released_support":
            return [{"g": share * joint.place.support} for share in (0.003, 0.03, 0.2, 0.6, 0.9)]
        case "springpot":
            return [springpot(x, eta, omega) for x in (k, 0.3 * scale) for eta in (0.05, 0.3)]
        case "box_spectrum":
            return [box_spectrum(x, eta, omega) for x in (k, 0.3 * scale) for eta in (0.1, 0.4)]
        case "viscoelastic":
            taus = [1 / low, 1 / omega, 1 / high]
            return [{"k0": 0.5 * x, "k1": 0.5 * x, "tau": t} for x in (k, 0.3 * scale) for t in taus]
        case "tuned_absorber":
            return _absorbers(recovered.free, scale, (low, high))
        case _:
            return linear_sizes(entry, k_all, (low, high))


def fit_mass(
    problem: Problem,
    choosing: Problem,
    joint: Joint,
    p: FloatArray,
    updated: FloatArray | None = None,
    *,
    afar: bool = False,
) -> Candidate | None:
    """A mass that resists in all directions of a node, fitted from unknowns `p` of the model and, the smallest one,
    from those of the `updated` model; from `afar`, from those of the deck as well, on strongly damped lines first."""
    entry = physics("added_mass")
    scale, omega = stiffness_scale(problem, joint)
    if not np.isfinite(scale):
        return None
    means = [np.log([f * scale / omega**2]) for f in (0.003, 0.03, 0.3, 3.0)]
    begun = [(p, m) for m in means] + ([] if updated is None else [(updated, means[0])])
    if afar:
        begun += [(problem.prior(joint.reduced)[0], m) for m in means]
        wide = joint.hypothesis(("added_mass",), means[1], np.full(1, LAW_SD))
        far = problem.sparing(FEW_LINES).continuation(wide, begun)
        begun = [] if far is None else [(far.p, far.x)]
    hypotheses = [joint.hypothesis(("added_mass",), m, np.full(1, LAW_SD)) for _, m in begun]
    few = problem.sparing(FEW_LINES)
    tries = [f for f in few.fit(hypotheses, begun, iterations=10) if f is not None]
    if not tries:
        return None
    best = min(tries, key=lambda f: f.cost)
    (fit,) = problem.fit([best.hypothesis], [(best.p, best.x)], iterations=12)
    return None if fit is None else _judged(problem, choosing, joint, [(("added_mass", entry), fit)])[0]


def _absorbers(free: Sequence[FreeForce], scale: float, band: tuple[float, float]) -> list[dict[str, float]]:
    """Tunings and losses whose force follows the free one best, and a coarse grid of tunings beside them."""
    ranked = []
    told = [(one.s, one.D, -one.F, np.real(np.einsum("kww->kw", one.gram))) for one in free]
    for w in band[0] * (band[1] / band[0]) ** np.linspace(0.0, 1.0, FINE_TUNINGS):
        for loss in (0.01, 0.05, 0.2):
            top = bottom = power = 0.0
            for x, D, F, seen in told:
                shape = (x**2 * (w**2 + 2 * loss * w * x) / (x**2 + 2 * loss * w * x + w**2))[:, None] * D
                top += float((seen * np.real(shape.conj() * F)).sum())
                bottom += float((seen * np.abs(shape) ** 2).sum())
                power += float((seen * np.abs(F) ** 2).sum())
            m = top / bottom
            if m > 0:
                ranked.append((power - top * m, {"m": m, "k": m * w**2, "c": 2 * loss * w * m}))
    ranked.sort(key=lambda item: item[0])
    coarse = band[0] * (band[1] / band[0]) ** ((np.arange(TUNINGS) + 0.5) / TUNINGS)
    grid = [{"m": f * scale / w**2, "k": f * scale, "c": 0.06 * f * scale / w} for w in coarse for f in (0.01, 0.1)]
    return [v for _, v in ranked[:6]] + grid


def judge_linear(choosing: Problem, candidate: Candidate, sigma: float = 0.0) -> Candidate:
    """The candidate with the misfit it leaves on records it has not seen (windowed by exp(-sigma t)), nothing estimated
    there but free decays."""
    (seen,) = choosing.fit([closed_by(candidate)], [(candidate.p, candidate.x)], sigma=sigma, iterations=0)
    return replace(candidate, chosen=_left(seen))


def closed_by(candidate: Candidate) -> Hypothesis:
    """The model with the linear law of a candidate that has a joint, free but for absurd values."""
    assert candidate.joint is not None
    assert candidate.physics is not None
    return _hypothesis(candidate.joint, candidate.physics, candidate.x)


def refit_linear(problem: Problem, candidate: Candidate) -> Candidate:
    """The candidate fitted to all records of the problem, with the covariance of its law; at a cut with the elements
    there as stiff as the fit has them."""
    assert candidate.joint is not None
    assert candidate.physics is not None
    done = _with_its_elements(problem, candidate)
    if done is None:
        return candidate
    joint, fit = done
    covariance = np.asarray(np.linalg.pinv(fit.hessian), dtype=np.float64)
    n_p = len(fit.p)
    values = candidate.physics.values_at(fit.x)
    return replace(
        candidate,
        joint=joint,
        values=values,
        p=fit.p,
        x=fit.x,
        fitted=fit.score,
        prior=_prior(problem, joint, candidate.physics, values, fit.p),
        covariance=covariance[n_p:, n_p:],
        converged=fit.converged,
        p_sd=standard_deviations(covariance, n_p),
    )


def _with_its_elements(problem: Problem, candidate: Candidate) -> tuple[Joint, Fit] | None:
    """The joint of a candidate, cut elements in it as stiff as its fit to all records has them, with that fit; None
    where the model breaks down."""
    assert candidate.joint is not None
    joint, p, x, done = candidate.joint, candidate.p, candidate.x, None
    for _ in range(AS_STIFF):
        softness, joint = joint.softness(p), joint.at(p)
        closed = closed_by(replace(candidate, joint=joint, x=x))
        (fit,) = problem.fit([closed], [(p, x)], iterations=TO_THE_END, tolerance=CLOSELY)
        if fit is None:
            break
        done, p, x = (joint, fit), fit.p, fit.x
        if np.abs(joint.softness(p) / softness - 1).max(initial=0.0) < AS_SOFT:
            break
    return done
