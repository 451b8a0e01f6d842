"""Dashpots of the deck as unknowns of a diagnosis."""

from __future__ import annotations

from femend.errors import DeckError, ModelError
from femend.model import Model, Parameter
from femend.model.cards.section_fields import bush_fields
from femend.model.model import model_of
from femend.model.patched.deck_fields import OWN_PROPERTIES
from femend.model.reduced.dashpots import dashpot_owners, still_dashpots

__all__ = ["with_free_dashpots"]

# relative 1-sigma of a dashpot for which the study gives none: as little is known of it as of a damping ratio
PRIOR_SD = 0.5
# dashpots of their own strength up to which each is an unknown; of more hardly any is told from the others
MOST = 4
# elements with a value of their own, and properties that have some
_ALONE = ("CDAMP2", "CDAMP4")
_DAMPED = ("PDAMP", "PBUSH")


def with_free_dashpots(model: Model) -> Model:
    """The `model` with a parameter more for each strength of the deck's dashpots of which the study has none: of every
    value of a property, and of every element that has its own. The same model where there are none or more than four.

    A damper that is stronger or weaker than drawn is nothing that the model lacks, but looks like it where its strength
    is held.
    """
    if not still_dashpots(model).size:
        return model
    free = _free(model)
    return _with(model, (*model.parameters, *free)) if 0 < len(free) <= MOST else model


def _free(model: Model) -> list[Parameter]:
    """A parameter for each strength that no parameter of the model is a factor on; not all of more than `MOST`."""
    found: list[Parameter] = []
    for (name, quantity), elements in _values(model).items():
        one = Parameter(name, quantity, "elements", tuple(elements), PRIOR_SD)
        try:
            owners = dashpot_owners(_with(model, (*model.parameters, one)))
        except ModelError:  # a dashpot of 0
            continue
        if len(model.parameters) in owners:
            found.append(one)
        if len(found) > MOST:
            break
    return found


def _with(model: Model, parameters: tuple[Parameter, ...]) -> Model:
    return model_of(model.deck, units=model.units, parameters=parameters, spc=model.spc, added_mass=model.added_mass)


def _values(model: Model) -> dict[tuple[str, str], list[int]]:
    """Elements by what their dashpots are called and by the quantity that a factor on them is."""
    found: dict[tuple[str, str], list[int]] = {}
    of_property: dict[tuple[str, int], list[int]] = {}
    for element, card, pid, _ in model.deck.elements():
        if card in _ALONE:
            found[f"{card} {element}", "c1"] = [element]
        elif OWN_PROPERTIES.get(card) in _DAMPED and pid is not None:
            of_property.setdefault((OWN_PROPERTIES[card], pid), []).append(element)
    for (kind, pid), elements in of_property.items():
        found |= {value: elements for value in _of_property(model, kind, pid)}
    return found


def _of_property(model: Model, kind: str, pid: int) -> list[tuple[str, str]]:
    """What the dashpots of a property are called, and "c1" to "c6"."""
    if kind != "PBUSH":
        return [(f"{kind} {pid}", "c1")]
    try:
        has = [c for c in (f"c{i}" for i in range(1, 7)) if bush_fields(model.deck, pid, c)]
    except DeckError:  # a property that is told otherwise than by a PBUSH
        return []
    return [(f"{c} of {kind} {pid}", c) for c in has]
