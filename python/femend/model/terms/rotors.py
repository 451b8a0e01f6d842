"""The rotors that a deck declares, as parts that spin."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from femend import _core
from femend.model.cards.rotor_cards import RotorCards, rotor_cards
from femend.model.terms.spinning import SpinningPart
from femend.numerals import listed, plain

__all__ = ["Rotor", "Rotors", "deck_rotors"]

FloatArray = NDArray[np.float64]

# what has a polar inertia on a rotor's line
_TURNING = ("CBAR", "CBEAM", "CONM1", "CONM2")
# grids count as on a line up to this share of its length, directions as along one another from this cosine on
ON_LINE, ALONG = 1e-3, 0.999


@dataclass(frozen=True, slots=True)
class Rotor:
    """A rotor: its `number`, unit vector `axis` about which it turns by the right hand (basic system), speed in those
    of the reference rotor, `ratio`, and ids of the beams and concentrated masses on its grids, `elements`."""

    number: int
    axis: tuple[float, float, float]
    ratio: float
    elements: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Rotors:
    """The rotors of a deck, that of reference first, and a sentence for each thing about them that is not clear."""

    rotors: tuple[Rotor, ...] = ()
    warnings: tuple[str, ...] = ()

    def parts(self, shaft: Sequence[float] | None = None) -> tuple[SpinningPart, ...]:
        """The rotors as parts of a machine whose speed is that of the shaft along the direction `shaft` (3,), positive
        about it by the right hand; without it that of the reference rotor about its own axis.

        The shaft is that of the reference rotor, or where this one lies another way the first along it; empty where
        none lies along `shaft`.
        """
        if not self.rotors:
            return ()
        turned = self.rotors[0].ratio
        if shaft is not None:
            along = [float(np.dot(r.axis, shaft)) / float(np.linalg.norm(shaft)) for r in self.rotors]
            at = next((i for i, cosine in enumerate(along) if abs(cosine) > ALONG), None)
            if at is None or self.rotors[at].ratio == 0.0:
                return ()
            turned = self.rotors[at].ratio * float(np.sign(along[at]))
        return tuple(SpinningPart(r.axis, r.elements, r.ratio / turned) for r in self.rotors if r.ratio)


def deck_rotors(deck: _core.Deck) -> Rotors:
    """The rotors that the cards of a `deck` declare (`rotor_cards`); those that cannot turn are told and left out.

    As in Nastran the mass on the grids of a rotor turns with it and no other does; unlike there, a CBAR has a polar
    inertia. Raises DeckError as the reading of coordinates and elements does.
    """
    cards, told = rotor_cards(deck)
    if not cards:
        return Rotors((), tuple(told))
    xyz = dict(zip(deck.node_ids.tolist(), deck.xyz, strict=True))
    rows = [(eid, nodes) for eid, card, _, nodes in deck.elements() if card in _TURNING]
    found = []
    for one in cards:
        who = f"rotor {one.number}"
        lacking = [n for n in (*one.grids, *(one.ends or ())) if n not in xyz]
        if lacking:
            told.append(f"{who} names grids that are not there ({listed(lacking, 4)}); it is taken at rest")
            continue
        grids = set(one.grids)
        elements = tuple(sorted({eid for eid, nodes in rows if nodes and grids.issuperset(nodes)}))
        if not elements:
            told.append(
                f"no beam and no concentrated mass stands on the {len(grids)} grids of {who}: nothing of it turns; "
                "name the grids of its line in ROTORG"
            )
            continue
        axis = _axis(who, one, xyz, told)
        if axis is not None:
            found.append(Rotor(one.number, (float(axis[0]), float(axis[1]), float(axis[2])), one.ratio, elements))
    return Rotors(tuple(found), tuple(told))


def _axis(who: str, one: RotorCards, xyz: dict[int, FloatArray], told: list[str]) -> FloatArray | None:
    """Unit vector along a rotor's line in its positive sense; None, and a sentence, where there is none."""
    points = np.array([xyz[n] for n in one.grids])
    away = points - points.mean(axis=0)
    size = float(np.linalg.norm(away, axis=1).max())
    said = None
    if one.ends is not None:
        said = xyz[one.ends[1]] - xyz[one.ends[0]]
    elif one.along is not None:
        said = np.asarray(one.along)
    if said is not None and not np.any(said):
        told.append(f"{who}: the two grids that tell its sense lie at one place; it is taken at rest")
        return None
    if size == 0.0:
        if said is None:
            told.append(f"{who}: one place has no direction, and no card says one (RSPINR); it is taken at rest")
            return None
        return np.asarray(said / np.linalg.norm(said))
    line = np.linalg.svd(away)[2][0]
    off = np.linalg.norm(away - np.outer(away @ line, line), axis=1)
    if off.max() > ON_LINE * size:
        farthest, by = one.grids[int(off.argmax())], plain(float(off.max()), 3)
        told.append(f"{who}: its grids do not lie on a line, grid {farthest} is {by} off; it is taken at rest")
        return None
    if said is None:
        told.append(
            f"{who}: no card tells the sense in which it turns (RSPINR, ROTORD); from grid {one.grids[0]} to "
            f"{one.grids[-1]} is taken as positive"
        )
        said = points[-1] - points[0]
    cosine = float(said @ line) / float(np.linalg.norm(said))
    if abs(cosine) < ALONG:
        angle = plain(np.degrees(np.arccos(min(abs(cosine), 1.0))), 2)
        told.append(f"{who}: its positive sense is given {angle}° from the line of its grids; the line counts")
        if cosine == 0.0:
            return None
    return np.asarray(np.sign(cosine) * line)
