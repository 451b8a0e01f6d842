"""The generator itself: reproducible, readable, and right against solutions that take another way."""

from __future__ import annotations

import dataclasses
import json
import os
import pathlib
import sys
from collections.abc import Iterator

import numpy as np
import pytest
import scipy.integrate as si

os.environ.setdefault("NUMBA_DISABLE_JIT", "1")  # short runs: compiling would take longer than interpreting
sys.path.insert(0, str(pathlib.Path(__file__).parent))

import one_record
import score_blind
from blindgen import (
    acquire,
    case,
    effects,
    excite,
    fe,
    laws,
    outside,
    plan,
    plates,
    respond,
    setting,
    solids,
    structures,
    truth,
    uff58,
    update,
)
from blindgen.integrate import Law, Modal, simulate
from blindgen.truth import quasi_static


@pytest.fixture(scope="module")
def short() -> Iterator[None]:
    """Recordings of a fifth of a second, so that a whole case is quick."""
    with pytest.MonkeyPatch.context() as patch:
        for name in setting.SECONDS:
            patch.setitem(setting.SECONDS, name, 0.2)
        yield


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory, short: None) -> tuple[pathlib.Path, dict]:
    """One small control case on disk."""
    folder = tmp_path_factory.mktemp("set") / "b0001"
    return folder, case.write_case(folder, 7, 0, "cantilever", "none:parameters")


def test_blocks_hold_every_effect_once() -> None:
    """A third controls by default, fourteen effects and two rare ones in every block; other shares and kinds."""
    labels = plan.block(3, 2)
    assert sum(q.startswith("none") for q in labels) == 8
    assert len(labels) == 24
    assert all(labels.count(q) == 1 for q in plan.EFFECTS)
    assert sum(q in plan.RARE for q in labels) == 2
    assert all(q.startswith("none") for q in plan.block(3, 2, controls=1.0))
    assert sum(q.startswith("outside:") for q in plan.block(1, 0, 0.2, "outside")) == 16
    for q in plan.block(1, 0, 0.0, "two"):
        for family in case.FAMILIES:
            a, b = plan.suited(q, family).removeprefix("two:").split("+")
            assert a != b
            assert not {a, b} & set(plan.LONE.get(family, ()))
    families = [plan.family(1, i, list(case.FAMILIES)) for i in range(10)]
    assert all(families.count(f) == 2 for f in case.FAMILIES)


def test_same_seed_same_bytes(written: tuple[pathlib.Path, dict], tmp_path: pathlib.Path) -> None:
    """Every file of a case is repeated bit by bit, and another number gives another case."""
    folder, _ = written
    again = tmp_path / "b0001"
    case.write_case(again, 7, 0, "cantilever", "none:parameters")
    files = sorted(p.relative_to(folder) for p in folder.rglob("*.*") if p.is_file())
    assert len(files) == 7 + 3
    assert all((folder / f).read_bytes() == (again / f).read_bytes() for f in files)
    other = tmp_path / "b0002"
    case.write_case(other, 7, 1, "cantilever", "none:parameters")
    assert (other / "public/high.uff").read_bytes() != (folder / "public/high.uff").read_bytes()


def test_files_are_readable_and_hide_the_answer(written: tuple[pathlib.Path, dict]) -> None:
    """pyuff reads what we wrote; predict recordings hold the force alone; noise is where it should be."""
    pyuff = pytest.importorskip("pyuff")
    folder, told = written
    sets = pyuff.UFF(str(folder / "public/high.uff")).read_sets()
    mine = uff58.read(folder / "public/high.uff")
    assert [(s["rsp_node"], s["rsp_dir"], s["ordinate_spec_data_type"]) for s in sets] == [
        (c.node, c.direction, c.kind) for c in mine
    ]
    assert all(
        np.array_equal(np.asarray(s["data"], np.float32), c.data.astype(np.float32))
        for s, c in zip(sets, mine, strict=True)
    )
    assert abs(1 / sets[0]["abscissa_inc"] / told["rate"] - 1) < 1e-5
    assert [c.kind for c in uff58.read(folder / "public/sweep.uff")] == [uff58.FORCE]
    assert len(uff58.read(folder / "sealed/sweep.uff")) == len(mine)
    assert not (folder / "public/truth.json").exists()
    assert 9.8 < mine[0].data.std() < 10.2
    deck = (folder / "public/model.bdf").read_text()
    assert deck.count("CBAR") == 18
    assert deck.count("CONM2") == 1
    assert "ENDDATA" in deck


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


