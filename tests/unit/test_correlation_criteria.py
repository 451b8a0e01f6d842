"""Every criterion against its published formula, written out in sums, and against worked numbers."""

from __future__ import annotations

import math
import time

import numpy as np
import pytest
import scipy.linalg
import scipy.sparse
from numpy.typing import NDArray

from femend import correlate as co
from femend.errors import CorrelationError

RNG = np.random.default_rng(20)
A = RNG.standard_normal((7, 3)) + 1j * RNG.standard_normal((7, 3))
B = A + 0.5 * (RNG.standard_normal((7, 3)) + 1j * RNG.standard_normal((7, 3)))
H_A = RNG.standard_normal((11, 4, 2)) + 1j * RNG.standard_normal((11, 4, 2))
H_B = H_A + 0.4 * (RNG.standard_normal((11, 4, 2)) + 1j * RNG.standard_normal((11, 4, 2)))
# A sum of ten products of numbers of order one keeps 15 digits; quotients of such sums keep 13.
DIGITS = 1e-13


def sums(x: NDArray, y: NDArray) -> tuple[complex, float, float]:
    """sum x conj(y), sum |x|^2, sum |y|^2, one term after the other."""
    pairs = list(zip(np.ravel(x).tolist(), np.ravel(y).tolist(), strict=True))
    return (
        sum(p * complex(q).conjugate() for p, q in pairs),
        math.fsum(abs(p) ** 2 for p, _ in pairs),
        math.fsum(abs(q) ** 2 for _, q in pairs),
    )


def shape_rule(x: NDArray, y: NDArray) -> float:
    """|sum x conj(y)|^2 / (sum |x|^2 sum |y|^2): Allemang 2003, for MAC, COMAC, FRAC; CSAC and RVAC likewise."""
    cross, xx, yy = sums(x, y)
    return abs(cross) ** 2 / (xx * yy)


def scale_rule(x: NDArray, y: NDArray) -> float:
    """2 |sum x conj(y)| / (sum |x|^2 + sum |y|^2): CSF of Dascotte and Strobbe 1999, FAAC."""
    cross, xx, yy = sums(x, y)
    return 2 * abs(cross) / (xx + yy)


def table(rule, x: NDArray, y: NDArray) -> NDArray:
    return np.array([[rule(x[:, i], y[:, j]) for j in range(y.shape[1])] for i in range(x.shape[1])])


def test_mac_worked_by_hand() -> None:
    # (1*1 + 2*2 + 2*1)^2 / ((1 + 4 + 4)(1 + 4 + 1)) = 49/54
    assert co.mac([1.0, 2.0, 2.0], [1.0, 2.0, 1.0])[0, 0] == pytest.approx(49 / 54, rel=1e-15)
    # complex: |(1)(1) + (-i)(1)|^2 / (2 * 2) = 2/4
    assert co.mac([1.0, 1j], [1.0, 1.0])[0, 0] == pytest.approx(0.5, rel=1e-15)


def test_mac_of_sets_is_the_formula_pair_by_pair() -> None:
    assert co.mac(A, B) == pytest.approx(table(shape_rule, A, B), abs=DIGITS)
    assert co.dac(A, B) == pytest.approx(co.mac(A, B), abs=0)
    assert np.diagonal(co.automac(A)) == pytest.approx(np.ones(3), abs=DIGITS)
    batch = co.mac(np.stack([A, B]), np.stack([B, B]))
    assert batch.shape == (2, 3, 3)
    assert batch[0] == pytest.approx(co.mac(A, B), abs=DIGITS)


@pytest.mark.parametrize("form", ["vector", "dense", "sparse"])
def test_weighted_mac_and_orthogonality(form: str) -> None:
    m = np.array([1.0, 2.0, 0.5, 3.0, 1.0, 4.0, 0.2])
    M = {"vector": m, "dense": np.diag(m), "sparse": scipy.sparse.diags_array(m).tocsr()}[form]
    expected = table(shape_rule, np.sqrt(m)[:, None] * A, np.sqrt(m)[:, None] * B)
    assert co.mac(A, B, M) == pytest.approx(expected, abs=DIGITS)
    assert np.abs(co.cross_orthogonality(A, B, M)) ** 2 == pytest.approx(expected, abs=DIGITS)


