"""Loads of a run: the bearing forces line by line first, then with the structure over the whole run."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from femend.diagnose.staged.prepare import ModesData, RunData, unbalance_of
from femend.diagnose.staged.run_modes import mode_lines
from femend.diagnose.staged.setup import Setup, carried
from femend.errors import LoadError
from femend.estimate.joint import (
    DELAY,
    DataChoice,
    ForceLaws,
    LineForces,
    OdsBlock,
    OdsFrf,
    Posterior,
    RunBlock,
    Unbalance,
    choose_data,
    compare_force_laws,
    line_forces,
    maximise,
    ods_frf,
    run_of,
    simulate_run,
    unbalance_unknowns,
)
from femend.estimate.loads import credible_lines
from femend.model.terms.configured import ConfiguredModel
from femend.model.terms.linear_terms import LinearTerm
from femend.model.terms.unknowns import Unknowns

__all__ = [
    "FEWEST_LINES",
    "LEAD",
    "RunResult",
    "fit_run",
    "ods_lines",
    "ods_lines_of",
    "ods_width",
    "predicted_ods",
    "shapes_block",
    "unbalance_scale",
]

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

# lines of the operating shapes: spacing in Hz as a share of the highest speed, the window each is averaged over, and
# the share of the speed range that is used (at its ends the record is cut)
SPACING, WINDOW, FROM, TO = 0.01, 0.004, 1.25, 0.97
# a run through few speeds has lines closer to each other, so many, as far as its length tells them apart; forces are
# not told from fewer
FEWEST_LINES = 12
# a shaft that was running already did so for this long (s), and what the record's first seconds look like then
LEAD, FIRST = 10.0, 5.0
# else its force set in with the record over one of these times (s); squares by which that must be better
ONSETS, CLEARLY = (0.0, 0.5, 1.0, 2.0, 3.0, 5.0), 20.0
# band of the force law, relative to the highest speed
LAW = (0.2, 0.97)


@dataclass(frozen=True, eq=False)
class RunResult:
    """A run's estimate: posterior over structure and unbalance together, and the forces line by line.

    `before` are the line forces through the model as the stage found it, `after` through the updated one; `exponent`
    and its deviation of |F| ~ Omega^n; `correlation` the largest of an unbalance with an unknown of the structure, and
    that unknown's name; `error` the NRMSE over the compared samples. `laws` holds the law of unbalance against a free
    power of the speed and free forces, None with too few sensors; `choice` tells which sensors were worth fitting in
    which band, and what was left out. `moved` says that the unbalance was found at another node than was told, `doubt`
    that the shaft turns about another axis: the structure is then left as it was.
    """

    data: RunData
    posterior: Posterior
    model: ConfiguredModel
    unbalance: Unbalance
    shapes: OdsFrf
    before: LineForces
    after: LineForces
    exponent: tuple[float, float]
    correlation: tuple[float, str]
    predicted: FloatArray
    error: float
    onset: float | None
    laws: ForceLaws | None = None
    choice: DataChoice | None = None
    moved: str = ""
    doubt: str = ""

    @property
    def other_law(self) -> bool:
        """Do the forces grow with another power of the speed than 2?"""
        return self.data.power[0] != 2.0 and self.laws is not None and self.laws.best == "power"

    def unbalances(self) -> tuple[FloatArray, FloatArray]:
        """U (n_bearings,) and phase (n_bearings,) in rad against the tacho; of forces with another power of the speed
        than 2 what they are at its reference."""
        u, values = self.posterior.unknowns, self.posterior.values
        parts = np.array([values[u.index(n)] for n in self.unbalance.names]).reshape(-1, 2)
        return np.hypot(parts[:, 0], parts[:, 1]), np.arctan2(parts[:, 1], parts[:, 0])


def ods_lines(data: RunData) -> OdsFrf:
    """Operating shapes of a run on even lines between its lowest and highest speed."""
    return ods_frf(data.run, data.y, ods_lines_of(data), ods_width(data))


def ods_lines_of(data: RunData) -> FloatArray:
    """Lines (K,) in Hz of a run's operating shapes; none where the speed is held."""
    low, high = float(data.rev_per_s.min()), float(data.rev_per_s.max())
    span = TO * high - FROM * low
    closest = mode_lines(data)[1]
    spacing = min(SPACING * high, max(span / FEWEST_LINES, closest))
    return np.arange(FROM * low, TO * high, spacing)


