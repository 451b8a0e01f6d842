"""Reading a deck: formats, continuations, includes, case control, and what is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from femend.errors import DeckError
from femend.io.deck import read_deck

FRAME = """\
SOL 103
CEND
SPC = 7
METHOD = 1
BEGIN BULK
EIGRL,1,,,4
PARAM,COUPMASS,1
GRID,1,,0.,0.,0.
GRID           2             1.5     0.0     0.0
GRID*                  3                            3.0             0.0
*                    0.0
MAT1    1       2.1+11          .3      7850.
PBAR,1,1,1.D-4,1.-9,1.-9,2.-9
CBAR,1,1,1,2,0.,1.,0.
CBAR    2       1       2       3       0.      1.      0.
SPC1,7,123456,1
CONM2,9,3,,2.5
ENDDATA
"""


def write(folder: Path, text: str, name: str = "model.bdf") -> Path:
    path = folder / name
    path.write_bytes(text.encode())
    return path


def refusal(folder: Path, text: str) -> DeckError:
    with pytest.raises(DeckError) as caught:
        read_deck(write(folder, text)).elements()
    return caught.value


def test_three_formats_give_one_model(tmp_path: Path) -> None:
    deck = read_deck(write(tmp_path, FRAME))
    assert deck.card_counts() == {
        "CBAR": 2,
        "CONM2": 1,
        "EIGRL": 1,
        "GRID": 3,
        "MAT1": 1,
        "PARAM": 1,
        "PBAR": 1,
        "SPC1": 1,
    }
    assert deck.node_ids.tolist() == [1, 2, 3]
    np.testing.assert_array_equal(deck.xyz, [[0, 0, 0], [1.5, 0, 0], [3, 0, 0]])
    assert deck.elements() == [(1, "CBAR", 1, (1, 2)), (2, "CBAR", 1, (2, 3)), (9, "CONM2", None, (3,))]
    assert deck.case_control() == {"SOL": "103", "SPC": "7", "METHOD": "1"}
    assert deck.params() == {"COUPMASS": "1"}
    assert deck.find("GRID", 3) == (str(tmp_path / "model.bdf"), 10)
    assert deck.field_text("mat1", 1, 3) == "2.1+11"
    assert "3 nodes" in repr(deck)


@pytest.mark.parametrize("newline", ["\n", "\r\n"])
def test_line_ends_and_case_do_not_matter(tmp_path: Path, newline: str) -> None:
    deck = read_deck(write(tmp_path, FRAME.lower().replace("\n", newline)))
    assert deck.card_counts()["CBAR"] == 2
    assert deck.case_control()["SPC"] == "7"
    assert deck.params() == {"COUPMASS": "1"}
    assert len(deck.elements()) == 3


def test_bulk_data_without_begin_bulk(tmp_path: Path) -> None:
    bulk = FRAME.split("BEGIN BULK\n")[1]
    assert read_deck(write(tmp_path, bulk)).card_counts()["GRID"] == 3
    with_case = read_deck(write(tmp_path, FRAME.replace("BEGIN BULK\n", "")))
    assert with_case.case_control()["SPC"] == "7"
    assert with_case.card_counts()["GRID"] == 3


def test_continuations_by_name_may_stand_anywhere(tmp_path: Path) -> None:
    text = (
        f"{'+A      22      23      24      25':<72}+B\n"
        + f"{'SPC1    9       123     1       2       3       4       5       6':<72}+A\n"
        + "".join(f"GRID,{i},,{i}.,0.,0.\n" for i in [*range(1, 7), *range(22, 29)])
        + "+B      26      27      28\n"
    )
    deck = read_deck(write(tmp_path, text))
    assert [deck.field_text("SPC1", 9, field) for field in (2, 9, 12, 15, 22, 24)] == ["9", "6", "22", "25", "26", "28"]


def test_a_continuation_that_belongs_to_no_card(tmp_path: Path) -> None:
    error = refusal(tmp_path, "GRID,1,,0.,0.,0.,,,,+X\n+Y,2\n")
    assert (error.line, "'Y' belongs to no card" in str(error)) == (2, True)
    assert "without a card" in str(refusal(tmp_path, "BEGIN BULK\n+,1,2\n"))


def test_includes_are_found_beside_the_including_file(tmp_path: Path) -> None:
    (tmp_path / "parts" / "deep").mkdir(parents=True)
    write(tmp_path, "BEGIN BULK\nINCLUDE 'parts/\n  one.blk'\nGRID,1,,0.,0.,0.\nENDDATA\n")
    write(tmp_path, "GRID,2,,1.,0.,0.\ninclude deep/two.blk $ a comment\n", "parts/one.blk")
    write(tmp_path, "GRID,3,,2.,0.,0.\n", "parts/deep/two.blk")
    deck = read_deck(tmp_path / "model.bdf")
    assert deck.node_ids.tolist() == [1, 2, 3]
    assert [Path(file).name for file in deck.files] == ["model.bdf", "one.blk", "two.blk"]
    assert deck.find("GRID", 3) == (str(tmp_path / "parts" / "deep" / "two.blk"), 1)


def test_a_circular_include_is_told(tmp_path: Path) -> None:
    write(tmp_path, "GRID,2,,1.,0.,0.\nINCLUDE 'model.bdf'\n", "one.blk")
    error = refusal(tmp_path, "BEGIN BULK\nINCLUDE 'one.blk'\n")
    assert error.file == str(tmp_path / "one.blk")
    assert error.line == 2
    assert "circular" in str(error)


def test_missing_files(tmp_path: Path) -> None:
    with pytest.raises(DeckError, match="no such file") as caught:
        read_deck(tmp_path / "absent.bdf")
    assert caught.value.file == str(tmp_path / "absent.bdf")
    error = refusal(tmp_path, "BEGIN BULK\n\nINCLUDE 'absent.blk'\n")
    assert (error.line, "absent.blk" in str(error)) == (3, True)
    with pytest.raises(DeckError, match="folder"):
        read_deck(tmp_path)


@pytest.mark.parametrize(
    ("wrong", "line", "card", "words"),
    [
        ("GRID,1,,abc,0.,0.", 1, "GRID 1", "field 4: 'abc' is not a number"),
        ("GRID,x,,1.,0.,0.", 1, "GRID x", "'x' is not an integer"),
        ("CQAUD4,1,1,1,2,3,4", 1, "CQAUD4", "did you mean CQUAD4?"),
        ("GRID,1\n=,*1,=\n", 2, None, "replication is not supported"),
        ("GRID,1\nCQUADR,4,1,1,2,3", 2, "CQUADR", "is not supported"),
        ("GRID,1\nGRID,2\nGRID,1,,1.,0.,0.", 3, "GRID 1", "id already used by"),
        ("CBAR,5,1,1,2,0.,1.,0.\nGRID,1\nPBAR,1,1\nMAT1,1,1.,,.3", 1, "CBAR 5", "GRID 2 is not defined"),
        ("CBAR,5,8,1,1,0.,1.,0.\nGRID,1", 1, "CBAR 5", "property 8 is not defined"),
        ("PBAR,1,3\nGRID,1", 1, "PBAR 1", "MAT1 3 is not defined"),
        ("GRID,1,4,0.,0.,0.", 1, "GRID 1", "coordinate system 4 is not defined"),
        ("CORD2R,1,2\n+,1.\nCORD2R,2,1,0.,0.,0.,0.,0.,1.\n+,1.\nGRID,1,1", None, None, "defined by itself"),
        ("CORD2R,1,,0.,0.,0.,0.,0.,1.\n+,0.,0.,2.\nGRID,1,1", 1, "CORD2R 1", "lie on one line"),
        ("CROD,1,1,1,2\nGRID,1\nGRID,2\nPBAR,1,1\nMAT1,1,1.,,.3", 1, "CROD 1", "is a PBAR; CROD needs PROD"),
        ("MAT1,1\nGRID,1", 1, "MAT1 1", "both blank"),
        ("PBARL,1,1,,DODECA\n+,1.\nMAT1,1,1.,,.3", 1, "PBARL 1", "section 'DODECA' is not supported"),
        ("RBE2,1,1,128,2\nGRID,1\nGRID,2", 1, "RBE2 1", "components 1 to 6"),
        ("", 1, None, "no bulk data"),
        ("just a text\n", 1, None, "is no card name"),
        ("BEGIN BULK\n/delete 3\n", 2, None, "is no card name"),
    ],
)
def test_a_refusal_names_line_card_and_fact(
    tmp_path: Path, wrong: str, line: int | None, card: str | None, words: str
) -> None:
    error = refusal(tmp_path, wrong)
    assert words in str(error)
    assert error.file == str(tmp_path / "model.bdf")
    assert str(tmp_path / "model.bdf") in str(error)
    if line is not None:
        assert (error.line, error.card) == (line, card)


def test_a_wrong_field_on_a_continuation_is_found_on_its_own_line(tmp_path: Path) -> None:
    error = refusal(tmp_path, "GRID,1\nCONM2,1,1,,2.\n$ comment\n+,1.,x.\n")
    assert (error.line, error.card) == (4, "CONM2 1")
    assert "field 13: 'x.'" in str(error)


def test_cards_that_do_not_matter_are_counted(tmp_path: Path) -> None:
    deck = read_deck(
        write(
            tmp_path, FRAME.replace("ENDDATA", "FORCE,1,2,,1.,0.,1.,0.\nPLOTEL,7,1,2\nFORCE,1,3,,1.,0.,1.,0.\nENDDATA")
        )
    )
    assert deck.ignored() == {"FORCE": 2, "PLOTEL": 1}


def test_coordinate_systems_of_every_kind(tmp_path: Path) -> None:
    text = """\
CORD2C,1,,1.,0.,0.,1.,0.,1.
+,2.,0.,0.
CORD2S,2,1,0.,0.,0.,0.,0.,1.
+,1.,0.,0.
CORD1R,3,10,11,12,4,10,12,11
GRID,1,1,2.,90.,5.
GRID,2,2,2.,90.,90.
GRID,3,3,1.,2.,3.
GRID,4,4,1.,2.,3.
GRID,10,,0.,0.,1.
GRID,11,,0.,1.,1.
GRID,12,,1.,0.,1.
"""
    deck = read_deck(write(tmp_path, text))
    xyz = dict(zip(deck.node_ids.tolist(), deck.xyz, strict=True))
    np.testing.assert_allclose(xyz[1], [1, 2, 5], atol=1e-12)
    np.testing.assert_allclose(xyz[2], [1, 2, 0], atol=1e-12)
    # z along +y, x along +x, hence y along -z
    np.testing.assert_allclose(xyz[3], [1, 3, -1], atol=1e-12)
    # z along +x, x along +y, hence y along +z
    np.testing.assert_allclose(xyz[4], [3, 1, 3], atol=1e-12)
