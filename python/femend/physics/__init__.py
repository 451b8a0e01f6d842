"""The catalogue of missing physics: names, families, parameters with units, fit coordinates, start values, limits."""

from __future__ import annotations

from femend.physics.catalogue import CATALOGUE, FAMILIES, Parameter, Physics, catalogue, physics, selected
from femend.physics.nested import simpler, with_companion
from femend.physics.own import register
from femend.physics.starts import Shape, shapes
from femend.physics.transform import FitCoordinates

__all__ = [
    "CATALOGUE",
    "FAMILIES",
    "FitCoordinates",
    "Parameter",
    "Physics",
    "Shape",
    "catalogue",
    "physics",
    "register",
    "selected",
    "shapes",
    "simpler",
    "with_companion",
]
