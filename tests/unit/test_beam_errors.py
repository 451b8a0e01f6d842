"""What a deck's beams are known to add to its frequencies is taken off before a diagnosis, in every basis."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.linalg import eigh

from femend.diagnose.locating.dressed import dressed
from femend.diagnose.updating import update
from femend.model import ReducedModel, reduce_model
from femend.model.mesh.form_errors import form_errors
from femend.model.places.freed import freed
from femend.model.places.held_motion import held_dof
from femend.model.reduced.reduction import extend_model

sys.path.insert(0, str(Path(__file__).parent))
from test_resolution import bars, frequencies, reduced_to

F_MAX = 700.0


def modes(reduced: ReducedModel, n: int = 3, stiff: NDArray[np.float64] | None = None) -> NDArray[np.float64]:
    K, M = reduced.as_drawn()
    return np.asarray(np.sqrt(eigh(K if stiff is None else K + stiff, M, eigvals_only=True)[:n]) / (2 * np.pi))


def mended(reduced: ReducedModel) -> ReducedModel:
    return form_errors(reduced, F_MAX).on(reduced)


@pytest.mark.parametrize("lumped", [False, True])
def test_frequencies_come_closer_to_those_of_a_fine_mesh(tmp_path: Path, lumped: bool) -> None:
    truth = frequencies(bars(tmp_path / "fine.bdf", 40), 3)
    model = bars(tmp_path / "m.bdf", 4, lumped=lumped)
    given = reduced_to(model, F_MAX)
    found = mended(given)
    before, after = np.abs(modes(given) / truth - 1), np.abs(modes(found) / truth - 1)
    assert before[2] > 0.003
    assert np.all(after[1:] < 0.6 * before[1:]), (before, after)
    # nothing of the deck's own model is lost, and what is shown of it as given is that
    np.testing.assert_allclose(modes(found.with_beams()), modes(given), rtol=1e-9)


def test_a_mesh_as_fine_as_its_modes_need_is_left_as_it_is(tmp_path: Path) -> None:
    given = reduced_to(bars(tmp_path / "m.bdf", 40), 100.0)
    found = form_errors(given, 100.0).on(given)
    assert found.beams is None
    np.testing.assert_allclose(modes(found), modes(given), rtol=1e-9)


def test_recordings_simulated_with_the_deck_have_its_errors(tmp_path: Path) -> None:
    given = reduced_to(bars(tmp_path / "m.bdf", 4), F_MAX)
    found = form_errors(given, F_MAX, mesh_as_built=True).on(given)
    np.testing.assert_allclose(modes(found), modes(given), rtol=1e-9)


def test_other_bases_of_the_model_are_without_them_too(tmp_path: Path) -> None:
    model = bars(tmp_path / "m.bdf", 4)
    found = mended(reduced_to(model, F_MAX))
    load = np.zeros((model.fe.n_a, 1))
    load[1] = 1.0
    larger = dressed(extend_model(found.bare(), load), found)
    again = dressed(reduce_model(model, F_MAX, [6 * model.index(2) + 2], load), found)
    for other in (larger, again, found.bare()):
        np.testing.assert_allclose(modes(other), modes(found), rtol=1e-6)
    assert larger.r == found.r + 1
    np.testing.assert_allclose(modes(larger.with_beams()), modes(found.with_beams()), rtol=1e-6)


def test_a_clamp_set_free_and_held_again_has_the_frequencies_of_the_clamp(tmp_path: Path) -> None:
    found = mended(reduced_to(bars(tmp_path / "m.bdf", 4), F_MAX))
    rows = [6 * found.model.index(1) + c for c in range(6)]
    loose = freed(found.bare(), [held_dof(row) for row in rows])
    moving = [row for row in rows if loose.V[row].any()]
    B = loose.V[moving]
    np.testing.assert_allclose(modes(loose, stiff=1e12 * B.T @ B), modes(found), rtol=1e-4)


def test_the_mesh_as_built_is_tried_only_where_its_errors_show(tmp_path: Path) -> None:
    for n, shown in ((4, True), (12, False)):
        reduced = mended(reduced_to(bars(tmp_path / f"{n}.bdf", n), F_MAX))
        start = update.UpdatedModel(_Band(), reduced, None, [])  # type: ignore[arg-type]
        found = update._as_built(start)
        assert (found is reduced.model) is shown
        assert (found is None) is not shown
    finer = replace(reduced, model=replace(reduced.model, refines=reduced.model))
    assert update._as_built(replace(start, reduced=finer)) is reduced.model


class _Band:
    band = (1.0, F_MAX)
