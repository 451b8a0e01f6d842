"""Where an update begins: at the least of a response surface from a design of experiments, if the model agrees."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from femend.errors import FemendError
from femend.estimate.updating import Problem, ResponseSurface, design, response_surface, sobol
from femend.numerals import plain
from femend.study.file.bench_settings import UpdatingSettings

__all__ = ["SurfaceStart", "start_on_surface"]

FloatArray = NDArray[np.float64]

# a surface that leaves more than this share of the residuals' variance at points left out is told of
POOR = 0.1
# points of the surface for the shares that unknowns have in it, and residuals that hardly move
SHARED, ROUNDING = 1024, 1e-12


@dataclass(frozen=True, eq=False)
class SurfaceStart:
    """A response surface, its least point `p` (n_unknowns,) and the costs, squares and prior, with every measured mode
    counting: what the surface has there (`foretold`), what the models have there (`there`) and at the deck (`deck`),
    infinite where they have no solution. `alone`, `in_all` (n_unknowns,) are the shares of the residuals' variance over
    the priors that an unknown makes by itself and has any part in (Sobol indices of all residuals together)."""

    surface: ResponseSurface
    p: FloatArray
    foretold: float
    there: float
    deck: float
    alone: FloatArray
    in_all: FloatArray

    @property
    def taken(self) -> bool:
        """Does the search begin at the surface's least point? Only where the models themselves cost less there."""
        return self.there < self.deck

    @property
    def left(self) -> float:
        """Share of the residuals' variance over the design that the surface leaves at points left out (PRESS)."""
        return float((self.surface.error / self.surface.spread) ** 2) if self.surface.spread > 0 else 0.0

    def as_dict(self) -> dict[str, Any]:
        """What updating.json holds of it."""
        unknowns = self.surface.problem.unknowns
        return {
            "points": len(self.surface.points),
            "failed": len(self.surface.failures),
            "terms": len(self.surface.coefficients),
            "press_error": self.surface.error,
            "spread": self.surface.spread,
            "left_of_variance": self.left,
            "minimum": dict(zip(unknowns.names, unknowns.values(self.p).tolist(), strict=True)),
            "sobol": {
                name: {"first": float(a), "total": float(t)}
                for name, a, t in zip(unknowns.names, self.alone, self.in_all, strict=True)
            },
            "cost": {"foretold": self.foretold, "there": self.there, "deck": self.deck},
            "begun_there": self.taken,
        }

    def warnings(self) -> list[str]:
        """Points of the design that gave no result."""
        n = len(self.surface.points) + len(self.surface.failures)
        if not self.surface.failures:
            return []
        k, text = next(iter(self.surface.failures.items()))
        return [f"{len(self.surface.failures)} of {n} points of the design gave no result, point {k + 1} first: {text}"]

    def advice(self) -> list[str]:
        """What a surface that is not to be believed asks for."""
        said = []
        if not self.taken:
            what = f"costs {plain(self.there)}" if np.isfinite(self.there) else "has no solution"
            said.append(
                f"the response surface's least point {what} in the models themselves, the deck {plain(self.deck)}: the "
                "search began at the deck; narrow the bounds, or allow more starts"
            )
        elif self.left > POOR:
            said.append(
                f"the response surface leaves {100 * self.left:.0f} % of the residuals' variance at points it was not "
                "fitted to: it told where to begin, no more; narrow the bounds, or raise design_points"
            )
        return said


def start_on_surface(problem: Problem, settings: UpdatingSettings) -> SurfaceStart:
    """Solves `problem` at the points of a design, fits a quadratic to every residual and goes to its least point.

    `settings` has the number of points (twice the quadratic's terms without it) and the seed. Every measured mode
    counts wherever the costs are compared, since a point at which modes have no mate would look better for it. Raises
    UpdatingError as `response_surface` does.
    """
    surface = response_surface(problem, settings.design_points, seed=settings.seed)
    p = surface.minimise(seed=settings.seed)
    foretold = float(surface.squares(p)[0]) + problem.prior_cost(p)
    there, deck = (_cost(problem, x) for x in (p, problem.unknowns.mean))
    return SurfaceStart(surface, p, foretold, there, deck, *_shares(problem, surface, settings.seed))


def _shares(problem: Problem, surface: ResponseSurface, seed: int) -> tuple[FloatArray, FloatArray]:
    """Sobol indices of all residuals of the surface together: first order and total (n_unknowns,)."""
    variance = np.var(surface.residual(design(problem.unknowns, SHARED, seed=seed)), axis=0)
    # what a residual scatters by rounding has no shares
    moving = variance > ROUNDING * variance.max(initial=0.0)
    if not moving.any():
        return np.zeros(len(problem.unknowns)), np.zeros(len(problem.unknowns))
    found = sobol(problem, lambda p: surface.residual(p)[:, moving], SHARED, seed=seed)
    return found.together(variance[moving])


def _cost(problem: Problem, p: FloatArray) -> float:
    every = [None if c.test is None else np.ones(c.test.freq.size, dtype=np.bool_) for c in problem.configurations]
    try:
        return float(problem.evaluate(p, active=every).cost)
    except (FemendError, ArithmeticError):
        return float("inf")
