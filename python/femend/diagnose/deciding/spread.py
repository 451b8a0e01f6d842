"""How far predictions of models lie apart that explain the recordings as well: motion that jumps hangs on little."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from femend.data.bands import within_band
from femend.diagnose.deciding.outcome import Diagnosis
from femend.diagnose.fitting.candidates import Candidate
from femend.diagnose.fitting.closed_loop import Loop, squares
from femend.diagnose.fitting.nonlinear import loop_of_candidate
from femend.diagnose.fitting.terms import Terms
from femend.errors import ModelError
from femend.estimate import FitRecord
from femend.numerals import plain

__all__ = ["AsGood", "Spread", "as_good", "spread"]

FloatArray = NDArray[np.float64]

# models that are drawn, and the number their draws begin with
DRAWS, SEED = 2, 1
# how near to the final model a draw is taken, in turn, until it leaves at most this multiple of the fitted recordings
NEARER, AS_WELL = (1.0, 0.5, 0.25, 0.125), 1.5
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


@dataclass(frozen=True, eq=False)
class AsGood:
    """The final model's unknowns p and x, and those of models that explain the recordings about as well."""

    loop: Loop
    points: list[tuple[FloatArray, FloatArray]]


def as_good(found: Diagnosis) -> AsGood | None:
    """Models drawn from the covariance of all unknowns around the final one, those of the structure and of the laws
    together. None where all that was found is linear, the motion of which follows its parameters smoothly, or where
    nothing is known of how well these are known.

    Along what the recordings do not tell, a law and the spring beside it say, a draw goes far, and what undoes the
    change of one by the other to first order does not there: each draw is taken so near to the final model that it
    leaves about as much of the recordings.
    """
    made = _final(found)
    if made is None:
        return None
    loop, p, x, covariance = made
    z = np.concatenate([p, x])
    drawn = _drawn(z, covariance)
    tried = [z, *(z + near * (one - z) for one in drawn for near in NEARER)]
    points = [(at[: len(p)], at[len(p) :]) for at in tried]
    least, *left = (squares(e) / loop.size() for e in loop.residuals(points)[0])
    if not np.isfinite(least):
        return None
    enough = AS_WELL * max(least, 1.0)
    first = [next((i for i, v in enumerate(some) if v <= enough), None) for some in np.split(np.array(left), DRAWS)]
    kept = [points[1 + n * len(NEARER) + i] for n, i in enumerate(first) if i is not None]
    return AsGood(loop, [points[0], *kept]) if kept else None


def spread(models: AsGood, found: Diagnosis, record: FitRecord, band: tuple[float, float] | None = None) -> Spread:
    """How far predictions of as good `models` for the forces of a record lie apart, in a `band` (Hz) where one is
    given."""
    driven = record if found.off is None else found.off.driving(record)
    loop = replace(models.loop, problem=found.problem.on([driven])).at(0.0)
    try:
        y, *others = (_within(histories[0].y, record.dt, band) for histories in loop.histories(models.points))
    except ModelError:
        return Spread(float("inf"), 0.0)
    size = float(np.sqrt(np.mean(y**2)))
    apart = np.sqrt(np.mean([np.mean((other - y) ** 2, axis=0) for other in others], axis=0)) / max(size, 1e-300)
    if not np.isfinite(apart).all():
        return Spread(float("inf"), 0.0)
    ends = [stretch[-1] for stretch in np.array_split(np.arange(len(apart)), min(STRETCHES, len(apart)))]
    level = [float(np.sqrt(np.mean(stretch**2))) for stretch in np.split(apart, [end + 1 for end in ends[:-1]])]
    parted = next((i for i, share in enumerate(level) if share > APART), len(level) - 1)
    since = 0.0 if parted == 0 else record.dt * (ends[parted - 1] + 1)
    return Spread(float(np.sqrt(np.mean(apart**2))), since)


def _within(y: FloatArray, dt: float, band: tuple[float, float] | None) -> FloatArray:
    """Samples (n_out, n) at step `dt` without what lies outside a band (Hz)."""
    if band is None:
        return y
    spectrum = np.fft.rfft(y, axis=1)
    spectrum[:, ~within_band(np.fft.rfftfreq(y.shape[1], dt), band)] = 0.0
    return np.fft.irfft(spectrum, y.shape[1], axis=1)


def _final(found: Diagnosis) -> tuple[Loop, FloatArray, FloatArray, FloatArray] | None:
    """Simulation of the final model for the recordings it was fitted to, its unknowns p and x, and their covariance."""
    what: Terms | Candidate | None = found.best if found.further is None else found.further.terms
    if isinstance(what, Terms):
        nonlinear = any(term.candidate.nonlinear for term in what.terms)
        if not nonlinear or what.covariance is None:
            return None
        return what.loop(found.problem), what.p, what.x, what.covariance
    if what is None or not what.nonlinear or what.whole is None:
        return None
    return loop_of_candidate(found.problem, what), what.p, what.x, what.whole


def _drawn(z: FloatArray, covariance: FloatArray) -> list[FloatArray]:
    """Unknowns drawn around `z` (n,)."""
    values, axes = np.linalg.eigh(covariance)
    root = axes * np.sqrt(np.maximum(values, 0.0))
    return list(z + np.random.default_rng(SEED).standard_normal((DRAWS, len(z))) @ root.T)
