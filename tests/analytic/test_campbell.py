"""Rotors with closed-form whirl: tilting disc, Stodola's overhung disc, Jeffcott with internal damping, two speeds."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.sparse import csc_array

from femend.analysis.campbell import campbell
from femend.analysis.complex_modes import complex_modes
from femend.analysis.turning import TurningSystem
from femend.dof import Dof
from femend.model import read_model
from femend.model.terms.spinning import SpinningPart

Array = NDArray[np.float64]
ALONG_X = SpinningPart((1.0, 0.0, 0.0))
# cantilever with a disc at its end
L, EI, MASS, ID, IP = 0.5, 1.05e4, 5.0, 0.02, 0.036
K = EI / L**3


def overhung() -> TurningSystem:
    """Stodola's rotor: a massless shaft along X clamped at 0, a disc at L; rows Y, Z, RY, RZ of node 1."""
    k, m = np.zeros((4, 4)), np.diag([MASS, MASS, ID, ID])
    k[np.ix_([0, 3], [0, 3])] = K * np.array([[12, -6 * L], [-6 * L, 4 * L * L]])
    k[np.ix_([1, 2], [1, 2])] = K * np.array([[12, 6 * L], [6 * L, 4 * L * L]])
    g = np.zeros((4, 4))
    g[2, 3], g[3, 2] = IP, -IP
    dofs = tuple(Dof(1, c) for c in (2, 3, 5, 6))
    return TurningSystem(csc_array(m), csc_array(k), dofs, G=csc_array(g), parts=(ALONG_X,))


def whirl_speeds(W: float) -> Array:
    """Roots w of (12 k - m w^2)(4 k L^2 + Ip W w - Id w^2) = (6 k L)^2 (Genta 2005): forward w > 0,
    backward w < 0."""
    p = np.poly1d([-MASS, 0, 12 * K]) * np.poly1d([-ID, IP * W, 4 * K * L * L]) - (6 * K * L) ** 2
    roots: Array = np.sort(p.roots.real)
    return roots


def critical_speeds(tilt: float) -> Array:
    """Roots of the same with w = W (`tilt` = Id - Ip) or w = -W (`tilt` = Id + Ip)."""
    p = np.poly1d([-MASS, 0, 12 * K]) * np.poly1d([-tilt, 0, 4 * K * L * L]) - (6 * K * L) ** 2
    real = p.roots[np.abs(p.roots.imag) < 1e-6].real
    return np.sort(real[real > 0])


def test_stodolas_rotor_whirls_as_its_characteristic_equation_has_it() -> None:
    found = campbell(overhung(), np.linspace(0.0, 1500.0, 16), n_modes=4)
    for i, W in enumerate(found.speed):
        exact = whirl_speeds(W)
        for branch in range(4):
            w = found.poles[i, branch].imag * (-1.0 if found.whirl[i, branch] < -0.5 else 1.0)
            if W == 0:
                w = abs(w)
            assert np.abs(exact - w).min() < 1e-9 * w.__abs__(), (W, branch)
    # two branches go up, two go down, and none is lost
    assert np.isfinite(found.poles).all()
    np.testing.assert_allclose(np.sort(found.whirl[-1]), [-1, -1, 1, 1], atol=1e-9)
    assert found.follow.min() > 0.75
    assert found.residual.max() < 1e-8


def test_critical_speeds_of_stodolas_rotor() -> None:
    """A disc with Ip > Id has one forward critical speed, not two."""
    found = campbell(overhung(), np.linspace(0.0, 1500.0, 6), n_modes=4)
    forward = [c.speed for c in found.critical if c.whirl > 0.5]
    backward = [c.speed for c in found.critical if c.whirl < -0.5]
    np.testing.assert_allclose(forward, critical_speeds(ID - IP), rtol=1e-9)
    np.testing.assert_allclose(backward, critical_speeds(ID + IP), rtol=1e-9)
    assert {c.residual < 1e-8 for c in found.critical} == {True}
    twice = campbell(overhung(), np.linspace(0.0, 1500.0, 6), n_modes=4, orders=(1.0, 2.0))
    assert len(twice.critical) == 6
    assert all(c.freq == pytest.approx(c.order * c.speed / (2 * np.pi), rel=1e-8) for c in twice.critical)


def test_internal_damping_makes_a_jeffcott_rotor_unstable_above_its_limit() -> None:
    """Stable up to w_n (1 + c_e / c_i) (Genta 2005); whirl there is forward at w_n."""
    m, k, outer, inner = 2.0, 8e4, 20.0, 10.0
    turn = np.array([[0.0, 1.0], [-1.0, 0.0]])
    rotor = TurningSystem(
        csc_array(m * np.eye(2)),
        csc_array(k * np.eye(2)),
        (Dof(1, 2), Dof(1, 3)),
        C=csc_array((outer + inner) * np.eye(2)),
        N=csc_array(inner * turn),
        parts=(ALONG_X,),
    )
    found = campbell(rotor, np.linspace(0.0, 1200.0, 7), n_modes=2)
    (limit,) = found.limits
    assert limit.speed == pytest.approx(200 * (1 + outer / inner), rel=1e-6)
    assert limit.unstable_above
    assert limit.freq == pytest.approx(200 / (2 * np.pi), rel=1e-6)
    assert found.whirl[-1, limit.branch] == pytest.approx(1.0)
    assert complex_modes(rotor, n_modes=2, speed=700.0).unstable.sum() == 1
    assert complex_modes(rotor, n_modes=2, speed=500.0).unstable.sum() == 0


