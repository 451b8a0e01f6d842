"""Operating shapes and orders as responses: what they eliminate, their derivatives, and what they refuse."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from femend.data import ODS, Channel, OrderTrack
from femend.dof import Dof
from femend.errors import UpdatingError
from femend.estimate.updating import (
    Configuration,
    Frfs,
    OdsDifferences,
    OrderDifferences,
    Problem,
    Unknown,
    Unknowns,
    deck_system,
    factor,
    mean_shapes,
    modal_system,
    sample,
    sensitivities,
    unknowns_of,
    update,
)
from femend.estimate.updating.order_responses import across
from femend.model import Model

sys.path.insert(0, str(Path(__file__).parents[1]))
from operating_models import BEARINGS, SENSORS, TRUE_FACTORS, channels, receptances, shaft
from updating_models import chain

FREQ = np.array([11.0, 17.0, 24.0, 31.0, 38.0, 46.0, 55.0])
PLACES = [Dof(2, 2), Dof(8, 3)]
UNBALANCE = {2: 4e-4 * np.exp(0.7j), 8: -2e-4j}


@pytest.fixture(scope="module")
def model(tmp_path_factory: pytest.TempPathFactory) -> Model:
    return shaft(tmp_path_factory.mktemp("shaft"))


def noisy(clean: np.ndarray, seed: int, share: float = 0.01) -> tuple[np.ndarray, np.ndarray]:
    """Shapes (n_freq, n_out) with noise in real and imaginary part each, and its deviations."""
    rng = np.random.default_rng(seed)
    sd = np.broadcast_to(share * np.abs(clean).max(axis=1, keepdims=True), clean.shape)
    return clean + sd * (rng.standard_normal(clean.shape) + 1j * rng.standard_normal(clean.shape)), sd


def undamped(factors: np.ndarray) -> np.ndarray:
    """Factors of a system: no damping beside the deck's."""
    return np.concatenate([factors, np.zeros(3)])


def operating(model: Model, seed: int = 1, share: float = 0.01) -> tuple[ODS, np.ndarray]:
    """Accelerations of the true shaft to forces (n_freq, 2) that change from line to line."""
    rng = np.random.default_rng(seed)
    force = rng.standard_normal((FREQ.size, 2)) + 1j * rng.standard_normal((FREQ.size, 2))
    s2 = (2j * np.pi * FREQ[:, None]) ** 2
    clean = s2 * np.einsum("koi,ki->ko", receptances(model, TRUE_FACTORS, FREQ, list(SENSORS), PLACES), force)
    values, sd = noisy(clean, seed + 50, share)
    return ODS(
        "gearbox", FREQ, values.T, channels(SENSORS), "ods-frf", channels(SENSORS)[0], sigma=np.sqrt(2) * sd.T
    ), force


def turning(model: Model, seed: int = 1, *, sense: int = -1, order: float = 1.0, power: float = 2.0) -> ODS:
    """Accelerations of the true shaft to `UNBALANCE`."""
    places, directions = across(tuple(UNBALANCE), 0, sense)
    H = receptances(model, TRUE_FACTORS, FREQ, list(SENSORS), list(places))
    force = directions @ np.array(list(UNBALANCE.values()))
    speed = FREQ / order
    clean = (2j * np.pi * FREQ[:, None]) ** 2 * (H @ force) * (2 * np.pi * speed[:, None]) ** power
    values, sd = noisy(clean, seed)
    return ODS("run-up", FREQ, values.T, channels(SENSORS), "order", order=order, speed=speed, sigma=np.sqrt(2) * sd.T)


def problem_of(model: Model, made: tuple[OdsDifferences | OrderDifferences, Frfs]) -> Problem:
    response, frfs = made
    system = deck_system(model, SENSORS, 0, frfs=frfs)
    return Problem(unknowns_of(model), (Configuration("shaft", system, (response,)),))


def made_of(model: Model, what: str) -> tuple[OdsDifferences | OrderDifferences, Frfs]:
    ods, force = operating(model)
    if what in ("free", "scaled", "known"):
        return OdsDifferences.of(ods, SENSORS, PLACES, force=None if what == "free" else force, amplitudes=what)
    if what == "known order":
        return OrderDifferences.of(turning(model), SENSORS, BEARINGS, 0, sense=-1, unbalance=UNBALANCE)
    return OrderDifferences.of(turning(model), SENSORS, BEARINGS, 0, sense=-1 if what == "order" else 0)


