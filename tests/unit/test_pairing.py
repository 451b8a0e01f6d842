"""Sensors find their nodes, or say how far they are from any."""

from __future__ import annotations

import numpy as np
import pytest

from femend import Channel, Dof, pair_sensors
from femend.errors import PairingError

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


def test_far_from_every_node() -> None:
    with pytest.raises(
        PairingError,
        match=r"sensor 7:\+Z at \(1.0, 0.9, 0.0\) is 0.1 from the nearest node 30; the tolerance is 0.02828 \(2 % of",
    ):
        pair_sensors([Dof(7, 3)], IDS, XYZ, sensor_xyz={7: (1.0, 0.9, 0.0)})
    assert len(pair_sensors([Dof(7, 3)], IDS, XYZ, sensor_xyz={7: (1.0, 0.9, 0.0)}, tolerance=0.1)) == 1


def test_unknown_node_without_coordinates() -> None:
    with pytest.raises(
        PairingError, match=r"sensor 7:\+Z: node 7 is not among the 4 nodes of the model \(ids 10 to 40"
    ):
        pair_sensors([Dof(7, 3)], IDS, XYZ)


def test_an_id_that_means_another_place() -> None:
    """The test numbered its points by itself: its node 10 lies at the model's node 30."""
    (pair,) = pair_sensors([Dof(10, 3)], IDS, XYZ, sensor_xyz={10: (1.0, 1.0, 0.0)})
    assert (pair.dof.node, pair.by) == (30, "nearest")


def test_an_id_is_believed_where_the_test_frame_fits_nowhere() -> None:
    (pair,) = pair_sensors([Dof(10, 3)], IDS, XYZ, sensor_xyz={10: (50.0, 0.0, 0.0)})
    assert (pair.dof.node, pair.by, pair.distance) == (10, "id", 50.0)


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
