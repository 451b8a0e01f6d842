"""A linear model that is wrong leaves the same share of all recordings; what leaves more at one level is not linear."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from types import SimpleNamespace as Space
from typing import Any, cast

import numpy as np
import pytest

from femend.diagnose.locating.locate import locate
from femend.diagnose.settings import Settings
from femend.diagnose.updating import levels
from femend.diagnose.updating.levels import UNEVEN, depends_on_level, relative_errors
from femend.diagnose.updating.update import UpdatedModel
from femend.model.places.places import find_places
from femend.study.run import diagnose

sys.path.insert(0, str(Path(__file__).parents[1]))
import small_study


def depends(start: UpdatedModel) -> bool:
    located = locate(start.problem, start.reduced, find_places(start.reduced.model), start.null)
    return depends_on_level(start.problem, start.null, located, Settings())


def test_a_linear_model_that_is_wrong_leaves_the_same_share_at_all_levels(tmp_path: Path) -> None:
    start = small_study.updated(tmp_path, small_study.Truth((7.3e10, 6.8e10), ("CELAS2,900,3.+4,7,3",)))
    error = relative_errors(start.problem, start.null)
    assert error.min() > 0.02
    np.testing.assert_allclose(error, error.mean(), rtol=0.15)
    assert not depends(start)


def test_a_model_that_lacks_nothing_leaves_nothing(tmp_path: Path) -> None:
    start = small_study.updated(tmp_path, small_study.Truth((7.3e10, 6.8e10)))
    assert relative_errors(start.problem, start.null).max() < 0.01
    assert not depends(start)


@pytest.mark.parametrize(
    "truth",
    [
        small_study.Truth((7.3e10, 6.8e10), laws=[(7, "cubic_stiffness", {"k3": 5e9})]),
        small_study.Truth((7.3e10, 6.8e10), sine=(8, 61.3, 0.6)),
    ],
    ids=["cubic", "unmeasured"],
)
def test_what_is_not_linear_leaves_more_at_one_level(tmp_path: Path, truth: small_study.Truth) -> None:
    start = small_study.updated(tmp_path, truth)
    error = relative_errors(start.problem, start.null)
    assert error.max() > UNEVEN * error.min()
    assert depends(start)
    # one recording cannot tell
    alone = UpdatedModel(start.problem.on(start.problem.records[:1]), start.reduced, start.null, start.g_rows)
    assert not depends_on_level(
        alone.problem, alone.null, locate(start.problem, start.reduced, (), start.null), Settings()
    )


@pytest.mark.parametrize(("noise", "told"), [(0.008, True), (0.012, False)])
def test_an_error_as_large_as_the_noise_counts_though_the_model_is_allowed_it(
    monkeypatch: pytest.MonkeyPatch, noise: float, told: bool
) -> None:
    # a fit that is consistent by its weights, and a force that takes a quarter of what it leaves
    null, found = Space(misfit=np.array([0.8, 1.0])), Space(fit=Space(misfit=np.array([0.75, 0.75])))
    problem = Space(records=[Space(frf=None, level=a) for a in (1.0, 5.0)])
    monkeypatch.setattr(levels, "relative_errors", lambda *a: np.array([0.003, 0.01]))
    monkeypatch.setattr(levels, "_noise_share", lambda *a: noise)
    assert depends_on_level(cast(Any, problem), cast(Any, null), cast(Any, [found]), Settings()) is told


def test_frfs_have_no_level() -> None:
    """Of one beside a recording in time nothing can be compared, nor of two."""
    low, high, frf = Space(frf=None, level=1.0), Space(frf=None, level=2.5), Space(frf=object(), level=0.0)
    assert levels.levels_differ(cast(Any, [low, frf, high]))
    for records in ([frf, frf], [frf, high], [low], []):
        assert not levels.levels_differ(cast(Any, records)), records


@pytest.mark.slow
def test_a_law_outside_the_catalogue_that_shows_at_one_level_is_not_passed_over(tmp_path: Path) -> None:
    law = (7, "displacement_damping", {"c": 0.05, "beta": 3e9})
    study = small_study.write_study(tmp_path, small_study.Truth((7.3e10, 6.8e10), laws=[law]))
    diagnose(study, tmp_path / "out")
    result = json.loads((tmp_path / "out/result.json").read_text(encoding="utf-8"))
    assert result["verdict"] in ("located-not-named", "missing-physics")
