"""The generated structures against closed forms, and against each other."""

from __future__ import annotations

import dataclasses
import types
from collections.abc import Callable

import numpy as np
import pytest
from blindgen import effects, excite, fe, laws, plates, solids, structures, truth
from blindgen.integrate import Law, Modal, simulate
from blindgen.truth import quasi_static


def plain_beam(sub: int, form: str = "timoshenko") -> tuple[structures.Structure, truth.Built]:
    """A uniform cantilever without lump."""
    s = structures.cantilever(np.random.default_rng(0))
    s.lumps, s.sections[2] = {}, s.sections[1]
    real = truth.nominal(s)
    real.n_sub, real.form = sub, form
    return s, truth.build(s, real)


@pytest.mark.parametrize(("form", "tol"), [("bernoulli", 1e-6), ("lumped", 2e-3), ("timoshenko", 2e-3)])
def test_cantilever_frequency(form: str, tol: float) -> None:
    """First bending mode of a slender cantilever: omega = 1.875104^2 sqrt(EI / rho A L^4), bending across the
    orientation plane held.
    """
    s, built = plain_beam(4, form)
    w, _ = fe.modes(built.system, 2000.0)
    q = s.sections[1]
    assert abs(w[0] / (1.8751040687**2 * np.sqrt(s.E * q.I1 / (2700.0 * q.A * s.span**4))) - 1) < tol


def test_plate_frequencies_and_deck() -> None:
    """A square plate on four corners: 7.11 sqrt(D / rho h) / a^2 (Leissa, NASA SP-160); a strip as a beam."""
    s = plates.plate(np.random.default_rng(0))
    s.lumps, s.sides = {}, (0.4, 0.4)
    w, _ = fe.modes(truth.build(s, truth.nominal(s)).system, 500.0)
    unit = np.sqrt(s.rigidity() / (2700.0 * s.thickness)) / 0.4**2
    assert w[0] / unit == pytest.approx(7.11, rel=0.015)
    assert s.bulk().count("CQUAD4") == 16 * 12
    long = plates.Plate(
        "strip",
        [],
        {},
        [],
        {1: "a", 2: "b"},
        {},
        {},
        [1, 17],
        "126",
        [3],
        1,
        pinned="3",
        cells=(16, 1),
        sides=(1.0, 0.02),
    )
    long.clamped, long.pinned = [1, 18], "35"
    ends = truth.build(long, truth.nominal(long))
    w, _ = fe.modes(ends.system, 500.0)
    beam = 1.8751040687**2 * np.sqrt(long.E * long.thickness**2 / 12 / 2700.0)
    assert w[0] == pytest.approx(beam, rel=0.02)  # clamped at x = 0, free elsewhere: between beam and plate rigidity


def test_twin_plates_are_two_plates_on_springs() -> None:
    """Without springs every mode of the plate is there twice; a stiff spring holds its ends together."""
    s = plates.twin_plates(np.random.default_rng(4))
    assert all(n + plates.LAYER in s.xyz for n in s.ties)
    assert {s.xyz[n + plates.LAYER][2] - s.xyz[n][2] for n in s.ties} == {s.xyz[1001][2]}
    s.lumps = {}
    ties, s.ties = s.ties, {}
    w, _ = fe.modes(truth.build(s, truth.nominal(s)).system, 300.0)
    np.testing.assert_allclose(w[::2][:3], w[1::2][:3], rtol=1e-9)
    s.ties = dict.fromkeys(ties, 1e9)
    built = truth.build(s, truth.nominal(s))
    _, phi = fe.modes(built.system, 300.0)
    for n in ties:
        apart = phi[built.system.dof[n + plates.LAYER, 3]] - phi[built.system.dof[n, 3]]
        assert np.abs(apart).max() < 1e-4 * np.abs(phi).max()
    assert s.bulk().count("CELAS2") == 2
    assert s.bulk().count("CQUAD4") == 2 * 16 * 12


def test_a_patch_over_half_a_plate_is_the_modulus_of_that_half() -> None:
    """And a smaller one leaves every other cell as it is."""
    s = plates.plate(np.random.default_rng(4))
    real = truth.nominal(s)
    whole = truth.build(s, real, truth.Change(patch=(0, 8, 0, 12, 0.5))).system.K
    halved = truth.build(s, dataclasses.replace(real, factor={1: 0.5, 2: 1.0})).system.K
    assert abs(whole - halved).max() < 1e-9 * abs(halved).max()
    plain, weak = (truth.build(s, real, c).system for c in (None, truth.Change(patch=(2, 4, 3, 5, 0.5))))
    changed = np.unique((plain.K - weak.K).tocoo().row)
    inside = {weak.dof[s.node(i, j), 3] for i in (2, 3, 4) for j in (3, 4, 5)}
    deck = {weak.dof[n, 3] for n in s.xyz} - {-1}
    assert deck.intersection(changed.tolist()) == inside


