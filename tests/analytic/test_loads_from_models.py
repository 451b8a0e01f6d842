"""Motion of supports and pressures through a model, against closed solutions and independent simulations."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import scipy.signal
from numpy.typing import NDArray

from femend.data import ODS, Channel, TimeData
from femend.dof import Dof
from femend.errors import LoadError, ModelError
from femend.estimate.loads import ModelSide, compare_loads, identify_loads, load_history, model_side
from femend.model import Model, pair_sensors, read_model
from femend.model.surfaces.faces import nodal_loads, surface_of
from femend.model.surfaces.pressure import modal_patterns, polynomial_patterns

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
E_STEEL, RHO = 2.1e11, 7850.0


def channels(dofs: list[str], quantity: str = "acceleration") -> list[Channel]:
    unit = {"acceleration": "m/s^2", "velocity": "m/s", "displacement": "m"}[quantity]
    return [Channel(Dof.parse(d), quantity, unit) for d in dofs]


def written(folder: Path, lines: list[str]) -> Model:
    path = folder / "model.bdf"
    path.write_text("\n".join(["SOL 103", "CEND", "SPC = 1", "BEGIN BULK", *lines, "ENDDATA", ""]))
    return read_model(path)


def side(model: Model, dofs: list[str], f_max: float, zeta: float = 0.01, quantity: str = "acceleration") -> ModelSide:
    own = channels(dofs, quantity)
    return model_side(model, own, pair_sensors(own, model.node_ids, model.xyz), f_max=f_max, zeta=zeta)


def oscillators(folder: Path) -> Model:
    """Masses of 1 kg on springs of 4e3, 9e3 and 25e3 N/m beside each other, on one support each, along X."""
    lines = []
    for i, k in enumerate((4e3, 9e3, 25e3)):
        a, b = 1 + i, 11 + i
        lines += [f"GRID,{a},,{0.1 * i},0.,0.", f"GRID,{b},,{0.1 * i},0.,0.1", f"CONM2,{100 + i},{b},,1.0"]
        lines += [f"CELAS2,{200 + i},{k},{a},1,{b},1", f"SPC1,1,123456,{a}", f"SPC1,1,23456,{b}"]
    return written(folder, lines)


def transmissibility(freq: Array, k: float, zeta: float) -> ComplexArray:
    """Absolute per base acceleration of a mass of 1 kg (Clough and Penzien, eq. 3-48 in complex form)."""
    w, w0 = 2 * np.pi * freq, np.sqrt(k)
    return (w0**2 + 2j * zeta * w0 * w) / (w0**2 - w**2 + 2j * zeta * w0 * w)


def test_oscillators_follow_their_support(tmp_path: Path) -> None:
    freq = np.linspace(1.0, 40.0, 200)
    look = side(oscillators(tmp_path), ["11:X", "12:X", "13:-X", "1:X"], 40.0, 0.03)
    H = look.base(freq, ["X"]).H[:, :, 0]
    expected = np.stack([transmissibility(freq, k, 0.03) for k in (4e3, 9e3, 25e3)], axis=1) * [1, 1, -1]
    # the damping of modes acts on the relative motion; its part in the support's own drive is not there
    apart = 2j * 0.03 * np.sqrt([4e3, 9e3, 25e3]) * 2 * np.pi * freq[:, None]
    w02 = np.array([4e3, 9e3, 25e3])
    relative = (2 * np.pi * freq[:, None]) ** 2 / (w02 - (2 * np.pi * freq[:, None]) ** 2 + apart)
    assert np.allclose(H[:, :3], (1 + relative) * [1, 1, -1], rtol=1e-8)
    assert np.allclose(H[:, :3], expected, rtol=1e-8)
    assert np.allclose(H[:, 3], 1.0)
    alone = look.base(freq, ["X"], nodes=[2]).H[:, :, 0]
    assert np.allclose(alone[:, [0, 2, 3]], 0.0, atol=1e-9)
    assert np.allclose(alone[:, 1], expected[:, 1], rtol=1e-8)


def test_a_rod_that_is_shaken_at_its_end(tmp_path: Path) -> None:
    """T(x) = cos(k (L - x)) / cos(k L), k = omega / c: a bar driven at one end and free at the other."""
    n, L = 60, 2.0
    lines = [f"GRID,{i + 1},,{L * i / n},0.,0.,,23456" for i in range(n + 1)]
    lines += [f"MAT1,1,{E_STEEL},,0.3,{RHO}", "PROD,1,1,1e-4", "SPC1,1,1,1", "PARAM,COUPMASS,1"]
    lines += [f"CROD,{i + 1},1,{i + 1},{i + 2}" for i in range(n)]
    look = side(written(tmp_path, lines), [f"{n + 1}:X", f"{n // 2 + 1}:X"], 1800.0, 0.0)
    c = np.sqrt(E_STEEL / RHO)
    freq = np.concatenate([np.linspace(20.0, 550.0, 60), np.linspace(750.0, 1800.0, 60)])  # poles: 646.6, 1940 Hz
    k = 2 * np.pi * freq / c
    expected = np.stack([1 / np.cos(k * L), np.cos(0.5 * k * L) / np.cos(k * L)], axis=1)
    # linear elements: the second mode is 0.02 % high
    assert np.allclose(look.base(freq, ["X"]).H[:, :, 0].real, expected, rtol=5e-3, atol=5e-3)


def beam(folder: Path, n: int = 10) -> Model:
    """A frame leg: a cantilever along X on one support, 1 m of 20 mm square steel."""
    lines = [f"GRID,{i + 1},,{i / n},0.,0." for i in range(n + 1)]
    lines += [f"MAT1,1,{E_STEEL},,0.3,{RHO}", "PBAR,1,1,4e-4,1.3333e-8,1.3333e-8,2.2e-8", "PARAM,COUPMASS,1"]
    lines += [f"CBAR,{i + 1},1,{i + 1},{i + 2},0.,1.,0." for i in range(n)] + ["SPC1,1,123456,1"]
    return written(folder, lines)


def test_turning_and_shifting_supports_move_a_stiff_beam_as_one_body(tmp_path: Path) -> None:
    look = side(beam(tmp_path), ["11:Y", "6:Z", "11:RY"], 40.0, 0.01, "displacement")
    unit = look.base(np.array([0.05]), ["X", "Y", "Z", "RX", "RY", "RZ"])
    s2 = (2j * np.pi * 0.05) ** 2
    H = (unit.H[0] * s2).real  # displacement per displacement
    assert np.allclose(H[0], [0, 1, 0, 0, 0, 1.0], atol=1e-4)
    assert np.allclose(H[1], [0, 0, 1, 0, -0.5, 0], atol=1e-4)
    assert np.allclose(H[2], [0, 0, 0, 0, 1, 0], atol=1e-4)
    assert unit.units == ("m/s^2",) * 3 + ("rad/s^2",) * 3


def test_what_cannot_move_is_refused(tmp_path: Path) -> None:
    freq = np.array([5.0])
    free = beam(tmp_path)
    with pytest.raises(ModelError, match="none of the nodes \\[7\\] is held"):
        side(free, ["11:Y"], 40.0).base(freq, ["Y"], nodes=[7])
    heavy = read_model(tmp_path / "model.bdf", added_mass=[(11, 1.0)])
    with pytest.raises(ModelError, match="masses on top of the deck"):
        side(heavy, ["11:Y"], 40.0).base(freq, ["Y"])
    text = (tmp_path / "model.bdf").read_text().replace("SPC1,1,123456,1\n", "")
    (tmp_path / "loose.bdf").write_text(text.replace("SPC = 1\n", ""))
    with pytest.raises(ModelError, match="holds no DOF"):
        side(read_model(tmp_path / "loose.bdf"), ["11:Y"], 40.0).base(freq, ["Y"])
    with pytest.raises(LoadError, match="measures no motion"):
        model_side(
            free, [Channel(Dof(11, 2), "force", "N")], pair_sensors([Dof(11, 2)], free.node_ids, free.xyz), f_max=9
        )


def recorded(dt: float, base: Array, k: tuple[float, ...], zeta: float) -> Array:
    """Accelerations of oscillators on a base with acceleration `base`, step by step (state space, ramps exact)."""
    found = []
    for stiffness in k:
        c = 2 * zeta * np.sqrt(stiffness)
        system = scipy.signal.StateSpace(
            [[0, 1], [-stiffness, -c]], [[0], [-1]], [[-stiffness, -c]], [[0]]
        )  # relative motion; its acceleration plus the base's is absolute
        _, y, _ = scipy.signal.lsim(system, base, dt * np.arange(len(base)))
        found.append(y)
    return np.array(found)


def test_history_of_a_base_from_three_sensors(tmp_path: Path) -> None:
    dt, n, rng = 1 / 512, 8192, np.random.default_rng(1)
    sos = scipy.signal.butter(4, [3.0, 25.0], "bandpass", fs=1 / dt, output="sos")
    base = scipy.signal.sosfiltfilt(sos, rng.standard_normal(n)) * np.hanning(n)
    y = recorded(dt, base, (4e3, 9e3, 25e3), 0.03)
    sd = 0.02 * y.std()
    response = TimeData("run", dt, y + sd * rng.standard_normal(y.shape), tuple(channels(["11:X", "12:X", "13:X"])))
    look = side(oscillators(tmp_path), ["11:X", "12:X", "13:X"], 30.0, 0.03)
    found = load_history(lambda f: look.base(f, ["X"]), response, (2.0, 30.0), noise=np.full(3, sd))
    assert found.time.channels[0].quantity == "acceleration"
    inside = (dt * np.arange(n) > found.trusted[0]) & (dt * np.arange(n) < found.trusted[1])
    spectrum, freq = np.fft.rfft(base), np.fft.rfftfreq(n, dt)
    in_band = (freq >= found.band[0]) & (freq <= found.band[1])
    left = (found.time.values[0] - np.fft.irfft(spectrum * in_band, n))[inside]
    # by Parseval the lines' deviations are that of the samples; 2 % for ramps between the samples
    stated = np.sqrt(2 * (found.lines.sd**2).sum()) / n
    assert np.sqrt((left**2).mean()) < 1.2 * stated + 0.02 * np.sqrt((base**2).mean())
    assert stated < 0.06 * np.sqrt((base**2).mean())
    assert found.lines.reliable[(found.lines.freq > 5.0) & (found.lines.freq < 20.0)].mean() > 0.9
    # deviations: errors are as large as stated on the lines that the base excites
    window_free = np.abs(found.lines.values[:, 0] - spectrum[in_band]) / found.lines.sd[:, 0]
    assert 0.5 < np.median(window_free[(found.lines.freq > 5) & (found.lines.freq < 20)]) < 1.2
    with pytest.raises(LoadError, match="ends at 300 Hz"):
        load_history(lambda f: look.base(f, ["X"]), response, (2.0, 300.0))


SEEN = ["3:Y", "5:Y", "7:Y", "9:Y", "11:Y", "5:Z", "8:Z", "11:Z"]


@pytest.mark.parametrize("truth", ["base", "force"])
def test_base_motion_and_a_force_are_told_apart(tmp_path: Path, truth: str) -> None:
    """The truth is a finer mesh with another stiffness, so that no rival explains everything."""
    (tmp_path / "fine").mkdir()
    fine, freq = beam(tmp_path / "fine", 40), np.linspace(5.0, 150.0, 80)
    own = {d: f"{4 * (int(d.split(':')[0]) - 1) + 1}:{d.split(':')[1]}" for d in SEEN}
    real, rng = side(fine, list(own.values()), 160.0, 0.012), np.random.default_rng(2)
    unit = real.base(freq, ["Y", "Z"]) if truth == "base" else real.forces(freq, ["33:Y", "33:Z"])
    load = np.stack([1 + 0.3j * np.sin(freq / 9), 0.7 * np.exp(1j * freq / 20)], axis=1)
    y = np.einsum("kmn,kn->km", unit.H, load)
    sd = 0.01 * np.sqrt((np.abs(y) ** 2).mean(axis=1, keepdims=True)) * np.ones(y.shape)
    y = y + sd / np.sqrt(2) * (rng.standard_normal(y.shape) + 1j * rng.standard_normal(y.shape))
    look = side(beam(tmp_path), SEEN, 160.0, 0.01)
    shapes = ODS("run", freq, y.T, tuple(channels(SEEN)), "ods", sigma=sd.T)
    rivals = {"base": look.base(freq, ["Y", "Z"]), "force": look.forces(freq, ["9:Y", "9:Z"])}
    found = compare_loads(rivals, shapes)
    assert found.best == truth, found.reason
    assert found.rivals[0].name == truth
    assert found.rivals[0].unseen < 0.5 * found.rivals[1].unseen
    assert found.rivals[0].probability > 0.99


def test_loads_that_do_the_same_are_not_told_apart(tmp_path: Path) -> None:
    """One oscillator per sensor: a force on its mass and a motion of its support differ by a factor per line."""
    freq = np.linspace(2.0, 30.0, 60)
    look = side(oscillators(tmp_path), ["11:X", "1:X"], 40.0, 0.03, "acceleration").base(freq, ["X"])
    pattern = look.sensors([0])
    twice = np.repeat(pattern.H, 3, axis=1)
    seen = tuple(channels(["11:X", "11:Y", "11:Z"]))
    base = type(pattern)(freq, twice, seen, ("base",), ("m/s^2",))
    force = type(pattern)(freq, twice * (1 + 0.5j), seen, ("force",), ("N",))
    rng = np.random.default_rng(3)
    y = twice[:, :, 0] * (1 + 0.01 * rng.standard_normal((len(freq), 3)))
    found = compare_loads({"base": base, "force": force}, ODS("run", freq, y.T, seen, "ods"))
    assert found.best is None
    assert "alike" in found.reason
    with pytest.raises(LoadError, match="nothing to compare"):
        compare_loads({"base": base}, ODS("run", freq, y.T, seen, "ods"))


def plate(folder: Path, n: int = 12, side_length: float = 1.0, h: float = 0.01) -> Model:
    """A square plate on simple supports."""
    lines, ids = [f"MAT1,1,{E_STEEL},,0.3,{RHO}", f"PSHELL,1,1,{h},1,,1", "PARAM,COUPMASS,1"], {}
    for j in range(n + 1):
        for i in range(n + 1):
            ids[i, j] = 1 + i + (n + 1) * j
            lines.append(f"GRID,{ids[i, j]},,{side_length * i / n},{side_length * j / n},0.")
            if i in (0, n) or j in (0, n):
                lines.append(f"SPC1,1,123,{ids[i, j]}")
    lines += ["SPC1,1,126," + str(v) for v in ids.values() if v not in (1,)]
    for j in range(n):
        for i in range(n):
            corner = ",".join(str(ids[p]) for p in ((i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)))
            lines.append(f"CQUAD4,{1 + i + n * j},1,{corner}")
    return written(folder, lines)


def test_a_plate_under_uniform_and_sloping_pressure(tmp_path: Path) -> None:
    """w = 0.00406 p a^4 / D in the middle (Timoshenko and Woinowsky-Krieger, table 8); a slope adds nothing there."""
    model = plate(tmp_path)
    look = side(model, ["85:Z"], 100.0, 0.01, "displacement")
    patterns = polynomial_patterns(surface_of(model, model.node_ids), 1)
    assert patterns.names[0] == "uniform"
    H = look.pressures(np.array([0.01]), patterns).H[0, 0].real
    D = E_STEEL * 0.01**3 / (12 * (1 - 0.09))
    assert H[0] == pytest.approx(0.00406 / D, rel=0.01)
    assert np.abs(H[1:]).max() < 1e-6 * H[0]


@pytest.mark.parametrize("thickness", [0.01, 0.0101])
def test_pressure_amplitudes_and_number_of_patterns(tmp_path: Path, thickness: float) -> None:
    """A pressure p (1 + 0.6 x) on a finer plate, 1 % thicker, comes back; where the plate is right no more patterns
    than it takes are asked for."""
    (tmp_path / "fine").mkdir()
    fine, coarse = plate(tmp_path / "fine", 30, 1.0, thickness), plate(tmp_path, 20)
    places = [(2, 2), (8, 2), (5, 5), (2, 8), (8, 8), (5, 2), (2, 5), (8, 5), (5, 8), (3, 4), (7, 6)]
    freq, rng = np.linspace(10.0, 180.0, 60), np.random.default_rng(4)
    real = side(fine, [f"{1 + 3 * i + 31 * 3 * j}:Z" for i, j in places], 200.0, 0.012)
    surface = surface_of(fine, fine.node_ids)
    x = fine.xyz[surface.at][:, 0]
    p = nodal_loads(surface, (1 + 0.6 * (2 * x - 1))[:, None])
    y = real.patterns(freq, p, ("p",), ("Pa",)).H[:, :, 0] * 50.0
    sd = 0.01 * np.sqrt((np.abs(y) ** 2).mean(axis=1, keepdims=True)) * np.ones(y.shape)
    y = y + sd / np.sqrt(2) * (rng.standard_normal(y.shape) + 1j * rng.standard_normal(y.shape))
    names = [f"{1 + 2 * i + 21 * 2 * j}:Z" for i, j in places]
    look = side(coarse, names, 200.0, 0.012)
    shapes = ODS("run", freq, y.T, tuple(channels(names)), "ods", sigma=sd.T)
    on = surface_of(coarse, coarse.node_ids)
    linear = polynomial_patterns(on, 1)
    found = identify_loads(look.pressures(freq, linear), shapes, model_error=0.02)
    good = found.reliable
    assert good.sum() > 15
    slope = {name: found.values[:, j] for j, name in enumerate(linear.names)}
    assert np.median(np.abs(slope["uniform"][good])) == pytest.approx(50.0, rel=0.05)
    steep = max(np.median(np.abs(slope[n][good])) for n in linear.names[1:])
    assert steep == pytest.approx(30.0, rel=0.1)
    if thickness != 0.01:  # the structure is wrong, and more patterns make up for it
        return
    rivals = {f"degree {d}": look.pressures(freq, polynomial_patterns(on, d)) for d in (0, 1, 2)}
    said = compare_loads(rivals, shapes)
    print([(r.name, r.unseen, r.log_evidence) for r in said.rivals], said.reason)
    assert max(said.rivals, key=lambda r: r.log_evidence).name == "degree 1"
    assert said.rivals[-1].name == "degree 0"


BOX = [(x, y, z) for z in (0.0, 1.0) for y in (0.0, 1.0) for x in (0.0, 1.0)]


def solid(folder: Path, quadratic: bool) -> Model:
    """A distorted hexahedron, with or without nodes in the middle of its edges."""
    corner = [BOX[i] for i in (0, 1, 3, 2, 4, 5, 7, 6)]
    corner = [(1.3 * x + 0.2 * z, y + 0.1 * x * y, 0.8 * z + 0.15 * x) for x, y, z in corner]
    edges = [(0, 1), (1, 2), (2, 3), (3, 0), (0, 4), (1, 5), (2, 6), (3, 7), (4, 5), (5, 6), (6, 7), (7, 4)]
    points = corner + [tuple((np.array(corner[a]) + corner[b]) / 2) for a, b in edges] * quadratic
    lines = [f"GRID,{i + 1},," + ",".join(f"{v:.6f}" for v in p) for i, p in enumerate(points)]
    ids = [str(i + 1) for i in range(len(points))]
    lines += [f"MAT1,1,{E_STEEL},,0.3,{RHO}", "PSOLID,1,1", "CHEXA,1,1," + ",".join(ids[:6])]
    lines += ["+," + ",".join(ids[i : i + 8]) for i in range(6, len(ids), 8)]
    return written(folder, [*lines, "SPC1,1,123,1", "SPC1,1,23,2", "SPC1,1,3,4"])


@pytest.mark.parametrize("quadratic", [False, True])
def test_pressure_all_around_a_solid_is_in_balance(tmp_path: Path, quadratic: bool) -> None:
    """Divergence theorem: no resultant under uniform pressure, minus the volume per unit slope, along that slope."""
    model = solid(tmp_path, quadratic)
    surface = surface_of(model, model.node_ids)
    assert len(surface.faces) == 6
    F = nodal_loads(surface, np.column_stack([np.ones(len(surface.at)), model.xyz[surface.at]]))
    total = F.reshape(-1, 6, 4)[:, :3].sum(axis=0)
    moment = np.cross(model.xyz, F.reshape(-1, 6, 4)[:, :3, 0]).sum(axis=0)
    assert np.abs(total[:, 0]).max() < 1e-12
    assert np.abs(moment).max() < 1e-12
    volume = -total[:, 1:]
    assert np.allclose(volume, volume[0, 0] * np.eye(3), atol=1e-12)
    # the volume of the mapped box by its Jacobian: 1.3 * 0.8 - 0.2 * 0.15 times (1 + 0.1 x), integrated
    assert volume[0, 0] == pytest.approx((1.3 * 0.8 - 0.2 * 0.15) * 1.05, rel=1e-6)


def test_faces_of_quadratic_wedges_and_tetrahedra_are_in_balance(tmp_path: Path) -> None:
    """As above, each with its middle nodes; volumes 1/2 and 1/6."""
    for card, corners, edges, volume in (
        ("CTETRA", [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], "01 12 20 03 13 23", 1 / 6),
        ("CPENTA", [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (0, 1, 1)],
         "01 12 20 03 14 25 34 45 53", 1 / 2),
    ):  # fmt: skip
        c = np.array(corners, dtype=float)
        points = [*c, *((c[int(e[0])] + c[int(e[1])]) / 2 for e in edges.split())]
        lines = [f"GRID,{i + 1},,{p[0]},{p[1]},{p[2]}" for i, p in enumerate(points)]
        ids = [str(i + 1) for i in range(len(points))]
        lines += [f"MAT1,1,{E_STEEL},,0.3,{RHO}", "PSOLID,1,1", f"{card},1,1," + ",".join(ids[:6])]
        lines += ["+," + ",".join(ids[i : i + 8]) for i in range(6, len(ids), 8)]
        model = written(tmp_path, [*lines, "SPC1,1,123,1", "SPC1,1,23,2", "SPC1,1,3,3"])
        surface = surface_of(model, model.node_ids)
        assert {len(f) for f in surface.faces} == ({6} if card == "CTETRA" else {6, 8})
        F = nodal_loads(surface, np.column_stack([np.ones(len(surface.at)), model.xyz[surface.at]]))
        total = F.reshape(-1, 6, 4)[:, :3].sum(axis=0)
        assert np.abs(total[:, 0]).max() < 1e-12
        assert np.allclose(-total[:, 1:], volume * np.eye(3), atol=1e-12)


def test_a_face_in_common_is_no_surface(tmp_path: Path) -> None:
    """Two tetrahedra on one triangle: six free faces of eight."""
    points = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (0, 0, -1)]
    lines = [f"GRID,{i + 1},,{x}.,{y}.,{z}." for i, (x, y, z) in enumerate(points)]
    lines += [f"MAT1,1,{E_STEEL},,0.3,{RHO}", "PSOLID,1,1", "CTETRA,1,1,1,2,3,4", "CTETRA,2,1,1,3,2,5"]
    model = written(tmp_path, [*lines, "SPC1,1,123,1", "SPC1,1,23,2", "SPC1,1,3,3"])
    surface = surface_of(model, model.node_ids)
    assert len(surface.faces) == 6
    F = nodal_loads(surface, np.ones((len(surface.at), 1))).reshape(-1, 6)[:, :3]
    assert np.abs(F.sum(axis=0)).max() < 1e-12
    with pytest.raises(ModelError, match="no shell and no free face"):
        surface_of(model, [1, 2, 3])


def test_patterns_of_modes_push_along_the_normal(tmp_path: Path) -> None:
    model = plate(tmp_path, 6)
    surface = surface_of(model, model.node_ids)
    phi = np.zeros((6 * len(model.node_ids), 3))
    x = model.xyz
    phi[2::6, 0] = np.sin(np.pi * x[:, 0]) * np.sin(np.pi * x[:, 1])
    phi[0::6, 1] = 1.0  # in the plane: no pressure
    phi[2::6, 2] = -3 * phi[2::6, 0]  # the same shape again
    patterns = modal_patterns(surface, phi)
    assert patterns.names == ("pressure of mode 1",)
    assert np.allclose(patterns.values[:, 0], phi[2::6, 0], atol=1e-12)
    with pytest.raises(ModelError, match="must be"):
        modal_patterns(surface, phi[:5])
    with pytest.raises(ModelError, match="degree -1"):
        polynomial_patterns(surface, -1)
