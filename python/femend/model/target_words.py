"""What is said where a parameter acts on nothing: in the user's words, with the ids that there are."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from femend import _core
from femend.errors import ModelError
from femend.model.cards.near_ids import near_ids
from femend.model.parameter import NOUNS, Parameter

__all__ = ["in_words"]

_NO_ELEMENT = re.compile(r"no element uses [a-z ]+ (\d+); correct the id$")
_MATERIAL = re.compile(r"^[ ]*MAT\d+\*?[ ,]+(\d+)", re.IGNORECASE | re.MULTILINE)


def in_words(error: ModelError, deck: _core.Deck, parameters: Sequence[Parameter]) -> ModelError:
    """The `error` of a model of the `deck` with these `parameters`: with the nearest ids where an id is used by no
    element, and the property as the user wrote it where the factor changes nothing; any other error as it is."""
    said = str(error)
    named = [p for p in parameters if said.startswith(f"parameter {p.name}: ")]
    if type(error) is not ModelError or not named:
        return error
    # a name may begin with another one and a colon
    p = max(named, key=lambda p: len(p.name))
    who, noun = f"parameter {p.name!r}", NOUNS.get(p.target, p.target)
    if missed := _NO_ELEMENT.search(said):
        return ModelError(f"{who}: {_missed(int(missed[1]), noun, _known(deck, p))}")
    if "its factor changes nothing" in said:
        ids = ", ".join(map(str, p.ids))
        return ModelError(
            f"{who}: its factor changes nothing: {p.property} of {noun} {ids} has no part in K, M or C; correct "
            f"property or {p.target}"
        )
    return error


def _missed(wanted: int, noun: str, known: list[int]) -> str:
    if wanted in known:
        return f"{noun} {wanted} is in the deck, but its factor acts on no element; correct the id"
    fact = "the deck has no" if noun.endswith("element") else "no element uses"
    return f"{fact} {noun} {wanted} ({near_ids(wanted, known)}); correct the id"


def _known(deck: _core.Deck, p: Parameter) -> list[int]:
    """Ids that the deck has of the kind of thing that a parameter acts on."""
    if p.target == "material":
        texts = [Path(name).read_text(encoding="latin-1") for name in deck.files]
        return [int(mid) for text in texts for mid in _MATERIAL.findall(text)]
    rows = deck.elements()
    if p.target == "property_id":
        return [pid for _, _, pid, _ in rows if pid is not None]
    masses = p.target == "mass" or p.property == "m"
    return [eid for eid, card, _, _ in rows if card.startswith(("CONM", "CMASS")) == masses]
