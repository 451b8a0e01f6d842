"""Maximum a posteriori fits of hypotheses: parameters, frequency factors and damping ratios stay free in every one."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from femend import _core
from femend.errors import ModelError
from femend.estimate.lines import FitRecord, Lines, spectral_lines
from femend.estimate.recorder import Recorder
from femend.estimate.swept import pressed
from femend.model import Place, ReducedModel
from femend.model.mesh.form_errors import MODE_SD
from femend.threads import go_on

__all__ = ["DAMPING_SD", "TUNED_ABOVE", "Fit", "Hypothesis", "Problem"]

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

# ln standard deviation of a damping ratio
DAMPING_SD = 0.5
# decays of the windows by which a fit comes down to the unwindowed lines, in units of `Problem.scale`, and how tightly
# the modes' own unknowns are held at each
CONTINUATION = ((30.0, 0.02), (8.0, 0.05), (2.0, 0.3), (0.0, 1.0))
# steps of a search
STEPS = 20
# fits that go on from one of these to the next, and distance in ln units below which two are the same
CONTINUED, SAME = 3, 0.01
# modes up to this multiple of the band's end have a frequency factor and a damping ratio of their own
TUNED_ABOVE = 1.1
# sensors up to which a search takes all the lines it is given, and the fewest lines a mode of the band with more
SENSORS, FEWEST_A_MODE = 40, 3
# lines a record on which fits of so many sensors come from far off, and cost there, as a multiple of the least, up to
# which minima end on all lines
FOLLOWED_LINES, NEARLY = 500, 1.5


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """What may be attached to a reduced model.

    `w` (n_w, r) directions, empty for nothing; `laws` names of linear laws or None for a free force; `compliance`
    (n_w,) in series; `mean`, `sd` prior of the logarithms of the laws' parameters; `at` numbers of the coordinates of
    each law, all without it; `held` (n_w,) stiffness of the coordinates that the reduced model holds already, beyond
    which laws act.
    """

    reduced: ReducedModel
    w: FloatArray
    laws: tuple[str, ...] | None = None
    compliance: FloatArray | None = None
    mean: FloatArray | None = None
    sd: FloatArray | None = None
    at: tuple[tuple[int, ...], ...] | None = None
    held: FloatArray | None = None

    def core(self, load: FloatArray | None = None) -> Any:
        """The core's object; along `load` (n, r) unrecorded forces act too, free on every line."""
        free = 0 if load is None else len(load)
        if len(self.w) + free == 0:
            return _core.Hypothesis()
        w, compliance, at, held = self.w, self.compliance, self.at, self.held
        if load is not None:
            n_w, w = len(w), np.vstack([w, load])
            compliance = np.concatenate([np.zeros(n_w) if compliance is None else compliance, np.zeros(free)])
            held = None if held is None else np.concatenate([held, np.zeros(free)])
            at = (tuple(range(n_w)),) * len(self.laws) if self.laws is not None and at is None else at
        series, mean, sd, inside = [
            None if v is None else [float(x) for x in v] for v in (compliance, self.mean, self.sd, held)
        ]
        laws = None if self.laws is None else list(self.laws)
        return _core.Hypothesis(np.ascontiguousarray(w), laws, series, mean, sd, at, free, inside)


@dataclass(frozen=True, eq=False)
class Fit:
    """A minimum: unknowns `p` (ln factors, ln frequency factors, ln damping ratios), ln law parameters `x`, `cost`
    (tempered squares plus prior), `prior` its prior part, `misfit` a record (mean weighted square of what is left),
    `hessian` Gauss-Newton matrix of half the cost, worked out when it is first asked for."""

    hypothesis: Hypothesis
    p: FloatArray
    x: FloatArray
    cost: float
    prior: float
    misfit: FloatArray
    converged: bool
    system: Any
    lines: Sequence[Any]
    core: Any

    @property
    def score(self) -> float:
        """Mean misfit over the records, the measure that compares hypotheses with different numbers of free forces."""
        return float(np.mean(self.misfit))

    @cached_property
    def hessian(self) -> FloatArray:
        """Gauss-Newton matrix (n, n) of half the cost over p, then x."""
        job = (self.system, self.core, self.p, self.x)
        (solved,) = _core.solve_hypotheses([job], self.lines, 0)
        assert solved is not None, "the minimum was solved before"
        return solved[5]


