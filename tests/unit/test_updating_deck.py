"""Updated values stand where they stood; the rest of the deck is the user's, byte for byte."""

from __future__ import annotations

from pathlib import Path

import pytest

from femend.errors import UpdatingError
from femend.estimate.updating import updated_deck
from femend.model import Parameter, read_model

MAIN = """$ a cantilever, kept by hand
SOL 103
CEND
BEGIN BULK
INCLUDE 'parts/props.bdf'
GRID,1,,0.,0.,0.
GRID,2,,1.,0.,0.
CBAR,1,1,1,2,0.,1.,0.
SPC1,1,123456,1
ENDDATA
"""
PROPS = """$ steel   <- from the data sheet
MAT1    1       2.1+11          .3      7850.
MAT1*   2               2.1E+11                         .3
*       7850.
PBAR    1       1       6.-4    5.-8    2.-8    3.-8    $ section
CONM2   9       2               1.5
"""


def test_back_to_the_deck(tmp_path: Path) -> None:
    (tmp_path / "parts").mkdir()
    (tmp_path / "m.bdf").write_text(MAIN, newline="")
    (tmp_path / "parts" / "props.bdf").write_text(PROPS.replace("\n", "\r\n"), newline="")
    parameters = [
        Parameter("E", "E", "material", (1,)),
        Parameter("I", "I1", "property_id", (1,)),
        Parameter("m", "m", "mass", (9,)),
        Parameter("one bar", "E", "elements", (1,)),
    ]
    model = read_model(tmp_path / "m.bdf", parameters=parameters)
    new = updated_deck(model, {"E": 0.95, "m": 1.1, "one bar": 1.2})
    assert new.left_out == ("one bar",)
    assert new.warnings[0].endswith("put them in by hand: one bar is 1.2 times E of element 1")
    assert [p.name for p in new.files] == ["props.bdf"]
    # of one changed file in a folder below too: beside the deck it would be another one
    (written,) = new.write(tmp_path / "out")
    assert written == tmp_path / "out" / "parts" / "props.bdf"
    old, text = (PROPS.replace("\n", "\r\n"), written.read_bytes().decode())
    assert text.count("\r\n") == old.count("\r\n")
    before, after = old.split("\r\n"), text.split("\r\n")
    changed = [i for i, (a, b) in enumerate(zip(before, after, strict=True)) if a != b]
    assert changed == [1, 5]
    for i, place in ((1, slice(16, 24)), (5, slice(32, 40))):
        assert before[i][: place.start] == after[i][: place.start]
        assert before[i][place.stop :] == after[i][place.stop :]
    assert "-MAT1    1       2.1+11" in new.diff
    assert (tmp_path / "parts" / "props.bdf").read_bytes().decode() == old, "the original stays"
    (tmp_path / "out" / "m.bdf").write_text(MAIN, newline="")
    again = read_model(tmp_path / "out" / "m.bdf", parameters=parameters)
    assert again.fe.total_mass() == pytest.approx(model.fe.total_mass() + 0.15, rel=1e-6)
    assert float(again.deck.field_text("MAT1", 1, 3).replace("+11", "e11")) == pytest.approx(0.95 * 2.1e11, rel=1e-4)
    with pytest.raises(UpdatingError, match="no parameter 'nu'"):
        updated_deck(model, {"nu": 1.0})


def test_factors_of_two_parameters_of_one_field_are_multiplied(tmp_path: Path) -> None:
    (tmp_path / "parts").mkdir()
    (tmp_path / "m.bdf").write_text(MAIN.replace("SPC1,", "CBAR,2,2,1,2,0.,1.,0.\nSPC1,"))
    (tmp_path / "parts" / "props.bdf").write_text(f"{PROPS}PBAR    2       2       6.-4    5.-8    2.-8    3.-8\n")
    parameters = [Parameter("E", "E", "material", (1,)), Parameter("both", "E", "material", (1, 2))]
    new = updated_deck(read_model(tmp_path / "m.bdf", parameters=parameters), {"E": 0.9, "both": 0.5})
    (text,) = (content.decode() for content in new.files.values())
    assert "MAT1    1       9.45+10 " in text


def test_a_model_without_parameters_says_how_to_give_them(tmp_path: Path) -> None:
    """It said "there are " and nothing."""
    (tmp_path / "parts").mkdir()
    (tmp_path / "m.bdf").write_text(MAIN)
    (tmp_path / "parts" / "props.bdf").write_text(PROPS)
    with pytest.raises(UpdatingError, match="no parameter 'E'; none was given: read_model"):
        updated_deck(read_model(tmp_path / "m.bdf"), {"E": 0.9})


@pytest.mark.parametrize("factor", [-2.0, 0.0, float("nan"), float("inf")])
def test_factors_that_no_stiffness_has_are_refused(tmp_path: Path, factor: float) -> None:
    (tmp_path / "parts").mkdir()
    (tmp_path / "m.bdf").write_text(MAIN)
    (tmp_path / "parts" / "props.bdf").write_text(PROPS)
    model = read_model(tmp_path / "m.bdf", parameters=[Parameter("E", "E", "material", (1,))])
    with pytest.raises(UpdatingError, match=f"the factor of 'E' is {factor:g}: .*give one above 0, 1 for no change"):
        updated_deck(model, {"E": factor})
