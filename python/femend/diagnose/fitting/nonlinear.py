"""Nonlinear laws at a joint: many starts sorted out on the beginnings of the records, the best followed on."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import takewhile

import numpy as np
from numpy.typing import NDArray

from femend.diagnose.fitting.candidates import Candidate, Start, standard_deviations
from femend.diagnose.fitting.closed_loop import COARSE, FINE, ClosedLoop, History, loop_of, squares
from femend.diagnose.fitting.descent import Descent, Reached
from femend.diagnose.fitting.motion import motion
from femend.diagnose.fitting.pace import OUTDONE_SOON, Pace
from femend.diagnose.fitting.runs import EXPLAINS, FAR, FEW, FIRST, Run, from_shorter, step_by_step, windows
from femend.diagnose.locating.joint import Joint
from femend.diagnose.locating.recovered import Recovered
from femend.estimate import FitRecord, Problem, in_turn
from femend.estimate.lines import TEMPERING
from femend.threads import at_once

__all__ = [
    "as_recorded",
    "candidate_of",
    "cost_of",
    "fit_nonlinear",
    "judge_nonlinear",
    "loop_of_candidate",
    "refit_nonlinear",
    "candidate_motion",
    "simulate_candidate",
]

FloatArray = NDArray[np.float64]

# starts that are followed, and steps with all unknowns
FOLLOWED, JOINT = 7, 10
# steps of a start after which it is given up where a law of another place has outdone it
SOON = 2
# as many steps more, so often, while they take at least this share of the cost of a law that leaves more than this
AGAIN, FALLING = 6, 0.2
# share of the cost that a last step took away below which no more steps are made
AT_REST = 1e-3
# starts whose cost is within this of the least are told apart by how well their law fits the recovered force: what acts
# at large motion alone may not show in the beginning of a record
TIED = 10.0
# a start is followed as long as it leaves at most so many times what the best one leaves, or all before it are lost
BEHIND = 2.0
# share of the cost, too, by which samples picked without a filter have to fit better
CLEARLY = 0.02
# shares of its force with which a law begins that cannot be simulated as it was read off
WEAKER = (0.3, 0.1)
# what a start leaves of the force it was read off, in the least of all, up to which it follows that as well
AS_WELL = 1.1
# misfit of the best law in the first window, as a multiple of what a free force leaves of the records, from which the
# model's unknowns, held there, bend the laws
BENT = 1.3
# a law whose misfit grows by more than this when the window is widened has motion that cannot be followed any longer
LOST = 4.0


def fit_nonlinear(
    problem: Problem,
    choosing: Problem,
    joint: Joint,
    recovered: Recovered,
    begun: Sequence[tuple[str, Start]],
    pace: Pace | None = None,
) -> list[Candidate]:
    """The best fits of several laws and starts at a joint, judged on `choosing`.

    All starts go a few steps on the beginnings of the records (an exponential window), where paths of motion that later
    part are still together; those that get on best go on, where they leave more than a free force does with the model's
    unknowns free there too, to wider windows and the whole records, as far as their motion can be followed: impacts may
    make it depend on its past without limit. Where none comes to explain whole records, and a free force does, they are
    begun anew in shorter windows and followed in small steps.

    Under forces that pass the band in turn the beginning shows the lowest modes alone, and nothing of what a law does
    to others (friction sticks throughout): where a free force explains the recordings, and so has brought the model's
    unknowns near the truth, laws begin on whole records then, and go through windows only if none explains these.

    A law is kept as it was in the widest window it was followed to and, where it explains less there than before, in
    the widest that it explains. Laws that the `pace` of those at other places outdoes are left out; those that explain
    whole records set it.
    """
    pace = Pace() if pace is None else pace
    explained = recovered.fit.score <= EXPLAINS
    swept = explained and all(in_turn(r, problem.band) for r in problem.records)
    directly = _on_whole_records(problem, joint, recovered, begun, pace) if swept else []
    runs, lost = _explaining(directly), list[Run]()
    if not runs:
        ready, runs, lost = _through_windows(problem, joint, recovered, begun, pace)
        if explained and not _explaining(runs):
            stepped = at_once(lambda run: step_by_step(run, recovered), ready)
            runs += [run for run in stepped if run is not None]
        runs += [] if _explaining(runs) else directly
    for run in _explaining(runs):
        pace.keep(run.path)
    kept: dict[tuple[str, bool], Candidate] = {}
    for run in (*runs, *lost):
        candidate = judge_nonlinear(choosing, candidate_of(run.descent.loop, run.start, run.name, run.reached, None))
        own = run.name, run.misfit <= EXPLAINS
        before = kept.get(own)
        if np.isfinite(candidate.fitted) and (before is None or _further(candidate, before)):
            kept[own] = candidate
    return list(kept.values())


def _explaining(runs: Sequence[Run]) -> list[Run]:
    """The runs that explain where they have come to."""
    return [run for run in runs if run.misfit <= EXPLAINS]


def _on_whole_records(
    problem: Problem, joint: Joint, recovered: Recovered, begun: Sequence[tuple[str, Start]], pace: Pace
) -> list[Run]:
    """Laws begun on whole records with the model as the free force left it, in rising order of cost. A law begins
    without a dashpot that feeds motion: over all of a record that grows without bounds."""
    stable = [(name, replace(start, c=max(start.c, 0.0))) for name, start in begun]
    # a law alone, the model held where the free force left it, is no measure for others
    made = at_once(lambda law: _begun(problem, joint, recovered, *law, 0.0, Pace()), stable)
    started = _best_of_each([run for run in made if run is not None])[:FOLLOWED]
    least = min((run.reached.cost for run in started), default=0.0)
    near = [run for run in started if run.reached.cost <= OUTDONE_SOON * least]
    ahead = at_once(lambda run: _widened(run, 0.0), near)
    runs = [run for run in ahead if run is not None and not pace.outdone(0.0, run.reached.cost)]
    least = min((run.reached.cost for run in runs), default=0.0)
    finely = at_once(_in_fine_steps, [run for run in runs if run.reached.cost <= BEHIND * least])
    return sorted(finely, key=lambda r: r.reached.cost)


def _in_fine_steps(run: Run) -> Run:
    """A run in the steps that laws are judged in: a stiff contact or friction leaves more in coarse ones than noise."""
    descent = run.descent.on(replace(run.descent.loop, substeps=FINE))
    reached = descent.run(run.reached.z, FIRST)
    if reached is None:
        return run
    new = replace(run, descent=descent, reached=reached)
    return replace(new, path=(*run.path, (0.0, reached.cost)))


def _through_windows(
    problem: Problem, joint: Joint, recovered: Recovered, begun: Sequence[tuple[str, Start]], pace: Pace
) -> tuple[list[Run], list[Run], list[Run]]:
    """Laws followed from the first window to whole records: all that were ready to be, those that came through, and
    those that were lost where they had explained what is before."""
    first, *wider = windows(problem)

    def begin(laws: Sequence[tuple[str, Start]]) -> list[Run]:
        made = at_once(lambda law: _begun(problem, joint, recovered, *law, first, pace), laws)
        return [run for run in made if run is not None]

    started = begin(begun)
    started += begin(_weaker_too(started))
    runs, lost = _best_of_each(started)[:FOLLOWED], list[Run]()
    runs = [run for run in runs if not pace.outdone(first, run.reached.cost, OUTDONE_SOON)]
    ready = from_shorter(_with_model_free(runs, recovered), recovered)
    runs = ready
    for sigma in wider:
        ahead: list[Run] = []
        for run, new in _all_widened(runs, sigma):
            if ahead and run.reached.cost > BEHIND * runs[0].reached.cost:
                break  # of laws in order, only these are followed as long as one before them can be
            if new is not None and pace.outdone(sigma, new.reached.cost):
                continue
            ahead += [] if new is None else [new]
            lost += [run] if new is None or new.misfit > EXPLAINS >= run.misfit else []
        runs = sorted(ahead, key=lambda r: r.reached.cost)
    return ready, runs, lost


def _begun(
    problem: Problem, joint: Joint, recovered: Recovered, name: str, start: Start, sigma: float, pace: Pace
) -> Run | None:
    """A start after its first steps in the window exp(-sigma t), of a weaker law where it cannot be simulated as it was
    read off: one that softens has motion without bounds from some size on. None where none can be, and where the `pace`
    of laws at other places has outdone it soon."""
    for share in (1.0, *WEAKER):
        begun = start if share == 1.0 else _weaker(start, share)
        loop, x = loop_of(problem, joint, begun, recovered)
        descent = Descent.around(replace(loop, sigma=sigma, substeps=COARSE), x, False)
        soon = SOON if pace.is_set(sigma) else 0
        reached = descent.run(np.concatenate([recovered.fit.p, x]), soon or FEW)
        if reached is not None and pace.outdone(sigma, reached.cost, OUTDONE_SOON):
            return None
        if reached is not None and soon:
            reached = descent.run(reached.z, FEW - soon)
        if reached is not None:
            return Run(name, begun, descent, reached, ((sigma, reached.cost),))
    return None


def _weaker_too(started: Sequence[Run]) -> list[tuple[str, Start]]:
    """Weaker laws of starts that follow what was read off as well as any, but leave far more than another once they are
    simulated: of a motion that jumps the lines in the band show too little, and a law read off it is too strong."""
    least = min((run.reached.cost for run in started), default=0.0)
    nearest = min((run.start.left for run in started if not np.isnan(run.start.left)), default=np.inf)
    return [
        (run.name, _weaker(run.start, share))
        for run in started
        if run.start.left <= AS_WELL * nearest and run.reached.cost > BEHIND * least and run.misfit > FAR
        for share in WEAKER
    ]


def _weaker(start: Start, share: float) -> Start:
    """A start whose law and companion have `share` of their force at any motion."""
    values = {q.name: start.values[q.name] * share ** q.dims[0] for q in start.physics.parameters}
    return replace(start, values=values, k=share * start.k, c=share * start.c)


def _best_of_each(runs: Sequence[Run]) -> list[Run]:
    """The best start of every law and number of sides, in rising order of cost, of those that cost as little in that of
    what the regression left; near copies take no other's place."""
    best: dict[tuple[str, float], Run] = {}
    for run in sorted(runs, key=lambda r: r.reached.cost):
        best.setdefault((run.name, run.start.values.get("sides", 0.0)), run)
    least = min((run.reached.cost for run in best.values()), default=0.0)

    def rank(run: Run) -> tuple[bool, float]:
        if run.reached.cost > least + TIED:
            return True, run.reached.cost
        # friction that sticks was found without a regression
        return False, -np.inf if np.isnan(run.start.left) else run.start.left

    return sorted(best.values(), key=rank)


