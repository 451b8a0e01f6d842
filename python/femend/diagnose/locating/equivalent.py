"""The spring or mass with a dashpot that does most like what a place did."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from femend.diagnose.locating.free_force import FreeForce
from femend.diagnose.locating.joint import Joint
from femend.errors import ModelError
from femend.estimate import Fit, Problem

__all__ = ["FEW_LINES", "RUGGED", "WINDOW", "equivalent_linear", "middle", "stiffness_scale"]

FloatArray = NDArray[np.float64]

# lines a record on which the equivalent spring and dashpot of a place are fitted
FEW_LINES = 120
# sizes that are tried against a free force, as multiples of the joint's own stiffness, and their loss: force of the
# dashpot as a share of that of the spring or mass; of a spring as a share of that of the dashpot it stands beside
SIZES, LOSS = 10.0 ** np.linspace(-3.0, 3.0, 49), 0.05
# the best of them that go on, steps of a fit, and spread of its logarithms
FOLLOWED, STEPS, SPREAD = 2, 10, np.full(2, 4.0)
# misfit, in units of the noise or of what a free force leaves, from which resonances are off by so many of their widths
# that minima are everywhere: fits begin in a window exp(-sigma t) too, whose broad resonances leave one, with its sigma
# in units of `Problem.scale`
RUGGED, WINDOW = 4.0, 15.0


def stiffness_scale(problem: Problem, joint: Joint) -> tuple[float, float]:
    """Stiffness (deck units) that a term at the joint has to have to matter, and a circular frequency of the band."""
    if joint.place.support:
        return joint.place.support, middle(problem)
    if joint.place.release is not None:
        return float(np.mean(np.diag(joint.place.release))), middle(problem)
    system = problem.system(joint.reduced)
    try:
        omega, _, Q, _ = system.modal(problem.prior(joint.reduced)[0])
    except ModelError:
        return np.inf, middle(problem)  # what was added before leaves no mass at the prior means
    w = joint.w @ Q
    low = 2 * np.pi * problem.band[0]
    compliance = (w**2 / np.maximum(omega**2, low**2)).sum(axis=1)
    mean = float(np.mean(compliance))
    # what does not move is stiffer than anything
    return 1 / mean if mean > 0 else np.inf, middle(problem)


def middle(problem: Problem) -> float:
    """Geometric middle of the band, rad/s."""
    return float(2 * np.pi * np.sqrt(problem.band[0] * problem.band[1]))


def equivalent_linear(problem: Problem, joint: Joint, p: FloatArray, free: Sequence[FreeForce] = ()) -> Fit | None:
    """The spring or mass with a dashpot that explains the records best, from a few sizes, from those nearest to what a
    `free` force did on each record, and from unknowns `p` (n_p,) of the model; None where nothing moves."""
    scale, omega = stiffness_scale(problem, joint)
    if not np.isfinite(scale):
        return None
    sizes = (0.02, 0.2, 2.0)
    families = ["support_stiffness"] + (["added_mass"] if joint.place.release is None else [])
    units = {"support_stiffness": scale, "added_mass": scale / omega**2}
    starts = [(law, np.log([f * units[law], 0.03 * f * scale / omega])) for law in families for f in sizes]
    starts += _nearest(free, families, units, omega)
    few, laws = problem.sparing(FEW_LINES), [joint.hypothesis((law, "viscous_damper"), m, SPREAD) for law, m in starts]
    begun = [(p, m) for _, m in starts]
    done = [t for t in few.fit(laws, begun, iterations=STEPS) if t is not None]
    if min((t.score for t in done), default=np.inf) > RUGGED:
        window = [t for t in few.fit(laws, begun, sigma=WINDOW * problem.scale(), iterations=STEPS) if t is not None]
        best = sorted(window, key=lambda t: t.cost)[:FOLLOWED]
        again = few.fit([t.hypothesis for t in best], [(t.p, t.x) for t in best], iterations=STEPS)
        done += [t for t in again if t is not None]
    return min(done, key=lambda t: t.cost) if done else None


def _nearest(
    free: Sequence[FreeForce], families: Sequence[str], units: dict[str, float], omega: float
) -> list[tuple[str, FloatArray]]:
    """Logarithms of sizes and dashpots, with their laws, whose forces come nearest to the free ones as the sensors tell
    those: `units` are the joint's own sizes of each law, `omega` (rad/s) is where the losses are meant.

    The model's unknowns stay where the free force has them. An effect of many times the noise leaves so many minima
    that a few sizes would hardly lie in the right one's reach.
    """
    found: list[tuple[float, str, FloatArray]] = []
    few = [one.thinned(FEW_LINES) for one in free]
    # springs and masses with little loss, and dashpots with little of a spring
    kinds = [*((law, LOSS) for law in families), ("support_stiffness", 1 / LOSS)]
    for law, loss in kinds if free else ():
        order = 2 if law == "added_mass" else 0
        sizes = SIZES * units[law] * min(1.0, 1 / loss)
        dashpots = sizes * omega ** (order - 1) * loss
        kappas = [sizes[:, None] * one.s**order + dashpots[:, None] * one.s for one in few]
        costs = np.sum([one.left(kappa) for one, kappa in zip(few, kappas, strict=True)], axis=0)
        inner = costs[1:-1]
        lowest = 1 + np.flatnonzero((inner < costs[:-2]) & (inner <= costs[2:]))
        found += [(float(costs[i]), law, np.log([sizes[i], dashpots[i]])) for i in lowest]
    found.sort(key=lambda one: one[0])
    return [(law, x) for _, law, x in found[:FOLLOWED]]
