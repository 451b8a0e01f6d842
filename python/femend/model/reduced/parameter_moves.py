"""How parameters move the modes of a model beyond a basis: vectors without which a basis knows one set of values alone.

A basis of modes and static responses at the deck's values gives frequencies that are off by the square of what the true
shapes have outside it as soon as parameters differ between parts of the model: at ± 10 % responses are off by several
per cent of their size. What the shapes of the band gain to first order is added (Balmes, Parametric families of reduced
finite element models, Mech. Syst. Signal Process. 10, 1996), as far as it matters.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from femend.model.model import Model

__all__ = ["forces_of_moves", "missed"]

FloatArray = NDArray[np.float64]

# step of ln factors by which derivatives are worked out, and modes that count: up to this multiple of the band's end
STEP, COUNTED = 0.05, 1.1
# share of a mode's strain energy, one prior standard deviation away, below which what a basis lacks does not matter: of
# the frequency it is half
ENOUGH = 1e-5
# forces that are worked with
MOST = 300


def forces_of_moves(model: Model, omega: FloatArray, phi: FloatArray, f_max: float) -> FloatArray:
    """Forces (n_a, m) by which one prior standard deviation of each parameter deforms the modes `phi` (n_a, n), of
    circular frequencies `omega` (n,), up to a little beyond `f_max` (Hz), a mode's by its frequency.

    (dK - omega² dM) phi / omega of every mode and parameter, or as many random combinations of more than `MOST` of
    them, which span what matters of all (Halko, Martinsson and Tropp, SIAM Review 53, 2011).
    """
    band = (omega > 0) & (omega <= COUNTED * 2 * np.pi * f_max)
    lam, shapes = omega[band] ** 2, phi[:, band]
    n = shapes.shape[1] * len(model.parameters)
    loads, first = np.zeros((len(phi), min(n, MOST))), 0
    rng = np.random.default_rng(0)
    for p in model.parameters if n else ():
        (k_up, m_up), (k_down, m_down) = (model.matrices({p.name: float(np.exp(side * STEP))}) for side in (1, -1))
        moved = (k_up - k_down) @ shapes - ((m_up - m_down) @ shapes) * lam
        moved *= (p.prior_sd / (2 * STEP)) / np.sqrt(lam)
        if n <= MOST:
            loads[:, first : first + len(lam)] = moved
            first += len(lam)
        else:
            loads += moved @ rng.standard_normal((len(lam), MOST)) / np.sqrt(MOST)
    return loads


def missed(K: Any, V: FloatArray, moves: FloatArray) -> FloatArray:
    """What of `moves` (n_a, m), the answers to those forces, a basis `V` (n_a, r) lacks, in the energy of a stiffness
    `K` (n_a, n_a): the directions (n_a, k) in which it matters."""
    if not moves.shape[1]:
        return moves
    KV = K @ V
    outside = moves - V @ np.linalg.solve(V.T @ KV, KV.T @ moves)
    energy = outside.T @ (K @ outside)
    shares, turns = np.linalg.eigh(0.5 * (energy + energy.T))
    return np.asarray(outside @ turns[:, shares > ENOUGH][:, ::-1])
