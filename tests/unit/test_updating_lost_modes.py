"""Measured modes that lose their mate in the model on the way of a search."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from femend.errors import UpdatingError
from femend.estimate.updating import (
    Configuration,
    Frequencies,
    ModeTest,
    Problem,
    ShapeDifferences,
    Unknowns,
    UpdateResult,
    factor,
    modal_system,
    read_history,
    sample,
    update,
)

sys.path.insert(0, str(Path(__file__).parents[1]))
from updating_models import TRUTH, chain


def with_a_mode_too_many(freq_sd: float = 1e-3) -> Problem:
    """Four modes of the chain at `TRUTH`, and as the seventh of the test one that looks most like the fifth of the
    model as it stands (MAC 0.65), at four fifths of its frequency."""
    system = modal_system(chain(), list(range(6)), 6)
    true, nominal = system.solve(TRUTH), system.solve(np.ones(4))
    unit = [nominal.value("phi")[:, k] / np.abs(nominal.value("phi")[:, k]).max() for k in (3, 4)]
    phi = np.column_stack([true.value("phi")[:, :4], unit[1] + 0.7 * unit[0]])
    phi = phi / np.abs(phi).max(axis=0)
    freq = np.append(true.value("freq")[:4], 0.8 * nominal.value("freq")[4])
    responses = (Frequencies(freq, freq_sd * freq), ShapeDifferences(phi, 0.05))
    test = ModeTest(freq, phi, numbers=(1, 2, 3, 4, 7))
    unknowns = Unknowns.of([factor(n, 0.3, (0.2, 5.0)) for n in ("k1", "k2", "k3", "m")])
    return Problem(unknowns, (Configuration("chain", system, responses, test),))


@pytest.fixture(scope="module")
def found() -> UpdateResult:
    return update(with_a_mode_too_many())


def test_a_mode_without_a_mate_is_let_go_and_pulls_no_longer(found: UpdateResult) -> None:
    """It went on counting, at a MAC of 0.27: the factors were 1.31, 0.52, 0.68 and 0.56."""
    # the prior draws them by less than a deviation of the test
    np.testing.assert_allclose(list(found.values.values()), TRUTH, atol=0.005)
    assert found.status == "converged"
    assert found.let_go() == [("chain", 7)] == found.unpaired()
    (counting,) = found.counting()
    assert counting is not None
    assert counting.tolist() == [True, True, True, True, False]
    # four frequencies and four shapes at six sensors
    assert found.after.n_values == 28


def test_it_is_told_by_the_number_that_its_test_gives_it(found: UpdateResult) -> None:
    notes = [n for i in found.history for n in i.notes]
    assert "chain: test mode 7 (MAC 0.269) had no mate where the search ended: let go, from step" in " ".join(notes)
    assert "measured mode chain 7 at " in found.advice
    assert "lost its mate on the way and does not count in what was found" in found.advice
    assert "chain 7 " in repr(found)


def test_a_search_is_gone_on_from_with_a_mode_let_go(found: UpdateResult, tmp_path: Path) -> None:
    problem, path = with_a_mode_too_many(), tmp_path / "run.json"
    cut = update(problem, history=path, stop=lambda i: any("let go" in n for n in i.notes) or bool(i.let_go[0][4]))
    assert cut.status == "stopped"
    assert cut.let_go() == [("chain", 7)]
    rest = update(problem, history=path, resume=True)
    np.testing.assert_allclose(rest.p, found.p, atol=1e-6)
    assert rest.let_go() == [("chain", 7)]
    assert read_history(path, problem)[-1].let_go == found.history[-1].let_go


def test_draws_are_of_the_modes_that_count(found: UpdateResult) -> None:
    """With it they were those of the parameters that it pulls to."""
    problem = with_a_mode_too_many()
    drawn = sample(problem, 24, counting=found.counting())
    np.testing.assert_allclose(drawn.values.mean(axis=0), TRUTH, atol=0.05)


def test_a_mode_stays_without_which_too_little_is_known() -> None:
    """Five frequencies tell five factors without priors; four do not."""
    problem = with_a_mode_too_many()
    (one,) = problem.configurations
    unknowns = Unknowns.of([factor(n, np.inf, (0.2, 5.0)) for n in ("k1", "k2", "k3", "k4", "m")])
    system = modal_system(chain(4), list(range(6)), 6)
    few = Problem(unknowns, (replace(one, system=system, responses=one.responses[:1]),))
    found = update(few)
    assert found.after.n_values == 5
    assert found.let_go() == []
    assert found.unpaired()


def test_modes_come_back_where_the_model_comes_near() -> None:
    """From afar modes are lost on the way: of 70 starts seven ended with such a mode, all elsewhere than where the data
    come from. Five of these come home."""
    system = modal_system(chain(5), list(range(6)), 6)
    names = ("k1", "k2", "k3", "k4", "k5", "m")
    unknowns = Unknowns.of([factor(n, np.inf, (0.1, 10.0), logarithmic=True) for n in names])
    lost, home = 0, 0
    for seed in range(70):
        truth = np.exp(0.6 * np.random.default_rng(seed).standard_normal(6))
        state = system.solve(truth)
        freq, phi = state.value("freq")[:5], state.value("phi")[:, :5]
        phi = phi / np.abs(phi).max(axis=0)
        responses = (Frequencies(freq, 1e-3 * freq), ShapeDifferences(phi, 0.05))
        problem = Problem(unknowns, (Configuration("chain", system, responses, ModeTest(freq, phi)),))
        try:
            found = update(problem)
        except UpdatingError:
            continue
        if any("let go" in n for i in found.history for n in i.notes):
            lost += 1
            home += bool(np.abs(found.p - np.log(truth)).max() < 1e-3 and not found.unpaired())
    assert lost >= 6
    assert home >= 0.6 * lost


def test_numbers_are_one_a_mode() -> None:
    with pytest.raises(UpdatingError, match="2 numbers for 3 test frequencies"):
        ModeTest(np.array([1.0, 2.0, 3.0]), numbers=(1, 2))
