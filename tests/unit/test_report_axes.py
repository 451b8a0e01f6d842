"""Every picture of the report says what its axes are, with numbers on them."""

from __future__ import annotations

import re

import numpy as np
import pytest

from femend.report.content import TimeOverlay
from femend.report.figures import trace_figure
from femend.report.mismatch_map import _key


def texts(svg: str) -> list[str]:
    return re.findall(r"<text[^>]*>([^<]*)</text>", svg)


@pytest.mark.parametrize("peak", [0.2, 1.9, 314.0, 390.0, 7500.0])
def test_both_parts_of_a_time_trace_have_scales_and_names(peak: float) -> None:
    t = np.arange(0.0, 5.0, 0.001)
    measured = peak * np.sin(30 * t)
    found = texts(trace_figure(TimeOverlay(t, measured, 0.5 * measured, 0.9 * measured, 0.99 * measured)))
    assert found.count("time, s") == 2
    named = found.index("recording and errors, m/s²")
    upper = found[: named + 1]
    levels = [float(text.replace("−", "-")) for text in upper if re.fullmatch(r"−[\d.]+", text)]
    assert levels
    assert 0.3 * peak < -min(levels) <= 1.05 * peak


def test_the_colours_of_the_mismatch_map_are_named() -> None:
    assert "share of the misfit that a free force there leaves" in texts(_key(0.01))