def test_unequal_bearings_whirl_backward_between_their_critical_speeds() -> None:
    """Planar modes at rest become elliptic; all four of 0 and 1 x speed are followed although both planes mix."""
    rotor = overhung()
    k = rotor.K.toarray()
    k[0, 0] *= 1.3
    soft = TurningSystem(rotor.M, csc_array(k), rotor.dofs, G=rotor.G, parts=rotor.parts)
    found = campbell(soft, np.linspace(0.0, 1000.0, 6), n_modes=4)
    assert np.isfinite(found.poles).all()
    np.testing.assert_allclose(found.whirl[0], 0.0, atol=1e-9)
    assert np.all(np.abs(found.whirl[-1]) > 0.3)
    # the poles of each speed by themselves are those of the branches
    for i in (1, -1):
        alone = complex_modes(soft, n_modes=4, speed=found.speed[i])
        np.testing.assert_allclose(np.sort(found.poles[i].imag), alone.poles.imag, rtol=1e-9)


DISCS = [
    "SOL 103", "CEND", "SPC = 1", "BEGIN BULK",
    "GRID,1,,0.,0.,0.", "GRID,2,,1.,0.,0.", "GRID,3,,2.,0.,0.",
    "CONM2,11,1,,1.0", "+,0.05,,0.03,,,0.03",
    "CONM2,12,2,,1.0", "+,0.05,,0.03,,,0.03",
    "CONM2,13,3,,1.0", "+,0.05,,0.03,,,0.03",
    *(f"CELAS2,{10 * n + c},{k},{n},{c}" for n, k in ((1, 400.0), (2, 500.0), (3, 650.0)) for c in (5, 6)),
    *(f"CDAMP2,{100 * n + c},{d},{n},{c}" for n, d in ((1, 0.002), (2, 0.002), (3, 0.002)) for c in (5, 6)),
    "SPC1,1,1234,1,2,3", "ENDDATA", "",
]  # fmt: skip


def test_parts_of_a_deck_turn_at_their_own_speeds(tmp_path: Path) -> None:
    """Three discs on springs, at 1, 2.5 and -1 times the shaft's speed: critical where n^2 Id - n r Ip = k / W^2."""
    (tmp_path / "discs.bdf").write_text("\n".join(DISCS))
    model = read_model(tmp_path / "discs.bdf")
    ratios = {11: 1.0, 12: 0.4, 13: -1.0}
    parts = [SpinningPart((1.0, 0.0, 0.0), (eid,), ratio=r) for eid, r in ratios.items()]
    found = campbell(model, np.linspace(0.0, 400.0, 9), n_modes=6, parts=parts)
    expected = []
    for (_, ratio), k in zip(ratios.items(), (400.0, 500.0, 650.0), strict=True):
        # forward is the sense of the part; one with a negative ratio is met by the shaft's order in its backward sense
        for sense in (1.0, -1.0):
            inertia = 0.03 - sense * abs(ratio) * 0.05
            if inertia > 0:
                expected.append((np.sqrt(k / inertia), sense))
    expected = sorted(e for e in expected if e[0] < 400.0)
    np.testing.assert_allclose([c.speed for c in found.critical], [e[0] for e in expected], rtol=1e-4)
    np.testing.assert_allclose([c.whirl for c in found.critical], [e[1] for e in expected], atol=1e-6)
    assert all(0 < c.zeta < 0.1 for c in found.critical)
    # each disc by itself: p^2 Id -+ i r W Ip p + c p + k = 0
    at = int(np.argmin(np.abs(found.speed - 300.0)))
    W = found.speed[at]
    exact = [
        r for (_, ratio), k in zip(ratios.items(), (400.0, 500.0, 650.0), strict=True)
        for sense in (1, -1) for r in np.roots([0.03, 0.002 - 1j * sense * ratio * W * 0.05, k])
        if r.imag > 0
    ]  # fmt: skip
    np.testing.assert_allclose(np.sort(found.poles[at].imag), np.sort(np.imag(exact)), rtol=1e-9)
    np.testing.assert_allclose(np.sort(found.poles[at].real), np.sort(np.real(exact)), rtol=1e-8)


def test_speeds_that_do_not_rise_are_refused() -> None:
    for speeds in ([1.0], [1.0, 1.0], [[1.0, 2.0]], [0.0, np.inf]):
        with pytest.raises(ValueError, match="two or more rising"):
            campbell(overhung(), speeds, n_modes=2)
    with pytest.raises(ValueError, match="belong to a model"):
        campbell(overhung(), [0.0, 1.0], n_modes=2, parts=[ALONG_X])
