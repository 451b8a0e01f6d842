"""Reductions and expansions against exact answers; residual energy, alignment and faulty sensors on known errors."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import eigh

from femend import Dof, model_modes
from femend.analysis.tam import tam_table
from femend.correlate import align_points, sensor_faults
from femend.diagnose.residual.residual_energy import residual_energy
from femend.diagnose.residual.residual_parameters import _greedy, rank_parameters
from femend.errors import CorrelationError, ExpansionError, ModelError
from femend.estimate.updating import DeckMatrices
from femend.expansion import (
    craig_bampton,
    dynamic,
    expand_dynamic,
    expand_residual,
    guyan,
    hybrid,
    irs,
    leave_one_out,
    serep,
)
from femend.model import Model, Parameter, read_model

N = 12
K = 1e4 * (2 * np.eye(N) - np.eye(N, k=1) - np.eye(N, k=-1))
K[-1, -1] = 1e4
M = np.diag(np.linspace(1.0, 2.0, N))
LAM, PHI = eigh(K, M)
FREQ = np.sqrt(LAM) / (2 * np.pi)
ROWS = [1, 4, 8, 11]


def test_guyan_of_a_chain_by_hand() -> None:
    # between measured masses springs in series: linear interpolation
    T = guyan(K, ROWS).T
    np.testing.assert_allclose(T[2], [2 / 3, 1 / 3, 0, 0], atol=1e-12)
    np.testing.assert_allclose(T[0], [0.5, 0, 0, 0], atol=1e-12)
    # reduced stiffness: springs in series
    np.testing.assert_allclose(guyan(K, ROWS).of(K)[0, 1], -1e4 / 3)


def test_dynamic_is_exact_at_its_frequency() -> None:
    R = dynamic(K, M, ROWS, FREQ[2])
    lam = eigh(R.of(K), R.of(M), eigvals_only=True)
    assert np.abs(np.sqrt(lam) / 2 / np.pi - FREQ[2]).min() < 1e-9
    np.testing.assert_allclose(R.expand(PHI[ROWS, 2:3]), PHI[:, 2:3], atol=1e-9)
    np.testing.assert_allclose(expand_dynamic(K, M, ROWS, PHI[ROWS, :4], FREQ[:4]), PHI[:, :4], atol=1e-9)


def test_each_reduction_is_better_than_the_one_it_improves() -> None:
    def error(R: object, r: int) -> float:
        return abs(R.modes(K, M)[0][r] / FREQ[r] - 1)  # type: ignore[attr-defined]

    for r in range(3):
        assert error(irs(K, M, ROWS), r) < 0.2 * error(guyan(K, ROWS), r)
    assert error(irs(K, M, ROWS, 30), 1) < 1e-6  # iterated IRS converges to the modes of the model
    assert max(error(craig_bampton(K, M, ROWS, 8), r) for r in range(N)) < 1e-9  # all fixed modes: the whole model
    assert all(craig_bampton(K, M, ROWS, 2).modes(K, M)[0][r] >= FREQ[r] * (1 - 1e-12) for r in range(6))


def test_serep_and_hybrid_are_exact_for_their_modes() -> None:
    for R in (serep(PHI[:, :3], ROWS), hybrid(guyan(K, ROWS), PHI[:, :3], M)):
        np.testing.assert_allclose(R.expand(PHI[ROWS, :3]), PHI[:, :3], atol=1e-10)
        mass = R.of(M)
        np.testing.assert_allclose(PHI[ROWS, :3].T @ mass @ PHI[ROWS, :3], np.eye(3), atol=1e-10)
    assert np.linalg.matrix_rank(hybrid(guyan(K, ROWS), PHI[:, :3], M).of(M)) == 4  # SEREP has 3
    full = hybrid(craig_bampton(K, M, ROWS, 8), PHI[:, :3], M)
    np.testing.assert_allclose(full.expand(PHI[ROWS, :3]), PHI[:, :3], atol=1e-9)


def test_orthogonality_over_the_reduced_mass() -> None:
    turned = PHI[:, :3].copy()
    turned[:, 0] = np.cos(0.3) * PHI[:, 0] + np.sin(0.3) * PHI[:, 1]  # a test mode that is a mixture
    table = tam_table(K, M, ROWS, turned[ROWS], PHI[:, :3], FREQ[:3])
    row = table["SEREP"]
    np.testing.assert_allclose(abs(row.cross[0, :2]), [np.cos(0.3), np.sin(0.3)], atol=1e-9)
    assert row.off_model < 1e-9 < table["Guyan"].off_model
    assert row.off_test == pytest.approx(np.sin(0.3), abs=1e-9)
    few = tam_table(K, M, ROWS[:2], turned[ROWS[:2]], PHI[:, :3], FREQ[:3], methods=["SEREP", "Guyan"])
    assert "2 sensors for 3 modes" in few["SEREP"].status
    assert few["Guyan"].status == ""


def test_least_residual_is_the_dense_quadratic_minimum() -> None:
    rng = np.random.default_rng(2)
    sd = np.array([0.01, 0.02, 0.01, 0.03])
    y = PHI[ROWS, 1] + sd * rng.standard_normal(4)
    f = 1.03 * FREQ[1]
    found = expand_residual(K, M, ROWS, y, [f], sd, model_error=0.05, error_at=range(N))
    Z = K - (2 * np.pi * f) ** 2 * M
    B = np.eye(N)[ROWS]
    u = found.phi[:, 0]
    # E is that of the pass before; it settles to well within a percent
    H = Z @ np.linalg.inv(K) @ Z / (0.05**2 * (u @ K @ u)) + B.T @ np.diag(sd**-2) @ B
    np.testing.assert_allclose(u, np.linalg.solve(H, B.T @ (y / sd**2)), rtol=0.01, atol=1e-3)
    np.testing.assert_allclose(found.sd[:, 0], np.sqrt(np.diag(np.linalg.inv(H))), rtol=0.02)


def test_shapes_at_frequencies_of_the_model_are_its_own() -> None:
    """The dynamic stiffness is singular there."""
    found = expand_residual(K, M, ROWS, PHI[ROWS, :3], FREQ[:3], 0.01, model_error=0.05, error_at=ROWS)
    np.testing.assert_allclose(found.phi, PHI[:, :3], atol=1e-6)
    assert found.energy.max() < 1e-9
    # a sensor is told no better than itself, and better with the others
    assert (found.sd < 0.01).all()
    assert (found.sd > 0.003).all()


def test_deviation_of_the_expansion_holds_for_wrong_models() -> None:
    """Structures whose stiffness is wrong at random: errors of the expansion are of the size that it states."""
    rng = np.random.default_rng(4)
    z = []
    for _ in range(40):
        # modal stiffness errors e omega_i omega_j, which the form supposes
        W = 0.03 * rng.standard_normal((N, N)) * np.sqrt(np.outer(LAM, LAM))
        W = np.triu(W, 1) + np.triu(W, 1).T
        basis = M @ PHI
        lam, phi = eigh(K + basis @ W @ basis.T, M)
        x = phi[:, 1] * np.sign(phi[:, 1] @ M @ PHI[:, 1])
        sd = 0.005
        y = x[ROWS] + sd * rng.standard_normal(4)
        f = float(np.sqrt(lam[1])) / 2 / np.pi
        found = expand_residual(K, M, ROWS, y, [f], sd, model_error=0.03, error_at=[3, 6, 9])
        z.append((found.phi[[3, 6, 9], 0] - x[[3, 6, 9]]) / found.sd[:, 0])
    assert 0.6 < np.sqrt(np.mean(np.square(z))) < 1.4


def test_left_out_sensors_show_a_bad_one() -> None:
    rows = list(range(0, 12, 2))
    y = PHI[rows, :2].copy()
    y[3] *= -1.0
    left = leave_one_out(lambda r, x: serep(PHI[:, :2], r).expand(x), rows, y)
    assert int(np.argmax(left.per_sensor)) == 3
    clean = leave_one_out(lambda r, x: serep(PHI[:, :2], r).expand(x), rows, PHI[rows, :2])
    assert clean.per_mode.max() < 1e-12
    few = leave_one_out(lambda r, x: serep(PHI[:, :2], r).expand(x), rows[:2], y[:2])
    assert np.isnan(few.predicted).all()


def test_what_cannot_be_expanded_is_said() -> None:
    free = K.copy()
    free[0, 0] = 1e4
    beside = np.block([[free, np.zeros((N, 1))], [np.zeros((1, N)), np.zeros((1, 1))]])
    with pytest.raises(ExpansionError, match="moves freely"):
        guyan(beside, [0, 3])
    with pytest.raises(ExpansionError, match="4 sensors for 5 modes"):
        serep(PHI[:, :5], ROWS)
    with pytest.raises(ExpansionError, match="no measured DOF is given"):
        guyan(K, [])
    with pytest.raises(ExpansionError, match=r"row 999 is none of the model, which has \d+, from 0"):
        guyan(K, [0, 999])
    with pytest.raises(ExpansionError, match="stand twice"):
        guyan(K, [1, 1])
    with pytest.raises(ExpansionError, match="no sensor measures"):
        craig_bampton(K, M, ROWS, 2).expand(PHI[ROWS, :2])
    with pytest.raises(ExpansionError, match="above 0"):
        expand_residual(K, M, ROWS, PHI[ROWS, :1], FREQ[:1], 0.0)
    # a free structure can be expanded all the same
    lam, phi = eigh(free, M)
    f = np.sqrt(lam[2]) / 2 / np.pi
    done = expand_residual(free, M, ROWS, phi[ROWS, 2], [f], 1e-4, model_error=0.05)
    np.testing.assert_allclose(done.phi[:, 0], phi[:, 2], atol=2e-3)


@pytest.fixture(scope="module")
def beam(tmp_path_factory: pytest.TempPathFactory) -> Model:
    """A clamped beam of ten elements, each with a factor on its E."""
    lines = ["BEGIN BULK", "MAT1,1,7.+10,,.3,2700.", "PBAR,1,1,4.-4,1.-8,2.-8,2.-8"]
    lines += [f"GRID,{i},,{i / 10},0.,0." for i in range(11)]
    lines = [line.replace("GRID,0,", "GRID,11,") for line in lines]
    lines += [f"CBAR,{i},1,{i - 1 or 11},{i},0.,1.,0." for i in range(1, 11)]
    path = tmp_path_factory.mktemp("beam") / "beam.bdf"
    path.write_text("\n".join([*lines, "SPC1,1,123456,11", "ENDDATA"]))
    return read_model(path, spc=1, parameters=[Parameter(f"E{e}", "E", "elements", (e,)) for e in range(1, 11)])


def test_residual_leads_to_the_wrong_element(beam: Model) -> None:
    k, m = (A.toarray() for A in beam.matrices())
    mu, phi = eigh(m, beam.matrices({"E4": 0.7})[0].toarray())  # some DOFs have no mass
    lam, phi = 1 / np.maximum(mu[::-1], 1e-30), phi[:, ::-1]
    bending = [
        r for r in range(12) if np.abs(phi[beam.fe.dof_components == 3][:, r]).max() > 0.1 * np.abs(phi[:, r]).max()
    ][:4]
    rows = np.flatnonzero(beam.fe.dof_components == 3)
    f = np.sqrt(lam[bending]) / 2 / np.pi
    rng = np.random.default_rng(0)
    sd = 1e-3 * np.abs(phi[np.ix_(rows, bending)]).max(axis=0)
    y = phi[np.ix_(rows, bending)] + sd * rng.standard_normal((rows.size, len(bending)))
    found = expand_residual(k, m, rows, y, f, np.tile(sd, (rows.size, 1)))
    energy = residual_energy(beam, found.residual, found.phi)
    assert energy.element.sum() == pytest.approx(1.0)
    assert energy.worst(1)[0][0] == 4
    ranking = rank_parameters(DeckMatrices(beam), rows, y, f, np.tile(sd, (rows.size, 1)), prior_sd=0.3)
    assert ranking.rows[0].name == "E4"
    assert ranking.rows[0].change == pytest.approx(-0.3, abs=0.1)
    assert [name for name, _, _ in ranking.chosen] == ["E4"]


def test_changes_that_are_told_together_are_those_of_all_of_them() -> None:
    """Of parameters that make up for each other the first one's change alone is another: with both told, the share
    that is said to be left has to be what their changes leave."""
    names, whole = ("k1", "k2", "m"), 200.0
    b, C = np.array([-30.0, 24.0, 2.0]), np.array([[20.0, 16.0, 0.0], [16.0, 40.0, 0.0], [0.0, 0.0, 30.0]])
    told = _greedy(names, b, C, whole, 6)
    own = [names.index(name) for name, _, _ in told]
    assert own == [0, 1]
    x = np.array([change for _, change, _ in told])
    left = 1 + (2 * b[own] @ x + x @ C[np.ix_(own, own)] @ x) / whole
    assert told[-1][2] == pytest.approx(left)
    np.testing.assert_allclose(C[np.ix_(own, own)] @ x, -b[own])


def test_the_soft_half_of_a_plate_is_found(tmp_path: Path) -> None:
    """Shells: the system of residual and shape together could not be factored, and was told as too few sensors."""
    n = 12
    nodes = [(i, j) for i in range(n + 1) for j in range(n + 1)]
    number = {at: k + 1 for k, at in enumerate(nodes)}
    lines = [f"GRID,{number[i, j]},,{i / n:.4f},{j / n:.4f},0." for i, j in nodes]
    lines += [
        f"CQUAD4,{k + 1},{1 if i < n // 2 else 2},"
        f"{number[i, j]},{number[i + 1, j]},{number[i + 1, j + 1]},{number[i, j + 1]}"
        for k, (i, j) in enumerate((i, j) for i in range(n) for j in range(n))
    ]
    lines += [f"MAT1,{k},7.+10,,.33,2700." for k in (1, 2)] + [f"PSHELL,{k},{k},.01,{k}" for k in (1, 2)]
    lines += [f"SPC1,1,123456,{number[0, j]}" for j in range(n + 1)]
    path = tmp_path / "plate.bdf"
    path.write_text("\n".join(["BEGIN BULK", *lines, "ENDDATA"]))
    parameters = [Parameter(f"E{k}", "E", "material", (k,)) for k in (1, 2)]
    plate = read_model(path, spc=1, parameters=parameters)
    true = model_modes(plate, n_modes=6, factors={"E2": 0.8})
    sensors = [Dof(number[i, j], 3) for i in (3, 6, 9, 12) for j in (0, 4, 8, 12)]
    at = {(int(a), int(c)): i for i, (a, c) in enumerate(zip(plate.fe.dof_nodes, plate.fe.dof_components, strict=True))}
    rows = [at[d.node, d.component] for d in sensors]
    y = true.phi[[true.dofs.index(d) for d in sensors]]
    sd = np.tile(0.03 * np.abs(y).max(axis=0), (len(rows), 1))
    found = expand_residual(*plate.matrices(), rows, y, true.freq, sd)
    energy = residual_energy(plate, found.residual, found.phi)
    carried = dict.fromkeys(energy.regions, 0.0)
    for eid, share, density in zip(energy.elements, energy.element, energy.density, strict=True):
        carried["property 1" if (eid - 1) // n < n // 2 else "property 2"] += share / density
    density = {name: share / carried[name] for name, share in energy.regions.items()}
    assert density["property 2"] > 2 * density["property 1"]
    ranking = rank_parameters(DeckMatrices(plate), rows, y, true.freq, sd, prior_sd=0.1, model_error=found.model_error)
    assert ranking.rows[0].name == "E2"
    assert ranking.rows[0].change == pytest.approx(-0.2, abs=0.05)


def test_residual_energy_of_all_of_an_element_is_that_of_the_matrices(beam: Model) -> None:
    k, _ = (A.toarray() for A in beam.matrices())
    rng = np.random.default_rng(1)
    d, u = rng.standard_normal((2, k.shape[0], 2))
    found = residual_energy(beam, d, u, regions={"tip": [9, 10], "rest": list(range(1, 9))})
    whole = np.einsum("im,ij,jm->m", d, k, d) / np.einsum("im,ij,jm->m", u, k, u)
    np.testing.assert_allclose(found.per_mode.sum(axis=0), whole, rtol=1e-8)
    assert found.regions["tip"] + found.regions["rest"] == pytest.approx(1.0)
    with pytest.raises(ModelError, match="no element 77"):
        residual_energy(beam, d, u, regions={"x": [77]})
    with pytest.raises(ModelError, match="no energy"):
        residual_energy(beam, 0 * d, u)


BOX = np.array([[x, y, z] for x in (0, 0.7, 2.0) for y in (0, 1.1) for z in (0, 0.5, 3.0)], dtype=float)


def rotation(seed: int) -> np.ndarray:
    return np.linalg.qr(np.random.default_rng(seed).standard_normal((3, 3)))[0]


def test_units_and_axes_are_found_with_and_without_mates() -> None:
    swapped = BOX[:, [1, 0, 2]] * [1, -1, 1] * 1000 + [50, -20, 7]
    for mate in (np.arange(len(BOX)), None):
        found = align_points(swapped, BOX, mate)
        assert found.scale == 0.001
        np.testing.assert_allclose(found.xyz, BOX, atol=1e-9)
        assert any("test in mm, model in m" in note for note in found.notes)
        assert any("test X is model Y" in note for note in found.notes)
    # the direction of a sensor goes with the frame: test X is model Y
    np.testing.assert_allclose(found.directions([1, 0, 0]), [0, 1, 0], atol=1e-9)


def test_any_turn_with_mates_and_a_mirrored_axis() -> None:
    R = rotation(3)
    found = align_points((BOX - 4.0) @ R, BOX, np.arange(len(BOX)))
    np.testing.assert_allclose(found.R, R, atol=1e-9)
    assert found.mirrored == (np.linalg.det(R) < 0)
    mirror = align_points(BOX * [1, -1, 1], BOX, np.arange(len(BOX)))
    assert mirror.mirrored
    assert any("left-handed" in note for note in mirror.notes)


def test_exchanged_and_misplaced_points_are_named() -> None:
    test = BOX.copy()
    test[[2, 9]] = test[[9, 2]]
    test[14] += [0, 0.4, 0]
    found = align_points(test * 1000, BOX, np.arange(len(BOX)))
    assert found.off == (2, 9, 14)
    assert "test points 2 and 9 are exchanged" in found.notes
    assert any(note.startswith("test point 14 is 0.4 from its mate") for note in found.notes)
    with pytest.raises(CorrelationError, match="in line"):
        align_points([[0, 0, 0], [1, 0, 0], [2, 0, 0]], BOX, [0, 1, 2])


def test_reversed_and_exchanged_sensors_are_named_and_clean_ones_are_not() -> None:
    rng = np.random.default_rng(6)
    phi = rng.standard_normal((14, 4))
    test = (phi + 0.05 * rng.standard_normal(phi.shape)) * [2.0, -1.0, 0.3, 5.0]
    assert sensor_faults(test, phi)[0] == ()
    bad = test.copy()
    bad[3] *= -1
    bad[[7, 10]] = bad[[10, 7]]
    faults, cured = sensor_faults(bad, phi, [f"{i}:+Z" for i in range(14)])
    assert {(f.kind, tuple(sorted(f.rows))) for f in faults} == {("reversed", (3,)), ("exchanged", (7, 10))}
    np.testing.assert_allclose(cured, test, rtol=1e-12)
    assert "3:+Z looks reversed" in "; ".join(f.text for f in faults)
    # nor are two that show nearly the same
    near = test.copy()
    phi[10], near[10] = phi[7], 1.1 * near[7]
    assert sensor_faults(near, phi)[0] == ()
    # a model that is wrong everywhere is no fault of a sensor
    assert sensor_faults(rng.standard_normal((14, 4)), phi)[0] == ()


def test_matrices_of_two_models_are_refused() -> None:
    with pytest.raises(ExpansionError, match="not of one model"):
        irs(K, M[:3, :3], ROWS)


def test_residual_on_the_mesh_is_brightest_at_its_element(beam: Model) -> None:
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    from matplotlib.figure import Figure

    from femend.report.content import MeshPicture
    from femend.report.plots import draw_residual

    k, _ = beam.matrices()
    d = np.zeros((k.shape[0], 1))
    tip = [i for i, n in enumerate(beam.fe.dof_nodes) if n == 10]
    d[tip[2]] = 1.0  # the end alone moves: the last element alone is strained
    energy = residual_energy(beam, d, d)
    assert energy.worst(1) == [(10, 1.0)]
    lines = np.array([[int(np.flatnonzero(beam.node_ids == n)[0]) for n in own] for _, _, own in beam.fe.elements()])
    mesh = MeshPicture(beam.node_ids, beam.xyz, lines)
    ax = Figure().add_subplot()
    draw_residual(ax, mesh, beam, energy)
    colours = ax.collections[-1].get_array()
    assert colours is not None
    last = [set(int(x) for x in own) for _, _, own in beam.fe.elements()].index({9, 10})
    assert int(np.argmax(colours)) == last
