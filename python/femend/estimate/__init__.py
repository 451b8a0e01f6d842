"""Responses, residuals, sensitivities and least squares."""

from femend.estimate.fit import Fit, Hypothesis, Problem
from femend.estimate.lines import FitRecord, Lines, noise_of, spectral_lines, used_band

__all__ = ["Fit", "FitRecord", "Hypothesis", "Lines", "Problem", "noise_of", "spectral_lines", "used_band"]
