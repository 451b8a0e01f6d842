"""Pairs across gaps: which nodes face each other, and along which axes something may act between them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from femend.model import Model, Place, find_places, read_model
from femend.model.places.gap_places import facing
from femend.model.places.places import gap_places

NX, NY, SIDE = 4, 3, 0.05


def sheet(first: int, at: tuple[float, float, float], nx: int = NX, ny: int = NY, side: float = SIDE) -> list[str]:
    """A plate in X-Y of square shells, ids from `first`, its first corner at `at`."""
    x, y, z = at
    lines = [
        f"GRID,{first + i + (nx + 1) * j},,{x + i * side:.4f},{y + j * side:.4f},{z:.4f}"
        for j in range(ny + 1)
        for i in range(nx + 1)
    ]
    for j in range(ny):
        for i in range(nx):
            n = first + i + (nx + 1) * j
            lines.append(f"CQUAD4,{n},1,{n},{n + 1},{n + nx + 2},{n + nx + 1}")
    return lines


def read(folder: Path, *cards: str) -> Model:
    head = ["BEGIN BULK", "MAT1,1,7.+10,,0.33,2700.", "PSHELL,1,1,0.003,1,,1", "PBAR,3,1,3.-4,2.-9,2.-8,1.-8"]
    path = folder / "gap.bdf"
    path.write_text("\n".join(["SOL 103", "CEND", *head, *cards, "ENDDATA", ""]))
    return read_model(path)


def bars(first: int, points: list[tuple[float, float, float]]) -> list[str]:
    """Bars from point to point, ids from `first`."""
    lines = [f"GRID,{first + i},,{x},{y},{z}" for i, (x, y, z) in enumerate(points)]
    return lines + [f"CBAR,{n},3,{n},{n + 1},0.3,0.5,1." for n in range(first, first + len(points) - 1)]


def pairs(model: Model) -> list[Place]:
    return [p for p in find_places(model) if p.kind == "pair"]


def test_two_plates_face_node_by_node(tmp_path: Path) -> None:
    model = read(tmp_path, *sheet(1, (0, 0, 0)), *sheet(101, (0, 0, 0.02)))
    assert facing(model) == [(n, n + 100) for n in range(1, 21)]
    own = [p for p in pairs(model) if p.nodes == (7, 107)]
    assert [(p.direction, p.to) for p in own] == [("", "107"), ("X", "107"), ("Y", "107")]
    # along the line: the upper node up, the lower one down
    moved = np.zeros(model.fe.n_g)
    moved[own[0].g_rows[0]] = own[0].g_values[0]
    assert {int(r): float(moved[r]) for r in np.flatnonzero(moved)} == pytest.approx(
        {6 * model.index(7) + 2: -1.0, 6 * model.index(107) + 2: 1.0}
    )


def test_plates_that_are_far_apart_do_not_face(tmp_path: Path) -> None:
    # farther than two elements and than a quarter of the diagonal, 0.25 m
    model = read(tmp_path, *sheet(1, (0, 0, 0)), *sheet(101, (0, 0, 0.13)))
    assert facing(model) == []
    # the same gap is narrow for plates of twice the size
    model = read(tmp_path, *sheet(1, (0, 0, 0), side=0.1), *sheet(101, (0, 0, 0.13), side=0.1))
    assert len(facing(model)) == 20


def test_meshes_that_do_not_match_are_paired_with_the_nearest(tmp_path: Path) -> None:
    model = read(tmp_path, *sheet(1, (0, 0, 0)), *sheet(101, (0.015, 0, 0.02), nx=8, ny=6, side=SIDE / 2))
    found = facing(model)
    # each node of the coarse plate has one of the fine plate within half its side, but for the first column's
    assert {a for a, _ in found} == set(range(1, 21))
    assert len({b for _, b in found}) == len(found)
    for a, b in found:
        x = model.xyz[model.index(b)] - model.xyz[model.index(a)]
        assert np.abs(x[:2]).max() <= 0.0151


def test_the_nearest_pairs_come_first(tmp_path: Path) -> None:
    # the second beam slopes away from the first
    lower = [(0.1 * i, 0.0, 0.0) for i in range(5)]
    upper = [(0.1 * i, 0.0, 0.02 + 0.01 * i) for i in range(5)]
    model = read(tmp_path, *bars(1, lower), *bars(11, upper))
    assert facing(model) == [(1 + i, 11 + i) for i in range(5)]


def test_nodes_that_are_joined_have_no_gap_between_them(tmp_path: Path) -> None:
    joints = ("CELAS2,900,1.+5,7,3,107,3", "RBE2,901,8,123,108")
    model = read(tmp_path, *sheet(1, (0, 0, 0)), *sheet(101, (0, 0, 0.02)), *joints)
    assert {(7, 107), (8, 108)}.isdisjoint(facing(model))
    assert len(facing(model)) == 18


def test_two_beams_at_one_point_may_lack_every_component_of_their_joint(tmp_path: Path) -> None:
    across = [(0.2, 0.0, 0.0), (0.2, 0.1, 0.0), (0.2, 0.2, 0.0)]
    model = read(tmp_path, *bars(1, [(0.0, 0.0, 0.0), (0.1, 0.0, 0.0), (0.2, 0.0, 0.0)]), *bars(11, across))
    assert facing(model)[0] == (3, 11)
    own = [p for p in pairs(model) if p.nodes == (3, 11)]
    assert sorted(p.direction for p in own) == ["RX", "RY", "RZ", "X", "Y", "Z"]


def test_solids_carry_no_rotation_across_a_gap(tmp_path: Path) -> None:
    cards = ["PSOLID,2,1"]
    for first, z in ((1, 0.0), (11, 0.1)):
        corners = [(x, y, z + h) for h in (0, 0.1) for x, y in ((0, 0), (0.1, 0), (0.1, 0.1), (0, 0.1))]
        cards += [f"GRID,{first + i},,{x},{y},{h:.2f}" for i, (x, y, h) in enumerate(corners)]
        cards += [f"CHEXA,{first},2,{','.join(str(first + i) for i in range(6))},", f",{first + 6},{first + 7}"]
    model = read(tmp_path, *cards)
    assert facing(model) == [(5, 11), (6, 12), (7, 13), (8, 14)]
    assert {p.direction for p in pairs(model)} == {"X", "Y", "Z"}


def test_a_slit_plate_faces_itself_and_a_whole_one_does_not(tmp_path: Path) -> None:
    assert facing(read(tmp_path, *sheet(1, (0, 0, 0), nx=8, ny=8))) == []
    # two plates side by side, 5 mm apart, joined along the last two columns of a third of their length
    one, two = sheet(1, (0, 0, 0), nx=8), sheet(101, (0, 3 * SIDE + 0.005, 0), nx=8)
    bridge = [f"CQUAD4,{201 + i},1,{28 + i},{29 + i},{102 + i},{101 + i}" for i in (6, 7)]
    found = facing(read(tmp_path, *one, *two, *bridge))
    # the two nodes next to the bridge are near along the mesh too
    assert found == [(28 + i, 101 + i) for i in range(4)]


def test_what_is_listed_as_a_pair_already_is_not_listed_again(tmp_path: Path) -> None:
    model = read(tmp_path, *bars(1, [(0, 0, 0), (0.1, 0, 0)]), *bars(11, [(0, 0, 0.05), (0.1, 0, 0.05)]))
    named = [(frozenset(p.nodes), p.direction) for p in pairs(model)]
    assert len(named) == len(set(named))
    held = np.zeros(model.fe.n_g, dtype=bool)
    assert len(gap_places(model, held, pairs(model))) == 0
    assert len(gap_places(model, held)) == 6


def test_of_many_joints_the_nearest_are_paired(tmp_path: Path) -> None:
    """A ladder of 24 rungs, 48 joints: its diagonals are nearer than anything else that no member joins."""
    cards = []
    for i in range(24):
        cards += [f"GRID,{1 + i},,{0.1 * i:.1f},0.,0.", f"GRID,{101 + i},,{0.1 * i:.1f},0.,0.1"]
        cards.append(f"CBAR,{200 + i},3,{1 + i},{101 + i},0.,1.,0.")
        if i:
            cards += [f"CBAR,{300 + i},3,{i},{1 + i},0.,1.,0.", f"CBAR,{400 + i},3,{100 + i},{101 + i},0.,1.,0."]
    found = pairs(read(tmp_path, *cards))
    assert {frozenset(p.nodes) for p in found[:46]} == {
        frozenset(pair) for i in range(1, 24) for pair in ((i, 101 + i), (1 + i, 100 + i))
    }
    assert 46 < len(found) <= 400
    assert {p.direction for p in found} == {""}
