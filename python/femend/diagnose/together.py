"""Laws fitted together, and what more of them have to bring against fewer."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from femend.diagnose.pairs import Searched, plain
from femend.diagnose.terms import Term, Terms, fit_terms, judge_terms

__all__ = ["Scored", "brings", "fitted_together", "gained"]

FloatArray = NDArray[np.float64]

# terms fitted together, with their score
Scored = tuple[float, Terms]


def fitted_together(first: Searched, terms: Sequence[Term], p: FloatArray) -> Scored | None:
    """Terms fitted together from unknowns `p` of the model (with or without factors of members), with their score;
    None where they cannot be judged."""
    found = fit_terms(first.split.fitting, terms, first.reduced, first.g_rows, plain(first, p))
    if found is None:
        return None
    found = judge_terms(first.split.choosing, found)
    value = _score(first, found)
    return (value, found) if np.isfinite(value) else None


def gained(first: Searched, gain: float, chosen: float, prior: float, found: Terms) -> bool:
    """Whether terms bring what a law has to bring, against what leaves `chosen` on unseen data with `prior`."""
    less = float(np.log(chosen / max(found.chosen, 1e-12)))
    return first.settings.wins(gain, less, prior - found.prior)


def brings(first: Searched, fewer: Scored, more: Scored) -> bool:
    """Whether more terms bring against fewer what a law has to bring against none."""
    return gained(first, fewer[0] - more[0], fewer[1].chosen, fewer[1].prior, more[1])


def _score(first: Searched, found: Terms) -> float:
    """Tempered squares on unseen data, prior of the model's unknowns, and a price for every parameter."""
    squares = first.n_values * float(np.log(max(found.chosen, 1e-12)))
    return squares + found.prior + first.price * found.n_law