REFERENCE = {  # states and force on the structure, written here a second time
    "cubic": (Law(laws.CUBIC, laws.pack(4e9)), 0, lambda d, v, z: (-4e9 * d**3, [])),
    "quadratic": (Law(laws.QUADRATIC, laws.pack(60.0, 0.0001)), 0, lambda d, v, z: (-60.0 * v * np.hypot(v, 1e-4), [])),
    "contact": (
        Law(laws.CONTACT, laws.pack(5e4, 2e-4, 1e9, 0.5)),
        0,
        lambda d, v, z: (-max(5e4 * (d - 2e-4) * (1 + 0.5 * v), 0.0) if d > 2e-4 else 0.0, []),
    ),
    "zener": (
        Law(laws.MAXWELL, laws.pack(3e3, 1, 2e4, 5e-3)),
        1,
        lambda d, v, z: (-3e3 * d - z[0], [2e4 * v - z[0] / 5e-3]),
    ),
    "absorber": (
        Law(laws.ABSORBER, laws.pack(0.1, 900.0, 1.0)),
        2,
        lambda d, v, z: (900.0 * (z[0] - d) + z[1] - v, [z[1], (900.0 * (d - z[0]) + v - z[1]) / 0.1]),
    ),
    "bouc_wen": (
        Law(laws.BOUC_WEN, laws.pack(3e4, 0.2, 2000.0, 1500.0, 1.0)),
        1,
        lambda d, v, z: (-6e3 * d - 2.4e4 * z[0], [v - 2000.0 * abs(v) * z[0] - 1500.0 * v * abs(z[0])]),
    ),
    "tanh_loop": (
        Law(laws.TANH_LOOP, laws.pack(3e4, 2e-4, 2e4, 1e-4)),
        1,
        lambda d, v, z: (-6.0 * np.tanh(d / 2e-4) - z[0], [2e4 * v - 1e4 * (abs(v) * z[0] + v * abs(z[0])) / 2.0]),
    ),
    "odd_damping": (
        Law(laws.ODD_DAMPING, laws.pack(40.0, 3e-4, 3.0, 1e-6)),
        0,
        lambda d, v, z: (-40.0 * (np.hypot(d, 1e-6) / 3e-4) ** 3 * v, []),
    ),
    "quintic": (Law(laws.QUINTIC, laws.pack(4e9, 1e16)), 0, lambda d, v, z: (4e9 * d**3 - 1e16 * d**5, [])),
    "power_damping": (
        Law(laws.POWER_DAMPING, laws.pack(60.0, 1e-4, 2e-4)),
        0,
        lambda d, v, z: (-60.0 * v * np.hypot(v, 1e-4) ** 0.5 * (1 + np.hypot(d, 2e-6) / 2e-4), []),
    ),
    "exponential": (
        Law(laws.EXPONENTIAL, laws.pack(2e4, 3e-4)),
        0,
        lambda d, v, z: (-6.0 * np.expm1(d / 3e-4), []),
    ),
    "wedge": (
        Law(laws.WEDGE, laws.pack(2e4, 2e-3, 3e-6)),
        0,
        lambda d, v, z: (-2e4 * np.hypot(d, 3e-6) * np.tanh(v / 2e-3), []),
    ),
}


@pytest.mark.parametrize("name", REFERENCE)
def test_law_against_adaptive_integration(name: str) -> None:
    """Two modes with each law: our stepping against LSODA at tight tolerance."""
    law, n_state, form = REFERENCE[name]
    w, zeta, shape, load = np.array([95.0, 260.0]), np.array([0.01, 0.02]), np.array([0.9, -1.1]), np.array([1.0, 0.6])
    m = Modal(w, zeta, load[None], np.array([[1.0, 0.5]]), shape[None], np.zeros((1, 1)))
    u = excite.sine(14.0, 0.3, 0.25)
    u.amplitude = 12.0
    _, trace = simulate(m, [law], [u], 512.0, 128, 16)

    def slope(t: float, x: np.ndarray) -> np.ndarray:
        ramp = 0.5 * (1 - np.cos(np.pi * min(t, excite.RAMP) / excite.RAMP))
        f, dz = form(shape @ x[:2], shape @ x[2:4], x[4:])
        drive = 2 * 12.0 * ramp * np.cos(2 * np.pi * 14.0 * t + 0.3)
        return np.concatenate([x[2:4], -(w**2) * x[:2] - 2 * zeta * w * x[2:4] + load * drive + shape * f, dz])

    t = np.arange(128) / 512.0
    ref = si.solve_ivp(slope, (0, t[-1]), np.zeros(4 + n_state), "LSODA", t, rtol=1e-9, atol=1e-12, max_step=5e-4).y
    d = shape @ ref[:2]
    assert np.linalg.norm(trace[0, 2]) > 0.1
    assert np.linalg.norm(trace[0, 0] - d) < 1e-3 * np.linalg.norm(d)


