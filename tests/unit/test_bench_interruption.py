"""`femend update` stopped by hand: what the search found is written where it was done, and kept where it was not."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from femend import model_modes, read_model, update_study
from femend.bench import UpdateInterrupted, update
from femend.cli import main
from femend.progress import SilentProgress

sys.path.insert(0, str(Path(__file__).parents[1]))
from bench_study import SENSORS, TABLES, Recorded, study_text, write_modes
from femend import Dof
from small_study import deck

DOFS = tuple(Dof(n, 3) for n in SENSORS)
MORE = TABLES + '[updating]\nstarts = 3\nposterior = "sampled"\n'


@pytest.fixture
def study(tmp_path: Path) -> Path:
    """A test of the cantilever with a modulus 5 % below the deck's, to be updated with starts and draws."""
    (tmp_path / "model.bdf").write_text(deck((7e10 * 0.95, 7e10)))
    modes = model_modes(read_model(tmp_path / "model.bdf"), n_modes=3)
    write_modes(tmp_path / "tip.uff", modes.freq, modes.phi[[modes.dofs.index(d) for d in DOFS]], DOFS)
    (tmp_path / "model.bdf").write_text(deck())
    path = tmp_path / "study.toml"
    path.write_text(study_text((Recorded("tip"),), MORE))
    return path


def stop_in(monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    """Ctrl-C as soon as `name` of the module of the update is called."""

    def stopped(*args: Any, **kwargs: Any) -> Any:
        raise KeyboardInterrupt

    # the package has a function of the module's name
    monkeypatch.setattr(sys.modules["femend.bench.updating.update"], name, stopped)


@pytest.mark.parametrize(
    ("name", "step", "starts"),
    [
        ("search_from_starts", "search from other starts", False),
        ("draw_posterior_of", "draw from the posterior", True),
    ],
)
def test_starts_and_draws_that_are_stopped_leave_what_was_found(
    study: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, step: str, starts: bool
) -> None:
    stop_in(monkeypatch, name)
    with pytest.raises(UpdateInterrupted, match=rf'interrupted in the step "{step}"; .* written to') as stopped:
        update_study(study, tmp_path / "out")
    written = json.loads((tmp_path / "out" / "updating.json").read_text())
    assert written["warnings"][0].startswith(f'interrupted by hand: the step "{step}" and what comes after it')
    assert written["parameters"]["E_root"]["factor"] == pytest.approx(0.95, abs=0.005)
    assert (written["starts"] is not None, written["posterior"]) == (starts, None)
    assert "interrupted by hand" in (tmp_path / "out" / "updating.html").read_text().lower()
    assert (tmp_path / "out" / "model.updated.bdf").is_file()
    assert stopped.value.run.found.status == written["status"]


class Impatient(SilentProgress):
    """Ctrl-C once two starts are done."""

    def start(self, step: str, total: int | None = None) -> None:
        self.left = 2 if step == "search from other starts" else 10**6

    def advance(self, n: int = 1) -> None:
        self.left -= n
        if not self.left:
            raise KeyboardInterrupt


def test_starts_that_were_done_are_kept(study: Path, tmp_path: Path) -> None:
    with pytest.raises(UpdateInterrupted, match="only 2 of 3 starts were followed to their end, and what comes after"):
        update(study, tmp_path / "out", Impatient())
    written = json.loads((tmp_path / "out" / "updating.json").read_text())
    assert written["warnings"][0].startswith("interrupted by hand: only 2 of 3 starts were followed to their end")
    assert (written["starts"]["starts"], written["starts"]["end_there"]) == (2, 2)
    assert written["posterior"] is None


def test_the_command_says_where_the_result_is(study: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    stop_in(monkeypatch, "search_from_starts")
    said = CliRunner().invoke(main, ["update", str(study), "--out", str(tmp_path / "out")])
    assert said.exit_code == 130
    assert f"written to {tmp_path / 'out'}" in said.stderr


@pytest.mark.parametrize("kept", [True, False])
def test_the_search_itself_says_what_is_kept(
    study: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kept: bool
) -> None:
    stop_in(monkeypatch, "search")
    history = tmp_path / "run.json"
    if kept:
        history.write_text("{}")
    with pytest.raises(KeyboardInterrupt) as stopped:
        update_study(study, tmp_path / "out", history=history)
    assert not isinstance(stopped.value, UpdateInterrupted)
    wanted = f"{history} keeps the steps made" if kept else "with --history FILE"
    assert f'in the step "update parameters"; no result was written: {wanted}' in str(stopped.value)
    assert not (tmp_path / "out").exists()
