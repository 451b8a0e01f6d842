"""A study with one fit recording: laws are chosen on a part of it that none was fitted to."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from femend.diagnose.locating.held_back import HELD_BACK

sys.path.insert(0, str(Path(__file__).parents[1]))
import small_study

SPRING = small_study.Truth((7.2e10, 6.9e10), laws=[(7, "support_stiffness", {"k": 4e4})])


@pytest.mark.parametrize(("seconds", "told"), [(4.0, "on the last 35 % (1.4 s)"), (1.0, "its last 35 % are 0.35 s")])
def test_a_spring_is_named_and_it_is_told_on_what(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, seconds: float, told: str
) -> None:
    monkeypatch.setattr(small_study, "SECONDS", seconds)
    monkeypatch.setattr(small_study, "LEVELS", {"high": ("fit", 5.0)})
    run = small_study.diagnosed(tmp_path, SPRING)
    split, warnings = run.diagnosis.split, run.result["warnings"]
    (finding,) = run.result["findings"]
    assert (finding["physics"], finding["location"]["nodes"]) == ("support_stiffness", [7])
    assert sum(told in w for w in warnings) == 1
    assert any(w.startswith("one level only (high)") for w in warnings)
    (fitted,), (choosing,) = split.fitting.records, split.choosing.records
    if seconds > 2:
        assert fitted.n == choosing.start == round((1 - HELD_BACK) * choosing.n)
        # scores count as many values as all of the recording has
        whole = split.whole.lines(run.diagnosis.reduced)[0]
        assert run.diagnosis.n_values == pytest.approx(whole.share * whole.Y.size, rel=0.02)
    else:
        assert split.fitting is split.choosing
