"""Updates that say less than they seem to: of few modes, with frequencies off by one factor or some that stay unmet."""

from __future__ import annotations

import csv
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from femend import Dof, correlate_study, model_modes, read_model, update_study
from femend.bench import UpdateRun
from femend.bench.page import render_page
from femend.bench.updating.left import Left, Unmet
from femend.bench.updating.paired_otherwise import paired_otherwise
from femend.bench.updating.update_advice import missing_modes
from femend.bench.updating.update_content import update_page
from femend.bench.updating.update_words import update_text
from femend.estimate.updating.result import ModeRow

sys.path.insert(0, str(Path(__file__).parents[1]))
from bench_study import RECORDINGS, SENSORS, TRUE_E, study_text, write_modes, write_study
from small_study import deck

DOFS = tuple(Dof(n, 3) for n in SENSORS)


def study(folder: Path, factor: float = 1.0, odd: int = 0) -> Path:
    """Modes of the true beam at frequencies times a `factor`, and `odd` ones that are none of its."""
    (folder / "model.bdf").write_text(deck(TRUE_E))
    modes = model_modes(read_model(folder / "model.bdf"), n_modes=3)
    phi = modes.phi[[modes.dofs.index(d) for d in DOFS]]
    (folder / "model.bdf").write_text(deck())
    jagged = [np.array([1.0, -1.0, 1.0, -1.0, 1.0, -1.0]) for _ in range(odd)]
    freq = np.array([*modes.freq * factor, *(modes.freq[0] * factor * (0.2 + 0.1 * np.arange(odd)))])
    write_modes(folder / "tip.uff", freq, np.column_stack([phi, *jagged]), DOFS)
    path = folder / "study.toml"
    path.write_text(study_text(RECORDINGS[:1], ""))
    return path


def page(run: UpdateRun) -> tuple[str, str]:
    """Headline and colour of the badge."""
    made = update_page(run, {}, ())
    return made.headline, made.badge[1]


def test_an_update_on_few_of_the_measured_modes_is_not_green(tmp_path: Path) -> None:
    run = update_study(study(tmp_path, odd=4))
    assert run.result["modes"] == {"measured": 7, "counted": 3}
    assert run.result["advice"].startswith("only 3 of 7 measured modes count: what was found is told by these alone")
    assert run.result["status"] == "converged"
    assert run.result["doubtful"]
    head, colour = page(run)
    assert "on 3 of 7 measured modes, whose frequencies are met to" in head
    assert colour == "warn"
    assert "; 3 of 7 measured modes count" in repr(run)


def test_all_modes_counting_are_told_as_before(tmp_path: Path) -> None:
    run = update_study(study(tmp_path))
    assert not run.result["doubtful"]
    head, colour = page(run)
    assert "parameters updated: measured frequencies are met to" in head
    assert colour == "good"
    assert run.result["advice"] == ""


@pytest.mark.parametrize(
    ("factor", "said"),
    [
        (2 * np.pi, "about 2 pi: they look like rad/s"),
        (1 / 60.0, "about 1/60"),
        (1 / (2 * np.pi), "about 1/(2 pi)"),
        (4.0, "check units, modulus, density"),
    ],
)
def test_frequencies_that_are_all_off_by_one_factor_are_told(factor: float, said: str, tmp_path: Path) -> None:
    """A data set 55 in rad/s, for one: shapes are right, and no parameter makes up for a factor of six."""
    found = correlate_study(study(tmp_path, factor)).result
    told = [w for w in found["warnings"] if said in w]
    assert len(told) == 1, found["warnings"]
    assert told[0].startswith("recording 'tip': 3 of 3 measured modes have the model's shapes at ")
    assert found["advice"].startswith("mend the frequencies that are all off by one factor first")
    assert not any("hardly are one mode" in w for w in found["warnings"])


def test_one_pair_far_apart_is_told(tmp_path: Path) -> None:
    path = study(tmp_path)
    modes = model_modes(read_model(tmp_path / "model.bdf"), n_modes=3)
    phi = modes.phi[[modes.dofs.index(d) for d in DOFS]]
    write_modes(tmp_path / "tip.uff", modes.freq * np.array([1.0, 0.5, 1.0]), phi, DOFS)
    told = [w for w in correlate_study(path).result["warnings"] if "hardly are one mode" in w]
    assert len(told) == 1
    assert "is paired with the model's mode 2" in told[0]
    assert "+100 % off" in told[0]


def test_frequencies_that_stay_unmet_are_told_beside_shapes_that_are_met(tmp_path: Path) -> None:
    """Each kind by itself, with what that makes of the parameters' deviations."""
    path = write_study(tmp_path)
    text = (tmp_path / "model.bdf").read_text()
    (tmp_path / "model.bdf").write_text(text.replace("CONM2,100,9,,0.1", "CONM2,100,9,,0.035"))
    found = update_study(path).result
    frequencies, shapes = found["left"]
    assert (frequencies["response"], frequencies["values"], frequencies["off"]) == ("frequencies", 3, True)
    assert (shapes["response"], shapes["off"]) == ("shapes", False)
    assert "frequencies of tip are left 5.1 times their deviations off (rms of 3, mode 3 by 6.8" in found["advice"]
    assert "the parameters' deviations are too narrow, about 8.8 times as wide" in found["advice"]
    for p in found["parameters"].values():
        assert 5 * p["sd"] < p["widened_sd"] < 10 * p["sd"]
    assert found["wider"] == ["E_root", "E_tip"]
    assert found["doubtful"]


