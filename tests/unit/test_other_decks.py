"""A deck of another program is told as such, not as a card that is misspelt."""

from __future__ import annotations

from pathlib import Path

import pytest

from femend import read_model
from femend.errors import DeckError
from femend.io.deck import read_deck

ABAQUS = (
    "** made by hand\n*HEADING\nbeam\n*NODE\n1,0.,0.,0.\n*ELEMENT,TYPE=B31\n1,1,2\n*STEP\n*FREQUENCY\n3\n*END STEP\n"
)
ANSYS = "/COM,ANSYS RELEASE 2023\n/PREP7\nNBLOCK,6,SOLID\n(3i9,6e21.13e3)\n"
DYNA = "*KEYWORD\n*NODE\n       1     0.0     0.0     0.0\n*END\n"
UNIVERSAL = "    -1\n  2411\n         1         0         0        11\n    -1\n"


@pytest.mark.parametrize(
    ("text", "line", "told"),
    [
        (ABAQUS, 2, "'\\*HEADING' is of Abaqus or CalculiX"),
        (ABAQUS.replace("*HEADING\nbeam\n", "").lower(), 2, "'\\*node' is of Abaqus or CalculiX"),
        (ANSYS, 1, "'/COM,ANSYS RELEASE 2023' is of ANSYS"),
        (DYNA, 1, "'\\*KEYWORD' is of LS-DYNA"),
        (UNIVERSAL, 1, "'-1' is of a universal file"),
    ],
    ids=["abaqus", "abaqus without heading", "ansys", "ls-dyna", "universal"],
)
@pytest.mark.parametrize("read", [read_deck, read_model])
def test_the_program_is_named(tmp_path: Path, read, text: str, line: int, told: str) -> None:  # type: ignore[no-untyped-def]
    path = tmp_path / "beam.inp"
    path.write_text(text)
    with pytest.raises(DeckError, match=f":{line}: {told}; a deck is Nastran bulk data") as caught:
        read(path)
    assert caught.value.line == line


def test_a_binary_file_is_told(tmp_path: Path) -> None:
    path = tmp_path / "model.bdf"
    path.write_bytes(b"\x04\x00\x00\x00\x03\x00\x00\x00")
    with pytest.raises(DeckError, match=r"model\.bdf is a binary file; a deck is"):
        read_deck(path)


def test_large_fields_and_misspelt_cards_are_nastrans(tmp_path: Path) -> None:
    path = tmp_path / "model.bdf"
    path.write_text(
        "BEGIN BULK\nGRID*                  1                              0.              0.\n*       0.\nBEEM,1\n"
    )
    with pytest.raises(DeckError, match="BEEM is not a known bulk-data card"):
        read_deck(path)
