"""Rods as places: the bars of a truss, and the joints that no bar joins."""

from __future__ import annotations

from pathlib import Path

from femend import read_model
from femend.model import Model, find_places
from femend.model.places.rod_places import struts

SQUARE = {1: (0, 0), 2: (1, 0), 3: (1, 1), 4: (0, 1)}
RODS = {1: (1, 2), 2: (2, 3), 3: (3, 4), 4: (4, 1), 5: (1, 3)}


def truss(folder: Path, *more: str) -> Model:
    """A square of rods with one diagonal, in X-Z, held at nodes 1 and 2."""
    lines = ["SOL 103", "CEND", "SPC = 1", "BEGIN BULK", "MAT1,1,7.+10,,0.33,2700.", "MAT1,2,7.+10,,0.33,2700."]
    lines += [f"GRID,{n},,{x}.,0.,{z}." for n, (x, z) in SQUARE.items()]
    lines += [f"CONROD,{e},{a},{b},{2 if e == 5 else 1},1.-4" for e, (a, b) in RODS.items()]
    lines += ["SPC1,1,123456,1,2", "SPC1,1,2456,3,4", *more, "ENDDATA", ""]
    (folder / "truss.bdf").write_text("\n".join(lines))
    return read_model(folder / "truss.bdf", parameters=["E:1", "E:2"])


def test_every_rod_is_a_member_with_the_parameter_that_scales_it(tmp_path: Path) -> None:
    members = [p for p in find_places(truss(tmp_path)) if p.kind == "member"]
    assert {p.elements: p.nodes for p in members} == {(e,): ends for e, ends in RODS.items()}
    assert [p.parameter for p in members] == [0, 0, 0, 0, 1]
    assert members[4].where == "at rod 5 between nodes 1 and 3"


def test_joints_that_no_rod_joins_are_pairs(tmp_path: Path) -> None:
    along = [p for p in find_places(truss(tmp_path)) if p.kind == "pair" and not p.direction]
    assert [set(p.nodes) for p in along] == [{2, 4}]


def test_a_rod_along_a_shell_or_a_beam_is_part_of_it(tmp_path: Path) -> None:
    shell = ("PSHELL,9,1,0.01,1", "CQUAD4,11,9,1,2,3,4")
    assert struts(truss(tmp_path, *shell)) == {}
    beam = ("PBAR,8,1,1.-4,1.-9,1.-9,1.-9", "CBAR,12,8,2,3,0.,1.,0.")
    assert set(struts(truss(tmp_path, *beam))) == {1, 3, 4, 5}
