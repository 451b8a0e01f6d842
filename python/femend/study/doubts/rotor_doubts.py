"""Rotors that a deck declares and that do not fit the runs of a study."""

from __future__ import annotations

from typing import TYPE_CHECKING

from femend import _core
from femend.model.terms.rotors import deck_rotors
from femend.numerals import listed

if TYPE_CHECKING:
    from femend.study.file.study import Study

__all__ = ["SHAFT", "rotor_doubts"]

SHAFT = {"X": (1.0, 0.0, 0.0), "Y": (0.0, 1.0, 0.0), "Z": (0.0, 0.0, 1.0)}


def rotor_doubts(study: Study, deck: _core.Deck) -> list[str]:
    """What is not clear about the rotors of the `deck` of a `study` with runs, and runs along whose shaft none of them
    lies; nothing where the deck has no rotors or the study no runs."""
    axes: dict[str, list[str]] = {}
    for r in study.recordings:
        if r.rotating is not None:
            axes.setdefault(r.rotating.axis, []).append(r.name)
    if not axes:
        return []
    rotors = deck_rotors(deck)
    told = list(rotors.warnings)
    for axis, names in axes.items():
        if rotors.rotors and not rotors.parts(SHAFT[axis]):
            told.append(
                f"no rotor of the deck lies along {axis}, the axis in [recording.rotating] of {listed(names, 4)}, so "
                "that the model is taken at rest there; check axis, and ROTORG of the deck"
            )
    return told
