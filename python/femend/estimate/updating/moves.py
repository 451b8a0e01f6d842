"""Moves of particles at one temperature: from where resampling left them to draws of their own."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Moved", "move"]

FloatArray = NDArray[np.float64]

# moves are made until the particles are new ones, within these numbers
FEWEST, MOST = 2, 60
# new ones are the root of 2 deviations away, those of two draws that know nothing of each other, and their squares have
# nothing to do with the old ones: evidence is made of the squares, which can be remembered long after the places
AWAY, REMEMBERED = 1.2, 0.1
# particles that moved less than a deviation tell of an answer that is not to be trusted
TOO_LITTLE = 1.0
# acceptance that steps are scaled to; a walk's is Roberts, Gelman and Gilks' (1997)
WALK, LEAP = 0.234, 0.3
# after so many moves the kind that got less far is tried once more
RETRY = 5
# of a covariance's mean variance, so that particles on a line have a factor of it
JITTER = 1e-12


@dataclass(frozen=True, eq=False)
class Moved:
    """Particles after their moves: `p` (n, n_unknowns), `squares` (n,), the mean `acceptance`, how far they are from
    where they were (`away`, in deviations, root mean square) and how many models were `solved`."""

    p: FloatArray
    squares: FloatArray
    acceptance: float
    away: float
    solved: int


class _Bells:
    """For each particle the bell that it moves in: mean and covariance of the half of the particles it is not in.

    A bell fitted to a particle itself holds it where it is, and the evidence comes out too large.
    """

    def __init__(self, p: FloatArray, rng: np.random.Generator) -> None:
        order = rng.permutation(len(p))
        self.halves = (order[: len(p) // 2], order[len(p) // 2 :])
        self.centres = [p[other].mean(axis=0) for other in self.halves[::-1]]
        self.factors = [_factor(p[other]) for other in self.halves[::-1]]
        self.inverses = [np.linalg.inv(L) for L in self.factors]

    def white(self, p: FloatArray) -> FloatArray:
        """Deviations (n, n_unknowns) of particles `p` in the coordinates of their bells."""
        z = np.empty_like(p)
        for at, centre, inverse in zip(self.halves, self.centres, self.inverses, strict=True):
            z[at] = (p[at] - centre) @ inverse.T
        return z

    def points(self, z: FloatArray) -> FloatArray:
        """The inverse of `white`."""
        p = np.empty_like(z)
        for at, centre, L in zip(self.halves, self.centres, self.factors, strict=True):
            p[at] = centre + z[at] @ L.T
        return p


def _factor(p: FloatArray) -> FloatArray:
    """Cholesky factor of the covariance of points (n, n_unknowns)."""
    C = np.atleast_2d(np.cov(p.T))
    return np.linalg.cholesky(C + JITTER * np.trace(C) / len(C) * np.eye(len(C)))


def move(
    p: FloatArray,
    squares: FloatArray,
    beta: float,
    rng: np.random.Generator,
    squares_of: Callable[[FloatArray], FloatArray],
    prior_of: Callable[[FloatArray], FloatArray],
    limits: tuple[FloatArray, FloatArray],
) -> Moved:
    """Metropolis-Hastings moves of particles `p` (n, n_unknowns) with `squares` (n,) under prior times
    exp(-`beta` squares / 2), cut off at the `limits`.

    Of two kinds of steps the one is taken that gets the particles further: leaps, which keep a bell invariant
    (preconditioned Crank-Nicolson: Cotter, Roberts, Stuart and White 2013) and are nearly independent draws where the
    posterior is one, and random walks, which need none. The bell of one half of the particles is that of the other
    half (as in Goodman and Weare 2010); the sizes of steps follow the acceptance. It ends when the particles have gone
    a root-mean-square `AWAY` and their squares correlate with the old ones by less than `REMEMBERED` (a criterion as in
    Catanach and Beck 2018), or after `MOST` moves. `squares_of` and `prior_of` map points (n, n_unknowns) to squares
    and prior cost (n,).
    """
    n, d = p.shape
    bells, whole = _Bells(p, rng), np.linalg.inv(_factor(p))
    prior, z = prior_of(p), bells.white(p)
    p0, s, s0 = p, squares, squares
    # a leap of size 1 is a draw from the bell
    size, jump, most = [0.7, 2.38 / np.sqrt(d)], [np.inf, np.inf], (1.0, np.inf)
    rates, solved, away = [], 0, 0.0
    for turn in range(MOST):
        kind = int(np.argmin(jump) if turn % RETRY == RETRY - 1 else np.argmax(jump))
        y = size[kind] * rng.standard_normal((n, d)) + (z if kind else np.sqrt(1.0 - size[0] ** 2) * z)
        q = bells.points(y)
        new_s, new_prior = np.full(n, np.inf), np.full(n, np.inf)
        inside = np.all((q >= limits[0]) & (q <= limits[1]), axis=1)
        if inside.any():
            new_s[inside], new_prior[inside] = squares_of(q[inside]), prior_of(q[inside])
            solved += int(inside.sum())
        ratio = -0.5 * (beta * (new_s - s) + new_prior - prior)
        if kind == 0:
            ratio += 0.5 * ((y**2).sum(axis=1) - (z**2).sum(axis=1))
        taken = np.log(rng.random(n)) < np.nan_to_num(ratio, nan=-np.inf)
        jump[kind] = float(np.mean(taken * ((y - z) ** 2).sum(axis=1)))
        p, z = np.where(taken[:, None], q, p), np.where(taken[:, None], y, z)
        s, prior = np.where(taken, new_s, s), np.where(taken, new_prior, prior)
        rates.append(float(taken.mean()))
        size[kind] = min(size[kind] * float(np.exp(rates[-1] - (WALK if kind else LEAP))), most[kind])
        away = float(np.sqrt(np.mean((((p - p0) @ whole.T) ** 2).sum(axis=1)) / d))
        if turn + 1 >= FEWEST and away >= AWAY and _remembered(s0, s) < REMEMBERED:
            break
    return Moved(p, s, float(np.mean(rates)), away, solved)


def _remembered(before: FloatArray, after: FloatArray) -> float:
    """Correlation of the squares (n,), 0 where one side is all alike."""
    a, b = before - before.mean(), after - after.mean()
    size = float(np.sqrt((a @ a) * (b @ b)))
    return abs(float(a @ b)) / size if size > 0 else 0.0
