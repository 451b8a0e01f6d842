"""The GARTEUR SM-AG19 testbed: a deck from a drawing, eight published frequencies, and what they do not prove."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from femend.estimate.updating import UpdateResult, deck_system, update, updated_deck
from femend.model import read_model


@pytest.fixture(scope="module")
def example(script: Callable[[str], ModuleType]) -> ModuleType:
    return script("garteur/garteur")


@pytest.fixture(scope="module")
def measured(example: ModuleType):
    return example.read_measured(example.HERE / "modes.csv")


@pytest.fixture(scope="module")
def found(example: ModuleType, measured) -> UpdateResult:
    return update(example.problem_of(measured))


def test_the_drawing_gives_the_weighed_mass_and_all_classes(example: ModuleType, measured) -> None:
    deck = sys.modules["garteur_deck"]
    assert (example.HERE / "model.bdf").read_text(encoding="ascii") == deck.deck()
    model = example.model_of(example.HERE / "model.bdf")
    system = deck_system(model, example.SENSORS, example.N_MODES, inertia=True)
    mass = system.solve(np.ones(len(example.FIELDS))).value("mass")
    # sections are written with four or five digits
    assert mass[0] == pytest.approx(44.0, rel=1e-4)
    freq, phi = example.modes_of(model)
    classes = example.classify(freq, phi)
    modes = [classes[c] for c in measured.classes]
    # the torsions of the model stand the other way round: 3 is above 4
    assert modes == [6, 7, 9, 8, 10, 11, 12, 13]
    errors = freq[modes] / measured.freq - 1
    # nothing is tuned: the largest error is 7.3 %
    assert 0.07 < np.abs(errors).max() < 0.075


def test_eight_frequencies_within_one_per_cent(example: ModuleType, measured, found: UpdateResult) -> None:
    assert found.status == "converged"
    assert len(example.PRIORS) <= 10
    errors = [m.freq_after / m.freq - 1 for m in found.modes()]
    assert np.abs(errors).max() < 0.01
    assert found.left_prior() == []
    assert not found.at_bound.any()
    assert example.classes_kept(measured, found.after)
    notes = [n for step in found.history for n in step.notes]
    assert any("test mode 3 paired with model mode 9, before with 10" in n for n in notes), notes


def test_the_deck_written_back_has_these_frequencies(
    example: ModuleType, measured, found: UpdateResult, tmp_path: Path
) -> None:
    new = updated_deck(example.model_of(example.HERE / "model.bdf"), example.changes(found))
    assert new.left_out == ()
    (path,) = new.write(tmp_path)
    freq = deck_system(read_model(path), example.SENSORS, example.N_MODES).solve(np.ones(0)).value("freq")
    kept = found.after.states[0].value("freq")
    np.testing.assert_allclose(freq[6:], kept[6:], rtol=1e-7)


def test_the_layer_gives_no_more_damping_than_was_measured(example: ModuleType, measured, found: UpdateResult) -> None:
    most = example.layer_damping(found.problem, found.after)
    assert np.all(most > 0)
    assert np.all(most < measured.damping)
    # and most where most was measured, least where least was
    assert (most.argmax(), most.argmin()) == (measured.damping.argmax(), measured.damping.argmin())


def test_within_one_per_cent_is_no_proof(example: ModuleType, measured, found: UpdateResult) -> None:
    other = example.other_reading(measured)
    assert max(abs(m.freq_after / m.freq - 1) for m in other.modes()) < 0.01
    # what tells is how far the parameters had to go
    assert "wing thickness" in other.left_prior()
    assert other.after.cost > 2 * found.after.cost


@pytest.mark.slow
def test_each_mode_from_the_other_seven(example: ModuleType, measured, found: UpdateResult) -> None:
    left = example.leave_one_out(measured, found.problem)
    errors = np.array([o.predicted / o.freq - 1 for o in left])
    before = np.array([m.freq_before / m.freq - 1 for m in found.modes()])
    assert np.sqrt(np.mean(errors**2)) < 0.6 * np.sqrt(np.mean(before**2))
    # the deviations leave out what the model cannot do: no prediction beyond three of them
    assert max(abs(o.predicted - o.freq) / o.sd for o in left) < 3