def _with_model_free(runs: list[Run], recovered: Recovered) -> list[Run]:
    """The runs fitted further in their window with everything free, in rising order of cost, where they leave more than
    a free force does: the model's unknowns are those that it led to, and what they are off by bends a law that has
    nothing but itself to make up for it so far that it is lost in the next window."""
    if not runs or min(run.misfit for run in runs) <= BENT * recovered.fit.score:
        return runs

    def freed(run: Run) -> Run:
        descent = run.descent.on(run.descent.loop, everything=True)
        reached = descent.run(run.reached.z, FIRST)
        return run if reached is None else replace(run, descent=descent, reached=reached)

    return sorted(at_once(freed, runs), key=lambda r: r.reached.cost)


def _further(one: Candidate, other: Candidate) -> bool:
    """Whether a fit holds on a wider window than another, or is better on the same."""
    return (one.sigma, one.fitted) < (other.sigma, other.fitted)


def _all_widened(runs: Sequence[Run], sigma: float) -> Iterator[tuple[Run, Run | None]]:
    """Runs in order, each on a wider window: the first ones close behind the best at once, the others as they are asked
    for."""
    near = list(takewhile(lambda run: run.reached.cost <= BEHIND * runs[0].reached.cost, runs))
    yield from zip(near, at_once(lambda run: _widened(run, sigma), near), strict=True)
    yield from ((run, _widened(run, sigma)) for run in runs[len(near) :])


