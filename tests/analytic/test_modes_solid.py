"""Modes of solids of several hundred DOFs against dense solutions: free cube, repeated modes, refilled stiffness."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.linalg
import scipy.sparse as sp

from femend import _core
from femend.errors import ModelError

TAU = 2 * np.pi
M = 5
"""Bricks along an edge: 648 DOFs, so that the iteration runs and not the dense solution of small models."""


@pytest.fixture
def cube(tmp_path: Path) -> _core.FeModel:
    """A free steel cube of M x M x M bricks in two materials, the split across Z."""

    def at(x: int, y: int, z: int) -> int:
        return (x * (M + 1) + y) * (M + 1) + z + 1

    lines = ["CEND", "BEGIN BULK", "PSOLID,1,1", "PSOLID,2,2", "MAT1,1,2.1+11,,0.3,7850.", "MAT1,2,2.1+11,,0.3,7850."]
    everywhere = [(x, y, z) for x in range(M + 1) for y in range(M + 1) for z in range(M + 1)]
    lines += [f"GRID,{at(*p)},,{p[0] * 0.02},{p[1] * 0.02},{p[2] * 0.02}" for p in everywhere]
    for e, (x, y, z) in enumerate((p for p in everywhere if max(p) < M), 1):
        face = [[at(x, y, w), at(x + 1, y, w), at(x + 1, y + 1, w), at(x, y + 1, w)] for w in (z, z + 1)]
        nodes = face[0] + face[1]
        lines.append(f"CHEXA,{e},{1 + (z < 2)},{','.join(map(str, nodes[:6]))}\n,{','.join(map(str, nodes[6:]))}")
    path = tmp_path / "cube.bdf"
    path.write_text("\n".join([*lines, "ENDDATA", ""]))
    parameters = [("E1", "E", "material", [1]), ("E2", "E", "material", [2]), ("rho", "rho", "material", [1, 2])]
    return _core.FeModel(_core.Deck.read(str(path)), parameters=parameters)


def dense(indptr: np.ndarray, indices: np.ndarray, k: np.ndarray, m: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    K, mass = (sp.csc_matrix((v, indices, indptr)).toarray() for v in (k, m))
    lam, phi = scipy.linalg.eigh(K, mass)
    return lam, phi


def test_free_cube_has_six_rigid_modes_and_all_its_repeated_ones(cube: _core.FeModel) -> None:
    indptr, indices, k, m, _, _ = cube.assemble()
    lam, _ = dense(indptr, indices, k, m)
    freq, phi, residual, info = _core.modes(indptr, indices, k, m, n_modes=26)
    assert info["n_rigid"] == 6
    assert (freq[:6] == 0).all()
    assert info["counted"] >= 26
    np.testing.assert_allclose((TAU * freq[6:]) ** 2, lam[6:26], rtol=1e-9)
    # a cube's modes come in pairs and triples
    assert (np.diff(freq[6:]) < 1e-8 * freq[6:-1]).sum() >= 8
    assert residual.max() < 1e-7
    mass = sp.csc_matrix((m, indices, indptr))
    assert np.abs(phi.T @ (mass @ phi) - np.eye(26)).max() < 1e-9


def test_band_ends_inside_a_repeated_mode_nowhere(cube: _core.FeModel) -> None:
    """A number of modes that cuts a triple still gives that number, and the count tells how many lie below."""
    indptr, indices, k, m, _, _ = cube.assemble()
    lam, _ = dense(indptr, indices, k, m)
    top = np.sqrt(lam[:40].clip(0)) / TAU
    ends = 0.5 * (top[12:30] + top[13:31])
    for end in ends[np.diff(top[12:31]) > 1e-3 * top[13:31]][:3]:
        found = _core.modes(indptr, indices, k, m, f_max=end)
        assert found[0].size == (top < end).sum() == found[3]["counted"]


def warm_and_cold(cube: _core.FeModel) -> tuple[Any, Any, Any]:
    """Modes of the cube at new factors from those before and from cold, and the changed stiffness."""
    indptr, indices, k, m, _, _ = cube.assemble()
    symbolic = _core.Symbolic(indptr, indices)
    before = _core.modes(indptr, indices, k, m, n_modes=24, symbolic=symbolic)[1]
    refilled = np.empty_like(k)
    cube.refill("K", np.array([1.05, 0.95, 1.0]), refilled)
    cold = _core.modes(indptr, indices, refilled, m, n_modes=20)
    return _core.modes(indptr, indices, refilled, m, n_modes=20, start=before, symbolic=symbolic), cold, refilled


def test_warm_shapes_are_as_sharp_as_cold_ones(cube: _core.FeModel) -> None:
    warm, cold, _ = warm_and_cold(cube)
    assert cold[2].max() < 1e-7
    assert warm[2].max() < 1e-7


def test_warm_start_finds_what_a_cold_one_does(cube: _core.FeModel) -> None:
    indptr, indices, _, m, _, _ = cube.assemble()
    warm, cold, refilled = warm_and_cold(cube)
    # an eigenvalue's error is about the square of the residual, the rest is rounding of the factor
    np.testing.assert_allclose(warm[0][6:], cold[0][6:], rtol=1e-9)
    assert warm[3]["n_rigid"] == 6
    assert warm[2].max() < 1e-5
    exact, _ = dense(indptr, indices, refilled, m)
    np.testing.assert_allclose((TAU * warm[0][6:]) ** 2, exact[6:20], rtol=1e-9)


def test_refill_equals_assembly(cube: _core.FeModel) -> None:
    factors = np.array([1.3, 0.8, 1.1])
    whole = dict(zip("KMCH", cube.assemble(factors)[2:], strict=True))
    assert cube.affine
    for name, values in whole.items():
        out = np.full_like(values, np.nan)
        cube.refill(name, factors, out)
        np.testing.assert_array_equal(out, values)
    # dK of both materials is all of K: K at one factor for both is K scaled
    nominal, out = cube.assemble()[2], np.empty_like(whole["K"])
    cube.refill("K", np.array([2.0, 2.0, 1.0]), out)
    np.testing.assert_allclose(out, 2 * nominal, rtol=1e-12, atol=1e-12 * nominal.max())
    by_hand = nominal + 0.3 * cube.derivative(0)[0] - 0.2 * cube.derivative(1)[0]
    np.testing.assert_allclose(whole["K"], by_hand, rtol=0, atol=1e-12 * nominal.max())
    with pytest.raises(ValueError, match="matrix 'L' is unknown"):
        cube.refill("L", factors, out)
    with pytest.raises(ModelError, match="the array"):
        cube.refill("K", factors, out[:-1].copy())
