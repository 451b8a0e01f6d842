"""The positions that a study lets an update change, on its deck."""

from __future__ import annotations

from collections.abc import Sequence

from femend.errors import FemendError
from femend.model import Model, Morph, grown, joint_moved, nodes_moved, offset_along_normal
from femend.study.file.bench_settings import MorphSettings

__all__ = ["morphs_on"]


def morphs_on(model: Model, settings: Sequence[MorphSettings]) -> tuple[Morph, ...]:
    """The morphs of ``[[updating.morph]]`` on `model`; raises ModelError, with the morph's name, for nodes, elements
    and properties that the deck does not have."""
    found = []
    for s in settings:
        try:
            found.append(_morph(model, s))
        except FemendError as error:
            error.add_note(f"in [[updating.morph]] {s.name!r}")
            raise
    return tuple(found)


def _morph(model: Model, s: MorphSettings) -> Morph:
    if s.move == "joint":
        assert s.direction is not None
        return joint_moved(model, s.name, s.prior_sd, s.nodes, s.direction, s.held, bounds=s.bounds)
    if s.move == "nodes":
        assert s.direction is not None
        assert s.radius is not None
        return nodes_moved(model, s.name, s.prior_sd, s.nodes, s.direction, s.radius, held=s.held, bounds=s.bounds)
    if s.move == "offset":
        return offset_along_normal(
            model, s.name, s.prior_sd, properties=s.properties, elements=s.elements, bounds=s.bounds
        )
    if s.move == "growth":
        assert s.point is not None
        return grown(model, s.name, s.prior_sd, s.nodes, s.point, axis=s.axis, along=s.along, bounds=s.bounds)
    return Morph.of(s.name, dict(s.vectors), s.prior_sd, s.bounds)
