"""Modes against closed forms and dense solutions: chains, free bodies, coinciding modes, massless DOFs, bad models."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.linalg
import scipy.sparse as sp

from femend import _core
from femend.errors import ModelError, SingularModelError

from .sparse_models import Pencil, beam, chain, membrane, pencil

TAU = 2 * np.pi


def solve(p: Pencil, **options: object) -> tuple[np.ndarray, np.ndarray, np.ndarray, dict]:
    return _core.modes(p.indptr, p.indices, p.k, p.m, **options)


def assert_modes(p: Pencil, freq: np.ndarray, phi: np.ndarray, residual: np.ndarray) -> None:
    """Residuals at Lanczos tolerance and mass-normalised shapes."""
    assert residual.max() < 1e-7
    assert np.abs(phi.T @ (p.M @ phi) - np.eye(freq.size)).max() < 1e-9
    lam = (TAU * freq) ** 2
    projected = phi.T @ (p.K @ phi)
    assert np.abs(projected - np.diag(lam)).max() < 1e-9 * max(lam.max(), 1e-300)


@pytest.mark.parametrize("n", [5, 200, 2000])
def test_clamped_chain(n: int) -> None:
    p = chain(n, k=4e4, m=0.3)
    count = min(n, 15)
    freq, phi, residual, info = solve(p, n_modes=count)
    exact = 2 * np.sqrt(4e4 / 0.3) * np.sin(np.pi * np.arange(1, count + 1) / (2 * (n + 1))) / TAU
    # the eigenvalue of a long chain is (pi/n)^2 beside diagonal entries of 2: n^2 units of rounding are lost
    np.testing.assert_allclose(freq, exact, rtol=1e-15 * n * n + 1e-13)
    assert_modes(p, freq, phi, residual)
    assert info["n_rigid"] == 0


@pytest.mark.parametrize("n", [20, 300, 301, 3000])
def test_free_chain_has_one_exact_rigid_mode(n: int) -> None:
    p = chain(n, fixed=False)
    freq, phi, residual, info = solve(p, n_modes=10)
    exact = 2 * np.sin(np.pi * np.arange(10) / (2 * n)) / TAU
    np.testing.assert_allclose(freq, exact, rtol=1e-15 * n * n + 1e-12, atol=0)
    assert freq[0] == 0.0
    assert info["n_rigid"] == 1
    np.testing.assert_allclose(phi[:, 0], 1 / np.sqrt(n), rtol=1e-8)
    assert_modes(p, freq, phi, residual)


@pytest.mark.parametrize(
    ("clamped", "roots", "rigid"),
    [(True, [1.87510407, 4.69409113, 7.85475744], 0), (False, [4.73004074, 7.85320462, 10.9956078], 2)],
)
@pytest.mark.parametrize("n", [40, 250])
def test_beam(clamped: bool, roots: list[float], rigid: int, n: int) -> None:
    """Bernoulli beams (Blevins 1979, table 8-1): cos(x) cosh(x) = -1 and +1."""
    p = beam(n, clamped=clamped)
    freq, _, residual, info = solve(p, n_modes=rigid + 3)
    assert info["n_rigid"] == rigid
    # cubic elements: relative error (x/n)^4 / 720 of omega^2; the roots have nine digits; K loses n^4 units of rounding
    np.testing.assert_allclose(freq[rigid:], np.square(roots) / TAU, rtol=(11 / n) ** 4 / 1440 + 3e-9 + 1e-16 * n**4)
    assert residual.max() < 1e-7 + 1e-15 * n**4


def test_coinciding_modes_are_all_found() -> None:
    n = 40
    p = membrane(n)
    line = 4 * np.sin(np.pi * np.arange(1, n + 1) / (2 * (n + 1))) ** 2
    exact = np.sort(np.add.outer(line, line).ravel())
    freq, phi, residual, _ = solve(p, n_modes=31)
    np.testing.assert_allclose((TAU * freq) ** 2, exact[:31], rtol=1e-11)
    assert_modes(p, freq, phi, residual)


@pytest.mark.parametrize("copies", [12, 40])
def test_no_copy_of_many_equal_structures_is_missed(copies: int) -> None:
    """Every mode comes `copies` times, more than a Lanczos block holds: only the inertia count can tell."""
    one = chain(60)
    p = pencil(sp.block_diag([one.K] * copies), sp.block_diag([one.M] * copies))
    freq, phi, residual, info = solve(p, n_modes=2 * copies + 3)
    exact = 2 * np.sin(np.pi * np.arange(1, 4) / 122) / TAU
    np.testing.assert_allclose(freq, np.repeat(exact, copies)[: 2 * copies + 3], rtol=1e-11)
    assert info["counted"] == 3 * copies or info["counted"] == 2 * copies + 3
    assert_modes(p, freq, phi, residual)


def test_free_equal_structures_have_all_rigid_modes() -> None:
    one = beam(20, clamped=False)
    p = pencil(sp.block_diag([one.K] * 15), sp.block_diag([one.M] * 15))
    freq, _, _, info = solve(p, n_modes=45)
    assert info["n_rigid"] == 30
    np.testing.assert_allclose(freq[30:], 4.73004074**2 / TAU, rtol=1e-5)


@pytest.mark.parametrize("n_modes", [1, 4, 7, 11])
def test_of_free_bodies_fewer_modes_than_rigid_ones_come(n_modes: int) -> None:
    """Twelve modes of 0 Hz, apart by rounding: the count above the last wanted one must not fall between them."""
    one = beam(30, clamped=False)
    p = pencil(sp.block_diag([(1 + 0.37 * i) * one.K for i in range(6)]), sp.block_diag([one.M] * 6))
    freq, phi, residual, info = solve(p, n_modes=n_modes)
    assert freq.tolist() == [0.0] * n_modes
    assert info["n_rigid"] == n_modes
    assert info["counted"] == 12
    assert residual.max() < 1e-8
    assert np.abs(phi.T @ (p.M @ phi) - np.eye(n_modes)).max() < 1e-9


@pytest.mark.parametrize("n", [150, 900])
def test_band_holds_exactly_the_modes_below(n: int) -> None:
    p = chain(n)
    exact = 2 * np.sin(np.pi * np.arange(1, n + 1) / (2 * (n + 1))) / TAU
    for count in (1, 7, 23):
        f_max = 0.5 * (exact[count - 1] + exact[count])
        freq, phi, residual, _ = solve(p, f_max=f_max)
        assert freq.size == count
        np.testing.assert_allclose(freq, exact[:count], rtol=1e-9)
        assert_modes(p, freq, phi, residual)
    assert solve(p, f_max=exact[0] / 2)[0].size == 0
    assert solve(p, f_max=exact[30], n_modes=4)[0].size == 4


@pytest.mark.parametrize("n", [60, 500])
@pytest.mark.parametrize("fixed", [True, False])
def test_massless_dofs(n: int, fixed: bool) -> None:
    """Two of three masses are zero: condensation to the others is exact."""
    p = chain(n, fixed=fixed)
    mass = np.where(np.arange(n) % 3 == 1, 2.0, 0.0)
    p = pencil(p.K, sp.diags(mass))
    freq, phi, residual, _ = solve(p, n_modes=12)
    heavy = np.flatnonzero(mass)
    light = np.flatnonzero(mass == 0)
    K = p.K.toarray()
    condensed = K[np.ix_(heavy, heavy)] - K[np.ix_(heavy, light)] @ np.linalg.solve(
        K[np.ix_(light, light)], K[np.ix_(light, heavy)]
    )
    exact = scipy.linalg.eigh(condensed / 2.0, eigvals_only=True)[:12]
    np.testing.assert_allclose((TAU * freq) ** 2, exact, rtol=1e-8, atol=1e-13)
    # massless DOFs follow statically: no part of the null space of M in the shapes
    static = -np.linalg.solve(K[np.ix_(light, light)], K[np.ix_(light, heavy)] @ phi[heavy])
    np.testing.assert_allclose(phi[light], static, atol=1e-8)
    assert_modes(p, freq, phi, residual)


def test_more_modes_than_masses_is_refused() -> None:
    p = pencil(chain(400).K, sp.diags(np.where(np.arange(400) < 3, 1.0, 0.0)))
    with pytest.raises(ValueError, match="only 3 modes"):
        solve(p, n_modes=5)
    assert solve(p, n_modes=3)[0].size == 3


def test_full_mass_against_dense_reference() -> None:
    rng = np.random.default_rng(7)
    n = 420
    B = sp.random(n, n, 0.01, random_state=rng)
    K = (B @ B.T + sp.diags(rng.uniform(0.5, 50, n))).tocsc()
    C = sp.random(n, n, 0.004, random_state=rng)
    M = (C @ C.T + sp.diags(rng.uniform(0.5, 2, n))).tocsc()
    p = pencil(K, M)
    freq, phi, residual, _ = solve(p, n_modes=40)
    exact, shapes = scipy.linalg.eigh(K.toarray(), M.toarray(), subset_by_index=[0, 39])
    np.testing.assert_allclose((TAU * freq) ** 2, exact, rtol=1e-10)
    mac = np.abs(np.einsum("ij,ij->j", phi, M @ shapes))
    np.testing.assert_allclose(mac, 1, atol=1e-8)
    assert_modes(p, freq, phi, residual)


def test_two_runs_give_the_same_digits_and_warm_start_the_same_modes() -> None:
    p = membrane(30)
    first, second = solve(p, n_modes=9), solve(p, n_modes=9)
    assert (first[1] == second[1]).all()
    softer = pencil(p.K + 0.02 * sp.diags(np.linspace(0, 1, 900)), p.M)
    cold = solve(softer, n_modes=9)
    warm = solve(softer, n_modes=9, start=first[1])
    np.testing.assert_allclose(cold[0], warm[0], rtol=1e-11)


def test_units_of_stiffness_and_mass_do_not_matter() -> None:
    for scale in (1e-12, 1.0, 1e15):
        p = chain(700, fixed=False)
        q = pencil(p.K * scale, p.M * scale * 1e-6)
        freq, _, _, info = solve(q, n_modes=6)
        exact = 1e3 * 2 * np.sin(np.pi * np.arange(6) / 1400) / TAU
        np.testing.assert_allclose(freq, exact, rtol=1e-9)
        assert info["n_rigid"] == 1


@pytest.mark.parametrize("n", [50, 600])
def test_dof_without_stiffness_and_mass_is_named(n: int) -> None:
    p = chain(n)
    K, M = p.K.tolil(), p.M.tolil()
    for d in (7, 31):
        K[d, :] = 0
        K[:, d] = 0
        M[d, d] = 0
    with pytest.raises(SingularModelError, match=r"DOF 7, DOF 31") as caught:
        solve(pencil(K, M), n_modes=3)
    assert caught.value.dofs == ("7", "31")


def test_negative_stiffness_is_told() -> None:
    p = chain(30)
    K = p.K.tolil()
    K[4, 4] = -8.0
    with pytest.raises(ModelError, match="1 negative eigenvalue"):
        solve(pencil(K, p.M), n_modes=3)


@pytest.mark.parametrize("n", [30, 800])
def test_a_mass_below_nothing_is_told_with_its_rows(n: int) -> None:
    p = chain(n)
    M = p.M.tolil()
    M[7, 7] = -0.01
    with pytest.raises(ModelError, match=r"mass is below nothing in a way the model can move \(DOF 7\)"):
        solve(pencil(p.K, M), n_modes=3)
    M[7, 7] = M[8, 8] = 1.0
    M[7, 8] = M[8, 7] = 1.1
    with pytest.raises(ModelError, match=r"\(DOF 7, DOF 8\)"):
        solve(pencil(p.K, M), n_modes=3)


def test_a_mass_that_no_two_rows_show_to_be_negative_is_told() -> None:
    p = chain(30)
    K, M = p.K.tolil(), p.M.tolil()
    for i, j in ((4, 5), (5, 6), (4, 6)):
        M[i, j] = M[j, i] = -0.9 * p.M[i, i]
    with pytest.raises(ModelError, match=r"below nothing in a way the model can move \(DOF [456]\)"):
        solve(pencil(K, M), n_modes=3)


def test_arguments_are_checked() -> None:
    p = chain(10)
    for options, text in [({}, "neither"), ({"n_modes": 0}, "at least one"), ({"f_max": -1.0}, "positive")]:
        with pytest.raises(ValueError, match=text):
            solve(p, **options)
    with pytest.raises(ValueError, match="mirror"):
        _core.modes(p.indptr, np.r_[p.indices[:1], 2, p.indices[2:]].astype(np.int32), p.k, p.m, n_modes=1)
    broken = p.k.copy()
    broken[3] = np.nan
    with pytest.raises(ModelError, match="NaN"):
        _core.modes(p.indptr, p.indices, broken, p.m, n_modes=1)