def test_solid_frequencies_and_deck() -> None:
    """First bending frequencies of the clamped bar about both axes (Bernoulli, shear and end effects below 2 %), and
    brick matrices: six rigid motions without force, the whole mass.
    """
    s = solids.solid(np.random.default_rng(0))
    s.lumps = {}
    built = truth.build(s, dataclasses.replace(truth.nominal(s), n_sub=2))
    assert not [place for place, _ in built.names if isinstance(place, tuple) and place[1] == 0]  # all held
    w, _ = fe.modes(built.system, 500.0)
    slender = [1.8751040687**2 * np.sqrt(s.E * d**2 / 12 / 2700.0) / s.sides[0] ** 2 for d in sorted(s.sides[1:])]
    assert w[0] == pytest.approx(slender[0], rel=0.02)
    assert np.abs(w / slender[1] - 1).min() < 0.02
    assert s.bulk().count("CHEXA") == np.prod(s.cells)
    K, M = solids.brick(0.03, 0.01, 0.02, 7e10, 2700.0)
    x = solids.POINTS * np.array([0.015, 0.005, 0.01])
    rigid = [np.tile(e, 20) for e in np.eye(3)] + [np.cross(e, x).ravel() for e in np.eye(3)]
    assert max(np.abs(K @ r).max() for r in rigid) < 1e-9 * np.abs(K).max()
    assert rigid[0] @ M @ rigid[0] == pytest.approx(2700.0 * 6e-6)


def test_linear_case_equals_direct_solution_in_full_coordinates() -> None:
    """A pulse through modes, residuals and time steps against K + i omega C - omega^2 M solved line by line at all
    equations.
    """
    _s, built = plain_beam(1)
    n, rate, period = built.system.K.shape[0], 512.0, 2.0
    K, M = built.system.K.toarray(), built.system.M.toarray()
    w, phi = fe.sla.eigh(K, M)
    w = np.sqrt(w)
    damping = truth.Damping({q: i for i, q in enumerate(built.names)}, phi, np.full(n, 0.08), 0.08)
    load, law = built.system.vector((4, 3, 1.0)), built.system.vector((6, 3, 1.0))
    k, c = 2000.0, 0.7
    f = np.arange(400)
    pulse = np.exp(-(((f / 2.0 - 60.0) / 35.0) ** 2) - 2j * np.pi * f * 0.3 / period) * (f > 0)
    m = truth.modal(built, damping, 3 * rate, load[:, None], np.eye(n)[:, [built.system.dof[7, 3]]], law[:, None])
    m = Modal(m.omega, m.zeta, m.load, m.sensor, np.vstack([m.law, m.law]), m.carried)
    both = [Law(laws.SPRING, laws.pack(k)), Law(laws.DASHPOT, laws.pack(c))]
    acc, trace = simulate(m, both, [excite.Force(period, pulse)], rate, int(rate * period), 8)
    C = M @ phi @ np.diag(2 * 0.08 * w) @ phi.T @ M + c * np.outer(law, law)
    Y = np.zeros(int(rate * period) // 2 + 1, complex)
    for i in f[1:]:
        o = 2 * np.pi * i / period
        x = np.linalg.solve(K + k * np.outer(law, law) + 1j * o * C - o * o * M, load * pulse[i])
        Y[i] = -o * o * x[built.system.dof[7, 3]]
    y = np.fft.irfft(Y) * int(rate * period)
    assert np.linalg.norm(acc[0] - y) < 1e-3 * np.linalg.norm(y)
    assert np.abs(trace[0, 0]).max() > 0


def test_a_residual_vector_far_above_the_modes_keeps_its_flexibility() -> None:
    """Above the highest frequency phi phi^T / omega^2 stays, so that nothing rings and nothing stiffens."""
    w = np.array([10.0, 200.0, 5e4])
    phi = np.array([[1.0, -0.5, 30.0], [0.2, 0.9, -20.0]])
    got_w, got = quasi_static(w, phi, 400.0)
    assert got_w.max() == 400.0
    np.testing.assert_allclose((got / got_w**2) @ got.T, (phi / w**2) @ phi.T, rtol=1e-12)
    np.testing.assert_array_equal(got[:, :2], phi[:, :2])


@pytest.mark.parametrize("draw", [structures.cantilever, structures.plane_frame, structures.space_frame])
def test_a_flexible_end_is_at_a_joint_or_a_clamp(draw: Callable[[np.random.Generator], structures.Structure]) -> None:
    """A hinge at a free end holds nothing and would be no effect."""
    flexible = 0
    for seed in range(20):
        rng = np.random.default_rng(seed)
        s = draw(rng)
        scene = types.SimpleNamespace(s=s, rng=rng)
        change = effects.joint_stiffness(scene).change(1.0)  # type: ignore[arg-type,misc]
        if change.hinge is None:
            continue
        flexible += 1
        member, end, _ = change.hinge
        node = (s.members[member].i, s.members[member].j)[end]
        others = [m for k, m in enumerate(s.members) if k != member and node in (m.i, m.j)]
        assert others or node in s.clamped
    assert flexible >= 5
