"""Exact derivatives of beams with a neutral axis of their own and of anisotropic pyramids, against differences."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from femend import _core

CARDS = [
    "MAT1,1,2.1+11,,.3,7850.,,,.02",
    "PBEAM,1,1,6.-4,5.-8,2.-8,,3.-8,.4",
    "+",
    "+,0.,0.",
    "+,.01,.04,,,.03,-.02",
    "MAT9,2,1.+11,3.+10,0.,0.,0.,0.,1.1+11",
    "+,0.,0.,0.,0.,1.2+11,0.,0.,0.",
    "+,5.+10,0.,0.,6.+10,0.,7.+10,3000.",
    "PSOLID,2,2",
    "GRID,1",
    "GRID,2,,1.,0.,0.",
    "CBEAM,1,1,1,2,0.,1.,0.",
    *(f"GRID,{11 + i},,{x},{y},{z}" for i, (x, y, z) in enumerate([(0.0, 0.0, 1.0), (1.1, 0.1, 1.0), (1.2, 0.9, 1.0)])),
    "GRID,14,,-.1,1.,1.",
    "GRID,15,,.4,.5,2.",
    "CPYRAM,20,2,11,12,13,14,15",
]
PARAMETERS = [("E", "material", 1), ("rho", "material", 1), ("A", "property_id", 1), ("I1", "property_id", 1)]
PARAMETERS += [("J", "property_id", 1), ("E", "material", 2), ("rho", "material", 2)]


@pytest.mark.parametrize("i", range(len(PARAMETERS)))
def test_derivatives_equal_differences(i: int, tmp_path: Path) -> None:
    file = tmp_path / "model.bdf"
    file.write_text("\n".join(["BEGIN BULK", "PARAM,COUPMASS,1", *CARDS, "ENDDATA", ""]))
    specs = [(f"{name}{k}", name, target, [id_]) for k, (name, target, id_) in enumerate(PARAMETERS)]
    fe = _core.FeModel(_core.Deck.read(file), None, specs, [])
    factors = 0.95 + 0.02 * np.arange(len(specs))
    step = 1e-4 * np.eye(len(specs))[i]
    high, low = fe.assemble(factors + step)[2:], fe.assemble(factors - step)[2:]
    changed = False
    for exact, above, below in zip(fe.derivative(i, factors), high, low, strict=True):
        size = float(abs(exact).max())
        changed |= size > 0.0
        np.testing.assert_allclose((above - below) / 2e-4, exact, rtol=0, atol=1e-6 * size + 1e-10 * abs(above).max())
    assert changed
