"""Start values: for each law a small grid of shapes, the force scale left to a regression on the recovered force."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import combinations, product

from femend.errors import LawParameterError
from femend.physics.entry import Physics
from femend.physics.own_starts import own_shapes

__all__ = ["Shape", "shapes"]

_GAP = (0.1, 0.25, 0.45, 0.7)
_SLIP = (0.03, 0.1, 0.25, 0.5)
_EXPONENT = (1.1, 2.0)
_RATIO = (0.0, 0.6)
_LOSS = (0.02, 0.1, 0.3)
_POWER = (0.2, 0.4, 0.6, 0.8)
_KNEE = (0.1, 0.3, 1.0, 3.0)
_PRELOAD = (0.05, 0.2, 0.45, 0.7)
_PLAY = (0.05, 0.2, 0.45)
_GROWTH = (3.0, 30.0)


@dataclass(frozen=True, slots=True)
class Shape:
    """A law with its force scale left open.

    The force is the sum over `terms` of a factor times the force of the law with that term's values; `values(factors)`
    puts the fitted factors back. Laws that are linear in several parameters (Zener at a given tau, bilinear) have as
    many terms.
    """

    physics: Physics
    terms: tuple[Mapping[str, float], ...]
    scaled: tuple[tuple[str, ...], ...]

    def values(self, factors: tuple[float, ...] | list[float]) -> dict[str, float]:
        """Parameter values for one fitted factor a term; raises LawParameterError for another number of `factors`."""
        if len(factors) != len(self.terms):
            raise LawParameterError(
                f"{self.physics.name} has {len(self.terms)} force scales here, {len(factors)} were given",
                law=self.physics.name,
            )
        out = dict(self.terms[0])
        for term, names, factor in zip(self.terms, self.scaled, factors, strict=True):
            for name in names:
                out[name] = term[name] * factor
        return out


def shapes(physics: Physics, *, amplitude: float, band: tuple[float, float], speed: float | None = None) -> list[Shape]:
    """Shapes of a law worth a regression.

    `amplitude` is the largest displacement of the coordinate in the records (the model's length unit, or rad), `band`
    the lowest and highest circular frequency of the fit (rad/s), `speed` the largest velocity where it is known. Raises LawParameterError for a physics without a law
    and ValueError for an amplitude or band that is not positive.

    >>> from femend.physics import physics
    >>> grid = shapes(physics("clearance"), amplitude=1.0, band=(10, 100))
    >>> [shape.terms[0]["gap"] for shape in grid][:4]
    [0.1, 0.25, 0.45, 0.7]
    """
    if not (amplitude > 0 and 0 < band[0] < band[1]):
        raise ValueError(
            f"amplitude = {amplitude:g}, band = {band}; give a positive amplitude and a rising band in rad/s"
        )
    if physics.law is None:
        raise LawParameterError(f"{physics.name} is not the law of a joint and has no start values", law=physics.name)
    low, high = band
    middle = (low * high) ** 0.5
    one = _single(physics)
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
        case "generalised_maxwell" | "generalised_maxwell_3":
            taus = [f / middle for f in (0.1, 0.3, 1.0, 3.0, 10.0)]
            n = (len(physics.parameters) - 1) // 2
            return [_maxwell(physics, pick) for pick in combinations(taus, n)]
        case "fractional":
            return [
                Shape(
                    physics,
                    ({"k": 1.0, "c": 0.0, "alpha": power}, {"k": 0.0, "c": middle**-power, "alpha": power}),
                    (("k",), ("c",)),
                )
                for power in _POWER
            ]
        case "saturating_stiffness":
            return [one({"k": 1.0, "d0": knee * amplitude}, "k") for knee in _KNEE]
        case "preloaded_contact":
            grid = product((1.0, -1.0), _PRELOAD)
            return [one({"k": 1.0, "preload": p * amplitude, "side": side}, "k", "preload") for side, p in grid]
        case "hertz_contact":
            grid = product((1.0, -1.0, 2.0), (0.0, *_GAP[1:]))
            return [one({"k": 1.0, "gap": gap * amplitude, "sides": sides}, "k") for sides, gap in grid]
        case "play_friction":
            grid = product(_SLIP, _PLAY)
            return [one({"f": slip * amplitude, "kt": 1.0, "gap": gap * amplitude}, "f", "kt") for slip, gap in grid]
        case "displacement_damping":
            return [one({"c": 1.0, "beta": growth / amplitude**2}, "c") for growth in _GROWTH]
        case "iwan":
            return [_linear_in(physics, {"span": span * amplitude}) for span in (0.5, 1.0)]
        case "free_form":
            speed = amplitude * middle if speed is None else speed
            return [_linear_in(physics, {"d_span": amplitude, "v_span": speed})]
        case _ if len(physics.parameters) == 1:
            (name,) = physics.parameter_names
            return [one({name: 1.0}, name)]
        case _:
            return own_shapes(physics, amplitude, band)


class _single:
    def __init__(self, physics: Physics) -> None:
        self.physics = physics

    def __call__(self, values: Mapping[str, float], *scaled: str) -> Shape:
        return Shape(self.physics, (dict(values),), (scaled,))


def _bouc_wen(slip: float, n: float, ratio: float) -> dict[str, float]:
    """alpha = 0: the share of the force without hysteresis is the linear companion's."""
    total = slip**-n
    return {"k": 1.0, "alpha": 0.0, "n": n, "beta": total / (1 + ratio), "gamma": ratio * total / (1 + ratio)}


def _linear_in(physics: Physics, fixed: Mapping[str, float]) -> Shape:
    """A law that is linear in all parameters but the fixed ones: a term for each."""
    free = [name for name in physics.parameter_names if name not in fixed]
    terms = tuple({**dict.fromkeys(free, 0.0), name: 1.0, **fixed} for name in free)
    return Shape(physics, terms, tuple((name,) for name in free))


def _maxwell(physics: Physics, taus: tuple[float, ...]) -> Shape:
    return _linear_in(physics, {f"tau{i + 1}": tau for i, tau in enumerate(taus)})


def _viscoelastic(physics: Physics, tau: float) -> Shape:
    terms = ({"k0": 1.0, "k1": 0.0, "tau": tau}, {"k0": 0.0, "k1": 1.0, "tau": tau})
    return Shape(physics, terms, (("k0",), ("k1",)))
