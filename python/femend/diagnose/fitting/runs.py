"""Starts of nonlinear laws on their way through windows of the records, and back to shorter ones where they are lost.

In a window exp(-sigma t) of a record paths of motion that later part are still together; a law that fits there begins
nearer to the right one in a wider window.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from femend.diagnose.fitting.candidates import Start
from femend.diagnose.fitting.closed_loop import COARSE, ClosedLoop, loop_of
from femend.diagnose.fitting.descent import Descent, Reached
from femend.diagnose.locating.recovered import Recovered
from femend.estimate import Problem
from femend.threads import at_once

__all__ = ["EXPLAINS", "FAR", "FEW", "FIRST", "Run", "from_shorter", "step_by_step", "wider_windows", "windows"]

# steps of a start with the law alone, in a window with all unknowns, and where these do not explain it yet
FEW, FIRST, LONGER = 6, 5, 15
# decays of the windows, in units of `Problem.scale`, before the whole records
WINDOWS = (10.0, 3.0, 1.0)
# decays of shorter windows, in the same units, through which laws are begun anew that are lost in the first
SHORTER = (100.0, 30.0)
# ratio of a window's decay to that of the one before where a law is followed on in small steps, and the decay (in units
# of `Problem.scale`) from which whole records are next
FINER, WHOLE = 0.7, 0.1
# misfit up to which a law explains a window, and from which it is far from doing so
EXPLAINS, FAR = 1.5, 2.0


@dataclass(frozen=True, eq=False)
class Run:
    """A start on its way: descent with the window it has reached, where it is there."""

    name: str
    start: Start
    descent: Descent[ClosedLoop]
    reached: Reached
    # costs in the windows it came through, by their decays
    path: tuple[tuple[float, float], ...] = ()

    @property
    def misfit(self) -> float:
        """Mean weighted square left in the window."""
        return _left(self.descent, self.reached)


def windows(problem: Problem) -> list[float]:
    """Decays sigma (1/s) of the windows exp(-sigma t) a law is followed through, the whole records (0) last."""
    return [*(factor * problem.scale() for factor in WINDOWS), 0.0]


def wider_windows(problem: Problem, sigma: float) -> list[float]:
    """Decays (1/s) of windows from exp(-sigma t) on to the whole records (0), each a little wider than the one
    before."""
    n = int(np.log(sigma / (WHOLE * problem.scale())) / np.log(1 / FINER))
    return [*(sigma * FINER ** (i + 1) for i in range(n)), 0.0]


def from_shorter(runs: list[Run], recovered: Recovered) -> list[Run]:
    """The runs, in rising order of cost, each begun anew in shorter windows where that leads further down in this one,
    where a free force explains the recordings and none of them comes near: after a few impacts motion depends on a stop
    so much that there are minima all around the right one, after the first there are not."""
    if not runs or min(run.misfit for run in runs) <= FAR or recovered.fit.score > EXPLAINS:
        return runs

    def anew(run: Run) -> Run:
        problem, last = run.descent.loop.problem, run.descent.loop.sigma
        shortest, *shorter = (factor * problem.scale() for factor in SHORTER)
        begun = _alone_first(run, recovered, shortest)
        if begun is None:
            return run
        descent, reached = begun
        for sigma, everything, steps in [
            (shortest, True, FIRST),
            *((s, *way) for s in (*shorter, last) for way in ((False, FEW), (True, FIRST))),
        ]:
            descent = descent.on(descent.loop.at(sigma), everything)
            there = descent.run(reached.z, steps)
            if there is None:
                return run
            reached = there
        return run if reached.cost > run.reached.cost else replace(run, descent=descent, reached=reached)

    return sorted(at_once(anew, runs), key=lambda r: r.reached.cost)


def step_by_step(run: Run, recovered: Recovered) -> Run | None:
    """A run begun anew in the shortest window and followed with everything free through windows each a little wider
    than the one before, as far as it explains them; None where that is not beyond the first of `windows`.

    Where motion jumps, a window three times as wide has minima all around the right one; a little wider, it has not.
    """
    problem, first = run.descent.loop.problem, run.descent.loop.sigma
    shortest = SHORTER[0] * problem.scale()
    begun = _alone_first(run, recovered, shortest)
    if begun is None:
        return None
    descent, there = begun
    reached: Run | None = None
    for sigma in (shortest, *wider_windows(problem, shortest)):
        descent = descent.on(descent.loop.at(sigma), everything=True)
        further = descent.run(there.z, FIRST)
        if further is not None and _left(descent, further) > EXPLAINS:
            further = descent.run(further.z, LONGER, thorough=True)
        if further is None or _left(descent, further) > EXPLAINS:
            break
        there = further
        reached = Run(run.name, run.start, descent, there, ((sigma, there.cost),))
    return reached if reached is not None and reached.descent.loop.sigma < first else None


def _left(descent: Descent[ClosedLoop], reached: Reached) -> float:
    """Mean weighted square left in the window."""
    return float(reached.e @ reached.e) / descent.loop.size()


def _alone_first(run: Run, recovered: Recovered, sigma: float) -> tuple[Descent[ClosedLoop], Reached] | None:
    """A run begun anew in the window exp(-sigma t), after steps with the law alone free; None where it cannot be
    simulated."""
    loop, x = loop_of(run.descent.loop.problem, run.descent.loop.joint, run.start, recovered)
    descent = Descent.around(replace(loop, sigma=sigma, substeps=COARSE), x, False)
    reached = descent.run(np.concatenate([recovered.fit.p, x]), FEW)
    return None if reached is None else (descent, reached)
