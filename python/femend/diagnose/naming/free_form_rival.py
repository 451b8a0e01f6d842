"""The free-form rival: a smooth force without a name, in the closed loop at the place of the best named law.

It has the freedom to follow any law, so it has to win what that freedom costs: it is fitted to the records that laws
are fitted to, its bends are held small, every parameter that the records determine has its price, and the choosing
record decides. Where it wins all the same, the law that is missing is none of the catalogue's.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from femend import _core
from femend.diagnose.fitting.candidates import Candidate
from femend.diagnose.fitting.closed_loop import COARSE, COMPANION_SD, FINE, ClosedLoop
from femend.diagnose.fitting.descent import Descent, Reached
from femend.diagnose.fitting.nonlinear import judge_nonlinear, simulate_candidate
from femend.diagnose.fitting.pace import OUTDONE, OUTDONE_SOON
from femend.diagnose.locating.joint import Joint
from femend.diagnose.locating.recovered import Recovered
from femend.diagnose.locating.split import Split
from femend.diagnose.naming.advice import seconds_seen
from femend.diagnose.naming.ranked import Ranked, score
from femend.diagnose.settings import Settings
from femend.estimate import Problem
from femend.physics import PARTS, Surrogate, classify, physics, surrogate_start
from femend.threads import at_once

__all__ = ["Rival", "find_rival", "refit_rival"]

FloatArray = NDArray[np.float64]

# starts that are followed, their steps, those of the best one with all unknowns, and in fine time steps at last
FOLLOWED, FEW, FURTHER, LAST = 2, 3, 10, 4
# places at which it is tried: that of the best named law, and the one where a free force leaves least
PLACES = 2
# classes of elastic forces, and the share of the other part's bent power below which a part is not told
_ELASTIC = ("hardening", "softening", "saturating", "contact-like", "asymmetric")
MINOR = 0.1


@dataclass(frozen=True, eq=False)
class Rival:
    """A free-form force that beats every named law on the choosing record, with the classes that can be told of it."""

    ranked: Ranked
    labels: tuple[str, ...]

    @property
    def advice(self) -> str:
        """What is known of the law that is missing."""
        kind = f"a force that is {', '.join(self.labels)}" if self.labels else "a force of no class that can be told"
        sigma = self.ranked.candidate.sigma
        beginning = (
            f"; it was fitted to about the first {seconds_seen(sigma)} s of the recordings, and explains less of the "
            "rest: record a weaker level too, or short bursts from rest"
            if sigma > 0
            else ""
        )
        return (
            f"what is missing is {kind}: a smooth force without a law explains an unseen recording better than every "
            "law that was tried and is in the final model; its curve in the report shows which other law to ask for "
            f'("laws", by name or "all") or to register{beginning}'
        )


def find_rival(
    split: Split, ranked: Sequence[Ranked], settings: Settings, n_values: float, sigma: float, worth: float
) -> Rival | None:
    """The free-form force where it beats all named laws on the choosing record, windowed by exp(-sigma t), by more than
    `settings.gain_cost` of score and `settings.gain_nonlinear` of misfit; None elsewhere.

    It is tried only where no named law comes as near to a free force at the place as noise allows, and where a score
    below `worth` counts.
    """
    if not ranked or any(r.frf is not None for r in split.whole.records):
        return None
    for base in _bases(ranked, settings, n_values):
        found = _fitted(split, base, settings, n_values, sigma)
        if found is not None and _wins(found, ranked, settings, worth):
            return Rival(found, _classes(split.fitting, found))
    return None


def _wins(rival: Ranked, ranked: Sequence[Ranked], settings: Settings, worth: float) -> bool:
    named = min([r.score for r in ranked] + [worth])
    nearest = min(r.candidate.chosen for r in ranked)
    return bool(
        rival.score < named - settings.gain_cost and np.log(nearest / rival.candidate.chosen) > settings.gain_nonlinear
    )


def _bases(ranked: Sequence[Ranked], settings: Settings, n_values: float) -> list[Ranked]:
    """The best named law of each place where it is worth trying: far from a free force there, if it is at the place of
    the best law; else where that free force is farther from it still."""
    opened = [r for r in ranked if r.recovered is not None and r.candidate.joint is not None]
    at: list[Ranked] = []
    for r in sorted(opened, key=lambda r: r.score):
        if not any(r.recovered is other.recovered for other in at):
            at.append(r)
    nearest = min(r.candidate.chosen for r in ranked)
    enough = max(settings.gain_cost / max(n_values, 1e-12), settings.gain_nonlinear)
    far = [r for r in at if np.log(nearest / _within_reach(r)) > enough]
    first = [r for r in far if r is at[0]]
    free = sorted((r for r in far if r is not at[0]), key=lambda r: r.candidate.reference)
    return [*first, *free][: PLACES if not first or first[0].candidate.reference > 1.0 else 1]


def _within_reach(at: Ranked) -> float:
    """Misfit that a right law can come to: what a free force leaves, or the noise where that force was not found."""
    return float(np.clip(at.candidate.reference, 1e-12, 1.0))


def _fitted(split: Split, base: Ranked, settings: Settings, n_values: float, sigma: float) -> Ranked | None:
    """The free-form force at the place of `base`, from what the place did and from what the named law makes it do."""
    joint, recovered = base.candidate.joint, base.recovered
    assert joint is not None
    assert recovered is not None
    begun: list[tuple[Descent[ClosedLoop], Reached]] = []
    for p, surrogate in _starts(split.fitting, base):
        loop = replace(_loop(split.fitting, joint, surrogate, recovered, sigma), substeps=COARSE)
        descent = _descent(loop, False)
        (at,) = descent.at(np.concatenate([p, surrogate.start(), np.zeros(2)]))
        begun += [(descent, at)] if np.isfinite(at.cost) else []
    begun.sort(key=lambda run: run[1].cost)
    begun = [run for run in begun if run[1].cost <= OUTDONE * begun[0][1].cost]
    few = at_once(lambda run: run[0].run(run[1].z, FEW), begun[:FOLLOWED])
    runs = [(on, there) for (on, _), there in zip(begun, few, strict=False) if there is not None]
    if not runs:
        return None
    descent, reached = min(runs, key=lambda run: run[1].cost)
    for substeps, steps, most in ((COARSE, FURTHER, OUTDONE_SOON), (FINE, LAST, OUTDONE)):
        if base.candidate.sigma == sigma and _misfit(descent, reached) > most * max(base.candidate.fitted, 1.0):
            return None  # with all its freedom it is far behind the law on the records that both are fitted to
        descent = descent.on(replace(descent.loop, substeps=substeps), everything=True)
        more = descent.run(reached.z, steps)
        if more is None:
            return None
        reached = more
    candidate = judge_nonlinear(split.choosing, _candidate(descent, reached))
    candidate = replace(candidate, reference=base.candidate.reference)
    value = score(candidate, settings, n_values)
    return Ranked(candidate, base.located, value, recovered, candidate.name) if np.isfinite(value) else None


def _starts(problem: Problem, base: Ranked) -> list[tuple[FloatArray, Surrogate]]:
    """Unknowns of the model with a free-form force, for each part that may stand beside the curves."""
    recovered = base.recovered
    assert recovered is not None
    motions = [(recovered.fit.p, recovered.d, recovered.v, recovered.f)]
    if base.candidate.nonlinear:
        histories = [simulate_candidate(problem, base.candidate, r) for r in problem.records]
        own = [h.d for h in histories], [h.v for h in histories], [h.f for h in histories]
        if all(np.isfinite(f).all() for f in own[2]):
            motions.append((base.candidate.p, *own))
    steps = [r.dt for r in problem.records]
    out = []
    for p, d, v, f in motions:
        # coordinates of a place with several share their law; the one that moves most tells it
        k = int(np.argmax(sum((x**2).sum(axis=1) for x in f)))
        for part in PARTS[1:]:
            start = surrogate_start([x[k] for x in d], [x[k] for x in v], [x[k] for x in f], steps, part)
            out += [] if start is None else [(p, start)]
    return out


def _loop(problem: Problem, joint: Joint, surrogate: Surrogate, recovered: Recovered, sigma: float) -> ClosedLoop:
    rms = [float(np.sqrt(np.mean([np.mean(x**2) for x in of]))) for of in (recovered.f, recovered.d, recovered.v)]
    return ClosedLoop(problem, joint, "free_form", surrogate, (rms[0] / rms[1], rms[0] / rms[2]), sigma=sigma)


def _descent(loop: ClosedLoop, everything: bool) -> Descent[ClosedLoop]:
    """Priors of the model, of the force's slopes, bends and other parts, and of the companion."""
    assert isinstance(loop.coordinates, Surrogate)
    mean, sd = loop.problem.prior(loop.joint.reduced)
    own_mean, own_sd = loop.coordinates.prior()
    means, sds = [mean, own_mean, np.zeros(2)], [sd, own_sd, np.full(2, COMPANION_SD)]
    return Descent(loop, np.concatenate(means), np.concatenate(sds), len(mean), everything)


