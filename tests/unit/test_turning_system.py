"""The matrices of a turning model: parts added with their ratios, preload, one pattern for all."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import scipy.sparse as sp

from femend.analysis.complex_frf import complex_frf
from femend.analysis.complex_modes import complex_modes
from femend.analysis.preload import stress_stiffness
from femend.analysis.rotor import gyroscopic_matrices
from femend.analysis.turning import TurningSystem, turning_system
from femend.data import Channel
from femend.dof import Dof
from femend.model import Model, read_model
from femend.model.reduced.one_pattern import on_one_pattern
from femend.model.terms.spinning import SpinningPart

X = (1.0, 0.0, 0.0)


def shaft(folder: Path) -> Model:
    """Twenty elements along X between hinges, discs on nodes 4 and 15, a loss factor, a damper at node 8."""
    deck = ["SOL 103", "CEND", "SPC = 1", "BEGIN BULK", "PARAM,COUPMASS,1", "MAT1,1,2.1+11,,0.3,7850.,,,0.01"]
    deck += ["PBAR,1,1,6.-4,5.-8,5.-8,1.-7", *(f"GRID,{i + 1},,{i / 20},0.,0." for i in range(21))]
    deck += [f"CBAR,{i},1,{i},{i + 1},0.,1.,0." for i in range(1, 21)]
    deck += ["CONM2,50,4,,2.", "+,0.04,,0.02,,,0.02", "CONM2,51,15,,3.", "+,0.06,,0.03,,,0.03"]
    deck += ["CDAMP2,90,30.,8,2", "CDAMP2,91,30.,8,3", "SPC1,1,1234,1", "SPC1,1,234,21", "ENDDATA", ""]
    (folder / "shaft.bdf").write_text("\n".join(deck))
    return read_model(folder / "shaft.bdf")


def test_parts_add_with_their_ratios_and_preload_stiffens(tmp_path: Path) -> None:
    model = shaft(tmp_path)
    parts = [SpinningPart(X, (50,)), SpinningPart(X, (51,), ratio=-2.0)]
    system = turning_system(model, parts, preload={Dof(21, 1): 5e4})
    one, _ = gyroscopic_matrices(model, X, elements=[50])
    two, _ = gyroscopic_matrices(model, X, elements=[51])
    assert system.G is not None
    np.testing.assert_allclose(system.G.toarray(), (one - 2.0 * two).toarray())
    K, _ = model.matrices()
    stress = stress_stiffness(model, {Dof(21, 1): 5e4})
    np.testing.assert_allclose(system.K.toarray(), (K + stress).toarray())
    assert system.S is None
    assert system.C is not None
    assert system.D is not None
    assert system.C.sum() == pytest.approx(60.0)
    at = system.matrix("damping", 3.0).toarray()
    np.testing.assert_allclose(at, system.C.toarray() + 3.0 * system.G.toarray())
    with pytest.raises(ValueError, match="neither 'damping' nor 'stiffness'"):
        system.matrix("mass", 1.0)
    loose = complex_modes(model, n_modes=4, parts=parts, speed=100.0)
    tight = complex_modes(model, n_modes=4, parts=parts, speed=100.0, preload={Dof(21, 1): 5e4})
    assert np.all(tight.modes.freq > loose.modes.freq)
    assert len(loose.modes.dofs) == 6 * 21


def test_frfs_of_a_turning_deck_are_those_of_its_matrices(tmp_path: Path) -> None:
    model = shaft(tmp_path)
    system = turning_system(model, [SpinningPart(X)])
    freq = np.linspace(5.0, 150.0, 60)
    out = [Channel(Dof(4, 2), "acceleration", "m/s^2"), Channel(Dof(15, 3, -1), "acceleration", "m/s^2")]
    into = [Channel(Dof(8, 2), "force", "N")]
    H = complex_frf(model, freq, out, into, parts=[SpinningPart(X)], speed=400.0, n_modes=8).H
    names = {(d.node, d.component): i for i, d in enumerate(system.dofs)}
    C, K = (system.matrix(a, 400.0).toarray() for a in ("damping", "stiffness"))
    load = np.zeros(len(names))
    load[names[8, 2]] = 1.0
    for i in (0, 21, 59):
        s = 2j * np.pi * freq[i]
        u = np.linalg.solve(s * s * system.M.toarray() + s * C + K, load) * s * s
        np.testing.assert_allclose(H[i, :, 0], [u[names[4, 2]], -u[names[15, 3]]], atol=1e-5 * np.abs(H).max())


def test_matrices_of_different_patterns_are_brought_to_one() -> None:
    rng = np.random.default_rng(4)
    given = [sp.random_array((9, 9), density=0.15, rng=rng, format="csc") for _ in range(3)]
    indptr, indices, values = on_one_pattern(given)
    for a, v in zip(given, values, strict=True):
        np.testing.assert_array_equal(sp.csc_array((v, indices, indptr), shape=(9, 9)).toarray(), a.toarray())
    full = sp.csc_array((np.ones(indices.size), indices, indptr), shape=(9, 9)).toarray()
    assert (full == full.T).all()
    assert full.diagonal().all()
    with pytest.raises(ValueError, match="there are 3 DOF names"):
        TurningSystem(given[0], given[1], tuple(Dof(i, 1) for i in (1, 2, 3)))
