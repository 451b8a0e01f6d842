"""An updated deck is read again: what is not the updated model is told by parameter and place, and is not written."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from femend.errors import UpdatingError
from femend.estimate.updating import updated_deck
from femend.io.deck import FieldChange, patch_deck
from femend.model import Model, Morph, Parameter, read_model
from femend.model.patched import deck_fields
from femend.model.patched.deck_changes import deck_changes
from femend.model.patched.read_back import deck_faults, unreadable

# fields of eight columns, in which factors are rounded
HEAD = """SOL 103
CEND
SPC=1
BEGIN BULK
INCLUDE 'a folder/mesh.bdf'
INCLUDE 'values.bdf'
ENDDATA
"""
MESH = """GRID,1,,0.,0.,0.
GRID,2,,.5,0.,0.
GRID,3,,1.,0.,0.
GRID,4,,1.,0.,0.
SPC1,1,123456,1,4
CBAR,1,1,1,2,0.,0.,1.
CBAR,2,1,2,3,0.,0.,1.
CBUSH,9,9,3,4,,,,0
CONM2,7,2,,1.5
"""
VALUES = """MAT1           1  2.1+11              .3   7850.
PBAR           1       1    1.-3    1.-7    2.-7    1.-7
PBUSH          9       B      5.      5.      5.
                       K    1.+4    1.+4     20.      1.      1.      1.
"""
PARAMETERS = [
    Parameter("E", "E", "material", (1,)),
    Parameter("k3", "k3", "property_id", (9,)),
    Parameter("c3", "c3", "property_id", (9,)),
    Parameter("m", "m", "mass", (7,)),
]
FACTORS = {"E": 1.0123456789, "k3": 0.9123456, "c3": 1.3333333, "m": 1.1111111}


@pytest.fixture
def model(tmp_path: Path) -> Model:
    (tmp_path / "a folder").mkdir()
    for name, text in (("m.bdf", HEAD), ("a folder/mesh.bdf", MESH), ("values.bdf", VALUES)):
        (tmp_path / name).write_text(text)
    return read_model(tmp_path / "m.bdf", parameters=PARAMETERS)


def test_a_deck_that_is_the_updated_model_but_for_rounding_has_no_faults(model: Model) -> None:
    new = updated_deck(model, FACTORS)
    assert len(new.files) == 2
    assert new.faults == ()


def test_a_soft_spring_written_into_its_dashpot_is_told_by_name(model: Model, monkeypatch: pytest.MonkeyPatch) -> None:
    right = deck_fields.bush_fields
    monkeypatch.setattr(deck_fields, "bush_fields", lambda deck, i, q: [6] if q == "k3" else right(deck, i, q))
    new = updated_deck(model, {"k3": 0.99})
    (one, two) = sorted(new.faults)
    assert "C at node 3, component 3 is 4.95 instead of 5; it looks as if parameter 'c3' (PBUSH 9)" in one
    assert "K at node 3, component 3" in two
    assert "parameter 'k3' (PBUSH 9) is written otherwise" in two
    assert all("do not use the deck" in text for text in new.faults)
    assert set(new.faults) <= set(new.warnings)
    with pytest.raises(UpdatingError, match="do not use the deck"):
        new.write("elsewhere")


def test_a_mass_that_stays_is_told(model: Model) -> None:
    changes = deck_changes(model, {n: {"factor": f} for n, f in (FACTORS | {"m": 1.0}).items()})
    (text, *_) = deck_faults(model, patch_deck(model.deck, changes), FACTORS)
    assert "1.5 in field 5 of CONM2 7 where 1.66667 is meant (parameter 'm')" in text


def test_what_no_parameter_reaches_is_told_without_one(model: Model) -> None:
    (text,) = deck_faults(model, patch_deck(model.deck, [FieldChange("PBUSH", 9, 4, 6.0)]), {})
    assert "C at node 3, component 1 is 6 instead of 5; do not" in text
    assert "parameter" not in text


def test_added_cards_are_read_again(model: Model) -> None:
    assert unreadable(model, patch_deck(model.deck, [], ["CELAS2,99,1.0+5,3,2"])) == ()
    (text,) = unreadable(model, patch_deck(model.deck, [], ["CELAS2,9,1.0+5,3,2"]))
    assert text.startswith("the updated deck cannot be read again: ")
    assert "do not use the deck" in text


def test_moved_nodes_are_compared_where_they_are_written(model: Model) -> None:
    morph = Morph("lift", np.array([2]), np.array([[0.0, 0.0, 1.0]]), 0.1)
    moving = model.with_morphs([morph])
    assert updated_deck(moving, FACTORS | {"lift": 0.0123456}).faults == ()
    files = patch_deck(model.deck, [FieldChange("GRID", 2, 6, 0.02)])
    (text,) = deck_faults(moving, files, {"lift": 0.0123456})
    assert "has node 2 0.007654 away" in text