EVERY = ("free", "scaled", "known", "order", "order in no sense", "known order")
HERE = np.array([1.02, 0.93, 1.1])


@pytest.mark.parametrize("what", EVERY)
def test_derivatives_against_differences(model: Model, what: str) -> None:
    """The gradient of the squares is exact; so are the derivatives off what the amplitudes meet."""
    problem = problem_of(model, made_of(model, what))
    here = problem.evaluate(HERE, slopes=True)
    h, ends = 1e-5, []
    for e in np.eye(3):
        ends.append((problem.evaluate(HERE + h * e), problem.evaluate(HERE - h * e)))
    gradient = np.array([(a.squares - b.squares) / (2 * h) for a, b in ends])
    np.testing.assert_allclose(2 * here.jacobian.T @ here.residual, gradient, rtol=1e-6)
    change = np.array([(a.residual - b.residual) / (2 * h) for a, b in ends]).T
    if "known" in what:
        np.testing.assert_allclose(here.jacobian, change, atol=1e-6 * np.abs(change).max())
        assert here.n_values == here.residual.size
        return
    # what the derivative leaves out has no part in the residual, nor in the derivative itself
    left_out = change - here.jacobian
    scale = np.linalg.norm(left_out, axis=0)
    assert (np.abs(here.jacobian.T @ left_out) < 1e-5 * np.outer(np.linalg.norm(here.jacobian, axis=0), scale)).all()
    assert (np.abs(here.residual @ left_out) < 1e-5 * np.linalg.norm(here.residual) * scale).all()
    eliminated = {"free": 2 * FREQ.size, "scaled": FREQ.size, "order": 2, "order in no sense": 4}[what]
    assert here.residual.size - here.n_values == 2 * eliminated


@pytest.mark.parametrize("what", ["free", "order in no sense"])
def test_deviations_are_those_of_the_problem_with_all_amplitudes_as_unknowns(model: Model, what: str) -> None:
    """J^T J is what is left of the whole normal matrix when the amplitudes are eliminated (Schur complement)."""
    response, frfs = made_of(model, what)
    system = deck_system(model, SENSORS, 0, frfs=frfs)
    state = system.solve(undamped(HERE))
    J = Problem(unknowns_of(model), (Configuration("shaft", system, (response,)),)).evaluate(HERE, slopes=True).jacobian
    H, dH = state.value("frf"), state.slope("frf")
    found, sd = response.found(state)
    if what == "free":
        columns, per = np.zeros((*response.shapes.shape, found.size), complex), found.shape[1]
        for k in range(FREQ.size):
            columns[k, :, per * k : per * (k + 1)] = H[k]
        moved = np.einsum("pkoi,ki->pko", dH, found)
    else:
        grown = ((2 * np.pi * response.speed) ** 2)[:, None, None]
        columns = grown * (H @ response.directions)
        moved = (grown * (dH @ response.directions)) @ found
    columns, moved = columns / response.sd[:, :, None], moved / response.sd
    A = columns.reshape(-1, found.size)
    whole = np.vstack([moved[:3].reshape(3, -1), A.T, 1j * A.T])  # amplitudes by real and imaginary part
    whole = np.hstack([whole.real, whole.imag])
    N = whole @ whole.T
    schur = N[:3, :3] - N[:3, 3:] @ np.linalg.solve(N[3:, 3:], N[3:, :3])
    np.testing.assert_allclose(J.T @ J, schur, rtol=1e-7, atol=1e-9 * np.abs(schur).max())
    variance = np.diag(np.linalg.inv(N[3:, 3:]))[: found.size]
    np.testing.assert_allclose(sd.ravel(), np.sqrt(variance), rtol=1e-6)


@pytest.mark.parametrize("what", EVERY)
def test_true_parameters_come_back_within_their_deviations(model: Model, what: str) -> None:
    result = update(problem_of(model, made_of(model, what)))
    assert result.status == "converged"
    off = (result.p - TRUE_FACTORS) / np.array([result.sd[n] for n in ("E", "k", "c")])
    assert np.abs(off).max() < 3.5, off
    assert result.sd["k"] < 0.05
    assert result.after.squares / result.after.n_values == pytest.approx(1.0, abs=0.4)
    told = sensitivities(result.problem)
    assert told.table.shape == (result.after.residual.size, 3)


