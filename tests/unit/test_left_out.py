"""Sensors across which a structure moves far more than along them, and what is said of them."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from femend.data import FRF, Channel
from femend.diagnose.updating.update import modelled
from femend.dof import Dof
from femend.estimate import FitRecord, without_crossed, without_still
from femend.model import ReducedModel, read_model, reduce_model
from femend.numerals import plain
from femend.study.result.predictions import Prediction
from femend.study.result.result import _left_out

sys.path.insert(0, str(Path(__file__).parent))
from test_cross_axis import BAND, SENSORS, Y, Z, of_frf, recorded, reduced

__all__ = ["reduced"]


def test_sensors_across_the_motion_are_left_out(reduced: ReducedModel) -> None:
    record = recorded(reduced, SENSORS, (7, Y))
    (left,) = without_crossed([record], reduced, BAND, 0.01)
    assert left.out_rows.tolist() == [37, 25, 13]
    np.testing.assert_array_equal(left.y, record.y[[0, 1, 3]])
    np.testing.assert_array_equal(left.noise, record.noise[[0, 1, 3]])
    assert [row for row, _, _ in left.crossed] == [20, 38]
    # that many times as much as the Y of the same node moves
    along = record.y[4].std()
    assert {row: ratio for row, ratio, _ in left.crossed}[38] == pytest.approx(record.y[0].std() / along, rel=0.2)
    assert min(ratio for _, ratio, _ in left.crossed) > 50


def test_sensors_are_kept_that_some_record_moves(reduced: ReducedModel) -> None:
    records = [recorded(reduced, SENSORS, (7, Y)), recorded(reduced, SENSORS, (7, Z))]
    assert all(a is b for a, b in zip(without_crossed(records, reduced, BAND, 0.01), records, strict=True))


def test_three_sensors_stay_whatever_they_are(reduced: ReducedModel) -> None:
    record = recorded(reduced, [(7, Y), (5, Y), (4, Z), (7, Z)], (7, Y))
    assert without_crossed([record], reduced, BAND, 0.01)[0] is record


def test_without_a_recorded_force_nothing_is_left_out(reduced: ReducedModel) -> None:
    record = recorded(reduced, SENSORS, (7, Y))
    unknown = replace(record, u=record.u[:0], in_rows=record.in_rows[:0], in_signs=record.in_signs[:0])
    assert without_crossed([unknown], reduced, BAND, 0.01)[0] is unknown


def still_and_unknown(reduced: ReducedModel) -> FitRecord:
    """Responses alone of a drive along Z, to which one sensor along Y shows rounding."""
    record = recorded(reduced, [(7, Z), (5, Z), (4, Y), (3, Z)], (7, Z))
    y = record.y.copy()
    y[2] = 1e-12 * y[0].std() * np.random.default_rng(4).standard_normal(y.shape[1])
    return replace(record, y=y, u=record.u[:0], in_rows=record.in_rows[:0], in_signs=record.in_signs[:0])


def test_sensors_that_stand_still_are_left_out_of_responses_alone(reduced: ReducedModel) -> None:
    unknown = still_and_unknown(reduced)
    (left,) = without_still([unknown])
    assert left.out_rows.tolist() == [6 * 6 + Z, 6 * 4 + Z, 6 * 2 + Z]
    assert [row for row, _, _ in left.crossed] == [6 * 3 + Y]
    assert left.y.shape[0] == len(left.noise) == 3
    # of sensors that move in another recording, and of three, none
    moving = replace(unknown, y=unknown.y[[0, 1, 0, 3]])
    assert [len(r.out_rows) for r in without_still([unknown, moving])] == [4, 4]
    few = replace(unknown, **{k: getattr(unknown, k)[1:] for k in ("y", "out_rows", "out_signs", "noise")})
    assert without_still([few])[0] is few
    # a recorded force tells more of them
    driven = replace(recorded(reduced, SENSORS, (7, Z)), y=unknown.y)
    assert without_still([driven])[0] is driven


def test_a_diagnosis_of_responses_says_which_sensors_stand_still(reduced: ReducedModel) -> None:
    _, own, problem = modelled(reduced.model, [still_and_unknown(reduced)], 0.01)
    assert len(problem.records[0].out_rows) == 3
    (said,) = _left_out(SimpleNamespace(reduced=own, problem=problem))  # type: ignore[arg-type]
    assert said.startswith("the sensors at node 4 Y stand still")


def test_columns_of_an_frf_are_left_out_too(reduced: ReducedModel) -> None:
    record = recorded(reduced, SENSORS, (7, Y))
    frf = of_frf(record)
    assert frf.frf is not None
    H = frf.frf.H
    (left,) = without_crossed([frf], reduced, BAND, 0.01)
    assert left.frf is not None
    assert left.frf.H.shape == left.frf.noise.shape == (len(H), 3)
    np.testing.assert_array_equal(left.frf.H, H[:, [0, 1, 3]])
    assert left.y.shape == (3, len(H))


def test_a_diagnosis_fits_the_others_and_says_so(reduced: ReducedModel) -> None:
    model = reduced.model
    _, own, problem = modelled(model, [recorded(reduced, SENSORS, (7, Y))], 0.01)
    (record,) = problem.records
    assert record.out_rows.tolist() == [37, 25, 13]
    (said,) = _left_out(SimpleNamespace(reduced=own, problem=problem))  # type: ignore[arg-type]
    times = plain(max(ratio for _, ratio, _ in record.crossed), 2)
    assert said.startswith(
        f"the structure moves up to {times} times as much across the sensors at node 4 Z, node 7 Z as"
    )
    assert "left out of the fit" in said
    nothing = problem.on([replace(record, crossed=())])
    assert _left_out(SimpleNamespace(reduced=own, problem=nothing)) == []  # type: ignore[arg-type]


def test_a_sensor_that_records_next_to_nothing_is_told_as_that(reduced: ReducedModel) -> None:
    # shaken between its axes, so that every sensor has motion along it and across
    along, across = (recorded(reduced, [(n, Y) for n in (7, 5, 4, 3)], (7, axis)) for axis in (Y, Z))
    y = along.y + across.y
    y[2] = 1e-3 * y[2].std() * np.random.default_rng(4).standard_normal(y.shape[1])
    both = np.vstack([along.u, across.u]), np.concatenate([along.in_rows, across.in_rows]), np.ones(2)
    dead = replace(along, y=y, u=both[0], in_rows=both[1], in_signs=both[2])
    _, own, problem = modelled(reduced.model, [dead], 0.01)
    ((row, crossed, little),) = problem.records[0].crossed
    assert row == 6 * 3 + Y
    assert min(crossed, little) > 50
    (said,) = _left_out(SimpleNamespace(reduced=own, problem=problem))  # type: ignore[arg-type]
    assert said.startswith("the sensors at node 4 Y record hardly anything of what the model moves there")


@pytest.mark.parametrize("kind", ["time", "frf"])
def test_rounding_of_the_model_is_no_motion_that_a_sensor_misses(tmp_path: Path, kind: str) -> None:
    """Across the plane of a frame model and recording hold rounding, the one 91 times as much of it as the other: its
    sensors were told to be looked after, as if they were not connected."""
    plane = in_its_plane(tmp_path)
    record = recorded(plane, [(7, Y), (5, Y), (4, Z), (3, Y)], (7, Y))
    y = record.y.copy()
    rounding = 1e-15 * y[0].std() * np.random.default_rng(4).standard_normal(y.shape[1])
    y[2] = rounding
    still = replace(record, y=y, noise=np.where(np.arange(4) == 2, rounding.std(), record.noise))
    still = still if kind == "time" else of_frf(still)
    _, own, problem = modelled(plane.model, [still], 0.01)
    ((row, crossed, little),) = problem.records[0].crossed
    assert row == 6 * 3 + Z
    assert np.isinf(crossed)
    assert little == 0.0
    (said,) = _left_out(SimpleNamespace(reduced=own, problem=problem))  # type: ignore[arg-type]
    assert said.startswith("the sensors at node 4 Z stand still, dead or in a plane that nothing drives")


@pytest.mark.parametrize("kind", ["time", "frf"])
@pytest.mark.parametrize("n", [4, 2])
def test_a_sensor_that_shows_rounding_alone_is_left_out_of_a_plane_too(tmp_path: Path, kind: str, n: int) -> None:
    """Nothing moves across it, and it was fitted to a noise of 1e-12 of its neighbours' motion."""
    plane = in_its_plane(tmp_path)
    record = recorded(plane, [(7, Y), (5, Y), (4, Y), (3, Y)][:n], (7, Y))
    y = record.y.copy()
    rounding = 1e-10 * y[0].std() * np.random.default_rng(4).standard_normal(y.shape[1])
    y[1] = rounding
    noise = np.where(np.arange(n) == 1, 1e-2 * rounding.std(), record.noise)
    dead = replace(record, y=y, noise=noise)
    dead = dead if kind == "time" else of_frf(dead)
    _, own, problem = modelled(plane.model, [dead], 0.01)
    ((row, _, little),) = problem.records[0].crossed
    assert row == 6 * 4 + Y
    assert little > 1e8
    assert len(problem.records[0].out_rows) == n - 1
    (said,) = _left_out(SimpleNamespace(reduced=own, problem=problem))  # type: ignore[arg-type]
    assert said.startswith("the sensors at node 5 Y record hardly anything of what the model moves there")


