"""A patched deck is the updated model: anisotropic materials and plies, whose values stand on several fields."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from femend.io.deck import patch_deck
from femend.model import Parameter, read_model
from femend.study.result.patch import deck_changes

CORNERS = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
CARDS = [
    "MAT1,1,7.+10,,.3,2700.",
    "MAT8,2,1.4+11,9.+9,.3,5.+9,5.+9,3.+9,1600.",
    "MAT2,3,8.+10,2.+10,0.,7.+10,0.,3.+10,2000.",
    "MAT9,4,2.+11,8.+10,8.+10,0.,0.,0.,2.+11",
    "+,8.+10,0.,0.,0.,2.+11,0.,0.,0.",
    "+,7.+10,0.,0.,7.+10,0.,7.+10,7000.",
    "PCOMP,1",
    "+,2,.001,45.,YES,,,-45.",
    "+,1,.003,,,2,.002,90.",
    "PSHELL,2,3,.01,3",
    "PSOLID,3,4",
    *(f"GRID,{i + 1},,{x}.,{y}.,{z}." for i, (x, y, z) in enumerate(CORNERS)),
    "CQUAD4,1,1,1,2,3,4",
    "CTRIA3,2,2,5,6,7",
    "CHEXA,3,3,1,2,3,4,5,6",
    "+,7,8",
]


def test_the_patched_deck_has_the_matrices_of_the_factors(tmp_path: Path) -> None:
    parameters = [
        Parameter("fibre", "E", "material", (2,)),
        Parameter("shear", "G", "material", (2,)),
        Parameter("nu", "nu", "material", (2,)),
        Parameter("plane", "E", "material", (3,)),
        Parameter("solid", "E", "material", (4,)),
        Parameter("rho", "rho", "material", (2, 3, 4)),
        Parameter("plies", "t", "property_id", (1,)),
    ]
    file = tmp_path / "layers.bdf"
    file.write_text("\n".join(["BEGIN BULK", *CARDS, "ENDDATA", ""]))
    model = read_model(file, parameters=parameters)
    factors = {p.name: 0.8 + 0.1 * k for k, p in enumerate(parameters)}
    changes = deck_changes(model, {name: {"factor": factor} for name, factor in factors.items()})
    for path, text in patch_deck(model.deck, changes, ()).items():
        Path(path).write_bytes(text)
    patched = read_model(file)
    for ours, theirs in zip(model.matrices(factors), patched.matrices(), strict=True):
        np.testing.assert_allclose(ours.toarray(), theirs.toarray(), rtol=1e-9, atol=1e-9 * abs(ours).max())
