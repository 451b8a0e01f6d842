"""What the report draws of a model and of recordings: skins, supports, sensors, frequency responses."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from femend.data import Channel, Recording, Test, TimeData
from femend.dof import Dof
from femend.model import Model, pair_sensors, read_model
from femend.study.shown.curves import frf_estimate
from femend.study.shown.picture import markers, mesh_picture

BRICKS = """\
CEND
SPC = 1
BEGIN BULK
GRID,1,,0.,0.,0.
GRID,2,,1.,0.,0.
GRID,3,,1.,1.,0.
GRID,4,,0.,1.,0.
GRID,5,,0.,0.,1.
GRID,6,,1.,0.,1.
GRID,7,,1.,1.,1.
GRID,8,,0.,1.,1.
GRID,9,,0.,0.,2.
GRID,10,,1.,0.,2.
GRID,11,,1.,1.,2.
GRID,12,,0.,1.,2.
GRID,13,,0.,0.,3.
CHEXA,1,1,1,2,3,4,5,6,+
+,7,8
CHEXA,2,1,5,6,7,8,9,10,+
+,11,12
PSOLID,1,1
MAT1,1,2.+11,,.3,7800.
CBAR,3,2,9,13,1.,0.,0.
PBAR,2,1,1.-4,1.-8,1.-8,1.-8
SPC1,1,123,1,2,3,4
ENDDATA
"""


@pytest.fixture
def bricks(tmp_path: Path) -> Model:
    """Two bricks on top of each other with a rod on one corner, held below."""
    path = tmp_path / "bricks.bdf"
    path.write_text(BRICKS)
    return read_model(path)


def test_of_solids_the_outer_skin_is_drawn(bricks: Model) -> None:
    picture = mesh_picture(bricks)
    shared = {5, 6, 7, 8}
    faces = [{int(picture.node_ids[k]) for k in face} for face in picture.faces]
    assert len(faces) == 10
    assert shared not in faces
    assert [[int(picture.node_ids[k]) for k in line] for line in picture.lines] == [[9, 13]]
    assert picture.supports == (1, 2, 3, 4)
    assert picture.unit == "m"


def test_sensors_stand_where_they_are_paired_and_point_where_they_measure(bricks: Model) -> None:
    channels = (
        Channel(Dof(11, 1, -1), "acceleration", "m/s^2", "top"),
        Channel(Dof(9, 3, 1), "force", "N", "shaker"),
    )
    data = TimeData("r", 0.01, np.ones((2, 4)), channels)
    test = Test((Recording("r", data),))
    sensors, shakers = markers(test, bricks, pair_sensors(channels, bricks.node_ids, bricks.xyz))
    assert [(m.node, m.vector, m.distance) for m in sensors] == [(11, (-1.0, 0.0, 0.0), 0.0)]
    assert [(m.node, m.vector) for m in shakers] == [(9, (0.0, 0.0, 1.0))]


@pytest.mark.parametrize("period", [0, 512])
def test_frf_estimate_finds_the_frf(period: int) -> None:
    rng = np.random.default_rng(0)
    n, dt = 2048, 1e-3
    spectrum = np.zeros(257, dtype=complex)
    spectrum[1:200:2] = np.exp(2j * np.pi * rng.random(100))
    u = np.tile(np.fft.irfft(spectrum), 4) if period else rng.normal(size=n)

    def frf(f: np.ndarray) -> np.ndarray:
        return 2.0 / (1.0 + 1j * f / 150.0)

    y = np.fft.irfft(np.fft.rfft(u) * frf(np.fft.rfftfreq(n, dt)))[None]
    freq, H = frf_estimate(u, y, dt, period)
    assert H.shape == (len(freq), 1)
    assert np.abs(H[:, 0] - frf(freq)).max() < (1e-9 if period else 0.02)
    if period:  # the lines the multisine leaves out are left out
        assert len(freq) == 100