def ods_width(data: RunData) -> float:
    """Window in Hz over which a line of the operating shapes is averaged."""
    return max(WINDOW * float(data.rev_per_s.max()), 8.0 / (data.run.padded * data.dt))


def predicted_ods(
    setup: Setup, data: RunData, model: ConfiguredModel, p: FloatArray, unbalance: Unbalance, freq: FloatArray
) -> ComplexArray:
    """Operating shapes (K, n_out) per unit course at `freq` (K,) Hz that the model says at `p` (n,), with the tacho's
    delay."""
    from femend.estimate.joint import receptance

    u = model.unknowns
    values = u.values(p)
    m_r = np.array([values[u.index(n)] for n in unbalance.names])
    s = 2j * np.pi * freq
    # at positive frequencies the sine course is -j times the cosine course
    course = np.array([1.0, -1.0j])
    load = np.einsum("c,ucr,u->r", course, unbalance.pattern(data.bearings(setup, model)), m_r)
    x = receptance(model, p, s, unbalance.speed(freq)).X @ load
    late = np.exp(-s * values[u.index(DELAY)]) * data.growth(freq)
    return np.asarray((x * (s**2 * late)[:, None]) @ setup.rows(model, data.sensors).T)


def fit_run(
    setup: Setup,
    configuration: str,
    data: RunData,
    terms: list[LinearTerm],
    before: Posterior | None,
    *,
    iterations: int = 12,
    structure: bool = True,
    start: FloatArray | None = None,
    checked: Sequence[ModesData] = (),
    law: bool = True,
) -> RunResult:
    """Estimates unbalance and structure together from a run; with `structure` False the unbalance alone, with `law`
    False under forces that grow with the speed squared whatever the run says.

    The sense of rotation and the start come from the forces line by line. `start` overrules what the stage before says
    about the unknowns it has. `checked` are identified modes of this configuration: around those that the model has
    wrong no line of the forces is reliable. Without any all lines may be.
    """
    size = unbalance_scale(setup, data)
    more = unbalance_unknowns(unbalance_of(data, 1), size, data.step)
    unknowns = carried(setup, setup.unknowns(terms, more), before)
    model = setup.model(configuration, unknowns, terms)
    p = unknowns.mean.copy()
    if start is not None:
        p[: len(start)] = start
    shapes = ods_lines(data)
    credible = _credible(setup, model, p, shapes.freq, checked)
    out, bearings = setup.rows(model, data.sensors), data.bearings(setup, model)
    lines, unbalance = _turning(model, data, lambda u: line_forces(model, p, shapes, u, out, bearings, credible))
    choice: DataChoice | None = None
    posterior = _unbalance_only(unknowns, data.block(setup, model, unbalance), p, unbalance)
    if structure:
        data, posterior = _with_law(setup, data, model, posterior, shapes, unbalance, iterations, law)
        predicted = simulate_run(model, posterior.p, data.loaded, unbalance, out, bearings)
        choice = _choice(setup, data, model, posterior.p, shapes, unbalance)
        data = data.without_slips(predicted).without_parts(choice)
        posterior = maximise(
            unknowns, [data.block(setup, model, unbalance)], posterior.p, iterations=max(3, iterations // 2)
        )
    predicted = simulate_run(model, posterior.p, data.loaded, unbalance, out, bearings)
    credible = _credible(setup, model, posterior.p, shapes.freq, checked)
    after = line_forces(model, posterior.p, shapes, unbalance, out, bearings, credible)
    high = float(data.rev_per_s.max())
    counted = data.slips < 10
    error = float(np.linalg.norm((predicted - data.y)[:, counted]) / np.linalg.norm(data.y[:, counted]))
    return RunResult(
        data, posterior, model, unbalance, shapes, lines, after,
        after.exponent(unbalance.sense, (LAW[0] * high, LAW[1] * high)),
        _correlation(posterior, unbalance), predicted, error,
        _onset(data, model, posterior, unbalance, out, bearings),
        _laws(setup, model, posterior, shapes, unbalance, out, bearings),
        choice,
    )  # fmt: skip


def _turning(
    model: ConfiguredModel, data: RunData, forces: Callable[[Unbalance], LineForces]
) -> tuple[LineForces, Unbalance]:
    """The `forces` line by line, and the unbalance that turns in the sense which they tell. Where the deck's own rotors
    turn, the model of a line depends on the sense in which forces are looked for."""
    forward = forces(unbalance_of(data, 1))
    if not model.spins:
        return forward, unbalance_of(data, forward.sense())
    backward = forces(unbalance_of(data, -1))
    if backward.turning(-1) > forward.turning(1):
        return backward, unbalance_of(data, -1)
    return forward, unbalance_of(data, 1)


def _with_law(
    setup: Setup,
    data: RunData,
    model: ConfiguredModel,
    start: Posterior,
    shapes: OdsFrf,
    unbalance: Unbalance,
    iterations: int,
    law: bool,
) -> tuple[RunData, Posterior]:
    """The run with the power of the speed by which its forces grow, and structure and loads that fit it; without `law`
    that of unbalance.

    Another power than 2 must be named with the structure as the stages before left it (one that had to follow a wrong
    law would hide it) and again with the updated one; else the law is that of unbalance.
    """
    out, bearings = setup.rows(model, data.sensors), data.bearings(setup, model)

    def named(posterior: Posterior) -> float:
        laws = _laws(setup, model, posterior, shapes, unbalance, out, bearings)
        return laws["power"].exponent if laws is not None and laws.best == "power" else 2.0

    n = named(start) if law else 2.0
    if n != 2.0:
        grown = data.with_power((n, float(shapes.freq[-1])))
        block = grown.block(setup, model, unbalance)
        own = _unbalance_only(start.unknowns, block, start.p, unbalance)
        own = maximise(start.unknowns, [block], own.p, iterations=iterations)
        if named(own) != 2.0:
            return data.with_power((named(own), float(shapes.freq[-1]))), own
    return data, maximise(start.unknowns, [data.block(setup, model, unbalance)], start.p, iterations=iterations)


def _choice(
    setup: Setup, data: RunData, model: ConfiguredModel, p: FloatArray, shapes: OdsFrf, unbalance: Unbalance
) -> DataChoice:
    """Which sensors tell what in which band, of a structure and loads that have seen the run once."""
    block = shapes_block(setup, data, model, shapes, unbalance)
    grown = data.growth(shapes.freq)[:, None]
    return choose_data(block, p, [str(d) for d in data.sensors], [data.name], noise=(shapes.sd / grown)[:, :, None])


def shapes_block(
    setup: Setup,
    data: RunData,
    model: ConfiguredModel,
    shapes: OdsFrf,
    unbalance: Unbalance,
    weight: float = 1.0,
) -> OdsBlock:
    """Residuals of a run's operating shapes against a configuration, per unit of the force that drove it, with the
    share of a line's mean that no model explains beside the noise."""
    mean = np.sqrt((np.abs(shapes.Y) ** 2).mean(axis=1, keepdims=True))
    grown = data.growth(shapes.freq)[:, None]
    sd = np.hypot(shapes.sd, setup.settings.model_run * mean)
    weighted = OdsFrf(shapes.freq, shapes.Y / grown, sd / grown)
    out, bearings = setup.rows(model, data.sensors), data.bearings(setup, model)
    return OdsBlock(data.name, model, weighted, out, bearings, unbalance, weight)


def _laws(
    setup: Setup,
    model: ConfiguredModel,
    posterior: Posterior,
    shapes: OdsFrf,
    unbalance: Unbalance,
    out: FloatArray,
    bearings: FloatArray,
) -> ForceLaws | None:
    """The law of the bearing forces through the updated structure; None where sensors or lines are too few for it."""
    delay = float(posterior.values[posterior.unknowns.index(DELAY)])
    try:
        return compare_force_laws(
            model, posterior.p, shapes, unbalance, out, bearings, delay=delay, model_error=setup.settings.model_run
        )
    except LoadError:
        return None


def _credible(
    setup: Setup, model: ConfiguredModel, p: FloatArray, freq: FloatArray, checked: Sequence[ModesData]
) -> NDArray[np.bool_]:
    """Lines (K,) on which the model at p has the identified modes right."""
    fine = np.ones(len(freq), dtype=bool)
    if checked:
        computed, mac = (
            np.concatenate(v) for v in zip(*(d.block(setup, model).nearest(p) for d in checked), strict=True)
        )
        own, zeta = (np.concatenate([getattr(d.modes, key) for d in checked]) for key in ("freq", "zeta"))
        fine = credible_lines(freq, own, zeta, computed, mac)
    return fine


def unbalance_scale(setup: Setup, data: RunData) -> float:
    """An unbalance that would shake the whole mass as strongly as was recorded, at the highest speed."""
    mass = setup.free.total_mass
    omega = 2 * np.pi * float(data.rev_per_s.max())
    return float(np.sqrt((data.y**2).mean()) * mass / omega**2)


def _unbalance_only(unknowns: Unknowns, block: RunBlock, p: FloatArray, unbalance: Unbalance) -> Posterior:
    """The unbalances for a structure as it is at p: two steps, since the problem is linear but for the delay."""
    at = np.array([unknowns.index(n) for n in (*unbalance.names, DELAY)])
    p = p.copy()
    cost, H = np.inf, unknowns.precision
    for _ in range(3):
        cost, gradient, A = block.gauss_newton(p, True)
        d = p - unknowns.mean
        H = unknowns.precision + A
        p[at] -= np.linalg.solve(H[np.ix_(at, at)], (gradient + unknowns.precision @ d)[at])
        p[at[-1]] = np.clip(p[at[-1]], -2.0, 2.0)
    return Posterior(unknowns, p, H, {block.name: cost}, 0.0, True, block.n_values)


def _correlation(posterior: Posterior, unbalance: Unbalance) -> tuple[float, str]:
    C = posterior.covariance
    sd = np.sqrt(np.diag(C))
    own = [posterior.unknowns.index(n) for n in unbalance.names]
    skip = {*own, posterior.unknowns.index(DELAY)}
    others = [i for i in range(len(sd)) if i not in skip]
    R = np.abs(C[np.ix_(own, others)] / np.outer(sd[own], sd[others]))
    at = np.unravel_index(int(np.argmax(R)), R.shape)
    return float(R[at]), posterior.unknowns.names[others[int(at[1])]]


def _onset(
    data: RunData,
    model: ConfiguredModel,
    posterior: Posterior,
    unbalance: Unbalance,
    out: FloatArray,
    bearings: FloatArray,
) -> float | None:
    """What the first seconds show: None for a machine that was running, else how long the force took to set in (s).

    Running is what a machine at speed is taken to be unless another beginning explains the samples clearly better.
    """
    first = slice(0, int(round(FIRST / data.dt)))

    def left(steady: float, onset: float) -> float:
        run = run_of(data.speed, data.y.shape[1], data.dt, steady=steady, onset=onset, power=data.power)
        y = simulate_run(model, posterior.p, run, unbalance, out, bearings)
        return float((((y - data.y)[:, first] / data.noise[:, None]) ** 2).sum())

    running = left(LEAD, 0.0)
    squares = {onset: left(0.0, onset) for onset in ONSETS}
    best = min(squares, key=lambda onset: squares[onset])
    inflation = max(1.0, min(running, squares[best]) / (data.y[:, first].size))
    return best if (running - squares[best]) / inflation > CLEARLY else None
