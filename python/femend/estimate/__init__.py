"""Responses, residuals, sensitivities and least squares."""

from femend.estimate.bands import further_band, modelled_band, used_band
from femend.estimate.cross_axis import ForcesBeside, crossed, with_across
from femend.estimate.fit import Fit, Hypothesis, Problem
from femend.estimate.left_out import without_crossed, without_still
from femend.estimate.lines import FitRecord, Lines, noise_floor, spectral_lines
from femend.estimate.noise import noise_of
from femend.estimate.prepare import check_sampling, fit_records, pair_test, period_of
from femend.estimate.rest import at_work
from femend.estimate.swept import in_turn, pressed

__all__ = [
    "ForcesBeside",
    "Fit",
    "FitRecord",
    "Hypothesis",
    "Lines",
    "Problem",
    "at_work",
    "check_sampling",
    "crossed",
    "fit_records",
    "further_band",
    "in_turn",
    "modelled_band",
    "noise_floor",
    "noise_of",
    "pair_test",
    "period_of",
    "pressed",
    "spectral_lines",
    "used_band",
    "with_across",
    "without_crossed",
    "without_still",
]
