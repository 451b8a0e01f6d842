"""Sensors find their nodes, or say how far they are from any."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import ClassVar

import numpy as np
import pytest

from femend import Channel, Dof, Recording, TimeData, functions_of, pair_sensors, write_uff
from femend.data import Test
from femend.errors import PairingError
from femend.estimate import pair_test
from femend.io import UniversalFile
from femend.io.uff.geometry import Nodes
from femend.model.cards.near_ids import near_ids
from femend.progress import SilentProgress
from femend.study.run import diagnose

sys.path.insert(0, str(Path(__file__).parents[1]))
import small_study

IDS = [10, 20, 30, 40]
XYZ = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], dtype=float)  # diagonal 1.414, reach 0.0283


def test_by_id() -> None:
    sensors = [Dof(20, 3, -1), Channel(Dof(10, 1), "force", "N"), Channel(None, "tacho", "V"), Dof(20, 3, -1)]
    pairing = pair_sensors(sensors, IDS, XYZ)
    assert [(str(p.sensor), str(p.dof), p.distance, p.by) for p in pairing] == [
        ("20:-Z", "20:-Z", 0.0, "id"),
        ("10:+X", "10:+X", 0.0, "id"),
    ]
    assert pairing.notes == ()
    assert pairing["20:-Z"].dof == Dof(20, 3, -1)
    with pytest.raises(KeyError, match=r"no sensor 30:\+X is paired"):
        pairing["30:X"]


def test_nearest_node_within_the_tolerance_is_reported() -> None:
    pairing = pair_sensors([Dof(7, 2, -1)], IDS, XYZ, sensor_xyz={7: (1.0, 0.98, 0.0)})
    (pair,) = pairing
    assert (str(pair.dof), pair.by) == ("30:-Y", "nearest")
    assert pair.distance == pytest.approx(0.02)
    assert pairing.notes == ("sensor 7:-Y is paired with node 30, 0.02 away",)


def test_many_sensors_by_place_are_told_in_one_sentence_without_round_off() -> None:
    sensors = [Dof(n, c) for n in (1, 2, 3, 40) for c in (1, 3)]
    places = {1: (0, 0, 5e-14), 2: (1, 2e-6, 0), 3: (1, 1, 0), 40: (1, 1, 0)}
    (told,) = pair_sensors(sensors, IDS, XYZ, sensor_xyz=places).notes
    assert told == (
        "sensors at 4 test nodes are paired with the nearest nodes of the model: 1 with 10, 2 with 20, 3 with 30, 40 "
        "with 30, each at its place; nodes of these numbers are in the model, but elsewhere: 40 by 1"
    )
    (told,) = pair_sensors(sensors[:6], IDS, XYZ, sensor_xyz={**places, 2: (1, 0.01, 0)}).notes
    assert told.endswith("2 with 20, 3 with 30; 2 is the farthest, 0.01 away")


def test_far_from_every_node() -> None:
    with pytest.raises(
        PairingError,
        match=r"sensor 7:\+Z at \(1.0, 0.9, 0.0\) is 0.1 from the nearest node 30; the tolerance is 0.02828 \(2 % of",
    ):
        pair_sensors([Dof(7, 3)], IDS, XYZ, sensor_xyz={7: (1.0, 0.9, 0.0)})
    assert len(pair_sensors([Dof(7, 3)], IDS, XYZ, sensor_xyz={7: (1.0, 0.9, 0.0)}, tolerance=0.1)) == 1


def test_unknown_node_without_coordinates() -> None:
    with pytest.raises(
        PairingError,
        match=r"sensor 7:\+Z: node 7 is not among the 4 nodes of the model \(ids 10 to 40; nearest id 10\)",
    ):
        pair_sensors([Dof(7, 3)], IDS, XYZ)


def test_an_id_that_means_another_place() -> None:
    """The test numbered its points by itself: its node 10 lies at the model's node 30."""
    (pair,) = pair_sensors([Dof(10, 3)], IDS, XYZ, sensor_xyz={10: (1.0, 1.0, 0.0)})
    assert (pair.dof.node, pair.by) == (30, "nearest")


