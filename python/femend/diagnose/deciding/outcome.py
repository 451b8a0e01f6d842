"""What a diagnosis found."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from femend.diagnose.driven.unrecorded import Driven
from femend.diagnose.fitting.candidates import Candidate
from femend.diagnose.loads.loads import LoadFinding
from femend.diagnose.locating.locate import Located
from femend.diagnose.locating.split import Split
from femend.diagnose.naming.followed import AsRead
from femend.diagnose.naming.free_form_rival import Rival
from femend.diagnose.naming.judge import Given
from femend.diagnose.naming.ranked import Ranked
from femend.diagnose.recordings.recorded_off import RecordedOff
from femend.diagnose.settings import Settings
from femend.diagnose.several.second import Further
from femend.estimate import Fit, Hypothesis, Problem
from femend.model import ReducedModel

__all__ = ["Diagnosis"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """Everything a diagnosis found.

    `verdict` is one of the contract's; `split` says which recordings choose between laws; `best` is the accepted
    candidate refitted to all records (None where nothing is added), `null` the updated model, `nominal` the deck as it
    is; `ranked` are the candidates in order, `located` the places, `probabilities` of the ranked, `load` a finding
    about the load, `n_values` the effective number of values that scores count on the choosing records, windowed by
    exp(-`sigma` t); `rival` is the free-form force where it beats every named law (`best` is it then); `further` are
    several effects at once where one does not explain enough; `driven` is where the force acts if nobody recorded it;
    `off` is what recordings are off by, a force that acted at another time or along another axis, sensors that are
    late: fits are of records without it; `interrupted` says that the run was stopped before it could decide;
    `read` is the model beside the force that was read at the place, where that explains the recordings and no law could
    be followed over them.
    """

    verdict: str
    problem: Problem
    split: Split
    reduced: ReducedModel
    nominal: tuple[Hypothesis, FloatArray]
    null: Fit
    null_chosen: Candidate
    null_score: float
    located: list[Located]
    ranked: list[Ranked]
    probabilities: list[float]
    best: Candidate | None
    place: Located | None
    load: LoadFinding | None
    advice: str
    settings: Settings
    g_rows: list[int]
    n_values: float = 0.0
    sigma: float = 0.0
    rival: Rival | None = None
    further: Further | None = None
    driven: Driven | None = None
    off: RecordedOff | None = None
    interrupted: bool = False
    read: AsRead | None = None

    @property
    def given(self) -> Given:
        """What laws were tried on."""
        return Given(self.split, self.reduced, self.g_rows, self.null.p, self.settings)

    @property
    def by_load(self) -> bool:
        """Whether what is told is the load; one that was tried may have lost against a law, or against nothing."""
        return self.load is not None and self.best is None and self.verdict == "missing-physics"

    @property
    def misfit(self) -> float:
        """Mean weighted square that the final model leaves of the fit recordings: 1 is noise."""
        if self.further is not None:
            return self.further.terms.fitted
        if self.best is not None:
            return self.best.fitted
        return self.load.fit.score if self.load is not None and self.by_load else self.null.score

    @property
    def final(self) -> Candidate | None:
        """The candidate used for the final predictions; None for the updated model."""
        return self.best
