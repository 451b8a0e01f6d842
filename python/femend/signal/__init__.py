"""From samples to spectra, FRFs, order tracks and operating shapes."""

from __future__ import annotations

from femend.signal.angular import AngleData, angular_orders, order_spectra, resample_angle
from femend.signal.calculus import to_quantity
from femend.signal.check import Fault, check_signals, find_gaps, notes_of, require_duration, require_sound
from femend.signal.frf import FrfEstimate, estimate_frf, h1, h2, hv
from femend.signal.impact import Hit, ImpactEstimate, find_hits, impact_frf
from femend.signal.ods import modal_peaks, ods_frf, ods_of_order, one_sided, peak_frequencies
from femend.signal.periodic import PeriodicEstimate, find_period, periodic_frf
from femend.signal.pulses import find_edges, repair_pulses
from femend.signal.resample import merge, resample, sample_at
from femend.signal.run_up import run_up_shapes
from femend.signal.spectra import (
    Correlations,
    SpectralMatrix,
    autospectra,
    correlations,
    cross_spectra,
    half_spectra,
)
from femend.signal.tacho import speed_from_edges, speed_from_profile, tacho_speed
from femend.signal.tacholess import refine_speed
from femend.signal.vold_kalman import vold_kalman
from femend.signal.windows import Window, exponential_window, force_window, make_window, without_window

__all__ = [
    "AngleData",
    "Correlations",
    "Fault",
    "FrfEstimate",
    "Hit",
    "ImpactEstimate",
    "PeriodicEstimate",
    "SpectralMatrix",
    "Window",
    "angular_orders",
    "autospectra",
    "check_signals",
    "correlations",
    "cross_spectra",
    "estimate_frf",
    "exponential_window",
    "find_edges",
    "find_gaps",
    "find_hits",
    "find_period",
    "force_window",
    "h1",
    "h2",
    "half_spectra",
    "hv",
    "impact_frf",
    "make_window",
    "merge",
    "modal_peaks",
    "notes_of",
    "ods_frf",
    "ods_of_order",
    "one_sided",
    "order_spectra",
    "peak_frequencies",
    "periodic_frf",
    "refine_speed",
    "repair_pulses",
    "require_duration",
    "require_sound",
    "resample",
    "resample_angle",
    "run_up_shapes",
    "sample_at",
    "speed_from_edges",
    "speed_from_profile",
    "tacho_speed",
    "to_quantity",
    "vold_kalman",
    "without_window",
]
