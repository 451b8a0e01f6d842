"""Turns of a test's geometry that its points do not tell apart: shapes do, where the structure is not symmetric."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from femend import Dof, correlate_study, model_modes, read_model
from femend.errors import PairingError

sys.path.insert(0, str(Path(__file__).parents[1]))
from bench_study import write_modes

TOPS = (11, 12, 13, 14)
# test X is model -Y, test Y is model X
TURN = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])


def table(soft: str) -> str:
    """A table on four clamped legs of 1 m; that at node 1 has the modulus `soft`."""
    corners = ((0, 0), (2, 0), (2, 1.2), (0, 1.2))
    lines = ["BEGIN BULK", "MAT1,1,2.1+11,,0.3,7850.", f"MAT1,2,{soft},,0.3,7850.", "SPC1,1,123456,1,THRU,4"]
    lines += [f"PBAR,{m},{m},1.-3,8.-7,5.-7,9.-7" for m in (1, 2)]
    for i, (x, y) in enumerate(corners, 1):
        lines += [f"GRID,{i},,{float(x)},{float(y)},0.", f"GRID,{10 + i},,{float(x)},{float(y)},1."]
        lines.append(f"CBAR,{i},{2 if i == 1 else 1},{i},{10 + i},1.,0.,0.")
        lines.append(f"CBAR,{20 + i},1,{10 + i},{11 + i % 4},0.,0.,1.")
    return "\n".join(["SOL 103", "CEND", "SPC = 1", *lines, "ENDDATA", ""])


def told(folder: Path, soft: str) -> tuple[dict[int, int], str, list[float]]:
    """The model's node of each sensor, the warnings and MACs, of the table's own modes measured in turned axes."""
    folder.mkdir()
    (folder / "model.bdf").write_text(table(soft))
    parameter = '[[parameter]]\nname = "E"\nproperty = "E"\nmaterial = 1\n[[recording]]\nname = "m"\nfile = "m.uff"\n'
    (folder / "study.toml").write_text(
        'format = "femend-study/1"\nmodel = { file = "model.bdf", units = "SI" }\n' + parameter
    )
    model = read_model(folder / "model.bdf")
    modes = model_modes(model, n_modes=4)
    phi = modes.phi[[modes.dofs.index(Dof(n, c)) for n in TOPS for c in (1, 2, 3)]]
    phi = np.einsum("ij,njm->nim", TURN, phi.reshape(4, 3, -1)).reshape(12, -1)
    places = {900 + n: tuple(TURN @ model.xyz[model.index(n)] + [0.3, -2.0, 0.1]) for n in TOPS}
    write_modes(
        folder / "m.uff", modes.freq, phi, tuple(Dof(900 + n, c) for n in TOPS for c in (1, 2, 3)), places=places
    )
    run = correlate_study(folder / "study.toml")
    pairs = run.prepared.placed.pairing
    mac = [row.mac for row in run.compared[0].comparison.table.rows]
    return {p.sensor.node: p.dof.node for p in pairs}, " ".join(run.result["warnings"]), mac


def test_shapes_choose_among_turns_that_fit_the_points_alike(tmp_path: Path) -> None:
    nodes, warnings, mac = told(tmp_path / "one soft leg", "4.+10")
    assert nodes == {900 + n: n for n in TOPS}
    assert min(mac) > 0.999
    assert "test X is model -Y, test Y is model X" in warnings
    assert "other turns or shifts fit as well; the one that shapes suit was taken, with a mean MAC of 1 in" in warnings
    assert "nearest to the frame as it is" not in warnings


def test_shapes_of_a_symmetric_structure_choose_nothing(tmp_path: Path) -> None:
    with pytest.raises(PairingError, match="8 turns and shifts fit alike"):
        told(tmp_path / "alike", "2.1+11")