def _widened(run: Run, sigma: float) -> Run | None:
    """The run on a wider window with everything free; None where it cannot be followed there."""
    descent = run.descent.on(run.descent.loop.at(sigma), everything=True)
    reached = descent.run(run.reached.z, FIRST)
    if reached is None:
        return None
    new = _on_its_way(Run(run.name, run.start, descent, reached))
    new = replace(new, path=(*run.path, (sigma, new.reached.cost)))
    return None if new.misfit > LOST * max(run.misfit, 1.0) else new


def _on_its_way(run: Run) -> Run:
    """The run followed further while it is far from the noise and falls fast: where the model has to go far with the
    law, it is on its way for long."""
    for _ in range(AGAIN):
        if run.misfit <= FAR or run.reached.fell < AT_REST:
            break
        reached = run.descent.run(run.reached.z, FIRST)
        if reached is None:
            break
        fallen, run = 1.0 - reached.cost / run.reached.cost, replace(run, reached=reached)
        if fallen < FALLING:
            break
    return run


def candidate_of(
    loop: ClosedLoop, start: Start, name: str, reached: Reached, covariance: FloatArray | None
) -> Candidate:
    """The candidate that a descent has `reached` in a `loop`, with the `covariance` (n_x, n_x) of its own unknowns."""
    n_p = len(loop.problem.prior(loop.joint.reduced)[0])
    p, x = reached.z[:n_p], reached.z[n_p:]
    values, k, c = loop.values(x)
    return Candidate(
        start.physics,
        name,
        loop.joint,
        values,
        p,
        x,
        loop.n_x,
        loop.problem.prior_cost(loop.joint.reduced, p),
        float(reached.e @ reached.e) / loop.size(),
        np.nan,
        k,
        c,
        np.inf,
        covariance,
        loop.coordinates,
        {"k_scale": loop.scale[0], "c_scale": loop.scale[1]},
        loop.sigma,
    )


