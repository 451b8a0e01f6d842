"""Every derivative against central finite differences; coinciding modes included."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.linalg
import scipy.sparse as sp

from femend import _core

H = 1e-5  # relative step: truncation 1e-10, rounding 1e-16 / 1e-5


class Grid:
    """Masses on a 5 x 7 net with springs of four groups and masses of two; 35 DOFs on one pattern."""

    def __init__(self, *, free: bool = False, square: bool = False) -> None:
        nx, ny = (6, 6) if square else (5, 7)
        n = self.n = nx * ny
        rng = np.random.default_rng(5)
        at = np.arange(n).reshape(nx, ny)
        ones = []
        for pairs in (
            np.stack([at[:-1].ravel(), at[1:].ravel()], 1),
            np.stack([at[:, :-1].ravel(), at[:, 1:].ravel()], 1),
        ):
            half = len(pairs) // 2
            ones += [pairs[:half], pairs[half:]]
        sizes = [np.ones(len(p)) if square else rng.uniform(0.5, 2.0, len(p)) for p in ones]
        group_k = [self.springs(p, k) for p, k in zip(ones, sizes, strict=True)]
        mass = np.ones(n) if square else rng.uniform(0.5, 2.0, n)
        group_m = [
            sp.diags(np.where(np.arange(n) < n // 3, mass, 0)),
            sp.diags(np.where(np.arange(n) < n // 3, 0, mass)),
        ]
        ground = sp.diags(np.zeros(n) if free else np.r_[np.full(n, 0.7)])
        pattern = sp.csc_matrix(sum(abs(g) for g in group_k) + sp.eye(n))
        pattern.sort_indices()
        self.pattern = pattern
        self.dk = np.array([self.values(g) for g in group_k] + [np.zeros(pattern.nnz)] * 2)
        self.dm = np.array([np.zeros(pattern.nnz)] * 4 + [self.values(g) for g in group_m])
        self.base_k, self.base_m = self.values(ground), np.zeros(pattern.nnz)
        self.n_p = 6

    def springs(self, pairs: np.ndarray, k: np.ndarray) -> sp.csc_matrix:
        i, j = pairs.T
        rows, cols = np.r_[i, j, i, j], np.r_[i, j, j, i]
        return sp.coo_matrix((np.r_[k, k, -k, -k], (rows, cols)), shape=(self.n, self.n)).tocsc()

    def values(self, matrix: sp.spmatrix) -> np.ndarray:
        coo = self.pattern.tocoo()
        return np.asarray(sp.csr_matrix(matrix)[coo.row, coo.col]).ravel()

    def km(self, theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return self.base_k + theta @ self.dk, self.base_m + theta @ self.dm

    def full(self, values: np.ndarray) -> np.ndarray:
        return sp.csc_matrix((values, self.pattern.indices, self.pattern.indptr), shape=(self.n, self.n)).toarray()

    def eigh(self, theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        k, m = self.km(theta)
        return scipy.linalg.eigh(self.full(k), self.full(m))

    def difference(self, function, theta: np.ndarray) -> np.ndarray:
        rows = []
        for p in range(self.n_p):
            step = H * np.eye(self.n_p)[p]
            rows.append((function(theta + step) - function(theta - step)) / (2 * H))
        return np.array(rows)

    @property
    def arrays(self) -> tuple[np.ndarray, np.ndarray]:
        return self.pattern.indptr, self.pattern.indices


THETA = np.array([1.0, 1.3, 0.8, 1.1, 0.9, 1.2])


@pytest.mark.parametrize("free", [False, True])
def test_eigenvalues(free: bool) -> None:
    g = Grid(free=free)
    lam, phi = g.eigh(THETA)
    found, cluster = _core.eigen_sensitivities(*g.arrays, g.dk, g.dm, lam[:12], phi[:, :12])
    exact = g.difference(lambda t: g.eigh(t)[0][:12], THETA)
    np.testing.assert_allclose(found, exact, rtol=1e-7, atol=1e-8)
    assert (cluster == np.arange(12)).all()


def test_a_parameter_that_changes_nothing_and_one_that_is_not_symmetric() -> None:
    g = Grid()
    lam, phi = g.eigh(THETA)
    dk = np.array(g.dk)
    dk[1] = 0.0
    found, _ = _core.eigen_sensitivities(*g.arrays, dk, None, lam[:4], phi[:, :4])
    assert (found[1] == 0).all()
    assert np.abs(found[0]).max() > 0
    indptr, indices = g.arrays
    row, column = next((int(i), j) for j in range(g.n) for i in indices[indptr[j] : indptr[j + 1]] if i > j)
    for value, words in ((1.0, "not symmetric"), (np.nan, "nan|NaN")):
        dk[1] = 0.0
        dk[1, indptr[column] + list(indices[indptr[column] : indptr[column + 1]]).index(row)] = value
        with pytest.raises(ValueError, match=words):
            _core.eigen_sensitivities(*g.arrays, dk, None, lam[:4], phi[:, :4])
    # mirrors that differ by rounding are those of a symmetric matrix
    dk = np.array(g.dk)
    exact, _ = _core.eigen_sensitivities(*g.arrays, dk, None, lam[:4], phi[:, :4])
    held = np.flatnonzero(dk[0] == 0)[0]
    dk[0, held] = 1e-16
    nearly, _ = _core.eigen_sensitivities(*g.arrays, dk, None, lam[:4], phi[:, :4])
    np.testing.assert_allclose(nearly, exact, rtol=1e-10)


def test_branches_of_coinciding_eigenvalues() -> None:
    """Modes (p, q) and (q, p) of a square net split under a change of one half; the branches have one-sided slopes."""
    g = Grid(square=True)
    theta = np.ones(6)
    lam, phi = g.eigh(theta)
    found, cluster = _core.eigen_sensitivities(*g.arrays, g.dk, g.dm, lam[:8], phi[:, :8])
    assert cluster[1] == cluster[2]
    assert np.abs(found[0, 2] - found[0, 1]) > 1e-3
    for p in range(6):
        ahead = g.eigh(theta + 1e-6 * np.eye(6)[p])[0][:8]
        np.testing.assert_allclose(found[p], (ahead - lam[:8]) / 1e-6, atol=2e-5)


@pytest.mark.parametrize("free", [False, True])
@pytest.mark.parametrize("n_modes", [1, 5, 12])
def test_shapes(free: bool, n_modes: int) -> None:
    g = Grid(free=free)
    k, m = g.km(THETA)
    lam, phi = g.eigh(THETA)

    def aligned(theta: np.ndarray) -> np.ndarray:
        shapes = g.eigh(theta)[1][:, :n_modes]
        return shapes * np.sign(np.einsum("ij,ij->j", shapes, phi[:, :n_modes]))

    found = _core.shape_sensitivities(*g.arrays, k, m, g.dk, g.dm, lam[:n_modes], phi[:, :n_modes])
    np.testing.assert_allclose(found, g.difference(aligned, THETA), atol=2e-8)


def test_subspace_of_coinciding_shapes() -> None:
    """Single shapes of a pair have no derivative; their projector phi phi^T has one."""
    g = Grid(square=True)
    theta = np.ones(6)
    k, m = g.km(theta)
    lam, phi = g.eigh(theta)
    _, cluster = _core.eigen_sensitivities(*g.arrays, g.dk, g.dm, lam[:6], phi[:, :6])
    n_modes = int(np.flatnonzero(np.diff(cluster))[-1]) + 1
    found = _core.shape_sensitivities(*g.arrays, k, m, g.dk, g.dm, lam[:n_modes], phi[:, :n_modes])
    pair = [1, 2]

    def projector(theta: np.ndarray) -> np.ndarray:
        shapes = g.eigh(theta)[1][:, pair]
        return shapes @ shapes.T

    exact = g.difference(projector, theta)
    half = found[:, :, pair] @ phi[:, pair].T
    np.testing.assert_allclose(half + half.transpose(0, 2, 1), exact, atol=2e-8)


def test_a_cut_cluster_is_told() -> None:
    g = Grid(square=True)
    k, m = g.km(np.ones(6))
    lam, phi = g.eigh(np.ones(6))
    with pytest.raises(ValueError, match="not in phi"):
        _core.shape_sensitivities(*g.arrays, k, m, g.dk, g.dm, lam[:2], phi[:, :2])


OUT, IN = [0, 3, 11, 30], [3, 17]
LINES = np.r_[2j * np.pi * np.linspace(0.02, 0.5, 20), -0.2 + 1.5j]


@pytest.mark.parametrize("kind", ["receptance", "accelerance"])
@pytest.mark.parametrize("square", [False, True])
def test_modal_frf(kind: str, square: bool) -> None:
    """All modes: the derivative of frf_modal itself, with each mode's damping held."""
    g = Grid(square=square)
    theta = np.ones(6) if square else THETA
    zeta = np.full(g.n, 0.02) if square else np.linspace(0.01, 0.05, g.n)
    lam, phi = g.eigh(theta)

    def frf(theta: np.ndarray) -> np.ndarray:
        lam, phi = g.eigh(theta)
        return _core.frf_modal(np.sqrt(lam), zeta, phi[OUT], phi[IN], LINES, kind)

    a = _core.modal_projections(*g.arrays, g.dk, phi)
    b = _core.modal_projections(*g.arrays, g.dm, phi)
    found = _core.frf_modal_sensitivities(np.sqrt(lam), zeta, phi[OUT], phi[IN], a, b, LINES, kind)
    exact = g.difference(frf, theta)
    np.testing.assert_allclose(found, exact, atol=1e-7 * np.abs(exact).max())
    only_k = _core.frf_modal_sensitivities(np.sqrt(lam), zeta, phi[OUT], phi[IN], a[:4], None, LINES, kind)
    np.testing.assert_allclose(only_k, found[:4], atol=1e-13 * np.abs(exact).max())


