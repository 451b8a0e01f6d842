"""Derivatives beside a law: by linearisation or along the simulation what simulations of every moved unknown give."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from femend.diagnose.fitting.candidates import Start
from femend.diagnose.fitting.closed_loop import ClosedLoop, History, squares
from femend.diagnose.fitting.descent import Descent, Reached
from femend.diagnose.fitting.linearised import linearised_columns
from femend.diagnose.locating.joint import open_joint
from femend.estimate import FitRecord, Problem
from femend.model import Place, read_model, reduce_model
from femend.model.places.places import stretches, topology
from femend.physics import FitCoordinates, physics

sys.path.insert(0, str(Path(__file__).parents[1]))
import small_study

Array = NDArray[np.float64]
DT, N = 1 / 1024, 1024


DIFFERENCE = 1e-4


def _loop(tmp_path: Path, law: str, values: dict[str, float], sigma: float) -> tuple[ClosedLoop, Array]:
    """A law beside a spring and a dashpot at a node of the small cantilever, and its fit coordinates with theirs."""
    model, out = small_study.cantilever(tmp_path)
    spectrum = np.zeros(N // 2 + 1, dtype=complex)
    rng = np.random.default_rng(3)
    spectrum[8:150] = rng.standard_normal(142) + 1j * rng.standard_normal(142)
    ramp = np.sin(0.5 * np.pi * np.clip(np.arange(N) / 100, 0, 1)) ** 2  # from rest
    u = np.fft.irfft(spectrum, N)[None] * 100 * ramp
    y = rng.standard_normal((len(out), N))
    record = FitRecord("r", u, y, DT, out[-1:], out, np.ones(1), np.ones(len(out)), 0.01 * y.std(axis=1))
    reduced = reduce_model(model, 150.0, out.tolist())
    problem = Problem([record], (8.0, 150.0), small_study.ZETA, 2)
    row = 6 * model.index(10) + 2
    joint = open_joint(
        Place("ground", (10,), "Z", "ground", (np.array([row]),), (np.ones(1),)), reduced, 150.0, out.tolist()
    )
    start = Start(physics(law), values, 8e3, 10.0, 0.0)
    coordinates = FitCoordinates(start.physics, start.values)
    loop = ClosedLoop(problem, joint, law, coordinates, (8e3, 10.0), sigma=sigma)
    return loop, np.concatenate([coordinates.start(), [1.0, 1.0]])


def test_linearised_columns_are_those_of_a_simulation(tmp_path: Path) -> None:
    """Beside a spring and a dashpot with a faint cubic part, where linearisation is exact but for the faint part (1 %)
    and the end of the window (exp(-8))."""
    loop, x = _loop(tmp_path, "cubic_stiffness", {"k3": 1.0}, 10.0)
    problem = loop.problem
    p = problem.prior(loop.joint.reduced)[0]
    (base,), (histories,) = loop.residuals([(p, x)])
    columns = linearised_columns(loop, p, x, histories)
    largest = max(np.linalg.norm(column) for column in columns.T)
    for i, column in enumerate(columns.T):
        moved = p.copy()
        moved[i] += DIFFERENCE
        (e,), _ = loop.residuals([(moved, x)])
        exact = (e - base) / DIFFERENCE
        assert np.linalg.norm(column - exact) < 0.03 * max(np.linalg.norm(exact), 0.01 * largest), i
    assert replace(loop, sigma=0.0).size() >= loop.size()
    descent = Descent.around(loop, x, True)
    (now,) = descent.at(np.concatenate([p, x]))
    simulated, linearised = descent.jacobian(now, exactly=True), descent.jacobian(now)
    assert simulated.shape == linearised.shape
    assert np.linalg.norm(simulated[:, len(p) :] - linearised[:, len(p) :]) < 1e-3 * largest
    assert np.linalg.norm(simulated[:, len(p) - 1] - exact) < 1e-3 * largest


LAWS = {
    "cubic_stiffness": {"k3": 3e10},
    "bouc_wen": {"k": 3e4, "alpha": 0.2, "n": 1.5, "beta": 3e5, "gamma": 1.5e5},
    "coulomb_friction": {"f": 4.0, "kt": 1e5},
    "clearance": {"k": 5e4, "gap": 2e-4, "sides": 2.0},
}


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("sigma", [0.0, 20.0])
def test_tangents_are_the_differences_of_simulations(tmp_path: Path, law: str, sigma: float) -> None:
    loop, x = _loop(tmp_path, law, LAWS[law], sigma)
    p = loop.problem.prior(loop.joint.reduced)[0]
    (_,), (histories,) = loop.residuals([(p, x)])
    spring = x[-2] * 8e3 * histories[0].d + x[-1] * 10.0 * histories[0].v
    assert np.abs(histories[0].f - spring).max() > 0.2 * np.abs(spring).max(), "the law does nothing here"
    descent = Descent.around(loop, x, True)
    (now,) = descent.at(np.concatenate([p, x]))
    columns = descent.jacobian(now, exactly=True)
    largest = max(np.linalg.norm(c) for c in columns.T)
    for i, column in enumerate(columns.T):
        ends = []
        for sign in (1.0, -1.0):
            z = now.z.copy()
            z[i] += sign * 1e-6
            ends.append(descent.at(z)[0].e)
        exact = (ends[0] - ends[1]) / 2e-6
        # a kink that falls between the two runs costs one sample
        assert np.linalg.norm(column - exact) < 2e-3 * max(np.linalg.norm(exact), 0.01 * largest), i


class _Valley(Descent[ClosedLoop]):
    """Descent over two unknowns, of which (y, x) = (1, 1) is the end of a bent valley (Rosenbrock 1960)."""

    STEEP, SIZE = 30.0, 1000.0  # cost and tolerances of a recording

    def at(self, *points: Array) -> list[Reached]:
        residuals = [self.SIZE * np.array([self.STEEP * (z[1] - z[0] ** 2), 1 - z[0]]) for z in points]
        return [Reached(z, e, [], self.cost(z, e)) for z, e in zip(points, residuals, strict=True)]

    def jacobian(self, now: Reached, exactly: bool = False) -> Array:
        return self.SIZE * np.array([[-2 * self.STEEP * now.z[0], self.STEEP], [-1.0, 0.0]])


def test_a_bent_valley_is_followed(tmp_path: Path) -> None:
    """Straight steps take more than twice as many."""
    loop, _ = _loop(tmp_path, "cubic_stiffness", {"k3": 1.0}, 0.0)
    valley = _Valley(loop, np.zeros(2), np.full(2, 1e3), 0, True)
    reached = valley.run(np.array([-1.2, 1.44]), 40)
    assert reached is not None
    np.testing.assert_allclose(reached.z, 1.0, atol=1e-3)


def test_steps_that_are_not_foreseen_to_gain_are_not_simulated(tmp_path: Path) -> None:
    """At the end of the valley no step is; a descent from there has seen where it begins and nothing else."""
    seen: list[Array] = []

    class Counted(_Valley):
        def at(self, *points: Array) -> list[Reached]:
            seen.extend(points)
            return super().at(*points)

    loop, _ = _loop(tmp_path, "cubic_stiffness", {"k3": 1.0}, 0.0)
    reached = Counted(loop, np.zeros(2), np.full(2, 1e3), 0, True).run(np.ones(2), 40, thorough=True)
    assert reached is not None
    assert len(seen) == 1
    assert reached.H is not None


class _Torn(_Valley):
    """The valley with derivatives that numbers hold, but not their squares."""

    def jacobian(self, now: Reached, exactly: bool = False) -> Array:
        return 1e200 * super().jacobian(now)


def test_derivatives_whose_squares_are_beyond_numbers_end_the_descent_where_it_is(tmp_path: Path) -> None:
    """Its end has no Gauss-Newton matrix, so that nobody takes deviations from it."""
    loop, _ = _loop(tmp_path, "cubic_stiffness", {"k3": 1.0}, 0.0)
    start = np.array([-1.2, 1.44])
    reached = _Torn(loop, np.zeros(2), np.full(2, 1e3), 0, True).run(start, 40)
    assert reached is not None
    assert reached.H is None
    np.testing.assert_array_equal(reached.z, start)


class _Steep(_Valley):
    """The valley with derivatives over one residual whose squares numbers hold, but not many times these."""

    def jacobian(self, now: Reached, exactly: bool = False) -> Array:
        return np.diag([1e148, 1.0]) @ super().jacobian(now)


class _Walled(_Valley):
    """The valley with residuals beyond `start` that numbers hold, but not their squares."""

    def at(self, *points: Array) -> list[Reached]:
        far = [np.full(2, 1e200) if there.z[0] != -1.2 else there.e for there in super().at(*points)]
        return [Reached(z, e, [], self.cost(z, e)) for z, e in zip(points, far, strict=True)]


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("kind", [_Torn, _Steep, _Walled])
def test_what_is_beyond_numbers_is_refused_without_a_warning(tmp_path: Path, kind: type[_Valley]) -> None:
    loop, _ = _loop(tmp_path, "cubic_stiffness", {"k3": 1.0}, 0.0)
    start = np.array([-1.2, 1.44])
    reached = kind(loop, np.zeros(2), np.full(2, 1e3), 0, True).run(start, 40, thorough=True)
    assert reached is not None
    np.testing.assert_array_equal(reached.z, start)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("size", [1.0, 1e160, 1e305])
def test_motion_beyond_numbers_leaves_infinite_squares(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, size: float
) -> None:
    loop, x = _loop(tmp_path, "cubic_stiffness", {"k3": 1.0}, 0.0)
    p = loop.problem.prior(loop.joint.reduced)[0]
    simulated = ClosedLoop._simulated

    def grown(*given: Any) -> list[list[History]]:
        return [[replace(h, y=size * h.y) for h in records] for records in simulated(*given)]

    monkeypatch.setattr(ClosedLoop, "_simulated", grown)
    (e,), _ = loop.residuals([(p, x)])
    assert np.isfinite(squares(e)) == (size == 1.0)


def test_nodes_inside_a_member_are_told_as_a_stretch(tmp_path: Path) -> None:
    """Nodes 1, 7 (change of section), 9 (a mass) and 13 are joints of the cantilever; 2 to 6 lie inside one member."""
    path = tmp_path / "model.bdf"
    path.write_text(small_study.deck())
    top = topology(read_model(path))
    assert set(top.joints) == {1, 7, 9, 13}
    assert stretches(top, [7, 4, 6, 3, 11]) == [(7,), (3, 6), (11,)]


def test_a_record_is_compared_from_where_it_starts_and_simulated_from_rest(tmp_path: Path) -> None:
    loop, x = _loop(tmp_path, "cubic_stiffness", {"k3": 3e10}, 0.0)
    p = loop.problem.prior(loop.joint.reduced)[0]
    (record,), cut = loop.problem.records, 600
    (history,) = loop.histories([(p, x)])[0]
    y = history.y.copy()
    y[:, :cut] += y.std()
    late = replace(loop, problem=loop.problem.on([replace(record, y=y, start=cut)]))
    (e,), _ = late.residuals([(p, x)])
    whole = replace(loop, problem=loop.problem.on([replace(record, y=y)]))
    (seen,), _ = whole.residuals([(p, x)])
    assert np.abs(e).max() < 1e-6 < 1.0 < np.abs(seen).max()
    # in a window, which shows the beginning, all of it counts
    (windowed,), _ = late.at(20.0).residuals([(p, x)])
    assert np.abs(windowed).max() > 1.0
