"""Several laws at several places at once, fitted together with the whole model: by simulation, linear ones on lines."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from femend import _core
from femend.diagnose.fitting.candidates import Candidate, standard_deviations
from femend.diagnose.fitting.closed_loop import COARSE, LAW_SD, LawSpec, Loop, companion_prior, squares
from femend.diagnose.fitting.descent import Descent
from femend.diagnose.fitting.known_force import rows_of
from femend.diagnose.fitting.motion import motion
from femend.diagnose.fitting.runs import EXPLAINS, wider_windows, windows
from femend.diagnose.locating.dressed import with_own, with_own_unknowns
from femend.diagnose.locating.joint import Joint, open_joints
from femend.diagnose.locating.locate import Located
from femend.estimate import FitRecord, Hypothesis, Problem
from femend.model import Place, ReducedModel

__all__ = ["Term", "Terms", "fit_terms", "follow_terms", "judge_terms", "refit_terms", "simulate_terms"]

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

# steps in each of the windows by which laws that were found one by one also come to terms, where whole records are too
# far off at first, and those on whole records
STEPS = (6, 6, 6, 40)
# steps in each further window of laws that explain the one before
FURTHER = 10
# share of the cost by which a fit of linear laws has to get on
LINEAR_TOLERANCE = 1e-3
# coordinates that a simulation can carry
MOST_COORDINATES = 6


@dataclass(frozen=True, eq=False)
class Term:
    """A law at a place, as it was found by itself or as it came out together with others; a `bare` one has no linear
    companion beside it, because laws of other terms stand at its place."""

    candidate: Candidate
    located: Located
    bare: bool = False

    @property
    def member(self) -> bool:
        """Whether it is a part of the model: a factor on a member's own stiffness, springs of a soft clamp."""
        return self.candidate.joint is None

    @property
    def place(self) -> Place | None:
        """The place whose coordinates it acts at; None for a part of the model."""
        return None if self.candidate.joint is None else self.candidate.joint.place

    @property
    def n_w(self) -> int:
        """Number of its place's coordinates."""
        return 0 if self.place is None else self.place.n_w

    @property
    def n_x(self) -> int:
        """Number of its fit coordinates outside the model."""
        return 0 if self.member else len(self.candidate.x) - (2 if self.bare else 0)

    @property
    def x(self) -> FloatArray:
        """Its fit coordinates (n_x,)."""
        return self.candidate.x[: self.n_x]

    def values(self, x: FloatArray) -> tuple[dict[str, float], float, float]:
        """Law parameters and companion k, c at the fit coordinates x; those of a linear law are logarithms, by which a
        step may take a fraction above one: it stays there."""
        c = self.candidate
        assert c.physics is not None
        if c.coordinates is None:
            given = zip(c.physics.parameters, np.exp(x).tolist(), strict=True)
            return {q.name: min(v, 1.0) if q.domain == "fraction" else v for q, v in given}, 0.0, 0.0
        n = len(c.coordinates.free)
        if self.bare:
            return c.coordinates.parameters(x), 0.0, 0.0
        return c.coordinates.parameters(x[:n]), float(x[n] * c.extra["k_scale"]), float(x[n + 1] * c.extra["c_scale"])

    def composite(self, x: FloatArray, omega: tuple[float, float]) -> list[LawSpec]:
        """The law at its fit coordinates `x` (n_x,) as the simulation takes it; `omega` are the ends of the band,
        rad/s."""
        c = self.candidate
        assert c.physics is not None
        values, k, damping = self.values(x)
        law = c.physics.law or c.physics.name
        if law == "structural_damping":
            return [("generalised_maxwell_3", relaxing(values, omega))]
        if c.coordinates is None or self.bare:
            return [(law, values)]
        return [(law, values), ("linear", {"k": k, "c": damping, "m": 0.0})]


