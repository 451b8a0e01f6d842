"""The SPC set that a further card has to be of to hold something with those that hold the model."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from femend import _core

__all__ = ["spc_set_of"]


def spc_set_of(deck: _core.Deck, chosen: int | None) -> int | None:
    """The SPC set that is selected, which is the one `chosen` or, without that, case control's; where SPCADD adds it
    up, the first of those it adds. None where none is."""
    text = deck.case_control().get("SPC", "").strip() if chosen is None else str(chosen)
    if not text.isdecimal() or int(text) == 0:
        return None
    adds = (fields for fields in deck.cards("SPCADD") if fields[0].strip() == text)
    return int(next((fields[1] for fields in adds), text))
