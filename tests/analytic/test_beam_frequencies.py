"""Beams against closed forms: discrete rods to all digits, Rayleigh and Timoshenko beams to the mesh's error."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[1]))
import fe

E, NU, RHO = 2.1e11, 0.3, 7850.0
G = E / (2 * (1 + NU))
A, I1, I2, J = 6e-4, 5e-8, 2e-8, 3e-8
L = 1.3


@pytest.mark.parametrize(("component", "speed"), [(1, np.sqrt(E / RHO)), (4, np.sqrt(G * J / (RHO * (I1 + I2))))])
@pytest.mark.parametrize("coupled", [True, False])
def test_rods_and_shafts_have_the_discrete_frequencies(
    tmp_path: Path, component: int, speed: float, coupled: bool
) -> None:
    """Held at one end: the linear elements' own closed form, to rounding."""
    n = 8
    others = "".join(c for c in "123456" if c != str(component))
    cards = [*fe.line(n, L), f"SPC1,1,{others},1,THRU,{n + 1}", f"SPC1,1,{component},1"]
    K, M = fe.matrices(fe.model(tmp_path, cards, coupled=coupled))
    angle = (2 * np.arange(1, n + 1) - 1) * np.pi / (2 * n)
    h = L / n
    waves = 6 * (1 - np.cos(angle)) / (2 + np.cos(angle)) if coupled else 2 * (1 - np.cos(angle))
    np.testing.assert_allclose(fe.low_omega(K, M), speed / h * np.sqrt(waves), rtol=1e-10)


def timoshenko_pinned(order: int, inertia: float, k: float) -> float:
    """Lowest root of the frequency equation of a pinned-pinned Timoshenko beam (Rayleigh's for k = 0)."""
    q = order * np.pi / L
    m, j = RHO * A, RHO * inertia
    if k == 0:
        return float(np.sqrt(E * inertia * q**4 / (m + j * q**2)))
    s = k * G * A
    a, b, c = m * j, -(m * (E * inertia * q**2 + s) + s * q**2 * j), s * E * inertia * q**4
    return float(np.sqrt((-b - np.sqrt(b * b - 4 * a * c)) / (2 * a)))


@pytest.mark.parametrize("plane", [1, 2])
@pytest.mark.parametrize("k", [0.0, 0.05, 5 / 6])
def test_pinned_beam_bends_as_timoshenko_says(tmp_path: Path, plane: int, k: float) -> None:
    """With shear flexibility exaggerated (k = 0.05) and without: the error is what the shape functions leave."""
    n = 20
    held, turn = ("1345", 2) if plane == 1 else ("1246", 3)
    shear = f"{k},{k}" if k else ""
    cards = [*fe.line(n, L, shear=shear), f"SPC1,1,{held},1,THRU,{n + 1}", f"SPC1,1,{turn},1,{n + 1}"]
    K, M = fe.matrices(fe.model(tmp_path, cards))
    inertia = I1 if plane == 1 else I2
    error = fe.low_omega(K, M)[:3] / [timoshenko_pinned(i, inertia, k) for i in (1, 2, 3)] - 1
    q = np.pi * np.arange(1, 4) / L
    share = E * inertia * q**2 / (k * G * A) if k else 0.0
    # a cubic deflection leaves (q h)^4 / 1440; a shear strain that is constant over the element, its share (q h)^2 / 24
    expected = (q * L / n) ** 4 / 1440 + share * (q * L / n) ** 2 / 24
    np.testing.assert_array_less(0.7 * expected, error)
    np.testing.assert_array_less(error, 1.02 * expected)


def test_cantilever_statics_is_exact_with_one_element(tmp_path: Path) -> None:
    """Tip flexibility L³/3EI + L/kGA, L/EA, L/GJ from a single element."""
    k = 0.6
    cards = [*fe.line(1, L, shear=f"{k},{k}"), "SPC1,1,123456,1"]
    K, _ = fe.matrices(fe.model(tmp_path, cards))
    flexibility = np.diag(np.linalg.inv(K))
    bend = [L**3 / (3 * E * i) + L / (k * G * A) for i in (I1, I2)]
    expected = [L / (E * A), *bend, L / (G * J), L / (E * I2), L / (E * I1)]
    np.testing.assert_allclose(flexibility, expected, rtol=1e-11)


def test_product_of_inertia_bends_about_the_principal_axes(tmp_path: Path) -> None:
    """A turned section given by I12 has the frequencies of the section given in its principal axes."""
    angle = 0.4
    c, s = float(np.cos(angle)), float(np.sin(angle))
    i1, i2 = I1 * c * c + I2 * s * s, I1 * s * s + I2 * c * c
    i12 = (I1 - I2) * c * s
    turned = [
        f"PBAR,1,1,{A},{i1!r},{i2!r},{J}",
        "+,",
        f"+,0.,0.,{i12!r}",
    ]
    n = 6
    straight = [*fe.line(n, L), "SPC1,1,123456,1"]
    cards = [card for card in straight if not card.startswith("PBAR")] + turned
    first = fe.low_omega(*fe.matrices(fe.model(tmp_path, straight)))
    second = fe.low_omega(*fe.matrices(fe.model(tmp_path, cards)))
    np.testing.assert_allclose(second[:12], first[:12], rtol=1e-9)


