"""Masses, springs and dashpots below nothing are told with card, number, node and value."""

from __future__ import annotations

import sys
from pathlib import Path

from femend import _core
from femend.model.cards.negative import negative_values

sys.path.insert(0, str(Path(__file__).parents[1]))
import small_study

CARDS = ("CONM2,901,4,,-0.25", "CELAS2,902,-3.+4,7,3", "CELAS2,903,3.+4,7,3,8,3", "CDAMP2,904,-1.5,7,3,8,3")


def test_negative_values_are_told(tmp_path: Path) -> None:
    path = tmp_path / "model.bdf"
    path.write_text(small_study.deck().replace("ENDDATA", "\n".join([*CARDS, "ENDDATA"])))
    told = negative_values(_core.Deck.read(path))
    assert [sentence.split(",")[0] for sentence in told] == [
        "CONM2 901 at node 4 has a mass of -0.25",
        "CELAS2 902 at node 7 has a stiffness of -3.+4",
        "CDAMP2 904 at node 7 and node 8 has a damping coefficient of -1.5",
    ]


def test_a_deck_with_none_is_silent(tmp_path: Path) -> None:
    path = tmp_path / "model.bdf"
    path.write_text(small_study.deck())
    assert negative_values(_core.Deck.read(path)) == []
