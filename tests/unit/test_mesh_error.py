"""The error of a deck's mesh, mode by mode."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from femend.errors import FemendError
from femend.model import Model, mesh_error, read_model

sys.path.insert(0, str(Path(__file__).parent))
from test_refined import bricks, frequencies, shells

F_MAX = 900.0
MODULE = sys.modules["femend.model.mesh_error"]


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


def test_a_deck_whose_files_are_gone_is_an_error(model: Model, tmp_path: Path) -> None:
    (tmp_path / "m.bdf").unlink()
    with pytest.raises((FemendError, OSError)):
        mesh_error(model, F_MAX)