def test_modes_of_a_model_are_orthogonal_over_its_mass() -> None:
    K, M = np.array([[3.0, -2.0], [-2.0, 2.0]]), np.diag([1.0, 2.0])
    phi = scipy.linalg.eigh(K, M)[1]
    assert co.orthogonality(phi * [5.0, -0.1], M) == pytest.approx(np.diag([1.0, 1.0]), abs=1e-14)
    assert co.mac(phi, phi)[0, 1] > 0.05, "over the identity they are not orthogonal"
    signed = co.cross_orthogonality(phi, -phi, M)
    assert np.diagonal(signed) == pytest.approx([-1.0, -1.0], abs=1e-14)


def test_macx_of_the_publication() -> None:
    # Vacher et al. 2010: (|x^H y| + |x^T y|)^2 / ((x^H x + |x^T x|)(y^H y + |y^T y|))
    def rule(x: NDArray, y: NDArray) -> float:
        top = abs(sum(p.conjugate() * q for p, q in zip(x, y, strict=True))) + abs(sum(x * y))
        return float(top**2 / ((sum(abs(x) ** 2) + abs(sum(x * x))) * (sum(abs(y) ** 2) + abs(sum(y * y)))))

    assert co.macx(A, B) == pytest.approx(table(rule, A, B), abs=DIGITS)
    assert co.macx(A.real, B.real) == pytest.approx(co.mac(A.real, B.real), abs=DIGITS)
    assert np.diagonal(co.macx(A, A.conj())) == pytest.approx(np.ones(3), abs=DIGITS)


def test_modal_scale_factor_is_the_least_squares_factor() -> None:
    scale = co.msf(A, B)
    for r in range(3):
        fitted = np.linalg.lstsq(B[:, r : r + 1], A[:, r], rcond=None)[0][0]
        assert scale[r] == pytest.approx(fitted, abs=DIGITS)
    # by hand: (1*2 + 1*4) / (1 + 1) = 3
    assert co.msf([2.0, 4.0], [1.0, 1.0]).tolist() == [3.0]
    assert co.msf([1e-200, 0.0], [1e200, 0.0]) == pytest.approx([0.0], abs=1e-300)


def test_comac_is_the_formula_and_worked_by_hand() -> None:
    expected = [shape_rule(A[q], B[q]) for q in range(7)]
    assert co.comac(A, B, normalise=False) == pytest.approx(expected, abs=DIGITS)
    # (1*1 + 2*1)^2 / ((1 + 4)(1 + 1)) = 0.9
    assert co.comac([[1.0, 2.0]], [[1.0, 1.0]], normalise=False) == pytest.approx([0.9], rel=1e-15)


def test_comac_with_normalising_does_not_mind_scale_and_phase_of_each_mode() -> None:
    factor = np.array([3.0, -0.01, 1j])
    assert co.comac(A, B * factor) == pytest.approx(co.comac(A * factor[::-1], B), abs=DIGITS)
    assert co.comac(A, A * factor) == pytest.approx(np.ones(7), abs=DIGITS)


def test_ecomac_is_the_formula_and_finds_the_reversed_sensor() -> None:
    a = A.real / np.abs(A.real).max(axis=0)
    b = B.real
    fitted = np.column_stack([b[:, r] * (a[:, r] @ b[:, r]) / (b[:, r] @ b[:, r]) for r in range(3)])
    expected = np.abs(a - fitted).sum(axis=1) / 6
    assert co.ecomac(A.real * [2.0, -1.0, 5.0], -7.0 * b) == pytest.approx(expected, abs=DIGITS)
    turned = A.copy()
    turned[4] *= -1
    assert np.argmax(co.ecomac(A, turned)) == 4
    assert co.comac(A, turned)[4] > 0.999, "a sensor upside down in all modes is what CoMAC cannot see"


def test_macco_is_the_mac_without_the_dof() -> None:
    for r in range(3):
        for q in range(7):
            rest = [i for i in range(7) if i != q]
            gain = shape_rule(A[rest, r], B[rest, r]) - shape_rule(A[:, r], B[:, r])
            assert co.macco(A, B)[q, r] == pytest.approx(gain, abs=DIGITS)
    assert np.isnan(co.macco([1.0, 0.0], [1.0, 0.0])[0, 0])


def test_elimination_takes_out_the_wrong_sensors_first() -> None:
    wrong = A + 0.01 * RNG.standard_normal(A.shape)
    wrong[2] *= -1
    wrong[5] = 0.1 * wrong[6]
    done = co.eliminate_dofs(A, wrong, 3)
    assert set(done.dofs[:2]) == {2, 5}
    assert done.mean_mac[2] > 0.999 > 0.9 > done.mean_mac[0]
    assert len(done.mean_mac) == 4


