"""What a deck asks of Nastran and does not get here is told: modes are those of another model without it."""

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import CliRunner

from femend.cli import main
from femend.io.deck import read_deck
from femend.model.cards.unheeded import unheeded

BAR = "GRID,1\nGRID,2,,1.,0.,0.\nCBAR,1,1,1,2,0.,1.,0.\nPBAR,1,1,6.-4,5.-8,5.-8,1.-7\nMAT1,1,2.1+11,,.3,7850.\n"
HELD = "SPC1,1,123456,1\nSPC1,2,123,1\n"


def deck(folder: Path, case: str, cards: str = "") -> Path:
    path = folder / "model.bdf"
    path.write_text(f"SOL 103\nCEND\n{case}\nBEGIN BULK\n{BAR}{HELD}{cards}ENDDATA\n")
    return path


@pytest.mark.parametrize(
    ("case", "cards", "words"),
    [
        ("SPC = 1\nSUBCASE 1\nLOAD = 3\nSUBCASE 2\nSTATSUB = 1", "", ("stress stiffness", "femend.analysis.preload")),
        ("SUBCASE 1\nSPC = 1\nSUBCASE 2\nSPC = 2", "", ("SPC = 2", "the first subcase counts")),
        ("SPC = 1\nTEMPERATURE(MATERIAL) = 4", "MATT1,1,5\n", ("moduli at the temperature", "1 MATT1")),
        ("SPC = 1", "PBUSHT,7,K,5\nPELAST,8,5\n", ("follow the frequency", "1 PBUSHT, 1 PELAST", "PBUSH, PELAS")),
        ("SPC = 1\nTFL = 3", "TF,3,1,1\n", ("transfer functions", "DMIG")),
        ("SPC = 1", "ASET1,2,2\n", ("(1 ASET1)", "not applied", "those of the whole model")),
        ("SPC = 1", "OMIT,2,3\nQSET1,0,9\nSPOINT,9\n", ("(1 OMIT, 1 QSET1)", "those of the whole model")),
    ],
    ids=[
        "stress stiffness",
        "second subcase",
        "temperature",
        "frequency",
        "transfer functions",
        "ASET1",
        "OMIT and QSET1",
    ],
)
def test_each_is_told_where_modes_are_computed(tmp_path: Path, case: str, cards: str, words: tuple[str, ...]) -> None:
    done = CliRunner().invoke(main, ["modes", str(deck(tmp_path, case, cards))])
    assert done.exit_code == 0, done.output
    told = [line for line in done.output.splitlines() if line.startswith("warning")]
    assert any(all(word in line for word in words) for line in told), done.output


@pytest.mark.parametrize(
    "case",
    ["SPC = 1", "SUBCASE 1\nSPC = 1\nSUBCASE 2\nSPC = 1\nMETHOD = 9", "SPC = 1\nSUBCASE 1\nSUBCASE 2\nLOAD = 2"],
)
def test_a_deck_that_gets_what_it_asks_for_is_left_alone(tmp_path: Path, case: str) -> None:
    assert unheeded(read_deck(deck(tmp_path, case, "MATT1,1,5\nTF,3,1,1\n"))) == []


def test_sets_that_are_named_elsewhere_are_not_missed(tmp_path: Path) -> None:
    read = read_deck(deck(tmp_path, "SUBCASE 1\nSPC = 1\nSUBCASE 2\nSPC = 2"))
    assert len(unheeded(read)) == 1
    assert unheeded(read, constraints=False) == []
