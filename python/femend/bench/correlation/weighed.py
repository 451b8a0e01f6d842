"""What a deck weighs, and where its centre of gravity is."""

from __future__ import annotations

from typing import Any

import numpy as np

from femend.errors import UpdatingError
from femend.estimate.updating.rigid import mass_and_centre, motions, telling_axes
from femend.model import Model
from femend.numerals import plain
from femend.units import unit_system

__all__ = ["weighed", "weighed_words"]

# a model of more DOFs is not assembled once more for this
LARGEST = 200_000
# of the model's size: coordinates nearer to 0 than this are rounding
ROUNDING = 1e-9


def weighed(model: Model) -> dict[str, Any] | None:
    """Mass and centre of gravity of the deck of `model` without its supports, with its configuration's added masses, in
    its units; None without mass, for a model of more than 200,000 DOFs, or one with scalar points, whose masses move
    in no direction, or whose GRIDs hold some of the mass for good (PS)."""
    if model.fe.n_a > LARGEST or model.is_scalar.any():
        return None
    free = model.unsupported
    M, R = free.matrices()[1], motions(free)
    products = R.T @ (M @ R)
    if products.diagonal()[:3].max() <= 0:
        return None
    try:
        found = mass_and_centre(products, axes=telling_axes(products, free.fe.total_mass()))
    except UpdatingError:
        return None
    if not np.isfinite(found["centre"]).all():
        return None
    size = float(np.ptp(free.xyz, axis=0).max())
    centre = [0.0 if abs(v) < ROUNDING * size else float(v) for v in found["centre"]]
    return {"mass": float(found["mass"][0]), "centre": centre}


def weighed_words(told: dict[str, Any] | None, units: str) -> str:
    """One sentence for a page; "" for None."""
    if told is None:
        return ""
    unit = unit_system(units)
    at = ", ".join(plain(v) for v in told["centre"])
    return (
        f" The deck weighs {plain(told['mass'])} {unit.text('mass')}, its centre of gravity is at ({at}) "
        f"{unit.text('length')}."
    )
