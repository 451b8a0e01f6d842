"""Critical speeds of rotors, of massless and light shafts too, against eigenvalues of the synchronous pencil."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import scipy.linalg
from click.testing import CliRunner
from numpy.typing import NDArray
from scipy.sparse import csc_array

from femend.analysis.campbell import campbell
from femend.analysis.complex_frf import complex_frf
from femend.analysis.complex_modes import ComplexSolver, complex_modes
from femend.analysis.massless import condensed
from femend.analysis.turning import TurningSystem, turning_system
from femend.cli import main
from femend.data import Channel
from femend.data.campbell import Campbell
from femend.dof import Dof
from femend.model import read_model
from femend.model.terms.rotors import deck_rotors
from femend.model.terms.spinning import SpinningPart

Array = NDArray[np.float64]
RPM = 2 * np.pi / 60
E, D, L, MASS, IP, ID = 2.1e11, 0.03, 0.4, 8.0, 0.16, 0.08
AREA, SECOND = np.pi * D**2 / 4, np.pi * D**4 / 64
STEEL = 7850.0


def overhung(folder: Path, density: float, n: int = 4, more: str = "") -> Path:
    """Stodola's rotor: a clamped shaft of `n` beams along X with a disc of Ip = 2 Id at its end."""
    lines = ["SOL 103", "CEND", "SPC=1", "BEGIN BULK", "PARAM,COUPMASS,1", f"MAT1,1,{E:.4E},,.3,{density:.3E}"]
    lines += [f"PBAR,1,1,{AREA:.6E},{SECOND:.6E},{SECOND:.6E},{2 * SECOND:.6E}"]
    lines += [f"GRID,{i + 1},,{i * L / n:.4f},0.,0." for i in range(n + 1)]
    lines += [f"CBAR,{i + 1},1,{i + 1},{i + 2},0.,1.,0." for i in range(n)]
    lines += [f"CONM2,900,{n + 1},,{MASS},,,,,+", f"+,{IP},,{ID},,,{ID}", "SPC1,1,123456,1"]
    lines += [f"SPC1,1,14,2,THRU,{n + 1}", f"ROTORG,1,1,THRU,{n + 1}", "RSPINR,1,1,2,RPM,1."]
    path = folder / "rotor.bdf"
    path.write_text("\n".join(lines) + f"\nRGYRO,1,ASYNC,1,RPM,0.,,6000.\n{more}ENDDATA\n")
    return path


def system_of(path: Path) -> TurningSystem:
    model = read_model(path)
    return turning_system(model, deck_rotors(model.deck).parts())


def synchronous(system: TurningSystem, order: float = 1.0) -> list[tuple[float, float]]:
    """Critical speeds W in rad/s with the whirl of rows Y and Z, from K phi = W^2 (n^2 M - i n G) phi."""
    M, K = system.M.toarray(), system.K.toarray()
    G = np.zeros_like(M) if system.G is None else system.G.toarray()
    mu, phi = scipy.linalg.eigh(order**2 * M - 1j * order * G, K)
    # the disc is on the last node
    rows = [[i for i, d in enumerate(system.dofs) if d.component == c] for c in (2, 3)]
    out = []
    for value, v in zip(mu, phi.T, strict=True):
        if value > 1e-12 * mu.max():
            y, z = (v[own[-1]] for own in rows)
            out.append((float(value**-0.5), float(-2 * np.imag(np.conj(y) * z) / (abs(y) ** 2 + abs(z) ** 2))))
    return sorted(out)


def stodola() -> list[float]:
    """Critical speeds in 1/min of the massless shaft: det(K - W^2 diag(m, Id -+ Ip)) = 0 with K of the free end."""
    a = np.array([[L**3 / 3, L**2 / 2], [L**2 / 2, L]]) / (E * SECOND)
    found = [scipy.linalg.eigvals(np.linalg.inv(a), np.diag([MASS, ID + s * IP])).real for s in (1, -1)]
    return sorted(float(np.sqrt(w) / RPM) for w in np.concatenate(found) if w > 0)


SPEEDS = ([0, 60000], [0, 7000], [0, 10000, 60000], [0, 100, 60000], [40, 60000], [0, 2000, 2100], [2000, 60000])


@pytest.mark.parametrize("rpm", SPEEDS)
@pytest.mark.parametrize("order", [1.0, 2.0])
def test_critical_speeds_do_not_depend_on_the_speeds_asked_for(tmp_path: Path, rpm: list[float], order: float) -> None:
    """Each once, none lost between two speeds, forward or backward as the pencil has it."""
    system = system_of(overhung(tmp_path, STEEL))
    expected = [c for c in synchronous(system, order) if rpm[0] * RPM < c[0] < rpm[-1] * RPM]
    found = campbell(system, RPM * np.array(rpm), n_modes=8, orders=(order,))
    np.testing.assert_allclose([c.speed for c in found.critical], [c[0] for c in expected], rtol=1e-8)
    assert [np.sign(c.whirl) for c in found.critical] == [np.sign(c[1]) for c in expected]
    assert len({c.branch for c in found.critical}) == len(expected)
    assert not found.notes


