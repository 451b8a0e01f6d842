"""Preloaded and spinning models from Python: stress stiffness, gyroscopic matrices, their errors."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
import scipy.linalg

from femend.analysis.preload import static_displacement, stress_stiffness
from femend.analysis.rotor import gyroscopic_matrices
from femend.dof import Dof
from femend.errors import ModelError, PairingError, SingularModelError
from femend.model import Model, Parameter, read_model

L, A, I = 1.0, 6e-4, 5e-8
HINGES = ["SPC1,1,1234,1", "SPC1,1,234,11"]


def shaft(folder: Path, cards: list[str] = HINGES, **options: object) -> Model:
    """A beam of ten elements along X with a disc on node 4."""
    deck = ["SOL 103", "CEND", "SPC = 1", "BEGIN BULK", "PARAM,COUPMASS,1", "MAT1,1,2.1+11,,0.3,7850."]
    deck += [f"PBAR,1,1,{A},{I},{I},{2 * I}", *(f"GRID,{i + 1},,{L * i / 10},0.,0." for i in range(11))]
    deck += [f"CBAR,{i},1,{i},{i + 1},0.,1.,0." for i in range(1, 11)]
    deck += ["CONM2,50,4,,2.", "+,0.04,,0.02,,,0.02"]
    file = folder / "shaft.bdf"
    file.write_text("\n".join([*deck, *cards, "ENDDATA", ""]))
    return read_model(file, **options)  # type: ignore[arg-type]


def test_a_preload_near_eulers_load_takes_the_stiffness_away(tmp_path: Path) -> None:
    model = shaft(tmp_path, parameters=[Parameter("E", "E", "material", (1,))])
    euler = 2.1e11 * I * (math.pi / L) ** 2
    K, M = (a.toarray() for a in model.matrices())
    sigma = stress_stiffness(model, {Dof.parse("11:-X"): euler}).toarray()
    np.testing.assert_allclose(sigma, sigma.T, atol=1e-9 * abs(sigma).max())
    # bending in two planes buckles at the same load
    low = scipy.linalg.eigh(K + sigma, M, eigvals_only=True)[:2]
    free = scipy.linalg.eigh(K, M, eigvals_only=True)[0]
    assert np.all(abs(low) < 1e-3 * free)
    # under the same force, half the modulus has twice the strain and the same stress
    soft = stress_stiffness(model, {Dof.parse("11:-X"): euler}, factors={"E": 0.5}).toarray()
    np.testing.assert_allclose(soft, sigma, atol=1e-6 * abs(sigma).max())


def test_static_displacement_is_that_of_a_stretched_bar(tmp_path: Path) -> None:
    model = shaft(tmp_path)
    u = model.transformation() @ static_displacement(model, {Dof.parse("11:X"): 1000.0})
    assert u[model.row(Dof.parse("11:X"))] == pytest.approx(1000.0 * L / (2.1e11 * A), rel=1e-9)


def test_a_disc_couples_its_tilts_by_its_polar_inertia(tmp_path: Path) -> None:
    model = shaft(tmp_path)
    G, S = gyroscopic_matrices(model, (3.0, 0.0, 0.0), elements=[50])
    assert abs(S).max() == 0.0
    names = [(int(n), int(c)) for n, c in zip(model.fe.dof_nodes, model.fe.dof_components, strict=True)]
    ry, rz = names.index((4, 5)), names.index((4, 6))
    assert G[ry, rz] == pytest.approx(0.04)
    assert G[rz, ry] == pytest.approx(-0.04)
    assert abs(G).sum() == pytest.approx(0.08)
    both, soft = gyroscopic_matrices(model, (1.0, 0.0, 0.0), axes="rotating")
    np.testing.assert_allclose(both.toarray(), -both.toarray().T)
    assert soft.toarray().min() < 0.0


def test_what_cannot_be_loaded_or_spun_is_refused(tmp_path: Path) -> None:
    free = shaft(tmp_path, ["SPC1,1,1,1"])
    with pytest.raises(SingularModelError, match="without resistance"):
        stress_stiffness(free, {Dof.parse("5:Y"): 1.0})
    model = shaft(tmp_path)
    with pytest.raises(PairingError, match="no node 77"):
        stress_stiffness(model, {Dof.parse("77:Y"): 1.0})
    with pytest.raises(ModelError, match="CBAR 1 is not parallel|CBAR 1: is not parallel"):
        gyroscopic_matrices(model, (0.0, 1.0, 0.0))
    with pytest.raises(ModelError, match="element 77"):
        gyroscopic_matrices(model, (1.0, 0.0, 0.0), elements=[77])
    with pytest.raises(ModelError, match="spin axis"):
        gyroscopic_matrices(model, (0.0, 0.0, 0.0))
