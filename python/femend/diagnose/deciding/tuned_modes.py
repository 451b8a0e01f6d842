"""Modes that a fit gives frequencies of their own, and the model without what no card of a deck can hold."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from femend.estimate import Problem
from femend.model import ReducedModel

__all__ = ["by_cards", "deviations", "put_off", "tuned"]

FloatArray = NDArray[np.float64]


def tuned(problem: Problem, reduced: ReducedModel) -> slice:
    """Where the factors of the modes' frequencies are among the unknowns of a model."""
    return slice(len(reduced.names), len(reduced.names) + problem.n_tuned)


def deviations(problem: Problem, reduced: ReducedModel, p: FloatArray) -> FloatArray:
    """Prior standard deviations by which the modes are off (n_tuned,) at unknowns `p` (n_p,)."""
    mean, sd = problem.prior(reduced)
    own = tuned(problem, reduced)
    return np.asarray(np.abs(p[own] - mean[own]) / sd[own])


def by_cards(problem: Problem, reduced: ReducedModel, p: FloatArray) -> FloatArray:
    """The unknowns `p` (n_p,) without what modes and members were given of their own; factors of members that were
    found stay, as the model's parameters do."""
    alone = p.copy()
    alone[len(reduced.model.parameters) : len(reduced.names) - reduced.extra] = 0.0
    alone[tuned(problem, reduced)] = 0.0
    return alone


def put_off(problem: Problem, reduced: ReducedModel, p: FloatArray, other: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Frequencies (n_tuned,) in Hz of the modes at unknowns `p` (n_p,), and by what share they are above those at
    `other` ones."""
    freq, without = (problem.modes(reduced, at)[0][: problem.n_tuned] / (2 * np.pi) for at in (p, other))
    return freq, freq / np.maximum(without, 1e-300) - 1
