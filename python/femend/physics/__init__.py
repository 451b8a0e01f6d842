"""The catalogue of missing physics: names, families, parameters with units, fit coordinates, start values, limits."""

from __future__ import annotations

from femend.physics.catalogue import CATALOGUE, FAMILIES, Parameter, Physics, catalogue, physics, selected
from femend.physics.classify import CLASSES, Classified, classify
from femend.physics.free_form import FreeForm, fit_free_form, roughness
from femend.physics.nested import companion_jacobian, simpler, with_companion
from femend.physics.own import register
from femend.physics.rotor import SpeedStiffness, gyroscopic_matrix, receptance_with_pair
from femend.physics.shape import Shape
from femend.physics.starts import linear_sizes, nearby, shapes
from femend.physics.surrogate import PARTS, Surrogate, surrogate_start
from femend.physics.transform import FitCoordinates

__all__ = [
    "companion_jacobian",
    "CATALOGUE",
    "CLASSES",
    "FAMILIES",
    "PARTS",
    "Classified",
    "FitCoordinates",
    "FreeForm",
    "Parameter",
    "Physics",
    "Shape",
    "SpeedStiffness",
    "Surrogate",
    "catalogue",
    "classify",
    "fit_free_form",
    "gyroscopic_matrix",
    "linear_sizes",
    "nearby",
    "physics",
    "receptance_with_pair",
    "register",
    "roughness",
    "selected",
    "shapes",
    "simpler",
    "surrogate_start",
    "with_companion",
]
