"""What a planned test tells of dashpots: ratios and phases against the modes of the damped structure."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
import scipy.linalg

from femend import Dof, pretest_study
from femend.errors import PretestError
from femend.model import Model
from femend.model.terms.linear_terms import point_dashpot, point_mass
from femend.pretest import PlannedTest, dashpot_test

sys.path.insert(0, str(Path(__file__).parents[1]))
import small_study

PLACES = [Dof(n, 3) for n in range(2, 14)]
ZETA, C = 0.01, 0.2


@pytest.fixture(scope="module")
def model(tmp_path_factory: pytest.TempPathFactory) -> Model:
    return small_study.cantilever(tmp_path_factory.mktemp("dashpots"))[0]


def plan_of(model: Model, c: float = C, **settings: float) -> PlannedTest:
    seen = model.transformation().tocsr()[[model.row(d) for d in PLACES]]
    dashpots = [point_dashpot(model, 7, 3, c), point_dashpot(model, 13, 3, c)]
    return dashpot_test(model, dashpots, seen, 4, modes=[0, 1, 2], zeta=settings.pop("zeta", ZETA), **settings)


def damped_modes(model: Model, node: int, c: float) -> tuple[np.ndarray, np.ndarray]:
    """Damping ratios (3,) and shapes (n_places, 3) of the deck with one dashpot, by the eigenvalues of its state."""
    K, M = (A.toarray() for A in model.matrices())
    T = model.transformation().toarray()
    row = T[model.row(Dof(node, 3))]
    n, Minv = len(K), np.linalg.inv(M)
    A = np.block([[np.zeros((n, n)), np.eye(n)], [-Minv @ K, -Minv @ (c * np.outer(row, row))]])
    lam, x = scipy.linalg.eig(A)
    at = np.flatnonzero(lam.imag > 0)
    at = at[np.argsort(lam[at].imag)][:3]
    return -lam[at].real / np.abs(lam[at]), T[[model.row(d) for d in PLACES]] @ x[:n, at]


@pytest.mark.parametrize(("position", "node"), [(0, 7), (1, 13)])
def test_ratios_and_phases_are_those_of_the_damped_structure(model: Model, position: int, node: int) -> None:
    plan = plan_of(model)
    # small enough that what is left is of the second order
    zeta, shapes = damped_modes(model, node, 1e-3 * C)
    np.testing.assert_allclose(plan.frequencies[:, position], 1e3 * zeta / (0.2 * ZETA), rtol=1e-5)
    for r in range(3):
        motion = plan.motion[:, r]
        scale = (motion @ motion) / (motion @ shapes[:, r])
        measured = 1e3 * (scale * shapes[:, r]).imag
        wanted = plan.shapes[:, r, position]
        # a phase common to all places is free: that part of the foretold shape is nothing
        wanted = wanted - motion * (motion @ wanted) / (motion @ motion)
        np.testing.assert_allclose(measured, wanted, atol=1e-4 * np.abs(wanted).max())


def test_the_own_damping_may_be_anything_within_a_factor_of_e(model: Model) -> None:
    plan = plan_of(model, damping_sd=0.1)
    assert plan.names[-1] == "damping of the structure"
    np.testing.assert_allclose(plan.frequencies[:, -1], 10.0)
    assert plan.prior[-1, -1] == 1.0
    # a level that is free takes away of the ratios what all modes have alike
    F = plan.information([5, 11])
    assert 1 / np.linalg.inv(F)[0, 0] < F[0, 0] * (1 - 1e-6)


def test_what_is_no_dashpot_or_has_no_ratio(model: Model) -> None:
    seen = model.transformation().tocsr()[[model.row(d) for d in PLACES]]
    with pytest.raises(PretestError, match="mass at 7 has no dashpot; give it to candidate_matrices"):
        dashpot_test(model, [point_mass(model, 7, 1.0)], seen, 4, modes=[0], zeta=ZETA)
    with pytest.raises(PretestError, match="zeta is 0; what a dashpot adds"):
        plan_of(model, zeta=0.0)


PLAN = """[pretest]
band = [5.0, 600.0]
sensors = 5
directions = ["Z"]
virtual_test = false
"""


def told(folder: Path, entries: str, parameters: bool = True) -> dict[tuple[str, str], dict]:
    kept = small_study.PARAMETERS if parameters else ()
    run = pretest_study(small_study.write_unrecorded(folder, f"{PLAN}distinguish = [{entries}]\n", kept))
    return {(d["truth"], d["rival"]): d for d in run.result["distinguish"]}


def dashpot(node: int, c: float = 5.0) -> str:
    return f'{{ physics = "viscous_damper", node = {node}, direction = "Z", c = {c} }}'


def test_a_study_tells_dashpots_from_each_other(tmp_path: Path) -> None:
    found = told(tmp_path, f"{dashpot(7)}, {dashpot(13)}")
    for d in found.values():
        assert 0 < d["distance"] < d["detected"] < np.inf
    again = told(tmp_path, f"{dashpot(7, 10.0)}, {dashpot(13, 10.0)}")
    for pair, d in found.items():
        assert again[pair]["distance"] == pytest.approx(2 * d["distance"], rel=1e-6)


def test_no_spring_and_no_parameter_takes_the_place_of_a_dashpot(tmp_path: Path) -> None:
    spring = '{ physics = "support_stiffness", node = 13, direction = "Z", k = 300.0 }'
    found = told(tmp_path, f'{dashpot(13)}, {spring}, {{ parameter = "E_root" }}')
    damper = "dashpot at 13 Z to ground"
    for rival in ("spring at 13 Z to ground", "E_root"):
        d, back = found[damper, rival], found[rival, damper]
        assert d["distance"] == pytest.approx(d["detected"], rel=1e-9)
        assert back["distance"] == pytest.approx(back["detected"], rel=1e-9)


def test_a_study_without_parameters_tells_dashpots_alone(tmp_path: Path) -> None:
    bare, beside = (told(tmp_path / str(i), f"{dashpot(7)}, {dashpot(13)}", bool(i)) for i in (0, 1))
    for pair, d in bare.items():  # parameters change no ratio, and sensors are where they were
        assert d["distance_with_all_places"] == pytest.approx(beside[pair]["distance_with_all_places"], rel=1e-6)