def test_critical_speeds_of_modes_that_are_not_followed_are_told(tmp_path: Path) -> None:
    found = campbell(system_of(overhung(tmp_path, STEEL)), RPM * np.array([0.0, 60000.0]), n_modes=2)
    assert [c.rpm for c in found.critical] == pytest.approx([1709, 2187], abs=1)
    (note,) = found.notes
    assert note.startswith("modes beyond the 2 followed are critical, too, at 6581, ")


@pytest.mark.parametrize("seed", range(6))
def test_no_critical_speed_of_a_random_rotor_is_lost(seed: int) -> None:
    """Eight DOFs coupled at will, unequal planes, strong gyroscopic terms, one wide interval."""
    rng = np.random.default_rng(seed)
    a, b, g = (rng.standard_normal((8, 8)) for _ in range(3))
    G = 0.5 * (g - g.T)
    dofs = tuple(Dof(n, c) for n in (1, 2, 3, 4) for c in (2, 3))
    M, K = a @ a.T + 4 * np.eye(8), 1e4 * (b @ b.T + np.eye(8))
    system = TurningSystem(csc_array(M), csc_array(K), dofs, G=csc_array(G), parts=(SpinningPart((1.0, 0.0, 0.0)),))
    expected = [speed for speed, _ in synchronous(system) if speed < 400.0]
    found = campbell(system, [0.0, 400.0], n_modes=8)
    np.testing.assert_allclose([c.speed for c in found.critical], expected, rtol=1e-8)


@pytest.mark.parametrize(("density", "n"), [(0.0, 4), (1e-4, 4), (1e-6, 4), (0.0, 40), (1e-4, 20)])
def test_a_massless_or_light_shaft_has_stodolas_critical_speeds(tmp_path: Path, density: float, n: int) -> None:
    """To 1e-5, which the mass of the light shafts (3e-5 of the disc at most) allows and the digits of the deck."""
    found = campbell(system_of(overhung(tmp_path, density, n)), RPM * np.array([0.0, 3000.0]), n_modes=4)
    np.testing.assert_allclose([c.rpm for c in found.critical], [c for c in stodola() if c < 3000], rtol=1e-5)
    assert [round(c.whirl) for c in found.critical] == [-1, 1]
    assert np.isfinite(found.poles).all()
    assert not found.limits
    assert not found.notes


@pytest.mark.parametrize("density", [0.0, 1e-6, 1e-4])
def test_the_command_tells_what_there_is(tmp_path: Path, density: float) -> None:
    path = overhung(tmp_path, density)
    for more in ([], ["--n", "4"], ["--n", "10"]):
        done = CliRunner().invoke(main, ["modes", str(path), "--rpm", "0,3000", *more])
        assert done.exit_code == 0, done.output
        assert "1744 1/min (29.07 Hz, backward), 2269 1/min (37.82 Hz, forward)" in done.output
        assert ("only 4 modes: no more DOFs have a mass" in done.output) == (density == 0 and more != ["--n", "4"])
        assert "unstable" not in done.output
        assert "lost" not in done.output


def test_a_damped_light_shaft_is_followed_as_one_without_mass(tmp_path: Path) -> None:
    """A dashpot of 200 Ns/m in one plane: left vectors are no conjugates, and a massless one has a relaxation."""
    more = "CDAMP2,801,200.,3,2\nCELAS2,701,2.+6,3,2\nCELAS2,702,3.+6,3,3\n"
    told: list[Campbell] = []
    for density in (0.0, 1e-4):
        told.append(campbell(system_of(overhung(tmp_path, density, 4, more)), [0.0, 300.0, 600.0], n_modes=4))
        assert np.isfinite(told[-1].poles).all()
    np.testing.assert_allclose(told[0].poles[told[0].asked], told[1].poles[told[1].asked], rtol=1e-5)
    for one, other in zip(*(t.critical for t in told), strict=True):
        assert one.speed == pytest.approx(other.speed, rel=1e-5)


def test_a_long_shaft_keeps_its_branches(tmp_path: Path) -> None:
    """240 DOFs without damping: both planes nearly coincide, and conjugates are the left vectors."""
    found = campbell(system_of(overhung(tmp_path, STEEL, 60)), RPM * np.array([0.0, 6000.0]), n_modes=6)
    assert np.isfinite(found.poles).all()
    assert found.residual.max() < 1e-8
    assert [round(c.rpm) for c in found.critical] == [1709, 2187]


def test_a_long_damped_shaft_keeps_its_branches(tmp_path: Path) -> None:
    """240 DOFs with dashpots fill the core's space, in which rounding takes the left vectors at low speed."""
    more = "CDAMP2,801,200.,30,2\nCDAMP2,802,300.,30,3\n"
    system = system_of(overhung(tmp_path, STEEL, 60, more))
    found = campbell(system, RPM * np.array([0.0, 3000.0]), n_modes=4)
    assert np.isfinite(found.poles).all()
    assert found.residual.max() < 1e-7
    assert [round(c.whirl) for c in found.critical] == [-1, 1]
    at = found.critical[0]
    alone = complex_modes(system, n_modes=2, speed=at.speed)
    assert alone.poles.imag == pytest.approx([at.speed, alone.poles[1].imag], rel=1e-7)


