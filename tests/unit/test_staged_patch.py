"""Rotational stiffnesses of springs go to the K group of their PBUSH wherever it stands, or are told to be put in."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from femend.io.deck import FieldChange
from femend.model import Parameter, read_model
from femend.study.result.deck_told import deck_told
from femend.study.staged.patch import staged_cards, staged_changes, staged_told

DECK = """BEGIN BULK
GRID,1,,0.,0.,0.
GRID,2,,0.,0.,.1
CBUSH,9,9,1,2,,,,0
CBUSH,10,9,1,2,,,,0
{bush}
SPC1,1,123456,1
CONM2,7,2,,1.5
ENDDATA
"""
WIDE = "PBUSH,9,B,1.,1.,1.\n,,K,1+4,1+4,2+4,0.,0.,0."
SHORT = "PBUSH,9,K,1+4,1+4,2+4"
VALUES = {"k_rot_x": 30.0, "k_rot_y": 40.0, "k_rot_z": 50.0, "coupling": 5.0}


def springs(folder: Path, bush: str) -> tuple[Any, Any]:
    """A setup and a flow in which the springs of property 9 were found to carry moments."""
    file = folder / "deck.bdf"
    file.write_text(DECK.format(bush=bush))
    names = tuple(f"bending: {name}" for name in VALUES)
    unknowns = SimpleNamespace(names=names, index=names.index)
    term = SimpleNamespace(
        physics="spring_bending", name="bending", label="moments in springs", property_id=9, configurations=(),
        unknowns=[SimpleNamespace(name=name) for name in names],
    )  # fmt: skip
    posterior = SimpleNamespace(values=np.array(list(VALUES.values())), unknowns=unknowns)
    return SimpleNamespace(free=read_model(file)), SimpleNamespace(terms=[term], posterior=posterior)


def test_they_are_written_behind_the_flag_k(tmp_path: Path) -> None:
    setup, flow = springs(tmp_path, WIDE)
    assert staged_changes(setup, flow) == [FieldChange("PBUSH", 9, 17 + i, 30.0 + 10 * i) for i in range(3)]
    assert "k_rot stand in PBUSH K4 to K6" in " ".join(staged_cards(setup, flow)).replace("$ femend: ", "")


def test_those_without_columns_are_told(tmp_path: Path) -> None:
    setup, flow = springs(tmp_path, SHORT)
    assert staged_changes(setup, flow) == []
    said = " ".join(staged_cards(setup, flow)).replace("$ femend: ", "")
    assert "PBUSH 9 has no columns for K4 = 30, K5 = 40, K6 = 50: put them into its K line by hand" in said


def test_what_the_deck_lacks_is_told(tmp_path: Path) -> None:
    (wide,) = staged_told(*springs(tmp_path, WIDE))
    assert wide.startswith("the updated deck does not contain all of the moments in springs; it lacks the coupling")
    (short,) = staged_told(*springs(tmp_path, SHORT))
    assert "K4 = 30 (put it into the K line of PBUSH 9" in short
    assert "K6 = 50" in short


@pytest.mark.parametrize(
    ("physics", "words"),
    [("gyroscopic", "a deck at rest has no card for it"), ("joint_stiffness", "with 0.4 times its stiffness")],
)
def test_terms_that_no_card_holds_are_told(tmp_path: Path, physics: str, words: str) -> None:
    setup, flow = springs(tmp_path, WIDE)
    unknowns = [SimpleNamespace(name="term: factor")]
    flow.terms = [SimpleNamespace(physics=physics, name="term", label="", configurations=(), unknowns=unknowns)]
    names = ("term: factor",)
    flow.posterior = SimpleNamespace(values=np.array([0.4]), unknowns=SimpleNamespace(names=names, index=names.index))
    (said,) = staged_told(setup, flow)
    assert words in said


@pytest.mark.parametrize("cards", [(), ("CELAS2,99,1.0+5,2,3",)])
def test_a_diagnosed_deck_is_told_by_its_values_alone(tmp_path: Path, cards: tuple[str, ...]) -> None:
    setup, _ = springs(tmp_path, SHORT)
    parameters = [Parameter("m", "m", "mass", (7,)), Parameter("k", "k3", "elements", (9,))]
    model = read_model(setup.free.deck.path, parameters=parameters)
    files = {Path(p): text for p, text in model.deck.patched([("CONM2", 7, 5, 1.8)], list(cards)).items()}
    (text,) = deck_told(model, {"m": 1.2, "k": 1.1}, files)
    assert text.startswith("no field of the deck holds the values of k: ")