def relaxing(values: Mapping[str, float], omega: tuple[float, float]) -> dict[str, float]:
    """A generalised Maxwell chain whose loss is about that of structural damping k (1 + i eta) over a band (rad/s).

    Structural damping has no response in time. Branches whose relaxation times are a factor r apart have a loss of
    about pi/(2 ln r) times the stiffness of one of them (Bland, Linear Viscoelasticity, 1960, ch. 2).

    >>> chain = relaxing({"k": 1.0, "eta": 0.1}, (10.0, 1000.0))
    >>> round(float(chain["k1"]), 4)
    0.1466
    """
    tau = np.geomspace(1 / omega[0], 1 / omega[1], 3)
    own = float(2 * np.log(tau[0] / tau[1]) / np.pi * values["k"] * values["eta"])
    branches = {f"{name}{i + 1}": v for i, t in enumerate(tau) for name, v in (("k", own), ("tau", float(t)))}
    return {"k0": max(values["k"] - 1.5 * own, 0.0), **branches}


@dataclass(frozen=True, eq=False)
class TermsLoop(Loop):
    """Terms at coordinates of their places, one place after the other; members are part of the model. Linear laws alone
    are `simulated`, too, where they are to be compared with nonlinear ones as these are worked out."""

    terms: tuple[Term, ...]
    simulated: bool = field(default=False, kw_only=True)

    @property
    def n_x(self) -> int:
        """Fit coordinates of all terms."""
        return sum(t.n_x for t in self.terms)

    def parts(self, x: FloatArray) -> list[FloatArray]:
        """Fit coordinates of every term."""
        return np.split(x, np.cumsum([t.n_x for t in self.terms])[:-1])

    @property
    def acting(self) -> list[tuple[int, ...]]:
        """Numbers of the terms that act at every coordinate: those of one place share its coordinates."""
        at: dict[int, tuple[int, list[int]]] = {}
        for i, term in enumerate(self.terms):
            if term.place is not None:
                at.setdefault(id(term.place), (term.n_w, []))[1].append(i)
        return [tuple(numbers) for n_w, numbers in at.values() for _ in range(n_w)]

    def laws(self, x: FloatArray) -> list[list[LawSpec]]:
        """Composite of every coordinate: the laws of all terms that act there."""
        band = (2 * np.pi * self.problem.band[0], 2 * np.pi * self.problem.band[1])
        parts = self.parts(x)
        return [[spec for i in at for spec in self.terms[i].composite(parts[i], band)] for at in self.acting]

    def prior(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Around `x` for laws, around nothing for the companions of nonlinear ones."""
        found = [
            companion_prior(part) if t.candidate.nonlinear and not t.bare else (part, np.full(len(part), LAW_SD))
            for t, part in zip(self.terms, self.parts(x), strict=True)
        ]
        return np.concatenate([m for m, _ in found]), np.concatenate([s for _, s in found])

    @property
    def linear(self) -> bool:
        """Whether all laws are: then there is nothing to simulate, unless it is asked for."""
        return not self.simulated and not any(t.candidate.nonlinear for t in self.terms)

    def hypothesis(self, x: FloatArray) -> Hypothesis:
        """Linear laws at their coordinates, with a prior around fit coordinates `x` (n_x,)."""
        laws, at = [], []
        for i, term in enumerate(self.terms):
            if term.candidate.physics is not None and not term.member:
                laws.append(term.candidate.physics.law or term.candidate.physics.name)
                at.append(tuple(j for j, numbers in enumerate(self.acting) if i in numbers))
        return replace(self.joint.hypothesis(tuple(laws), *self.prior(x)), at=tuple(at))

    def stiffness(self, x: FloatArray, s: ComplexArray) -> ComplexArray:
        """Dynamic stiffness of the coordinates at which no term is nonlinear."""
        columns = []
        for at, composite in zip(self.acting, self.laws(x), strict=True):
            if any(self.terms[i].candidate.nonlinear for i in at):
                columns.append(np.full(len(s), np.nan, dtype=np.complex128))
            else:
                columns.append(np.sum([_core.law_dynamic_stiffness(law, own, s)[0] for law, own in composite], axis=0))
        return np.array(columns, dtype=np.complex128).reshape(-1, len(s)).T


@dataclass(frozen=True, eq=False)
class Terms:
    """Laws fitted together: `terms` with their values, unknowns p of the model, `score` parts as of a candidate,
    `sigma` (1/s) of the window exp(-sigma t) they are fitted in; `followed` is that of the widest window that they
    explained on the way, where they did so."""

    terms: tuple[Term, ...]
    joint: Joint
    p: FloatArray
    x: FloatArray
    n_law: int
    prior: float
    fitted: float
    chosen: float
    covariance: FloatArray | None = None
    sigma: float = 0.0
    simulated: bool = False
    followed: float = np.inf

    def loop(self, problem: Problem) -> TermsLoop:
        """The simulation of the terms for the records of a problem, in their window."""
        return TermsLoop(problem, self.joint, self.terms, sigma=self.sigma, simulated=self.simulated)


def fit_terms(
    problem: Problem,
    terms: Sequence[Term],
    reduced: ReducedModel,
    g_rows: list[int],
    p: FloatArray,
    sigma: float = 0.0,
    *,
    simulated: bool = False,
) -> Terms | None:
    """Terms fitted together from where each was found, with the model's unknowns from `p` (those of `reduced`), in a
    window exp(-sigma t), linear ones alone `simulated` if asked for; None where they cannot be simulated together."""
    made = _opened(problem, terms, reduced, g_rows, p, sigma)
    if made is None:
        return None
    loop, z = replace(made[0], simulated=simulated), made[1]
    x = z[len(z) - loop.n_x :]
    ends = [_run(loop, x, z, STEPS[-1])]
    start, followed = z, np.inf
    for narrower, steps in zip(windows(problem), STEPS, strict=True):
        if narrower <= sigma:
            break
        reached = _run(replace(loop, sigma=narrower, substeps=COARSE), x, start, steps)
        start = start if reached is None else reached.z
        followed = narrower if reached is not None and reached.fitted <= EXPLAINS else followed
    ends.append(_run(loop, x, start, STEPS[-1]))
    done = [e for e in ends if e is not None]
    return replace(_made(loop, min(done, key=lambda e: e.cost)), followed=followed) if done else None


def refit_terms(problem: Problem, found: Terms, iterations: int = STEPS[-1]) -> Terms:
    """The terms fitted to all records of a problem, with the covariance of their laws."""
    loop = found.loop(problem)
    reached = _run(loop, found.x, np.concatenate([found.p, found.x]), iterations)
    return found if reached is None else replace(_made(loop, reached), chosen=found.chosen)


def follow_terms(fitting: Problem, choosing: Problem, found: Terms, adequate: float) -> Terms:
    """The terms fitted in ever wider windows, a little wider at a time, as long as they leave at most `adequate` of
    what they have not seen there; they were found in a beginning, where paths of motion that later part are still
    together."""
    if found.sigma == 0 or found.loop(fitting).linear:
        return found
    for wider in wider_windows(fitting, found.sigma):
        there = judge_terms(choosing, refit_terms(fitting, replace(found, sigma=wider), FURTHER))
        if there.chosen > adequate:
            break
        found = there
    return found


@dataclass(frozen=True, eq=False)
class _End:
    """Where a fit ended: unknowns z (p, then x), cost, mean weighted square left, and Gauss-Newton matrix of half the
    cost."""

    z: FloatArray
    cost: float
    fitted: float
    H: FloatArray | None


def _run(loop: TermsLoop, x: FloatArray, z: FloatArray, steps: int) -> _End | None:
    """The end of a fit from unknowns `z` with a prior of the laws around `x`; None where it cannot begin."""
    if not loop.linear:
        reached = Descent.around(loop, x, True).run(z, steps)
        return None if reached is None else _End(reached.z, reached.cost, _left(loop, reached.e), reached.H)
    n_p = len(z) - loop.n_x
    (fit,) = loop.problem.fit(
        [loop.hypothesis(x)], [(z[:n_p], z[n_p:])], sigma=loop.sigma, iterations=steps, tolerance=LINEAR_TOLERANCE
    )
    return None if fit is None else _End(np.concatenate([fit.p, fit.x]), fit.cost, fit.score, fit.hessian)


def _left(loop: TermsLoop, e: FloatArray) -> float:
    """Mean weighted square of a residual, infinite where it is not finite."""
    return squares(e) / loop.size()


def judge_terms(choosing: Problem, found: Terms) -> Terms:
    """The terms with the misfit they leave on records they have not seen, in their window."""
    loop = found.loop(choosing)
    if loop.linear:
        (seen,) = choosing.fit([loop.hypothesis(found.x)], [(found.p, found.x)], sigma=found.sigma, iterations=0)
        return replace(found, chosen=np.inf if seen is None else seen.score)
    (e,), _ = loop.residuals([(found.p, found.x)])
    return replace(found, chosen=_left(loop, e))


def simulate_terms(problem: Problem, found: Terms, record: FitRecord, order: int = 2) -> FloatArray:
    """Accelerations (n_out, n) of the model with its terms for one record's forces, or another derivative of the
    displacements by its `order`."""
    return motion(replace(found, sigma=0.0).loop(problem.on([record])), found.p, found.x, order)


def _opened(
    problem: Problem, terms: Sequence[Term], reduced: ReducedModel, g_rows: list[int], p: FloatArray, sigma: float
) -> tuple[TermsLoop, FloatArray] | None:
    attached = [t for t in terms if not t.member]
    places = list({id(t.place): t.place for t in attached if t.place is not None}.values())
    elements = [e for place in places for e in place.elements]
    if not attached or sum(p.n_w for p in places) > MOST_COORDINATES or len(elements) != len(set(elements)):
        return None
    bare, factors = reduced, [np.zeros(0)]
    for t in terms:
        if t.member:
            reduced = with_own(t.located.place, reduced)
            factors.append(t.located.place.logarithms(t.candidate.values))
    start = with_own_unknowns(p, bare, np.concatenate(factors))
    joints = {id(t.place): t.candidate.joint for t in reversed(attached)}
    held = [None if joint is None else joint.held for joint in (joints[id(place)] for place in places)]
    inside = [place for place in reduced.members if place.inside]
    rows = rows_of(inside, g_rows) if inside else g_rows
    joint = open_joints(places, reduced, problem.band[1], rows, held)
    ordered = (*attached, *(t for t in terms if t.member))
    x = np.concatenate([np.zeros(0), *(t.x for t in attached)])
    return TermsLoop(problem, joint, ordered, sigma=sigma), np.concatenate([start, x])


def _made(loop: TermsLoop, reached: _End) -> Terms:
    problem, reduced = loop.problem, loop.joint.reduced
    n_p = len(problem.prior(reduced)[0])
    p, x = reached.z[:n_p], reached.z[n_p:]
    fitted = reached.fitted
    mean, sd = problem.prior(reduced)
    n = len(reduced.names)
    deviations = ((p - mean) / sd) ** 2
    members = slice(n - reduced.extra, n)
    covariance = None if reached.H is None else np.asarray(np.linalg.pinv(reached.H))
    terms, first, member = [], n_p, n - reduced.extra
    for term, part in zip(loop.terms, loop.parts(x), strict=True):
        if term.member:
            place = term.located.place
            own = slice(member, member + place.n_own)
            told = place.slopes(p[own])
            own_covariance = None if covariance is None else covariance[own, own] * np.outer(told, told)
            candidate = replace(
                term.candidate, values=place.values(p[own]), p=p, fitted=fitted, covariance=own_covariance
            )
            member += place.n_own
        else:
            values, k, c = term.values(part)
            own = slice(first, first + term.n_x)
            own_covariance = None if covariance is None else covariance[own, own]
            if term.bare:  # its companion is there, and is nothing
                part = np.concatenate([part, np.zeros(2)])
                own_covariance = None if own_covariance is None else np.pad(own_covariance, (0, 2))
            candidate = replace(
                term.candidate, values=values, k=k, c=c, p=p, x=part, fitted=fitted, covariance=own_covariance,
                p_sd=None if covariance is None else standard_deviations(covariance, n_p),
            )  # fmt: skip
        first += term.n_x
        terms.append(replace(term, candidate=candidate))
    prior = float(deviations.sum() - deviations[members].sum())
    return Terms(
        tuple(terms),
        loop.joint,
        p,
        x,
        loop.n_x + reduced.extra,
        prior,
        fitted,
        np.nan,
        covariance,
        loop.sigma,
        loop.simulated,
    )
