"""Blocks of residuals and terms against what can be computed by hand or by differences."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from femend import Dof
from femend.data import Speed
from femend.estimate.joint import (
    DELAY,
    FrfBlock,
    ModesBlock,
    RunBlock,
    Unbalance,
    line_forces,
    maximise,
    ods_frf,
    receptance,
    run_of,
    simulate_run,
    unbalance_unknowns,
)
from femend.model import Parameter
from femend.model.model import model_of, read_model
from femend.model.terms.bushes import bush_groups
from femend.model.terms.configured import ALPHA, BETA, ConfiguredModel, configure, free_model
from femend.model.terms.linear_terms import compliant_support, point_mass, spring_bending
from femend.model.terms.supports import held_rows, support_regions
from femend.model.terms.unknowns import Unknown, Unknowns

sys.path.insert(0, str(Path(__file__).parents[1]))
from rigs import Rig, deck

Array = NDArray[np.float64]
PARAMETERS = [Parameter("kz", "k3", "property_id", (11,), 0.2), Parameter("kx", "k1", "property_id", (11,), 0.2)]
BEARINGS = (511, 512)


@pytest.fixture(scope="module")
def rig(tmp_path_factory: pytest.TempPathFactory) -> ConfiguredModel:
    """A rig on a layer, with springs that bend and an unbalance among its unknowns."""
    path = tmp_path_factory.mktemp("rig") / "model.bdf"
    path.write_text(deck(Rig()))
    nominal = read_model(path)
    free = free_model(nominal.deck, units="SI", parameters=PARAMETERS)
    (region,) = support_regions(free, held_rows(free, model_of(nominal.deck, spc=1)))
    (group,) = bush_groups(free)
    terms = [spring_bending(free, group), compliant_support(free, region, 60.0, 0.02)]
    unknowns = Unknowns.of(
        [
            *(Unknown(p.name, 1.0, sd=p.prior_sd) for p in PARAMETERS),
            Unknown(ALPHA, 0.5),
            Unknown(BETA, 1e-4),
            *(u for t in terms for u in t.unknowns),
            *unbalance_unknowns(Unbalance(BEARINGS, 0), 1e-3, 1 / 256),
        ]
    )
    rows = [free.row(Dof(n, c)) for n in (*BEARINGS, 505) for c in (1, 2, 3)]
    return configure("operation", free, unknowns, terms, spc=1, f_max=30.0, g_rows=rows)


def place(model: ConfiguredModel, seed: int = 3) -> Array:
    p = 0.1 * np.random.default_rng(seed).standard_normal(len(model.unknowns))
    return np.asarray(p)


def rows(model: ConfiguredModel, nodes: tuple[int, ...]) -> Array:
    return model.rows([model.model.row(Dof(n, c)) for n in nodes for c in (1, 2, 3)])


def differences(block: FrfBlock | ModesBlock | RunBlock, p: Array, step: float = 1e-5) -> Array:
    """Half the gradient of the squares by central differences."""
    found = []
    for i in range(len(p)):
        d = np.zeros(len(p))
        d[i] = step
        found.append(block.gauss_newton(p + d, False)[0] - block.gauss_newton(p - d, False)[0])
    return np.array(found) / (4 * step)


def test_matrices_have_exact_derivatives(rig: ConfiguredModel) -> None:
    p, step = place(rig), 1e-6
    index, *exact = rig.derivatives(p)
    for k, i in enumerate(index):
        d = np.zeros(len(p))
        d[i] = step
        for A, B, dA in zip(rig.matrices(p + d), rig.matrices(p - d), exact, strict=True):
            scale = max(float(np.abs(dA[k]).max()), 1e-9 * float(np.abs(A).max()))
            assert np.abs((A - B) / (2 * step) - dA[k]).max() < 1e-4 * scale


def test_frf_residuals_have_exact_gradients(rig: ConfiguredModel) -> None:
    out, into = rows(rig, (505,)), rows(rig, BEARINGS)
    freq = np.linspace(3.0, 25.0, 40)
    p = place(rig)
    H = receptance(rig, 0 * p, 2j * np.pi * freq).between(out, into)
    block = FrfBlock("frf", rig, freq, H, np.full(H.shape, 0.05), out, into)
    gradient = block.gauss_newton(p, True)[1]
    assert np.allclose(gradient, differences(block, p), rtol=1e-5, atol=1e-6 * np.abs(gradient).max())


def test_mode_residuals_have_exact_gradients(rig: ConfiguredModel) -> None:
    """Complex modes: the layer's dashpots couple them."""
    seen = rows(rig, (501, 502, 505, 507, 1, 30))
    lam, psi = rig.damped_modes(np.zeros(len(rig.unknowns)))
    m, shape = 8, (len(seen), 8)
    sd = np.full(m, 0.01)
    block = ModesBlock("modes", rig, lam[:m], seen @ psi[:, :m], sd, 10 * sd, np.full(shape, 0.02), seen)
    p = 0.2 * place(rig)
    gradient = block.gauss_newton(p, True)[1]
    assert np.allclose(gradient, differences(block, p), rtol=1e-4, atol=1e-6 * np.abs(gradient).max())


