"""Rotors at speed as systems to update: against full matrices, derivatives, twins, and what they refuse."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import scipy.linalg

from femend import SpinningPart, complex_frf
from femend.data import ODS
from femend.dof import Dof
from femend.errors import ConvergenceError, FemendError, ModelError, PairingError, UpdatingError
from femend.estimate.updating import (
    Configuration,
    FrfDifferences,
    Frfs,
    Link,
    OdsDifferences,
    OrderDifferences,
    Problem,
    RotorSystem,
    SpeedCurve,
    SpeedPower,
    SpeedTerm,
    Unknown,
    Unknowns,
    UpdateResult,
    WhirlFrequencies,
    Whirls,
    affine_matrices,
    bearing_term,
    deck_system,
    disc_term,
    factor,
    reduced_problem,
    rotor_system,
    update,
)
from femend.model import Model, Morph

sys.path.insert(0, str(Path(__file__).parents[1]))
from operating_models import channels
from turning_models import AXIS, BEARINGS, SENSORS, TOP, K, dense, parts, rotor, terms

FREQ = np.array([9.0, 14.0, 19.0, 23.0, 27.0, 33.0, 40.0, 48.0, 57.0])
SPEEDS = np.array([60.0, 200.0, 380.0])
# factors of the deck, alpha, beta, eta, and factors of what changes with the speed
HERE = np.array([1.05, 1.2, 0.9, 1.3, 0.3, 1e-5, 0.01, 0.4, 1.1, 0.7])
STEPS = np.array([1e-4, 1e-4, 1e-4, 1e-4, 1e-3, 1e-8, 1e-5, 1e-4, 1e-4, 1e-3])
UNBALANCE = {2: 3e-5 * np.exp(0.7j), 6: 5e-5 * np.exp(-1.9j)}


@pytest.fixture(scope="module")
def model(tmp_path_factory: pytest.TempPathFactory) -> Model:
    return rotor(tmp_path_factory.mktemp("rotor"))


def lines(sense: int = 1) -> Frfs:
    return Frfs(FREQ, tuple(range(8)), (0, 1, 2, 3), "accelerance", sense * 2 * np.pi * FREQ)


def full(model: Model, speed: float, at: np.ndarray = HERE) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """K, C, M (n, n) at a speed in full matrices, with alpha, beta and eta on what is there at rest."""
    stiffness, C, M = dense(model, at[:4], at[7:], speed)
    rest = dense(model, at[:4], np.zeros(3), 0.0)[0]
    return stiffness + 1j * at[6] * rest, C + at[4] * M + at[5] * rest, M


@pytest.mark.parametrize("sense", [1, -1])
def test_frfs_are_those_of_full_matrices_at_the_speed_of_every_line(model: Model, sense: int) -> None:
    frfs = lines(sense)
    H = rotor_system(model, SENSORS, parts=parts(), terms=terms(model), frfs=frfs).solve(HERE).value("frf")
    B = model.transformation().tocsr()[[model.row(d) for d in SENSORS]].toarray()
    for k, (s, speed) in enumerate(zip(frfs.s, frfs.speed, strict=True)):
        stiffness, C, M = full(model, float(speed))
        wanted = s**2 * (B @ np.linalg.solve(stiffness + s * C + s**2 * M, B[:4].T))
        np.testing.assert_allclose(H[k], wanted, atol=1e-9 * np.abs(wanted).max())
    still = deck_system(model, SENSORS, 0, frfs=frfs).solve(HERE[:7]).value("frf")
    assert np.abs(H - still).max() > 0.5 * np.abs(still).max()  # turning is no small matter here


def test_frfs_at_several_speeds_are_those_of_complex_modes(model: Model) -> None:
    """Lines of two speeds one after the other, against the modal sum of `complex_frf` at each."""
    freq = np.array([12.0, 21.0, 30.0])
    frfs = Frfs(np.tile(freq, 2), (0, 5), (2,), "receptance", np.repeat([100.0, 350.0], 3))
    H = rotor_system(model, SENSORS, parts=parts(), frfs=frfs).solve(np.array([1, 1, 1, 1, 0.0, 0, 0])).value("frf")
    out, into = channels((SENSORS[0], SENSORS[5])), channels((SENSORS[2],))
    for i, speed in enumerate((100.0, 350.0)):
        wanted = complex_frf(model, freq, out, into, n_modes=8, speed=speed, parts=parts(), kind="receptance").H
        np.testing.assert_allclose(H[3 * i : 3 * i + 3], wanted, atol=1e-5 * np.abs(wanted).max())


def test_poles_are_those_of_full_matrices(model: Model) -> None:
    system = rotor_system(model, SENSORS, parts=parts(), terms=terms(model), whirls=Whirls(SPEEDS, 6))
    state = system.solve(HERE)
    for k, speed in enumerate(SPEEDS):
        stiffness, C, M = full(model, float(speed))
        n = len(M)
        A = np.block([[np.zeros((n, n)), np.eye(n)], [-stiffness, -C]])
        found = scipy.linalg.eigvals(A, scipy.linalg.block_diag(np.eye(n), M))
        found = found[np.isfinite(found)]
        for pole in state.value("pole")[k]:
            assert np.abs(found - pole).min() < 1e-7 * abs(pole)
    np.testing.assert_allclose(state.value("whirl"), np.tile([-1.0, 1.0], (3, 3)), atol=1e-6)


@pytest.mark.parametrize("what", ["frf", "pole"])
def test_derivatives_are_differences(model: Model, what: str) -> None:
    """Of all parameters: of the deck (the disc's inertia turns too), of damping, and of what changes with the speed."""
    asked = {"frfs": lines()} if what == "frf" else {"whirls": Whirls(SPEEDS, 6)}
    system = rotor_system(model, SENSORS, parts=parts(), terms=terms(model), **asked)
    assert system.names == ("E", "J disc", "k", "c", "alpha", "beta", "eta", "growth", "film", "coupling")
    found = system.solve(HERE).slope(what)
    for i, h in enumerate(STEPS):
        e = h * np.eye(HERE.size)[i]
        # fourth order
        one, two = (system.solve(HERE + n * e).value(what) - system.solve(HERE - n * e).value(what) for n in (1, 2))
        change = (8 * one - two) / (12 * h)
        np.testing.assert_allclose(found[i], change, atol=2e-6 * np.abs(change).max(), err_msg=system.names[i])


def test_planes_alike_at_rest_share_the_derivative_of_their_mean(model: Model) -> None:
    system = rotor_system(model, SENSORS, parts=parts(), whirls=Whirls([0.0], 4))
    at = np.array([1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0])
    found = system.solve(at).slope("pole")[:4, 0]
    np.testing.assert_allclose(found[:, 0], found[:, 1], rtol=1e-9)
    for i, e in enumerate(1e-4 * np.eye(7)[:4]):
        change = (system.solve(at + e).value("pole") - system.solve(at - e).value("pole"))[0] / 2e-4
        np.testing.assert_allclose(found[i], change, atol=1e-5 * np.abs(change).max())


# ---- responses, and twins

TRUTH = {"J disc": 1.25, "k": 0.85, "c": 1.2, "growth": 0.4}


def stiffening(model: Model) -> SpeedTerm:
    return bearing_term(model, "growth", BEARINGS, AXIS, K * np.eye(2), course=SpeedPower(2, TOP))


def unknowns(*names: str) -> Unknowns:
    priors = {"growth": Unknown("growth", 1.0, False, 0.0, 1.0), "E": factor("E", 0.1)}
    return Unknowns.of([priors.get(n) or factor(n, 0.4, (0.3, 3.0)) for n in names])


def true_run(model: Model, seed: int = 3, sense: int = 1, share: float = 0.01) -> ODS:
    """Accelerations of order 1 on 45 lines of a run-up of the true rotor, in full matrices, with noise."""
    freq = np.linspace(8.0, 60.0, 45)
    B = model.transformation().tocsr()[[model.row(d) for d in SENSORS]].toarray()
    force = np.zeros(len(SENSORS), dtype=complex)
    for node, u in UNBALANCE.items():
        force[SENSORS.index(Dof(node, 2))], force[SENSORS.index(Dof(node, 3))] = u, -1j * sense * u
    shapes = []
    for f in freq:
        s, speed = 2j * np.pi * f, sense * 2 * np.pi * f
        stiffness, C, M = dense(model, np.array([1, *list(TRUTH.values())[:3]]), np.array([0.4, 0, 0]), speed)
        shapes.append(s**2 * speed**2 * B @ np.linalg.solve(stiffness + s * C + s**2 * M, B.T @ force))
    clean = np.array(shapes)
    rng = np.random.default_rng(seed)
    sd = np.broadcast_to(share * np.abs(clean).max(axis=1, keepdims=True), clean.shape)
    noisy = clean + sd * (rng.standard_normal(clean.shape) + 1j * rng.standard_normal(clean.shape))
    return ODS("run-up", freq, noisy.T, channels(SENSORS), "order", order=1.0, speed=freq, sigma=np.sqrt(2) * sd.T)


def off(result: UpdateResult, truth: dict[str, float]) -> np.ndarray:
    return np.array([(result.values[n] - v) / result.sd[n] for n, v in truth.items()])


@pytest.mark.parametrize("sense", [1, -1])
def test_a_run_up_tells_inertia_bearings_their_growth_and_unbalance(model: Model, sense: int) -> None:
    response, frfs = OrderDifferences.of(true_run(model, sense=sense), SENSORS, BEARINGS, AXIS, sense=sense)
    np.testing.assert_allclose(frfs.speed, sense * 2 * np.pi * frfs.freq)
    system = rotor_system(model, SENSORS, parts=parts(), terms=[stiffening(model)], frfs=frfs)
    result = update(Problem(unknowns(*TRUTH), (Configuration("running", system, (response,)),)))
    assert result.status == "converged"
    assert np.abs(off(result, TRUTH)).max() < 3.5
    assert max(result.sd.values()) < 0.02
    assert result.after.squares / result.after.n_values == pytest.approx(1.0, abs=0.2)
    u, sd = response.found(result.after.states[0])
    assert (np.abs(u - np.array(list(UNBALANCE.values()))) < 4 * sd).all()
    assert (sd < 0.05 * np.abs(u)).all()


def test_deviations_hold_over_many_noises(model: Model) -> None:
    z = []
    for seed in range(100, 112):
        response, frfs = OrderDifferences.of(true_run(model, seed), SENSORS, BEARINGS, AXIS, sense=1)
        system = rotor_system(model, SENSORS, parts=parts(), terms=[stiffening(model)], frfs=frfs)
        z.append(off(update(Problem(unknowns(*TRUTH), (Configuration("running", system, (response,)),))), TRUTH))
    # 48 squares scatter by 0.2 about one
    assert np.mean(np.square(z)) == pytest.approx(1.0, abs=0.6)


def test_growth_in_proportion_to_the_spring_is_a_link(model: Model) -> None:
    response, frfs = OrderDifferences.of(true_run(model), SENSORS, BEARINGS, AXIS, sense=1)
    system = rotor_system(model, SENSORS, parts=parts(), terms=[stiffening(model)], frfs=frfs)
    share = {"growth": Link((("growth", 1.0), ("k", 1.0)))}
    problem = Problem(unknowns(*TRUTH), (Configuration("running", system, (response,), links=share),))
    result = update(problem)
    assert np.abs(off(result, {**TRUTH, "growth": 0.4 / 0.85})).max() < 3.5
    here = problem.evaluate(problem.unknowns.mean + 0.05, slopes=True)
    ends = [[problem.evaluate(here.p + h * e).squares for h in (1e-5, -1e-5)] for e in np.eye(4)]
    gradient = np.array([(a - b) / 2e-5 for a, b in ends])
    np.testing.assert_allclose(2 * here.jacobian.T @ here.residual, gradient, atol=1e-6 * np.abs(gradient).max())


def test_without_gyroscopic_moments_the_run_up_is_missed(model: Model) -> None:
    response, frfs = OrderDifferences.of(true_run(model), SENSORS, BEARINGS, AXIS, sense=1)
    without = rotor_system(model, SENSORS, terms=[stiffening(model)], frfs=frfs)
    result = update(Problem(unknowns(*TRUTH), (Configuration("not turning", without, (response,)),)))
    assert result.after.squares / result.after.n_values > 20
    assert np.abs(off(result, TRUTH)).max() > 20
    at_rest = deck_system(model, SENSORS, 0, frfs=frfs)
    result = update(Problem(unknowns("J disc", "k", "c"), (Configuration("at rest", at_rest, (response,)),)))
    assert result.after.squares / result.after.n_values > 20


def test_a_campbell_diagram_tells_the_same(model: Model) -> None:
    """16 frequencies to 0.1 %, of which two without their whirl; one start 20 % off."""
    system = rotor_system(model, SENSORS, parts=parts(), terms=[stiffening(model)], whirls=Whirls([0.0, *SPEEDS], 6))
    state = system.solve(np.array([1.04, 1.25, 0.85, 1.0, 0.0, 0.0, 0.0, 0.4]))
    freq = state.value("pole").imag[:, :4] / (2 * np.pi)
    whirl = np.sign(np.round(state.value("whirl")[:, :4]))
    whirl[0], whirl[1, 0] = 0.0, 0.0
    rng = np.random.default_rng(4)
    measured = freq * (1 + 1e-3 * rng.standard_normal(freq.shape))
    speed = np.repeat([0.0, *SPEEDS], 4)
    response, whirls = WhirlFrequencies.of(speed, measured.ravel(), 1e-3 * freq.ravel(), 6, whirl=whirl.ravel())
    system = rotor_system(model, SENSORS, parts=parts(), terms=[stiffening(model)], whirls=whirls)
    problem = Problem(unknowns("E", "J disc", "k", "growth"), (Configuration("Campbell", system, (response,)),))
    here = problem.evaluate(problem.unknowns.mean + 0.01, slopes=True)
    ends = [[problem.evaluate(here.p + h * e).residual for h in (1e-4, -1e-4)] for e in np.eye(4)]
    change = np.array([(a - b) / 2e-4 for a, b in ends]).T
    np.testing.assert_allclose(here.jacobian, change, atol=1e-5 * np.abs(change).max())
    result = update(problem)
    assert result.status == "converged"
    assert np.abs(off(result, {"E": 1.04, "J disc": 1.25, "k": 0.85, "growth": 0.4})).max() < 3.5
    assert result.sd["J disc"] < 0.01
    assert result.after.squares / result.after.n_values == pytest.approx(1.0, abs=0.7)


def test_hammer_at_rest_and_shapes_at_a_held_speed_share_their_unknowns(model: Model) -> None:
    """FRFs at rest and operating shapes under a force that nobody measured at 250 rad/s, two configurations."""
    truth = np.array([1.0, 1.25, 0.85, 1.2, 0.0, 0.0, 0.0, 0.4])
    rng = np.random.default_rng(9)

    def noisy(clean: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        sd = 0.01 * np.abs(clean).max(axis=1, keepdims=True) * np.ones(clean.shape)
        return clean + sd * (rng.standard_normal(clean.shape) + 1j * rng.standard_normal(clean.shape)), sd

    at_rest = Frfs(FREQ, tuple(range(8)), (4,))
    H, sd = noisy(deck_system(model, SENSORS, 0, frfs=at_rest).solve(truth[:7]).value("frf"))
    held = Frfs(FREQ, tuple(range(8)), (5,), "accelerance", 250.0)
    made = rotor_system(model, SENSORS, parts=parts(), terms=[stiffening(model)], frfs=held)
    shapes, scatter = noisy(made.solve(truth).value("frf")[:, :, 0] * np.exp(1j * rng.uniform(0, 6, (FREQ.size, 1))))
    ods = ODS("at 250 rad/s", FREQ, shapes.T, channels(SENSORS), "ods", sigma=np.sqrt(2) * scatter.T)
    response, frfs = OdsDifferences.of(ods, SENSORS, [SENSORS[5]], speed=250.0)
    np.testing.assert_allclose(frfs.speed, 250.0)
    system = rotor_system(model, SENSORS, parts=parts(), terms=[stiffening(model)], frfs=frfs)
    problem = Problem(
        unknowns(*TRUTH),
        (
            Configuration("at rest", deck_system(model, SENSORS, 6, frfs=at_rest), (FrfDifferences(H, sd),)),
            Configuration("running", system, (response,)),
        ),
    )
    result = update(problem)
    assert result.status == "converged"
    assert np.abs(off(result, TRUTH)).max() < 3.5
    here = problem.evaluate(result.p + 0.05, slopes=True)
    ends = [[problem.evaluate(here.p + h * e).squares for h in (1e-5, -1e-5)] for e in np.eye(4)]
    gradient = np.array([(a - b) / 2e-5 for a, b in ends])
    np.testing.assert_allclose(2 * here.jacobian.T @ here.residual, gradient, atol=1e-6 * np.abs(gradient).max())
    small = reduced_problem(problem, 2, n_check=1).problem
    assert small.configurations[1].system is system


def test_a_curve_through_knots_is_the_power_it_goes_through(model: Model) -> None:
    """Splines that are 1 at one speed each, with factors of a parabola's values; a pair stands between two nodes."""
    at = np.linspace(0.0, 400.0, 9)
    knots = [
        bearing_term(model, f"k at {v:g}", BEARINGS, AXIS, K * np.eye(2), course=curve)
        for v, curve in zip(at, SpeedCurve.knots(at), strict=True)
    ]
    frfs = lines()
    base = np.array([1, 1, 1, 1, 0.0, 0, 0])
    splined = rotor_system(model, SENSORS, parts=parts(), terms=knots, frfs=frfs)
    powered = rotor_system(model, SENSORS, parts=parts(), terms=[stiffening(model)], frfs=frfs)
    H, wanted = (
        s.solve(np.concatenate([base, v])).value("frf") for s, v in ((splined, 0.4 * (at / TOP) ** 2), (powered, [0.4]))
    )
    # a natural spline has no curvature at its ends
    np.testing.assert_allclose(H, wanted, atol=0.02 * np.abs(wanted).max())
    between = bearing_term(model, "gap", [(4, 5)], AXIS, np.diag([2.0, 3.0]), kind="damping").matrix
    one = model.transformation().tocsr()[[model.row(Dof(n, 3)) for n in (4, 5)]].toarray()
    rigid = one.T @ np.array([1.0, -1.0])
    np.testing.assert_allclose(between @ np.linalg.pinv(one) @ [1.0, 0.0], 3.0 * rigid, atol=1e-12)


def test_matrices_without_a_deck_turn_by_terms() -> None:
    """A disc of Id = 3, Ip = 2 on springs of 400: forward critical at 20 rad/s, backward at 8.944."""
    tilts = affine_matrices({"k": 400.0 * np.eye(2)}, 3.0 * np.eye(2))
    spin = SpeedTerm("Ip", "damping", [[0.0, 2.0], [-2.0, 0.0]], SpeedPower(1, 1.0, signed=True))
    system = RotorSystem(tilts, np.eye(2), terms=(spin,), whirls=Whirls([np.sqrt(80.0), 20.0], 2))
    poles = system.solve(np.array([1.0, 0.0, 0.0, 0.0, 1.0])).value("pole")
    assert poles[0, 0].imag == pytest.approx(np.sqrt(80.0), rel=1e-9)
    assert poles[1, 1].imag == pytest.approx(20.0, rel=1e-9)
    response, _ = WhirlFrequencies.of([20.0], [20.0 / (2 * np.pi)], 0.01, 2, whirl=[1])
    with pytest.raises(UpdatingError, match="the model tells no whirl"):
        response.compare(
            RotorSystem(tilts, np.eye(2), terms=(spin,), whirls=Whirls([20.0], 2)).solve(
                np.array([1.0, 0.0, 0.0, 0.0, 1.0])
            ),
            None,
            False,
        )


# ---- what is refused


def wrong_systems(model: Model) -> list[tuple[str, type[FemendError], Callable[[], object]]]:
    frfs, shaft, term = lines(), parts(), stiffening(model)
    still = Frfs(FREQ, (0,), (0,))
    X = (1.0, 0.0, 0.0)

    def system(**given: object) -> RotorSystem:
        return rotor_system(model, SENSORS, **{"parts": shaft, "frfs": frfs, **given})  # type: ignore[arg-type]

    moved = model.with_morphs([Morph.of("apex", {5: (0, 0, 1)}, 0.01)])
    named = SpeedTerm("k", "stiffness", term.matrix)
    return [
        ("9 lines without the shaft's speed, which a rotor's depend on", UpdatingError, lambda: system(frfs=still)),
        ("is asked for nothing; give the `Frfs` or `Whirls`", UpdatingError, lambda: system(frfs=None)),
        ("nothing turns: there is neither", UpdatingError, lambda: system(parts=[])),
        (
            r"spinning part 2 of 2 names 1 elements that the deck does not have: \[77\]",
            UpdatingError,
            lambda: system(parts=[*shaft, SpinningPart(X, (41, 77))]),
        ),
        ("part 1 of 1 has no polar inertia", UpdatingError, lambda: system(parts=[SpinningPart(X, (40,))])),
        ("in rotating axes, but the sensors", UpdatingError, lambda: system(parts=[SpinningPart(X, axes="rotating")])),
        ("not parallel to the spin axis", ModelError, lambda: system(parts=[SpinningPart((0.0, 1.0, 0.0), (1,))])),
        ("a rotor with 1 morphs", UpdatingError, lambda: rotor_system(moved, SENSORS, parts=shaft, frfs=frfs)),
        ("no node 99", PairingError, lambda: rotor_system(model, [Dof(99, 2)], parts=shaft, frfs=frfs)),
        ("both called 'k'; name one otherwise", UpdatingError, lambda: system(terms=[named])),
        (
            r"'x' is \(2, 2\), the model has 38 rows",
            UpdatingError,
            lambda: system(terms=[SpeedTerm("x", "damping", np.eye(2))]),
        ),
        (
            "come without one; give their gyroscopic matrix as a `SpeedTerm`",
            UpdatingError,
            lambda: RotorSystem(affine_matrices({"k": [[1.0]]}, [[1.0]]), np.eye(1), tuple(shaft), frfs=frfs),
        ),
        (r"9 lines at speeds of shape \(2,\)", UpdatingError, lambda: Frfs(FREQ, (0,), (0,), "mobility", [1.0, 2.0])),
        ("or speeds that are no numbers", UpdatingError, lambda: Frfs(FREQ, (0,), (0,), "mobility", np.nan)),
        (
            "spins in the sense 2",
            UpdatingError,
            lambda: OrderDifferences.of(true_run(model), SENSORS, BEARINGS, AXIS, spin=2),
        ),
    ]


def wrong_terms(model: Model) -> list[tuple[str, type[FemendError], Callable[[], object]]]:
    two = np.eye(2)
    short = SpeedTerm("a", "stiffness", two, SpeedCurve([10.0, 100.0], [1.0, 2.0]))
    return [
        ("'a' is of kind 'mass'", UpdatingError, lambda: SpeedTerm("a", "mass", two)),  # type: ignore[arg-type]
        (r"'a' has shape \(1, 2\)", UpdatingError, lambda: SpeedTerm("a", "damping", np.ones((1, 2)))),
        ("holds what is no number", UpdatingError, lambda: SpeedTerm("a", "damping", np.nan * two)),
        ("reaches from 10 to 100 rad/s and is asked for 120", UpdatingError, lambda: short.weights(np.array([120.0]))),
        (
            "'a' weighs inf at 0 rad/s; leave the line out",
            UpdatingError,
            lambda: SpeedTerm("a", "damping", two, SpeedPower(-1, 100.0)).weights(np.array([0.0])),
        ),
        ("two or more rising speeds from 0 on", UpdatingError, lambda: SpeedCurve([5.0, 5.0], [1.0, 1.0])),
        ("two or more rising speeds from 0 on", UpdatingError, lambda: SpeedCurve([-5.0, 5.0], [1.0, 1.0])),
        ("a curve over speed holds what is no number", UpdatingError, lambda: SpeedCurve([0.0, 5.0], [1.0, np.nan])),
        (
            r"of 'b' has shape \(3, 3\); it is \(2, 2\)",
            UpdatingError,
            lambda: bearing_term(model, "b", [2], 0, np.eye(3)),
        ),
        ("'b' stands at no node", UpdatingError, lambda: bearing_term(model, "b", [], 0, two)),
        ("between nodes", UpdatingError, lambda: bearing_term(model, "b", [(2, 3, 4)], 0, two)),
        ("along axis 3", UpdatingError, lambda: bearing_term(model, "b", [2], 3, two)),
        ("the model has no node 99", PairingError, lambda: disc_term(model, "d", 99, 0, 1.0)),
        (r"'d' moves nothing: 2:\+RY, 2:\+RZ", UpdatingError, lambda: disc_term(model, "d", 2, 0, 0.0)),
    ]


def wrong_whirls() -> list[tuple[str, type[FemendError], Callable[[], object]]]:
    def of(speed: list[float], freq: list[float], whirl: list[float], n: int = 4) -> object:
        return WhirlFrequencies.of(speed, freq, 0.1, n, whirl=whirl)

    return [
        ("modes at a speed of -20 rad/s; forward is the sense", UpdatingError, lambda: of([-20.0], [10.0], [1])),
        ("frequency 2 is 0 Hz", UpdatingError, lambda: of([20.0, 20.0], [10.0, 0.0], [1, 0])),
        ("whirl 1 is 2; give", UpdatingError, lambda: of([20.0], [10.0], [2])),
        ("mode 1 whirls at a speed of 0", UpdatingError, lambda: of([0.0], [10.0], [1])),
        (
            "2 modes were measured at 20 rad/s and 1 are",
            UpdatingError,
            lambda: of([20.0, 20.0], [9.0, 10.0], [0, 0], 1),
        ),
        (r"whirls \(1,\); there is one of each", UpdatingError, lambda: of([20.0, 20.0], [9.0, 10.0], [0])),
        ("that do not rise or are no numbers", UpdatingError, lambda: Whirls([3.0, 2.0], 2)),
        ("0 modes at every speed", UpdatingError, lambda: Whirls([3.0], 0)),
    ]


def test_bad_input_is_told_with_what_to_do(model: Model) -> None:
    for said, kind, call in [*wrong_systems(model), *wrong_terms(model), *wrong_whirls()]:
        with pytest.raises(kind, match=said):
            call()


def test_what_cannot_be_solved_is_told(model: Model) -> None:
    one = affine_matrices({"k": [[1.0]]}, [[1.0]])
    grown = SpeedTerm("growth", "stiffness", [[1.0]], SpeedPower(2, 1.0))
    resonant = RotorSystem(one, np.eye(1), terms=(grown,), frfs=Frfs([1 / np.pi], (0,), (0,), "receptance", 1.0))
    with pytest.raises(ModelError, match="is singular at 0.31831 Hz and a speed of 1 rad/s"):
        resonant.solve(np.array([1.0, 0.0, 0.0, 0.0, 3.0]))
    response, _ = WhirlFrequencies.of([20.0], [10.0], 0.1, 2)
    other = rotor_system(model, SENSORS, parts=parts(), whirls=Whirls([30.0], 2))
    with pytest.raises(UpdatingError, match=r"1 modes at 20 rad/s, and the model gives 2 at \[30.0\]"):
        response.compare(other.solve(np.array([1.0, 1, 1, 1, 0, 0, 0])), None, False)
    many = RotorSystem(one, np.eye(1), terms=(grown,), whirls=Whirls([1.0], 4))
    with pytest.raises(ConvergenceError, match="4 modes at 1 rad/s"):
        many.solve(np.array([1.0, 0.0, 0.0, 0.0, 3.0]))


def test_an_order_of_free_forces_knows_the_rotors_own_sense(model: Model) -> None:
    run = true_run(model)
    assert OrderDifferences.of(run, SENSORS, BEARINGS, AXIS)[1].speed is None
    np.testing.assert_allclose(
        OrderDifferences.of(run, SENSORS, BEARINGS, AXIS, spin=-1)[1].speed, -2 * np.pi * run.freq
    )
    second = ODS("second", run.freq, run.shapes, run.channels, "order", order=2.0, speed=run.freq / 2, sigma=run.sigma)
    _, frfs = OrderDifferences.of(second, SENSORS, BEARINGS, AXIS, order=2.0, spin=1, width=1.0)
    # every point of a line's width is passed at its own speed
    np.testing.assert_allclose(frfs.speed, np.pi * frfs.freq)
    assert OdsDifferences.of(run, SENSORS, [SENSORS[0]])[1].speed is None
