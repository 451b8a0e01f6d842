"""A cut that is held by a spring: the model is the same, but its damping ratios are those of the structure with it."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.linalg import eigh

from femend.diagnose.fitting.candidates import Candidate, Start
from femend.diagnose.fitting.closed_loop import loop_of
from femend.diagnose.fitting.linear import refit_linear
from femend.diagnose.fitting.predict import predict_model
from femend.diagnose.locating.joint import Joint, open_joint, open_joints
from femend.diagnose.locating.recovered import recover
from femend.estimate import FitRecord, Problem
from femend.model import Place, ReducedModel, find_places, reduce_model
from femend.physics import physics

sys.path.insert(0, str(Path(__file__).parents[1]))
import small_study

Array = NDArray[np.float64]

# stiffness of the true joint and of the spring that holds it, N m/rad
K, HELD = 400.0, 300.0


@pytest.fixture
def reduced(tmp_path: Path) -> ReducedModel:
    model, rows = small_study.cantilever(tmp_path)
    return reduce_model(model, small_study.BAND[1], rows.tolist())


def problem_of(reduced: ReducedModel, y: Array | None = None) -> Problem:
    """A record of the cantilever shaken at its tip, with responses `y` (n_out, n); the modes have a damping of 2 %."""
    rows = np.array([6 * reduced.model.index(node) + 2 for node in small_study.SENSORS])
    n = 1024
    u, one = small_study.force(2.0, 4, n)[None], np.ones(len(rows))
    y = np.zeros((len(rows), n)) if y is None else y
    noise = one if not y.any() else 1e-3 * y.std(axis=1)
    record = FitRecord("r", u, y, 1 / small_study.RATE, rows[-1:], rows, np.ones(1), one, noise)
    return Problem([record], small_study.BAND, 0.02, 3)


def cut(reduced: ReducedModel) -> Place:
    return next(p for p in find_places(reduced.model) if p.release is not None and 7 in p.nodes)


def opened(reduced: ReducedModel) -> Joint:
    rows = [6 * reduced.model.index(node) + 2 for node in small_study.SENSORS]
    return open_joint(cut(reduced), reduced, small_study.BAND[1], rows)


def undamped(problem: Problem, joint: Joint) -> Array:
    p = problem.prior(joint.reduced)[0]
    p[len(joint.reduced.names) + problem.n_tuned :] = -30.0
    return p


def test_without_damping_it_makes_no_difference(reduced: ReducedModel) -> None:
    # but for how far the mass of the element that is cut goes with its end
    problem, joint = problem_of(reduced), replace(opened(reduced), loose=())
    held = joint.held_by(np.full(1, HELD))
    x, p = np.log([K]), undamped(problem, joint)
    laws = [one.hypothesis(("support_stiffness",), x, np.ones(1)) for one in (joint, held)]
    opened_up, closed = (predict_model(problem, one, p, x, problem.records[0]) for one in laws)
    np.testing.assert_allclose(closed, opened_up, atol=1e-6 * np.abs(opened_up).max())
    ((_, D, F),) = problem.fitted_lines(laws[1], p, x)
    np.testing.assert_allclose(F, -K * D, atol=1e-9 * np.abs(F).max())


def test_the_modes_with_the_spring_have_the_damping(reduced: ReducedModel) -> None:
    problem, joint = problem_of(reduced), opened(reduced)
    held = joint.held_by(np.full(1, K))
    p = problem.prior(joint.reduced)[0]
    omega, zeta, _, _ = problem.system(held.reduced).modal(p)
    g = K / (1 + K * joint.compliance[0])
    closed = joint.reduced.K_fixed + g * joint.w.T @ joint.w
    mass = held.reduced.M_fixed.copy()
    for term in joint.reduced.terms:
        closed = closed + (0.0 if term.K is None else term.K)
        mass = mass + (0.0 if term.M is None else term.M)
    squares = np.linalg.eigvals(np.linalg.solve(mass, closed)).real
    np.testing.assert_allclose(np.sort(np.sqrt(squares))[:3], omega[:3], rtol=1e-8)
    np.testing.assert_allclose(zeta[:3], 0.02)
    # held by the law's own stiffness, the law adds nothing
    x = np.log([K])
    laws = held.hypothesis(("support_stiffness",), x, np.ones(1))
    alone = held.hypothesis(None)
    ((y, _, _),) = problem.fitted_lines(laws, p, x)
    bare = predict_model(problem, alone, p, np.zeros(0), problem.records[0])
    with_law = predict_model(problem, laws, p, x, problem.records[0])
    np.testing.assert_allclose(with_law, bare, atol=1e-9 * np.abs(bare).max())
    assert np.isfinite(y).all()


@pytest.mark.parametrize("k", [K, 3e4])
def test_the_modes_are_those_of_a_beam_with_an_end_of_its_own(reduced: ReducedModel, k: float) -> None:
    """The element that is cut has its mass where its own end is, not where the node is: with that, modes of short waves
    come out with their frequencies, whatever holds the end."""
    joint = opened(reduced)
    problem, place, fe = problem_of(reduced), joint.place, reduced.model.fe
    T = reduced.model.transformation().toarray()
    K_g, M_g = np.zeros((fe.n_g + 1, fe.n_g + 1)), np.zeros((fe.n_g + 1, fe.n_g + 1))
    (turns,) = place.lets_go
    for eid, _, _ in fe.elements():
        rows, K_e, M_e = fe.element_matrices(eid, np.ones(len(reduced.model.parameters)))
        # beside its rows by how much less the end of the element that is cut moves than the node
        own = np.column_stack([np.eye(len(rows)), turns if (eid,) == place.elements else np.zeros(len(rows))])
        at = np.ix_([*rows, fe.n_g], [*rows, fe.n_g])
        K_g[at] += own.T @ K_e @ own
        M_g[at] += own.T @ M_e @ own
    K_g[-1, -1] += k
    free = np.block([[T, np.zeros((len(T), 1))], [np.zeros((1, T.shape[1])), np.ones((1, 1))]])
    expected = np.sqrt(eigh(free.T @ K_g @ free, free.T @ M_g @ free, eigvals_only=True)[:3])
    off = []
    for one in (joint, replace(joint, loose=())):
        held = one.held_by(np.full(1, k)).reduced
        omega = problem.system(held).modal(problem.prior(held)[0])[0][: len(expected)]
        off.append(float(np.abs(omega / expected - 1).max()))
    assert off[0] < 2e-5 < 1e-4 < off[1], off


def test_what_is_simulated_is_what_is_predicted(reduced: ReducedModel) -> None:
    joint = opened(reduced).held_by(np.full(1, HELD))
    problem = problem_of(reduced)
    p, x = problem.prior(joint.reduced)[0], np.log([K])
    hypothesis = joint.hypothesis(("support_stiffness",), x, np.ones(1))
    predicted = predict_model(problem, hypothesis, p, x, problem.records[0])
    problem = problem_of(reduced, predicted)
    recovered = recover(problem, joint, p)
    assert recovered is not None
    # force and motion of the law itself, not of what it does beyond the spring
    k = np.real(np.vdot(recovered.D[0], recovered.F[0])) / np.linalg.norm(recovered.D[0]) ** 2
    assert k == pytest.approx(K, rel=0.02)
    start = Start(physics("cubic_stiffness"), {"k3": 1e-6}, K, 0.0, 0.0)
    loop, at = loop_of(problem, joint, start, recovered)
    (history,) = loop.histories([(p, at)])[0]
    assert np.linalg.norm(history.y - predicted) < 5e-3 * np.linalg.norm(predicted)
    np.testing.assert_allclose(history.f, K * history.d, atol=1e-3 * np.abs(history.f).max())


def test_of_several_places_each_is_held_as_it_says(reduced: ReducedModel) -> None:
    place = cut(reduced)
    other = next(
        p for p in find_places(reduced.model) if p.kind == "ground" and p.nodes == (10,) and p.direction == "Z"
    )
    rows = [6 * reduced.model.index(node) + 2 for node in small_study.SENSORS]
    both = open_joints([other, place], reduced, small_study.BAND[1], rows, [None, np.full(1, HELD)])
    assert both.held is not None
    np.testing.assert_allclose(both.held, [0.0, HELD])
    free = open_joints([other, place], reduced, small_study.BAND[1], rows)
    np.testing.assert_allclose(both.w[0], free.w[0])
    assert free.held is None


def test_a_joint_is_as_stiff_as_it_is_whatever_its_member_is(reduced: ReducedModel) -> None:
    """Where the element that is cut is a fifth stiffer than drawn, and the joint half as stiff as the element, what is
    told is the joint."""
    joint = opened(reduced)
    assert joint.place.parameter is not None
    k = 0.5 * float(joint.place.release[0, 0])
    x = np.log([k])
    problem = problem_of(reduced)
    p = problem.prior(joint.reduced)[0]
    p[joint.place.parameter] = np.log(1.2)
    truth = joint.at(p).held_by(np.full(1, k))
    record = problem.records[0]
    y = predict_model(problem, truth.hypothesis(("support_stiffness",), x, np.ones(1)), p, x, record)
    problem = problem_of(reduced, y)
    begun = Candidate(physics("support_stiffness"), "joint_stiffness", joint.held_by(np.full(1, k)), {"k": k}, p, x, 1,
                      0.0, 1.0, 1.0)  # fmt: skip
    found = refit_linear(problem, begun)
    assert found.values["k"] == pytest.approx(k, rel=0.01)