def test_an_id_is_believed_where_the_test_frame_fits_nowhere_and_that_is_told() -> None:
    sensors, places = (
        [Dof(10, 3), Dof(10, 1), Dof(20, 3), Dof(30, 3)],
        {10: (50.0, 0, 0), 20: (1.0, 0, 0), 30: (1, 1, 0.8)},
    )
    pairing = pair_sensors(sensors, IDS, XYZ, sensor_xyz=places)
    pair = pairing["10:+Z"]
    assert (pair.dof.node, pair.by, pair.distance) == (10, "id", 50.0)
    (told,) = pairing.warnings
    assert told.startswith(
        "sensors are paired with the model's nodes of their numbers though the test's coordinates lie"
    )
    assert "elsewhere: node 10 by 50, node 30 by 0.8 (the tolerance is 0.02828, 2 % of the model's diagonal)" in told
    assert told in repr(pairing)
    # who says how near a node has to be means it
    with pytest.raises(PairingError, match=r"elsewhere: node 10 by 50 \(the tolerance is 0.07071, 5 % of"):
        pair_sensors(sensors, IDS, XYZ, sensor_xyz=places, tolerance=0.05)


def test_a_pair_by_place_tells_where_the_node_of_its_number_is() -> None:
    pairing = pair_sensors([Dof(10, 3)], IDS, XYZ, sensor_xyz={10: (1.0, 1.0, 0.0)})
    assert pairing.notes == (
        "sensor 10:+Z is paired with node 30 at its place, since node 10 of the model lies 1.414 away",
    )


@pytest.mark.parametrize(
    ("wanted", "named"),
    [
        (9107, "nearest ids 107, 403"),
        (170, "nearest ids 107, 403"),
        (500, "nearest id 403"),
        (3, "nearest id 101"),
    ],
)
def test_the_nearest_ids_are_those_of_a_slip_of_the_keyboard_and_the_neighbours(wanted: int, named: str) -> None:
    assert near_ids(wanted, [101, 105, 107, 403]) == named


def test_a_diagnosis_tells_at_once_that_coordinates_contradict_numbers(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    channels = (Channel(Dof(13, 3), "force", "N"), Channel(Dof(13, 3), "acceleration", "m/s^2"))
    values = np.random.default_rng(1).standard_normal((2, 400))
    path = small_study.write_unrecorded(tmp_path, "")
    path.write_text(small_study.study_text({"high": "fit"}))
    far = Nodes(np.array([13]), np.array([[0.0, 0.8, 5.0]]), np.zeros((1, 2), dtype=np.int64))
    file = UniversalFile("", tuple(functions_of(TimeData("high", 0.01, values, channels))), (far,))
    write_uff(tmp_path / "high.uff", file)

    class Told(SilentProgress):
        said: ClassVar[list[str]] = []

        def say(self, text: str) -> None:
            self.said.append(text)

    def stop(*_: object) -> None:
        raise PairingError("enough")

    monkeypatch.setattr("femend.study.run.fit_records", stop)
    with pytest.raises(PairingError, match="enough"):
        diagnose(path, progress=Told())
    assert any("coordinates lie elsewhere: node 13 by" in text for text in Told.said)


def test_a_sensor_without_a_node_is_told_with_its_recording_and_channel(tmp_path: Path) -> None:
    model, _ = small_study.cantilever(tmp_path)
    channels = (Channel(Dof(13, 3), "force", "N"), Channel(Dof(77, 3), "acceleration", "m/s^2", name="tip"))
    test = Test((Recording("high", TimeData("high", 0.01, np.ones((2, 50)), channels)),))
    with pytest.raises(
        PairingError, match=r"^recording 'high', channel 'tip': sensor 77:\+Z: node 77 is not among the 1"
    ):
        pair_test(test, model)


def test_renumbering_the_model_leaves_places_alone() -> None:
    rng = np.random.default_rng(6)
    points = rng.standard_normal((50, 3))
    places = {100 + i: points[i] + 1e-3 for i in range(50)}
    sensors = [Dof(n, 1) for n in places]
    order = rng.permutation(50)
    for ids, xyz in ((np.arange(50), points), (np.arange(50), points[order])):
        pairing = pair_sensors(sensors, ids, xyz, sensor_xyz=places)
        found = [xyz[list(ids).index(p.dof.node)] for p in pairing]
        np.testing.assert_array_equal(found, points)


def test_model_without_nodes() -> None:
    with pytest.raises(PairingError, match="no nodes to pair with"):
        pair_sensors([Dof(1, 1)], [], np.zeros((0, 3)))
