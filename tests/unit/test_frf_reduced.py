"""Reduced direct FRFs against dense solutions on every line, and fused scores against those of the stored FRF."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp

from femend import _core
from femend.correlate import csac, csf, faac, frac

from ..analytic.sparse_models import on_pattern

N, OUT, IN = 120, [0, 31, 77, 119], [31, 90]


@pytest.fixture
def parts() -> tuple[sp.csc_matrix, np.ndarray]:
    """An uneven chain as K, M and the stiffness of its last quarter, on one pattern."""
    rng = np.random.default_rng(3)
    k = rng.uniform(0.5, 2.0, N) * 1e5

    def chain(k: np.ndarray) -> sp.csc_matrix:
        return sp.diags([-k[1:], k + np.r_[k[1:], 0.0], -k[1:]], [-1, 0, 1]).tocsc()

    K, Z = chain(k), chain(np.where(np.arange(N) < 90, 0.0, k))
    M = sp.diags(rng.uniform(0.5, 2.0, N))
    K.sort_indices()
    return K, np.array([on_pattern(a, K) for a in (K, M, Z)])


def unit(dofs: list[int]) -> np.ndarray:
    b = np.zeros((N, len(dofs)))
    b[dofs, range(len(dofs))] = 1.0
    return b


def dense(pattern: sp.csc_matrix, values: np.ndarray) -> np.ndarray:
    return sp.csc_matrix((values, pattern.indices, pattern.indptr), shape=pattern.shape).toarray()


@pytest.mark.parametrize("kind", ["receptance", "accelerance"])
def test_lossy_zone_and_viscoelastic_law_equal_the_dense_solution(
    parts: tuple[sp.csc_matrix, np.ndarray], kind: str
) -> None:
    pattern, on = parts
    s = 2j * np.pi * np.linspace(0.5, 25.0, 160)
    # loss factor 0.01 everywhere; in the zone a standard linear solid whose modulus follows the frequency
    law = 0.8 * s / (s + 60.0)
    coefficients = np.array([np.full(s.size, 1 + 0.01j), s**2, law])
    H, info = _core.frf_reduced(
        pattern.indptr, pattern.indices, on, coefficients, unit(OUT), unit(IN), s, kind, tolerance=1e-7
    )
    K, M, Z = (dense(pattern, v) for v in on)
    power = {"receptance": 0, "accelerance": 2}[kind]
    assert info["converged"]
    assert info["error"] <= 1e-7
    assert len(info["solved"]) == len(set(info["solved"])) < 40
    assert info["basis"] <= N
    for line, x in enumerate(s):
        exact = x**power * np.linalg.solve(K * (1 + 0.01j) + Z * law[line] + x * x * M, unit(IN))[OUT]
        # the tolerance binds the lines that were measured; others may be a little worse
        np.testing.assert_allclose(H[line], exact, rtol=0, atol=1e-6 * np.abs(exact).max())


def test_too_few_solutions_are_told_not_hidden(parts: tuple[sp.csc_matrix, np.ndarray]) -> None:
    pattern, on = parts
    s = 2j * np.pi * np.linspace(0.5, 40.0, 200)
    coefficients = np.array([np.full(s.size, 1 + 0.002j), s**2, np.zeros(s.size)])
    arguments = (pattern.indptr, pattern.indices, on, coefficients, unit(OUT), unit(IN), s)
    _, info = _core.frf_reduced(*arguments, max_solutions=6, tolerance=1e-9)
    assert not info["converged"]
    assert len(info["solved"]) <= 6
    assert info["residual"] > 1e-9


@pytest.mark.parametrize("count", [0, 1, 3])
def test_few_lines_are_solved_directly(parts: tuple[sp.csc_matrix, np.ndarray], count: int) -> None:
    pattern, on = parts
    s = 2j * np.pi * np.linspace(1.0, 9.0, count)
    coefficients = np.array([np.full(count, 1 + 0.02j), s**2, 0 * s])
    H, info = _core.frf_reduced(pattern.indptr, pattern.indices, on, coefficients, unit(OUT), unit(IN), s)
    assert H.shape == (count, len(OUT), len(IN))
    assert info["converged"]
    K, M, _ = (dense(pattern, v) for v in on)
    for line, x in enumerate(s):
        exact = np.linalg.solve(K * (1 + 0.02j) + x * x * M, unit(IN))[OUT]
        np.testing.assert_allclose(H[line], exact, rtol=1e-9)


def test_reduced_arguments_are_checked(parts: tuple[sp.csc_matrix, np.ndarray]) -> None:
    pattern, on = parts
    s = 2j * np.pi * np.linspace(1.0, 9.0, 5)
    c = np.ones((3, 5), complex)

    def call(c: np.ndarray, b: np.ndarray) -> object:
        return _core.frf_reduced(pattern.indptr, pattern.indices, on, c, b, unit(IN), s)

    with pytest.raises(ValueError, match="2 rows of coefficients"):
        call(c[:2], unit(OUT))
    with pytest.raises(ValueError, match="matrix 0 has 4 coefficients"):
        call(np.ascontiguousarray(c[:, :4]), unit(OUT))
    with pytest.raises(ValueError, match="b_out has 7 rows"):
        call(c, np.ones((7, 1)))
    c[1, 2] = np.nan
    with pytest.raises(ValueError, match="matrix 1 on line 2"):
        call(c, unit(OUT))


def test_fused_scores_equal_those_of_the_stored_frf() -> None:
    rng = np.random.default_rng(5)
    omega, zeta = np.sort(rng.uniform(5, 200, 17)), np.full(17, 0.02)
    phi_out, phi_in = rng.standard_normal((29, 17)), rng.standard_normal((3, 17))
    s = 1j * np.linspace(1, 220, 203)
    H = _core.frf_modal(omega, zeta, phi_out, phi_in, s, "mobility")
    measured = _core.frf_modal(omega * 1.01, zeta * 1.3, phi_out, phi_in, s, "mobility")
    measured[:, 3, 1] = 0.0
    found = _core.frf_modal_scores(omega, zeta, phi_out, phi_in, s, measured, "mobility")
    for name, function in [("frac", frac), ("faac", faac), ("csac", csac), ("csf", csf)]:
        np.testing.assert_allclose(found[name], function(H, measured), rtol=1e-10, atol=1e-12)
    np.testing.assert_allclose(found["misfit"], np.sum(np.abs(H - measured) ** 2), rtol=1e-11)
    assert np.isnan(found["frac"][3, 1])
    with pytest.raises(ValueError, match="measured has shape"):
        _core.frf_modal_scores(omega, zeta, phi_out, phi_in, s, measured[:, :, :2], "mobility")