def test_a_mode_that_is_none_cannot_decide(rig: ConfiguredModel) -> None:
    seen = rows(rig, (501, 502, 505, 507, 1, 30))
    lam, psi = rig.damped_modes(np.zeros(len(rig.unknowns)))
    shapes = seen @ psi[:, :6]
    shapes[:, 5] = np.random.default_rng(0).standard_normal(len(seen))
    sd = np.full(6, 0.002)
    block = ModesBlock("modes", rig, lam[:6], shapes, sd, 10 * sd, np.full(shapes.shape, 0.02), seen)
    found = maximise(rig.unknowns, [block], 0.05 * np.ones(len(rig.unknowns)))
    freq = np.abs(block.pairs(found.p)[0][:5])
    assert np.allclose(freq, np.abs(lam[:5]), rtol=2e-3)


def test_a_pole_that_came_twice_is_like_its_mode_twice(rig: ConfiguredModel) -> None:
    """Pairs are one to one; what is most like an identified mode may be so for two."""
    seen = rows(rig, (501, 502, 505, 507, 1, 30))
    p = np.zeros(len(rig.unknowns))
    lam, psi = rig.damped_modes(p)
    twice = [0, 1, 2, 2]
    sd = np.full(4, 0.01)
    shapes = seen @ psi[:, twice]
    block = ModesBlock("modes", rig, lam[twice] * [1, 1, 1, 1.004], shapes, sd, sd, np.full(shapes.shape, 0.02), seen)
    freq, mac = block.nearest(p)
    assert freq == pytest.approx(np.abs(lam[twice]) / (2 * np.pi))
    assert mac == pytest.approx(1.0)
    assert len(set(np.round(np.abs(block.pairs(p)[0]), 6))) == 4


def short_run(n: int = 1200, dt: float = 1 / 64) -> tuple[Speed, int, float]:
    t = np.linspace(0.0, n * dt, 2000)
    return Speed(t, 4.0 + 0.9 * t, 2 * np.pi * (4.0 * t + 0.45 * t**2)), n, dt


def test_run_residuals_have_exact_gradients(rig: ConfiguredModel) -> None:
    speed, n, dt = short_run()
    run, unbalance = run_of(speed, n, dt), Unbalance(BEARINGS, 0)
    out = rows(rig, (505, 1))
    bearings = np.array([rows(rig, (b,)) for b in BEARINGS])
    p = place(rig)
    y = simulate_run(rig, 0 * p + 0.05, run, unbalance, out, bearings)
    block = RunBlock("run", rig, run, y, np.full(y.shape, 0.1), out, bearings, unbalance, 31.0)
    gradient = block.gauss_newton(p, True)[1]
    assert np.allclose(gradient, differences(block, p), rtol=1e-4, atol=1e-6 * np.abs(gradient).max())


def test_a_run_is_simulated_in_displacements_and_velocities_too(rig: ConfiguredModel) -> None:
    speed, n, dt = short_run()
    run, unbalance = run_of(speed, n, dt), Unbalance(BEARINGS, 0)
    bearings = np.array([rows(rig, (b,)) for b in BEARINGS])
    at = rig, 0 * place(rig) + 0.05, run, unbalance, rows(rig, (505, 1)), bearings
    moved, window, s = simulate_run(*at, 0), np.hanning(n), 2j * np.pi * np.fft.rfftfreq(n, dt)
    for order in (1, 2):
        wanted = np.fft.irfft(s**order * np.fft.rfft(moved * window, axis=1), n, axis=1)
        found = simulate_run(*at, order) * window
        # but for what the window changes by, over a record of some 200 periods
        assert np.linalg.norm(found - wanted) < 0.02 * np.linalg.norm(wanted)
    np.testing.assert_array_equal(simulate_run(*at), simulate_run(*at, 2))


@pytest.mark.parametrize("sense", [1, -1])
def test_line_forces_find_unbalance_sense_and_exponent(rig: ConfiguredModel, sense: int) -> None:
    """Forces that were put in come out of the shapes, although the sweep is too fast for resonances to build up."""
    speed, n, dt = short_run(2400)
    run, unbalance = run_of(speed, n, dt), Unbalance(BEARINGS, 0, sense)
    out = rows(rig, (501, 503, 505, 507, 1, 30))
    bearings = np.array([rows(rig, (b,)) for b in BEARINGS])
    p = np.zeros(len(rig.unknowns))
    U, phase = np.array([2e-3, 1e-3]), np.array([0.4, -1.9])
    parts = np.stack([U * np.cos(phase), U * np.sin(phase)], axis=1).ravel()
    for name, value in zip(unbalance.names, parts, strict=True):
        p[rig.unknowns.index(name)] = value / 1e-3
    p[rig.unknowns.index(DELAY)] = 0.0
    y = simulate_run(rig, p, run, unbalance, out, bearings)
    shapes = ods_frf(run, y, np.arange(6.0, 25.0, 0.5), 0.2)
    found = line_forces(rig, p, shapes, Unbalance(BEARINGS, 0), out, bearings, (5.0, 26.0))
    assert found.sense() == sense
    exponent, _ = found.exponent(sense, (6.0, 24.0))
    assert exponent == pytest.approx(2.0, abs=0.05)
    middle = np.median(found.unbalances(sense), axis=0)
    assert np.abs(middle) == pytest.approx(U, rel=0.03)
    assert np.angle(middle) == pytest.approx(phase, abs=0.03)


