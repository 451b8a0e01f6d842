"""The values of a parameter are written wherever they stand: the new deck is the model with the factor."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from femend.estimate.updating import UpdatedDeck, updated_deck
from femend.model import Model, Parameter, read_model

STEEL = "MAT1,1,2.1+11,,.3,7850.,,,.01\nSPC1,1,123456,1\n"
NODES = "GRID,1,,0.,0.,0.\nGRID,2,,.5,0.,0.\nGRID,3,,1.,0.,0.\nGRID,4,,1.,0.,0.\nSPC1,1,123456,4\n"
BARS = "CBAR,1,1,1,2,0.,0.,1.\nCBAR,2,1,2,3,0.,0.,1.\nPBAR,1,1,1-3,1-7,2-7,1-7\n"
BUSH = f"{STEEL}{NODES}{BARS}CBUSH,9,9,3,4,,,,0\n"
PLATE = f"{STEEL}GRID,1,,0.,0.,0.\nGRID,2,,1.,0.,0.\nGRID,3,,1.,1.,0.\nGRID,4,,0.,1.,0.\n"
BEAMS = f"{STEEL}{NODES}CBEAM,1,1,1,2,0.,0.,1.\nCBEAM,2,1,2,3,0.,0.,1.\n"
TAPER = "PBEAM,1,1,2-3,2-7,4-7,,2-7\n,,,,,,,,\n,YES,.5,1.5-3,1.5-7,3-7,,1.5-7\n,,,,,,,,\n,NO,1.,1-3,1-7,2-7,,1-7\n"
FIRST_B = "PBUSH,9,B,5.,5.,5.,5.,5.,5.\n,,K,1+4,1+4,1+5,1.,1.,1.\n,,GE,.02\n"

WRITTEN = {
    "k after b": (f"{BUSH}{FIRST_B}", "k3", "property_id", 9, ["2.+5"]),
    "c before k": (f"{BUSH}{FIRST_B}", "c3", "property_id", 9, ["10."]),
    "one ge of a bush": (f"{BUSH}{FIRST_B}", "eta", "property_id", 9, [".04"]),
    "ge before k": (f"{BUSH}PBUSH,9,GE,.01\n,,K,1+4,1+4,1+5\n", "k3", "property_id", 9, ["2.+5"]),
    "k without its number": (f"{BUSH}PBUSH,9,B,5.\n,,K,1+4,1+4,1+5\n", "k", "property_id", 9, ["2.+4"]),
    "corners": (
        f"{PLATE}CQUAD4,1,1,1,2,3,4\n,,,.02,.03,.02\nPSHELL,1,1,.01,1\n", "t", "property_id", 1,
        [".02", ".04", ".04", ".06"],
    ),
    "all corners of one element": (
        f"{PLATE}CQUAD4,1,1,1,2,3,4\n,,,.02,.02,.02,.02\nPSHELL,1,1,,1\n", "t", "elements", 1, [".04"] * 4,
    ),
    "shares of the thickness": (
        f"{PLATE}CTRIA3,1,1,1,2,3\n,,1,1.5,1.,1.\nCTRIA3,2,1,1,3,4\n,,,.03\nPSHELL,1,1,.01,1\n", "t", "property_id",
        1, [".02", ".06"],
    ),
    "plies by number": (
        f"{PLATE}CQUAD4,1,1,1,2,3,4\nPCOMPG,1\n,1,1,.01,0.\n,2,1,,90.\n,3,1,.02,0.\n", "t", "property_id", 1,
        [".02", ".04"],
    ),
    "ge of a laminate": (
        f"{PLATE}CQUAD4,1,1,1,2,3,4\nPCOMP,1,,,,,,.03\n,1,.01,0.\n", "eta", "material", 1, [".02", ".06"],
    ),
    "tapered area": (f"{BEAMS}{TAPER}", "A", "property_id", 1, ["2.-3", "3.-3", "4.-3"]),
    "tapered torsion": (f"{BEAMS}{TAPER}", "J", "property_id", 1, ["2.-7", "3.-7", "4.-7"]),
    "beam": (f"{BEAMS}PBEAM,1,1,1-3,1-7,2-7,,1-7\n", "I2", "property_id", 1, ["4.-7"]),
    "loss": (f"{STEEL}{NODES}{BARS}", "eta", "material", 1, [".02"]),
    "second dashpot": (
        f"{STEEL}{NODES}{BARS}CDAMP1,8,8,3,3\nCDAMP1,9,9,2,3\nPDAMP,8,5.,9,7.\n", "c1", "property_id", 9, ["14."]
    ),
    "spring": (f"{STEEL}{NODES}{BARS}CELAS2,7,1+5,3,3\n", "k1", "elements", 7, ["2.+5"]),
    "loss of a spring": (f"{STEEL}{NODES}{BARS}CELAS2,7,1+5,3,3,,,.05\n", "eta", "elements", 7, [".1"]),
    "dashpot": (f"{STEEL}{NODES}{BARS}CDAMP2,7,6.,3,3\n", "c1", "elements", 7, ["12."]),
    "the only bush of its property": (f"{BUSH}{FIRST_B}", "k3", "elements", 9, ["2.+5"]),
    "rod": (f"{STEEL}{NODES}{BARS}CONROD,7,2,3,1,1-4\n", "A", "elements", 7, ["2.-4"]),
    "mass matrix": (f"{STEEL}{NODES}{BARS}CONM1,7,3,,5.\n,,6.\n,,,7.\n", "m", "mass", 7, ["10.", "12.", "14."]),
    "mass of one direction": (f"{STEEL}{NODES}{BARS}CMASS2,7,3.,3,3\n", "m", "mass", 7, ["6."]),
}  # fmt: skip

KEPT = {
    "section from dimensions": (
        f"{STEEL}{NODES}CBAR,1,1,1,2,0.,0.,1.\nCBAR,2,1,2,3,0.,0.,1.\nPBARL,1,1,,ROD\n,.02\n", "I1", "property_id", (1,)
    ),
    "shear modulus from E and nu": (f"{STEEL}{NODES}{BARS}", "G", "material", (1,)),
    "modulus of one property": (f"{STEEL}{NODES}{BARS}", "E", "property_id", (1,)),
    "one of two elements": (f"{STEEL}{NODES}{BARS}", "I1", "elements", (1,)),
    # half of it would be another model than either
    "one of two": (
        f"{STEEL}{NODES}{BARS}CBAR,3,2,2,3,0.,0.,1.\nPBARL,2,1,,ROD\n,.02\n", "A", "property_id", (1, 2)
    ),
}  # fmt: skip


def updated(
    folder: Path, deck: str, parameters: list[Parameter], factors: dict[str, float]
) -> tuple[Model, UpdatedDeck]:
    file = folder / "m.bdf"
    file.write_text(f"SOL 103\nCEND\nSPC=1\nBEGIN BULK\n{deck}ENDDATA\n")
    model = read_model(file, parameters=parameters)
    return model, updated_deck(model, factors)


@pytest.mark.parametrize("case", WRITTEN)
def test_a_factor_is_written_where_its_values_stand(tmp_path: Path, case: str) -> None:
    deck, quantity, target, id_, values = WRITTEN[case]
    model, new = updated(tmp_path, deck, [Parameter("p", quantity, target, (id_,))], {"p": 2.0})
    assert new.left_out == ()
    assert new.warnings == ()
    (text,) = (content.decode() for content in new.files.values())
    before, after = ([word for line in t.splitlines() for word in line.split(",")] for t in (file_of(model), text))
    assert sorted(b for a, b in zip(before, after, strict=True) if a != b) == sorted(values)
    (written,) = new.write(tmp_path / "out")
    again = read_model(written)
    for ours, theirs in zip(model.fe.assemble(model.factors({"p": 2.0})), again.fe.assemble(None), strict=True):
        np.testing.assert_allclose(theirs, ours, rtol=1e-12, atol=1e-12 * np.abs(ours).max())


def file_of(model: Model) -> str:
    return Path(model.deck.path).read_text()


def test_all_elements_of_a_property_are_written_on_its_card(tmp_path: Path) -> None:
    _, new = updated(tmp_path, f"{STEEL}{NODES}{BARS}", [Parameter("p", "I1", "elements", (1, 2))], {"p": 2.0})
    assert new.warnings == ()
    assert "+PBAR,1,1,1-3,2.-7,2-7,1-7" in new.diff


@pytest.mark.parametrize("case", KEPT)
def test_what_no_field_can_hold_is_kept_as_a_whole_and_told(tmp_path: Path, case: str) -> None:
    deck, quantity, target, ids = KEPT[case]
    _, new = updated(tmp_path, deck, [Parameter("p", quantity, target, ids)], {"p": 2.0})
    assert new.left_out == ("p",)
    assert not new.files
    assert "no field of the deck holds the values of p: the deck keeps them" in new.warnings[0]


def test_numbers_that_stay_keep_their_bytes(tmp_path: Path) -> None:
    parameters = [Parameter("E", "E", "material", (1,)), Parameter("A", "A", "property_id", (1,))]
    _, new = updated(tmp_path, f"{STEEL}{NODES}{BARS}", parameters, {"A": 1.5})
    assert "2.1+11,,.3,7850.,,,.01" not in new.diff
    assert "+PBAR,1,1,1.5-3,1-7,2-7,1-7" in new.diff
