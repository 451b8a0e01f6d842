"""Bars and rods without a cross-section are told, with what they lack; nothing of no mass is divided by it."""

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import CliRunner

from femend import _core
from femend.cli import main
from femend.model.cards.no_area import zero_areas

HEAD = ["SOL 103", "CEND", "SPC = 1", "BEGIN BULK", "MAT1,1,2.1+11,,.3,7850.", "SPC1,1,123456,1"]
GRIDS = [f"GRID,{n},,{0.1 * n:.1f},0.,0." for n in range(1, 5)]


def deck(folder: Path, *cards: str) -> Path:
    path = folder / "a.bdf"
    path.write_text("\n".join([*HEAD, *GRIDS, *cards, "ENDDATA", ""]))
    return path


def bars(card: str, section: str) -> list[str]:
    return [section, *(f"{card},{n},7,{n},{n + 1},0.,1.,0." for n in range(1, 4))]


@pytest.mark.parametrize(
    ("card", "section"),
    [("CBAR", "PBAR,7,1,0.,1.-9,1.-9,2.-9"), ("CBAR", "PBAR,7,1,,1.-9,1.-9,2.-9"),
     ("CBEAM", "PBEAM,7,1,0.,1.-9,1.-9,,2.-9")],
)  # fmt: skip
def test_a_bar_of_no_area_is_told_and_no_share_of_no_mass_is_shown(tmp_path: Path, card: str, section: str) -> None:
    done = CliRunner().invoke(main, ["modes", str(deck(tmp_path, *bars(card, section))), "--n", "2"])
    assert done.exit_code == 0, done.output
    assert (
        f"warning   P{card[1:]} 7 ({card} 1 and its like) has a cross-section A of 0: its bars have no" in done.output
    )
    assert "nan" not in done.output
    assert "inf" not in done.output.replace("info", "")
    assert "shares of the structure's mass, which is 0: none are told" in done.output
    assert [line.split()[2:] for line in done.output.splitlines()[-3:-1]] == [["–"] * 3] * 2


def test_rods_that_hold_nothing_are_told_and_those_that_twist_alone_are_not(tmp_path: Path) -> None:
    rods = ["PROD,8,1,0.,1.-9", "PROD,9,1,0.", "CROD,11,8,1,2", "CROD,12,9,1,2", "CONROD,13,1,2,1,0.",
            "CONROD,14,1,2,1,1.-4", "CONROD,15,1,2,1,0.,1.-9"]  # fmt: skip
    told = zero_areas(_core.Deck.read(deck(tmp_path, *bars("CBAR", "PBAR,7,1,1.-4,1.-9,1.-9,2.-9"), *rods)))
    assert [sentence.split(" has a")[0] for sentence in told] == ["PROD 9 (CROD 12 and its like)", "CONROD 13"]


def test_sections_with_an_area_and_those_of_no_bar_are_silent(tmp_path: Path) -> None:
    cards = [*bars("CBAR", "PBAR,7,1,1.-4,1.-9,1.-9,2.-9"), "PBAR,99,1,0.", "PROD,98,1,0."]
    assert zero_areas(_core.Deck.read(deck(tmp_path, *cards))) == []
