"""Complex modes with known answers: one and two masses, proportional damping, overdamped and defective pairs, rigid
bodies."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import csc_array, diags_array, eye_array, kron

from femend.analysis.complex_frf import complex_frf, complex_receptance
from femend.analysis.complex_modes import complex_modes
from femend.analysis.turning import TurningSystem
from femend.data import Channel, ComplexModes
from femend.dof import Dof
from femend.errors import ConvergenceError, ModelError, PairingError, SingularModelError


def names(n: int) -> tuple[Dof, ...]:
    return tuple(Dof(i + 1, 1) for i in range(n))


def system(M: object, K: object, **more: object) -> TurningSystem:
    return TurningSystem(
        csc_array(M), csc_array(K), names(csc_array(K).shape[0]), **{k: csc_array(v) for k, v in more.items()}
    )


def chain(n: int, k: float = 1e4, *, free: bool = False) -> csc_array:
    diagonal = np.full(n, 2.0)
    if free:
        diagonal[[0, -1]] = 1.0
    return csc_array(k * diags_array([-np.ones(n - 1), diagonal, -np.ones(n - 1)], offsets=[-1, 0, 1]))


def test_two_equal_masses_have_two_damped_modes_in_closed_form() -> None:
    """In and out of phase: m p^2 + c p + k = 0 and m p^2 + (c + 2 c12) p + k + 2 k12 = 0."""
    m, k, k12, c, c12 = 2.0, 300.0, 500.0, 3.0, 7.0
    found = complex_modes(
        system(m * np.eye(2), [[k + k12, -k12], [-k12, k + k12]], C=[[c + c12, -c12], [-c12, c + c12]]), n_modes=2
    )
    for pole, damping, stiffness in zip(found.poles, (c, c + 2 * c12), (k, k + 2 * k12), strict=True):
        expected = -damping / (2 * m) + 1j * np.sqrt(stiffness / m - (damping / (2 * m)) ** 2)
        assert pole == pytest.approx(expected, rel=1e-13)
    # modal a of mass-normalised shapes is 2 i times the damped frequency, residues phi phi^T / a (Ewins 2000, ch. 2)
    np.testing.assert_allclose(found.modal_a, 2j * found.poles.imag, rtol=1e-12)
    np.testing.assert_allclose(found.condition, (2 * abs(found.poles) - 2 * found.poles.real) / (2 * found.poles.imag))
    np.testing.assert_allclose(np.abs(found.modes.phi), np.full((2, 2), 0.5), rtol=1e-12)
    scaled = found.modal_a_shapes()
    np.testing.assert_allclose((2 * m * found.poles + [c, c + 2 * c12]) * np.sum(scaled**2, axis=0), 1.0, rtol=1e-12)


def test_proportional_damping_leaves_real_modes_with_their_frequencies() -> None:
    n, alpha, beta = 400, 0.8, 2e-5
    K, M = chain(n), csc_array(eye_array(n))
    found = complex_modes(system(M, K, C=alpha * M + beta * K), n_modes=10)
    omega = 2 * np.sqrt(1e4) * np.sin(np.arange(1, 11) * np.pi / (2 * (n + 1)))
    np.testing.assert_allclose(found.modes.freq, omega / (2 * np.pi), rtol=1e-9)
    np.testing.assert_allclose(found.modes.zeta, alpha / (2 * omega) + beta * omega / 2, rtol=1e-7)
    exact = np.sin(np.outer(np.arange(1, n + 1), np.arange(1, 11)) * np.pi / (n + 1)) * np.sqrt(2 / (n + 1))
    mac = np.abs(np.sum(exact * found.modes.phi, axis=0)) ** 2
    np.testing.assert_allclose(mac, 1.0, atol=1e-12)
    assert np.abs(np.imag(found.modes.phi)).max() < 1e-6
    assert found.info["counted"] >= 10


def test_the_same_loss_factor_everywhere_gives_it_to_every_mode() -> None:
    n, eta = 400, 0.04
    K = chain(n)
    found = complex_modes(system(eye_array(n), K, D=eta * K), n_modes=6)
    omega = 2 * np.sqrt(1e4) * np.sin(np.arange(1, 7) * np.pi / (2 * (n + 1)))
    np.testing.assert_allclose(found.poles, 1j * omega * np.sqrt(1 + 1j * eta), rtol=1e-9)
    np.testing.assert_allclose(found.mirrored.poles, -found.poles, rtol=1e-8)


def test_repeated_modes_are_all_found_and_their_frfs_are_right() -> None:
    """A square net has equal pairs (p, q), (q, p); the damper at the middle takes part in neither."""
    n = 21
    line = diags_array([-np.ones(n - 1), np.full(n, 2.0), -np.ones(n - 1)], offsets=[-1, 0, 1])
    one = eye_array(n)
    K = csc_array(kron(line, one) + kron(one, line))
    c = np.zeros(n * n)
    c[(n * n) // 2] = 0.3
    given = system(eye_array(n * n), K, C=diags_array([c], offsets=[0]))
    found = complex_modes(given, n_modes=12)
    side = 4 * np.sin(np.arange(1, 8) * np.pi / (2 * (n + 1))) ** 2
    omega = np.sqrt(np.sort((side[:, None] + side[None, :]).ravel()))
    assert found.modes.freq[1] == pytest.approx(found.modes.freq[2], rel=1e-9)
    assert abs(found.poles[1]) == pytest.approx(omega[1], rel=1e-9)
    place = [Channel(Dof(30, 1), "displacement", "m"), Channel(Dof(200, 1), "displacement", "m")]
    freq = np.linspace(0.01, 0.07, 41)
    H = complex_frf(given, freq, place, place, n_modes=12, kind="receptance").H
    for i in (0, 17, 40):
        s = 2j * np.pi * freq[i]
        Z = (s * s * given.M + s * given.C + K).toarray()
        exact = np.linalg.inv(Z)[np.ix_([29, 199], [29, 199])]
        assert np.abs(H[i] - exact).max() < 1e-6 * np.abs(H).max()


def test_overdamped_poles_are_told_apart_from_modes() -> None:
    m, k, c = np.array([1.0, 1.0]), np.array([100.0, 400.0]), np.array([50.0, 1.0])
    given = system(np.diag(m), np.diag(k), C=np.diag(c))
    found = complex_modes(given, f_max=20.0)
    root = np.sqrt(c[0] ** 2 / 4 - k[0])
    np.testing.assert_allclose(found.overdamped.poles, [-25 + root, -25 - root], rtol=1e-12)
    assert found.n_modes == 1
    assert found.modes.zeta[0] == pytest.approx(0.025)
    with pytest.raises(ValueError, match=r"only 1 oscillatory modes at this speed \(2 poles are overdamped\)"):
        complex_modes(given, n_modes=2)
    H = complex_receptance(found, [3j], [Dof(1, 1), Dof(2, 1)], [Dof(1, 1), Dof(2, 1)])[0]
    np.testing.assert_allclose(H, np.diag(1 / (k - 9 + 3j * c)), rtol=1e-10, atol=1e-18)


def test_a_critically_damped_pair_is_told_defective() -> None:
    """c = 2 sqrt(k m): two poles and one vector. Beside it a mode that nothing is wrong with."""
    given = system(np.eye(2), np.diag([100.0, 400.0]), C=np.diag([20.0 * (1 - 1e-15), 1.0]))
    found = complex_modes(given, f_max=10.0)
    near = [found.condition.max(), *(1 / np.abs(found.overdamped.modal_a))]
    assert max(near) > 1e6
    pair = [*found.poles, *found.overdamped.poles]
    assert min(abs(p + 10) for p in pair) < 1e-5


def test_frfs_of_a_nearly_defective_mode_are_refused() -> None:
    """zeta = 1 - 1e-13 has the condition sqrt((1 + zeta) / (1 - zeta)) = 4.5e6, above the 1e6 from which modal a is
    lost; at zeta = 1 - 1e-9 it is 4.5e4 and the receptance is still 1 / (k - w^2 + i c w)."""
    place = [Dof(1, 1)]

    def found(gap: float) -> ComplexModes:
        return complex_modes(system(np.eye(2), np.diag([100.0, 400.0]), C=np.diag([20.0 * (1 - gap), 1.0])), n_modes=2)

    near = found(1e-13)
    # the two poles part by the root of rounding, 1.5e-8 of their size, beside 4.5e-7 by damping
    assert near.condition.max() == pytest.approx(np.sqrt(2e13), rel=0.05)
    with pytest.raises(
        ConvergenceError, match=r"mode 1 \(1\.59\d* Hz, zeta 1\) is defective: its condition is 4\.\de\+06"
    ):
        complex_receptance(near, [1j], place, place)
    well = found(1e-9)
    assert well.condition.max() == pytest.approx(np.sqrt(2e9), rel=1e-3)
    np.testing.assert_allclose(complex_receptance(well, [1j], place, place)[0, 0, 0], 1 / (99 + 20j), rtol=1e-6)


def test_a_free_chain_keeps_its_rigid_body_at_zero() -> None:
    n = 500
    K = chain(n, free=True)
    w = np.zeros(n)
    w[100], w[300] = 1.0, -1.0
    given = system(eye_array(n), K, C=2.0 * np.outer(w, w))
    found = complex_modes(given, n_modes=6)
    assert found.poles[0] == 0
    np.testing.assert_allclose(found.modes.phi[:, 0].real, 1 / np.sqrt(n), rtol=1e-8)
    omega = 2 * np.sqrt(1e4) * np.sin(np.arange(1, 6) * np.pi / (2 * n))
    np.testing.assert_allclose(np.abs(found.poles[1:]), omega, rtol=1e-3)
    assert np.all(found.modes.zeta[1:] > -1e-12)
    with pytest.raises(ValueError, match="rigid-body motions with modal A = 0"):
        found.modal_a_shapes()


def test_a_damper_on_a_massless_dof_relaxes() -> None:
    """A spring and a damper in series on a mass: p (m p^2 + k) c + k1 (m p^2 + c p + k) = 0, with no pole of the
    middle's own."""
    m, k, k1, c = 2.0, 200.0, 500.0, 4.0
    given = system(np.diag([m, 0.0]), [[k + k1, -k1], [-k1, k1]], C=np.diag([0.0, c]))
    roots = np.roots([c * m, k1 * m, c * (k + k1), k1 * k])
    found = complex_modes(given, f_max=100.0)
    assert found.n_modes == 1
    assert found.poles[0] == pytest.approx(roots[roots.imag > 0][0], rel=1e-12)
    assert found.overdamped.poles[0].real == pytest.approx(roots[abs(roots.imag) < 1e-9][0].real, rel=1e-12)


