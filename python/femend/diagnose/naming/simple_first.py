"""The simpler of laws that do about as well: it goes first where a richer one does not clearly beat it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from femend.diagnose.evidence import fall
from femend.diagnose.fitting.candidates import Candidate
from femend.diagnose.naming.ranked import Ranked
from femend.diagnose.settings import Settings
from femend.model import Place

__all__ = ["simple_first", "simplest_linear"]

# a law that leaves at most so many times what another leaves does as well
NEARLY = 1.15
# exponent n from which the knee of a Bouc-Wen loop is so near to that of friction with a spring before it that what
# else is wrong with the model may round it (materials and joints have 1 to 3)
KNEE = 4.0


def simple_first(ranked: list[Ranked], settings: Settings) -> list[Ranked]:
    """Puts the best linear law before nonlinear ones that leave hardly less: what is wrong with the rest of the
    model gives a law with more freedom that much by itself."""
    ranked = simplest_linear(_friction_first(ranked), settings)
    linear = next((r for r in ranked if not r.candidate.nonlinear), None)
    if linear is None or linear is ranked[0]:
        return ranked
    worth = float(np.exp(-settings.gain_nonlinear))
    reach = [r for r in ranked if r.candidate.nonlinear and r.candidate.chosen < worth * linear.candidate.chosen]
    if any(r.score < linear.score for r in reach):
        return ranked
    # they lack as much evidence as a law has to bring
    enough = linear.score + settings.gain_cost
    behind = [replace(r, score=max(r.score, enough)) if r.candidate.nonlinear else r for r in ranked if r is not linear]
    return [linear, *sorted(behind, key=lambda r: r.score)]


def simplest_linear(ranked: list[Ranked], settings: Settings) -> list[Ranked]:
    """Puts a linear law with fewer parameters before the best one at the same place, and a spring to ground before a
    bedding that holds its node, where this does not bring against it what a law has to bring against none.

    Two laws of several parameters of which neither contains the other, a loss factor and a relaxation, are told apart
    by their scores: what is wrong with the rest of the model gives neither of them anything by itself.
    """
    for r in ranked:
        first = next((f for f in ranked if not f.candidate.nonlinear), None)
        if first is None or r.candidate.nonlinear:
            continue
        simpler = _same_place(r.located.place, first.located.place) and _simpler(r.candidate, first.candidate)
        if (simpler or _part_of(r, first)) and not _won(first, r, settings):
            ahead = replace(r, score=first.score)
            # what the other lacks of the evidence that a law has to bring; a bedding is no other law
            lacks = max(settings.gain_cost - (r.score - first.score), 0.0) if simpler else 0.0
            behind = [replace(f, score=f.score + lacks) if f is first else f for f in ranked if f is not r]
            ranked = sorted([ahead, *behind], key=lambda o: o.score)
    return ranked


def _simpler(law: Candidate, rich: Candidate) -> bool:
    """Whether a law has fewer parameters than another, and only one or those of a limit of the other.

    On calibration cases (seed 98) a relaxation scored better than a loss factor by 21 to 374 on eight of nine supports
    and joints that relax (worse by 5 on the ninth, near the noise), and a loss factor by 4 to 94 on all eleven of its.
    """
    if law.n_law >= rich.n_law:
        return False
    if law.n_law == 1 or law.physics is None or rich.physics is None or law.physics is rich.physics:
        return True
    return law.name in rich.physics.simpler


def _won(rich: Ranked, simple: Ranked, settings: Settings) -> bool:
    """Whether a law brings against a simpler one what a law has to bring."""
    less = fall(simple.candidate.chosen, rich.candidate.chosen)
    relieved = simple.candidate.prior - rich.candidate.prior
    return settings.wins(simple.score - rich.score, less, relieved)


def _part_of(spring: Ranked, bedding: Ranked) -> bool:
    """Whether one law is a spring to ground at a node that the other, a bedding, holds along the same direction."""
    at, bed = spring.located.place, bedding.located.place
    holds = spring.candidate.name == "support_stiffness" and at.kind == "ground" and at.direction == bed.direction
    return holds and not set(at.nodes).isdisjoint(bed.bed_nodes)


def _same_place(a: Place, b: Place) -> bool:
    """Whether laws at two places can stand for each other: it is one place, or one clamp of which one is on springs."""
    return a is b or (bool(a.springs or b.springs) and a.kind == b.kind and a.nodes == b.nodes)


def _friction_first(ranked: list[Ranked]) -> list[Ranked]:
    """Puts friction before a Bouc-Wen loop at the same place whose knee is nearly as sharp and that leaves hardly
    less."""
    if not ranked or ranked[0].candidate.name != "bouc_wen" or ranked[0].candidate.values["n"] <= KNEE:
        return ranked
    loop = ranked[0]
    for r in ranked[1:]:
        same = r.candidate.name == "coulomb_friction" and r.located.place is loop.located.place
        if same and r.candidate.chosen < NEARLY * loop.candidate.chosen:
            first = replace(r, score=loop.score)
            return [first, *(other for other in ranked if other is not r)]
    return ranked
