"""Studies of real structures through the commands: the figures of the examples in Python, from a study file."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from femend import correlate_study, update_study
from femend.estimate.updating import update


@pytest.fixture
def examples(project_root: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[str], ModuleType]:
    monkeypatch.syspath_prepend(str(project_root / "python" / "examples"))

    def find(name: str) -> ModuleType:
        sys.modules.pop(name, None)
        return importlib.import_module(name)

    return find


def test_the_four_storey_frame_from_a_study_is_that_of_the_example(
    examples: Callable[[str], ModuleType], shared: Callable[[str], Path], tmp_path: Path
) -> None:
    data = shared("data/shear_frames")
    direct = update(examples("shear_frames").four_storeys(data))
    run = update_study(examples("shear_frame_study").write_study(tmp_path, data), tmp_path / "out")
    assert run.found.status == direct.status == "converged"
    # the file of modes has six digits
    np.testing.assert_allclose(list(run.factors.values()), list(direct.values.values()), rtol=1e-4)
    np.testing.assert_allclose(list(run.found.sd.values()), list(direct.sd.values()), rtol=1e-3)
    # issue: measured modes met within 1 %, storey stiffnesses inside their priors
    assert max(abs(m["error_after"]) for m in run.result["recordings"][0]["modes"]) < 0.001
    assert run.found.left_prior() == []
    text = (tmp_path / "out" / "model.updated.bdf").read_text()
    assert float(text.split("PELAS,4,")[1].split("\n")[0]) == pytest.approx(10.0 * run.factors["k4"], rel=1e-12)


def test_the_hammer_test_of_the_motor_rig_is_correlated(shared: Callable[[str], Path], tmp_path: Path) -> None:
    run = correlate_study(shared("cases/rig/public/study.toml"), tmp_path / "out")
    hammer = run["ema_hammer"]
    np.testing.assert_allclose(hammer.test.freq, [6.99, 7.69, 12.11, 18.67, 19.05], atol=0.01)
    assert hammer.n_pairs == 5
    assert min(r.mac for r in hammer.comparison.table.rows) > 0.99
    # by reciprocity: one accelerometer, blows at the others
    assert hammer.frfs is not None
    assert len(hammer.frfs.matched.inputs) > len(hammer.frfs.matched.outputs)


def test_the_run_up_of_the_motor_rig_is_compared_in_its_own_configuration(shared: Callable[[str], Path]) -> None:
    """On its layer the machine has other modes than the deck: the peaks are where the ambient recording has its modes,
    look like the model's, and are as far off as those."""
    run = correlate_study(shared("cases/rig/public/study.toml"))
    found = run.run("runup")
    np.testing.assert_allclose(found.measured.peak_freq, [5.69, 10.22, 17.31], atol=0.02)
    ambient = run["ambient"]
    for row in found.comparison.table.rows:
        near = int(np.argmin(np.abs(ambient.test.freq - row.freq_a)))
        assert abs(ambient.test.freq[near] / row.freq_a - 1) < 0.01
        mate = next(r for r in ambient.comparison.table.rows if r.a == near)
        assert mate.b == row.b
    assert [r.b for r in found.comparison.table.rows] == [0, 2, 3]
    assert min(r.mac for r in found.comparison.table.rows) > 0.75
    assert [r["recording"] for r in run.result["runs"]] == ["runup"]  # the run-down is to be predicted
