"""Shapes of close modes are compared as one space, in updates too."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from femend.estimate.updating import (
    AffineMatrices,
    Configuration,
    Frequencies,
    MacDifferences,
    ModalSystem,
    ModeTest,
    Problem,
    Response,
    ShapeDifferences,
    State,
    Unknowns,
    affine_matrices,
    factor,
    update,
)
from femend.estimate.updating.close_modes import CLOSENESS, close_modes, reach

Array = NDArray[np.float64]
NAMES = ("a", "b", "c", "m")


def arms(n: int = 3) -> AffineMatrices:
    """Arms of four masses each about one hub: `a` stiffens the first arm, `b` the second, `c` all, `m` is a mass at the
    first arm's tip. With all at 1 the arms' own modes are n - 1 fold."""
    size = 4 * n + 1
    parts = {name: np.zeros((size, size)) for name in ("a", "b", "c")}
    for arm in range(n):
        for i, k in enumerate((2e3, 3e3, 2.5e3, 4e3)):
            row = np.zeros(size)
            row[4 * arm + i] = 1.0
            row[4 * arm + i - 1 if i else size - 1] -= 1.0
            own = k * np.outer(row, row)
            parts["c"] += 0.5 * own
            name = {0: "a", 1: "b"}.get(arm)
            parts[name or "c"] += 0.5 * own
    parts["c"][-1, -1] += 5e3
    tip = np.zeros((size, size))
    tip[3, 3] = 0.02
    return affine_matrices(parts, np.eye(size) - tip, M_parts={"m": tip})


def problem_at(truth: Array, turn: float = 0.0, *, n: int = 3, mac: bool = False) -> tuple[Problem, Array, Array]:
    """Six modes of the arms at `truth`, shapes of neighbours within 2 % mixed by `turn` radians."""
    system = ModalSystem(arms(n), np.eye(4 * n + 1), 11)
    state = system.solve(truth)
    freq, phi = state.value("freq")[:6], state.value("phi")[:, :6].copy()
    for k in range(5):
        if freq[k + 1] - freq[k] < CLOSENESS * freq[k + 1]:
            c, s = np.cos(turn), np.sin(turn)
            phi[:, [k, k + 1]] = phi[:, [k, k + 1]] @ np.array([[c, -s], [s, c]])
    phi = phi / np.abs(phi).max(axis=0)
    response: Response = MacDifferences(phi, np.full(6, 0.02)) if mac else ShapeDifferences(phi, 0.02)
    unknowns = Unknowns.of([factor(name, 0.3) for name in NAMES])
    configuration = Configuration("arms", system, (Frequencies(freq, 1e-3 * freq), response), ModeTest(freq, phi))
    return Problem(unknowns, (configuration,)), freq, phi


@pytest.mark.parametrize("mac", [False, True])
@pytest.mark.parametrize("n", [3, 4])
@pytest.mark.parametrize("apart", [0.004, 0.02, 0.05])
def test_derivatives_of_close_modes(apart: float, n: int, mac: bool) -> None:
    """From modes that coincide nearly to such as are just close, two and three of them, in the test and the model."""
    problem, _, _ = problem_at(np.array([1.01, 1.02, 1.0, 1.1]), 0.7, n=n, mac=mac)
    p = np.array([1.0 + apart, 0.999, 1.1, 0.9])
    pairs = problem.evaluate(p).mates[0]
    assert pairs is not None
    assert any(pairs.close(problem.states(p)[0], 4 * n + 1))
    J = problem.evaluate(p, slopes=True).jacobian
    h = 1e-6
    exact = [(problem.evaluate(p + h * e).residual - problem.evaluate(p - h * e).residual) / (2 * h) for e in np.eye(4)]
    np.testing.assert_allclose(J, np.array(exact).T, atol=2e-5 * np.abs(exact).max())


@pytest.mark.parametrize("mac", [False, True])
@pytest.mark.parametrize("turn", [0.0, 1.0, 2.0])
def test_double_modes_are_any_mixture(turn: float, mac: bool) -> None:
    """The parameters are found whichever mixture of double modes was measured."""
    truth = np.array([1.0, 1.0, 1.2, 1.0])
    truth[:2] = 1.2  # as stiff as the third arm, whose modes are double then
    problem, _, _ = problem_at(truth, turn, mac=mac)
    assert problem.evaluate(truth).squares < 1e-3
    found = update(problem)
    assert mac or found.status == "converged"  # MACs have no slope where they are met, so that their search creeps
    np.testing.assert_allclose(found.p, truth, atol=0.01)


def test_the_cost_has_no_jump_where_modes_part_or_cross() -> None:
    problem, _, _ = problem_at(np.array([1.2, 1.2, 1.2, 1.0]), 1.0)
    at = np.linspace(0.9, 1.1, 2001)
    active = problem.active(problem.states(np.ones(4)))
    cost = np.array([problem.evaluate(np.array([1.2 * a, 1.2, 1.2, 1.0]), active=active).cost for a in at])
    steps = np.abs(np.diff(cost))
    assert steps.max() < 0.05 * np.ptp(cost)


def test_single_modes_are_compared_as_they_were() -> None:
    """No neighbour within the closeness, no change."""
    assert close_modes(np.array([0, 1]), np.array([9.0, 10.0]), np.array([9.0, 9.2, 12.0]), 8) == ((), ())
    assert reach(np.array([0, 1, -1]), np.array([9.0, 9.2, 12.0])) == 2
    assert reach(np.array([0, -1]), np.array([9.0, 9.1, 12.0])) == 2


def test_a_crowd_at_few_sensors_is_no_space() -> None:
    freq = np.array([9.0, 9.01, 9.02, 9.03])
    assert close_modes(np.array([0]), np.array([9.0]), freq, 5) == ((),)
    assert len(close_modes(np.array([0]), np.array([9.0]), freq, 8)[0]) == 3


def test_a_poorly_measured_mode_keeps_its_mate_beside_a_close_one() -> None:
    """Two measured modes 2 Hz apart are one space, in which the mate of the second explains the first as well; to leave
    no mode of the model that looks a little like the second unused, these two changed mates (MAC 0 of the first)."""
    e = np.eye(6)
    phi = np.column_stack([e[0], e[1], e[2], 0.9 * e[1] + 0.43 * e[3]])
    test = ModeTest(np.array([146.0, 148.0]), np.column_stack([0.85 * e[0] + 0.53 * e[4], e[1]]))
    mates = test.mates(State({"freq": np.array([144.0, 148.0, 160.0, 190.0]), "phi": phi}, lambda n: {}))
    assert mates.mate.tolist() == [0, 1]
    # a mode without a mate still takes what is left over, and says how poor that is
    lost = ModeTest(np.array([146.0, 148.0]), np.column_stack([e[5] + 0.1 * e[2], e[1]]))
    mates = lost.mates(State({"freq": np.array([144.0, 148.0, 160.0, 190.0]), "phi": phi}, lambda n: {}))
    assert mates.mate[1] == 1
    assert mates.mate[0] not in (-1, 1)
    assert mates.mac[0] < 0.5
