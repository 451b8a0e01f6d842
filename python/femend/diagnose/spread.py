"""How far predictions of models lie apart that explain the recordings as well: motion that jumps hangs on little."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from femend.diagnose.candidates import Candidate
from femend.diagnose.closed_loop import Loop
from femend.diagnose.nonlinear import loop_of_candidate
from femend.diagnose.outcome import Diagnosis
from femend.diagnose.terms import Terms
from femend.errors import ModelError
from femend.estimate import FitRecord, Problem
from femend.numerals import plain

__all__ = ["Spread", "spread"]

FloatArray = NDArray[np.float64]

# models that are drawn, and the number their draws begin with
DRAWS, SEED = 2, 1
# stretches of a record that are looked at one by one, and how far apart predictions are where they have parted
STRETCHES, APART = 40, 0.3


@dataclass(frozen=True, slots=True)
class Spread:
    """How far apart predictions of a record are: `share` of the response, and the time `since` (s) when they part by
    more than `APART` of it."""

    share: float
    since: float

    def text(self, name: str) -> str:
        """What is said of the prediction of the recording `name`; nothing where they stay together."""
        if self.share < APART:
            return ""
        much = f"by {plain(100 * self.share, 2)} % of the response" if np.isfinite(self.share) else "without bounds"
        return (
            f"the prediction of recording {name!r} hangs on little: models that explain the fitted recordings as well "
            f"differ from it {much}, from about {plain(self.since, 2)} s on (a jump or impacts come sooner or later). "
            "From there it is one of several courses that the structure may take: record at that level to settle it"
        )


def spread(found: Diagnosis, record: FitRecord) -> Spread | None:
    """How far predictions for the forces of a record lie apart; None where all that was found is linear, the motion of
    which follows its parameters smoothly, or where nothing is known of how well these are known.

    Models are drawn from the covariance of all unknowns around the final one, those of the structure and of the laws
    together, and simulated.
    """
    made = _final(found, found.problem.on([record if found.off is None else found.off.driving(record)]))
    if made is None:
        return None
    loop, p, x, covariance = made
    points = [(p, x), *((z[: len(p)], z[len(p) :]) for z in _drawn(np.concatenate([p, x]), covariance))]
    try:
        y, *others = (histories[0].y for histories in loop.histories(points))
    except ModelError:
        return Spread(float("inf"), 0.0)  # unknowns that are told so little that they may be those of no structure
    size = float(np.sqrt(np.mean(y**2)))
    apart = np.sqrt(np.mean([np.mean((other - y) ** 2, axis=0) for other in others], axis=0)) / max(size, 1e-300)
    if not np.isfinite(apart).all():
        return Spread(float("inf"), 0.0)
    ends = [stretch[-1] for stretch in np.array_split(np.arange(len(apart)), min(STRETCHES, len(apart)))]
    level = [float(np.sqrt(np.mean(stretch**2))) for stretch in np.split(apart, [end + 1 for end in ends[:-1]])]
    parted = next((i for i, share in enumerate(level) if share > APART), len(level) - 1)
    since = 0.0 if parted == 0 else record.dt * (ends[parted - 1] + 1)
    return Spread(float(np.sqrt(np.mean(apart**2))), since)


def _final(found: Diagnosis, problem: Problem) -> tuple[Loop, FloatArray, FloatArray, FloatArray] | None:
    """Simulation of the final model, its unknowns p and x, and their covariance."""
    what: Terms | Candidate | None = found.best if found.further is None else found.further.terms
    if isinstance(what, Terms):
        nonlinear = any(term.candidate.nonlinear for term in what.terms)
        if not nonlinear or what.covariance is None:
            return None
        return what.loop(problem).at(0.0), what.p, what.x, what.covariance
    if what is None or not what.nonlinear or what.whole is None:
        return None
    return loop_of_candidate(problem, what).at(0.0), what.p, what.x, what.whole


def _drawn(z: FloatArray, covariance: FloatArray) -> list[FloatArray]:
    """Unknowns drawn around `z` (n,)."""
    values, axes = np.linalg.eigh(covariance)
    root = axes * np.sqrt(np.maximum(values, 0.0))
    return list(z + np.random.default_rng(SEED).standard_normal((DRAWS, len(z))) @ root.T)