def test_deviations_hold_over_many_noises(model: Model) -> None:
    """Errors over deviations have mean square one: nothing is taken for known that the amplitudes could do."""
    z = []
    for seed in range(100, 140):
        ods, _ = operating(model, seed, share=0.02)
        result = update(problem_of(model, OdsDifferences.of(ods, SENSORS, PLACES)))
        z.append((result.p - TRUE_FACTORS) / np.array([result.sd[n] for n in ("E", "k", "c")]))
    # priors lie off the truth and draw a little; 120 squares of z scatter by 0.13 about one
    assert np.mean(np.square(z)) == pytest.approx(1.0, abs=0.4)


def test_amplitudes_that_nobody_measured_are_found(model: Model) -> None:
    ods, force = operating(model)
    response, frfs = OdsDifferences.of(ods, SENSORS, [Dof(2, 2, -1), Dof(8, 3)])
    found, sd = response.found(deck_system(model, SENSORS, 0, frfs=frfs).solve(undamped(TRUE_FACTORS)))
    off = np.concatenate([x for part in ((found * [-1, 1] - force) / sd,) for x in (part.real, part.imag)])
    assert np.mean(off**2) == pytest.approx(1.0, abs=0.5)  # 28 squares
    order, frfs = OrderDifferences.of(turning(model), SENSORS, BEARINGS, 0, sense=-1)
    u, sd = order.found(deck_system(model, SENSORS, 0, frfs=frfs).solve(undamped(TRUE_FACTORS)))
    assert (np.abs(u - np.array(list(UNBALANCE.values()))) < 4 * sd).all()
    assert (sd < 0.05 * np.abs(u)).all()


def test_a_wrong_unbalance_spoils_what_a_free_one_finds(model: Model) -> None:
    wrong = {2: 1.3 * UNBALANCE[2], 8: UNBALANCE[8] * np.exp(0.4j)}
    held = update(
        problem_of(model, OrderDifferences.of(turning(model), SENSORS, BEARINGS, 0, sense=-1, unbalance=wrong))
    )
    free = update(problem_of(model, OrderDifferences.of(turning(model), SENSORS, BEARINGS, 0, sense=-1)))
    truth = dict(zip(("E", "k", "c"), TRUE_FACTORS, strict=True))
    assert max(abs(held.values[n] - truth[n]) / held.sd[n] for n in truth) > 10
    assert max(abs(free.values[n] - truth[n]) / free.sd[n] for n in truth) < 3.5
    assert held.after.squares > 20 * free.after.squares


def test_the_sense_of_rotation_and_the_growth_of_forces_matter(model: Model) -> None:
    def left(run: ODS, **said: float) -> float:
        result = update(problem_of(model, OrderDifferences.of(run, SENSORS, BEARINGS, 0, **said)))
        return result.after.squares / result.after.n_values

    backward = turning(model)
    assert left(backward, sense=0) < 1.5
    # a shaft alike in both directions answers to backward forces with another phase between them alone
    assert left(backward, sense=-1) < 1.5 < 20 < left(backward, sense=1)
    second = turning(model, order=2.0, power=1.0)
    assert left(second, sense=0, order=2.0, power=1.0) < 1.5
    assert left(second, sense=0, order=2.0) > 20


def test_lines_that_are_means_over_a_width(model: Model) -> None:
    """The model is averaged over the line as the measurement is: without, a narrow resonance looks damped."""
    places, directions = across(tuple(UNBALANCE), 0, -1)
    fine = FREQ[:, None] + np.linspace(-1.0, 1.0, 401)
    H = receptances(model, TRUE_FACTORS, fine.ravel(), list(SENSORS), list(places))
    a = ((2j * np.pi * fine.ravel()[:, None]) ** 2 * (H @ directions @ list(UNBALANCE.values()))).reshape(7, 401, -1)
    course = (2 * np.pi * FREQ[:, None]) ** 2
    wide = ODS("wide", FREQ, (a.mean(axis=1) * course).T, channels(SENSORS), "order", order=1.0, speed=FREQ)
    said = {"sense": -1, "unbalance": UNBALANCE, "sd": 1e-3}
    state = {}
    for width in (0.0, 2.0):
        response, frfs = OrderDifferences.of(wide, SENSORS, BEARINGS, 0, width=width, **said)
        system = deck_system(model, SENSORS, 0, frfs=frfs)
        assert frfs.freq.size == (35 if width else 7)
        state[width] = np.abs(response.compare(system.solve(undamped(TRUE_FACTORS)), None, False).residual).max()
    assert state[2.0] < 0.05 * state[0.0]
    problem = problem_of(model, OrderDifferences.of(wide, SENSORS, BEARINGS, 0, width=2.0, sd=0.01))
    here = problem.evaluate(HERE, slopes=True)
    ends = [[problem.evaluate(HERE + x * e).squares for x in (1e-5, -1e-5)] for e in np.eye(3)]
    np.testing.assert_allclose(2 * here.jacobian.T @ here.residual, [(a - b) / 2e-5 for a, b in ends], rtol=1e-6)