def _different(fits: Sequence[Fit | None]) -> list[Fit]:
    """Fits that are there, from the best to the worst, without those that stand where a better one does."""
    kept: list[Fit] = []
    for fit in sorted((fit for fit in fits if fit is not None), key=lambda fit: fit.cost):
        z = np.concatenate([fit.p, fit.x])
        if all(np.abs(z - np.concatenate([other.p, other.x])).max(initial=0.0) > SAME for other in kept):
            kept.append(fit)
    return kept


class Problem:
    """The records with a band: makes systems and lines, and fits batches of hypotheses.

    Where the force that moved the structure was not recorded, `load` is where it acts: there a force is free on every
    line, beside whatever is attached, and only how the sensors move relative to each other is compared. `zeta` is the
    median that damping ratios are expected around, `drawn_zeta` that of the deck. The `recorder`
    is the one of all problems made from this one.
    """

    def __init__(
        self,
        records: Sequence[FitRecord],
        band: tuple[float, float],
        zeta: float,
        n_tuned: int,
        limit: int | None = None,
        load: Place | None = None,
        recorder: Recorder | None = None,
        drawn_zeta: float | None = None,
    ) -> None:
        self.records = list(records)
        self.band = band
        self.zeta = zeta
        self.n_tuned = n_tuned
        self.limit = limit
        self.load = load
        self.recorder = recorder or Recorder()
        self.drawn_zeta = zeta if drawn_zeta is None else drawn_zeta
        self._systems: dict[tuple[int, float], tuple[ReducedModel, Any]] = {}
        self._lines: dict[tuple[int, float], tuple[ReducedModel, list[Lines]]] = {}
        self._made: dict[Hashable, Any] = {}

    def thinned(self, limit: int | None) -> Problem:
        """The same problem on at most about `limit` lines a record; on all with None."""
        return self._but(limit=limit)

    def _but(self, **changes: Any) -> Problem:
        """The same problem but for `changes`, by the names of the constructor."""
        own = {"records": self.records, "band": self.band, "zeta": self.zeta, "n_tuned": self.n_tuned}
        own |= {"limit": self.limit, "load": self.load, "recorder": self.recorder, "drawn_zeta": self.drawn_zeta}
        return Problem(**{**own, **changes})

    def driven_at(self, load: Place | None) -> Problem:
        """The same problem with an unrecorded force at `load`; with None without one."""
        return self._but(load=load)

    @property
    def n_free(self) -> int:
        """Number of unrecorded forces."""
        return 0 if self.load is None else self.load.n_w

    def core(self, hypothesis: Hypothesis) -> Any:
        """The core's object of a hypothesis, with the force nobody recorded."""
        if self.load is None:
            return hypothesis.core()
        return hypothesis.core(self.load.w(hypothesis.reduced.V, hypothesis.reduced.V_a))

    def fitted_lines(
        self, hypothesis: Hypothesis, p: FloatArray, x: FloatArray, lines: Sequence[Lines] | None = None
    ) -> list[tuple[ComplexArray, ComplexArray, ComplexArray]]:
        """What a hypothesis predicts at unknowns `p` (n_p,) and ln law parameters `x` (n_law,) on each of the `lines`,
        all records' where none are given.

        Accelerations (K, n_out) with fitted free decays, displacements of the coordinates (K, n_w + n_free) and forces
        on the structure there, those that nobody recorded last. The force of a stiffness that the reduced model holds
        is among them, as it is where the model does not hold it. Raises ModelError where the model cannot be solved.
        """
        reduced = hypothesis.reduced
        cores = [line.core for line in (self.lines(reduced) if lines is None else lines)]
        fitted = list(_core.fitted_lines(self.system(reduced), self.core(hypothesis), cores, p, x))
        if hypothesis.held is None:
            return fitted
        held = np.concatenate([hypothesis.held, np.zeros(self.n_free)])
        return [(y, D, F - held * D) for y, D, F in fitted]

    def sparing(self, limit: int) -> Problem:
        """The same problem on at most about `limit` lines a record, on fewer where many sensors give as many values on
        fewer lines; enough that a few lines stand on every resonance."""
        n_out = min(r.y.shape[0] for r in self.records)
        return self.thinned(max(min(limit, limit * SENSORS // n_out), min(limit, FEWEST_A_MODE * self.n_tuned)))

    def untuned(self) -> Problem:
        """The same problem without frequency factors, with one damping ratio for all modes: enough, and much cheaper,
        where lines are so strongly damped that resonances do not show."""
        return self._but(n_tuned=0)

    def tuned_like(self, p: FloatArray, reduced: ReducedModel) -> FloatArray:
        """Unknowns `p` (n_p,) of the same model in this problem or another, of which one is untuned, as this one has
        them."""
        n = len(reduced.names)
        if len(p) == n + 2 * self.n_tuned + 1:
            return p
        return np.concatenate([p[:n], np.zeros(self.n_tuned), np.full(self.n_tuned + 1, p[-1])])

    def around(self, zeta: float) -> Problem:
        """The same problem with damping ratios expected around `zeta`."""
        return self._but(zeta=zeta)

    def with_modes(self, n_tuned: int) -> Problem:
        """The same problem with so many modes that have a frequency factor and a damping ratio of their own."""
        return self._but(n_tuned=n_tuned)

    def as_drawn(self, reduced: ReducedModel) -> FloatArray:
        """Unknowns (n_p,) of a reduced model as the deck has it."""
        mean = self.prior(reduced)[0]
        mean[len(reduced.names) + self.n_tuned :] = np.log(self.drawn_zeta)
        return mean

    def on(self, records: Sequence[FitRecord]) -> Problem:
        """The same band and priors on other records."""
        return self._but(records=records)

    def pressed(self) -> Problem:
        """The same problem for lines strongly damped by a window: sweeps are pulses in it; itself where none are."""

        def make() -> Problem:
            records = [pressed(r, self.band) for r in self.records]
            unchanged = all(new is r for new, r in zip(records, self.records, strict=True))
            return self if unchanged else self._but(records=records)

        done: Problem = self.kept("pressed", make)
        return done

    def kept(self, key: Hashable, make: Callable[[], Any]) -> Any:
        """What `make` gives, made once for a key; for what belongs to the records."""
        if key not in self._made:
            self._made[key] = make()
        return self._made[key]

    def scale(self) -> float:
        """Decay that belongs to one unit of the continuation, 1/s."""
        return max(self.band[0] / 10.0, 1e-12)

    def prior(self, reduced: ReducedModel) -> tuple[FloatArray, FloatArray]:
        """Prior means and standard deviations of all unknowns of a reduced model."""
        n = len(reduced.names)
        modes = np.full(self.n_tuned, MODE_SD) if reduced.form is None else reduced.form.mode_sds(self.n_tuned)
        mean = np.concatenate([np.zeros(n + self.n_tuned), np.full(self.n_tuned + 1, np.log(self.zeta))])
        sd = np.concatenate([reduced.prior_sd, modes, np.full(self.n_tuned + 1, DAMPING_SD)])
        return mean, sd

    def prior_cost(self, reduced: ReducedModel, p: FloatArray) -> float:
        """Sum of squared prior deviations of the unknowns p."""
        mean, sd = self.prior(reduced)
        return float((((p - mean) / sd) ** 2).sum())

    def system(self, reduced: ReducedModel, held: float = 1.0) -> Any:
        """The core's system of a reduced model, made once; `held` < 1 tightens the priors of the modes' unknowns."""
        kept = self._systems.get((id(reduced), held))
        if kept is None:
            mean, sd = self.prior(reduced)
            sd[len(reduced.names) :] *= held
            terms = [(list(t.exponents), t.K, t.M) for t in reduced.terms]
            n, (rows, of) = len(reduced.names), reduced.dashpots
            core = _core.System(reduced.K_fixed, reduced.M_fixed, terms, n, self.n_tuned, mean, sd, rows, of)
            kept = self._systems[id(reduced), held] = (reduced, core)
        return kept[1]

    def modes(self, reduced: ReducedModel, p: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """omega (r,) in rad/s, damping ratios (r,) and mass-normalised modes (r, r) of a reduced model at unknowns `p`,
        as real modes have them: of the deck's dashpots the damping that they add to each mode, which leaves out how
        they couple modes. Raises ModelError where the model has no modes."""
        omega, zeta, Q, own = self.system(reduced).modal(p)
        if not len(own):
            return omega, zeta, Q
        return omega, zeta + (own**2).sum(axis=0) / (2 * np.maximum(omega, 1e-300)), Q

    def _as_drawn(self, reduced: ReducedModel) -> tuple[FloatArray, FloatArray, FloatArray] | None:
        """Modes at the prior means; None where there are none."""
        try:
            omega, zeta, Q = self.modes(reduced, self.prior(reduced)[0])
        except ModelError:
            return None
        return omega, zeta, Q

    def lines(self, reduced: ReducedModel, sigma: float = 0.0) -> list[Lines]:
        """Lines of all records for a basis, made once."""
        key = (id(reduced.V), sigma)
        kept = self._lines.get(key)
        if kept is None:
            known = self.n_tuned or any(r.frf is not None for r in self.records)
            modal = self._as_drawn(reduced) if known else None
            told = (self.band, sigma, self.limit, modal, self.n_tuned, self.zeta)
            made = [spectral_lines(r, reduced, *told) for r in self.records]
            kept = self._lines[key] = (reduced, made)
        return kept[1]

    def fit(
        self,
        hypotheses: Sequence[Hypothesis],
        starts: Sequence[tuple[FloatArray, FloatArray]] | None = None,
        *,
        sigma: float = 0.0,
        iterations: int = STEPS,
        tolerance: float = 1e-2,
        held: float = 1.0,
        heats: Sequence[tuple[int, float]] = (),
        groups: Sequence[int] = (),
    ) -> list[Fit | None]:
        """Fits each hypothesis from its start (prior means where none are given); None where its model breaks down.

        `starts` are (unknowns, ln law parameters) of each. All hypotheses of a call share one basis. With `held` < 1
        the modes' own frequency factors and damping ratios are held that much tighter, so that far from the minimum the
        parameters do the work.

        With `heats` (steps, ratio) hypotheses race each other: after so many steps those go on whose cost is at most
        this multiple of the lowest in their group (`groups`, a number each; one group without), and the others come
        back as they stand.
        """
        if not hypotheses:
            return []
        go_on()
        if starts is None:
            starts = [self._start(h) for h in hypotheses]
        jobs = [
            (self.system(h.reduced, held), self.core(h), p, x) for h, (p, x) in zip(hypotheses, starts, strict=True)
        ]
        lines = [line.core for line in self.lines(hypotheses[0].reduced, sigma)]
        done = _core.solve_hypotheses(jobs, lines, iterations, tolerance, False, list(heats), list(groups))
        return [
            None if r is None or not np.isfinite(r[2]) else Fit(h, *r[:5], r[7], job[0], lines, job[1])
            for h, job, r in zip(hypotheses, jobs, done, strict=True)
        ]

    def _start(self, hypothesis: Hypothesis) -> tuple[FloatArray, FloatArray]:
        """Prior means of the unknowns and of the ln law parameters."""
        law = np.zeros(0) if hypothesis.mean is None else hypothesis.mean
        return self.prior(hypothesis.reduced)[0], law

    def continuation(
        self,
        hypothesis: Hypothesis,
        starts: Sequence[tuple[FloatArray, FloatArray]] | None = None,
        iterations: int = 15,
        most: int = CONTINUED,
        cheapest: int | None = None,
    ) -> Fit | None:
        """Fit from far off: strongly damped lines first, the recorded last; None where the model breaks down at its
        starts.

        `starts` are (unknowns, ln law parameters), prior means where none are given. Which minimum the recorded lines
        lead to can hang on little, so that what comes of the first start and the `most` best of different minima go on
        from each stage to the next. Of many starts as many as `cheapest`, those that cost least on the most strongly
        damped lines, can be all that are followed: there the cost has few minima.
        """
        starts = [self._start(hypothesis)] if starts is None else starts
        at, few = starts, self._few()
        for factor, held in CONTINUATION:
            problem, sigma = few.pressed() if factor > 0 else few, factor * self.scale()
            if cheapest is not None and len(at) > cheapest:
                seen = problem.fit([hypothesis] * len(at), at, sigma=sigma, iterations=0)
                order = sorted((fit.cost, i) for i, fit in enumerate(seen) if fit is not None)
                at = [at[i] for _, i in order[:cheapest]] or at
            fits = problem.fit([hypothesis] * len(at), at, sigma=sigma, iterations=iterations, held=held)
            done = _different(fits)
            if not done:  # lines that are damped less may break down where a wrong model was taken to
                done = _different(self.fit([hypothesis] * len(starts), starts, iterations=iterations))
                break
            go_on = (fits[0], *(fit for fit in done[:most] if fit is not fits[0]))
            at = [(fit.p, fit.x) for fit in go_on if fit is not None]
        if done and few is not self:
            near = [fit for fit in done if fit.cost <= NEARLY * done[0].cost]
            again = self.fit([hypothesis] * len(near), [(fit.p, fit.x) for fit in near], iterations=iterations)
            done = _different(again) or done
        return done[0] if done else None

    def _few(self) -> Problem:
        """The problem in which a fit from far off is followed: itself, or, where more than `SENSORS` sensors give as
        many values, on fewer lines."""
        if min((r.y.shape[0] for r in self.records), default=0) <= SENSORS:
            return self
        few: Problem = self.kept("few", lambda: self.sparing(FOLLOWED_LINES))
        return self if self.limit is not None and self.limit <= (few.limit or 0) else few
