"""Modes and FRFs as labelled data: names of DOFs in errors, signs of sensors, rows that do not exist."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from femend import _core
from femend.analysis.frf import modal_frf, modal_frf_scores, shapes_at
from femend.analysis.model_modes import model_modes
from femend.analysis.modes import solve_modes
from femend.correlate import compare_frfs
from femend.data.channel import Channel
from femend.data.frf import FRF
from femend.data.mode_set import ModeSet
from femend.dof import Dof
from femend.errors import SingularModelError, UnitError
from femend.model.model import read_model

DOFS = [Dof(10, 1), Dof(10, 3), Dof(20, 1)]


def dense(K: np.ndarray, M: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    n = len(K)
    return np.arange(0, n * n + 1, n), np.tile(np.arange(n), n), K.ravel().astype(float), M.ravel().astype(float)


K = 1e4 * np.array([[3.0, -1, 0], [-1, 2, -1], [0, -1, 2]])
M = np.diag([1.0, 2.0, 1.5])


@pytest.fixture
def modes() -> ModeSet:
    return solve_modes(*dense(K, M), DOFS, n_modes=3, zeta=[0.01, 0.02, 0.03]).modes


def test_modes_are_labelled(modes: ModeSet) -> None:
    assert modes.dofs == tuple(DOFS)
    assert modes.zeta.tolist() == [0.01, 0.02, 0.03]
    lam = np.linalg.eigvals(np.linalg.solve(M, K)).real
    np.testing.assert_allclose((2 * np.pi * modes.freq) ** 2, np.sort(lam), rtol=1e-12)


def test_modes_of_a_model_stand_at_its_nodes(tmp_path: Path) -> None:
    """Two masses of 1 kg on a chain of equal springs along X, of which one with one mass is at 100 Hz."""
    k = (2 * np.pi * 100.0) ** 2
    lines = ["GRID,1,,0.,0.,0.", "GRID,2,,1.,0.,0.", "GRID,3,,2.,0.,0.", "SPC1,1,123456,1", "SPC1,1,23456,2,3"]
    lines += [f"CELAS2,1,{k:.9E},1,1,2,1", f"CELAS2,2,{k:.9E},2,1,3,1", "CONM2,11,2,,1.", "CONM2,12,3,,1."]
    path = tmp_path / "chain.bdf"
    path.write_text("\n".join(["SOL 103", "CEND", "SPC = 1", "BEGIN BULK", *lines, "ENDDATA", ""]))
    found = model_modes(read_model(path), zeta=0.01)
    # lambda / k = (3 -+ sqrt(5)) / 2 for the chain held at one end
    np.testing.assert_allclose(found.freq, 100.0 * np.sqrt((3 + np.array([-1, 1]) * np.sqrt(5)) / 2), rtol=1e-6)
    assert found.phi.shape == (18, 2)
    at = {str(d): i for i, d in enumerate(found.dofs)}
    ratio = found.phi[at["3:+X"]] / found.phi[at["2:+X"]]
    np.testing.assert_allclose(ratio, [(1 + np.sqrt(5)) / 2, (1 - np.sqrt(5)) / 2], rtol=1e-6)
    assert (found.phi[at["1:+X"]] == 0).all()
    np.testing.assert_allclose((found.phi**2).sum(axis=0), 1.0, rtol=1e-6)


def test_moving_dofs_are_named() -> None:
    loose = K * np.outer([1, 0, 1], [1, 0, 1])
    with pytest.raises(SingularModelError, match="10:") as caught:
        solve_modes(*dense(loose, np.diag([1.0, 0.0, 1.0])), DOFS, n_modes=1)
    assert caught.value.dofs == (str(Dof(10, 3)),)
    with pytest.raises(ValueError, match="name every row"):
        solve_modes(*dense(K, M), DOFS[:2], n_modes=1)


def test_frf_follows_the_direction_of_sensors(modes: ModeSet) -> None:
    up, down = Channel(Dof(10, 3), "acceleration", "m/s^2"), Channel(Dof(10, 3, -1), "acceleration", "m/s^2")
    drive = Channel(Dof(20, 1), "force", "N")
    freq = np.linspace(5, 40, 20)
    frf = modal_frf(modes, freq, [up, down], [drive])
    assert frf.H.shape == (20, 2, 1)
    np.testing.assert_array_equal(frf.H[:, 0], -frf.H[:, 1])
    assert (frf.kind, frf.unit) == ("accelerance", "m/s^2/N")
    # three modes are all modes: the static limit is the inverse of K
    static = modal_frf(modes, [0.0], [up], [drive], kind="receptance").H[0, 0, 0]
    np.testing.assert_allclose(static, np.linalg.inv(K)[1, 2], rtol=1e-12)


def test_what_does_not_fit_is_refused(modes: ModeSet) -> None:
    with pytest.raises(ValueError, match="no DOF 99"):
        shapes_at(modes, [Dof(99, 1)])
    place = [Channel(Dof(10, 3), "acceleration", "m/s^2")]
    with pytest.raises(ValueError, match="has no DOF"):
        modal_frf(modes, [1.0], [Channel(None, "tacho", "")], place)
    unscaled = ModeSet(modes.freq, modes.zeta, modes.phi, modes.dofs, scaling="unscaled")
    with pytest.raises(ValueError, match="mass-normalised"):
        modal_frf(unscaled, [1.0], place, place)


def test_factor_tells_inertia_cost_and_singular_rows() -> None:
    arrays = dense(K, M)
    factor = _core.Factor(*arrays[:3])
    assert (factor.kind, factor.inertia) == ("cholesky", 0)
    b = np.arange(6.0).reshape(3, 2)
    np.testing.assert_allclose(factor.solve(b), np.linalg.solve(K, b), rtol=1e-13)
    lam = np.sort(np.linalg.eigvals(np.linalg.solve(M, K)).real)
    shifted = _core.Factor(*arrays[:2], arrays[2] - 0.5 * (lam[1] + lam[2]) * arrays[3])
    assert (shifted.kind, shifted.inertia) == ("indefinite", 2)
    assert factor.nnz == 9 or factor.nnz == 6
    assert factor.flops == 14
    with pytest.raises(SingularModelError, match="zero pivot") as caught:
        _core.Factor(*dense(np.outer([1.0, 2, 3], [1.0, 2, 3]), M)[:3], indefinite=True)
    assert len(caught.value.dofs) == 2
    with pytest.raises(ValueError, match="rows"):
        factor.solve(np.ones((4, 1)))


def frf_of(modes: ModeSet, kind: str, unit: str, *, scale: float = 1.0) -> FRF:
    outputs = [Channel(Dof(n, 3, sign), "acceleration", "m/s^2") for n, sign in ((1, 1), (4, -1), (7, 1))]
    inputs = [Channel(Dof(1, 3), "force", "N"), Channel(Dof(5, 3), "force", "N")]
    found = modal_frf(modes, np.linspace(2.0, 40.0, 77), outputs, inputs, kind=kind)
    return FRF("test", found.freq, found.H * scale, found.outputs, found.inputs, kind, unit)


def random_modes(*, soft: float = 1.0) -> ModeSet:
    rng = np.random.default_rng(8)
    freq, phi = np.sort(rng.uniform(5, 35, 6)), rng.standard_normal((9, 6))
    return ModeSet(soft * freq, np.full(6, 0.02), phi, tuple(Dof(n, 3) for n in range(1, 10)))


@pytest.mark.parametrize(
    ("kind", "unit", "scale"),
    [("accelerance", "mm/s^2/N", 1e3), ("receptance", "m/N", 1.0), ("mobility", "m/s/N", 1.0)],
)
def test_scores_without_storing_are_those_of_the_stored_frfs(kind: str, unit: str, scale: float) -> None:
    measured = frf_of(random_modes(soft=1.03), kind, unit, scale=scale)
    found = modal_frf_scores(random_modes(), measured)
    stored = modal_frf(random_modes(), measured.freq, measured.outputs, measured.inputs, kind=kind)
    expected = compare_frfs(measured, stored)
    for name in ("frac", "faac", "csac", "csf"):
        np.testing.assert_allclose(getattr(found, name), getattr(expected, name), rtol=1e-9)
    assert found.misfit == pytest.approx(np.sum(np.abs(stored.H - measured.H / scale) ** 2), rel=1e-9)
    # a residual takes part
    other = modal_frf_scores(random_modes(), measured, residual=np.full((3, 2), 1e-3))
    assert other.misfit != pytest.approx(found.misfit, rel=1e-3)


def test_scores_of_what_does_not_fit_are_refused() -> None:
    measured = frf_of(random_modes(), "accelerance", "m/s^2/N")
    with pytest.raises(UnitError, match=r"'test' is in 'm/s\^2/N' and the model's FRFs are in 'm/N'"):
        modal_frf_scores(random_modes(), measured, unit="m/N")
    few = ModeSet([1.0], [0.01], [[2.0]], (Dof(1, 3),))
    with pytest.raises(ValueError, match=r"no DOF 4:-Z, 7:\+Z"):
        modal_frf_scores(few, measured)
