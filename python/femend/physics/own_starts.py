"""Start values of a law of one's own, from the units and ordinary sizes of its parameters."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import product

from femend.physics.entry import Parameter, Physics
from femend.physics.shape import Shape

__all__ = ["own_shapes"]

# at most so many shapes are tried; shares of what the motion or the band suggests
MOST = 18
_SHARE, _RATE, _SIZE = (0.1, 0.3, 1.0), (0.1, 1.0, 10.0), (1.0, 0.3, 3.0)


def own_shapes(physics: Physics, amplitude: float, band: tuple[float, float]) -> list[Shape]:
    """Shapes of a law of one's own.

    Lengths and velocities start at shares of the motion (`amplitude`), times and rates around the `band` (rad/s), other
    shapes around the sizes they were registered with. The force scale is left open: a term for each parameter that
    multiplies the force by itself, or one for all that do so together.
    """
    middle = (band[0] * band[1]) ** 0.5
    forms = [p for p in physics.parameters if p.shape]
    scaled = tuple(p.name for p in physics.parameters if not p.shape)
    found = []
    for sizes in product(*(_sizes(p, amplitude, middle) for p in forms)):
        fixed = {p.name: size for p, size in zip(forms, sizes, strict=True)}
        terms, names = _terms(physics, scaled, fixed)
        found.append(Shape(physics, terms, names))
    return found[:: max(1, -(-len(found) // MOST))]


def _sizes(p: Parameter, amplitude: float, middle: float) -> tuple[float, ...]:
    if p.domain == "choice":
        return (p.typical,)
    by_unit: dict[tuple[float, float, float], tuple[tuple[float, ...], float]] = {
        (0, 1, 0): (_SHARE, amplitude),
        (0, 1, -1): (_SHARE, amplitude * middle),
        (0, 0, 1): (_RATE, 1 / middle),
        (0, 0, -1): (_RATE, middle),
    }
    shares, unit = by_unit.get(p.dims, (_SIZE, p.typical))
    if p.domain == "fraction":
        return tuple({0.25, 0.75, p.typical})
    if p.domain == "above_one":
        return tuple(1 + share * max(p.typical - 1, 0.1) for share in _SIZE)
    return tuple(share * unit for share in shares)


def _terms(
    physics: Physics, scaled: tuple[str, ...], fixed: Mapping[str, float]
) -> tuple[tuple[dict[str, float], ...], tuple[tuple[str, ...], ...]]:
    typical = {p.name: p.typical for p in physics.parameters}
    if physics.scales_together:
        return ({**{name: typical[name] for name in scaled}, **fixed},), (scaled,)
    none = dict.fromkeys(scaled, 0.0)
    return tuple({**none, name: typical[name], **fixed} for name in scaled), tuple((name,) for name in scaled)
