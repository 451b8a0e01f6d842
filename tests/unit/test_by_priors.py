"""A law that takes back what an update paid its priors for is named, and what the name rests on is told."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from femend.diagnose.deciding.accepted import accepted, share_taken
from femend.diagnose.deciding.by_priors import rests_on_priors
from femend.diagnose.deciding.outcome import Diagnosis
from femend.diagnose.naming.ranked import Ranked
from femend.diagnose.naming.shares import score_of_noise
from femend.report.headline import BY_PRIORS, headline
from femend.study.result.study_run import StudyRun
from femend.study.run import diagnose

sys.path.insert(0, str(Path(__file__).parents[1]))
from small_study import PARAMETERS, Truth, write_study

# misfit of an updated model below the noise as it was estimated, what a free force leaves of it, and the cost of the
# priors that it leaves for that
AT_NOISE, FREE, PAID = 0.69, 0.63, 400.0


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> Diagnosis:
    truth = Truth((7.0e10, 7.0e10), more=("CELAS2,900,2.+4,7,3",))
    run = diagnose(write_study(tmp_path_factory.mktemp("spring"), truth))
    assert isinstance(run, StudyRun)
    assert run.diagnosis.best is not None
    return run.diagnosis


def bent(found: Diagnosis, law: float = 0.68, paid: float = 14.0) -> tuple[Diagnosis, Ranked]:
    """The diagnosis as of a model that explains the recordings by bending its first parameter eight deviations, and of
    a law that leaves the misfit `law` with `paid` of prior cost."""
    p = found.null.p.copy()
    p[0] = -8 * PARAMETERS[0].prior_sd
    null = replace(found.null, p=p, misfit=np.full_like(found.null.misfit, AT_NOISE))
    chosen = replace(found.null_chosen, chosen=AT_NOISE, prior=PAID)
    score, null_score = (found.n_values * float(np.log(one)) + cost for one, cost in ((law, paid), (AT_NOISE, PAID)))
    first = found.ranked[0]
    candidate = replace(first.candidate, chosen=law, prior=paid, reference=FREE)
    best = replace(first, score=score, candidate=candidate)
    ranked = [best, *found.ranked[1:]]
    return replace(found, null=null, null_chosen=chosen, null_score=null_score, ranked=ranked), best


def test_at_the_noise_the_share_is_that_of_the_priors(found: Diagnosis) -> None:
    whole, best = bent(found)
    assert score_of_noise(whole.ranked, whole.n_values) < best.score
    assert share_taken(whole, best) == pytest.approx((PAID - 14) / PAID)
    assert accepted(whole, best)


def test_a_law_that_leaves_more_or_relieves_half_takes_no_share_of_them(found: Diagnosis) -> None:
    whole, best = bent(found, law=0.72)
    assert share_taken(whole, best) < (PAID - 14) / PAID
    half, other = bent(found, paid=PAID / 2)
    assert share_taken(half, other) == pytest.approx(0.5, abs=0.1)
    assert not accepted(half, other)


def test_far_from_the_noise_the_misfit_counts(found: Diagnosis) -> None:
    whole, best = bent(found)
    far = replace(whole, null_chosen=replace(whole.null_chosen, chosen=1.5))
    assert share_taken(far, best) < (PAID - 14) / PAID


def test_what_the_name_rests_on_is_told(found: Diagnosis) -> None:
    assert found.verdict == "missing-physics"
    assert rests_on_priors(found) == ""
    whole, _ = bent(found)
    told = rests_on_priors(whole)
    assert f"'{PARAMETERS[0].name}' at 0.449" in told
    assert "8 of its prior standard deviations" in told
    assert "rests on these priors" in told


def test_the_headline_tells_no_errors_that_are_the_same() -> None:
    result: dict[str, Any] = {
        "verdict": "missing-physics",
        "findings": [
            {
                "physics": "support_stiffness",
                "probability": 0.95,
                "location": {"nodes": [7], "to": "ground", "direction": "Z"},
                "parameters": {"k": {"value": 2.0e4, "sd": 500.0, "unit": "N/m"}},
                "rests_on": "priors",
            }
        ],
        "fit": [{"recording": "low", "role": "fit", "nominal": 0.5, "parameters": 0.006, "final": 0.006}],
    }
    assert headline(result).endswith(f"{BY_PRIORS}.")
    held_out = {"recording": "mid", "role": "validate", "nominal": 0.5, "parameters": 0.09, "final": 0.02}
    told = headline(result | {"fit": [*result["fit"], held_out]})
    assert told.endswith(f"{BY_PRIORS}; prediction error on unseen recordings 0.09 → 0.02.")