def test_frf_criteria_are_the_formulas() -> None:
    n_freq, n_out, n_in = H_A.shape
    pairs = [(p, q) for p in range(n_out) for q in range(n_in)]
    for p, q in pairs:
        assert co.frac(H_A, H_B)[p, q] == pytest.approx(shape_rule(H_A[:, p, q], H_B[:, p, q]), abs=DIGITS)
        assert co.faac(H_A, H_B)[p, q] == pytest.approx(scale_rule(H_A[:, p, q], H_B[:, p, q]), abs=DIGITS)
    for k in range(n_freq):
        assert co.csac(H_A, H_B)[k] == pytest.approx(shape_rule(H_A[k], H_B[k]), abs=DIGITS)
        assert co.csf(H_A, H_B)[k] == pytest.approx(scale_rule(H_A[k], H_B[k]), abs=DIGITS)
        for q in range(n_in):
            assert co.rvac(H_A, H_B)[k, q] == pytest.approx(shape_rule(H_A[k, :, q], H_B[k, :, q]), abs=DIGITS)
            for m in range(n_freq):
                expected = shape_rule(H_A[k, :, q], H_B[m, :, q])
                assert co.fdac(H_A, H_B)[q, k, m] == pytest.approx(expected, abs=DIGITS)
    assert co.coherence_criterion(H_A, H_B) == pytest.approx(
        np.abs(H_A + H_B) ** 2 / (2 * (np.abs(H_A) ** 2 + np.abs(H_B) ** 2)), abs=DIGITS
    )


def test_frf_criteria_worked_by_hand() -> None:
    # Two outputs, one line: a = (3, 4), b = (4, 3). CSAC = (12 + 12)^2 / (25 * 25), CSF = 2 * 24 / 50.
    a, b = np.array([[[3.0], [4.0]]]), np.array([[[4.0], [3.0]]])
    assert co.csac(a, b)[0] == pytest.approx(576 / 625, rel=1e-15)
    assert co.csf(a, b)[0] == pytest.approx(0.96, rel=1e-15)
    # CSAC does not mind the scale, CSF does: 2 * 2 * 25 / (25 + 100)
    assert co.csac(a, 2 * a)[0] == pytest.approx(1.0, rel=1e-15)
    assert co.csf(a, 2 * a)[0] == pytest.approx(0.8, rel=1e-15)


def test_fdac_ridge_is_the_shift_of_frequency() -> None:
    freq = np.linspace(1.0, 20.0, 96)
    shapes = np.linalg.qr(RNG.standard_normal((6, 3)))[0]

    def frf(factor: float) -> NDArray:
        poles = factor * np.array([5.0, 9.0, 14.0])
        q = 1 / (poles**2 - freq[:, None] ** 2 + 0.02j * poles * freq[:, None])
        return (shapes * shapes[0])[None] @ q[:, :, None]

    ridge = co.fdac(frf(1.0), frf(1.1))[0]
    at = [int(np.argmin(np.abs(freq - f))) for f in (5.0, 9.0, 14.0)]
    # one line is 0.2 Hz: the ridge is where the model has its modes, within a line
    assert [freq[int(np.argmax(ridge[k]))] for k in at] == pytest.approx([5.5, 9.9, 15.4], abs=0.2)
    signed = co.fdac(frf(1.0), -frf(1.0), signed=True)[0]
    assert np.diagonal(signed) == pytest.approx(-np.ones(freq.size), abs=1e-12)


def test_mpc_is_that_of_the_covariances() -> None:
    # Pappa, Elliott and Schenk 1993, with sums over the components
    x, y = A.real, A.imag
    sxx, syy, sxy = (x * x).sum(axis=0), (y * y).sum(axis=0), (x * y).sum(axis=0)
    expected = ((sxx - syy) ** 2 + 4 * sxy**2) / (sxx + syy) ** 2
    assert co.mpc(A) == pytest.approx(expected, abs=DIGITS)
    assert co.mpc(A) == pytest.approx(np.diagonal(co.mac(A, A.conj())), abs=DIGITS)
    assert co.mcf(A) == pytest.approx(1 - expected, abs=DIGITS)
    # by hand: (3, 4i): ((9 - 16)^2 + 0) / 25^2
    assert co.mpc([3.0, 4j]) == pytest.approx([49 / 625], rel=1e-15)