def test_friction_stays_below_its_limit_and_dissipates() -> None:
    """Jenkins: never above the slip force, work done on it positive, same answer with half the step."""
    m = Modal(
        np.array([95.0, 260.0]),
        np.array([0.01, 0.02]),
        np.ones((1, 2)),
        np.ones((1, 2)),
        np.array([[0.9, -1.1]]),
        np.zeros((1, 1)),
    )
    law, u = Law(laws.JENKINS, laws.pack(3e4, 4.0)), excite.sine(14.0, 0.3, 0.25)
    u.amplitude = 12.0
    _, coarse = simulate(m, [law], [u], 512.0, 128, 16)
    _, fine = simulate(m, [law], [u], 512.0, 128, 32)
    assert np.abs(coarse[0, 2]).max() == pytest.approx(4.0)
    assert np.trapezoid(-coarse[0, 2] * coarse[0, 1]) > 0
    assert np.linalg.norm(coarse[0, 0] - fine[0, 0]) < 2e-3 * np.linalg.norm(fine[0, 0])


def catalogue_forces(d: np.ndarray, v: np.ndarray, a: np.ndarray, dt: float) -> Iterator[np.ndarray]:
    """Columns (samples, k), linear in k parameters, of every law the package knows, on a grid of their shapes, each
    beside a spring and a dashpot. Written from the catalogue's formulas, not from its code.
    """
    base = [d, v]
    s, sv = d.std(), v.std()
    free = [[a], [v * abs(v)], [v**3], [d**3], [d**2], [d**2 * v], [np.maximum(d, 0), np.minimum(d, 0)]]
    free += [[d / (1 + abs(d) / q)] for q in s * np.geomspace(0.05, 5, 25)]
    for g in s * np.linspace(0, 3, 25):
        above, below = np.maximum(d - g, 0), np.minimum(d + g, 0)
        free += [[above], [below], [above + below], [above**1.5], [below * abs(below) ** 0.5]]
        free += [[np.maximum(d + g, 0)], [np.minimum(d - g, 0)]]
    for tau in np.geomspace(0.1, 10, 15) * s / sv:
        z, out = 0.0, np.zeros_like(d)
        for i in range(1, len(d)):
            z = (z + d[i] - d[i - 1]) * np.exp(-dt / tau)
            out[i] = z
        free.append([out])
    for g in s * np.geomspace(0.02, 3, 15):
        z, loop = 0.0, np.zeros_like(d)
        y = {n: np.zeros_like(d) for n in (1.0, 1.5, 2.0)}
        for i in range(1, len(d)):
            z = min(max(z + d[i] - d[i - 1], -g), g)
            loop[i] = z
            for n, q in y.items():
                r, step = q[i - 1], d[i] - d[i - 1]
                r += step - 0.5 * (abs(step) * r * abs(r / g) ** (n - 1) / g + step * abs(r / g) ** n)
                q[i] = min(max(r, -g), g)
        free += [[loop], *([q] for q in y.values())]
    for columns in free:
        yield np.column_stack(base + columns)