def test_a_hinge_halves_the_beam(tmp_path: Path) -> None:
    """Released moments in the middle of a clamped-clamped beam: two cantilevers share a tip load."""
    cards = [c for c in fe.line(2, 2 * L) if not c.startswith("CBAR")]
    cards += ["CBAR,1,1,1,2,0.,1.,0.", "+,,56", "CBAR,2,1,2,3,0.,1.,0.", "SPC1,1,123456,1,3"]
    fem = fe.model(tmp_path, cards)
    K, _ = fe.matrices(fem)
    force = np.zeros(fem.n_a)
    force[list(fem.dof_components).index(2)] = 1.0
    # one half is released: only its shear goes over; both halves bend as cantilevers
    deflection = force @ np.linalg.solve(K, force)
    # node 2 keeps the rotation of the second beam, whose tip is free of moment
    assert deflection == pytest.approx(L**3 / (6 * E * I1), rel=1e-11)


def test_offsets_move_the_beam_not_the_nodes(tmp_path: Path) -> None:
    """A beam whose ends are offset equals one between massless nodes on RBE2 arms."""
    arm = "0.03,-0.02,0.1"
    direct = ["GRID,1,,0.,0.,0.", "GRID,2,,1.,0.2,0.", "CBAR,1,1,1,2,0.,0.,1.", f"+,,,{arm},{arm}"]
    arms = ["GRID,1,,0.,0.,0.", "GRID,2,,1.,0.2,0.", f"GRID,11,,{arm}", "GRID,12,,1.03,0.18,0.1"]
    arms += ["CBAR,1,1,11,12,0.,0.,1.", "RBE2,21,1,123456,11", "RBE2,22,2,123456,12"]
    common = [f"PBAR,1,1,{A},{I1},{I2},{J}", "MAT1,1,2.1+11,,0.3,7850."]
    results = [fe.matrices(fe.model(tmp_path, common + cards)) for cards in (direct, arms)]
    for a, b in zip(*results, strict=True):
        np.testing.assert_allclose(a, b, atol=1e-12 * abs(a).max())


def test_a_mass_with_offset_and_inertia_swings_as_a_rigid_body(tmp_path: Path) -> None:
    """A rigid body on a torsion spring: omega² = k / (I + m d²)."""
    cards = ["GRID,1,,0.,0.,0.", "CONM2,5,1,,2.,0.,0.3,0.", "+,0.07,,0.,,,0.", "CELAS2,6,50.,1,4", "SPC1,1,12356,1"]
    K, M = fe.matrices(fe.model(tmp_path, cards))
    assert fe.low_omega(K, M)[0] == pytest.approx(np.sqrt(50 / (0.07 + 2 * 0.09)), rel=1e-12)


def test_a_chain_of_masses_and_springs(tmp_path: Path) -> None:
    """n equal masses between walls: omega_i = 2 sqrt(k/m) sin(i pi / (2 (n + 1)))."""
    n, k, m = 7, 3e4, 0.8
    cards = [f"GRID,{i},,{i}.,0.,0." for i in range(1, n + 1)] + [f"CONM2,{100 + i},{i},,{m}" for i in range(1, n + 1)]
    cards += [f"CELAS2,{i},{k},{i},1,{i + 1},1" for i in range(1, n)]
    cards += [f"CELAS2,{n},{k},1,1", f"CELAS2,{n + 1},{k},{n},1", f"SPC1,1,23456,1,THRU,{n}"]
    K, M = fe.matrices(fe.model(tmp_path, cards))
    expected = 2 * np.sqrt(k / m) * np.sin(np.arange(1, n + 1) * np.pi / (2 * (n + 1)))
    np.testing.assert_allclose(fe.low_omega(K, M), expected, rtol=1e-12)


def test_a_bush_of_any_length_and_frame_has_its_stiffnesses(tmp_path: Path) -> None:
    """Grounded and two-node bushes: stiffness at the spring's place, in its own axes."""
    cards = [
        "GRID,1,,0.,0.,0.",
        "GRID,2,,0.,0.,0.4",
        "CORD2R,7,,0.,0.,0.,1.,0.,0.",
        "+,0.,1.,0.",
        "PBUSH,4,K,1.+3,2.+3,4.+3,5.,6.,7.",
        "CBUSH,5,4,1,2,,,,7",
        "SPC1,1,123456,1",
        "CONM2,9,2,,1.",
        "+,1.,,1.,,,1.",
    ]
    fem = fe.model(tmp_path, cards)
    K, _ = fe.matrices(fem)
    # local z = basic x, local x = basic y, local y = basic z; the spring sits half-way, 0.2 below node 2
    arm = 0.2
    expected = np.diag([4e3, 1e3, 2e3, 7 + 1e3 * arm**2, 5 + 4e3 * arm**2, 6.0])
    expected[0, 4] = expected[4, 0] = -4e3 * arm
    expected[1, 3] = expected[3, 1] = 1e3 * arm
    np.testing.assert_allclose(K, expected, atol=1e-9)
