"""What spinning parts of a deck have to be for an update."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from femend.errors import UpdatingError
from femend.model import Model
from femend.model.terms.spinning import SpinningPart, gyroscopic

__all__ = ["check_parts"]


def check_parts(model: Model, parts: Sequence[SpinningPart]) -> None:
    """Raises UpdatingError for parts of the `model` in turning axes, that are no elements of it, or without polar
    inertia, and what `gyroscopic_matrices` raises."""
    there = {int(eid) for eid, _, _ in model.fe.elements()}
    for i, part in enumerate(parts, start=1):
        who = f"spinning part {i} of {len(parts)}"
        if part.axes != "fixed":
            raise UpdatingError(
                f"{who} is described in {part.axes} axes, but the sensors stand still; take axes='fixed'"
            )
        strange = [e for e in part.elements or () if e not in there]
        if strange:
            raise UpdatingError(
                f"{who} names {len(strange)} elements that the deck does not have: {strange[:8]}; name beams and "
                "concentrated masses of the deck"
            )
        if not np.any(gyroscopic(model, [part], np.ones(len(model.parameters)))):
            raise UpdatingError(
                f"{who} has no polar inertia about {part.axis}: nothing of it acts with the speed; give the beams rho "
                "and I1, I2, the masses their inertia"
            )
