"""A skew space frame of Timoshenko beams with nodal masses, against OpenSees: same theory, so the same digits."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[1]))
import fe

E, NU = 7e10, 0.33
G = E / (2 * (1 + NU))
A, I1, I2, J, K = 6e-4, 5e-8, 2e-8, 3e-8, 0.4
XYZ = [(0, 0, 0), (0.1, 0, 0.5), (0.6, 0.2, 0.6), (0.7, -0.1, 0), (0.2, 0.5, 0.5), (0.9, 0.6, 0.4), (0.3, 0.7, 0)]
PAIRS = [(1, 2), (2, 3), (3, 4), (2, 5), (3, 6), (5, 6), (5, 7)]
ORIENTATION = (0.3, 1.0, 0.2)
HELD = (1, 4, 7)


def deck() -> list[str]:
    """The frame as cards; the masses are the only inertia."""
    cards = [f"MAT1,1,{E},,{NU},0.", f"PBAR,1,1,{A},{I1},{I2},{J}", "+,", f"+,{K},{K}"]
    cards += [f"GRID,{i + 1},,{x!r},{y!r},{z!r}" for i, (x, y, z) in enumerate(np.array(XYZ, float).tolist())]
    v = ",".join(str(c) for c in ORIENTATION)
    cards += [f"CBAR,{i + 1},1,{a},{b},{v}" for i, (a, b) in enumerate(PAIRS)]
    for node in (2, 3, 5, 6):
        cards += [f"CONM2,{100 + node},{node},,{0.5 + 0.1 * node}", f"+,0.002,,0.003,,,0.{node:03d}"]
    return [*cards, "SPC1,1,123456," + ",".join(str(n) for n in HELD)]


def opensees_omega() -> np.ndarray:
    """Angular frequencies of all 24 DOFs."""
    ops = pytest.importorskip("openseespy.opensees", reason="OpenSeesPy is not installed (pip install openseespy)")
    ops.wipe()
    ops.model("basic", "-ndm", 3, "-ndf", 6)
    for i, point in enumerate(np.array(XYZ, float).tolist()):
        ops.node(i + 1, *point)
    for node in HELD:
        ops.fix(node, *[1] * 6)
    for node in (2, 3, 5, 6):
        m = 0.5 + 0.1 * node
        ops.mass(node, m, m, m, 0.002, 0.003, float(f"0.{node:03d}"))
    for i, (a, b) in enumerate(PAIRS):
        # the vector lies in the local x-z plane there: z = x cross (our y)
        axis = np.subtract(XYZ[b - 1], XYZ[a - 1])
        z = np.cross(axis, ORIENTATION)
        ops.geomTransf("Linear", i + 1, *(z / np.linalg.norm(z)).tolist())
        ops.element("ElasticTimoshenkoBeam", i + 1, a, b, E, G, A, J, I2, I1, K * A, K * A, i + 1)
    values = np.array(ops.eigen("-fullGenLapack", 23))
    ops.wipe()
    return np.sqrt(values)


def test_frequencies_equal_those_of_opensees(tmp_path: Path) -> None:
    """Ten digits: both programs hold the exact Timoshenko stiffness."""
    ours = fe.low_omega(*fe.matrices(fe.model(tmp_path, deck())))
    assert len(ours) == 24
    np.testing.assert_allclose(ours[:23], opensees_omega(), rtol=1e-8)