def test_a_sensor_with_noise_of_its_own_stays(tmp_path: Path) -> None:
    plane = in_its_plane(tmp_path)
    record = recorded(plane, [(7, Y), (5, Y), (4, Y), (3, Y)], (7, Y))
    y = record.y.copy()
    y[1] = 1e-5 * y[0].std() * np.random.default_rng(4).standard_normal(y.shape[1])
    _, _, problem = modelled(plane.model, [replace(record, y=y)], 0.01)
    assert len(problem.records[0].out_rows) == 4


def in_its_plane(folder: Path) -> ReducedModel:
    """The cantilever with its tip mass on the axis but for rounding, so that a force along Y moves Z by rounding."""
    lines = ["SOL 103", "CEND", "SPC = 1", "BEGIN BULK", "MAT1,1,7.+10,,0.33,2700.", "PBAR,1,1,4.-4,3.-9,1.2-8,8.-9"]
    lines += [f"GRID,{i + 1},,{0.1 * i},0.,0." for i in range(7)]
    lines += [f"CBAR,{i},1,{i},{i + 1},0.,1.,0." for i in range(1, 7)]
    lines += ["SPC1,1,123456,1", "CONM2,90,7,,0.2,0.,1.-14,1.-14", "ENDDATA", ""]
    (folder / "plane.bdf").write_text("\n".join(lines))
    model = read_model(folder / "plane.bdf")
    return reduce_model(model, BAND[1], [6 * (n - 1) + c for n in range(2, 8) for c in (Y, Z)])


def test_sensors_that_were_left_out_do_not_count_in_errors() -> None:
    dofs = [Dof.parse(text) for text in ("7:+Y", "5:+Y", "4:+Z")]
    channels = tuple(Channel(dof, "acceleration", "m/s^2") for dof in dofs)
    shown = np.array([[1.0, -1.0], [2.0, -2.0], [3.0, -3.0]])
    made = {"final": shown * np.array([[1.1], [0.9], [9.0]])}
    every = Prediction("a", "fit", 0.01, channels, made, shown)
    assert every.error("final") > 5
    assert replace(every, left_out=frozenset({2})).error("final") == pytest.approx(0.1)
    H = FRF(
        "a",
        np.array([1.0, 2.0]),
        shown.T[:, :, None] + 0j,
        channels,
        (Channel(dofs[0], "force", "N"),),
        "accelerance",
        "m/s^2/N",
    )
    of_frf = replace(every, frf=H, stages={"final": made["final"].T[:, :, None]}, recorded=H.H, dt=0.0)
    assert replace(of_frf, left_out=frozenset({2})).error("final") == pytest.approx(0.1)