def test_mpd_is_that_of_the_singular_vectors() -> None:
    # Reynders et al. 2012: V from [Re, Im] = U S V^T, weights |psi|
    for r in range(3):
        psi = A[:, r]
        V = np.linalg.svd(np.column_stack([psi.real, psi.imag]))[2].T
        cosine = np.abs(psi.real * V[1, 1] - psi.imag * V[0, 1]) / (np.hypot(V[0, 1], V[1, 1]) * np.abs(psi))
        expected = np.degrees((np.abs(psi) * np.arccos(np.minimum(cosine, 1))).sum() / np.abs(psi).sum())
        assert co.mpd(A)[r] == pytest.approx(expected, abs=1e-10)
        phase = np.degrees(np.arctan(-V[0, 1] / V[1, 1]))
        assert (co.mean_phase(A)[r] - phase) % 180 == pytest.approx(0.0, abs=1e-9) or (
            co.mean_phase(A)[r] - phase
        ) % 180 == pytest.approx(180.0, abs=1e-9)


def test_complexity_of_real_and_of_travelling_shapes() -> None:
    real = RNG.standard_normal((9, 2)) * np.exp(1j * np.array([0.3, -2.0]))
    assert co.mpc(real) == pytest.approx([1.0, 1.0], abs=DIGITS)
    assert co.mpd(real) == pytest.approx([0.0, 0.0], abs=1e-10)
    assert co.mcf_area(real) == pytest.approx([0.0, 0.0], abs=1e-12)
    wave = np.exp(2j * np.pi * np.arange(400) / 400)
    assert co.mpc(wave) == pytest.approx([0.0], abs=1e-12)
    assert np.isnan(co.mean_phase(wave)).all()
    # 400 points: the polygon's area is (n/2) sin(2 pi/n), of pi
    assert co.mcf_area(wave) == pytest.approx([200 * np.sin(2 * np.pi / 400) / np.pi], rel=1e-12)
    # square at half and full radius: the inner points do not count
    assert co.mcf_area([1.0, 1j, -1.0, -1j, 0.5 + 0.1j]) == pytest.approx([2 / np.pi], rel=1e-12)


def test_where_nothing_moves_there_is_no_number() -> None:
    assert np.isnan(co.mac([0.0, 0.0], [1.0, 2.0])).all()
    assert np.isnan(co.comac([[1.0], [0.0]], [[1.0], [0.0]])).tolist() == [False, True]
    still = np.zeros((1, 2, 1))
    assert np.isnan(co.csac(still, still + 1.0)).all()
    assert co.csf(still, still + 1.0).tolist() == [0.0]
    assert np.isnan(co.csf(still, still)).all()
    assert np.isnan(co.mpc([0.0, 0.0])).all()
    assert np.isnan(co.msf([1.0], [0.0])).all()


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: co.mac(np.ones((3, 2)), np.ones((4, 2))), "3 and 4 DOFs cannot be compared"),
        (lambda: co.mac([1.0, np.inf], [1.0, 1.0]), "1 values that are not finite, the first at (1,)"),
        (lambda: co.mac([1.0, 1.0], [1.0, 1.0], np.eye(3)), "shape (3, 3) does not fit shapes with 2 DOFs"),
        (lambda: co.mac([1.0, 1.0], [1.0, 1.0], [-1.0, 0.0]), "gives a shape the square -1"),
        # (1 + 1/8)^2 / (1 - 1/8)^2 = 81/49: this weight is negative at the second DOF
        (lambda: co.mac([1.0, 0.5], [1.0, -0.5], [1.0, -0.5]), "the quotient 1.653, where 1 is the most"),
        (lambda: co.mac([1.0, 0.0], [0.0, 1.0], [[1.0, 0.5], [0.0, 1.0]]), "differs from its transpose by 0.5"),
        (lambda: co.orthogonality(np.eye(2), scipy.sparse.csr_array([[1.0, 0.5], [0.0, 1.0]])), "both triangles"),
        (lambda: co.mac([1.0, 0.0], [0.0, 1.0], scipy.sparse.csr_array(np.diag([np.nan, 1.0]))), "not finite"),
        (lambda: co.mac(2.0, 3.0), "a single number"),
        (lambda: co.comac(np.ones((3, 2)), np.ones((3, 1))), "2 and 1 modes"),
        (lambda: co.ecomac([0.0, 0.0], [1.0, 1.0]), "zero at all DOFs"),
        (lambda: co.macco([1.0], [1.0]), "only one DOF"),
        (lambda: co.eliminate_dofs([1.0, 1.0], [1.0, 1.0], 1), "1 of 2 DOFs cannot be left out"),
        (
            lambda: co.orthogonality([[1.0, 0.0], [0.0, 1.0]], [1.0, 0.0]),
            "mode 2 of the first set has the modal mass 0",
        ),
        (lambda: co.csac(np.ones((3, 2)), np.ones((3, 2))), "FRFs are (n_freq, n_out, n_in)"),
        (lambda: co.frac(np.ones((3, 2, 1)), np.ones((4, 2, 1))), "cannot be compared"),
        (lambda: co.fdac(np.ones((3, 2, 1)), np.ones((3, 3, 1))), "FDAC takes"),
        (lambda: co.mac(np.ones((0, 2)), np.ones((0, 2))), "nothing to compare"),
    ],
)
def test_what_cannot_be_compared_is_refused(call, words: str) -> None:
    with pytest.raises(CorrelationError) as caught:
        call()
    assert words in str(caught.value)


