"""The rivals that may be missing in a configuration, each as a term."""

from __future__ import annotations

from collections.abc import Sequence

from femend.diagnose.staged.setup import Setup
from femend.dof import Dof
from femend.model.linear_terms import (
    LinearTerm,
    compliant_support,
    point_mass,
    point_spring,
    spring_bending,
    weaker_element,
)

__all__ = ["rivals"]

# members whose stiffness may be another; shells and solids are too many and too alike
MEMBERS = ("CBUSH", "CBAR", "CBEAM", "CROD", "CELAS1", "CELAS2")


def rivals(
    setup: Setup, configuration: str, sensors: Sequence[Dof], taken: Sequence[LinearTerm], *, only_here: bool
) -> tuple[LinearTerm, ...]:
    """Terms that may explain what the recordings of `configuration` leave, without those `taken`.

    Supports that give, springs that bend, members with another stiffness, and masses and springs to ground at the
    nodes of the sensors. With `only_here` they exist in this configuration alone (one before it did without them);
    supports always do, bending never: what a spring is made of does not change with its mounting.
    """
    free, limit = setup.free, setup.settings.most_places
    scale = free.fe.total_mass()
    found: list[LinearTerm] = []
    for region in setup.regions[configuration]:
        term = compliant_support(free, region, setup.omega, setup.zeta)
        found.append(term.only_in(configuration) if len(setup.configurations) > 1 else term)
    found += [spring_bending(free, group) for group in setup.bushes]
    local: list[LinearTerm] = []
    members = [eid for eid, card, _, _ in free.deck.elements() if card in MEMBERS][:limit]
    local += [weaker_element(free, eid) for eid in members]
    nodes = list(dict.fromkeys(setup.pairing[d].dof.node for d in sensors))[:limit]
    held = {n for region in setup.regions[configuration] for n in region.nodes}
    loose = [n for n in nodes if n not in held]
    local += [point_mass(free, n, 0.02 * scale) for n in loose]
    local += [point_spring(free, n, c, 0.02 * scale * setup.omega**2) for n in loose for c in (1, 2, 3)]
    found += [term.only_in(configuration) if only_here else term for term in local]
    names = {t.name for t in taken}
    return tuple(t for t in found if t.name not in names)
