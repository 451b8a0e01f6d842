"""Sensors between nodes: on shells, on the surface of solids and along bars."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from femend import Dof, correlate_study, model_modes, read_model, update_study
from femend.bench import CorrelationRun
from femend.data import IdentifiedModes
from femend.io import UniversalFile
from femend.io.uff import modes_55, write_uff
from femend.io.uff.geometry import Nodes
from femend.model import Model
from femend.model.sensor_point import SensorPoint
from femend.model.surfaces.sensor_points import sensor_points

Array = NDArray[np.float64]
LENGTH, WIDTH = 0.6, 0.4


def plate(n: int, m: int, E: float = 7e10, skew: float = 0.0) -> str:
    """A plate of n x m quadrilaterals, clamped along its short side at X = 0; `skew` shifts its nodes along Y."""
    lines = ["SOL 103", "CEND", "BEGIN BULK", f"MAT1,1,{E:.4e},,0.33,2700.", "PSHELL,1,1,5.-3,1,,1"]
    node = np.arange(1, (n + 1) * (m + 1) + 1).reshape(n + 1, m + 1)
    for i in range(n + 1):
        for j in range(m + 1):
            x, y = LENGTH * i / n, WIDTH * j / m + skew * np.sin(3.0 * i + j)
            lines.append(f"GRID,{node[i, j]},,{x:.6f},{y:.6f},0.")
            if i == 0:
                lines.append(f"SPC1,1,123456,{node[i, j]}")
    for e, (i, j) in enumerate(np.ndindex(n, m), start=1):
        a, b, c, d = node[i, j], node[i + 1, j], node[i + 1, j + 1], node[i, j + 1]
        lines.append(f"CQUAD4,{e},1,{a},{b},{c},{d}")
    return "\n".join([*lines[:1], *lines[1:2], "SPC = 1", *lines[2:], "ENDDATA", ""])


def beam(n: int) -> str:
    """A cantilever of n bars along X."""
    lines = ["SOL 103", "CEND", "SPC = 1", "BEGIN BULK", "MAT1,1,7.+10,,0.33,2700.", "PBAR,1,1,4.-4,3.-9,9.-9,6.-9"]
    lines += [f"GRID,{i + 1},,{LENGTH * i / n:.6f},0.,0." for i in range(n + 1)]
    lines += [f"CBAR,{i},1,{i},{i + 1},0.,1.,0." for i in range(1, n + 1)]
    return "\n".join([*lines, "SPC1,1,123456,1", "ENDDATA", ""])


def read(folder: Path, text: str) -> Model:
    (folder / "deck.bdf").write_text(text)
    return read_model(folder / "deck.bdf")


def at(model: Model, *places: tuple[float, float, float], reach: float = 0.02) -> list[SensorPoint]:
    found = sensor_points(model, dict(enumerate(map(np.array, places))), reach=reach, at_node=1e-6, first=1000)
    return [found[i] for i in range(len(places))]


def test_a_point_moves_with_a_rigid_body(tmp_path: Path) -> None:
    """On a skewed shell, off it, and along a bar and beside it, as translation and rotation of the whole say."""
    for text, place in ((plate(4, 3, skew=0.01), (0.21, 0.17, 0.012)), (beam(4), (0.2, 0.0, 0.015))):
        model = read(tmp_path, text)
        (point,) = at(model, place)
        move, turn = np.array([0.3, -0.2, 0.5]), np.array([0.1, 0.4, -0.3])
        u = np.hstack([move + np.cross(turn, model.xyz), np.tile(turn, (len(model.xyz), 1))]).ravel()
        np.testing.assert_allclose(point.weights @ u[point.rows], move + np.cross(turn, place), atol=1e-12)
        assert point.distance == pytest.approx(place[2])


def test_at_a_node_it_is_the_node(tmp_path: Path) -> None:
    model = read(tmp_path, plate(4, 3))
    near = model.xyz[6] + np.array([1e-5, 1e-5, 0.0])
    (point,) = at(model, tuple(near))
    expected = np.zeros((3, model.fe.n_g))
    expected[:, 36:39] = np.eye(3)
    seen = np.zeros_like(expected)
    seen[:, point.rows] = point.weights
    np.testing.assert_allclose(seen, expected, atol=2e-4)
    assert point.node == model.node_ids[6]


def test_what_is_far_from_all_elements_has_no_point(tmp_path: Path) -> None:
    model = read(tmp_path, plate(4, 3))
    assert sensor_points(model, {7: np.array([0.2, 0.2, 0.1])}, reach=0.02, at_node=1e-6, first=1000) == {}


def test_between_the_nodes_of_bars_it_is_what_bars_cut_in_two_have(tmp_path: Path) -> None:
    """The nearest node's motion is 15 to 60 % of the largest off."""
    coarse, fine = read(tmp_path, beam(6)), read(tmp_path, beam(12))
    x = [(k + 0.5) * LENGTH / 6 for k in range(6)]
    points = at(coarse, *((v, 0.0, 0.0) for v in x))
    for mode in range(3):
        a, b = (model_modes(m, n_modes=8) for m in (coarse, fine))
        node = {int(n): i for i, n in enumerate(fine.node_ids)}
        own = a.phi.reshape(len(coarse.node_ids), 6, -1).reshape(-1, a.n_modes)
        between = np.array([p.weights[2] @ own[p.rows, mode] for p in points])
        there = b.phi[[6 * node[2 * k + 2] + 2 for k in range(6)], mode]
        nearest = own[[6 * coarse.index(p.node) + 2 for p in points], mode]
        if np.abs(there).max() < 1e-6:
            continue  # a mode in the other plane
        there = there * np.sign(there @ between)
        assert np.abs(between - there).max() < 0.02 * np.abs(there).max()
        assert np.abs(nearest - there).max() > 0.1 * np.abs(there).max()


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> CorrelationRun:
    """A plate of 6 x 4 elements, tested in the middle of elements; the truth is of 24 x 16, its modulus 10 % higher."""
    folder = tmp_path_factory.mktemp("between")
    truth = read(folder, plate(24, 16, 7.7e10))
    modes = model_modes(truth, n_modes=4)
    places = {901 + k: (LENGTH * (i + 0.5) / 6, WIDTH * (j + 0.5) / 4, 0.0)
              for k, (i, j) in enumerate(np.ndindex(6, 4)) if (i + j) % 2 or i == 5}  # fmt: skip
    rows = [6 * int(np.argmin(np.linalg.norm(truth.xyz - p, axis=1))) + 2 for p in places.values()]
    omega = 2 * np.pi * modes.freq
    dofs = tuple(Dof(n, 3) for n in places)
    found = IdentifiedModes(dofs, -0.01 * omega + 1j * omega, modes.phi[rows].astype(complex))
    ids = np.array(list(places))
    nodes = Nodes(ids, np.array(list(places.values())), np.zeros((len(ids), 2), dtype=np.int64))
    write_uff(folder / "test.uff", UniversalFile("test", nodes=(nodes,), modes=tuple(modes_55(found))))
    (folder / "deck.bdf").write_text(plate(6, 4))
    (folder / "study.toml").write_text(
        'format = "femend-study/1"\ntitle = "between"\n[model]\nfile = "deck.bdf"\nunits = "SI"\n'
        '[[parameter]]\nname = "E"\nproperty = "E"\nmaterial = 1\nprior_sd = 0.2\n'
        '[[recording]]\nname = "test"\nfile = "test.uff"\nrole = "fit"\nexcitation = "measured"\n'
    )
    return correlate_study(folder / "study.toml", folder / "out")


def test_sensors_in_the_middle_of_elements_are_there(run: CorrelationRun) -> None:
    """Such a test was refused, as 0.07 from the nearest node."""
    placed = run.prepared.placed
    assert not placed.applied
    assert {p.by for p in placed.pairing} == {"between"}
    assert all(len(p.point.nodes) == 4 for p in placed.pairing if p.point is not None)
    said = " ".join(run.result["warnings"])
    assert "test nodes lie between nodes: 901 " in said or "test nodes lie between nodes: 902 " in said
    assert "their motion is taken there, not at the nearest node" in said
    (compared,) = run.compared
    assert [p.mac for p in compared.comparison.pairing.pairs] == pytest.approx([1.0] * 4, abs=0.004)


def test_an_update_sees_them_there_too(run: CorrelationRun) -> None:
    found = update_study(run.prepared.study.file)
    system = found.problem.configurations[0].system
    assert (np.diff(system.sensors.indptr) > 1).all()
    assert not any(left["off"] for left in found.result["left"] if left["response"] == "shapes")
