"""The error of a deck's mesh mode by mode, and what a diagnosis makes of it."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.sparse import csc_array

from femend.errors import FemendError
from femend.model import Model, affordable_refinement, form_errors, mesh_error, read_model, reduce_model
from femend.model.mesh.form_errors import (
    HALVED,
    MESH_SD,
    QUADRATIC_MODE_SD,
    REFINED_MODE_SD,
    REFINED_SHARE,
    SOLID_MODE_SD,
)
from femend.model.mesh.refined import refined_size
from femend.model.mesh.scatter import SUPPORT_SD

sys.path.insert(0, str(Path(__file__).parent))
from test_refined import bricks, frequencies, shells

F_MAX = 900.0
MODULE = sys.modules["femend.model.mesh.mesh_error"]


@pytest.fixture
def model(tmp_path: Path) -> Model:
    return read_model(bricks(tmp_path / "m.bdf"))


def test_the_error_is_that_of_the_frequencies(model: Model, tmp_path: Path) -> None:
    found = mesh_error(model, F_MAX)
    truth = frequencies(read_model(bricks(tmp_path / "fine.bdf", (24, 8, 4))), len(found.freq))
    np.testing.assert_allclose(found.freq, frequencies(model, len(found.freq)), rtol=1e-9)
    # quadratic bricks this long are a little too stiff in all modes alike; of the rest what is left is an eighth
    left = found.converged / truth - 1
    assert np.ptp(found.error) > 0.08
    np.testing.assert_allclose(left, left.mean(), rtol=0, atol=0.125 * np.ptp(found.error) + 0.002)
    assert np.all(found.mac > 0.9)
    head, first, *_ = str(found).splitlines()
    assert head.split() == ["mode", "deck", "Hz", "refined", "Hz", "converged", "Hz", "error", "%", "MAC"]
    assert first.split()[0] == "1"
    assert float(first.split()[1]) == pytest.approx(found.freq[0], rel=1e-4)


def test_shells_are_extrapolated(tmp_path: Path) -> None:
    found = mesh_error(read_model(shells(tmp_path / "m.bdf")), 200.0)
    step = found.refined**2 - found.freq**2
    np.testing.assert_allclose(found.converged**2 - found.refined**2, step / 3, rtol=1e-9)


def test_a_mode_without_its_like_has_no_error(model: Model, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(MODULE, "SAME", 2.0)
    found = mesh_error(model, F_MAX)
    assert np.isnan(found.error).all()
    assert np.isnan(found.converged).all()
    assert str(found).splitlines()[1].split()[2:5] == ["-", "-", "-"]
    assert affordable_refinement(model, F_MAX) is None


@pytest.mark.parametrize(("alike", "told"), [(0.94, False), (1.0, True)])
def test_a_mode_that_a_finer_mesh_puts_higher_has_to_be_the_same_for_sure(
    model: Model, monkeypatch: pytest.MonkeyPatch, alike: float, told: bool
) -> None:
    """With one more half wave between two nodes of the deck another mode looks nearly alike at these."""
    true = mesh_error(model, F_MAX)
    solve = MODULE.core_modes

    def raised(K: csc_array, M: csc_array, f_max: float) -> tuple[np.ndarray, np.ndarray]:
        freq, phi = (a.copy() for a in solve(K, M, f_max))
        if K.shape[0] > model.fe.n_a:
            freq[1] = 1.2 * true.freq[1]
            phi[:, 1] = np.sqrt(alike) * phi[:, 1] + np.sqrt(1 - alike) * phi[:, -1]
        return freq, phi

    monkeypatch.setattr(MODULE, "core_modes", raised)
    found = mesh_error(model, F_MAX)
    assert np.isfinite(found.error[1]) == told
    assert found.error[0] == pytest.approx(true.error[0], rel=1e-9)


def test_priors_of_modes_follow_from_their_error(model: Model) -> None:
    finer = affordable_refinement(model, F_MAX)
    assert finer is not None
    assert finer.mesh_error is not None
    error = finer.mesh_error
    reduced = reduce_model(finer, F_MAX, [6 * model.index(7) + 2])
    n = int((reduced.freq < F_MAX).sum())
    sds = form_errors(reduced, F_MAX).mode_sds(n)
    order = np.argsort(error.refined)
    np.testing.assert_allclose(sds, np.hypot(REFINED_SHARE * error.error[order][:n], REFINED_MODE_SD), rtol=1e-6)
    # modes that were not paired, and those of a deck that was not refined, keep the wide prior of bricks
    lost = np.where(np.arange(len(error.freq)) == 1, np.nan, error.refined)
    part = replace(error, refined=lost, converged=lost)
    other = form_errors(replace(reduced, model=replace(finer, mesh_error=part)), F_MAX).mode_sds(n)
    at = int(np.flatnonzero(order == 1)[0])
    assert other[at] == SOLID_MODE_SD
    np.testing.assert_allclose(np.delete(other, at), np.delete(sds, at))
    plain = reduce_model(model, F_MAX, [6 * model.index(7) + 2])
    assert np.all(form_errors(plain, F_MAX).mode_sds(n) == SOLID_MODE_SD)


def test_solids_too_many_to_be_halved_are_believed_less(model: Model, monkeypatch: pytest.MonkeyPatch) -> None:
    sds = []
    for most in (3000, refined_size(model)):
        monkeypatch.setattr(MODULE, "MOST_NODES", most)
        finer = affordable_refinement(model, F_MAX)
        assert finer is not None
        assert finer.mesh_error is not None
        assert finer.mesh_error.halved == (most == 3000)
        sds.append(form_errors(reduce_model(finer, F_MAX, [6 * model.index(7) + 2]), F_MAX).mode_sds(1)[0])
    assert REFINED_MODE_SD <= sds[0] < QUADRATIC_MODE_SD <= sds[1]


def test_little_of_the_growing_error_is_left_in_refined_shells(tmp_path: Path) -> None:
    model = read_model(shells(tmp_path / "m.bdf"))
    finer = affordable_refinement(model, 200.0)
    assert finer is not None
    sds = [form_errors(reduce_model(m, 200.0, [8]), 200.0).mesh_sd for m in (model, finer)]
    assert sds == [MESH_SD, HALVED * MESH_SD]


def test_elements_at_a_clamp_may_be_off_by_more(model: Model) -> None:
    """The bricks that the clamped face belongs to are one unit; those of a deck without a clamp are none."""
    units = form_errors(reduce_model(model, F_MAX, [6 * model.index(7) + 2]), F_MAX).units
    (clamp,) = (u for u in units if u.sd == SUPPORT_SD)
    held = {n for n, x in zip(model.node_ids.tolist(), model.xyz[:, 0], strict=True) if x == 0.0}
    assert set(clamp.elements) == {eid for eid, _, nodes in model.fe.elements() if held & set(nodes)}
    assert abs(clamp.mass).max() == 0
    free = model.unsupported
    assert all(u.sd != SUPPORT_SD for u in form_errors(reduce_model(free, F_MAX, [8]), F_MAX).units)


def test_what_cannot_be_refined_stays_as_it_is(model: Model, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert affordable_refinement(model, F_MAX) is not None
    with monkeypatch.context() as patch:
        patch.setattr(MODULE, "MOST_NODES", 100)
        assert affordable_refinement(model, F_MAX) is None
    (tmp_path / "m.bdf").unlink()
    assert affordable_refinement(model, F_MAX) is None
    with pytest.raises((FemendError, OSError)):
        mesh_error(model, F_MAX)