def test_a_soft_winkler_layer_carries_the_rig_as_a_rigid_body(tmp_path: Path) -> None:
    """omega^2 = k A / m for heave, once the layer is far softer than plate and springs."""
    path = tmp_path / "model.bdf"
    path.write_text(deck(Rig()))
    free = free_model(read_model(path).deck, units="SI", parameters=[])
    (region,) = support_regions(free, held_rows(free, model_of(free.deck, spc=1)))
    term = compliant_support(free, region, 2 * np.pi * 0.2, 0.01)
    unknowns = Unknowns.of([Unknown(ALPHA, 1e-9), Unknown(BETA, 1e-12), *term.unknowns])
    model = configure("operation", free, unknowns, [term], spc=1, f_max=10.0, g_rows=[])
    k = unknowns.values(np.zeros(len(unknowns)))[unknowns.names.index(term.unknowns[4].name)]
    expected = np.sqrt(k * region.area / free.fe.total_mass())
    assert region.area == pytest.approx(0.2)
    omega, phi = model.modes(np.zeros(len(unknowns)))
    heave = int(np.argmax(np.abs(rows(model, (500,))[2] @ phi[:, :6])))
    assert omega[heave] == pytest.approx(expected, rel=2e-3)


def test_spring_bending_is_what_a_bush_with_rotational_stiffness_has(tmp_path: Path) -> None:
    text = deck(Rig())
    (tmp_path / "plain.bdf").write_text(text)
    (tmp_path / "full.bdf").write_text(text.replace("0.,0.,0.\nCBUSH", "9.,11.,8.\nCBUSH"))
    full = read_model(tmp_path / "full.bdf")
    free = free_model(read_model(tmp_path / "plain.bdf").deck, units="SI", parameters=[])
    assert bush_groups(full) == ()
    (group,) = bush_groups(free)
    term = spring_bending(free, group)
    unknowns = Unknowns.of([Unknown(ALPHA, 1e-9), Unknown(BETA, 1e-12), *term.unknowns])
    model = configure("clamped", free, unknowns, [term], spc=1, f_max=30.0, g_rows=[])
    p = np.array([0.0, 0.0, *(np.log(v / u.scale) for v, u in zip((9.0, 11.0, 8.0), term.unknowns)), 0.0])
    K, M = (A.toarray() for A in full.matrices())
    expected = np.sqrt(np.linalg.eigvals(np.linalg.solve(M, K)).real)
    assert np.sort(model.modes(p)[0])[:6] == pytest.approx(np.sort(expected)[:6], rel=1e-6)


def test_a_point_mass_lowers_the_kinetic_frequency(tmp_path: Path) -> None:
    path = tmp_path / "model.bdf"
    path.write_text(deck(Rig()))
    free = free_model(read_model(path).deck, units="SI", parameters=[])
    term = point_mass(free, 500, 5.0)
    unknowns = Unknowns.of([Unknown(ALPHA, 1e-9), Unknown(BETA, 1e-12), *term.unknowns])
    model = configure("clamped", free, unknowns, [term], spc=1, f_max=30.0, g_rows=[])
    heave = np.sqrt(4 * 30000.0 / 25.0)
    assert np.abs(model.modes(np.zeros(3))[0] - heave).min() < 1e-3 * heave


def test_evidence_of_a_linear_problem_is_exact(rig: ConfiguredModel) -> None:
    """One unknown, one datum y = p + noise: ln Z follows from N(0, sd^2 + prior^2), up to the noise's own constant."""

    class Datum:
        name, n_values, y, sd = "datum", 1.0, 1.7, 0.3

        def gauss_newton(self, p: Array, derivatives: bool) -> tuple[float, Array, Array]:
            r = (p[0] - self.y) / self.sd
            return float(r**2), np.array([r / self.sd]), np.array([[1 / self.sd**2]])

    prior = 0.8
    found = maximise(Unknowns.of([Unknown("a", 1.0, positive=False, sd=prior)]), [Datum()])
    total = 0.3**2 + prior**2
    exact = -0.5 * 1.7**2 / total - 0.5 * np.log(total / 0.3**2)
    assert found.log_evidence == pytest.approx(exact, rel=1e-6)
    assert found.p[0] == pytest.approx(1.7 * prior**2 / total, rel=1e-6)
