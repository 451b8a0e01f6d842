"""The steps from Python: parameters as text, update and locate on the bundled case, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest

import femend as fe
from femend.data import Test
from femend.demo import STUDY
from femend.errors import ArgumentError, ModelError, RecordingError, UpdatingError
from femend.model import Model, Pairing
from femend.workflow import Check, Named, Places, Updated

FOLDER = STUDY.parent


@pytest.fixture(scope="module")
def start() -> Updated:
    model = fe.read_model(FOLDER / "model.bdf", parameters=["E:1", "E:2"])
    test = fe.read_recordings([FOLDER / f"{level}.uff" for level in ("low", "mid", "high")])
    return fe.update(model, test, fe.pair(test, model), damping=0.01)


@pytest.fixture(scope="module")
def where(start: Updated) -> Places:
    return fe.locate(start)


def test_parameters_as_text() -> None:
    own = fe.Parameter("tip", "E", "material", (2,), 0.2)
    model = fe.read_model(FOLDER / "model.bdf", parameters=["E:1,2", own], prior_sd=0.05)
    assert model.parameters == (fe.Parameter("E:1,2", "E", "material", (1, 2), 0.05), own)
    # the two materials make up the whole beam, so all of its stiffness follows the factor
    before, _ = model.matrices()
    after, _ = model.matrices({"E:1,2": 1.5})
    assert after.trace() == pytest.approx(1.5 * before.trace(), rel=1e-12)


@pytest.mark.parametrize("text", ["E", "E:", "E:one"])
def test_a_parameter_that_means_nothing(text: str) -> None:
    with pytest.raises(ModelError, match="property:id"):
        fe.read_model(FOLDER / "model.bdf", parameters=[text])


def of(kind: type) -> object:
    """An object of a kind whose content is not looked at."""
    return kind.__new__(kind)


@pytest.mark.parametrize(
    ("step", "given", "said"),
    [
        ("pair", (Model, Test), r"takes recordings as .*Test\(\(recording,\)\)`, as its test; a Model was given"),
        ("pair", (Test, Test), "takes a model as `femend.read_model` gives it, as its model; a Test was given"),
        ("pair", (list, Model), "takes recordings as .*, as its test; a list was given"),
        ("update", (Test, Model, Pairing), "takes a model as .*, as its model; a Test was given"),
        (
            "update",
            (Model, Test, Test),
            r"takes what `femend.pair\(test, model\)` gives, as its pairs; a Test was given",
        ),
        (
            "locate",
            (Model,),
            r"takes what `femend.update\(model, test, pairs\)` gives, as its start; a Model was given",
        ),
        ("locate", (Updated, dict), r"takes thresholds as `femend.Settings\(...\)`, as its settings; a dict was given"),
        ("name", (Updated, Updated), r"takes what `femend.locate\(start\)` gives, as its where; an Updated was given"),
        ("name", (Places, Places), r"takes what `femend.update\(model, test, pairs\)` gives, as its start; a Places"),
        (
            "validate",
            (Updated, Test),
            r"takes what `femend.name\(start, where\)` gives, as its what; an Updated was given",
        ),
        ("validate", (Named, list), "takes recordings as .*, as its test; a list was given"),
        (
            "write_report",
            (Check, Named, str),
            r"takes what `femend.name\(start, where\)` gives, as its what; a Check was",
        ),
        (
            "write_report",
            (Named, Test, str),
            r"takes what `femend.validate\(what, test\)` gives, as its check; a Test was",
        ),
    ],
)
def test_arguments_of_another_kind_are_told_with_where_they_come_from(
    step: str, given: tuple[type, ...], said: str
) -> None:
    """Those of the later steps ended in an AttributeError on what they lack."""
    with pytest.raises(ArgumentError, match=f"`femend.{step}` {said}") as caught:
        getattr(fe, step)(*map(of, given))
    assert isinstance(caught.value, TypeError)


def test_a_parameter_that_is_no_text() -> None:
    with pytest.raises(ArgumentError, match=r"texts like 'E:1', or as `femend.Parameter\(...\)`; an int was given"):
        fe.read_model(FOLDER / "model.bdf", parameters=[1])  # type: ignore[list-item]


@pytest.mark.parametrize(
    ("damping", "told"), [(0.0, "0"), (-0.1, "-0.1"), (float("nan"), "nan"), (5.0, "5"), ("1 %", "'1 %'")]
)
@pytest.mark.filterwarnings("error::RuntimeWarning")
def test_what_is_no_damping_ratio_is_told_as_that(damping: float, told: str) -> None:
    """It was told as a model without mass: the logarithm of the ratio went into the unknowns."""
    model, test = fe.read_model(FOLDER / "model.bdf"), fe.read_recordings([FOLDER / "low.uff"])
    with pytest.raises(UpdatingError, match=rf"damping: {told} is not between 0 and 1 \(1 % is 0.01\)"):
        fe.update(model, test, fe.pair(test, model), damping=damping)


def test_the_update_lowers_the_misfit_within_its_priors(start: Updated) -> None:
    before, after = start.misfit
    assert after < before
    assert set(start.factors) == {"E:1", "E:2"}
    # the update minimises squares plus prior, so no factor can stand far outside its prior of 10 %
    assert all(abs(np.log(f)) < 0.5 for f in start.factors.values())
    assert "E:1" in repr(start)
    assert "misfit" in repr(start)


def test_one_place_explains_what_the_update_does_not(start: Updated, where: Places) -> None:
    assert (where[0].place.kind, where[0].place.nodes, where[0].place.direction) == ("ground", (3,), "Z")
    # a free force at the right place leaves no more than the noise; the updated model is a hundred times above it
    assert where[0].fit.score < 1.0
    assert start.misfit[1] > 100.0
    assert where.ambiguous[0] is where[0]
    costs = [found.cost for found in where]
    assert costs == sorted(costs)
    assert "node 3 to ground, Z" in repr(where).splitlines()[1]


def test_a_recording_without_role_fit_is_refused(start: Updated) -> None:
    test = fe.read_recordings(FOLDER / "low.uff", role="validate")
    with pytest.raises(RecordingError, match='role = "fit"'):
        fe.update(start.model, test, start.pairing)


def test_validation_refuses_what_was_used_to_fit(start: Updated) -> None:
    # the refusal comes before anything of the diagnosis is looked at
    with pytest.raises(RecordingError, match="used to fit"):
        fe.validate(Named(start, None), start.test)  # type: ignore[arg-type]
