"""Every criterion on an example small enough to be worked with pencil and paper, and what it does with the traps.

Each docstring names the source and its formula; each expected value is a number that was derived by hand, in the
comment above it. Equations are numbered where the number is known. "Shock and Vibration Handbook" is its chapter 21,
Experimental modal analysis, by Allemang and Brown.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import ArrayLike, NDArray

from femend import correlate as co
from femend.analysis.tam import tam_table
from femend.errors import CorrelationError
from femend.expansion import guyan

# Sums of three products of small integers are exact; a root and a quotient cost a digit or two.
EXACT = 1e-14


def one(values: NDArray) -> float | complex:
    """The only entry of an array."""
    assert values.size == 1
    return values.ravel()[0].item()


def line(*outputs: complex) -> NDArray[np.complex128]:
    """An FRF of one line and one input, one value per output."""
    return np.array(outputs, dtype=np.complex128)[None, :, None]


def band(*lines: complex) -> NDArray[np.complex128]:
    """One FRF, one value per line."""
    return np.array(lines, dtype=np.complex128)[:, None, None]


# Shapes


def test_mac() -> None:
    """|a^H b|^2 / ((a^H a)(b^H b)): Allemang and Brown, A correlation coefficient for modal vector analysis, IMAC I,
    1982; Allemang, The modal assurance criterion: twenty years of use and abuse, Sound and Vibration 37(8), 2003."""
    # real: (1 + 4 + 2)^2 / (9 * 6)
    assert one(co.mac([1, 2, 2], [1, 2, 1])) == pytest.approx(49 / 54, abs=EXACT)
    # a^H b = 1*1 + (-2i)*2 + 3*(-i) = 1 - 7i: |.|^2 = 50, over (1 + 4 + 9)(1 + 4 + 1) = 84
    a, b = [1, 2j, 3], [1, 2, -1j]
    assert one(co.mac(a, b)) == pytest.approx(25 / 42, abs=EXACT)
    # without the conjugate it would be |1 + 4i - 3i|^2 / 84 = 2 / 84
    assert one(co.mac(a, b)) != pytest.approx(1 / 42, abs=0.1)
    # scale, sign and phase: b times -3i is the same shape
    assert one(co.mac(a, np.multiply(b, -3j))) == pytest.approx(25 / 42, abs=EXACT)
    # a shape and its conjugate turn opposite ways round: 1*1 + (-i)(-i) = 0
    assert one(co.mac([1, 1j], [1, -1j])) == 0.0


def test_weighted_mac() -> None:
    """|a^T W b|^2 / ((a^T W a)(b^T W b)): Allemang 2003, the weighted form, W the mass matrix."""
    # W = diag(3, 1): (3*1*1 + 1*1*(-1))^2 / (4 * 4) = 4/16; over the identity the two are orthogonal
    assert one(co.mac([1, 1], [1, -1], [3, 1])) == pytest.approx(0.25, abs=EXACT)
    assert one(co.mac([1, 1], [1, -1])) == 0.0
    # W = [[2, 1], [1, 2]], complex: W (1, i) = (2 + i, 1 + 2i); (1, 0) W (1, i) = 2 + i, |.|^2 = 5;
    # (1, 0): 2; (1, i): 2 + i - i(1 + 2i) = 4
    assert one(co.mac([1, 0], [1, 1j], [[2, 1], [1, 2]])) == pytest.approx(5 / 8, abs=EXACT)


def test_automac() -> None:
    """MAC of a set with itself: Allemang 2003."""
    # columns (1, 1, 0) and (1, 0, i): |1|^2 / (2 * 2); without the conjugate the second has length 1 - 1 = 0
    assert co.automac([[1, 1], [1, 0], [0, 1j]]) == pytest.approx(np.array([[1, 0.25], [0.25, 1]]), abs=EXACT)


def test_macx() -> None:
    """(|a^H b| + |a^T b|)^2 / ((a^H a + |a^T a|)(b^H b + |b^T b|)): Vacher, Jacquier and Bucharles, Extensions of the
    MAC criterion to complex modes, ISMA 2010."""
    # a = (1, 2i), b = (2, 1): a^H b = 2 - 2i, a^T b = 2 + 2i: (2 sqrt 8)^2 = 32; a: 5 + |1 - 4| = 8; b: 5 + 5 = 10
    assert one(co.macx([1, 2j], [2, 1])) == pytest.approx(0.4, abs=EXACT)
    assert one(co.mac([1, 2j], [2, 1])) == pytest.approx(8 / 25, abs=EXACT)
    # blind to the sense of turning: a shape and its conjugate are one
    assert one(co.macx([1, 2j], [1, -2j])) == pytest.approx(1.0, abs=EXACT)
    assert one(co.macx([1, 2j], [1, -2j])) > one(co.mac([1, 2j], [1, -2j])) == pytest.approx(9 / 25, abs=EXACT)


def test_subspace_mac() -> None:
    """S2MAC = ((x.f)^2 - 2 (x.f)(f.g)(x.g) + (x.g)^2) / (1 - (f.g)^2) for x, f, g of unit length: D'Ambrogio and
    Fregolent, Mech. Syst. Signal Process. 17, 2003, 599-610."""
    # f = (1, 0, 0), g = (3, 4, 0)/5, x = (2, 1, 2)/3: x.f = 2/3, x.g = (6 + 4)/15 = 2/3, f.g = 3/5
    # (4/9 - 2*4/9*3/5 + 4/9) / (1 - 9/25) = (16/45) / (16/25) = 5/9
    assert one(co.subspace_mac([2, 1, 2], [[1, 3], [0, 4], [0, 0]])) == pytest.approx(5 / 9, abs=EXACT)
    # against either mode alone it is the MAC, 4/9: the pair of close modes explains more than one of them
    assert one(co.mac([2, 1, 2], [3, 4, 0])) == pytest.approx(4 / 9, abs=EXACT)
    # complex: of (1, 1, 1) the span of (1, i, 0) alone holds |1 - i|^2 / (3 * 2)
    assert one(co.subspace_mac([1, 1, 1], [1, 1j, 0])) == pytest.approx(1 / 3, abs=EXACT)
    # a second copy of a mode spans nothing new
    assert one(co.subspace_mac([2, 1, 2], [[1, -7], [0, 0], [0, 0]])) == pytest.approx(4 / 9, abs=EXACT)


def test_principal_angles() -> None:
    """Cosines are the singular values of Qa^H Qb: Björck and Golub, Math. Comp. 27, 1973, 579-594."""
    # the plane of e1, e2 and the plane of e1, (0, 3, 4): the angles are 0 and acos(3/5)
    found = co.principal_cosines([[1, 1], [0, 1], [0, 0]], [[1, 2], [0, 3], [0, 4]])
    assert found == pytest.approx([1, 9 / 25], abs=EXACT)
    # complex: |1 * 1|^2 / 2
    assert one(co.principal_cosines([1, 1j], [1, 0])) == pytest.approx(0.5, abs=EXACT)


def test_msf() -> None:
    """MSF = b^H a / b^H b, the factor that takes b to a: Allemang and Brown 1982."""
    # b^H a = (-i)(1 + i) + 1*2 = 3 - i, b^H b = 2; with the conjugate on the other one it would be 1.5 + 0.5i
    assert one(co.msf([1 + 1j, 2], [1j, 1])) == pytest.approx(1.5 - 0.5j, abs=EXACT)
    assert one(co.msf([2, -4], [-1, 2])) == -2.0


def test_comac() -> None:
    """|sum_r a_r conj(b_r)|^2 / (sum |a_r|^2 sum |b_r|^2) over paired modes r: Lieven and Ewins, IMAC VI, 1988; in
    this form Shock and Vibration Handbook, eq. 21.103, and Allemang 2003."""
    # as given: 1*(-i) + 2i*1 = i: 1 / (5 * 2); without the conjugate (i + 2i) it would be 9/10
    assert one(co.comac([[1, 2j]], [[1j, 1]], normalise=False)) == pytest.approx(0.1, abs=EXACT)
    # modes (3, 4), (4, -3) against -2 (3, 4), (3, -4); at unit length and of one sign
    # DOF 1: (0.6*0.6 + 0.8*0.6)^2 / ((0.36 + 0.64)(0.36 + 0.36)) = 0.84^2 / 0.72
    # DOF 2: (0.8*0.8 + 0.6*0.8)^2 / ((0.64 + 0.36)(0.64 + 0.64)) = 1.12^2 / 1.28
    found = co.comac([[3, 4], [4, -3]], [[-6, 3], [-8, -4]])
    assert found == pytest.approx([0.98, 0.98], abs=EXACT)
    # the modulus stands outside the sum: signs that differ from mode to mode are seen ...
    assert one(co.comac([[1, 1]], [[1, -1]], normalise=False)) == 0.0
    # ... and a sensor upside down in all modes is not
    assert co.comac([[1, 1], [1, -1]], [[1, 1], [-1, 1]], normalise=False).tolist() == [1.0, 1.0]


def test_ecomac() -> None:
    """sum_r |a_r - b_r| / (2 n) over n paired modes, scaled alike: Hunt, Application of an enhanced coordinate modal
    assurance criterion, IMAC X, 1992; Allemang 2003."""
    # a = (2, 1) has largest component 1 as (1, 1/2); b = (1, 1) times (1 + 1/2)/2 = (3/4, 3/4): 1/4 and 1/4, over 2
    assert co.ecomac([2, 1], [1, 1]) == pytest.approx([0.125, 0.125], abs=EXACT)
    # a second mode that agrees but for a factor halves it
    assert co.ecomac([[2, 1], [1, 1]], [[1, -3], [1, -3]]) == pytest.approx([0.0625, 0.0625], abs=EXACT)
    # (1, i) and (1, -i) are orthogonal: nothing of b is taken, |a| / 2 stays
    assert co.ecomac([1, 1j], [1, -1j]) == pytest.approx([0.5, 0.5], abs=EXACT)
    # the last of four sensors upside down: b times 2/4; |1 - 1/2| / 2 at the good ones, |1 + 1/2| / 2 at the bad
    assert co.ecomac([1, 1, 1, 1], [1, 1, 1, -1]) == pytest.approx([0.25, 0.25, 0.25, 0.75], abs=EXACT)


def test_macco() -> None:
    """MAC without the DOF, less the MAC with it: SDT reference manual, ii_mac, MACCO."""
    # a = (1, 1, i), b = (1, 1, -i): a^H b = 1 + 1 - 1, MAC = 1/9; without the third 1; without the first (1 - 1) = 0
    found = co.macco([1, 1, 1j], [1, 1, -1j])[:, 0]
    assert found == pytest.approx([-1 / 9, -1 / 9, 8 / 9], abs=EXACT)
    assert co.eliminate_dofs([1, 1, 1j], [1, 1, -1j], 1).dofs == (2,)


def test_orthogonality() -> None:
    """a^H M b / sqrt((a^H M a)(b^H M b)): Ewins, Modal Testing, 2nd edition 2000, chapter 5."""
    M = np.array([[2.0, 1.0], [1.0, 2.0]])
    # (1, 0) and (1, 1): 3 / sqrt(2 * 6)
    assert co.orthogonality([[1, 1], [0, 1]], M)[0, 1] == pytest.approx(math.sqrt(3) / 2, abs=EXACT)
    # (1, 0) and (1, i): (2 + i) / sqrt(2 * 4), and its conjugate the other way round
    found = co.orthogonality([[1, 1], [0, 1j]], M)
    assert found[0, 1] == pytest.approx((2 + 1j) / math.sqrt(8), abs=EXACT)
    assert found[1, 0] == pytest.approx((2 - 1j) / math.sqrt(8), abs=EXACT)
    # signed and not squared, whatever the scale: MAC over M is its square
    crossed = one(co.cross_orthogonality([5, 0], [-2, -2], M))
    assert crossed == pytest.approx(-math.sqrt(3) / 2, abs=EXACT)
    assert one(co.mac([5, 0], [-2, -2], M)) == pytest.approx(0.75, abs=EXACT)


def test_orthogonality_over_a_reduced_mass() -> None:
    """The same over M reduced to the sensors by Guyan, AIAA Journal 3, 1965: M_r = T^T M T."""
    # three unit masses, springs ground-1-2-3 of stiffness 1; mass 2 is not measured and follows: u2 = (u1 + u3) / 2
    # M_r = [[1 + 1/4, 1/4], [1/4, 1 + 1/4]]
    K, M = np.array([[2.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 1.0]]), np.eye(3)
    reduced = guyan(K, [0, 2]).of(M)
    assert np.asarray(reduced) == pytest.approx(np.array([[1.25, 0.25], [0.25, 1.25]]), abs=EXACT)
    # one mass at a time: 0.25 / 1.25; together against each other: 1.25 - 1.25 = 0
    assert co.orthogonality(np.eye(2), reduced)[0, 1] == pytest.approx(0.2, abs=EXACT)
    assert one(co.cross_orthogonality([1, 1], [1, -1], reduced)) == pytest.approx(0.0, abs=EXACT)
    # cut out instead of reduced, M says that one mass at a time is orthogonal
    assert co.orthogonality(np.eye(2), M[np.ix_([0, 2], [0, 2])])[0, 1] == 0.0
    # the table of reductions says the same of test shapes (1, 0) and (0, 1)
    phi = np.linalg.eigh(K)[1][:, :2]
    row = tam_table(K, M, [0, 2], np.eye(2), phi, [0.07, 0.2], methods=["Guyan"])["Guyan"]
    assert row.off_test == pytest.approx(0.2, abs=EXACT)


def test_mpc_and_mcf() -> None:
    """((Sxx - Syy)^2 + 4 Sxy^2) / (Sxx + Syy)^2: Pappa, Elliott and Schenk, J. Guid. Control Dyn. 16, 1993, 852-858,
    with S the sums of products of real and imaginary parts."""
    # (1 + i, 2): Sxx = 1 + 4, Syy = 1, Sxy = 1: (16 + 4) / 36
    assert one(co.mpc([1 + 1j, 2])) == pytest.approx(5 / 9, abs=EXACT)
    assert one(co.mcf([1 + 1j, 2])) == pytest.approx(4 / 9, abs=EXACT)
    # turned and scaled by 3 - 4i it is the same
    assert one(co.mpc(np.multiply([1 + 1j, 2], 3 - 4j))) == pytest.approx(5 / 9, abs=EXACT)
    # a real shape in any phase is collinear; the mean is not taken off, so that a rigid translation is too
    assert one(co.mpc([1j, 1j, 1j])) == 1.0


def test_mean_phase_and_its_deviation() -> None:
    """The line through the origin nearest to the components, and sum |psi| delta / sum |psi| about it: Reynders,
    Houbrechts and De Roeck, Mech. Syst. Signal Process. 29, 2012, 228-250, section 3.2."""
    # (1 + i, 2): tan(2 angle) = 2 Sxy / (Sxx - Syy) = 2/4, angle = 26.565051 / 2 = 13.282526 degrees
    assert one(co.mean_phase([1 + 1j, 2])) == pytest.approx(13.282526, abs=1e-6)
    # components at 45 and 0 degrees with moduli 1.414214 and 2:
    # (1.414214 * 31.717474 + 2 * 13.282526) / 3.414214 = (44.855284 + 26.565052) / 3.414214
    assert one(co.mpd([1 + 1j, 2])) == pytest.approx(20.918532, abs=2e-6)


def test_mcf_by_area() -> None:
    """Area of the polygon around the components over that of the circle around the largest: Imregun and Ewins,
    IMAC XIII, 1995."""
    # corners 0, 2, 2i: area 2, circle 4 pi
    assert one(co.mcf_area([0, 2, 2j])) == pytest.approx(0.15915494309, abs=1e-10)
    # two components have no area, however far from collinear: MPC sees what this one does not
    assert one(co.mcf_area([1, 1j])) == 0.0
    assert one(co.mpc([1, 1j])) == 0.0


# FRFs and operating shapes


def test_frac() -> None:
    """|sum_w H_a conj(H_b)|^2 / (sum |H_a|^2 sum |H_b|^2) for one FRF over the lines: Heylen and Lammens, ISMA 1996;
    Allemang 2003."""
    # H_a = (1, i), H_b = (1 + i, 0): |1 - i|^2 / (2 * 2)
    assert one(co.frac(band(1, 1j), band(1 + 1j, 0))) == pytest.approx(0.5, abs=EXACT)
    # a loop the other way round has none in common: 1*1 + i*i = 0; without the conjugate it would be 1
    assert one(co.frac(band(1, 1j), band(1, -1j))) == 0.0
    # blind to amplitude and a constant phase: a calibration of 2i
    assert one(co.frac(band(1, 1j), 2j * band(1, 1j))) == pytest.approx(1.0, abs=EXACT)


def test_faac() -> None:
    """2 |sum_w H_a conj(H_b)| / (sum |H_a|^2 + sum |H_b|^2): Zang, Schwingshackl and Ewins 2008."""
    # H_a = (1, i), H_b = (1 + i, 0): 2 sqrt 2 / (2 + 2); twice the amplitude: 2*2*2 / (2 + 8)
    assert one(co.faac(band(1, 1j), band(1 + 1j, 0))) == pytest.approx(math.sqrt(0.5), abs=EXACT)
    assert one(co.faac(band(1, 1j), 2 * band(1, 1j))) == pytest.approx(0.8, abs=EXACT)


def test_csac() -> None:
    """|H_a^H H_b|^2 / ((H_a^H H_a)(H_b^H H_b)) over all DOF pairs of one line: Dascotte and Strobbe, IMAC XVII, 1999;
    Zang, Grafe and Imregun, Mech. Syst. Signal Process. 15, 2001, 139-155 (global shape criterion)."""
    # (1, 2i, 3) and (1, 2, -i), the pair of the MAC
    assert one(co.csac(line(1, 2j, 3), line(1, 2, -1j))) == pytest.approx(25 / 42, abs=EXACT)
    # blind to amplitude: half the damping at a resonance is a factor for all DOFs
    assert one(co.csac(line(1, 2j, 3), 2 * line(1, 2j, 3))) == pytest.approx(1.0, abs=EXACT)
    # two inputs are one long vector: (1, 0 | 0, 1) and (1, 0 | 0, -1): 1 - 1 = 0, each input alone would give 1
    assert co.csac([[[1, 0], [0, 1]]], [[[1, 0], [0, -1]]]).tolist() == [0.0]
    assert co.rvac([[[1, 0], [0, 1]]], [[[1, 0], [0, -1]]]).tolist() == [[1.0, 1.0]]


def test_csf() -> None:
    """2 |H_a^H H_b| / (H_a^H H_a + H_b^H H_b) over all DOF pairs of one line: Dascotte and Strobbe 1999; Zang et al.
    2001 (global amplitude criterion)."""
    # 2 sqrt 50 / (14 + 6)
    assert one(co.csf(line(1, 2j, 3), line(1, 2, -1j))) == pytest.approx(math.sqrt(0.5), abs=EXACT)
    # three times the amplitude: 2*3 / (1 + 9); a common phase is not seen
    assert one(co.csf(line(1, 2j), 3j * line(1, 2j))) == pytest.approx(0.6, abs=EXACT)


def test_rvac() -> None:
    """|h_a^H h_b|^2 / ((h_a^H h_a)(h_b^H h_b)) over the outputs, for one input at one line: Heylen, Lammens and Sas,
    Modal Analysis Theory and Testing, 1997."""
    # input 1: (1, i) with (1, 1): |1 - i|^2 / 4; input 2: (2, 0) with (3, 4): 36 / (4 * 25)
    a, b = [[[1, 2], [1j, 0]]], [[[1, 3], [1, 4]]]
    assert co.rvac(a, b) == pytest.approx(np.array([[0.5, 0.36]]), abs=EXACT)


def test_fdac() -> None:
    """The same between any two lines: Pascual, Golinval and Razeto, A frequency domain correlation technique for model
    correlation and updating, IMAC XV, 1997."""
    # lines (1, 0), (0, 1) of the test come one line later in the model: (9, 9), (2, 0), (0, 3)
    a = np.array([[[1.0], [0.0]], [[0.0], [1.0]]])
    b = np.array([[[9.0], [9.0]], [[2.0], [0.0]], [[0.0], [3.0]]])
    assert co.fdac(a, b)[0] == pytest.approx(np.array([[0.5, 1, 0], [0.5, 0, 1]]), abs=EXACT)
    # signed: Re(h_a^H h_b) / (|h_a| |h_b|): (1, i) with (-i, 1) is -i times it, quadrature; with (-1, -i) opposite
    assert one(co.fdac(line(1, 1j), line(-1j, 1), signed=True)) == pytest.approx(0.0, abs=EXACT)
    assert one(co.fdac(line(1, 1j), line(-1, -1j), signed=True)) == pytest.approx(-1.0, abs=EXACT)
    assert one(co.fdac(line(1, 1j), line(-1j, 1))) == pytest.approx(1.0, abs=EXACT)


def test_local_criteria() -> None:
    """One FRF at one line: 2 |H_a conj(H_b)| / (|H_a|^2 + |H_b|^2), the CSF of one DOF pair; and
    |H_a + H_b|^2 / (2 (|H_a|^2 + |H_b|^2)), the coherence criterion: van der Seijs, thesis TU Delft, 2016."""
    # 1 and 2i: 2*2 / (1 + 4); |1 + 2i|^2 / (2*5)
    assert one(co.lac(band(1), band(2j))) == pytest.approx(0.8, abs=EXACT)
    assert one(co.coherence_criterion(band(1), band(2j))) == pytest.approx(0.5, abs=EXACT)
    # opposite sign: the amplitude criterion does not see it, the coherence criterion sees nothing else
    assert one(co.lac(band(1), band(-1))) == 1.0
    assert one(co.coherence_criterion(band(1), band(-1))) == 0.0
    # each DOF pair by itself: outputs 1 and 2 of one line
    assert co.lac(line(1, 3), line(1, 1)).ravel() == pytest.approx([1.0, 0.6], abs=EXACT)


def test_dac() -> None:
    """MAC between operating shapes at any two speeds: Dascotte and Strobbe 1999; Guggenberger, EASC 2009."""
    # shapes (1, i), (1, 1) at two speeds against (1, -i), (2, 2): 0 and |2 - 2i|^2 / 16; |1 - i|^2 / 4 and 1
    found = co.dac([[1, 1], [1j, 1]], [[1, 2], [-1j, 2]])
    assert found == pytest.approx(np.array([[0, 0.5], [0.5, 1]]), abs=EXACT)


# Traps

Criterion = Callable[[ArrayLike, ArrayLike], NDArray]
OF_SHAPES: list[Criterion] = [co.mac, co.macx, co.msf, co.comac, co.subspace_mac, co.principal_cosines, co.dac]
OF_FRFS: list[Criterion] = [co.frac, co.faac, co.csac, co.csf, co.rvac, co.fdac, co.lac, co.coherence_criterion]
OF_ONE: list[Callable[[ArrayLike], NDArray]] = [co.automac, co.mpc, co.mcf, co.mcf_area, co.mean_phase, co.mpd]


def name(of: Callable[..., NDArray]) -> str:
    return of.__name__


@pytest.mark.parametrize("criterion", [*OF_SHAPES, co.ecomac, co.macco], ids=name)
def test_shapes_of_other_lengths_and_without_value(criterion: Criterion) -> None:
    with pytest.raises(CorrelationError, match="3 and 2 DOFs cannot be compared"):
        criterion([1, 2, 3], [1, 2])
    with pytest.raises(CorrelationError, match="1 values that are not finite"):
        criterion([1, 2, math.nan], [1, 2, 3])
    with pytest.raises(CorrelationError, match="not finite"):
        criterion([1, 2, 3], [1, complex(0, math.inf), 3])
    with pytest.raises(CorrelationError, match="nothing to compare"):
        criterion(np.ones((3, 0)), np.ones((3, 0)))


@pytest.mark.parametrize("criterion", [co.msf, co.comac, co.ecomac, co.macco], ids=name)
def test_criteria_of_pairs_take_as_many_modes(criterion: Criterion) -> None:
    with pytest.raises(CorrelationError, match="2 and 3 modes"):
        criterion(np.ones((4, 2)), np.ones((4, 3)))


@pytest.mark.parametrize("criterion", [co.mac, co.macx, co.msf, co.comac, co.subspace_mac, co.dac], ids=name)
def test_a_shape_that_does_not_move_has_no_number(criterion: Criterion) -> None:
    assert np.isnan(criterion([0, 0], [0, 0])).all()


def test_a_shape_that_does_not_move_leaves_the_others_alone() -> None:
    still, both = [[1, 0], [1, 0]], [[1, 1], [1, 1]]
    nan = math.nan
    for criterion in (co.mac, co.macx, co.dac):
        assert criterion(both, still) == pytest.approx(np.array([[1, nan], [1, nan]]), nan_ok=True), criterion.__name__
    assert co.msf(both, still) == pytest.approx([1, nan], nan_ok=True)
    assert co.subspace_mac(still, both) == pytest.approx([1, nan], nan_ok=True)
    assert co.subspace_mac(both, still) == pytest.approx([1, 1]), "a basis leaves it out"
    # by DOF: at unit length 1/sqrt 2 and 0 against 1/sqrt 2 twice: (1/2)^2 / (1 * 1/2)
    assert co.comac(both, still) == pytest.approx([0.5, 0.5], abs=EXACT)


def test_a_shape_that_does_not_move_is_refused_where_it_would_spoil_the_rest() -> None:
    with pytest.raises(CorrelationError, match="zero at all DOFs"):
        co.ecomac([[1, 0], [1, 0]], [[1, 1], [1, 1]])
    with pytest.raises(CorrelationError, match="mode 2 of the first set has the modal mass 0"):
        co.orthogonality([[1, 0], [1, 0]], [1, 1])
    assert co.principal_cosines([0, 0], [1, 1]).size == 0, "nothing spans no angle"


@pytest.mark.parametrize(
    ("criterion", "value"),
    [(co.mac, 1), (co.macx, 1), (co.comac, 1), (co.subspace_mac, 1), (co.principal_cosines, 1), (co.ecomac, 0)],
    ids=lambda x: getattr(x, "__name__", ""),
)
def test_one_dof_says_nothing(criterion: Criterion, value: float) -> None:
    """Any number is a factor times any other: the criteria are perfect, and mean nothing."""
    assert one(criterion([2j], [-3])) == pytest.approx(value, abs=EXACT)
    with pytest.raises(CorrelationError, match="only one DOF"):
        co.macco([2j], [-3])


@pytest.mark.parametrize("criterion", OF_ONE, ids=name)
def test_criteria_of_one_set(criterion: Callable[[ArrayLike], NDArray]) -> None:
    assert np.isnan(criterion([0, 0])).all()
    with pytest.raises(CorrelationError, match="not finite"):
        criterion([1, math.nan])
    with pytest.raises(CorrelationError, match="nothing to compare"):
        criterion(np.ones((0, 1)))
    # one DOF is a real shape in some phase: 2i is collinear, without area, at 90 degrees
    single = {"mcf": 0, "mcf_area": 0, "mean_phase": 90, "mpd": 0}
    assert one(criterion([2j])) == pytest.approx(single.get(criterion.__name__, 1), abs=EXACT)


@pytest.mark.parametrize("criterion", OF_FRFS, ids=name)
def test_frfs_of_other_sizes_and_without_value(criterion: Criterion) -> None:
    H = np.ones((3, 2, 1))
    if criterion is not co.fdac:  # it takes any lines
        with pytest.raises(CorrelationError, match="cannot be compared"):
            criterion(H, np.ones((4, 2, 1)))
    with pytest.raises(CorrelationError, match=r"\(3, 2, 1\) and \(3, 1, 1\)"):
        criterion(H, np.ones((3, 1, 1)))
    with pytest.raises(CorrelationError, match="not finite"):
        criterion(H, H * math.nan)
    with pytest.raises(CorrelationError, match="H\\[:, None, None\\]"):
        criterion([1, 2], [1, 2])
    assert np.isnan(criterion(0 * H, 0 * H)).all()
    # one of them is zero: no shape to compare, but an amplitude that is wrong; opposite values would be 0
    with_amplitude = {"faac": 0.0, "csf": 0.0, "lac": 0.0, "coherence_criterion": 0.5}
    against = criterion(0 * H, H)
    assert against == pytest.approx(with_amplitude.get(criterion.__name__, math.nan), nan_ok=True)
