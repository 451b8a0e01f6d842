"""The rivals that may be missing in a configuration, each as a term."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from femend.diagnose.staged.nodes import on_the_line
from femend.diagnose.staged.places import masses_and_springs, places_tried, untaken
from femend.diagnose.staged.setup import Setup
from femend.dof import Dof
from femend.model.terms.linear_terms import LinearTerm, compliant_support, spring_bending, weaker_element
from femend.model.terms.speed_terms import disc_at_node, member_over_speed, rotor_between, springs_over_speed

__all__ = ["rivals", "speed_rivals"]

# members whose stiffness may be another; shells and solids are too many and too alike
MEMBERS = ("CBUSH", "CBAR", "CBEAM", "CROD", "CELAS1", "CELAS2")


def rivals(
    setup: Setup, configuration: str, sensors: Sequence[Dof], taken: Sequence[LinearTerm], *, only_here: bool
) -> tuple[LinearTerm, ...]:
    """Terms that may explain what the recordings of `configuration` leave, without those `taken`.

    Supports that give, springs that bend, members with another stiffness, and masses and springs to ground at the
    nodes of the sensors (`places.elsewhere` has those at other nodes). With `only_here` they exist in this
    configuration alone (one before it did without them); supports always do, bending never: what a spring is made of
    does not change with its mounting.
    """
    free, limit = setup.free, setup.settings.most_places
    found: list[LinearTerm] = []
    for region in setup.regions[configuration]:
        for i, spread in enumerate(region.spread()):
            term = compliant_support(free, spread, setup.omega, setup.zeta)
            term = replace(term, label=f"{term.label}, spread to tilt as on a layer") if i else term
            found.append(term.only_in(configuration) if len(setup.configurations) > 1 else term)
    found += [spring_bending(free, group) for group in setup.bushes]
    local: list[LinearTerm] = []
    members = [eid for eid, card, _, _ in free.deck.elements() if card in MEMBERS][:limit]
    local += [weaker_element(free, eid) for eid in members]
    local += masses_and_springs(setup, places_tried(setup, configuration, sensors)[0])
    found += [term.only_in(configuration) if only_here else term for term in local]
    return untaken(found, taken)


def speed_rivals(
    setup: Setup, bearings: Sequence[int], axis: int, reference: float, taken: Sequence[LinearTerm]
) -> tuple[LinearTerm, ...]:
    """Terms that act with the speed of a shaft along `axis` (0, 1, 2) in `bearings`, without those `taken`.

    Gyroscopic moments of a rotor between the bearings, of discs at them and at masses on the shaft's line; springs of
    a property, along each axis and along all, and members, whose stiffness changes up to `reference` rad/s.
    """
    free, limit = setup.free, setup.settings.most_places
    xyz = free.xyz_of
    along = [float(xyz[n][axis]) for n in bearings]
    found = [rotor_between(free, bearings, axis, reference)] if max(along) > min(along) else []
    found += [disc_at_node(free, n, axis, reference) for n in _on_shaft(setup, bearings, axis)]
    for group in setup.bushes:
        found += [springs_over_speed(free, group, i, reference) for i in (None, 0, 1, 2)]
    members = [eid for eid, card, _, _ in free.deck.elements() if card in MEMBERS][:limit]
    found += [member_over_speed(free, eid, reference) for eid in members]
    return untaken(found, taken)


def _on_shaft(setup: Setup, bearings: Sequence[int], axis: int) -> list[int]:
    """Bearings, and nodes with masses on the line through the first one along the shaft, that can turn."""
    free = setup.free
    masses = [n for _, card, _, nodes in free.deck.elements() if card == "CONM2" for n in nodes[:1]]
    on_line = on_the_line(setup, masses, bearings[0], axis)
    T = free.transformation()
    turning = [3 + (axis + 1) % 3, 3 + (axis + 2) % 3]
    nodes = dict.fromkeys([*bearings, *on_line])
    return [n for n in nodes if all(T[[6 * free.index(n) + c]].nnz for c in turning)]
