"""Rods have no axes across them, and waves of stretching alone."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from femend.model import read_model, reduce_model
from femend.model.mesh.resolution import mode_resolution
from femend.model.reduced.beam_waves import beam_of

LENGTH, ELEMENTS = 1.0, 10
RODS = "".join(f"CROD,{i},1,{i},{i + 1}\n" for i in range(1, ELEMENTS + 1))
GRIDS = "".join(f"GRID,{i},,{(i - 1) * LENGTH / ELEMENTS},0.0,0.0,,{'123456' if i == 1 else '23456'}\n"
                for i in range(1, ELEMENTS + 2))  # fmt: skip
DECK = f"BEGIN BULK\n{GRIDS}{RODS}PROD,1,1,1.0-4\nMAT1,1,7.0+10,,0.3,2700.0\nENDDATA\n"


@pytest.mark.parametrize("card", ["CROD,{0},1,{0},{1}", "CONROD,{0},{0},{1},1,1.0-4"])
def test_a_rod_is_off_by_its_wave_of_stretching(tmp_path: Path, card: str) -> None:
    file = tmp_path / "rod.bdf"
    rods = "".join(card.format(i, i + 1) + "\n" for i in range(1, ELEMENTS + 1))
    file.write_text(DECK.replace(RODS, rods))
    model = read_model(file)
    found = mode_resolution(reduce_model(model, 8000.0, []), 8000.0)
    # a held rod: f = (2 n - 1) c / 4 L; lumped or consistent masses are off by (k h)^2 / 24
    c = np.sqrt(7.0e10 / 2700.0)
    exact = (2 * np.arange(1, len(found.freq) + 1) - 1) * c / (4 * LENGTH)
    off = found.freq / exact - 1
    np.testing.assert_allclose(found.error, off, rtol=0.05, atol=1e-6)
    assert abs(found.error[2]) > 1e-3


def test_axes_of_a_rod_stand_on_each_other(tmp_path: Path) -> None:
    file = tmp_path / "rod.bdf"
    file.write_text(DECK)
    model = read_model(file)
    beam = beam_of(model, 3, "CROD", (3, 4))
    assert beam is not None
    np.testing.assert_allclose(beam.axes @ beam.axes.T, np.eye(3), atol=1e-12)
    np.testing.assert_allclose(beam.axes[0], [1.0, 0.0, 0.0], atol=1e-12)
    assert beam.length == pytest.approx(LENGTH / ELEMENTS)