def loop_of_candidate(problem: Problem, candidate: Candidate) -> ClosedLoop:
    """The simulation of a nonlinear candidate for the records of a problem, in the window it was fitted in."""
    assert candidate.joint is not None
    assert candidate.physics is not None
    assert candidate.coordinates is not None
    return ClosedLoop(
        problem,
        candidate.joint,
        candidate.physics.law or candidate.physics.name,
        candidate.coordinates,
        (candidate.extra["k_scale"], candidate.extra["c_scale"]),
        sigma=candidate.sigma,
    )


def judge_nonlinear(choosing: Problem, candidate: Candidate, sigma: float | None = None) -> Candidate:
    """The candidate with the misfit it leaves on records it has not seen, in the window it was fitted in or another."""
    loop = loop_of_candidate(choosing, candidate)
    loop = loop if sigma is None else loop.at(sigma)
    (e,), _ = loop.residuals([(candidate.p, candidate.x)])
    return replace(candidate, chosen=squares(e) / loop.size())


def refit_nonlinear(problem: Problem, candidate: Candidate, iterations: int = JOINT) -> Candidate:
    """The candidate fitted to all records of the problem in its window, all unknowns together; in as many steps again
    while it is above the noise and falls fast."""
    loop = loop_of_candidate(problem, candidate)
    descent = Descent.around(loop, candidate.x, True)
    reached = descent.run(np.concatenate([candidate.p, candidate.x]), iterations, thorough=True)
    for _ in range(AGAIN):
        if reached is None or reached.fell < AT_REST or float(reached.e @ reached.e) <= EXPLAINS * loop.size():
            break
        further = descent.run(reached.z, iterations, thorough=True)
        fast = further is not None and further.cost < (1.0 - FALLING) * reached.cost
        reached = reached if further is None else further
        if not fast:
            break
    if reached is None or reached.H is None or candidate.physics is None:
        return candidate
    n_p = len(candidate.p)
    start = Start(candidate.physics, candidate.values, candidate.k, candidate.c, 0.0)
    covariance = np.asarray(np.linalg.pinv(reached.H), dtype=np.float64)
    return replace(
        candidate_of(loop, start, candidate.name, reached, covariance[n_p:, n_p:]),
        chosen=candidate.chosen,
        reference=candidate.reference,
        p_sd=standard_deviations(covariance, n_p),
        whole=covariance,
    )


def as_recorded(problem: Problem, candidate: Candidate, gain: float, enough: float) -> Candidate:
    """A candidate fitted to all records of the problem; fitted again where samples picked without a filter fit better
    by `gain` of the cost and leave a misfit of no more than `enough`, and the recorder is one without a filter from
    then on; nothing is said of it where that is interrupted. A law that leaves more lacks something else, which tells
    nothing of the recorder."""
    recorder = problem.recorder
    if not recorder.filters:
        return candidate
    filtered = cost_of(problem, candidate)
    recorder.filters, believed = False, False
    try:
        if cost_of(problem, candidate) < filtered:
            again = refit_nonlinear(problem, candidate)
            believed = again.fitted <= enough and cost_of(problem, again) < filtered - max(gain, CLEARLY * filtered)
    finally:
        recorder.filters = not believed
    return again if believed else candidate


def cost_of(problem: Problem, candidate: Candidate) -> float:
    """Tempered squares that a candidate leaves, with the prior of the model's unknowns; infinite where it cannot be
    simulated."""
    (e,), _ = loop_of_candidate(problem, candidate).residuals([(candidate.p, candidate.x)])
    return TEMPERING * squares(e) + candidate.prior


def candidate_motion(problem: Problem, candidate: Candidate, record: FitRecord, order: int = 2) -> FloatArray:
    """Accelerations (n_out, n) of a nonlinear candidate for one record's forces, or another derivative of the
    displacements by its `order`."""
    return motion(loop_of_candidate(problem.on([record]), candidate).at(0.0), candidate.p, candidate.x, order)


def simulate_candidate(problem: Problem, candidate: Candidate, record: FitRecord) -> History:
    """Histories of a nonlinear candidate for one record's forces (its responses are not looked at)."""
    return loop_of_candidate(problem.on([record]), candidate).at(0.0).histories([(candidate.p, candidate.x)])[0][0]
