"""Places of a frame: which there are, and that a cut is the connection it takes away."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from femend.model import Model, Place, find_places, read_model
from femend.model.places.places import topology


def frame(pins: str = "", more: tuple[str, ...] = ()) -> str:
    """A portal of three members of two bars in X-Z; `pins` releases the first bar of the beam at its end A."""
    xz = {1: (0, 0), 2: (0, 0.2), 3: (0, 0.4), 4: (0.25, 0.4), 5: (0.5, 0.4), 6: (0.5, 0.2), 7: (0.5, 0)}
    lines = ["SOL 103", "CEND", "SPC = 1", "BEGIN BULK", "MAT1,1,7.+10,,0.33,2700.", "PBAR,1,1,3.-4,2.-9,2.-8,1.-8"]
    lines += [f"GRID,{n},,{x},0.,{z}" for n, (x, z) in xz.items()]
    for n in range(1, 7):
        v = "0.,1.,0."
        lines += [f"CBAR,{n},1,{n},{n + 1},{v}" + (f"\n,{pins}" if n == 3 and pins else "")]
    lines += ["SPC1,1,123456,1,7", "SPC1,1,246,2,THRU,6", *more, "ENDDATA", ""]
    return "\n".join(lines)


def read(folder: Path, text: str) -> Model:
    (folder / "frame.bdf").write_text(text)
    return read_model(folder / "frame.bdf")


def cut(model: Model) -> Place:
    """The beam's end at joint 3, turning about Y."""
    found = [p for p in find_places(model) if p.kind == "end" and p.nodes == (3,) and p.elements == (3,)]
    (place,) = [p for p in found if p.direction == "RY"]
    return place


def test_joints_and_members(tmp_path: Path) -> None:
    top = topology(read(tmp_path, frame()))
    assert top.joints == [1, 3, 5, 7]
    assert sorted((min(a, b), max(a, b), sorted(chain)) for a, b, chain in top.members) == [
        (1, 3, [1, 2]),
        (3, 5, [3, 4]),
        (5, 7, [5, 6]),
    ]
    with_mass = topology(read(tmp_path, frame(more=("CONM2,100,4,,0.2",))))
    assert 4 in with_mass.joints


def test_every_kind_of_place_is_offered(tmp_path: Path) -> None:
    model = read(tmp_path, frame())
    places = find_places(model)
    grounds = {(p.nodes[0], p.direction) for p in places if p.kind == "ground"}
    assert {(3, "X"), (3, "Z"), (5, "X"), (5, "Z")} <= grounds
    assert not [p for p in places if p.kind == "ground" and p.direction == "Y"]
    assert {p.nodes for p in places if p.kind == "clamp"} == {(1,), (7,)}
    assert sorted(tuple(sorted(p.nodes)) for p in places if p.kind == "member") == [(1, 3), (3, 5), (5, 7)]
    assert {p.direction for p in places if p.kind == "base"} == {"X", "Z"}
    assert cut(model).to == "member to node 5"


def test_moved_supports_carry_the_structure_along(tmp_path: Path) -> None:
    """Static response to a uniform displacement of all supports is that displacement everywhere."""
    model = read(tmp_path, frame())
    moved = [p for p in find_places(model) if p.kind == "base" and p.to == "moved"]
    assert [p.direction for p in moved] == ["X", "Z"]
    for place, c in zip(moved, (0, 2), strict=True):
        pattern = np.zeros(model.fe.n_g)
        pattern[place.g_rows[0]] = place.g_values[0]
        T = model.transformation()
        u = np.asarray(T @ np.linalg.solve(model.matrices()[0].toarray(), np.asarray(T.T @ pattern)))
        free = [6 * model.index(node) + c for node in (2, 3, 4, 5, 6)]
        np.testing.assert_allclose(u[free], 1.0, rtol=1e-8)


def test_a_long_member_is_offered_in_parts(tmp_path: Path) -> None:
    """A straight cantilever of six bars: whole, halves, thirds and single bars, each with its own end nodes."""
    lines = ["SOL 103", "CEND", "SPC = 1", "BEGIN BULK", "MAT1,1,7.+10,,0.33,2700.", "PBAR,1,1,3.-4,2.-9,2.-8,1.-8"]
    lines += [f"GRID,{n},,{0.1 * n:.1f},0.,0." for n in range(1, 8)]
    lines += [f"CBAR,{n},1,{n},{n + 1},0.,0.,1." for n in range(1, 7)]
    model = read(tmp_path, "\n".join([*lines, "SPC1,1,123456,1", "ENDDATA", ""]))
    members = [p for p in find_places(model) if p.kind == "member"]
    assert members[0].nodes == (1, 7)
    assert not members[0].unlikely
    by_nodes = {p.nodes: p for p in members[1:]}
    assert by_nodes[1, 4].elements == (1, 2, 3)
    assert by_nodes[3, 5].elements == (3, 4)
    assert {(n, n + 1) for n in range(1, 7)} <= set(by_nodes)
    assert len(by_nodes) == len(members) - 1
    assert all(p.unlikely for p in members[1:])


def released(model: Model, place: Place) -> tuple[np.ndarray, np.ndarray, float]:
    """K with the cut open, B on the independent DOFs, S."""
    B = np.zeros(model.fe.n_g)
    B[place.g_rows[0]] = place.g_values[0]
    b = np.asarray(model.transformation().T @ B)
    assert place.release is not None
    S = float(place.release[0, 0])
    return model.matrices()[0].toarray() - np.outer(b, b) / S, b, S


def test_a_cut_is_a_pinned_end(tmp_path: Path) -> None:
    model = read(tmp_path, frame())
    K, _, _ = released(model, cut(model))
    # plane 1 of the bar holds its axis and v = Y; motion in X-Z bends it in plane 2, about its own y: pin flag 5
    pinned = read(tmp_path, frame(pins="5")).matrices()[0].toarray()
    assert np.abs(pinned - model.matrices()[0].toarray()).max() > 1e-3 * np.abs(pinned).max()
    np.testing.assert_allclose(K, pinned, rtol=0, atol=1e-9 * np.abs(pinned).max())


@pytest.mark.parametrize(("k", "off"), [(1e3, None), (1e12, 1e-6)])
def test_a_stiff_spring_across_the_cut_is_the_rigid_connection(tmp_path: Path, k: float, off: float | None) -> None:
    """d = B' u / S - m / S opens the cut, m = k d holds it: K_open + B B' / S^2 * k / (1 + k / S)."""
    model = read(tmp_path, frame())
    K, b, S = released(model, cut(model))
    rigid = model.matrices()[0].toarray()
    closed = K + np.outer(b, b) / S**2 * k / (1 + k / S)
    left = np.abs(closed - rigid).max() / np.abs(rigid).max()
    if off is None:
        assert left > 1e-3
    else:
        assert left < off
