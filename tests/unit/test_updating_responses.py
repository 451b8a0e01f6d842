"""Every response has the derivative of its own differences, on full and on sparse models."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from femend import _core
from femend.dof import Dof
from femend.errors import UpdatingError
from femend.estimate.updating import (
    Configuration,
    CrossOrthogonality,
    FracDifferences,
    Frequencies,
    FrfDifferences,
    Frfs,
    Link,
    MacDifferences,
    ModalSystem,
    ModeTest,
    Problem,
    Response,
    ShapeDifferences,
    Statics,
    Unknowns,
    Values,
    deck_system,
    factor,
    modal_system,
    update,
)
from femend.estimate.updating.responses import Mates
from femend.model import Parameter, read_model

sys.path.insert(0, str(Path(__file__).parents[1]))
import fe
from updating_models import TRUTH, chain, chain_problem

HERE = np.array([0.9, 1.1, 1.05, 0.97])
LINES = np.linspace(0.5, 9.0, 7)


def differences(problem: Problem, p: np.ndarray, h: float = 1e-5) -> np.ndarray:
    columns = [
        (problem.evaluate(p + h * e).residual - problem.evaluate(p - h * e).residual) / (2 * h) for e in np.eye(p.size)
    ]
    return np.array(columns).T


def check(problem: Problem, p: np.ndarray, tolerance: float = 1e-6) -> None:
    J = problem.evaluate(p, slopes=True).jacobian
    assert J is not None
    exact = differences(problem, p)
    np.testing.assert_allclose(J, exact, atol=tolerance * np.abs(exact).max())
    assert np.abs(J).max() > 0


def modal_responses() -> list[Response]:
    problem = chain_problem(noise=20.0)
    freq, shapes = problem.configurations[0].responses
    assert isinstance(freq, Frequencies)
    assert isinstance(shapes, ShapeDifferences)
    hole = shapes.phi.copy()
    hole[2, 1] = np.nan
    return [
        freq,
        replace(freq, of="eigenvalue"),
        replace(freq, of="logarithm"),
        shapes,
        ShapeDifferences(hole, 0.01),
        ShapeDifferences(shapes.phi, 0.01, (5, 2, 5, 0)),
        MacDifferences(shapes.phi, np.full(4, 0.01)),
        CrossOrthogonality(shapes.phi, np.diag([1.0, 0.8, 1.2, 0.9, 1.1, 0.7]), 0.1),
    ]


@pytest.mark.parametrize("sparse", [False, True])
@pytest.mark.parametrize("number", range(8))
def test_modal_responses(number: int, sparse: bool) -> None:
    problem = chain_problem(noise=20.0)
    (c,) = problem.configurations
    system = ModalSystem(chain(), np.eye(6), 5) if sparse else c.system
    check(replace(problem, configurations=(replace(c, system=system, responses=(modal_responses()[number],)),)), HERE)


@pytest.mark.parametrize("sparse", [False, True])
def test_frf_responses_with_damping(sparse: bool) -> None:
    frfs = Frfs(LINES, (0, 3, 5), (0, 5))
    system = ModalSystem(chain(), np.eye(6), 5, frfs=frfs) if sparse else modal_system(chain(), np.eye(6), 6, frfs=frfs)
    damping = [0.3, 2e-4, 0.02]
    H = system.solve(np.array([*TRUTH, *damping])).value("frf")
    unknowns = Unknowns.of(
        [*(factor(n) for n in ("k1", "k2", "k3", "m")), *(factor(n) for n in ("alpha", "beta", "eta"))]
    )
    links = {n: Link(((n, 1.0),), s) for n, s in zip(("alpha", "beta", "eta"), damping, strict=True)}
    bands = ((0.0, 3.0), (6.0, 10.0))
    for response in (
        FrfDifferences(H, 0.1),
        FrfDifferences(H, 0.1, "logarithm", LINES, bands),
        FrfDifferences(H, 0.1, "logarithm", floor=0.1 * np.abs(H)),
        FracDifferences(H, 0.1),
        FracDifferences(H, 0.1, "places"),
    ):
        problem = Problem(unknowns, (Configuration("c", system, (response,), None, links),))
        check(problem, np.array([*HERE, 0.8, 1.1, 1.3]))
        assert problem.evaluate([*TRUTH, 1.0, 1.0, 1.0]).squares < 1e-18
    both = FrfDifferences(H, 0.01 * np.abs(H).max())
    found = update(Problem(unknowns, (Configuration("c", system, (both,), None, links),)))
    # noise-free data with a prior of 10 %: the pull of the prior is what is left
    assert found.status == "converged"
    np.testing.assert_allclose(found.p[:4], TRUTH, atol=0.02)


def test_magnitudes_below_noise_and_floor_are_not_compared() -> None:
    """A quiet model is off a measured noise by what the noise scatters, has no slope, and far lines keep theirs."""
    frfs = Frfs(LINES, (0, 3, 5), (0, 5))
    system = modal_system(chain(), np.eye(6), 6, frfs=frfs)
    unknowns = Unknowns.of([factor(n) for n in ("k1", "k2", "k3", "m")])
    unknowns = unknowns.extended([factor("eta")])
    links = {n: Link((("eta", 1.0),), s) for n, s in (("alpha", 0.0), ("beta", 0.0), ("eta", 0.02))}
    measured = 1e3 * np.abs(system.solve([*TRUTH, 0.0, 0.0, 0.02]).value("frf")).max() * np.ones((LINES.size, 3, 2))

    def evaluated(**below: float | np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        response = FrfDifferences(measured, 0.1, "logarithm", **below)
        problem = Problem(unknowns, (Configuration("c", system, (response,), None, links),))
        found = problem.evaluate([*HERE, 1.0], slopes=True)
        assert found.jacobian is not None
        return found.residual[: measured.size], found.jacobian[: measured.size]

    far, slope = evaluated()
    assert np.abs(far).min() > 50
    quiet, flat = evaluated(noise=measured)
    np.testing.assert_allclose(quiet, 0, atol=1e-3)
    assert np.abs(flat).max() < 1e-4 * np.abs(slope).max()
    # a floor counts on both sides: ln(1 / (1 + 1)) / 2 where the model is silent and the test as loud as the floor
    np.testing.assert_allclose(evaluated(floor=measured)[0], -0.5 * np.log(2) / 0.1, rtol=1e-4)
    half = np.where(np.arange(LINES.size)[:, None, None] < 3, measured, 0.0)
    np.testing.assert_allclose(evaluated(noise=half)[1][-6:], slope[-6:])


@pytest.mark.parametrize(
    ("given", "words"),
    [(-1.0, "noise has to be finite and not negative; it holds -1"), (np.ones((2, 2)), r"noise of shape \(2, 2\)")],
)
def test_a_noise_that_does_not_fit(given: float | np.ndarray, words: str) -> None:
    with pytest.raises(UpdatingError, match=words):
        FrfDifferences(np.ones((7, 3, 2)), 0.1, "logarithm", noise=given)


@pytest.mark.parametrize("sparse", [False, True])
def test_static_displacements(sparse: bool) -> None:
    statics = Statics(np.eye(6)[:, 4:], (1, 5))
    system = (
        ModalSystem(chain(), np.eye(6), 0, statics=statics)
        if sparse
        else modal_system(chain(), np.eye(6), 1, statics=statics)
    )
    measured = system.solve(TRUTH).value("static")
    unknowns = Unknowns.of([factor(n, np.inf) for n in ("k1", "k2", "k3")])
    problem = Problem(unknowns, (Configuration("load", system, (Values("static", measured, 1e-5),)),))
    check(problem, HERE[:3])
    np.testing.assert_allclose(update(problem).p, TRUTH[:3], rtol=1e-6)


def test_a_deck_with_thickness_mass_and_centre_of_gravity(tmp_path: Path) -> None:
    cards = [
        *fe.line(6, 1.2),
        "CONM2,100,7,,2.0",
        "CQUAD4,50,5,1,2,8,9",
        "GRID,8,,0.2,0.3,0.",
        "GRID,9,,0.,0.3,0.",
        "PSHELL,5,1,0.004,1",
        "SPC1,1,123456,1",
    ]
    (tmp_path / "m.bdf").write_text("\n".join(["BEGIN BULK", "PARAM,COUPMASS,1", *cards, "ENDDATA", ""]))
    parameters = [
        Parameter("E", "E", "material", (1,)),
        Parameter("t", "t", "property_id", (5,)),
        Parameter("m", "m", "mass", (100,)),
    ]
    model = read_model(tmp_path / "m.bdf", parameters=parameters, spc=0)
    system = deck_system(model, [Dof(7, 2), Dof(4, 2, -1), Dof(8, 3)], 9, inertia=True)
    state = system.solve(np.array([1.0, 1.0, 1.0]))
    assert state.value("mass")[0] == pytest.approx(model.fe.total_mass(), rel=1e-9)
    beam, plate = 7850.0 * 6e-4 * 1.2, 7850.0 * 0.2 * 0.3 * 0.004
    centre = (beam * 0.6 + 2.0 * 1.2 + plate * 0.1) / (beam + 2.0 + plate)
    assert state.value("centre")[0] == pytest.approx(centre, rel=1e-9)
    held = read_model(tmp_path / "m.bdf", parameters=parameters, spc=1)
    modes = deck_system(held, [Dof(7, 2), Dof(4, 2, -1), Dof(8, 3)], 4)
    f = modes.solve(np.array([1.0, 1.1, 0.9])).value("freq")[:3]
    unknowns = Unknowns.of([factor("E", 0.1), factor("t", 0.1), factor("m", 0.1)])
    # two configurations with shared parameters: weighed free, measured clamped
    problem = Problem(
        unknowns,
        (
            Configuration("free", system, (Values("mass", [8.0], 0.1), Values("centre", [0.8, 0.0, 0.0], 0.01))),
            Configuration("clamped", modes, (Frequencies(f, 0.01 * f),), ModeTest(f)),
        ),
    )
    check(problem, np.array([1.02, 1.05, 0.97]), 1e-5)


BALANCE = """SOL 103
CEND
SPC=1
BEGIN BULK
{0}GRID,1,,0.,0.,0.5,,{1}
GRID,2,,1.,0.2,0.5
GRID,3,,2.,0.2,0.7
CBAR,1,1,1,2,0.,0.,1.
CBAR,2,1,2,3,0.,0.,1.
CONM2,9,3,,2.,.1,.3,.2
PBAR,1,1,1.-3,1.-7,1.-7,1.-7
MAT1,1,2.+11,,.3,7800.
SPC1,1,123456,1
ENDDATA
"""


def test_a_deck_weighs_what_stands_on_the_balance_held_nodes_included(tmp_path: Path) -> None:
    path, rho = tmp_path / "m.bdf", [Parameter("rho", "rho", "material", (1,))]
    ends = np.array([[0.0, 0.0, 0.5], [1.0, 0.2, 0.5], [2.0, 0.2, 0.7]])
    parts = [7.8 * np.linalg.norm(ends[i + 1] - ends[i]) for i in (0, 1)] + [2.0]
    places = [ends[:2].mean(axis=0), ends[1:].mean(axis=0), ends[2] + [0.1, 0.3, 0.2]]
    mass = sum(parts)
    centre = np.average(places, axis=0, weights=parts)
    # in the plane of a plane structure, which GRDSET holds across it, too
    for grdset, told in (("", [0, 1, 2]), ("GRDSET,,,,,,,246\n", [0, 2]), ("GRDSET,,,,,,,345\n", [0, 1])):
        path.write_text(BALANCE.format(grdset, ""))
        system = deck_system(read_model(path, parameters=rho), ["3:+Z"], 1, inertia=True)
        state = system.solve(np.ones(1))
        assert state.value("mass")[0] == pytest.approx(mass, rel=1e-9)
        assert state.value("centre")[told] == pytest.approx(centre[told], rel=1e-9)
        h = 1e-5
        for name in ("mass", "centre"):
            up, down = (system.solve(np.array([1 + s * h])).value(name) for s in (1, -1))
            assert state.slope(name)[0] == pytest.approx((up - down) / (2 * h), rel=1e-6, abs=1e-9)
    path.write_text(BALANCE.format("", "123456"))
    with pytest.raises(UpdatingError, match="22 % of the deck's mass is at DOFs that its GRIDs hold for good"):
        deck_system(read_model(path, parameters=rho), ["3:+Z"], 1, inertia=True)


def test_configurations_with_shared_and_own_parameters() -> None:
    system = modal_system(chain(), list(range(6)), 6)
    made = []
    for name, m in (("bare", 1.0), ("loaded", 3.0)):
        state = system.solve(np.array([0.8, 1.2, 0.95, m]))
        f, phi = state.value("freq")[:3], state.value("phi")[:, :3]
        made.append(
            Configuration(
                name,
                system,
                (Frequencies(f, 1e-3 * f), ShapeDifferences(phi, 0.01)),
                ModeTest(f, phi),
                {"m": f"m {name}"},
            )
        )
    unknowns = Unknowns.of([factor(n, 1.0) for n in ("k1", "k2", "k3", "m bare", "m loaded")])
    found = update(Problem(unknowns, tuple(made)))
    np.testing.assert_allclose(list(found.values.values()), [0.8, 1.2, 0.95, 1.0, 3.0], rtol=1e-3)


def test_mac_and_shapes_need_modes_and_deviations() -> None:
    phi = np.ones((6, 2))
    with pytest.raises(UpdatingError, match="without scatter"):
        ShapeDifferences(phi, np.zeros((6, 2)))
    with pytest.raises(UpdatingError, match="without scatter"):
        Frequencies(np.array([1.0, 2.0]), np.array([0.1, 0.0]))
    with pytest.raises(UpdatingError, match="complex"):
        ShapeDifferences(phi * 1j, 0.1)
    state = modal_system(chain(), list(range(6)), 6).solve(np.ones(4))
    with pytest.raises(UpdatingError, match="no test modes"):
        MacDifferences(phi, np.ones(2)).compare(state, None, False)
    with pytest.raises(UpdatingError, match="ask the system"):
        Values("frf", np.ones(2), 0.1).compare(state, Mates(np.array([0]), np.ones(1)), False)


def test_matrices_of_core_and_full_model_agree() -> None:
    m = chain()
    K, M = m.at(HERE)
    freq = _core.modes(m.indptr, m.indices, K, M, n_modes=6)[0]
    np.testing.assert_allclose(modal_system(m, [0], 6).solve(HERE).value("freq"), freq, rtol=1e-10)
