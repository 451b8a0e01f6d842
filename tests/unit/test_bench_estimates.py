"""`femend update` with other starts and with draws: a minimum that the deck's start misses, draws beside Laplace."""

from __future__ import annotations

import csv
import json
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from femend import Dof, model_modes, read_model, update_study
from femend.bench import UpdateRun
from femend.bench.reading.small_problem import small_problem
from femend.bench.updating.drawn import draw_posterior_of
from femend.cli import main
from femend.errors import StudyError, UpdatingError
from femend.estimate.updating import (
    Configuration,
    ModalSystem,
    Problem,
    Unknowns,
    Values,
    reduced_problem,
    update,
)
from femend.study import load_study
from femend.study.file.bench_settings import UpdatingSettings

sys.path.insert(0, str(Path(__file__).parents[1]))
import small_study
from bench_study import SENSORS, TABLES, TRUE_E, Recorded, study_text, write_modes, write_study
from updating_models import FunctionSystem, chain, chain_problem, free

# a beam clamped at both ends, its halves alike but for their moduli: frequencies cannot tell which of them is the soft
# one, shapes can; the deck has it the wrong way round
HALVES, DECK = (1.30, 0.75), (0.90, 1.15)
TRUTH = {"E_root": HALVES[0] / DECK[0], "E_tip": HALVES[1] / DECK[1]}
TABLES_OF_STARTS = "[updating]\nstarts = 6\nshape_sd = 0.2\nseed = 3\n"


def symmetric_deck(E: tuple[float, float] = (7e10, 7e10)) -> str:
    """The cantilever of `small_study` with equal halves, no lump, and a second clamp."""
    lines = small_study.deck(E, ("SPC1,1,123456,13",)).replace("SPC1,1,246,2,THRU,13", "SPC1,1,246,2,THRU,12")
    first = next(x for x in lines.splitlines() if x.startswith("PBAR,1,1,"))
    second = next(x for x in lines.splitlines() if x.startswith("PBAR,2,2,"))
    return lines.replace(second, first.replace("PBAR,1,1,", "PBAR,2,2,")).replace("CONM2,100,9,,0.1\n", "")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    found = tmp_path_factory.mktemp("estimates")
    path = found / "model.bdf"
    path.write_text(symmetric_deck((7e10 * HALVES[0], 7e10 * HALVES[1])))
    dofs = tuple(Dof(n, 3) for n in SENSORS[:-1])
    modes = model_modes(read_model(path), n_modes=3)
    write_modes(found / "tip.uff", modes.freq, modes.phi[[modes.dofs.index(d) for d in dofs]], dofs)
    path.write_text(symmetric_deck((7e10 * DECK[0], 7e10 * DECK[1])))
    text = study_text((Recorded("tip"),), TABLES_OF_STARTS)
    for name in TRUTH:
        assert f'name = "{name}"\n' in text
        text = text.replace(f'name = "{name}"\n', f'name = "{name}"\nprior_sd = 0.4\nbounds = [0.3, 3.0]\n')
    (found / "study.toml").write_text(text)
    return found


@pytest.fixture(scope="module")
def run(folder: Path) -> UpdateRun:
    return update_study(folder, folder / "out")


def test_other_starts_find_what_the_deck_misses(run: UpdateRun) -> None:
    assert run.starts is not None
    best = run.starts.many.minima[0]
    stayed = next(m for m in run.starts.many.minima if 0 in m.starts)
    # frequencies of a mirrored beam are its own: the deck's search ends there, and met no shape
    mirrored = {"E_root": HALVES[1] / DECK[0], "E_tip": HALVES[0] / DECK[1]}
    assert stayed.result.values == pytest.approx(mirrored, rel=0.03)
    assert stayed.result.after.cost > best.result.after.cost + 10
    assert run.factors == pytest.approx(TRUTH, rel=0.01)
    # what stood before the update is the deck, however far away the search began
    assert run.result["cost"]["before"] == pytest.approx(run.problem.evaluate(run.problem.unknowns.mean).cost)
    assert {p["before"] for p in run.result["parameters"].values()} == {1.0}
    assert run.result["iterations"] >= 2
    # nor is there need of other starts where a surface over few solutions leads out of the deck's valley
    wide = run.study.file.parent / "surface.toml"
    wide.write_text(run.study.file.read_text().replace("starts = 6", "response_surface = true"))
    led = update_study(wide)
    assert led.surface is not None
    assert led.surface.taken
    assert led.factors == pytest.approx(run.factors, rel=1e-3)
    one = run.study.file.parent / "one.toml"
    one.write_text(run.study.file.read_text().replace("starts = 6", "starts = 1"))
    alone = update_study(one)
    assert alone.factors == pytest.approx(mirrored, rel=0.03)


def test_what_is_written_of_starts(run: UpdateRun, folder: Path) -> None:
    out = folder / "out"
    starts = json.loads((out / "updating.json").read_text())["starts"]
    assert starts["starts"] == 6
    assert starts["taken"] == 1
    assert sorted(i for m in starts["minima"] for i in m["starts"]) == [1, 2, 3, 4, 5, 6]
    assert starts["end_there"] == len(starts["minima"][0]["starts"])
    page = (out / "updating.html").read_text()
    assert "Other starts" in page
    assert "updating.starts.csv" in page
    with (out / "updating.starts.csv").open() as file:
        minima = list(csv.DictReader(file))
    assert float(minima[0]["E_root"]) == pytest.approx(run.factors["E_root"])
    assert f"starts    {starts['end_there']} of 6 end there; {len(minima)} different ends" in str(run)


