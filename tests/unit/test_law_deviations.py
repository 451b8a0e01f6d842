"""Deviations of the parameters that a law is told by, where the spring beside it is told as part of it."""

from __future__ import annotations

import numpy as np
import pytest

from femend.diagnose.fitting.candidates import Candidate
from femend.physics import FitCoordinates, physics
from femend.study.result.findings import _law_sd


def test_the_share_of_a_spring_beside_a_loop_has_a_deviation() -> None:
    law = physics("bouc_wen")
    values = {"k": 3e4, "alpha": 0.0, "n": 1.5, "beta": 1e4, "gamma": 5e3}
    coordinates, k, k_scale, off = FitCoordinates(law, values), 1e4, 2e4, 0.02
    n = len(coordinates.free)
    x = np.concatenate([coordinates.start(), [k / k_scale, 0.0]])
    # the spring alone is uncertain, by 400 N/m
    covariance = np.zeros((n + 2, n + 2))
    covariance[n, n] = off**2
    best = Candidate(law, law.name, None, values, np.zeros(0), x, n, 0.0, 1.0, 1.0, k=k, covariance=covariance,
                     coordinates=coordinates, extra={"k_scale": k_scale, "c_scale": 1.0})  # fmt: skip
    sd = _law_sd(best, [p.name for p in law.parameters], None)
    assert sd["k"] == pytest.approx(off * k_scale)
    assert sd["alpha"] == pytest.approx(off * k_scale * (1 - 0.25) / 4e4)
    assert sd["n"] == sd["beta"] == 0.0
