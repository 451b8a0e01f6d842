"""Bulk-data cards of linear laws that lose energy: an oscillator, a spring that relaxes, one with a loss factor."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

__all__ = ["Ids", "damped_cards"]


@dataclass(frozen=True, slots=True)
class Ids:
    """The first ids that a deck has free for an `element`, a `property` and a scalar `point`."""

    element: int
    property: int
    point: int


def damped_cards(
    ids: Ids,
    physics: str,
    values: Mapping[str, float],
    at: tuple[int, int],
    to: tuple[int, int] | None = None,
    *,
    mass: float = 1.0,
) -> list[str]:
    """Cards of the law `physics` between the DOF `at` and the DOF `to` (node, component), or ground; none where scalar
    elements do not make it. `mass` is what a mass of 1 on a card is in the unit of `values` (`mass_of_card`).

    The mass of an oscillator and the inner end of what relaxes (spring k1 before a dashpot k1 tau, beside k0) are a
    scalar point; a loss factor is GE of CELAS2 (Nastran Quick Reference Guide: SPOINT, CMASS2, CELAS2, CDAMP2).
    """
    id_, here, there = ids.element, _end(at), _end(to)
    if physics == "tuned_absorber" and to is None:
        return [
            f"SPOINT,{ids.point}",
            f"CMASS2,{id_},{values['m'] / mass:.6E},{ids.point}",
            f"CELAS2,{id_ + 1},{values['k']:.6E},{here},{ids.point}",
            f"CDAMP2,{id_ + 2},{values['c']:.6E},{here},{ids.point}",
        ]
    if physics == "viscoelastic" and {"k0", "k1", "tau"} <= set(values):
        inner = f"SPOINT,{ids.point}"
        held = [f"CELAS2,{id_},{values['k0']:.6E},{here},{there}".rstrip(",")] if values["k0"] else []
        return [
            *held,
            inner,
            f"CELAS2,{id_ + 1},{values['k1']:.6E},{here},{ids.point}",
            f"CDAMP2,{id_ + 2},{values['k1'] * values['tau']:.6E},{ids.point},,{there}".rstrip(","),
        ]
    if physics == "structural_damping" and {"k", "eta"} <= set(values):
        return [f"CELAS2,{id_},{values['k']:.6E},{here},{there or ','},{values['eta']:.6E}"]
    return []


def _end(dof: tuple[int, int] | None) -> str:
    """Node and component as fields of a card; nothing for ground."""
    return "" if dof is None else f"{dof[0]},{dof[1]}"