def test_direct_frf() -> None:
    g = Grid()
    unit = np.eye(g.n)
    c, h = 0.1 * g.base_k, 0.02 * g.km(THETA)[0]
    dc, dh = 0.05 * g.dk, 0.03 * g.dk

    def frf(theta: np.ndarray) -> np.ndarray:
        k, m = g.km(theta)
        change = theta - THETA
        return _core.frf_direct(
            *g.arrays, k, m, unit[:, OUT], unit[:, IN], LINES, "mobility", c=c + change @ dc, h=h + change @ dh
        )

    k, m = g.km(THETA)
    found = _core.frf_direct_sensitivities(
        *g.arrays, k, m, g.dk, g.dm, unit[:, OUT], unit[:, IN], LINES, "mobility", c=c, h=h, dc=dc, dh=dh
    )
    exact = g.difference(frf, THETA)
    np.testing.assert_allclose(found, exact, atol=1e-7 * np.abs(exact).max())


@pytest.mark.parametrize("free", [False, True])
def test_ritz_basis(free: bool) -> None:
    """Static responses are in the span exactly; modes and their first derivatives too."""
    g = Grid(free=free)
    k, m = g.km(THETA)
    M = g.full(m)
    unit = np.eye(g.n)[:, IN]
    v, freq = _core.ritz_basis(*g.arrays, k, m, unit, n_modes=4, dk=g.dk, dm=g.dm)
    assert freq.size == 4
    np.testing.assert_allclose(v.T @ M @ v, np.eye(v.shape[1]), atol=1e-10)
    inside = lambda x: np.abs(x - v @ (v.T @ (M @ x))).max() / np.abs(x).max()  # noqa: E731
    lam, phi = g.eigh(THETA)
    left = phi[:, 4:]
    assert inside(left @ np.diag(1 / lam[4:]) @ left.T @ unit) < 1e-5
    # frequencies 2 % away: reduced with the derivative vectors against full
    theta = THETA * (1 + 0.02 * np.array([1, -1, 1, -1, 1, -1]))
    near_k, near_m = g.km(theta)
    reduced = scipy.linalg.eigh(v.T @ g.full(near_k) @ v, v.T @ g.full(near_m) @ v, eigvals_only=True)[:4]
    np.testing.assert_allclose(reduced, g.eigh(theta)[0][:4], rtol=1e-5, atol=1e-10)
    bare = phi[:, :4]
    coarse = scipy.linalg.eigh(bare.T @ g.full(near_k) @ bare, bare.T @ g.full(near_m) @ bare, eigvals_only=True)
    assert np.abs(reduced - g.eigh(theta)[0][:4]).max() < 0.05 * np.abs(coarse - g.eigh(theta)[0][:4]).max()


def test_ritz_basis_drops_repeated_loads() -> None:
    g = Grid()
    k, m = g.km(THETA)
    unit = np.eye(g.n)[:, [3, 3, 17, 3]]
    v, _ = _core.ritz_basis(*g.arrays, k, m, unit, n_modes=4)
    assert v.shape == (g.n, 6)
