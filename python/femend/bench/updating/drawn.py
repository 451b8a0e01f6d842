"""The posterior of an update by draws, beside the bell that a search ends with."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from femend.estimate.updating import Posterior, Problem, Reduction, UpdateResult, sample
from femend.estimate.updating.moves import FEWEST
from femend.estimate.updating.sampling import temperatures_left
from femend.numerals import plain
from femend.progress import Progress, tell
from femend.study.file.bench_settings import UpdatingSettings

__all__ = ["Drawn", "draw_posterior_of"]

FloatArray = NDArray[np.float64]

QUANTILES = (0.025, 0.5, 0.975)
# draws tell another story than Laplace's bell where a mean is off by more of its deviations, or a deviation by more
# than this factor; both are several times what 500 draws scatter by
SHIFTED, WIDER = 0.5, 1.5
# s, from which it is told how long draws will take
LONG = 10.0


@dataclass(frozen=True, eq=False)
class Drawn:
    """Draws from the posterior, beside the update `found`; `small` is the reduction they were made in (None: the models
    as they are)."""

    posterior: Posterior
    found: UpdateResult
    small: Reduction | None

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the unknowns."""
        return self.posterior.problem.unknowns.names

    @property
    def values(self) -> FloatArray:
        """Values (n_draws, n_unknowns)."""
        return self.posterior.values

    def shift(self) -> FloatArray:
        """Mean of the draws from the estimate (n_unknowns,), in Laplace's deviations of p."""
        return np.asarray((self.posterior.mean - self.found.p) / self._laplace_sd())

    def ratio(self) -> FloatArray:
        """Deviation of the draws over Laplace's (n_unknowns,)."""
        return np.asarray(np.sqrt(np.diag(self.posterior.covariance)) / self._laplace_sd())

    def _laplace_sd(self) -> FloatArray:
        return np.sqrt(np.diag(self.found.covariance))

    def unlike(self) -> list[str]:
        """Unknowns whose draws Laplace's bell does not describe."""
        off = (np.abs(self.shift()) > SHIFTED) | (self.ratio() > WIDER) | (self.ratio() < 1 / WIDER)
        return [n for n, bad in zip(self.names, off, strict=True) if bad]

    def as_dict(self) -> dict[str, Any]:
        """What updating.json holds of them."""
        values, shift, ratio = self.values, self.shift(), self.ratio()
        quantiles = self.posterior.quantiles(QUANTILES)
        with np.errstate(invalid="ignore", divide="ignore"):
            correlation = np.atleast_2d(np.corrcoef(values.T))
        return {
            "draws": len(values),
            "models_solved": self.posterior.n_solved,
            "reduced_model_error": None if self.small is None else self.small.error,
            "log_evidence": self.posterior.log_evidence,
            "log_evidence_se": self.posterior.log_evidence_se,
            "temperatures": list(self.posterior.temperatures),
            "acceptance": list(self.posterior.acceptance),
            "parameters": {
                name: {
                    "mean": float(values[:, i].mean()),
                    "sd": float(values[:, i].std(ddof=1)),
                    "quantiles": dict(zip(("2.5 %", "50 %", "97.5 %"), quantiles[name], strict=True)),
                    "shift_from_laplace": float(shift[i]),
                    "sd_over_laplace": float(ratio[i]),
                }
                for i, name in enumerate(self.names)
            },
            "correlation": correlation.tolist(),
            "unlike_laplace": self.unlike(),
        }

    def advice(self) -> list[str]:
        """What the moves of the draws, and their difference from Laplace's bell, ask for."""
        said = [f"draws: {self.posterior.advice} ([updating] draws)"] if self.posterior.advice else []
        if self.unlike():
            said.append(
                f"the posterior of {', '.join(self.unlike())} is not the bell that its deviation tells of: use the "
                "quantiles of the draws"
            )
        return said


@dataclass(eq=False)
class Pace:
    """Counts the temperatures of `draws` draws for `n_unknowns` unknowns on a `progress`, and tells how long they will
    take once that is known, where it is more than `LONG` s."""

    progress: Progress
    draws: int
    n_unknowns: int
    clock: Callable[[], float] = time.perf_counter
    _at: list[float] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._at.append(self.clock())

    def __call__(self, beta: float) -> None:
        """The temperature `beta` is reached; 0 once the draws from the prior are solved."""
        self._at.append(self.clock())
        taken = self._at[-1] - self._at[-2]
        if beta > 0:
            self.progress.advance()
        left = temperatures_left(beta, self.n_unknowns) if beta > 0 else 0
        if beta == 0 and FEWEST * taken > LONG:
            tell(
                self.progress,
                f"{self.draws} models took {_lasting(taken)}; the draws are moved through temperatures, each of which "
                f"takes {_lasting(FEWEST * taken)} or more: how long all take is told after the first",
            )
        elif len(self._at) == 3 and left * taken > LONG:
            tell(
                self.progress,
                f"the draws take about {_lasting(left * taken)} more: {left} temperatures of about {_lasting(taken)}; "
                "fewer [updating] draws take less, and Ctrl-C leaves them out and keeps the search",
            )


def _lasting(seconds: float) -> str:
    """A duration in words.

    >>> _lasting(8.26), _lasting(130), _lasting(9000)
    ('8 s', '2.2 min', '2.5 h')
    """
    for unit, size in (("h", 3600.0), ("min", 60.0)):
        if seconds > 1.5 * size:
            return f"{plain(seconds / size, 2)} {unit}"
    return f"{plain(seconds, 1 if seconds < 10 else 2)} s"


def draw_posterior_of(
    found: UpdateResult, settings: UpdatingSettings, small: Reduction | None, progress: Progress | None = None
) -> Drawn:
    """Draws `settings.draws` times from the posterior of the problem of `found`, in reduced models where `small` has
    them, without the modes that its search let go.

    The temperatures are counted on the `progress`, which is told how long they will take. Raises UpdatingError as
    `sample` does.
    """
    problem: Problem = found.problem if small is None else small.problem
    told = None if progress is None else Pace(progress, settings.draws, len(problem.unknowns))
    return Drawn(
        sample(problem, settings.draws, seed=settings.seed, counting=found.counting(), told=told), found, small
    )