@pytest.mark.parametrize("name", outside.OUTSIDE)
def test_outside_laws_are_not_in_the_catalogue(name: str) -> None:
    """Whatever law of the catalogue is fitted to a prescribed motion leaves 4 % of the nonlinear force or more."""
    rng, dt, n = np.random.default_rng(4), 5e-4, 6000
    spectrum = np.zeros(n // 2 + 1, complex)
    spectrum[15:120] = np.exp(2j * np.pi * rng.random(105)) / np.arange(15, 120)
    omega = 2j * np.pi * np.arange(n // 2 + 1) / (n * dt)
    d, v, a = (np.fft.irfft(spectrum * omega**q) for q in range(3))
    scale = 1e-3 / d.std()
    d, v, a = d * scale, v * scale, a * scale
    code, _, par = outside.OUTSIDE[name].shape(rng, effects.Place([1], 3, d.std(), v.std(), 1e4))
    p, z, f = laws.pack(*par(1.0)), np.zeros(laws.N_STATE), np.zeros(n)
    for i in range(n):
        g = np.zeros(laws.N_STATE)
        laws.rate(code, p, d[i], v[i], z, g)
        z += dt * g
        f[i] = laws.force(code, p, d[i], v[i], z, 0.0)[0]
    straight = np.column_stack([d, v])
    beyond = np.linalg.norm(f - straight @ np.linalg.lstsq(straight, f, rcond=None)[0])
    left = min(np.linalg.norm(f - A @ np.linalg.lstsq(A, f, rcond=None)[0]) for A in catalogue_forces(d, v, a, dt))
    assert beyond > 0.1 * np.linalg.norm(f)
    assert left > 0.04 * beyond, left / beyond


def test_recorder_folds_nothing_back() -> None:
    """Sines in the band come out as they are, without delay; above half the rate nothing is left of them."""
    n = 400
    t = np.arange(acquire.FINER * (n + acquire.AFTER)) / acquire.FINER
    inside = slice(2 * acquire.AFTER, n - acquire.AFTER)
    for f in (0.02, 0.2, 0.41):
        out = acquire.sampled(np.sin(2 * np.pi * f * t), n)
        assert np.abs(out - np.sin(2 * np.pi * f * np.arange(n)))[inside].max() < 3e-4
    for f in (0.53, 0.8, 1.1, 1.9):
        assert np.abs(acquire.sampled(np.sin(2 * np.pi * f * t), n))[inside].max() < 3e-4


def test_two_effects_add_up_where_they_are_linear(short: None) -> None:
    """A spring and a mass together: the truth with both is the truth with one whose deck already has the other."""
    rng = np.random.default_rng(3)
    test = setting.draw_test(rng, "cantilever", "", 0.02)
    x = 2e3
    spring = effects.Effect("s", [4], "Z", "ground", (1, 1), dict, law=lambda k: Law(laws.SPRING, laws.pack(k)))
    mass = effects.Effect("m", [6], "", "", (1, 1), dict, change=lambda m: truth.Change(mass={6: m}))
    both, _ = respond.record(test, ((spring, x), (mass, 0.1)), "high")
    built = truth.build(test.s, test.real, truth.Change(mass={6: 0.1}))
    changed = dataclasses.replace(test, plain=built)
    second, _ = respond.record(changed, ((spring, x),), "high")
    one, _ = respond.record(test, ((spring, x),), "high")
    assert np.linalg.norm(both - second) < 1e-6 * np.linalg.norm(both)
    assert np.linalg.norm(both - one) > 1e-2 * np.linalg.norm(both)


def test_update_absorbs_what_it_may_and_nothing_else(short: None) -> None:
    """Derivatives against differences; moduli 6 % off are fitted away, what no unknown makes stays."""
    rng = np.random.default_rng(3)
    test = setting.draw_test(rng, "cantilever", "", 0.02)
    base, _ = respond.record(test, (), "high")
    fit = update.Update(test, base)
    theta = 0.02 * rng.standard_normal(len(fit.sd))
    J, h = fit.derivatives(theta, fit.response(theta)[1]), 1e-5
    for i in range(0, len(theta), 4):
        up, down = (fit.response(theta + s * h * np.eye(len(theta))[i])[0] for s in (1, -1))
        assert np.linalg.norm(J[:, i] - (up - down) / (2 * h)) < 0.03 * np.linalg.norm(J[:, i])
    real = dataclasses.replace(test.real, factor={p: 1.06 * f for p, f in test.real.factor.items()})
    stiffer = dataclasses.replace(test, real=real, plain=truth.build(test.s, real))
    e = respond.record(stiffer, (), "high")[0] - base
    seen = np.linalg.norm(e) / np.linalg.norm(base)
    assert fit.left(e) < 0.2 * seen
    other = rng.standard_normal(base.shape) * base.std()
    assert fit.left(other) > 0.9 * np.linalg.norm(other) / np.linalg.norm(base)


def test_scoring(written: tuple[pathlib.Path, dict], tmp_path: pathlib.Path) -> None:
    """A silent answer to a control is right, a finding is a false positive; the Wilson bound of 0 of 42 is 8 %."""
    folder, _ = written
    (tmp_path / "result.json").write_text(json.dumps({"verdict": "parameters-only", "findings": []}))
    assert score_blind.score(tmp_path, folder)["named"]
    found = {"physics": "added_mass", "probability": 0.9, "location": {"nodes": [3]}}
    (tmp_path / "result.json").write_text(json.dumps({"verdict": "missing-physics", "findings": [found]}))
    row = score_blind.score(tmp_path, folder)
    assert not row["named"]
    assert row["said"] == "added_mass"
    assert score_blind.nrmse(folder / "sealed/random.uff", folder / "sealed/random.uff") == 0.0
    assert score_blind.nrmse(folder / "public/random.uff", folder / "sealed/random.uff") == 1.0
    assert score_blind.wilson(0, 42)[1] == pytest.approx(0.0838, abs=1e-3)
    place = {"nodes": [3], "node_xyz": {"1": [0, 0, 0], "3": [0.1, 0, 0], "4": [0.105, 0, 0], "9": [1, 0, 0]}}
    assert score_blind.near([4], place)
    assert not score_blind.near([9], place)
    assert not score_blind.near([1, 3, 4], place)


def test_scoring_of_outside_two_and_intervals(tmp_path: pathlib.Path) -> None:
    """Located but not named is right for a law outside; two findings are matched to two effects; intervals counted."""
    xyz = {"1": [0, 0, 0], "3": [0.5, 0, 0], "9": [1, 0, 0]}
    common = {"node_xyz": xyz, "family": "plate", "visibility_beyond_update": 3.0, "noise": 0.02}
    found = {"physics": "", "probability": 0.0, "location": {"nodes": [3]}}

    def judged(truth: dict, verdict: str, *findings: dict, **more: dict) -> dict:
        (tmp_path / "c/sealed").mkdir(parents=True, exist_ok=True)
        (tmp_path / "c/sealed/truth.json").write_text(json.dumps(common | truth))
        (tmp_path / "result.json").write_text(json.dumps({"verdict": verdict, "findings": findings, **more}))
        return score_blind.score(tmp_path, tmp_path / "c")

    outside = {"effect": "outside", "law": "wedge", "families": ["hysteretic", "damping"], "nodes": [3]}
    assert judged(outside, "located-not-named", found)["class_right"]
    assert judged(outside, "missing-physics", found | {"physics": "bouc_wen"})["class_right"]
    assert judged(outside, "missing-physics", found | {"physics": "added_mass"})["wrong"]
    assert not judged(outside, "parameters-only")["class_right"]
    two = {"effect": "two", "nodes": [3, 9]}
    two["effects"] = [{"effect": "added_mass", "nodes": [9]}, {"effect": "clearance", "nodes": [3]}]
    a = found | {"physics": "clearance"}
    b = {"physics": "added_mass", "probability": 0.9, "location": {"nodes": [9]}}
    row = judged(two, "missing-physics", a, b)
    assert row["located"]
    assert row["named"]
    row = judged(two, "missing-physics", a | {"physics": "cubic_stiffness"}, b)
    assert row["located"]
    assert not row["named"]
    assert row["one_named"]
    assert row["wrong"]
    one = {"effect": "clearance", "nodes": [3], "parameters": {"k": 100.0, "gap": 1.0}, "E_factor": {"a": 1.1}}
    told = {"k": {"value": 110.0, "sd": 5.0}, "gap": {"value": 1.01, "sd": 0.02}, "sides": {"value": 1, "sd": None}}
    row = judged(one, "missing-physics", a | {"parameters": told}, parameters={"E_a": {"factor": 1.09, "sd": 0.01}})
    assert row["covered_law"] == [False, True]
    assert row["covered_model"] == [True]


def test_one_recording_is_left_to_fit() -> None:
    block = '[[recording]]\nname = "{}"\nrole = "{}"\n\n'
    head = 'title = "c"\n\n'
    study = head + "".join(block.format(*r) for r in (("low", "fit"), ("high", "fit"), ("sweep", "predict")))
    left = head + block.format("high", "fit") + block.format("sweep", "predict")
    assert one_record.kept_alone(study, "high") == left
    with pytest.raises(ValueError, match="no recording 'sweep' with role"):
        one_record.kept_alone(study, "sweep")


def test_a_residual_vector_far_above_the_modes_keeps_its_flexibility() -> None:
    """Above the highest frequency phi phi^T / omega^2 stays, so that nothing rings and nothing stiffens."""
    w = np.array([10.0, 200.0, 5e4])
    phi = np.array([[1.0, -0.5, 30.0], [0.2, 0.9, -20.0]])
    got_w, got = quasi_static(w, phi, 400.0)
    assert got_w.max() == 400.0
    np.testing.assert_allclose((got / got_w**2) @ got.T, (phi / w**2) @ phi.T, rtol=1e-12)
    np.testing.assert_array_equal(got[:, :2], phi[:, :2])
