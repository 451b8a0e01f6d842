"""`femend population`: mean and scatter over structures that a study holds, what is written, what cannot be meant."""

from __future__ import annotations

import csv
import json
import sys
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from femend import Dof, model_modes, population_study, update_study
from femend.bench import PopulationRun
from femend.cli import main
from femend.errors import StudyError
from femend.model import read_model
from femend.study import load_study

sys.path.insert(0, str(Path(__file__).parents[1]))
import small_study
from bench_study import write_modes

DOFS = tuple(Dof(n, 3) for n in (3, 5, 7, 9, 11, 13))
N = 8
# the root scatters by 4 % about 1.08, the tip not at all
ROOT = 1.08 + 0.04 * np.array([-1.4, -0.9, -0.5, -0.2, 0.2, 0.5, 0.9, 1.4])
HEAD = """format = "femend-study/1"
title = "blades"
[model]
file = "model.bdf"
[[parameter]]
name = "E_root"
property = "E"
material = 1
[[parameter]]
name = "E_tip"
property = "E"
material = 2
"""


def tables(n: int = N, roles: dict[int, str] | None = None) -> tuple[str, str]:
    """Recordings and structures."""
    recordings = "".join(
        f'[[recording]]\nname = "test {k}"\nfile = "test{k}.uff"\nrole = "{(roles or {}).get(k, "fit")}"\n'
        for k in range(n)
    )
    structures = "".join(f'[[updating.structure]]\nname = "blade {k}"\nrecordings = ["test {k}"]\n' for k in range(n))
    return recordings, structures


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    found = tmp_path_factory.mktemp("blades")
    (found / "model.bdf").write_text(small_study.deck())
    model = read_model(found / "model.bdf", parameters=list(small_study.PARAMETERS))
    rng = np.random.default_rng(5)
    for k, root in enumerate(ROOT):
        modes = model_modes(model, n_modes=4, factors={"E_root": float(root), "E_tip": 0.95})
        phi = modes.phi[[modes.dofs.index(d) for d in DOFS]]
        phi = phi + 0.01 * np.abs(phi).max(axis=0) * rng.standard_normal(phi.shape)
        freq = modes.freq * (1 + 1e-3 * rng.standard_normal(4))
        write_modes(found / f"test{k}.uff", freq, phi, DOFS)
    (found / "study.toml").write_text(HEAD + "".join(tables()))
    return found


@pytest.fixture(scope="module")
def run(folder: Path) -> PopulationRun:
    return population_study(folder, folder / "out")


def test_mean_and_scatter_are_those_of_the_structures(run: PopulationRun) -> None:
    root, tip = (run.result["parameters"][n] for n in ("E_root", "E_tip"))
    assert root["mean"] == pytest.approx(ROOT.mean(), abs=3 * root["mean_sd"])
    assert root["mean_sd"] == pytest.approx(ROOT.std(ddof=1) / np.sqrt(N), rel=0.2)
    assert root["scatter"] == pytest.approx(ROOT.std(ddof=1), rel=0.15)
    assert root["scatter_sd"] == pytest.approx(root["scatter"] / np.sqrt(2 * (N - 1)), rel=0.05)
    assert tip["mean"] == pytest.approx(0.95, abs=4e-3)
    # what does not scatter is told as that: far below the other
    assert tip["scatter"] < 0.1 * root["scatter"]
    assert tip["scatter"] < tip["alone_sd"]
    assert run.result["status"] == "converged"
    assert "a scatter of E_tip 0.00" in run.result["advice"]
    assert "is hardly told from none" in run.result["advice"]
    found = [s["parameters"]["E_root"]["value"] for s in run.result["structures"]]
    np.testing.assert_allclose(found, ROOT, atol=8e-3)
    assert all(s["freq_error"]["after"] < 2e-3 < s["freq_error"]["before"] for s in run.result["structures"])
    # one update of all recordings together has no place for the scatter
    pooled = update_study(run.study.file)
    assert any("8 [[updating.structure]] are updated as one" in w for w in pooled.result["warnings"])
    assert pooled.found.sd["E_root"] < 0.2 * root["scatter"]


