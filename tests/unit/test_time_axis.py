"""FRFs that end far below the model's modes are told as a mistaken time axis."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from femend import FRF, Channel, Dof
from femend.bench.compared import modelled_frf
from femend.errors import CorrelationError
from femend.model import read_model


def test_milliseconds_read_as_seconds(tmp_path: Path) -> None:
    deck = ["SOL 103", "CEND", "SPC = 1", "BEGIN BULK", "GRID,1,,0.,0.,0.", "CELAS2,1,1.+6,1,3", "CONM2,2,1,,1."]
    (tmp_path / "m.bdf").write_text("\n".join([*deck, "SPC1,1,12456,1", "ENDDATA", ""]))
    model, dof = read_model(tmp_path / "m.bdf"), Dof(1, 3)
    ends = (Channel(dof, "acceleration", "m/s^2"),), (Channel(dof, "force", "N"),)
    frf = FRF("hit", np.linspace(0.01, 0.5, 20), np.ones((20, 1, 1), complex), *ends, "accelerance", "(m/s^2)/N")
    with pytest.raises(CorrelationError, match=r"'hit' end at 0.5 Hz.*milliseconds"):
        modelled_frf(frf, model, {dof: dof}, {}, 0.01)