def _candidate(descent: Descent[ClosedLoop], reached: Reached) -> Candidate:
    loop = descent.loop
    p, x = descent.split(reached.z)
    values, k, c = loop.values(x)
    return Candidate(
        physics("free_form"),
        "",
        loop.joint,
        values,
        p,
        x,
        _determined(descent, reached),
        loop.problem.prior_cost(loop.joint.reduced, p),
        _misfit(descent, reached),
        np.nan,
        k,
        c,
        coordinates=loop.coordinates,
        extra={"k_scale": loop.scale[0], "c_scale": loop.scale[1]},
        sigma=loop.sigma,
    )


def _misfit(descent: Descent[ClosedLoop], reached: Reached) -> float:
    """Mean weighted square that a force leaves."""
    return float(reached.e @ reached.e) / descent.loop.size()


def _determined(descent: Descent[ClosedLoop], reached: Reached) -> int:
    """Number of the force's parameters that the records determine, not the prior (MacKay 1992, gamma): a curve held
    straight by its prior is two."""
    n = len(reached.z) - descent.n_p
    if reached.H is None:
        return n
    variance = np.diag(np.linalg.pinv(reached.H))[-n:]
    return int(np.ceil(np.clip(1 - variance / descent.sd[-n:] ** 2, 0.0, 1.0).sum()))


