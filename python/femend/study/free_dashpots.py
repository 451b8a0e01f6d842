"""Dashpots of the deck as unknowns of a diagnosis."""

from __future__ import annotations

from femend.errors import DeckError, ModelError
from femend.model import Model, Parameter
from femend.model.dashpots import dashpot_owners
from femend.model.model import model_of
from femend.model.section_fields import bush_fields

__all__ = ["with_free_dashpots"]

# relative 1-sigma of a dashpot for which the study gives none: as little is known of it as of a damping ratio
PRIOR_SD = 0.5
# dashpots of their own strength up to which each is an unknown; of more hardly any is told from the others
MOST = 4
_OF_PROPERTY = {"CDAMP1": "PDAMP", "CDAMP3": "PDAMP", "CBUSH": "PBUSH"}
_ALONE = ("CDAMP2", "CDAMP4")


def with_free_dashpots(model: Model) -> Model:
    """The `model` with a parameter more for each strength of the deck's dashpots of which the study has none: of every
    value of a property, and of every element that has its own. The same model where there are none or more than four.

    A damper that is stronger or weaker than drawn is nothing that the model lacks, but looks like it where its strength
    is held.
    """
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
    for element, card, pid, _ in model.deck.elements():
        if card in _ALONE:
            found[f"{card} {element}", "c1"] = [element]
        elif card in _OF_PROPERTY and pid is not None:
            for quantity in _quantities(model, card, pid):
                name = f"{quantity} of {_OF_PROPERTY[card]} {pid}" if card == "CBUSH" else f"PDAMP {pid}"
                found.setdefault((name, quantity), []).append(element)
    return found


def _quantities(model: Model, card: str, pid: int) -> list[str]:
    """Dashpots "c1" to "c6" that a property has."""
    if card != "CBUSH":
        return ["c1"]
    try:
        return [c for c in (f"c{i}" for i in range(1, 7)) if bush_fields(model.deck, pid, c)]
    except DeckError:  # a property that is told otherwise than by a PBUSH
        return []
