"""Which beams of a deck are too long for the waves of a band, and are cut where its mesh is refined.

What beams leave out of their waves puts frequencies off, which can be taken off mode by mode (`form_errors`), and
shapes, which cannot: neighbouring modes mix by the error over the distance of their frequencies, several times as much
as either frequency is off, and a sensor near a node of a mode shows several times as much again. Cut in two, a beam of
consistent mass leaves a sixteenth of it, one of lumped mass a quarter.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from femend.model.free_body import is_elastic
from femend.model.mesh.form_errors import COUNTS, MODE_SD
from femend.model.mesh.refined import held_inside
from femend.model.model import Model
from femend.model.places.places import held_rows
from femend.model.reduced.beam_waves import beam_errors, beam_of
from femend.model.reduced.reduction import core_modes

__all__ = ["coarse_beams"]

FloatArray = NDArray[np.float64]

# cards of beams that bend; a rod that is cut is a mechanism
_BENDING = ("CBAR", "CBEAM")
# of the diagonal of an end's stiffness what is none
NONE = 1e-9


def coarse_beams(model: Model, f_max: float) -> frozenset[int]:
    """Ids of the beams that put a mode up to `f_max` (Hz) off by more than half of what a diagnosis allows a mode, at
    the deck's values: all but those that together do not count. Empty where no mode is off by as much."""
    bending = {eid for eid, card, _ in model.fe.elements() if eid and card in _BENDING}
    if not bending:
        return frozenset()
    freq, phi = core_modes(*model.matrices(), f_max)
    elastic = is_elastic(freq)
    omega, V = 2 * np.pi * freq[elastic], np.asarray(model.transformation() @ phi[:, elastic])
    total: FloatArray = np.zeros(len(omega))
    most: dict[int, float] = {}
    for eid, error, _ in beam_errors(model, V, np.eye(len(omega)), omega):
        if eid in bending:
            total += error
            most[eid] = most.get(eid, 0.0) + float(np.abs(error).max(initial=0.0))
    if not (np.abs(total) > MODE_SD / 2).any():
        return frozenset()
    order = sorted(most, key=lambda eid: most[eid])
    little = np.cumsum([most[eid] for eid in order]) < COUNTS * MODE_SD
    long = {eid for eid, out in zip(order, little, strict=True) if not out}
    held = held_rows(model)
    return frozenset(
        eid for eid, card, nodes in model.fe.elements() if eid in long and _resists(model, eid, card, nodes, held)
    )


def _resists(model: Model, eid: int, card: str, nodes: Sequence[int], held: NDArray[np.bool_]) -> bool:
    """Whether either end of a beam, let go, is held by the other one in all that its middle is free to do: pins and
    sections without a stiffness would leave a middle of it loose."""
    beam = beam_of(model, eid, card, nodes)
    if beam is None:
        return False
    free = ~held_inside(model, nodes[:2], held)
    for node in nodes[:2]:
        own = (beam.rows // 6 == model.index(node)) & free[beam.rows % 6]
        K = beam.K[np.ix_(own, own)]
        size = np.sqrt(np.maximum(np.diag(K), 0.0))
        if own.sum() < free.sum() or not size.all():
            return False
        if own.any() and np.linalg.eigvalsh(K / np.outer(size, size))[0] < NONE:
            return False
    return True
