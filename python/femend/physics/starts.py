"""Start values: for each law a small grid of shapes, the force scale left to a regression on the recovered force."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from itertools import product

import numpy as np

from femend import _core
from femend.errors import LawParameterError
from femend.physics.entry import Physics
from femend.physics.own_starts import own_shapes
from femend.physics.shape import Shape, single
from femend.physics.starts_extended import EXTENDED_STARTS, extended_shapes

__all__ = ["Shape", "linear_sizes", "nearby", "shapes"]

# in units of the largest motion; of a stiff stop that peaks alone reach, hardly less than that, of a play that every
# resonance of a sweep goes through, far less
_GAP = (0.03, 0.1, 0.25, 0.45, 0.7, 0.9)
# gaps and slips between two of these, in units of the lower one
_BETWEEN = (0.75, 0.87, 1.15, 1.3)
_SLIP = (0.03, 0.1, 0.25, 0.5)
_EXPONENT = (1.1, 2.0)
_RATIO = (0.0, 0.6)
_LOSS = (0.02, 0.1, 0.3)


def shapes(physics: Physics, *, amplitude: float, band: tuple[float, float], speed: float | None = None) -> list[Shape]:
    """Shapes of a law worth a regression.

    `amplitude` is the largest displacement of the coordinate in the records (the model's length unit, or rad), `band`
    the lowest and highest circular frequency of the fit (rad/s), `speed` the largest velocity where it is known. Raises
    LawParameterError for a physics without a law and ValueError for an amplitude or band that is not positive.

    >>> from femend.physics import physics
    >>> grid = shapes(physics("clearance"), amplitude=1.0, band=(10, 100))
    >>> [shape.terms[0]["gap"] for shape in grid][:4]
    [0.03, 0.1, 0.25, 0.45]
    """
    if not (amplitude > 0 and 0 < band[0] < band[1]):
        raise ValueError(
            f"amplitude = {amplitude:g}, band = {band}; give a positive amplitude and a rising band in rad/s"
        )
    if physics.law is None:
        raise LawParameterError(f"{physics.name} is not the law of a joint and has no start values", law=physics.name)
    low, high = band
    middle = (low * high) ** 0.5
    one = partial(single, physics)
    match physics.law:
        case "clearance":
            grid = product((1.0, -1.0, 2.0), _GAP)
            return [one({"k": 1.0, "gap": gap * amplitude, "sides": sides}, "k") for sides, gap in grid]
        case "coulomb_friction":
            return [one({"f": slip * amplitude, "kt": 1.0}, "f", "kt") for slip in _SLIP]
        case "bouc_wen":
            grid3 = product(_SLIP, _EXPONENT, _RATIO)
            return [one(_bouc_wen(slip * amplitude, n, ratio), "k") for slip, n, ratio in grid3]
        case "viscoelastic":
            taus = [f / middle for f in (0.1, 0.3, 1.0, 3.0, 10.0)]
            return [_viscoelastic(physics, tau) for tau in taus]
        case "tuned_absorber":
            steps = 8
            tuned = [low * (high / low) ** ((i + 0.5) / steps) for i in range(steps)]
            return [
                one({"m": 1.0, "k": omega**2, "c": 2 * loss * omega}, "m", "k", "c")
                for omega, loss in product(tuned, (0.01, 0.05))
            ]
        case "structural_damping":
            return [one({"k": 1.0, "eta": eta}, "k") for eta in _LOSS]
        case "bilinear_stiffness":
            sides = ({"k_plus": 1.0, "k_minus": 0.0}, {"k_plus": 0.0, "k_minus": 1.0})
            return [Shape(physics, sides, (("k_plus",), ("k_minus",)))]
        case _ if physics.extended and physics.law in EXTENDED_STARTS:
            return extended_shapes(physics, amplitude, band, amplitude * middle if speed is None else speed)
        case _ if len(physics.parameters) == 1:
            (name,) = physics.parameter_names
            return [one({name: 1.0}, name)]
        case _:
            return own_shapes(physics, amplitude, band)


def nearby(shape: Shape) -> list[Shape]:
    """The same shape of a stop or of friction with its gap or slip between those of `shapes`, which are far apart
    beside how well a regression tells them; nothing of other laws."""
    own = {"clearance": "gap", "coulomb_friction": "f"}.get(shape.physics.law or "")
    if own is None:
        return []
    return [
        Shape(shape.physics, tuple({**term, own: factor * term[own]} for term in shape.terms), shape.scaled)
        for factor in _BETWEEN
    ]


def linear_sizes(physics: Physics, stiffness: Sequence[float], band: tuple[float, float]) -> list[dict[str, float]]:
    """Parameter values of a linear law at which its force in the band is that of springs of these sizes.

    For fits on spectral lines, where no regression on a force is needed: every shape of the law at each of `stiffness`
    (N/m), its terms sharing it alike; `band` as for `shapes`. Raises LawParameterError for a law that is not linear.

    >>> from femend.physics import physics
    >>> [round(p["c"]) for p in linear_sizes(physics("fractional"), [1e4], (50.0, 200.0))]
    [1991, 792, 315, 126]
    """
    if physics.kind != "linear":
        raise LawParameterError(f"{physics.name} is not linear; use shapes", law=physics.name)
    middle = np.array([1j * (band[0] * band[1]) ** 0.5])
    out = []
    for shape in shapes(physics, amplitude=1.0, band=band):
        sizes = [
            abs(complex(_core.law_dynamic_stiffness(physics.law or physics.name, dict(term), middle)[0][0]))
            for term in shape.terms
        ]
        out += [shape.values([k / len(sizes) / size for size in sizes]) for k in stiffness]
    return out


def _bouc_wen(slip: float, n: float, ratio: float) -> dict[str, float]:
    """alpha = 0: the share of the force without hysteresis is the linear companion's."""
    total = slip**-n
    return {"k": 1.0, "alpha": 0.0, "n": n, "beta": total / (1 + ratio), "gamma": ratio * total / (1 + ratio)}


def _viscoelastic(physics: Physics, tau: float) -> Shape:
    terms = ({"k0": 1.0, "k1": 0.0, "tau": tau}, {"k0": 0.0, "k1": 1.0, "tau": tau})
    return Shape(physics, terms, (("k0",), ("k1",)))
