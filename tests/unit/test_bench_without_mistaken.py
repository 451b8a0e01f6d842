"""Sensors that look mistaken have no part in an update, and frequencies in another unit make none."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from femend import Dof, functions_of, model_modes, read_model, update_study, write_uff
from femend.bench.updating.update_content import update_page
from femend.bench.updating.update_words import update_text
from femend.cli import main
from femend.errors import UpdatingError

sys.path.insert(0, str(Path(__file__).parents[1]))
from bench_study import RECORDINGS, SENSORS, TABLES, TRUE_E, measured_frf, study_text, write_modes, write_study
from small_study import deck

FRFS = TABLES + '[updating]\nresponses = ["frequencies", "shapes", "frfs"]\n'


def modes_study(folder: Path, rows: dict[int, int], factor: float = 1.0, sensors: tuple[int, ...] = SENSORS) -> Path:
    """Modes of the true beam at frequencies times a `factor`; `rows` tells which sensor's motion stands at another's
    row, from 1, with its sign."""
    (folder / "model.bdf").write_text(deck(TRUE_E))
    modes = model_modes(read_model(folder / "model.bdf"), n_modes=3)
    (folder / "model.bdf").write_text(deck())
    dofs = tuple(Dof(n, 3) for n in sensors)
    phi = modes.phi[[modes.dofs.index(d) for d in dofs]]
    put = phi.copy()
    for at, shown in rows.items():
        put[at - 1] = np.sign(shown) * phi[abs(shown) - 1]
    write_modes(folder / "tip.uff", modes.freq * factor, put, dofs)
    path = folder / "study.toml"
    path.write_text(study_text(RECORDINGS[:1], ""))
    return path


@pytest.mark.parametrize(
    ("rows", "names", "said"),
    [
        ({3: -3}, ["7:+Z"], "7:+Z looks reversed: "),
        ({4: 6, 6: 4}, ["9:+Z", "13:+Z"], "look exchanged: "),
    ],
)
def test_a_mistaken_sensor_has_no_part_in_what_is_fitted(
    rows: dict[int, int], names: list[str], said: str, tmp_path: Path
) -> None:
    """The parameters made up for it, beside a warning that named it."""
    sound = update_study(modes_study(tmp_path, {})).result
    assert sound["recordings"][0]["sensors_left_out"] == []
    run = update_study(modes_study(tmp_path, rows), tmp_path / "out")
    found = run.result
    for name, p in found["parameters"].items():
        assert p["factor"] == pytest.approx(sound["parameters"][name]["factor"], rel=2e-3)
    assert found["fit"]["mac"]["after"] > 0.9999
    assert found["recordings"][0]["sensors_left_out"] == names
    assert [str(d) for d in run.counted[0].dofs] == [f"{n}:+Z" for n in SENSORS if f"{n}:+Z" not in names]
    (told,) = [w for w in found["warnings"] if said in w]
    assert "left out of what is fitted: " in told
    assert "in the recording, and update again" in told
    listed = ", ".join(names)
    assert found["advice"].startswith(
        f"mend the sensors that look mistaken, and update again: this update is without {listed} of 'tip'"
    )
    assert found["doubtful"]
    assert f"tip (used to fit, without {listed}, as modelled)" in update_text(found)
    page = update_page(run, {}, ())
    assert any(f"Without {listed}, which look mistaken" in s.lead for s in page.sections)
    assert page.badge[1] == "warn"


def test_frfs_of_a_mistaken_sensor_have_no_part_either(tmp_path: Path) -> None:
    """Those of the driving point's sensor, exchanged with another, are left out; its force stays."""
    path = write_study(tmp_path, tables=FRFS)
    frf = measured_frf(tmp_path, RECORDINGS[0])
    order = [0, 1, 2, 5, 4, 3]
    write_uff(tmp_path / "tip.uff", functions_of(replace(frf, H=frf.H[:, order])))
    run = update_study(path)
    fit, held = run.result["recordings"]
    assert sorted(fit["sensors_left_out"]) == ["13:+Z", "9:+Z"]
    assert held["sensors_left_out"] == []
    (counted,) = run.counted
    assert counted.frf is not None
    assert [str(c.dof) for c in counted.frf.outputs] == ["3:+Z", "5:+Z", "7:+Z", "11:+Z"]
    assert [c.dof.node for c in counted.frf.inputs if c.dof is not None] == [13]
    for name, true in zip(("E_root", "E_tip"), TRUE_E, strict=True):
        p = run.result["parameters"][name]
        assert p["factor"] == pytest.approx(true / 7e10, abs=max(4 * p["widened_sd"], 0.01))


def test_too_few_sensors_that_are_sound_are_refused(tmp_path: Path) -> None:
    path = modes_study(tmp_path, {4: 1, 1: 4}, sensors=(3, 7, 9, 13))
    with pytest.raises(UpdatingError, match=r"look exchanged.*2 would be left in recording 'tip'.*3 are needed"):
        update_study(path, tmp_path / "out")
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("factor", [2 * np.pi, 1 / 60.0, 1 / (2 * np.pi)])
def test_no_update_is_made_of_frequencies_in_another_unit(factor: float, tmp_path: Path) -> None:
    """Modes that count, because the study names them: a deck with parameters at their bounds was written."""
    path = modes_study(tmp_path, {}, factor)
    path.write_text(path.read_text() + "[updating]\nmodes = [1, 2, 3]\n")
    ran = CliRunner().invoke(main, ["update", str(path), "--out", str(tmp_path / "out")])
    assert ran.exit_code == 2
    assert "no update is made of frequencies in another unit: recording 'tip': 3 of 3 measured modes" in ran.output
    assert "give them in Hz, or check the units of the deck" in ran.output
    assert not (tmp_path / "out").exists()