def driven_chain(noise: float) -> Problem:
    """The chain under a force of unknown amplitudes on its last mass, which carries the factor m; 12 lines."""
    sensors = [Dof(n, 2) for n in range(1, 7)]
    freq = np.linspace(1.0, 9.0, 12)
    truth = np.array([0.8, 1.2, 0.95, 1.1, 0.0, 0.0, 0.04])
    made = Frfs(freq, tuple(range(6)), (5,), "accelerance")
    H = modal_system(chain(), list(range(6)), 0, frfs=made).solve(truth).value("frf")[:, :, 0]
    shapes, sd = noisy(H, 4, 0.01)
    ods = ODS("last mass driven", freq, (shapes if noise else H).T, channels(tuple(sensors)), "ods")
    response, frfs = OdsDifferences.of(ods, sensors, [Dof(6, 2)], sd=sd)
    unknowns = Unknowns.of([*(factor(n, 0.3) for n in ("k1", "k2", "k3", "m")), Unknown("eta", 0.05, sd=1.0)])
    system = modal_system(chain(), list(range(6)), 0, frfs=frfs)
    return Problem(unknowns, (Configuration("driven", system, (response,)),))


def test_a_free_force_takes_up_what_acts_at_its_own_place() -> None:
    """A mass or spring at the only driven place cannot be told from another force there."""
    problem = driven_chain(0.0)
    assert sensitivities(problem).insensitive == ("m",)
    result = update(problem)
    found = [result.values[n] for n in ("k1", "k2", "k3", "eta")]
    np.testing.assert_allclose(found, [0.8, 1.2, 0.95, 0.04], rtol=2e-3)
    assert result.values["m"] == pytest.approx(1.0, abs=1e-6)
    assert result.sd["m"] == pytest.approx(0.3, rel=1e-6)


def test_draws_from_the_posterior_scatter_as_laplace_has_it() -> None:
    problem = driven_chain(0.01)
    result, draws = update(problem), sample(problem, 200, seed=1)
    values = np.array([problem.unknowns.values(p) for p in draws.p])
    for i, name in enumerate(problem.unknowns.names):
        assert values[:, i].mean() == pytest.approx(result.values[name], abs=0.4 * result.sd[name]), name
        assert values[:, i].std() == pytest.approx(result.sd[name], rel=0.25), name


def test_signs_quantities_and_sensors_that_were_not_there(model: Model) -> None:
    ods, force = operating(model)
    s = 2j * np.pi * FREQ
    mixed, signs = list(ods.channels), np.ones(len(SENSORS))
    values, sigma = ods.shapes.copy(), ods.sigma.copy()
    mixed[0] = Channel(Dof(2, 2), "displacement", "m")
    values[0], sigma[0] = values[0] / s**2, sigma[0] / np.abs(s) ** 2
    mixed[3] = Channel(Dof(5, 3, -1), "velocity", "m/s")
    values[3], sigma[3] = -values[3] / s, sigma[3] / np.abs(s)
    signs[4] = -1
    turned = ODS("gearbox", FREQ, values, tuple(mixed), "ods-frf", mixed[1], sigma=sigma)
    system_sensors = [Dof(d.node, d.component, int(x)) for d, x in zip(SENSORS, signs, strict=True)]

    def at_truth(shapes: ODS, sensors: list[Dof] | tuple[Dof, ...]) -> tuple[np.ndarray, Frfs]:
        response, frfs = OdsDifferences.of(shapes, sensors, PLACES, force=force, amplitudes="known")
        state = deck_system(model, sensors, 0, frfs=frfs).solve(undamped(TRUE_FACTORS))
        return response.compare(state, None, False).residual.reshape(2, FREQ.size, -1), frfs

    plain, _ = at_truth(ods, SENSORS)
    other, frfs = at_truth(turned, system_sensors)
    assert frfs.kind == "accelerance"
    np.testing.assert_allclose(np.sum(other**2, axis=0), np.sum(plain**2, axis=0), rtol=1e-8)
    velocities = ods.select([0, 1, 2])
    velocities = ODS("v", FREQ, velocities.shapes, channels(SENSORS[:3], "velocity"), "ods", sigma=velocities.sigma)
    assert OdsDifferences.of(velocities, SENSORS, PLACES)[1].kind == "mobility"

    response, frfs = OdsDifferences.of(ods, SENSORS, PLACES)
    shapes = response.shapes.copy()
    shapes[2, 1] = np.nan
    less = OdsDifferences(shapes, response.sd, FREQ, (1, 1))
    here = problem_of(model, (less, frfs)).evaluate(HERE, slopes=True)
    assert here.residual.size == 2 * (shapes.size - 1)
    assert np.isfinite(here.jacobian).all()


