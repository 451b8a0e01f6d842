"""Measured modes above the MAC that is asked of a pair that are no mates: all others contradict them."""

from __future__ import annotations

import runpy
import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from femend import Dof, model_modes, read_model, update_study
from femend.estimate.updating import multi_start, read_history, update

sys.path.insert(0, str(Path(__file__).parents[1]))
from bench_study import RECORDINGS, SENSORS, TRUE_E, study_text, write_modes
from small_study import deck


@pytest.fixture(scope="module")
def bench(project_root: Path) -> SimpleNamespace:
    """Two coupled chains whose modes come in close pairs, and tests of them."""
    return SimpleNamespace(**runpy.run_path(str(project_root / "benches" / "wrong_modes.py")))


def wrong(bench: SimpleNamespace, seed: int, form: float = 0.0) -> tuple[Any, Any]:
    """A test with a wrong mode, and its problem."""
    system, rng = bench.deck(), np.random.default_rng(seed)
    test = bench.with_a_wrong_mode(rng, bench.honest(rng, form), system)
    return test, test.problem(system)


@pytest.mark.parametrize(("seed", "form"), [(6, 0.0), (15, 0.0), (18, 0.0), (15, 0.05), (39, 0.05)])
def test_a_wrong_mode_does_not_lead(bench: SimpleNamespace, seed: int, form: float) -> None:
    """Factors were off by 0.07 to 0.46 of themselves."""
    test, problem = wrong(bench, seed, form)
    assert test.error(update(problem, doubt=False)) > 0.05
    found = update(problem)
    assert found.problem.left_out == {(0, test.wrong)}
    assert test.error(found) < (0.02 if form == 0 else 0.07)
    assert found.let_go() == [("test", test.wrong + 1)] == found.unpaired()
    (counting,) = found.counting()
    assert counting is not None
    assert np.flatnonzero(~counting).tolist() == [test.wrong]


def test_honest_modes_stay(bench: SimpleNamespace) -> None:
    """Pairs of close modes that change places on the way, of structures whose every spring and mass is 5 % off."""
    system = bench.deck()
    low = 0
    for seed in range(6):
        test = bench.honest(np.random.default_rng(seed), 0.05)
        problem = test.problem(system)
        found = update(problem)
        (mates,) = found.before.mates
        low += int((mates.mac < 0.9).sum())
        assert found.problem.left_out == frozenset()
    assert low > 5  # modes that were looked at


def test_it_is_said_what_it_looks_like(bench: SimpleNamespace) -> None:
    _, problem = wrong(bench, 15)
    found = update(problem)
    notes = " ".join(n for i in found.history for n in i.notes)
    assert "test: test mode 7 (MAC 0." in notes
    assert "deviations off what explains all others: left out, from the start on" in notes
    assert "measured mode test 7 at " in found.advice
    assert "is like no mode of the model for sure, and what explains all others contradicts it" in found.advice


def test_it_stays_out_of_what_is_gone_on_from(bench: SimpleNamespace, tmp_path: Path) -> None:
    test, problem = wrong(bench, 15)
    path = tmp_path / "run.json"
    found = update(problem, history=path)
    assert read_history(path, problem)[-1].let_go == found.history[-1].let_go
    again = update(problem, history=path, resume=True)
    assert again.problem.left_out == found.problem.left_out
    np.testing.assert_allclose(again.p, found.p, atol=1e-6)
    # as it does of starts of the problem that was solved
    many = multi_start(found.problem, 2)
    np.testing.assert_allclose(many.best.p, found.p, atol=1e-3)
    assert test.error(many.best) < 0.02


def test_a_mode_without_which_too_little_is_known_stays(bench: SimpleNamespace) -> None:
    """Five frequencies and five factors: whichever is left out, the others are met."""
    test, problem = wrong(bench, 15)
    keep = [0, 1, 2, 3, test.wrong]
    (one,) = problem.configurations
    few = replace(test, freq=test.freq[keep], phi=test.phi[:, keep], wrong=4).problem(one.system)
    (all_of,) = few.configurations
    found = update(replace(few, configurations=(replace(all_of, responses=all_of.responses[:1]),)))
    assert found.problem.left_out == frozenset()


def test_a_study_is_updated_without_it_and_says_so(tmp_path: Path) -> None:
    """The fifth mode of the test is like the model's fourth and a little like its third, at 0.87 of the frequency."""
    dofs = tuple(Dof(n, 3) for n in SENSORS)

    def modes(text: str) -> tuple[np.ndarray, np.ndarray]:
        (tmp_path / "model.bdf").write_text(text)
        found = model_modes(read_model(tmp_path / "model.bdf"), n_modes=4)
        phi = found.phi[[found.dofs.index(d) for d in dofs]]
        return found.freq, phi / np.abs(phi).max(axis=0)

    freq, phi = modes(deck(TRUE_E))
    nominal = modes(deck())
    shape = nominal[1][:, 3] + 0.6 * nominal[1][:, 2]
    write_modes(
        tmp_path / "tip.uff", np.append(freq[:3], 0.87 * nominal[0][3]), np.column_stack([phi[:, :3], shape]), dofs
    )
    (tmp_path / "study.toml").write_text(study_text(RECORDINGS[:1], ""))
    run = update_study(tmp_path / "study.toml")
    found = {name: p["factor"] for name, p in run.result["parameters"].items()}
    assert found["E_root"] == pytest.approx(TRUE_E[0] / 7e10, abs=0.01)
    assert found["E_tip"] == pytest.approx(TRUE_E[1] / 7e10, abs=0.01)
    assert "measured mode tip 4 at " in run.result["advice"]
    assert "contradicts it" in run.result["advice"]
    assert run.result["doubtful"]
