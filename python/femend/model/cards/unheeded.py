"""What a deck asks of Nastran that changes a model's stiffness and has no part in it here: stress stiffness of a static
subcase, constraints of a second subcase, properties that follow a temperature or a frequency, transfer functions,
reduction to a set of DOFs."""

from __future__ import annotations

from femend import _core
from femend.numerals import listed

__all__ = ["unheeded"]

# what selects matrices and constraints
_SELECTING = ("SPC", "MPC", "K2GG", "M2GG", "B2GG", "K42GG", "K2PP", "M2PP", "B2PP")
_TEMPERATURE = ("TEMPERATURE", "TEMP")
_OVER_TEMPERATURE = ("MATT1", "MATT2", "MATT8", "MATT9")
_REDUCING = tuple(f"{name}{one}" for name in ("ASET", "BSET", "CSET", "OMIT", "QSET") for one in ("", "1"))
_OVER_FREQUENCY = ("PBUSHT", "PELAST", "PDAMPT")


def unheeded(deck: _core.Deck, constraints: bool = True) -> list[str]:
    """A sentence for each thing that the deck's case control asks for, or that a card of it says, and that the model is
    made without. `constraints` tells whether the sets of case control are those in force.

    Nastran Quick Reference Guide: case control STATSUB, TEMPERATURE, TFL; MATT1, PBUSHT, PELAST, PDAMPT,
    ASET, OMIT.
    """
    ours, later = deck.case_control(), deck.later_subcases()
    cards = deck.ignored()
    told = []
    if "STATSUB" in ours or any(name == "STATSUB" for name, _ in later):
        told.append(
            "case control asks for modes of the loaded structure (STATSUB): the stress stiffness of that load is not "
            "added; stress_stiffness of femend.analysis.preload computes it"
        )
    others = [f"{name} = {value}" for name, value in later if name in _SELECTING and ours.get(name) != value]
    if constraints and others:
        told.append(
            f"a later subcase selects {listed(list(dict.fromkeys(others)), 4)}, of which nothing is taken: the first "
            "subcase counts; put the one that is meant first, or name its sets where constraints are chosen"
        )
    warm = any(name in ours for name in _TEMPERATURE)
    told += _cards(cards, _OVER_TEMPERATURE if warm else (), "moduli at the temperature selected", "the materials")
    told += _cards(cards, _OVER_FREQUENCY, "values that follow the frequency", "PBUSH, PELAS and PDAMP")
    if "TFL" in ours and "TF" in cards:
        told.append("case control selects transfer functions (TFL), which are not added: write them as DMIG")
    reducing = [f"{cards[name]} {name}" for name in _REDUCING if name in cards]
    if reducing:
        told.append(
            f"the deck has sets to reduce the model to ({listed(reducing, 4)}), which are not applied: modes are "
            "those of the whole model, whose frequencies are no higher than those of a reduced one"
        )
    return told


def _cards(counts: dict[str, int], names: tuple[str, ...], what: str, instead: str) -> list[str]:
    found = [f"{counts[name]} {name}" for name in names if name in counts]
    return [f"{what} ({listed(found, 4)}) are not taken: those of {instead} stand"] if found else []