def test_scatter_is_what_weighs() -> None:
    """sigma is of real and imaginary part together; a floor is added in squares; means of one value borrow."""
    two = channels((Dof(2, 2), Dof(5, 2)))
    shapes = np.array([[3.0, 4.0], [1.0, 2.0]])
    ods = ODS("x", [10.0, 20.0], shapes, two, "order", sigma=[[0.2, 0.0], [0.4, 0.6]], order=1.0, speed=[10.0, 20.0])
    response, _ = OdsDifferences.of(ods, [Dof(2, 2), Dof(5, 2)], [Dof(2, 2)])
    np.testing.assert_allclose(response.sd, np.array([[0.2, 0.4], [0.2, 0.6]]) / np.sqrt(2))
    with_floor, _ = OdsDifferences.of(ods, [Dof(2, 2), Dof(5, 2)], [Dof(2, 2)], floor=0.1)
    np.testing.assert_allclose(with_floor.sd, np.hypot(response.sd, [[0.3], [0.4]]))


def test_the_mean_of_repeated_shapes_scatters_as_theory_has_it() -> None:
    rng = np.random.default_rng(2)
    shape, sd, n = rng.standard_normal((6, 40)) + 1j * rng.standard_normal((6, 40)), 0.05, 8
    six = channels(tuple(Dof(i, 2) for i in range(1, 7)))

    def repeated(kind: str, levels: np.ndarray) -> ODS:
        noise = sd * (rng.standard_normal((n, 6, 40)) + 1j * rng.standard_normal((n, 6, 40)))
        more = {"order": 1.0, "speed": np.arange(1.0, 41.0)} if kind == "order" else {}
        return mean_shapes(
            [ODS(f"r{i}", np.arange(1.0, 41.0), levels[i] * shape + noise[i], six, kind, **more) for i in range(n)]
        )

    own = rng.uniform(0.5, 2.0, (n, 1, 40)) * np.exp(2j * np.pi * rng.uniform(size=(n, 1, 40)))
    for mean in (repeated("order", np.ones((n, 1, 40))), repeated("ods", own)):
        assert mean.sigma is not None
        scale = (mean.shapes.conj() * shape).sum(0) / (np.abs(mean.shapes) ** 2).sum(0)
        off = mean.shapes * scale - shape if mean.kind == "ods" else mean.shapes - shape
        # one complex factor a line was fitted to six values
        share = 5 / 6 if mean.kind == "ods" else 1.0
        told = mean.sigma * np.abs(scale) if mean.kind == "ods" else mean.sigma
        assert np.mean(np.abs(off) ** 2) / np.mean(told**2) == pytest.approx(share, rel=0.25)


