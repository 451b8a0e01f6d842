"""Supports that stand in a deck and that its case control does not select: the model is free, as Nastran's would be."""

from __future__ import annotations

from femend import _core

__all__ = ["unselected_supports"]


def unselected_supports(deck: _core.Deck) -> list[str]:
    """A sentence where a deck has SPC cards and its case control selects none of their sets."""
    counts = deck.card_counts()
    n = sum(counts.get(card, 0) for card in ("SPC", "SPC1"))
    if not n or "SPC" in deck.case_control():
        return []
    return [
        f"the deck has {n} SPC card{'s' * (n > 1)}, but its case control selects no set, so that nothing is held by "
        "them: write SPC = (the set's number) between CEND and BEGIN BULK, or name the set (spc of a "
        "[[configuration]], --spc of femend modes)"
    ]
