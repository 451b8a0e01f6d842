"""Responses, residuals, sensitivities and least squares."""

from femend.estimate.fit import Fit, Hypothesis, Problem
from femend.estimate.lines import FitRecord, Lines, modelled_band, noise_floor, noise_of, spectral_lines, used_band
from femend.estimate.prepare import check_sampling, fit_records, pair_test, period_of

__all__ = [
    "Fit",
    "FitRecord",
    "Hypothesis",
    "Lines",
    "Problem",
    "check_sampling",
    "fit_records",
    "modelled_band",
    "noise_floor",
    "noise_of",
    "pair_test",
    "period_of",
    "spectral_lines",
    "used_band",
]