def unfit_sizes(response: OdsDifferences, order: OrderDifferences, force: np.ndarray) -> list[tuple[str, object]]:
    y, sd, zero = response.shapes, response.sd, np.array([0.0, *FREQ[1:]])
    return [
        ("line 1 is at 0 Hz; a shape at rest has no phase", lambda: OdsDifferences(y, sd, zero, (1, 1))),
        ("line 1 is at 0 rev/s", lambda: OrderDifferences(y, sd, zero, order.directions)),
        ("nothing was measured", lambda: OdsDifferences(y[:0], 1.0, FREQ[:0])),
        ("nothing was measured", lambda: OdsDifferences(y[:, :0], 1.0, FREQ)),
        (r"have shape \(7, 8\) for 6 lines", lambda: OdsDifferences(y, sd, FREQ[:6], (1, 1))),
        (
            r"2 complex values on line 1 at 11 Hz are met by 2 free amplitudes",
            lambda: OdsDifferences(y[:, :2], 1.0, FREQ, (1, 1)),
        ),
        ("take 5 values or more", lambda: OrderDifferences(y[:1, :4], 1.0, [5.0], order.directions)),
        ("is 0 at \\[0, 0\\]: a value without scatter", lambda: OdsDifferences(y, 0.0 * sd, FREQ, (1, 1))),
        ("scaled ones take one", lambda: OdsDifferences(y, sd, FREQ, (1, 1), None, "scaled")),
        ("free amplitudes take no `force`", lambda: OdsDifferences(y, sd, FREQ, (1, 1), force)),
        ("'some' are none of free, scaled, known", lambda: OdsDifferences(y, sd, FREQ, (1, 1), force, "some")),
        (r"here \(7, 2\)", lambda: OdsDifferences(y, sd, FREQ, (1, 1), force[:, :1], "known")),
        ("holds what is no number", lambda: OdsDifferences(y, sd, FREQ, (1, 1), np.nan * force, "known")),
        ("signs [0.0, 1.0] of the inputs".replace("[", r"\["), lambda: OdsDifferences(y, sd, FREQ, (0, 1))),
        ("to the power inf", lambda: OrderDifferences(y, sd, FREQ, order.directions, power=np.inf)),
        (r"directions of forces have shape \(2,\)", lambda: OrderDifferences(y, sd, FREQ, np.ones(2))),
        ("one for each of the 4 directions", lambda: OrderDifferences(y, sd, FREQ, order.directions, np.ones(2))),
    ]


def bad_shapes(model: Model) -> list[tuple[str, object]]:
    ods, force = operating(model)
    response, _ = OdsDifferences.of(ods, SENSORS, PLACES)
    order, _ = OrderDifferences.of(turning(model), SENSORS, BEARINGS, 0)
    y, sd = response.shapes, response.sd
    nothing = y.copy()
    nothing[3] = np.nan
    of, run = OdsDifferences.of, OrderDifferences.of
    stranger = ODS("x", FREQ, ods.shapes[:1], channels((Dof(4, 2),)), "ods", sigma=ods.sigma[:1])
    strain = ODS("x", FREQ, ods.shapes[:1], (Channel(Dof(2, 2), "strain", ""),), "ods", sigma=ods.sigma[:1])
    twice = ODS("x", FREQ, ods.shapes[:2], channels((Dof(2, 2), Dof(2, 2, -1))), "ods", sigma=ods.sigma[:2])
    bare = ODS("x", FREQ, ods.shapes, ods.channels, "ods")
    still = ODS("x", FREQ, ods.shapes[:3], ods.channels[:3], "ods", sigma=np.zeros((3, FREQ.size)))
    return [
        *unfit_sizes(response, order, force),
        (
            "no sensor has a value on line 4 at 31 Hz; leave the line out",
            lambda: OdsDifferences(nothing, sd, FREQ, (1, 1)),
        ),
        (r"acceleration 4:\+Y is at none of the system's 8 sensors", lambda: of(stranger, SENSORS, PLACES)),
        ("is no displacement, velocity, acceleration", lambda: of(strain, SENSORS, PLACES)),
        (r"two channels are at 2:\+Y", lambda: of(twice, SENSORS, PLACES)),
        ("hold no scatter", lambda: of(bare, SENSORS, PLACES)),
        ("has a scatter of 0 on all lines", lambda: of(still, SENSORS, PLACES)),
        ("there is no channel", lambda: of(ods.select([]), SENSORS, PLACES)),
        ("floor -1 is a share", lambda: of(ods, SENSORS, PLACES, floor=-1.0)),
        (r"a force acts at 9:\+Y, which is none of the system's 8 sensors", lambda: of(ods, SENSORS, [Dof(9, 2)])),
        ("no place of a force is given", lambda: of(ods, SENSORS, [])),
        ("they are 'ods-frf'", lambda: run(ods, SENSORS, BEARINGS, 0)),
        ("they are of order 1; take", lambda: run(turning(model), SENSORS, BEARINGS, 0, order=2.0)),
        ("turns in a sense", lambda: run(turning(model), SENSORS, BEARINGS, 0, unbalance=UNBALANCE)),
        ("names no node", lambda: run(turning(model), SENSORS, BEARINGS, 0, sense=1, unbalance={})),
        ("are means over 22 Hz, the lowest is at 11 Hz", lambda: run(turning(model), SENSORS, BEARINGS, 0, width=22.0)),
        ("along axis 3", lambda: run(turning(model), SENSORS, BEARINGS, 3)),
        ("sense 2 of rotation", lambda: run(turning(model), SENSORS, BEARINGS, 0, sense=2)),
        (r"bearings at nodes \[2, 2\]", lambda: run(turning(model), SENSORS, (2, 2), 0)),
        ("scatter takes two recordings or more, there are 1", lambda: mean_shapes([ods])),
        ("stand on 6 lines", lambda: mean_shapes([ods, ods.lines(np.arange(6))])),
        ("have other channels", lambda: mean_shapes([ods, ods.select([1, 0])])),
        ("the forces are known", lambda: OdsDifferences(y, sd, FREQ, (1, 1), force, "known").found(None)),  # type: ignore[arg-type]
    ]


