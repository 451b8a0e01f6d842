"""Complex modes of random models against scipy's dense state-space eigenvalues, and FRFs against dense solutions.

300 DOFs: a chain of springs and masses with long links, dashpots between any two of them, gyroscopic coupling of
neighbours, structural damping that differs from part to part. Poles agree to 1e-8, the residual that is asked for.
"""

from __future__ import annotations

import numpy as np
import pytest
import scipy.linalg
import scipy.sparse as sp
from numpy.typing import NDArray

from femend.analysis.complex_frf import complex_frf
from femend.analysis.complex_modes import complex_modes
from femend.analysis.turning import TurningSystem
from femend.data import Channel
from femend.dof import Dof

Array = NDArray[np.float64]


def random_system(
    n: int, seed: int, *, dashpot: float = 0.0, gyro: float = 0.0, eta: float = 0.0, free: bool = False
) -> TurningSystem:
    rng = np.random.default_rng(seed)
    K = np.zeros((n, n))

    def link(i: int, j: int, k: float, into: Array) -> None:
        into[np.ix_([i, j], [i, j])] += k * np.array([[1.0, -1.0], [-1.0, 1.0]])

    for i in range(n - 1):
        link(i, i + 1, 1e4 * (0.5 + rng.random()), K)
    for _ in range(n // 4):
        link(*rng.choice(n, 2, replace=False), 100.0, K)
    if not free:
        K[0, 0] += 1e4
    C = np.zeros((n, n))
    for _ in range(6):
        link(*rng.choice(n, 2, replace=False), dashpot, C)
    G = np.diag(gyro * rng.standard_normal(n - 1), 1)
    weight = np.where(np.arange(n) < n // 3, 1.0, 0.2)
    D = eta * 0.5 * (K * weight + (K * weight).T)
    dofs = tuple(Dof(i + 1, 1) for i in range(n))

    def sparse(a: Array) -> sp.csc_array | None:
        return sp.csc_array(a) if a.any() else None

    M = sp.csc_array(np.diag(0.5 + rng.random(n)))
    return TurningSystem(M, sp.csc_array(K), dofs, C=sparse(C), D=sparse(D), G=sparse(G - G.T))


def dense_poles(system: TurningSystem, speed: float) -> NDArray[np.complex128]:
    """All poles, by |pole|."""
    n = len(system.dofs)
    M = system.M.toarray()
    C, K = (system.matrix(name, speed).toarray() for name in ("damping", "stiffness"))
    state = np.block([[np.zeros((n, n)), np.eye(n)], [-np.linalg.solve(M, K), -np.linalg.solve(M, C)]])
    poles = scipy.linalg.eigvals(state)
    return poles[np.argsort(np.abs(poles))]


CASES = {
    "undamped": ({}, 0.0),
    "light dashpots": ({"dashpot": 2.0}, 0.0),
    "strong dashpots": ({"dashpot": 2000.0}, 0.0),
    "turning": ({"gyro": 1.0}, 10.0),
    "turning and damped": ({"gyro": 2.0, "dashpot": 5.0}, 30.0),
    "structural": ({"eta": 0.05}, 0.0),
    "all": ({"gyro": 1.0, "dashpot": 5.0, "eta": 0.05}, 20.0),
    "free and damped": ({"dashpot": 5.0, "free": True}, 0.0),
}


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("n", [40, 300])
def test_poles_are_those_of_the_dense_state_space(case: str, n: int) -> None:
    options, speed = CASES[case]
    system = random_system(n, 5, **options)
    found = complex_modes(system, n_modes=12, speed=speed, left_tolerance=1e-8)
    dense = dense_poles(system, speed)
    expected = dense[(dense.imag > 1e-7 * np.abs(dense)) & (np.abs(dense) > 1e-4)]
    flexible = found.poles[found.poles != 0]
    np.testing.assert_allclose(flexible, expected[: flexible.size], rtol=1e-8)
    assert max(found.residual.max(), found.residual_left[found.poles != 0].max()) < 1e-8
    real = dense[(np.abs(dense.imag) <= 1e-7 * np.abs(dense)) & (np.abs(dense) > 1e-4)].real
    if "structural" not in case and case != "all":
        inside = real[np.abs(real) <= np.abs(flexible[-1])]
        np.testing.assert_allclose(found.overdamped.poles, inside, rtol=1e-8)
    # what is reported as residual is that of the whole model
    psi, pole = found.modes.phi[:, -1], found.poles[-1]
    inertia = pole**2 * (system.M @ psi)
    damping, stiffness = pole * (system.matrix("damping", speed) @ psi), system.matrix("stiffness", speed) @ psi
    held = stiffness - found.info["sigma"] * (system.M @ psi)
    size = sum(np.linalg.norm(a) for a in (inertia, damping, held))
    told = np.linalg.norm(inertia + damping + stiffness) / size
    assert told == pytest.approx(found.residual[-1], rel=0.2, abs=1e-13)


@pytest.mark.parametrize("case", ["light dashpots", "turning and damped", "structural", "all", "free and damped"])
def test_frfs_from_complex_modes_are_those_of_the_dense_solution(case: str) -> None:
    """To 1e-6 of the largest, the tolerance that is asked for; 12 of 200 modes."""
    options, speed = CASES[case]
    system = random_system(200, 7, **options)
    freq = np.linspace(0.2, 2.2, 141)
    outputs = [Channel(Dof(i, 1, sign), "displacement", "m") for i, sign in ((3, 1), (50, -1), (140, 1))]
    inputs = [Channel(Dof(50, 1), "force", "N"), Channel(Dof(199, 1), "force", "N")]
    H = complex_frf(system, freq, outputs, inputs, n_modes=12, speed=speed, kind="receptance").H
    M, C, K = system.M.toarray(), *(system.matrix(a, speed).toarray() for a in ("damping", "stiffness"))
    B = np.zeros((200, 2))
    B[49, 0] = B[198, 1] = 1.0
    for i, f in enumerate(freq):
        s = 2j * np.pi * f
        X = np.linalg.solve(s * s * M + s * C + K, B)
        exact = np.array([X[2], -X[49], X[139]])
        assert np.abs(H[i] - exact).max() < 1e-6 * np.abs(H).max(), f
