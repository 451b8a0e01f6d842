"""Faces of shells and solids: sensors, pressures and morphs on them."""

from femend.model.surfaces.faces import surface_of
from femend.model.surfaces.pressure import polynomial_patterns

__all__ = ["polynomial_patterns", "surface_of"]
