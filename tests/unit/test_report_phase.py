"""The phase of an FRF in the report is cut where it seldom is, and no line is drawn from one side of the cut to the
other."""

from __future__ import annotations

import re

import numpy as np

from femend.report.content import FrfOverlay
from femend.report.figures import frf_figure

FREQ = np.linspace(1.0, 100.0, 400)


def phase_lines(H: np.ndarray) -> list[tuple[float, float]]:
    """Vertical extent of every stroke of the measured phase, in the picture's units."""
    svg = frf_figure(FrfOverlay(FREQ, H, label="4:+Z", recording="low"))
    path = re.findall(r'class="curve measured" d="([^"]*)"', svg)[1]
    return [(float(x), float(y)) for x, y in re.findall(r"l(-?[\d.]+) (-?[\d.]+)", path)]


def test_noise_about_180_degrees_is_a_line_and_not_a_block() -> None:
    noise = np.random.default_rng(1).standard_normal(FREQ.size)
    strokes = phase_lines(-np.exp(0.1j * noise))
    # the picture is 56 high for 360 degrees: three deviations to either side are 6
    assert len(strokes) > 300
    assert max(abs(dy) for _, dy in strokes) < 8


def test_a_phase_that_turns_on_and_on_breaks_at_the_cut() -> None:
    strokes = phase_lines(np.exp(-0.2j * np.arange(FREQ.size)))
    assert max(abs(dy) for _, dy in strokes) < 3
