"""Nastran decks: reading, looking up, and writing a changed deck that is otherwise the user's, byte for byte."""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path
from typing import Literal, NamedTuple

from femend._core import Deck
from femend.errors import DeckError
from femend.io.other_decks import other_deck

__all__ = ["Deck", "FieldChange", "next_id", "patch_deck", "read_deck"]

Kind = Literal["node", "coord", "element", "mass", "rigid", "property", "bush", "spring", "damper", "material"]


class FieldChange(NamedTuple):
    """A new number for one field of one card.

    `field` counts as Nastran does: 1 is the card's name, 2 to 9 the data of its first line, 12 to 19 those of the
    second, 22 to 29 of the third, whatever the format. E of MAT1 is field 3, I11 of CONM2 field 12.
    """

    card: str
    id: int
    field: int
    value: float


def read_deck(path: str | os.PathLike[str]) -> Deck:
    """Read a bulk-data deck and the files it includes.

    Raises `DeckError` with `file`, `line` and `card` for what cannot be opened or understood, for unknown cards, for
    cards that would change K, M or C and are not supported, and for ids used twice. Values and references are
    checked when the model is built. A deck of another program (Abaqus, ANSYS, LS-DYNA) is told as such.
    """
    try:
        return Deck.read(os.fspath(path))
    except DeckError as error:
        other = other_deck(path) if Path(path).is_file() else None
        if other is None:
            raise
        told = f":{other.line}: {other.text!r} is of {other.program}" if other.line else f" is {other.program}"
        raise DeckError(
            f"{os.fspath(path)}{told}; a deck is Nastran bulk data (.bdf, .dat, .nas): export the model as that",
            file=error.file,
            line=other.line or None,
        ) from None


def patch_deck(
    deck: Deck, changes: Iterable[tuple[str, int, int, float]], additions: Iterable[str] = ()
) -> dict[Path, bytes]:
    """Contents of the files of `deck` that differ once `changes` are made and `additions` are put in.

    `changes` are `FieldChange` or plain (card, id, field, value). Each number is written where the old one stands, as
    exactly as the field's columns allow (8, 16, or as many as needed in free field). `additions` are lines of bulk data
    put before ENDDATA, or at the end of a deck without one. Everything else keeps its bytes, line ends included. A
    coordinate that the line of a GRID ends before (free and small fields) is put at its end.

    Raises `DeckError` for a card that is not there, a field that is not on its card, and a value its columns
    cannot hold.
    """
    plain = [(card, int(id_), int(field), float(value)) for card, id_, field, value in changes]
    return {Path(path): text for path, text in deck.patched(plain, list(additions)).items()}


def next_id(deck: Deck, kind: Kind) -> int:
    """An id of this kind that the deck does not use: the largest plus one. Elements of every kind share their ids."""
    if kind in ("element", "mass", "rigid"):
        return max(deck.next_id("element"), deck.next_id("mass"), deck.next_id("rigid"))
    if kind in ("property", "bush", "spring", "damper"):
        return max(deck.next_id(other) for other in ("property", "bush", "spring", "damper"))
    return deck.next_id(kind)
