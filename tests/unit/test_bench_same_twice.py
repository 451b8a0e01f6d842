"""One test that a study lists twice is told: it counts twice, or holds nothing out."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from femend import Dof, correlate_study, model_modes, read_model, update_study

sys.path.insert(0, str(Path(__file__).parents[1]))
from bench_study import SENSORS, TABLES, Recorded, study_text, write_modes
from small_study import deck

DOFS = tuple(Dof(n, 3) for n in SENSORS)


@pytest.mark.parametrize(
    ("role", "factor", "said"),
    [
        ("fit", 1.0, "'one' and 'two' hold the same 3 modes to all digits: one test that counts twice"),
        ("validate", 1.0, "'two' is held out and is what 'one' was fitted to, so that it confirms nothing"),
        ("fit", 1.0003, ""),
        ("validate", 1.0003, ""),
    ],
)
def test_a_test_that_is_listed_twice_is_told(role: str, factor: float, said: str, tmp_path: Path) -> None:
    (tmp_path / "model.bdf").write_text(deck((7e10 * 0.95, 7e10)))
    modes = model_modes(read_model(tmp_path / "model.bdf"), n_modes=3)
    phi = modes.phi[[modes.dofs.index(d) for d in DOFS]]
    write_modes(tmp_path / "one.uff", modes.freq, phi, DOFS)
    write_modes(tmp_path / "two.uff", modes.freq * factor, phi * -2.0, DOFS)
    (tmp_path / "model.bdf").write_text(deck())
    path = tmp_path / "study.toml"
    path.write_text(study_text((Recorded("one"), Recorded("two", role=role)), TABLES))
    for result in (correlate_study(path).result, update_study(path).result):
        told = [w for w in result["warnings"] if "to all digits" in w]
        assert len(told) == bool(said)
        assert said in "".join(told)