def _classes(problem: Problem, rival: Ranked) -> tuple[str, ...]:
    """Classes of the force, read off the motion that it makes itself: those of its elastic and of its dissipative part,
    but for a part that bends so little beside the other that it may be its shadow."""
    histories = [simulate_candidate(problem, rival.candidate, r) for r in problem.records]
    k = int(np.argmax(sum((h.f**2).sum(axis=1) for h in histories)))
    d, v, f = ([getattr(h, what)[k] for h in histories] for what in ("d", "v", "f"))
    if not all(np.isfinite(x).all() for x in (*d, *v, *f)):
        return ()
    dt = problem.records[0].dt
    elastic, dissipative = _bent(rival.candidate, d, v, dt)
    largest = max(elastic, dissipative)
    labels = classify(d, v, f, dt).labels
    return tuple(x for x in labels if (elastic if x in _ELASTIC else dissipative) >= MINOR * largest)


def _bent(candidate: Candidate, d: list[FloatArray], v: list[FloatArray], dt: float) -> tuple[float, float]:
    """Power of the elastic and of the dissipative part of the force beyond a spring and a dashpot."""
    assert candidate.coordinates is not None
    curves, *beside = candidate.coordinates.composite(candidate.values)
    A = np.array([np.concatenate(d), np.concatenate(v)]).T
    over = {axis: {key: 0.0 if key.startswith(other) else value for key, value in curves[1].items()}
            for axis, other in (("d", "fv"), ("v", "fd"))}  # fmt: skip
    power = []
    for laws in ([(curves[0], over["d"])], [(curves[0], over["v"]), *beside]):
        parts = [
            sum(_core.law_force(name, values, x, y, np.zeros_like(x), dt) for name, values in laws)
            for x, y in zip(d, v, strict=True)
        ]
        f = np.concatenate([np.asarray(part) for part in parts])
        rest = f - A @ np.linalg.lstsq(A, f, rcond=None)[0]
        power.append(float(rest @ rest))
    return power[0], power[1]


def refit_rival(problem: Problem, candidate: Candidate) -> Candidate:
    """The free-form force fitted to all records of the problem, all unknowns together."""
    assert candidate.joint is not None
    assert isinstance(candidate.coordinates, Surrogate)
    scale = candidate.extra["k_scale"], candidate.extra["c_scale"]
    loop = ClosedLoop(problem, candidate.joint, "free_form", candidate.coordinates, scale, sigma=candidate.sigma)
    descent = _descent(loop, True)
    reached = descent.run(np.concatenate([candidate.p, candidate.x]), LAST)
    if reached is None or reached.H is None:
        return candidate
    return replace(_candidate(descent, reached), chosen=candidate.chosen, reference=candidate.reference)
