"""Masses of a deck's cards against those of its unit system (PARAM,WTMASS)."""

from __future__ import annotations

from femend import _core
from femend.model.cards.real_field import real

__all__ = ["mass_of_card"]


def mass_of_card(deck: _core.Deck) -> float:
    """What a mass of 1 on a card of the `deck` is in the unit system that it is said to be in: 1, or its PARAM,WTMASS,
    as in decks of kilograms or pounds beside mm and N or in and lbf."""
    return real(deck.params().get("WTMASS", "1."))
