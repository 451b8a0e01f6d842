"""Places of a plane in which nothing was recorded are left out; those of several directions keep what is sensed."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from femend.diagnose.locating.joint import open_joint
from femend.diagnose.locating.sensed import sensed_places
from femend.errors import ModelError
from femend.estimate import FitRecord, Problem
from femend.model import ReducedModel, find_places, read_model, reduce_model
from femend.model.places.places import mass_place

sys.path.insert(0, str(Path(__file__).parents[1]))

Y, Z = 1, 2


def cantilever(path: Path, offset: str) -> ReducedModel:
    """A bar of two different stiffnesses along X whose tip mass lies off its axis by `offset`."""
    lines = ["SOL 103", "CEND", "SPC = 1", "BEGIN BULK", "MAT1,1,7.+10,,0.33,2700.", "PBAR,1,1,4.-4,3.-9,1.2-8,8.-9"]
    lines += [f"GRID,{i + 1},,{0.1 * i},0.,0." for i in range(7)]
    lines += [f"CBAR,{i},1,{i},{i + 1},0.,1.,0." for i in range(1, 7)]
    lines += ["SPC1,1,123456,1", f"CONM2,90,7,,0.2,{offset}", "ENDDATA", ""]
    path.write_text("\n".join(lines))
    model = read_model(path)
    return reduce_model(model, 400.0, [6 * (n - 1) + Z for n in (4, 7)])


def problem(axes: tuple[int, ...]) -> Problem:
    rows = np.array([6 * (n - 1) + c for n in (4, 7) for c in axes])
    record = FitRecord(
        name="r", y=np.zeros((len(rows), 8)), u=np.zeros((1, 8)), dt=1e-3, out_rows=rows, out_signs=np.ones(len(rows)),
        in_rows=np.array([6 * 6 + Z]), in_signs=np.ones(1), noise=np.ones(len(rows)),
    )  # fmt: skip
    return Problem([record], (5.0, 400.0), 0.01, 2)


def kinds(reduced: ReducedModel, axes: tuple[int, ...]) -> dict[tuple[str, str], set[int]]:
    """Numbers of directions of the places that are left, by kind and direction."""
    found: dict[tuple[str, str], set[int]] = {}
    for place in sensed_places(problem(axes), reduced, find_places(reduced.model)):
        found.setdefault((place.kind, place.direction), set()).add(place.n_w)
    return found


def test_what_moves_in_another_plane_than_the_sensors_is_no_place(tmp_path: Path) -> None:
    """A free force in such a plane explained friction by rounding, at 1e12 times the noise."""
    reduced = cantilever(tmp_path / "m.bdf", "0.,0.,0.")
    left = kinds(reduced, (Z,))
    assert {d for kind, d in left if kind == "ground"} == {"Z"}
    assert {d for kind, d in left if kind == "clamp"} == {"Z", "RY"}
    assert {d for kind, d in left if kind == "base"} <= {"Z", "RY"}
    assert any(kind == "member" for kind, _ in left)
    # both planes are seen: rotations about Y and Z are left of all three
    both = kinds(reduced, (Y, Z))
    assert {d for kind, d in both if kind == "ground"} == {"Y", "Z"}
    assert both["clamp", "R"] == {2}


def test_planes_that_couple_a_little_are_all_seen(tmp_path: Path) -> None:
    left = kinds(cantilever(tmp_path / "m.bdf", "0.,2.-4,2.-4"), (Z,))
    assert {d for kind, d in left if kind == "ground"} >= {"Y", "Z"}


def test_a_cut_keeps_the_stiffness_of_the_directions_left(tmp_path: Path) -> None:
    reduced = cantilever(tmp_path / "m.bdf", "0.,0.,0.")
    places = find_places(reduced.model)
    (whole,) = (p for p in places if p.kind == "clamp" and p.direction == "R")
    (kept,) = sensed_places(problem((Y, Z)), reduced, [whole])
    assert whole.release is not None
    assert kept.release is not None
    np.testing.assert_allclose(kept.release, whole.release[1:, 1:])
    for left, right in zip(kept.lets_go, whole.lets_go[1:], strict=True):
        np.testing.assert_array_equal(left, right)
    assert open_joint(kept, reduced, 100.0, [6 * 6 + Z]).w.shape[0] == 2
    # a mass moves in both planes; alone it is a place of its own
    mass = mass_place(reduced.model, 7)
    assert [p.n_w for p in sensed_places(problem((Y, Z)), reduced, [mass])] == [2]
    assert sensed_places(problem((Z,)), reduced, [mass]) == []


def test_all_places_are_left_where_the_model_has_no_solution(tmp_path: Path) -> None:
    reduced = cantilever(tmp_path / "m.bdf", "0.,0.,0.")
    places = find_places(reduced.model)
    broken = replace(reduced, M_fixed=reduced.M_fixed - 2.0 * np.eye(reduced.r))
    with pytest.raises(ModelError):
        problem((Z,)).system(broken).modal(problem((Z,)).prior(broken)[0])
    assert sensed_places(problem((Z,)), broken, places) == places