def test_negative_damping_is_unstable() -> None:
    found = complex_modes(system(np.eye(2), np.diag([100.0, 400.0]), C=np.diag([-1.0, 1.0])), n_modes=2)
    assert found.unstable.tolist() == [True, False]
    assert found.modes.zeta[0] == pytest.approx(-0.05)


def test_what_cannot_be_solved_is_refused() -> None:
    M, K = np.eye(3), np.diag([1.0, 2.0, 3.0])
    with pytest.raises(SingularModelError, match=r"2:\+X"):
        complex_modes(system(np.diag([1.0, 0.0, 1.0]), np.diag([1.0, 0.0, 3.0])), n_modes=1)
    with pytest.raises(ModelError, match="negative eigenvalue"):
        complex_modes(system(M, np.diag([1.0, -2.0, 3.0])), n_modes=1)
    with pytest.raises(ValueError, match="n_modes = 0"):
        complex_modes(system(np.eye(70), np.eye(70)), n_modes=0)
    with pytest.raises(ValueError, match="only 3 oscillatory"):
        complex_modes(system(M, K), n_modes=4)
    with pytest.raises(ValueError, match="not finite"):
        complex_modes(system(M, K, C=np.diag([1.0, np.nan, 1.0])), n_modes=1)
    with pytest.raises(ValueError, match="speed = inf"):
        complex_modes(system(M, K), n_modes=1, speed=float("inf"))
    with pytest.raises(ValueError, match="belong to a model"):
        complex_modes(system(M, K), n_modes=1, factors={"E": 1.0})
    with pytest.raises(ValueError, match=r"C is \(2, 2\), but there are 3 DOF names"):
        system(M, K, C=np.eye(2))
    found = complex_modes(system(M, K), n_modes=2)
    with pytest.raises(PairingError, match=r"no DOF 9:\+X"):
        complex_receptance(found, [1j], [Dof(9, 1)], [Dof(1, 1)])
    place = [Channel(Dof(1, 1), "displacement", "m")]
    with pytest.raises(ValueError, match="rising lines"):
        complex_frf(system(M, K), [2.0, 1.0], place, place)
    with pytest.raises(ValueError, match="kind 'inertance' is unknown"):
        complex_frf(system(M, K), [1.0], place, place, kind="inertance")