def test_what_is_written_and_said(run: PopulationRun, folder: Path) -> None:
    out = folder / "out"
    result = json.loads((out / "population.json").read_text())
    assert result["format"] == "femend-population/1"
    assert [s["name"] for s in result["structures"]] == [f"blade {k}" for k in range(N)]
    mean = result["parameters"]["E_root"]["mean"]
    card = next(x for x in (out / "model.mean.bdf").read_text().splitlines() if x.startswith("MAT1,1,"))
    assert float(card.split(",")[2].replace("+", "e+", 1)) == pytest.approx(7e10 * mean, rel=1e-6)
    page = (out / "population.html").read_text()
    assert "8 structures: E_root scatters most" in page
    assert "Mean and scatter" in page
    with (out / "population.structures.csv").open() as file:
        assert [float(row["E_root"]) for row in csv.DictReader(file)] == pytest.approx(
            [s["parameters"]["E_root"]["value"] for s in result["structures"]]
        )
    assert "8 structures" in repr(run)


def test_held_out_recordings_are_compared_alone(folder: Path, run: PopulationRun) -> None:
    recordings, structures = tables(4, {3: "validate"})
    structures = structures.replace('recordings = ["test 2"]', 'recordings = ["test 2", "test 3"]')
    structures = structures[: structures.index('[[updating.structure]]\nname = "blade 3"')]
    (folder / "held.toml").write_text(HEAD + recordings + structures)
    held = population_study(folder / "held.toml")
    last = held.result["structures"][2]
    assert last["recordings"] == ["test 2", "test 3"]
    assert last["parameters"]["E_root"]["value"] == pytest.approx(ROOT[2], abs=6e-3)


def test_the_command(folder: Path, run: PopulationRun, tmp_path: Path) -> None:
    (folder / "three.toml").write_text(HEAD + "".join(tables(3)))
    done = CliRunner().invoke(main, ["population", str(folder / "three.toml"), "--out", str(tmp_path / "out")])
    assert done.exit_code == 0, done.output
    assert "3 structures" in done.output
    done = CliRunner().invoke(main, ["population", str(folder / "three.toml"), "-q", "--out", str(tmp_path / "out")])
    assert (done.exit_code, done.output) == (0, "")
    plain = HEAD + tables(3)[0]
    (folder / "plain.toml").write_text(plain)
    done = CliRunner().invoke(main, ["population", str(folder / "plain.toml"), "--out", str(tmp_path / "out")])
    assert done.exit_code == 2
    assert "there is no [[updating.structure]]; a population needs three or more" in done.output


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('recordings = ["test 1"]', "recordings = []", r"structure 'blade 1': the list is empty"),
        ('recordings = ["test 1"]', 'recordings = ["tst 1"]', r"'tst 1' is none of .*; did you mean 'test 1'"),
        ('recordings = ["test 1"]', 'recordings = ["test 0"]', r"'test 0' is of structure 'blade 0' already"),
        ('name = "blade 1"', 'name = "blade 0"', r"2 \[\[updating.structure\]\] are named 'blade 0'"),
        ('[[updating.structure]]\nname = "blade 2"\nrecordings = ["test 2"]\n', "", r"2 structures tell no scatter"),
    ],
)
def test_structures_that_cannot_be_meant(folder: Path, run: PopulationRun, old: str, new: str, message: str) -> None:
    text = HEAD + "".join(tables(3))
    assert old in text
    (folder / "broken.toml").write_text(text.replace(old, new))
    with pytest.raises(StudyError, match=message):
        load_study(folder / "broken.toml")


def test_a_recording_of_no_structure(folder: Path, run: PopulationRun) -> None:
    (folder / "lost.toml").write_text(HEAD + tables(4)[0] + tables(3)[1])
    with pytest.raises(StudyError, match="recording 'test 3' is to be fitted and is of no structure"):
        load_study(folder / "lost.toml")


def test_tables_that_do_not_go_with_a_population(folder: Path, run: PopulationRun) -> None:
    text = HEAD + "".join(tables(3)).replace(
        "[[updating.structure]]", "[updating]\nrepeated = true\n[[updating.structure]]", 1
    )
    (folder / "both.toml").write_text(text)
    with pytest.raises(StudyError, match="updating.repeated: a population is told without it"):
        population_study(folder / "both.toml")
