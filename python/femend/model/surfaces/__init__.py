"""Faces of shells and solids: sensors, pressures and morphs on them."""