def test_deviations_that_what_is_unmet_widens_stand_beside_the_others(tmp_path: Path) -> None:
    """The table said 1.034 +- 0.001 where 0.92 was true, and the advice below it that this was 30 times too narrow."""
    path = write_study(tmp_path)
    text = (tmp_path / "model.bdf").read_text()
    (tmp_path / "model.bdf").write_text(text.replace("CONM2,100,9,,0.1", "CONM2,100,9,,0.035"))
    run = update_study(path, tmp_path / "out")
    tip = run.result["parameters"]["E_tip"]
    shown = [line.split() for line in update_text(run.result).splitlines()]
    header = next(line for line in shown if line[:1] == ["parameter"])
    assert " ".join(header).startswith("parameter value sd sd with misfit prior sd")
    row = next(line for line in shown if line[:1] == ["E_tip"])
    assert [float(x) for x in row[2:4]] == pytest.approx([tip["sd"], tip["widened_sd"]], rel=0.05)
    assert "± with misfit" in (tmp_path / "out" / "updating.html").read_text()
    with (tmp_path / "out" / "updating.parameters.csv").open() as file:
        table = {line["parameter"]: line for line in csv.DictReader(file)}
    assert float(table["E_tip"]["sd with misfit"]) == pytest.approx(tip["widened_sd"], rel=1e-3)


def test_modes_that_miss_their_frfs_come_first() -> None:
    """Parameters that were fitted to some of the modes in a band, neighbours taken for others; where the modes hold
    is told in Hz."""
    freq = np.linspace(1.0, 100.0, 397)
    H = np.ones((freq.size, 1, 1))
    lines = {
        "measured": SimpleNamespace(freq=freq, H=H),
        "resynthesised": SimpleNamespace(H=H * (freq >= 25.0)[:, None, None]),
    }
    modes = SimpleNamespace(freq=np.array([30.0, 70.0]))
    poor = SimpleNamespace(
        name="h1", role="fit", test=SimpleNamespace(error=0.78, noise_share=0.02, modes=modes, **lines)
    )
    noisy = SimpleNamespace(name="h2", role="fit", test=SimpleNamespace(error=0.3, noise_share=0.25))
    held = SimpleNamespace(name="h3", role="validate", test=poor.test)
    (told,) = missing_modes(cast(Any, [poor, noisy, held]))
    assert told.startswith(
        "the modes that were found leave 78 % of the FRFs of 'h1' (scatter explains 2 %) unexplained"
    )
    assert "narrow [correlation] band to what the modes explain: 25 to 100 Hz of 'h1', and update on that" in told
    assert missing_modes(cast(Any, [noisy, held])) == []


def test_what_is_met_widens_nothing(tmp_path: Path) -> None:
    run = update_study(study(tmp_path))
    assert not any(k["off"] for k in run.result["left"])
    assert all(p["widened_sd"] == pytest.approx(p["sd"]) for p in run.result["parameters"].values())
    assert run.result["wider"] == []
    assert "with misfit" not in update_text(run.result)


def test_the_page_can_be_written(tmp_path: Path) -> None:
    run = update_study(study(tmp_path, odd=4))
    assert "on 3 of 7 measured modes" in render_page(update_page(run, {}, ()))


def test_a_mode_fitted_as_another_than_it_is_shown_as_is_told() -> None:
    """Modes that count are paired among themselves in the fit, and beside all others in the tables."""
    fitted = [ModeRow("tip", 2, 11.3, 13.7, 11.31, 0.9, 0.91, 1), ModeRow("tip", 4, 20.0, 21.0, 20.01, 0.9, 0.98, 2)]
    table = [SimpleNamespace(a=1, freq_b=27.7, mac=0.72), SimpleNamespace(a=3, freq_b=20.01, mac=0.98)]
    compared = SimpleNamespace(
        measured=SimpleNamespace(name="tip"), comparison=SimpleNamespace(table=SimpleNamespace(rows=table))
    )
    counted = SimpleNamespace(name="tip", numbers=(2, 4), sources=("tip",))
    found: Any = SimpleNamespace(modes=lambda: fitted, let_go=list)
    (told,) = paired_otherwise(found, [cast(Any, counted)], [cast(Any, compared)])
    assert told.startswith("recording 'tip': mode 2 at 11.3 Hz was fitted with the model's mode at 11.31 Hz (MAC 0.91)")
    assert "paired with that at 27.7 Hz (MAC 0.72)" in told


def test_deviations_that_hardly_widen_are_not_called_too_narrow() -> None:
    """Few frequencies that are not met beside hundreds of shape values widened deviations "about 1 times"."""
    off = Left("tip", "frequencies", 2, 29.0, True, 800.0)
    found: Any = SimpleNamespace(determined=lambda: ["E"], sd={"E": 0.01})
    assert "too narrow" not in Unmet((off,), {"E": 1.004}).text(found)
    assert "too narrow, about 1.2 times as wide" in Unmet((off,), {"E": 1.2}).text(found)
