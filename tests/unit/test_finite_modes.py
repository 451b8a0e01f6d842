"""A diagnosis of a deck in which few DOFs have a mass has as many modes as there are."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from femend.model import read_model
from femend.model.reduced.reduction import reduce_model

DECK = """CEND
SPC=1
BEGIN BULK
GRID,1,,0.,0.,0.
GRID,2,,1.,0.,0.
GRID,3,,2.,0.,0.
CELAS2,1,4.+4,1,1
CELAS2,2,6.+4,1,1,2,1
CELAS2,3,6.+4,2,1,3,1
CONM2,11,1,,2.
CONM2,13,3,,1.
SPC1,1,23456,1,2,3
ENDDATA
"""


def test_a_node_without_mass_between_two_masses(tmp_path: Path) -> None:
    (tmp_path / "model.bdf").write_text(DECK)
    model = read_model(tmp_path / "model.bdf")
    reduced = reduce_model(model, 50.0, [6 * i for i in range(3)])
    # two masses on springs of 4e4 and 3e4 N/m
    K, M = np.array([[7e4, -3e4], [-3e4, 3e4]]), np.diag([2.0, 1.0])
    expected = np.sqrt(np.linalg.eigvals(np.linalg.solve(M, K)))
    assert reduced.freq[:2] == pytest.approx(np.sort(expected) / (2 * np.pi), rel=1e-9)
