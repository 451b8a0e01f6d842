"""What misfits on data that no fit has seen say for a law, and what its parameters cost."""

from __future__ import annotations

import numpy as np

from femend.diagnose.settings import Settings

__all__ = ["LEAST", "deviance", "fall", "price"]

# least misfit that is told from none
LEAST = 1e-12


def deviance(misfit: float, n_values: float) -> float:
    """Tempered -2 ln likelihood of a `misfit` on `n_values` values, but for what is the same for all laws.

    >>> deviance(1.0, 100.0)
    0.0
    """
    return n_values * float(np.log(max(misfit, LEAST)))


def fall(before: float, after: float) -> float:
    """Relative fall (ln) of a misfit from `before` to `after`.

    >>> round(fall(2.0, 1.0), 3)
    0.693
    """
    return float(np.log(before / max(after, LEAST)))


def price(settings: Settings, n_values: float) -> float:
    """Score that a parameter of a law costs where `n_values` values choose (Schwarz 1978, with the price of the
    `settings`)."""
    return settings.price * float(np.log(max(n_values, np.e)))
