"""Along which direction of its node a recorded force acts: the three shares of it that explain the beginning of the
recordings best, linear least squares with the model held.

In a beginning so short that resonances do not show, what the model is off by counts little, so that the shares are
found though the force is far off its axis and the updated model bent by that.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from femend.diagnose.locating.receptances import on_lines
from femend.estimate import Problem
from femend.model import ReducedModel

__all__ = ["shares_along"]

FloatArray = NDArray[np.float64]

# lines that are looked at
LINES = 120
# the length of a force by its shares, and the multiple of the least left up to which fewer shares explain as much
WHOLE, NEARLY = (0.7, 1.4), 2.0


def shares_along(
    problem: Problem, reduced: ReducedModel, unknowns: Sequence[FloatArray], rows: Sequence[int], decay: float
) -> tuple[FloatArray, float]:
    """Shares (n,) of the one recorded force that act at `rows` (n,) of the g-set, and what they leave of what the whole
    of it at the first row, either way round, does: at those of the model's `unknowns` (n_p,) each that explain most so,
    in a window of this `decay` (in units of `Problem.scale`).

    Shares are of as few rows as explain nearly as much, and together about the whole force, which a load cell shows
    along its own axis: what hardly moves a sensor might be any share. (0, ...) and infinity where no shares are.
    """
    few = problem.sparing(LINES).untuned().pressed()
    nothing: FloatArray = np.zeros(len(rows))
    tried = [(np.inf, nothing)]
    for p in unknowns:
        A, b = _made(few, reduced, few.tuned_like(p, reduced), rows, decay)
        own = min(float(((b - sign * A[:, 0]) ** 2).sum()) for sign in (1.0, -1.0))
        for n in range(2, len(rows) + 1):
            for others in combinations(range(1, len(rows)), n - 1):
                at, shares = [0, *others], nothing.copy()
                shares[at] = np.linalg.lstsq(A[:, at], b, rcond=None)[0]
                if WHOLE[0] <= np.linalg.norm(shares) <= WHOLE[1]:
                    tried.append((float(((b - A @ shares) ** 2).sum()) / max(own, 1e-300), shares))
    enough = NEARLY * min(left for left, _ in tried)
    left, shares = min((t for t in tried if t[0] <= enough), key=lambda t: (np.count_nonzero(t[1]), t[0]))
    return shares, left


def _made(
    problem: Problem, reduced: ReducedModel, p: FloatArray, rows: Sequence[int], decay: float
) -> tuple[FloatArray, FloatArray]:
    """What the whole recorded force at each of `rows` makes of the weighted recordings (m, n), and these (m,)."""
    omega, zeta, Q = problem.modes(reduced, p)
    W = reduced.rows(rows) @ Q
    made, recorded = [], []
    for line in problem.lines(reduced, decay * problem.scale()):
        s, g, out = on_lines(line, reduced, omega, zeta, Q)
        size = np.sqrt(line.share)
        h = np.einsum("ir,kr,or->koi", W, (s**2 * line.U[:, 0])[:, None] * g, out) * line.weight[:, :, None]
        made.append(size * h.reshape(-1, len(rows)))
        recorded.append(size * (line.Y * line.weight).ravel())
    A, b = np.concatenate(made), np.concatenate(recorded)
    return np.concatenate([A.real, A.imag]), np.concatenate([b.real, b.imag])
