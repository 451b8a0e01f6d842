"""Complex modes of large models against scipy's Arnoldi on the state space, and what they cost."""

from __future__ import annotations

import time

import numpy as np
import pytest
import scipy.sparse as sp
import scipy.sparse.linalg as sla

from femend.analysis.complex_modes import complex_modes
from femend.analysis.turning import TurningSystem
from femend.dof import Dof


def box(n: int, seed: int) -> TurningSystem:
    """n^3 points of three DOFs: each a net of springs, local dashpots, a loss that differs from half to half,
    Coriolis terms."""
    rng = np.random.default_rng(seed)
    line = sp.diags_array([-np.ones(n - 1), np.full(n, 2.0), -np.ones(n - 1)], offsets=[-1, 0, 1])
    line = line - sp.diags_array([np.r_[np.zeros(n - 1), 1.0]], offsets=[0])
    one = sp.eye_array(n)
    shape = (1.0, 0.35, 1.7)
    net = sum(
        w * sp.kron(sp.kron(a, b), c)
        for w, (a, b, c) in zip(shape, ((line, one, one), (one, line, one), (one, one, line)), strict=True)
    )
    size = n**3
    K = sp.csc_array(1e4 * sp.kron(net, sp.diags_array([[1.0, 1.3, 1.9]], offsets=[0])))
    M = sp.csc_array(sp.eye_array(3 * size))
    c = np.zeros(3 * size)
    c[rng.choice(3 * size, 20, replace=False)] = 300.0
    weight = sp.diags_array([np.where(np.arange(3 * size) < 1.5 * size, 1.0, 0.1)], offsets=[0])
    C = sp.csc_array(sp.diags_array([c], offsets=[0]) + 2e-3 * (weight @ M))
    turn = np.zeros((3, 3))
    turn[0, 1], turn[1, 0] = -2.0, 2.0
    G = sp.csc_array(sp.kron(sp.eye_array(size), turn))
    dofs = tuple(Dof(i // 3 + 1, i % 3 + 1) for i in range(3 * size))
    return TurningSystem(M, K, dofs, C=C, G=G)


def arnoldi(system: TurningSystem, speed: float, k: int) -> np.ndarray:
    """The k lowest oscillatory poles by |pole|, shift-invert about 0 on the state space."""
    n = len(system.dofs)
    B, K = (sp.csc_array(system.matrix(a, speed)) for a in ("damping", "stiffness"))
    solver = sla.splu(K, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    step = sla.LinearOperator(
        (2 * n, 2 * n), matvec=lambda x: np.r_[-solver.solve(B @ x[:n] + system.M @ x[n:]), x[:n]], dtype=float
    )
    values = sla.eigs(step, k=2 * k + 6, which="LM", tol=1e-10, return_eigenvectors=False)
    poles = 1.0 / values
    poles = poles[poles.imag > 0]
    return poles[np.argsort(np.abs(poles))][:k]


def check(n: int, speed: float) -> float:
    system = box(n, 3)
    begin = time.perf_counter()
    found = complex_modes(system, n_modes=12, speed=speed)
    seconds = time.perf_counter() - begin
    np.testing.assert_allclose(found.poles, arnoldi(system, speed, 12), rtol=1e-7)
    assert found.residual.max() < 1e-8
    assert found.info["counted"] >= 0
    # residual by the matrices themselves
    psi, p = found.modes.phi, found.poles
    terms = [(system.M @ psi) * p**2, (system.matrix("damping", speed) @ psi) * p, system.K @ psi]
    size = sum(np.linalg.norm(t, axis=0) for t in terms)
    assert np.max(np.linalg.norm(sum(terms), axis=0) / size) < 1e-8
    return seconds


def test_poles_of_a_model_of_three_thousand_dofs() -> None:
    check(10, 2.0)


@pytest.mark.slow
def test_poles_of_a_model_of_forty_thousand_dofs() -> None:
    """41 472 DOFs of a net in three dimensions; the bound is ten times what two shared cores took (12 s)."""
    assert check(24, 1.0) < 120.0