def test_a_minimum_as_good_is_told(folder: Path) -> None:
    """Without shapes nothing tells the beam from its mirror image but the prior, which likes both alike."""
    path = folder / "frequencies.toml"
    text = (folder / "study.toml").read_text().replace("shape_sd", 'responses = ["frequencies"]\nshape_sd')
    path.write_text(text)
    run = update_study(path)
    assert "minimum 2 explains the data nearly as well" in run.result["advice"]
    assert run.starts is not None
    first, second = (m.result.after.cost for m in run.starts.many.minima[:2])
    assert second - first < 6


def square_root_problem() -> Problem:
    """y = x^2 was measured: x is the root of it, or its negative."""
    unknowns = Unknowns.of([free("x", 2.0, (-4.0, 4.0)), free("z", 1.0)])
    system = FunctionSystem(("x", "z"), lambda v: np.array([v[0] ** 2, v[1]]))
    return Problem(unknowns, (Configuration("c", system, (Values("y", [1.0, 0.3], 0.1),)),))


def test_draws_that_no_bell_describes_are_told() -> None:
    found = update(square_root_problem(), [0.5, 0.0])
    drawn = draw_posterior_of(found, UpdatingSettings(draws=400, seed=1), None)
    told = drawn.as_dict()
    assert told["unlike_laplace"] == ["x"]
    x = told["parameters"]["x"]
    np.testing.assert_allclose([x["quantiles"]["2.5 %"], x["quantiles"]["97.5 %"]], [-1.0, 1.0], atol=0.12)
    assert x["sd_over_laplace"] > 10
    (said,) = [t for t in drawn.advice() if "bell" in t]
    assert said.startswith("the posterior of x is not the bell")
    # Laplace sees one of two humps, and half of the evidence
    more = told["log_evidence"] - found.log_evidence
    assert more == pytest.approx(np.log(2), abs=max(0.2, 3 * told["log_evidence_se"]))


def test_one_hump_is_laplace(tmp_path: Path) -> None:
    """Close to linear: draws and Laplace say the same, and nothing is advised."""
    tables = TABLES + '[updating]\nstarts = 3\nposterior = "sampled"\ndraws = 100\n'
    run = update_study(write_study(tmp_path, (Recorded("tip"),), tables), tmp_path / "out")
    assert run.starts is not None
    assert run.drawn is not None
    assert run.starts.together == 3
    assert run.result["advice"] == ""
    # standard errors of 100 draws: 0.1 of a mean, 7 % of a deviation
    np.testing.assert_allclose(run.drawn.shift(), 0.0, atol=0.4)
    np.testing.assert_allclose(run.drawn.ratio(), 1.0, atol=0.3)
    posterior = json.loads((tmp_path / "out" / "updating.json").read_text())["posterior"]
    assert posterior["draws"] == 100
    assert posterior["unlike_laplace"] == []
    page = (tmp_path / "out" / "updating.html").read_text()
    assert "The posterior by draws" in page
    assert "updating.posterior.csv" in page
    with (tmp_path / "out" / "updating.posterior.csv").open() as file:
        rows = list(csv.reader(file))
    assert rows[0] == ["E_root", "E_tip", "squares"]
    assert np.array(rows[1:], dtype=float)[:, 0].mean() == pytest.approx(posterior["parameters"]["E_root"]["mean"])
    assert "100 draws, ln evidence" in str(run)
    assert [run.factors[n] for n in ("E_root", "E_tip")] == pytest.approx([e / 7e10 for e in TRUE_E], rel=2e-3)


def test_without_the_keys_nothing_more_is_done(tmp_path: Path) -> None:
    done = CliRunner().invoke(
        main, ["update", str(write_study(tmp_path, (Recorded("tip"),))), "-o", str(tmp_path / "out")]
    )
    assert done.exit_code == 0, done.output
    assert "other starts" not in done.stderr
    result = json.loads((tmp_path / "out" / "updating.json").read_text())
    assert result["starts"] is None
    assert result["posterior"] is None


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ("starts = 0", r"updating\.starts: 0 is less than one"),
        ('posterior = "sample"', r"updating\.posterior: 'sample' is none of laplace, sampled; did you mean 'sampled'"),
        ("draws = 20", r"updating\.draws: 20 is less than 100; so few tell no quantiles"),
        ("seed = -1", r"updating\.seed: -1 is below 0"),
    ],
)
def test_keys_that_are_refused(tmp_path: Path, table: str, message: str) -> None:
    path = write_study(tmp_path, (Recorded("tip"),), f"[updating]\n{table}\n")
    with pytest.raises(StudyError, match=message):
        load_study(path)


def sparse_chain(damping: bool = False) -> Problem:
    """The chain's problem by sparse matrices, as a large deck's is."""
    problem = chain_problem(sd=0.1)
    (c,) = problem.configurations
    return replace(problem, configurations=(replace(c, system=ModalSystem(chain(), np.eye(6), 5, damping=damping)),))


def test_models_are_reduced_where_that_is_good_enough() -> None:
    small = small_problem(sparse_chain(), 0.01)
    assert small is not None
    assert small.error < 0.002
    assert small_problem(sparse_chain(), 1e-16) is None  # no basis is as good as that
    assert small_problem(chain_problem(), 0.01) is None  # small as it is
    assert small_problem(sparse_chain(damping=True), 0.01) is None
    with pytest.raises(UpdatingError, match="a reduced model gives no damping ratios"):
        reduced_problem(sparse_chain(damping=True))
