"""Test geometries on models: what is left where it is, what is moved, what is told and what is refused."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from femend import Channel, Dof, Recording, TimeData, correlate_study, model_modes, read_model, update_study
from femend.bench.reading.placed import Placed, placed_sensors
from femend.correlate import align_points
from femend.data import Geometry, Test
from femend.errors import PairingError
from femend.estimate import pair_test

sys.path.insert(0, str(Path(__file__).parents[1]))
from bench_study import Recorded, study_text, write_modes

FloatArray = NDArray[np.float64]
FIRST = 901
NO_ELEMENTS = SimpleNamespace(elements=list)
AXES = np.array([[0, 0, 1], [1, 0, 0], [0, 1, 0.0]])  # test X is model Y, test Y is model Z


def grid(*axes: FloatArray) -> FloatArray:
    return np.array(np.meshgrid(*axes, indexing="ij")).reshape(len(axes), -1).T


PLATE = np.column_stack([grid(np.arange(0.0, 601, 25), np.arange(0.0, 401, 25)), np.zeros(25 * 17)])
# everywhere on its edges, and symmetric
CORNERS = np.array([(x, y, 0.0) for x in (0, 100, 500, 600) for y in (0, 150, 250, 400)])
# a tower whose storeys are alike
TOWER = grid(np.array([0.0, 2.0]), np.array([0.0, 1.5]), np.arange(0, 3.1, 0.25))


def measured(at: FloatArray, name: str = "modes", first: int = FIRST, unit: float | None = None) -> Any:
    ids = first + np.arange(len(at))
    return SimpleNamespace(name=name, dofs=tuple(Dof(int(n), 3) for n in ids), geometry=Geometry(ids, at, None, unit))


def model_at(xyz: FloatArray, units: str = "mm-t-s") -> Any:
    n = len(xyz)
    return SimpleNamespace(
        is_scalar=np.zeros(n, dtype=bool), node_ids=np.arange(1, n + 1), xyz=xyz, units=units, fe=NO_ELEMENTS
    )


def found_at(placed: Placed, model: Any) -> FloatArray:
    return np.array([model.xyz[p.dof.node - 1] for p in placed.pairing])


@pytest.mark.parametrize("seed", range(4))
def test_coordinates_that_lie_on_nodes_are_left_there_though_they_fit_elsewhere(seed: int) -> None:
    rng = np.random.default_rng(seed)
    bracket = np.vstack(
        [
            grid(np.arange(0.0, 81, 4), np.arange(0.0, 61, 5), np.arange(0.0, 9, 4)),
            grid(np.arange(0.0, 9, 4), np.arange(0.0, 61, 5), np.arange(12.0, 105, 4)),
            [(-25.0, 30.0, 112.0)],
        ]
    )
    for points in (TOWER, PLATE, bracket):
        model = model_at(points)
        at = points[rng.choice(len(points), 8, replace=False)]
        for noise in (0.0, 0.05 * 0.25):  # of the tower's pitch, which is the finest
            placed = placed_sensors([measured(at + noise * rng.uniform(-1, 1, at.shape))], model)
            assert not placed.applied
            assert not any("test geometry" in w for w in placed.warnings)
            np.testing.assert_array_equal(found_at(placed, model), at)


def test_sensors_on_two_storeys_are_not_moved_down_a_storey() -> None:
    at = TOWER[np.isin(TOWER[:, 2], (2.0, 3.0))]
    placed = placed_sensors([measured(at)], model_at(TOWER))
    assert not placed.applied
    np.testing.assert_array_equal(found_at(placed, model_at(TOWER)), at)


def test_coordinates_by_hand_stay_where_no_turn_is_clearly_better() -> None:
    rng = np.random.default_rng(2)
    fine = np.column_stack([grid(np.arange(0.0, 601, 10), np.arange(0.0, 401, 10)), np.zeros(61 * 41)])
    at = CORNERS + np.column_stack([rng.uniform(-4, 4, (16, 2)), np.zeros(16)])
    assert align_points(at, fine).notes == ()
    np.testing.assert_array_equal(align_points(at, fine).R, np.eye(3))


def test_of_turns_that_fit_as_well_none_is_preferred_and_that_is_told() -> None:
    model = model_at(PLATE)
    placed = placed_sensors([measured(CORNERS + np.array([120.0, -40.0, 10.0]))], model)
    assert placed.applied
    np.testing.assert_array_equal(found_at(placed, model), CORNERS)
    told = " ".join(placed.warnings)
    assert "3 other turns or shifts fit as well (test Y is model -Y, test Z is model -Z, shifted by" in told
    assert "the one nearest to the frame as it is was taken" in told
    assert "shifted by (-120, 40, -10) after it" in told
    # the unit alone
    placed = placed_sensors([measured(1e3 * CORNERS)], model)
    np.testing.assert_array_equal(found_at(placed, model), CORNERS)
    told = " ".join(placed.warnings)
    assert "scale 0.001: its coordinates are in mm but were read as m, as the file states no unit" in told
    assert "applied to the sensors' places and directions; [correlation]" in told
    # a turn that is needed: that with the least shift
    placed = placed_sensors([measured((CORNERS + np.array([10.0, 20.0, -40.0])) @ AXES)], model)
    np.testing.assert_array_equal(found_at(placed, model), CORNERS)
    assert "test X is model Y" in " ".join(placed.warnings)
    # where coordinates already fit nothing is to be decided
    assert not any("turns" in w for w in placed_sensors([measured(CORNERS)], model).warnings)


def test_places_that_slide_along_the_mesh_are_refused_with_what_helps() -> None:
    at = CORNERS[CORNERS[:, 1] < 300]
    with pytest.raises(PairingError, match="recording 'modes': sensor 90") as found:
        placed_sensors([measured((at + np.array([10.0, 20.0, -40.0])) @ AXES)], model_at(PLATE))
    told = str(found.value)
    assert "turns and shifts fit alike (test X is model Y" in told
    assert "the mesh is regular, and it is left as it is; write the test's coordinates in the axes and from the" in told
    assert "off the symmetry" not in told
    assert "mate" not in told


def test_the_unit_that_the_file_states_is_kept_where_it_fits() -> None:
    rng = np.random.default_rng(5)
    cloud = rng.uniform(0, 100, (300, 3))
    at = cloud[:10] + np.array([500.0, 0.0, 0.0])
    placed = placed_sensors([measured(at, unit=1e-3)], model_at(cloud))
    assert placed.applied
    assert placed.alignment is not None
    assert placed.alignment.scale == 1.0
    wrong = placed_sensors([measured(1e3 * cloud[:10], unit=1.0)], model_at(cloud))
    assert any("in mm but were read as m, as data set 164 states" in w for w in wrong.warnings)


def test_a_sensor_that_stands_off_is_told_in_the_models_unit() -> None:
    """In mm, read as m: places of 12 sensors are off the mesh by up to 0.4 of it, as if they had been read in m; one
    that is 60 mm beside the plate is told so, not as 5e5 mm from it."""
    rng = np.random.default_rng(2)
    places = np.vstack([CORNERS[:12], [(600.0, 200.0, 0.0)]])
    spread = places + np.array([10.0, 10.0, 0.0]) * rng.uniform(-1, 1, places.shape)
    in_mm = placed_sensors([measured(1e3 * spread)], model_at(PLATE))
    np.testing.assert_array_equal(
        found_at(in_mm, model_at(PLATE)), found_at(placed_sensors([measured(spread)], model_at(PLATE)), model_at(PLATE))
    )
    off = np.vstack([CORNERS[:12], [(660.0, 200.0, 0.0)]])
    with pytest.raises(PairingError) as error:
        placed_sensors([measured(1e3 * off, "hammer")], model_at(PLATE))
    said = "recording 'hammer': sensor 913:+Z at (660.0, 200.0, 0.0) is 60 from the nearest node 417; the tolerance"
    assert str(error.value).startswith(said)
    assert "its coordinates are in mm but were read as m" in str(error.value)


def test_sensors_between_nodes_in_another_unit_are_scaled_by_the_unit_alone(tmp_path: Path) -> None:
    """Brought onto nodes they were scaled by 2 % and moved by 17 mm."""
    lines = ["BEGIN BULK", "MAT1,1,7.+10,,0.3,2700.", "PSHELL,1,1,.002,1"]
    for j, i in np.ndindex(9, 13):
        lines.append(f"GRID,{1 + i + 13 * j},,{0.05 * i:.2f},{0.05 * j:.2f},0.")
    for j, i in np.ndindex(8, 12):
        n = 1 + i + 13 * j
        lines.append(f"CQUAD4,{n},1,{n},{n + 1},{n + 14},{n + 13}")
    (tmp_path / "plate.bdf").write_text("\n".join([*lines, "ENDDATA", ""]))
    model = read_model(tmp_path / "plate.bdf")
    at = np.array([(x, y, 0.0) for x in (0.09, 0.21, 0.33, 0.46, 0.53) for y in (0.06, 0.17, 0.27, 0.35)])
    for turn in (np.eye(3), AXES):
        placed = placed_sensors([measured(1e3 * at @ turn)], model)
        assert placed.applied
        assert placed.alignment is not None
        np.testing.assert_allclose(placed.alignment.xyz, at, atol=1e-12)
        assert len(placed.points) == len(at)
        assert "in mm but were read as m, as the file states no unit" in placed.warnings[0]
        assert not any("shift" in w for w in placed.warnings)


def test_what_does_not_fit_is_told_in_one_clause() -> None:
    rng = np.random.default_rng(0)
    with pytest.raises(
        PairingError, match=r"no one unit, turn of axes and shift brings it onto the model; \d+ of its"
    ) as found:
        placed_sensors([measured(rng.uniform(0, 5000, (20, 3)))], model_at(PLATE))
    assert str(found.value).count("; test geometry: ") == 1


def test_a_frame_along_no_axes_is_told_with_what_to_do() -> None:
    turn = np.deg2rad(30)
    R = np.array([[np.cos(turn), np.sin(turn), 0], [-np.sin(turn), np.cos(turn), 0], [0, 0, 1]])
    placed = placed_sensors([measured(PLATE[::40] @ R.T, first=1)], model_at(PLATE[::40]))
    assert not placed.applied
    told = (
        "turned by 30.0 degrees about an axis of its own: its sensors look along no axes of the model, and are compared"
    )
    assert told in placed.warnings[0]


def test_recordings_in_frames_of_their_own_are_placed_one_by_one() -> None:
    model = model_at(PLATE)
    turned = measured((CORNERS + np.array([10.0, 20.0, -40.0])) @ AXES, "turned")
    placed = placed_sensors([measured(CORNERS, "as is", 701), turned], model)
    assert placed.applied
    np.testing.assert_array_equal(found_at(placed, model), np.vstack([CORNERS, CORNERS]))
    assert any(w.startswith("recording 'turned': test geometry: test X is model Y") for w in placed.warnings)


FRAME = """\
SOL 103
CEND
SPC = 1
BEGIN BULK
CORD2R,7,0,0.,0.,0.,0.,0.,1.
,0.8,0.6,0.
GRID,1,,0.,0.,0.
GRID,2,,1.,0.,0.,7
GRID,3,,2.,0.,0.,7
GRID,4,,1.,1.,0.
CBAR,1,1,1,2,0.,0.,1.
CBAR,2,1,2,3,0.,0.,1.
CBAR,3,2,2,4,0.,0.,1.
PBAR,1,1,1.-3,1.-6,2.-6,1.-6
PBAR,2,2,1.-3,1.-6,2.-6,1.-6
MAT1,2,2.+11,,.3,7800.
MAT1,1,2.+11,,.3,7800.
SPC1,1,123456,1
ENDDATA
"""


def test_directions_at_nodes_with_displacement_systems_are_told(tmp_path: Path) -> None:
    (tmp_path / "model.bdf").write_text(FRAME)
    (tmp_path / "study.toml").write_text(study_text((Recorded("modes"),), ""))
    model = read_model(tmp_path / "model.bdf")
    modes = model_modes(model, n_modes=3)
    dofs = tuple(Dof(n, c) for n in (2, 3, 4) for c in (1, 2, 3))
    places = {n: tuple(model.xyz[model.index(n)]) for n in (2, 3, 4)}

    def said(phi: np.ndarray, places: dict[int, Any] | None = places) -> list[list[str]]:
        write_modes(tmp_path / "modes.uff", modes.freq, phi, dofs, places=places)
        runs = (correlate_study(tmp_path / "study.toml"), update_study(tmp_path / "study.toml"))
        return [[w for w in run.result["warnings"] if "displacement system" in w] for run in runs]

    # the shapes themselves say that the directions are those of the nodes, and that they are basic ones
    own = modes.phi[[modes.dofs.index(d) for d in dofs]]
    assert said(own) == [[], []]
    basic = own.copy()
    for first, node in ((0, 2), (3, 3)):
        basic[first : first + 3] = model.frames[model.index(node)].T @ own[first : first + 3]
    for told in said(basic):
        assert re.match(
            r"sensors at node 2, 3 were recorded in basic axes, .* MAC is 0\.\d+ so and 1 in basic axes", told[0]
        )
        assert len(told) == 1
    # a file without a geometry states no system: the shapes say it all the same
    assert said(basic, None) == said(basic)
    assert said(own, None) == [[], []]
    # two of three modes that the model has not (rad/s) suit neither, which says nothing of axes
    write_modes(tmp_path / "modes.uff", modes.freq * [2 * np.pi, 2 * np.pi, 1.0], basic, dofs)
    warnings = correlate_study(tmp_path / "study.toml").result["warnings"]
    assert not any("were recorded in basic axes" in w for w in warnings)
    # motion along Z, and at the node that has no system, suits both alike
    alike = own.copy()
    alike[[0, 1, 3, 4]] = 0.0
    for told in said(alike):
        assert [w[:60] for w in told] == ["sensor node 2 has displacement system 7 (CD) in the model wh"]
    # so does what a diagnosis pairs; nothing is said where the file states the node's own system
    channels = tuple(Channel(d, "acceleration", "m/s^2") for d in dofs)
    for systems, n in ((np.zeros(3), 1), (np.array([7, 7, 0]), 0)):
        geometry = Geometry(np.array([2, 3, 4]), np.array(list(places.values())), systems.astype(np.int64))
        recording = Recording(
            "r", TimeData("r", 0.01, np.ones((9, 50)), channels), excitation="unknown", geometry=geometry
        )
        assert len(pair_test(Test((recording,)), model).warnings) == n