def test_bad_input_is_told_with_what_to_do(model: Model) -> None:
    for said, call in bad_shapes(model):
        with pytest.raises(UpdatingError, match=said):
            call()  # type: ignore[operator]


def test_another_order_than_tracked_is_told(model: Model) -> None:
    run = turning(model)
    track = OrderTrack("run", [1.0], FREQ, FREQ, FREQ[None], run.shapes[None], run.channels)
    with pytest.raises(KeyError, match="order 2 of shaft 0 was not tracked"):
        OrderDifferences.of(track, SENSORS, BEARINGS, 0, order=2.0)


def test_forces_that_cannot_be_told_are_refused_with_their_line(model: Model) -> None:
    ods, _ = operating(model)
    same = (*SENSORS, Dof(2, 2))
    # the same place twice
    response, frfs = OdsDifferences.of(ods, SENSORS, [Dof(2, 2), Dof(2, 2, -1)])
    problem = problem_of(model, (response, frfs))
    with pytest.raises(UpdatingError, match="do not tell the 2 forces apart on line 1 at 11 Hz"):
        problem.evaluate(HERE)
    # forces along Y move nothing in Z
    in_z = ods.select([i for i, d in enumerate(SENSORS) if d.component == 3])
    with pytest.raises(UpdatingError, match="force 1 of 1 moves no sensor on line 1 at 11 Hz"):
        problem_of(model, OdsDifferences.of(in_z, same[:-1], [Dof(2, 2)])).evaluate(HERE)
    # lines of another system
    other = Frfs(frfs.freq[:3], frfs.outputs, frfs.inputs, frfs.kind)
    with pytest.raises(UpdatingError, match=r"make FRFs of shape \(7, 8, 2\), \(3, 8, 2\) computed"):
        problem_of(model, (response, other)).evaluate(HERE)


def test_fewer_values_than_unknowns_counts_what_amplitudes_take_up(model: Model) -> None:
    """Six values, of which the one amplitude meets two: four for five unknowns without prior."""
    ods, _ = operating(model)
    one = ods.lines(np.array([2])).select([0, 2, 4])
    response, frfs = OdsDifferences.of(one, SENSORS, PLACES[:1])
    system = deck_system(model, SENSORS, 0, frfs=frfs)
    names = ("E", "k", "c", "alpha", "beta")
    unknowns = Unknowns.of([factor(n, np.inf) for n in names])
    with pytest.raises(UpdatingError, match="4 paired values and 0 priors for 5 unknowns"):
        update(Problem(unknowns, (Configuration("shaft", system, (response,)),)))


def test_a_history_goes_on_only_with_the_same_measurement(model: Model, tmp_path: Path) -> None:
    problem = problem_of(model, made_of(model, "order"))
    first = update(problem, iterations=2, history=tmp_path / "run.json")
    again = update(problem, history=tmp_path / "run.json", resume=True)
    assert again.history[: len(first.history)] == first.history
    assert again.after.cost == pytest.approx(update(problem).after.cost, rel=1e-6)
    with pytest.raises(UpdatingError, match="another problem"):
        update(problem_of(model, made_of(model, "order in no sense")), history=tmp_path / "run.json", resume=True)