def test_planes_that_nothing_tells_apart_are_critical_forward_and_backward() -> None:
    """A disc in the middle of its shaft (Jeffcott's): sqrt(k / m) twice, at the same speed."""
    dofs = tuple(Dof(1, c) for c in (2, 3, 5, 6))
    G = np.zeros((4, 4))
    G[2, 3], G[3, 2] = 0.1, -0.1
    system = TurningSystem(
        csc_array(np.diag([2.0, 2.0, 0.06, 0.06])),
        csc_array(np.diag([8e4, 8e4, 9e3, 9e3])),
        dofs,
        G=csc_array(G),
        parts=(SpinningPart((1.0, 0.0, 0.0)),),
    )
    found = campbell(system, [0.0, 250.0], n_modes=4)
    assert [c.speed for c in found.critical] == pytest.approx([200.0, 200.0, 237.17], rel=1e-5)
    assert [c.whirl for c in found.critical] == pytest.approx([-1.0, 1.0, -1.0])
    assert found.speed.size < 8  # coinciding planes are no reason to halve steps


def test_a_mode_that_loses_its_stiffness_is_told_lost() -> None:
    """k - W^2 s is 0 at 10 rad/s, where the pole becomes real; the other mode goes on."""
    dofs = (Dof(1, 2), Dof(2, 2))
    system = TurningSystem(
        csc_array(np.eye(2)),
        csc_array(np.diag([100.0, 1e4])),
        dofs,
        S=csc_array(np.diag([-1.0, 0.0])),
    )
    found = campbell(system, [0.0, 5.0, 20.0], n_modes=2)
    assert np.isnan(found.poles[-1, 0])
    assert found.poles[-1, 1].imag == pytest.approx(100.0)
    (note,) = found.notes
    assert "mode 1 lost from " in note
    assert "give more speeds before it" in note


def massless_chain() -> TurningSystem:
    """Masses at every other node of a chain with structural damping that differs from spring to spring."""
    n = 7
    K, D = np.zeros((n, n)), np.zeros((n, n))
    for i, eta in enumerate((0.01, 0.04, 0.02, 0.05, 0.03, 0.01)):
        link = 1e4 * (1 + i) * np.array([[1.0, -1.0], [-1.0, 1.0]])
        K[i : i + 2, i : i + 2] += link
        D[i : i + 2, i : i + 2] += eta * link
    K[0, 0] += 1e4
    M = np.diag([1.0, 0.0, 2.0, 0.0, 1.0, 0.0, 0.0])
    return TurningSystem(csc_array(M), csc_array(K), tuple(Dof(i + 1, 1) for i in range(n)), D=csc_array(D))


def test_massless_rows_are_condensed_exactly() -> None:
    system = massless_chain()
    small = condensed(system)
    assert [d.node for d in small.system.dofs] == [1, 3, 5]
    found = complex_modes(system, n_modes=3)
    Z = [p**2 * system.M.toarray() + system.matrix("stiffness", 0.0).toarray() for p in found.poles]
    for z, psi, y in zip(Z, np.asarray(found.modes.phi).T, found.left.T, strict=True):
        assert np.linalg.norm(z @ psi) < 1e-9 * np.linalg.norm(z) * np.linalg.norm(psi)
        assert np.linalg.norm(z.T @ y) < 1e-9 * np.linalg.norm(z) * np.linalg.norm(y)
    with pytest.raises(ValueError, match="only 3 oscillatory modes"):
        complex_modes(system, n_modes=4)


def test_frfs_at_massless_dofs_are_those_of_the_dense_solution() -> None:
    system = massless_chain()
    freq = np.linspace(1.0, 40.0, 60)
    outputs = [Channel(Dof(i, 1), "displacement", "m") for i in (2, 3, 7)]
    inputs = [Channel(Dof(i, 1), "force", "N") for i in (2, 7)]
    H = complex_frf(system, freq, outputs, inputs, n_modes=3, kind="receptance").H
    K = system.matrix("stiffness", 0.0).toarray()
    for i, f in enumerate(freq):
        exact = np.linalg.inv(K - (2 * np.pi * f) ** 2 * system.M.toarray())[np.ix_([1, 2, 6], [1, 6])]
        np.testing.assert_allclose(H[i], exact, atol=1e-6 * np.abs(H).max())


def test_rows_without_mass_and_stiffness_stay_for_the_core_to_name() -> None:
    dofs = (Dof(1, 1), Dof(2, 1))
    loose = TurningSystem(csc_array(np.diag([1.0, 0.0])), csc_array(np.diag([1.0, 0.0])), dofs)
    assert condensed(loose).T is None
    with pytest.raises(ValueError, match="2:"):
        ComplexSolver(loose, n_modes=1).raw(0.0)
