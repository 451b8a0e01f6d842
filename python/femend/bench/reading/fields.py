"""The fields of factors that a study lets an update change, on its deck, and which of their parts are neighbours."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from itertools import pairwise

import numpy as np

from femend import _core
from femend.errors import ModelError
from femend.estimate.updating import Unknowns, smooth
from femend.model import Model, Parameter
from femend.study.file.bench_settings import FieldSettings

__all__ = ["elements_of_parameters", "field_members", "field_parameters", "neighbours", "smoothed"]

# a field of more parts holds as many derivatives of K and M at once, and no test tells them
MOST = 500
_TARGETS = {"elements": "elements", "elements_of": "elements", "property_ids": "property_id", "materials": "material"}
# nodes that two parts have in common where they touch along an edge or a face, by the cards of their elements
_SHELLS = ("CQUAD", "CTRIA", "CSHEAR")
_SOLIDS = ("CTETRA", "CPENTA", "CPYRAM", "CHEXA")


def field_parameters(deck: _core.Deck, settings: Sequence[FieldSettings]) -> tuple[Parameter, ...]:
    """A parameter of the `deck` for each part of the fields, called by the field's name and the part's number; none for
    those of a study's own parameters.

    Raises ModelError, naming the field, for a property without elements and more parts than 500.
    """
    return tuple(
        Parameter(name, s.property, _TARGETS[s.target], (i,), s.prior_sd, s.bounds)
        for s in settings
        if s.target != "parameters"
        for i, name in _parts(deck, s)
    )


def field_members(deck: _core.Deck, s: FieldSettings) -> tuple[str, ...]:
    """Names of the parameters that the field has, in its order; raises as `field_parameters`."""
    return s.parameters if s.target == "parameters" else tuple(name for _, name in _parts(deck, s))


def _parts(deck: _core.Deck, s: FieldSettings) -> list[tuple[int, str]]:
    ids = s.ids
    if s.target == "elements_of":
        rows = deck.elements()
        for pid in s.ids:
            if not any(p == pid for _, _, p, _ in rows):
                raise ModelError(f"field {s.name!r}: no element has property {pid}; correct elements_of")
        ids = tuple(eid for eid, _, pid, _ in rows if pid in s.ids)
    if len(ids) > MOST:
        raise ModelError(
            f"field {s.name!r} has {len(ids)} parts, {MOST} at most go: give groups of elements properties of their "
            "own in the deck, and name these by property_ids"
        )
    return [(i, f"{s.name} {i}") for i in ids]


def smoothed(unknowns: Unknowns, model: Model, settings: Sequence[FieldSettings]) -> Unknowns:
    """The `unknowns` of `model` with neighbours of each field held alike, as far as they are unknowns; raises
    ModelError, naming the field, for a part that touches no other."""
    for s in settings:
        pairs = [(a, b) for a, b in neighbours(model, s) if a in unknowns.names and b in unknowns.names]
        unknowns = smooth(unknowns, pairs, s.neighbour_sd)
    return unknowns


def neighbours(model: Model, s: FieldSettings) -> list[tuple[str, str]]:
    """Pairs of parts of the field, by name, that are neighbours: each and the next where it is in order; else those
    whose elements have an edge (shells), a face (solids) or a node (others) in common. Raises ModelError for a part
    that touches no other."""
    members = field_members(model.deck, s)
    if s.in_order:
        return list(pairwise(members))
    elements = elements_of_parameters(model, members)
    kind = {eid: (_least(card), frozenset(n for n in nodes if n)) for eid, card, nodes in model.fe.elements()}
    touching = _touching(elements, kind)
    for name in members:
        if not any(name in pair for pair in touching):
            raise ModelError(
                f"field {s.name!r}: {name} touches no other part of it; leave it out, or say neighbours = "
                '"in order", each part beside the next'
            )
    return [(a, b) for a, b in touching if a in members and b in members]


def _least(card: str) -> int:
    """How many nodes elements have in common at least where they touch as such elements do."""
    return 2 if card.startswith(_SHELLS) else 3 if card.startswith(_SOLIDS) else 1


def _touching(
    elements: Mapping[str, frozenset[int]], kind: Mapping[int, tuple[int, frozenset[int]]]
) -> list[tuple[str, str]]:
    """Pairs of parts of which some element touches one of the other."""
    at: dict[int, list[tuple[str, int]]] = defaultdict(list)
    for name, own in elements.items():
        for eid in own:
            for node in kind[eid][1]:
                at[node].append((name, eid))
    order = {name: i for i, name in enumerate(elements)}
    found: set[tuple[str, str]] = set()
    for there in at.values():
        for name, eid in there:
            for other, oid in there:
                if order[name] < order[other] and (name, other) not in found:
                    (least, nodes), (also, others) = kind[eid], kind[oid]
                    if len(nodes & others) >= min(least, also):
                        found.add((name, other))
    return sorted(found, key=lambda pair: (order[pair[0]], order[pair[1]]))


def elements_of_parameters(model: Model, names: Sequence[str]) -> dict[str, frozenset[int]]:
    """The elements whose matrices each parameter of these `names` changes.

    Those of a material are told by one element of each kind and property: all of them have it, or none.
    """
    index = {p.name: i for i, p in enumerate(model.parameters)}
    property_of = {eid: pid for eid, _, pid, _ in model.deck.elements()}
    there = [(eid, card) for eid, card, _ in model.fe.elements() if eid]
    out = {}
    for name in names:
        p = model.parameters[index[name]]
        if p.target in ("elements", "mass"):
            own = {eid for eid, _ in there if eid in p.ids}
        elif p.target == "property_id":
            own = {eid for eid, _ in there if property_of.get(eid) in p.ids}
        else:
            kinds: dict[tuple[int | None, str], bool] = {}
            own = set()
            for eid, card in there:
                key = (property_of.get(eid), card)
                if key not in kinds:
                    kinds[key] = _changes(model, eid, index[name])
                if kinds[key]:
                    own.add(eid)
        out[name] = frozenset(own)
    return out


def _changes(model: Model, eid: int, i: int) -> bool:
    """Whether parameter number `i` changes the stiffness or mass of an element."""
    ones = np.ones(len(model.parameters))
    more = np.where(np.arange(len(ones)) == i, 2.0, 1.0)
    before, after = (model.fe.element_matrices(eid, x)[1:] for x in (ones, more))
    return any(not np.allclose(a, b, rtol=1e-9, atol=0.0) for a, b in zip(before, after, strict=True))
