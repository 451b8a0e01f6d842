"""Recordings, models and pairings that do not belong together are refused before anything is estimated."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import femend as fe
from femend.demo import STUDY
from femend.errors import ModelError, PairingError, UnitError
from femend.estimate.other_units import refuse_other_units

FOLDER = STUDY.parent
DECK, LOW = FOLDER / "model.bdf", FOLDER / "low.uff"


@pytest.mark.parametrize(
    ("of_model", "of_test", "said"),
    [
        ("mm-t-s", "SI", r"in m/s\^2 \(units SI\), the model is in mm/s\^2 \(units mm-t-s\).*units='mm-t-s'"),
        ("SI", "mm-t-s", r"in mm/s\^2 \(units mm-t-s\), the model is in m/s\^2 \(units SI\).*units='SI'"),
        ("in-lbf-s", "SI", r"the model is in in/s\^2 \(units in-lbf-s\).*the model with units='SI' if"),
    ],
)
def test_recordings_read_in_other_units_than_the_model(of_model: str, of_test: str, said: str) -> None:
    """Their values were fitted as they stood: a thickness went to 180 times the deck's."""
    model, test = fe.read_model(DECK, units=of_model), fe.read_recordings(LOW, units=of_test)
    with pytest.raises(UnitError, match=rf"recording 'low' has .*{said}"):
        fe.pair(test, model)
    same = fe.read_recordings(LOW, units=of_model)
    with pytest.raises(UnitError, match=said):
        fe.update(model, test, fe.pair(same, model))


@pytest.mark.parametrize("units", ["SI", "mm-t-s", "in-lbf-s"])
def test_recordings_read_in_the_units_of_the_model(units: str) -> None:
    assert len(fe.pair(fe.read_recordings(LOW, units=units), fe.read_model(DECK, units=units)))


def test_a_channel_that_a_script_holds_in_g_is_told_and_one_without_unit_is_believed() -> None:
    (recording,) = fe.read_recordings(LOW)

    def labelled(unit: str) -> fe.Test:
        channels = [c if c.quantity == "force" else replace(c, unit=unit) for c in recording.time.channels]
        return fe.Test((recording.with_data(replace(recording.time, channels=tuple(channels))),))

    with pytest.raises(UnitError, match=r"acceleration .* in g, the model is in m/s\^2"):
        refuse_other_units(labelled("g"), "SI")
    refuse_other_units(labelled(""), "SI")
    refuse_other_units(labelled("counts"), "SI")


def test_rotations_are_compared_as_such() -> None:
    at = fe.Dof(2, 5)
    outputs, inputs = (fe.Channel(at, "acceleration", "rad/s^2"),), (fe.Channel(at, "force", "N*mm"),)
    frf = fe.FRF("r", np.array([1.0, 2.0]), np.ones((2, 1, 1)), outputs, inputs, "accelerance", "rad/s^2/(N*mm)")
    test = fe.Test((fe.Recording("r", frf),))
    refuse_other_units(test, "mm-t-s")
    with pytest.raises(UnitError, match=r"in N\*mm \(units mm-t-s\), the model is in N\*m \(units SI\)"):
        refuse_other_units(test, "SI")


def test_a_pairing_of_another_model(tmp_path: Path) -> None:
    test = fe.read_recordings(LOW)
    pairs = fe.pair(test, fe.read_model(DECK))
    longer = tmp_path / "longer.bdf"
    longer.write_text(DECK.read_text().replace("GRID,7,,0.726113639", "GRID,7,,0.74"))
    model = fe.read_model(longer)
    assert model.mesh_key != pairs.mesh
    with pytest.raises(PairingError, match=r"made with another model.*femend.pair\(test, model\)"):
        fe.update(model, test, pairs)
    # other parameters of the same deck leave the sensors where they are
    assert fe.read_model(DECK, parameters="E:1").mesh_key == pairs.mesh


def test_a_pairing_of_other_recordings() -> None:
    model, test = fe.read_model(DECK), fe.read_recordings(LOW)
    pairs = fe.pair(test, model)
    with pytest.raises(PairingError, match="is paired; there are .* pair these recordings"):
        fe.update(model, test, replace(pairs, pairs=pairs.pairs[:1]))


@pytest.mark.parametrize("sd", [-1.0, 0.0, float("nan"), float("inf"), "10 %"])
def test_what_is_no_standard_deviation(sd: float) -> None:
    with pytest.raises(ModelError, match=r"parameter 'E:1', prior_sd: .* is (not positive|no number) \(10 % is 0.10\)"):
        fe.read_model(DECK, parameters="E:1", prior_sd=sd)


def test_one_parameter_twice() -> None:
    with pytest.raises(ModelError, match=r"'E:1' \(E of material 1\) is given twice: .* leave one out"):
        fe.read_model(DECK, parameters=["E:1", "E:1"])
    root = fe.Parameter("root", "E", "material", (1,))
    with pytest.raises(ModelError, match="parameters 'E:1' and 'root' are both a factor on E of material 1"):
        fe.read_model(DECK, parameters=["E:1", root])
    with pytest.raises(ModelError, match="2 parameters are named 'root'"):
        fe.read_model(DECK, parameters=[root, replace(root, ids=(2,))])
    with pytest.raises(ModelError, match=r"parameter 'root', bounds: \(1.2, 1.5\) leaves out the deck's own value"):
        fe.read_model(DECK, parameters=[replace(root, bounds=(1.2, 1.5))])
    # a factor on all, and one on a part of it, are told apart by what the part does
    assert len(fe.read_model(DECK, parameters=["E:1", "E:1,2"]).parameters) == 2
