"""What a script gives by mistake is told by name, with what to give in its place."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from femend import Dof, identify_modes, model_modes, read_model
from femend.correlate import compare_modes
from femend.errors import CorrelationError, RecordingError, UnitError, UpdatingError
from femend.estimate.updating import (
    Configuration,
    DampingRatios,
    Frequencies,
    MacDifferences,
    ModeTest,
    Response,
    ShapeDifferences,
    deck_system,
)

sys.path.insert(0, str(Path(__file__).parents[1]))
from small_study import deck

FREQ, PHI = np.array([8.0, 27.0, 90.0]), np.eye(3)


@pytest.fixture(scope="module")
def bdf(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("deck") / "model.bdf"
    path.write_text(deck())
    return path


@pytest.mark.parametrize("units", ["mm", "si", ""])
def test_units_of_a_deck_that_are_none_are_refused(bdf: Path, units: str) -> None:
    with pytest.raises(UnitError, match="use one of SI, mm-t-s, in-lbf-s"):
        read_model(bdf, units=units)


def test_one_parameter_may_be_given_by_itself(bdf: Path) -> None:
    assert [p.ids for p in read_model(bdf, parameters="E:1").parameters] == [(1,)]


def test_sensors_may_be_given_as_text(bdf: Path) -> None:
    model = read_model(bdf, parameters=["E:1"])
    as_text = deck_system(model, ["7:-Z", "13:Z"], 3).solve(np.ones(1)).value("phi")
    np.testing.assert_array_equal(
        as_text, deck_system(model, [Dof(7, 3, -1), Dof(13, 3)], 3).solve(np.ones(1)).value("phi")
    )
    with pytest.raises(ValueError, match="'7Z' is not written as node:direction"):
        deck_system(model, ["7Z"], 3)


@pytest.mark.parametrize(
    "response",
    [
        Frequencies(FREQ[:2], 0.1),
        Frequencies(np.append(FREQ, 95.0), 0.1),
        ShapeDifferences(PHI[:, :2], 0.05),
        MacDifferences(PHI[:, :2], 0.05),
        DampingRatios(np.full(4, 0.01), 0.002),
    ],
    ids=["fewer", "more", "shapes", "mac", "damping"],
)
def test_responses_of_another_number_of_modes_than_the_test_are_refused(bdf: Path, response: Response) -> None:
    """More frequencies than modes were fitted without a word, the last ones left out."""
    system = deck_system(read_model(bdf, parameters=["E:1"]), [Dof(n, 3) for n in (5, 9, 13)], 4)
    with pytest.raises(UpdatingError, match=rf"bench: {response.name} are of [24] modes, the test has 3"):
        Configuration("bench", system, (response,), ModeTest(FREQ, PHI))


def test_what_holds_no_frfs_or_modes_is_told(bdf: Path) -> None:
    with pytest.raises(RecordingError, match="a str was given; it takes FRFs or one recording of them"):
        identify_modes("hammer.uff")  # type: ignore[arg-type]
    model = read_model(bdf)
    with pytest.raises(
        CorrelationError, match=r"a Model was given: those of a model are `femend.model_modes\(model\)`"
    ):
        compare_modes(model_modes(model, n_modes=2), model)  # type: ignore[arg-type]
