"""`femend update` with priors whose strength the data choose: what is taken and said, and what cannot be meant."""

from __future__ import annotations

import csv
import json
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from femend import update_study
from femend.bench import UpdateRun
from femend.bench.updating.strength import choose_strength
from femend.errors import StudyError
from femend.estimate.updating import Configuration, Problem, Unknowns, Values, sample, tikhonov
from femend.study import load_study
from femend.study.file.bench_settings import UpdatingSettings

sys.path.insert(0, str(Path(__file__).parents[1]))
from bench_study import TABLES, TRUE_E, Recorded, study_text, write_study
from updating_models import LinearSystem, free

RECORDED = (Recorded("tip"),)
# priors that are far too narrow for a truth 10 % and 6 % off
NARROW = "prior_sd = 0.002\n"


def text(keys: str, prior: str = NARROW) -> str:
    found = study_text(RECORDED, f"{TABLES}[updating]\n{keys}")
    for name in ("E_root", "E_tip"):
        assert f'name = "{name}"\n' in found
        found = found.replace(f'name = "{name}"\n', f'name = "{name}"\n{prior}')
    return found


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    found = tmp_path_factory.mktemp("strength")
    write_study(found, RECORDED)
    (found / "study.toml").write_text(text('regularisation = "gcv"\n'))
    return found


@pytest.fixture(scope="module")
def run(folder: Path) -> UpdateRun:
    return update_study(folder, folder / "out")


def test_priors_that_are_too_narrow_are_taken_wider(run: UpdateRun, folder: Path) -> None:
    assert run.strength is not None
    curve = tikhonov(run.problem)
    assert run.strength.curve.strength == curve.strength < 0.1
    assert run.found.p == pytest.approx(curve.result.p, rel=1e-4)
    truth = {"E_root": TRUE_E[0] / 7e10, "E_tip": TRUE_E[1] / 7e10}
    assert run.factors == pytest.approx(truth, rel=3e-3)
    (folder / "stated.toml").write_text(text(""))
    stated = update_study(folder / "stated.toml")
    assert abs(stated.factors["E_root"] - truth["E_root"]) > 3 * abs(run.factors["E_root"] - truth["E_root"])
    # deviations are those of the prior that was taken, what stood before is the deck
    precision = run.found.problem.unknowns.precision
    np.testing.assert_allclose(precision, curve.strength * stated.problem.unknowns.precision)
    assert {p["before"] for p in run.result["parameters"].values()} == {1.0}
    assert run.result["parameters"]["E_root"]["prior_sd"] == 0.002
    assert "E_root" in run.found.left_prior()


def test_what_is_written_and_said(run: UpdateRun, folder: Path) -> None:
    out = folder / "out"
    told = json.loads((out / "updating.json").read_text())["regularisation"]
    assert told["rule"] == "gcv"
    assert len(told["strengths"]) == len(told["parameters"]["E_tip"]) == 17
    assert told["criterion"].index(min(told["criterion"])) == told["strengths"].index(told["strength"])
    assert told["prior_sd_times"] == pytest.approx(told["strength"] ** -0.5)
    page = (out / "updating.html").read_text()
    assert "Strength of the priors" in page
    assert "It is what generalised cross-validation takes of 17 strengths" in page
    assert "E_root changes most by it" in page
    assert "times as strong as stated" in repr(run)
    # what the data tell with the strength that was chosen they see
    hardly = [text for text in run.result["advice"].split("; ") if text.startswith("the data hardly see")]
    assert not any(name in text for text in hardly for name in run.found.determined())
    with (out / "updating.strengths.csv").open() as file:
        assert [float(row["strength"]) for row in csv.DictReader(file)] == pytest.approx(told["strengths"])


def test_a_strength_that_the_data_do_not_choose_is_pointed_out(folder: Path, run: UpdateRun) -> None:
    path = folder / "few.toml"
    path.write_text(text('regularisation = "gcv"\nstrengths = [1, 10]\n'))
    few = update_study(path)
    assert few.result["regularisation"]["strengths"] == [10.0, 1.0]
    assert "1, is the least that was tried: the data do not choose one" in few.result["advice"]
    path.write_text(text('regularisation = "l-curve"\nstrengths = [3]\n'))
    one = update_study(path, folder / "one")
    assert one.result["regularisation"]["strength"] == 3.0
    assert "that was tried" not in one.result["advice"]
    assert "It is the one that the study gives." in (folder / "one" / "updating.html").read_text()
    assert "(deviations times 0.577), as the study gives it; squares" in repr(one)


def test_draws_start_from_the_prior_that_was_taken() -> None:
    """A mean that nothing pulls: the draws have the prior's deviation, stated or strengthened."""
    system = LinearSystem(np.eye(1))
    unknowns = Unknowns.of([free(m, 1.0) for m in system.names])
    problem = Problem(unknowns, (Configuration("c", system, (Values("y", np.zeros(1), 1e6),)),))
    strong = replace(problem, unknowns=unknowns.strengthened(25.0))
    assert float(sample(strong, 400).values.std()) == pytest.approx(0.2, rel=0.1)


def test_strengths_follow_one_another_with_their_steps_told() -> None:
    system = LinearSystem(np.array([[1.0, 0.0], [0.0, 1e-3], [0.0, 0.0]]))
    unknowns = Unknowns.of([free(m, 1.0) for m in system.names])
    problem = Problem(unknowns, (Configuration("c", system, (Values("y", [3.0, 0.1, 0.3], 0.1),)),))
    counted: list[int] = []
    settings = UpdatingSettings(regularisation="discrepancy", strengths=(10.0, 1.0, 0.1))
    found = choose_strength(problem, settings, lambda: counted.append(1))
    assert found is not None
    assert len(counted) == 3
    assert found.curve.p.shape == (3, 2)
    assert choose_strength(problem, UpdatingSettings()) is None


def test_an_l_curve_without_corner_leaves_the_priors_as_stated() -> None:
    """Values that the unknowns meet: the squares fall to nothing, and nothing holds the penalty."""
    system = LinearSystem(np.eye(2))
    unknowns = Unknowns.of([free(m, 1.0) for m in system.names])
    problem = Problem(unknowns, (Configuration("c", system, (Values("y", [3.0, 1.0], 0.1),)),))
    found = choose_strength(problem, UpdatingSettings(regularisation="l-curve", strengths=(1e4, 1e3, 1e2, 1e1, 1.0)))
    assert found is not None
    assert not found.has_corner
    assert found.curve.strength == 1.0
    (said,) = found.advice()
    assert "the L-curve has no corner among 5 strengths" in said


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        (
            'regularisation = "gvc"\n',
            r"updating\.regularisation: 'gvc' is none of gcv, discrepancy, l-curve; did you mean",
        ),
        (
            "strengths = [1, 10]\n",
            r'updating\.strengths: are given and nothing chooses among them; say regularisation = "gcv"',
        ),
        ('regularisation = "gcv"\nstrengths = []\n', r"updating\.strengths: \[\] are not numbers above 0"),
        ('regularisation = "gcv"\nstrengths = [0.0, 1.0]\n', r"1 is the priors as they are stated"),
        ('regularization = "gcv"\n', r"'regularization' is no key of \[updating\]; did you mean 'regularisation'"),
    ],
)
def test_keys_that_cannot_be_meant(folder: Path, run: UpdateRun, keys: str, message: str) -> None:
    (folder / "broken.toml").write_text(text(keys))
    with pytest.raises(StudyError, match=message):
        load_study(folder / "broken.toml")
