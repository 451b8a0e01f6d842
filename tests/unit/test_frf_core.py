"""FRFs of the core against closed forms and dense direct solutions."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.linalg
import scipy.sparse as sp

from femend import _core

N = 40


def tridiagonal(values: np.ndarray, off: np.ndarray) -> sp.csc_matrix:
    a = sp.diags([off, values, off], [-1, 0, 1]).tocsc()
    a.sort_indices()
    return a


@pytest.fixture
def model() -> tuple[sp.csc_matrix, sp.csc_matrix]:
    """A chain of uneven masses and springs on the ground at one end."""
    rng = np.random.default_rng(3)
    k = rng.uniform(0.5, 2.0, N) * 1e5
    K = tridiagonal(k + np.r_[k[1:], 0.0], -k[1:])
    M = tridiagonal(rng.uniform(0.5, 2.0, N), np.full(N - 1, 1e-30))
    return K, M


def unit(dofs: list[int]) -> np.ndarray:
    b = np.zeros((N, len(dofs)))
    b[dofs, range(len(dofs))] = 1.0
    return b


def dense_frf(Z: np.ndarray, outputs: list[int], inputs: list[int]) -> np.ndarray:
    return np.linalg.solve(Z, unit(inputs))[outputs]


OUT, IN = [0, 7, 30, 39], [7, 21]
FREQ = np.linspace(1.0, 120.0, 61)


def test_all_modes_give_the_direct_frf(model: tuple[sp.csc_matrix, sp.csc_matrix]) -> None:
    K, M = model
    lam, phi = scipy.linalg.eigh(K.toarray(), M.toarray())
    omega, zeta = np.sqrt(lam), np.linspace(0.005, 0.04, N)
    C = M @ phi @ np.diag(2 * zeta * omega) @ phi.T @ M
    s = np.r_[2j * np.pi * FREQ, -3.0 + 40j, 12.0 + 200j, 5.0 + 0j]
    for power, kind in enumerate(("receptance", "mobility", "accelerance")):
        H = _core.frf_modal(omega, zeta, phi[OUT], phi[IN], s, kind)
        assert H.shape == (s.size, len(OUT), len(IN))
        for line, x in enumerate(s):
            exact = x**power * dense_frf(K.toarray() + x * C + x * x * M.toarray(), OUT, IN)
            np.testing.assert_allclose(H[line], exact, rtol=1e-10, atol=1e-10 * np.abs(exact).max())


def test_direct_frf_equals_dense_solution(model: tuple[sp.csc_matrix, sp.csc_matrix]) -> None:
    K, M = model
    c, h = 1e-4 * K.data + 2.0 * M.data, 0.03 * K.data
    s = 2j * np.pi * FREQ
    H = _core.frf_direct(K.indptr, K.indices, K.data, M.data, unit(OUT), unit(IN), s, "mobility", c=c, h=h)
    for line, x in enumerate(s):
        Z = K.toarray() * (1 + 0.03j + 1e-4 * x) + M.toarray() * (x * x + 2.0 * x)
        exact = x * dense_frf(Z, OUT, IN)
        np.testing.assert_allclose(H[line], exact, rtol=1e-10, atol=1e-10 * np.abs(exact).max())


def test_reciprocity(model: tuple[sp.csc_matrix, sp.csc_matrix]) -> None:
    K, M = model
    freq, phi, _, _ = _core.modes(K.indptr, K.indices, K.data, M.data, n_modes=12)
    H = _core.frf_modal(2 * np.pi * freq, np.full(12, 0.01), phi[IN], phi[IN], 2j * np.pi * FREQ)
    np.testing.assert_array_equal(H, H.transpose(0, 2, 1))


def test_residual_vectors_make_the_static_response_exact(model: tuple[sp.csc_matrix, sp.csc_matrix]) -> None:
    K, M = model
    freq, phi, _, _ = _core.modes(K.indptr, K.indices, K.data, M.data, n_modes=5)
    X = _core.residual_vectors(K.indptr, K.indices, K.data, M.data, phi, unit(IN))
    omega, zeta = 2 * np.pi * freq, np.full(5, 0.01)
    exact = dense_frf(K.toarray(), OUT, IN)
    static = _core.frf_modal(omega, zeta, phi[OUT], phi[IN], np.zeros(1, complex), residual=X[OUT])[0]
    np.testing.assert_allclose(static, exact, rtol=1e-11)
    bare = _core.frf_modal(omega, zeta, phi[OUT], phi[IN], np.zeros(1, complex))[0]
    assert np.abs(bare - exact).max() > 1e-3 * np.abs(exact).max()
    assert np.abs(phi.T @ (M @ X)).max() < 1e-9 * np.abs(X).max()


@pytest.mark.parametrize("n_modes", [1, 6])
def test_residual_vectors_of_a_free_chain(model: tuple[sp.csc_matrix, sp.csc_matrix], n_modes: int) -> None:
    """Free-free: the sum over all elastic modes left out, from a dense solution."""
    K, M = model
    K = K.copy()
    K[0, 0] = -K[0, 1]  # no spring to ground
    lam, shapes = scipy.linalg.eigh(K.toarray(), M.toarray())
    _, phi, _, info = _core.modes(K.indptr, K.indices, K.data, M.data, n_modes=n_modes)
    assert info["n_rigid"] == 1
    X = _core.residual_vectors(K.indptr, K.indices, K.data, M.data, phi, unit(IN))
    left = shapes[:, n_modes:]
    exact = left @ np.diag(1 / lam[n_modes:]) @ left.T @ unit(IN)
    np.testing.assert_allclose(X, exact, rtol=1e-9, atol=1e-11 * np.abs(exact).max())
    with pytest.raises(ValueError, match="rigid-body"):
        _core.residual_vectors(K.indptr, K.indices, K.data, M.data, phi[:, 1:], unit(IN))


def test_static_correction_shrinks_the_error_in_band(model: tuple[sp.csc_matrix, sp.csc_matrix]) -> None:
    K, M = model
    freq, phi, _, _ = _core.modes(K.indptr, K.indices, K.data, M.data, n_modes=10)
    s = 2j * np.pi * np.linspace(0.1, 0.6 * freq[-1], 50) - 0.5
    X = _core.residual_vectors(K.indptr, K.indices, K.data, M.data, phi, unit(IN))
    exact = _core.frf_direct(K.indptr, K.indices, K.data, M.data, unit(OUT), unit(IN), s)
    omega, zeta = 2 * np.pi * freq, np.zeros(10)
    bare = np.abs(_core.frf_modal(omega, zeta, phi[OUT], phi[IN], s) - exact).max()
    corrected = np.abs(_core.frf_modal(omega, zeta, phi[OUT], phi[IN], s, residual=X[OUT]) - exact).max()
    assert corrected < 0.2 * bare


def test_out_is_filled_and_returned() -> None:
    omega, zeta = np.array([3.0, 50.0]), np.array([0.01, 0.02])
    phi = np.array([[1.0, 2.0], [0.5, -1.0]])
    s = 1j * np.linspace(1, 60, 33)
    out = np.full((33, 2, 2), np.nan + 0j)
    H = _core.frf_modal(omega, zeta, phi, phi, s, out=out)
    assert H is out
    np.testing.assert_array_equal(out, _core.frf_modal(omega, zeta, phi, phi, s))
    with pytest.raises(ValueError, match="C-contiguous"):
        _core.frf_modal(omega, zeta, phi, phi, s, out=np.zeros((33, 2, 4), complex)[:, :, ::2])
    out.flags.writeable = False
    with pytest.raises(ValueError, match="written"):
        _core.frf_modal(omega, zeta, phi, phi, s, out=out)


def test_poles_and_shapes_are_refused() -> None:
    phi = np.ones((1, 2))
    omega, zeta = np.array([0.0, 50.0]), np.zeros(2)
    with pytest.raises(ValueError, match=r"pole .* mode 1"):
        _core.frf_modal(omega, zeta, phi, phi, np.array([3j, 50j]))
    with pytest.raises(ValueError, match=r"pole .* mode 0"):
        _core.frf_modal(omega, zeta, phi, phi, np.zeros(1, complex))
    with pytest.raises(ValueError, match="phi_in has 3 modes"):
        _core.frf_modal(omega, zeta, phi, np.ones((1, 3)), np.array([3j]))
    with pytest.raises(ValueError, match="unknown"):
        _core.frf_modal(omega, zeta, phi, phi, np.array([3j]), "compliance")
    with pytest.raises(ValueError, match="residual"):
        _core.frf_modal(omega, zeta, phi, phi, np.array([3j]), residual=np.ones((2, 2)))
