"""From samples to spectra, FRFs, order tracks and operating shapes."""

from __future__ import annotations

from femend.signal.frf import FrfEstimate, estimate_frf, h1, h2, hv
from femend.signal.tacho import speed_from_edges, speed_from_profile, tacho_speed
from femend.signal.vold_kalman import vold_kalman
from femend.signal.windows import without_window

__all__ = [
    "FrfEstimate",
    "estimate_frf",
    "h1",
    "h2",
    "hv",
    "speed_from_edges",
    "speed_from_profile",
    "tacho_speed",
    "vold_kalman",
    "without_window",
]