def test_mac_of_large_sets_is_quick() -> None:
    # The agreed limit is 50 ms (benches/correlation.py); six times that still tells a product from a loop.
    a, b = RNG.standard_normal((2, 5000, 200))
    seconds = []
    for _ in range(3):
        start = time.perf_counter()
        co.mac(a, b)
        seconds.append(time.perf_counter() - start)
    assert min(seconds) < 0.3


@pytest.mark.parametrize("size", [1e-180, 1e-90, 1e90, 1e180])
def test_numbers_of_any_size_give_the_same(size: float) -> None:
    # Squares of 1e180 overflow and those of 1e-180 are lost.
    for criterion in (co.mac, co.macx, co.comac, co.ecomac, co.macco, co.subspace_mac):
        assert criterion(size * A, size * B) == pytest.approx(criterion(A, B), abs=1e-12), criterion.__name__
    for criterion in (co.frac, co.faac, co.csac, co.csf, co.rvac, co.fdac, co.lac, co.coherence_criterion):
        assert criterion(size * H_A, size * H_B) == pytest.approx(criterion(H_A, H_B), abs=1e-12), criterion.__name__
    for criterion in (co.mpc, co.mpd, co.mcf_area, co.mean_phase):
        assert criterion(size * A) == pytest.approx(criterion(A), abs=1e-10), criterion.__name__
    assert co.msf(size * A, size * B) == pytest.approx(co.msf(A, B), rel=1e-12)
    M = np.diag(RNG.uniform(1, 2, 7))
    for use in (lambda a, b: co.mac(a, b, M), lambda a, b: co.cross_orthogonality(a, b, M)):
        assert use(size * A, size * B) == pytest.approx(use(A, B), abs=1e-12)


def test_numbers_at_the_ends_of_the_range() -> None:
    # The modulus of the first number is 2.4e308, which does not exist; the smallest number there is divides by nothing.
    largest, smallest = 1.7e308, 5e-324
    # |(1 - i) + 1|^2 / ((2 + 1) 2) = 5/6
    assert co.mac([largest * (1 + 1j), largest], [1.0, 1.0])[0, 0] == pytest.approx(5 / 6, rel=1e-15)
    assert co.mac([smallest, smallest], [largest, largest])[0, 0] == pytest.approx(1.0, rel=1e-15)
    assert co.mpc([smallest, 1j * smallest]) == pytest.approx([0.0], abs=1e-15)
    H = np.full((1, 1, 1), largest * (1 + 1j))
    assert co.csf(H, H) == pytest.approx([1.0], rel=1e-15)
    assert co.coherence_criterion(H, -H).ravel() == pytest.approx([0.0], abs=1e-15)


def test_one_frf_is_compared_with_a_batch_from_either_side() -> None:
    """Samples of a model against one test: every criterion of pairs broadcasts."""
    batch = np.stack([H_A, 2 * H_B])
    for criterion in (co.frac, co.faac, co.csac, co.csf, co.rvac, co.lac, co.coherence_criterion):
        from_left, from_right = criterion(batch, H_A), criterion(H_A, batch)
        for k in range(2):
            assert from_left[k] == pytest.approx(criterion(batch[k], H_A), abs=DIGITS), criterion.__name__
            assert from_right[k] == pytest.approx(criterion(H_A, batch[k]), abs=DIGITS), criterion.__name__
