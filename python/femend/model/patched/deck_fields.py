"""Which fields of a deck hold the values of a parameter."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from femend import _core
from femend.errors import DeckError
from femend.model.cards.section_fields import beam_fields, bush_fields, corner_fields, ply_fields
from femend.model.model import Model
from femend.model.parameter import Parameter

__all__ = ["OWN_PROPERTIES", "Place", "parameter_fields"]

# a card, its id, and a field as Nastran counts
Place = tuple[str, int, int]

_CONM1 = (*range(5, 10), *range(12, 20), *range(22, 30))
# fields of every material that a factor may scale; a factor on a quantity not named has no part in the material
_MATERIAL: dict[str, dict[str, tuple[int, ...]]] = {
    "MAT1": {"E": (3,), "G": (4,), "nu": (5,), "rho": (6,), "eta": (9,)},
    "MAT2": {"E": tuple(range(3, 9)), "rho": (9,), "eta": (16,)},
    "MAT8": {"E": (3, 4), "nu": (5,), "G": (6, 7, 8), "rho": (9,), "eta": (22,)},
    "MAT9": {"E": (*range(3, 10), *range(12, 20), *range(22, 28)), "rho": (28,), "eta": (38,)},
}
# of E, G and nu of a MAT1 the one left blank follows from the others; any other blank field is 0
_FOLLOWING = {("MAT1", "E"), ("MAT1", "G"), ("MAT1", "nu")}
_PROPERTY: dict[str, dict[str, int]] = {
    "PBAR": {"A": 4, "I1": 5, "I2": 6, "J": 7},
    "PROD": {"A": 4, "J": 5},
    "PELAS": {"k1": 3, "eta": 4},
    "PDAMP": {"c1": 3},
}
_ELEMENT: dict[str, dict[str, int]] = {
    "CELAS2": {"k1": 3, "eta": 8},
    "CELAS4": {"k1": 3},
    "CDAMP2": {"c1": 3},
    "CDAMP4": {"c1": 3},
    "CONROD": {"A": 6, "J": 7},
}
_MASS: dict[str, tuple[int, ...]] = {"CONM2": (5,), "CONM1": _CONM1, "CMASS2": (3,), "CMASS4": (3,)}
_STRUCTURAL = ("PBAR", "PBARL", "PBEAM", "PBEAML", "PROD", "PSHELL", "PCOMP", "PCOMPG", "PSOLID")
# cards of properties with ids of their own, by the elements that have them; those of all others share theirs
OWN_PROPERTIES = {"CBUSH": "PBUSH", "CELAS1": "PELAS", "CELAS3": "PELAS", "CDAMP1": "PDAMP", "CDAMP3": "PDAMP"}
_OF_MATERIAL, _OF_BEAM = ("E", "G", "nu", "rho", "eta"), ("A", "I1", "I2", "J")


def parameter_fields(model: Model) -> dict[str, list[Place]]:
    """Fields of the deck of `model` for every parameter by name: each times the factor, they make of the deck what the
    factor makes of the model. None where no fields do: values that follow from others (a section from its dimensions,
    G from E and nu), or that stand on a card which other elements use too."""
    deck = _Deck(model.deck)
    return {p.name: deck.fields(p) or [] for p in model.parameters}


@dataclass(frozen=True, eq=False)
class _Deck:
    deck: _core.Deck

    @cached_property
    def shells(self) -> dict[int, list[tuple[str, int]]]:
        """(card, id) of the shell elements of every property."""
        found: dict[int, list[tuple[str, int]]] = {}
        for eid, card, pid, _ in self.deck.elements():
            if card in ("CQUAD4", "CTRIA3") and pid is not None:
                found.setdefault(pid, []).append((card, eid))
        return found

    @cached_property
    def property_of(self) -> dict[int, tuple[str, int]]:
        """Kind of property card (OWN_PROPERTIES, "" for those that share their ids) and its id by element."""
        masses = ("CONM", "CMASS")
        rows = self.deck.elements()
        return {
            i: (OWN_PROPERTIES.get(c, ""), pid) for i, c, pid, _ in rows if pid is not None and not c.startswith(masses)
        }

    @cached_property
    def users(self) -> dict[tuple[str, int], set[int]]:
        """Elements of every property."""
        found: dict[tuple[str, int], set[int]] = {}
        for eid, key in self.property_of.items():
            found.setdefault(key, set()).add(eid)
        return found

    def fields(self, parameter: Parameter) -> list[Place] | None:
        """Those that are written; None where a value of the parameter stands in none."""
        quantity = {"k": "k1", "c": "c1"}.get(parameter.property, parameter.property)
        of = {"material": self._material, "property_id": self._property}.get(parameter.target, self._element)
        if parameter.target == "mass" or (parameter.target == "elements" and quantity == "m"):
            of = self._mass
        found: list[Place] = []
        for i in parameter.ids:
            own = of(i, quantity)
            if own is None and of == self._element:
                own = self._as_property(i, quantity, set(parameter.ids))
            if own is None:
                return None
            found += [place for place in own if place not in found]
        return found

    def _has(self, card: str, id_: int) -> bool:
        try:
            self.deck.find(card, id_)
        except DeckError:
            return False
        return True

    def _written(self, card: str, id_: int, fields: tuple[int, ...] | list[int]) -> list[Place]:
        return [(card, id_, k) for k in fields if self.deck.field_text(card, id_, k).strip()]

    def _material(self, id_: int, quantity: str) -> list[Place] | None:
        card = next((c for c in _MATERIAL if self._has(c, id_)), None)
        if card is None:
            return None
        own = self._written(card, id_, _MATERIAL[card].get(quantity, ()))
        if quantity == "eta":
            own += self._laminates_of(id_)
        return None if not own and (card, quantity) in _FOLLOWING else own

    def _laminates_of(self, material: int) -> list[Place]:
        """GE of the laminates with a ply of the `material`, which counts in place of its own."""
        found: list[Place] = []
        for pid in self.shells:
            for card in ("PCOMP", "PCOMPG"):
                if self._has(card, pid):
                    plies = [k - 1 for k in ply_fields(self.deck, card, pid)]
                    if str(material) in (self.deck.field_text(card, pid, k).strip() for k in plies):
                        found += self._written(card, pid, (8,))
        return found

    def _property(self, id_: int, quantity: str) -> list[Place] | None:
        found: list[Place] = []
        for card in (*_STRUCTURAL, "PBUSH", "PELAS", "PDAMP"):
            if self._has(card, id_):
                own = self._on_property(card, id_, quantity)
                if own is None:
                    return None
                found += own
        return found

    def _on_property(self, card: str, id_: int, quantity: str) -> list[Place] | None:
        if card in ("PCOMP", "PCOMPG"):
            return self._on_laminate(card, id_, quantity)
        if card in _STRUCTURAL and quantity in _OF_MATERIAL:
            return None  # of the material, which other properties may use
        if card in ("PBARL", "PBEAML") and quantity in _OF_BEAM:
            return None  # follows from dimensions, which other values follow from too
        if card == "PBEAM":
            return self._written(card, id_, beam_fields(self.deck, id_, quantity))
        if card == "PBUSH":
            return self._written(card, id_, bush_fields(self.deck, id_, quantity))
        if card == "PSHELL" and quantity == "t":
            corners = [
                place
                for name, eid in self.shells.get(id_, ())
                for place in self._written(name, eid, corner_fields(self.deck, name, eid) or [])
            ]
            return [*self._written(card, id_, (4,)), *corners]
        field = _PROPERTY.get(card, {}).get(quantity)
        return [] if field is None else self._written(card, id_, (field,))

    def _on_laminate(self, card: str, id_: int, quantity: str) -> list[Place] | None:
        if quantity == "eta":  # GE of the laminate, where there is one, counts in place of its materials'
            return self._written(card, id_, (8,)) or None
        if quantity in _OF_MATERIAL:
            return None
        if quantity != "t":
            return []
        # with Z0 given, thicker plies would move the middle plane about which the factor grows them
        given = self.deck.field_text(card, id_, 3).strip()
        return None if given else self._written(card, id_, ply_fields(self.deck, card, id_))

    def _element(self, id_: int, quantity: str) -> list[Place] | None:
        """Values on the element's own card, which no other element uses."""
        for card in ("CQUAD4", "CTRIA3"):
            if quantity == "t" and self._has(card, id_):
                corners = corner_fields(self.deck, card, id_)
                own = self._written(card, id_, corners or [])
                return own if own and len(own) == len(corners or ()) else None
        card_of = next((c for c, fields in _ELEMENT.items() if quantity in fields and self._has(c, id_)), None)
        return None if card_of is None else self._written(card_of, id_, (_ELEMENT[card_of][quantity],))

    def _as_property(self, id_: int, quantity: str, ids: set[int]) -> list[Place] | None:
        """Values of the element's property where all its elements are among `ids`."""
        key = self.property_of.get(id_)
        if key is None or not self.users[key] <= ids:
            return None
        cards = [c for c in ([key[0]] if key[0] else _STRUCTURAL) if self._has(c, key[1])]
        return self._on_property(cards[0], key[1], quantity) if cards else None

    def _mass(self, id_: int, quantity: str) -> list[Place] | None:
        card = next((c for c in _MASS if self._has(c, id_)), None)
        return None if card is None else self._written(card, id_, _MASS[card])
