"""Sensors across which a structure moves far more than along them, and what is said of them and of a mesh."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from femend.diagnose.update import modelled
from femend.estimate import FitRecord, without_crossed
from femend.estimate.frf import FrfLines
from femend.model import MeshError, ReducedModel, read_model, reduce_model
from femend.numerals import plain
from femend.study.result import _crossed, _mesh_off

BAND, RATE, N = (5.0, 200.0), 1024.0, 2048
Y, Z = 1, 2


@pytest.fixture
def reduced(tmp_path: Path) -> ReducedModel:
    """A cantilever whose tip mass is a little off its axis, so that Y and Z are coupled by little."""
    lines = ["SOL 103", "CEND", "SPC = 1", "BEGIN BULK", "MAT1,1,7.+10,,0.33,2700.", "PBAR,1,1,4.-4,3.-9,1.2-8,8.-9"]
    lines += [f"GRID,{i + 1},,{0.1 * i},0.,0." for i in range(7)]
    lines += [f"CBAR,{i},1,{i},{i + 1},0.,1.,0." for i in range(1, 7)]
    lines += ["SPC1,1,123456,1", "CONM2,90,7,,0.2,0.,0.0002,0.0002", "ENDDATA", ""]
    path = tmp_path / "m.bdf"
    path.write_text("\n".join(lines))
    model = read_model(path)
    return reduce_model(model, BAND[1], [6 * (n - 1) + c for n in range(2, 8) for c in (Y, Z)])


def recorded(reduced: ReducedModel, sensors: list[tuple[int, int]], force: tuple[int, int]) -> FitRecord:
    """Accelerations at `sensors` (node, axis) under a random force at one, one damping ratio."""
    K, M = reduced.as_drawn()
    rng = np.random.default_rng(0)
    freq = np.fft.rfftfreq(N, 1 / RATE)
    U = np.where((freq > BAND[0]) & (freq < BAND[1]), rng.standard_normal((2, freq.size)).T @ [1, 1j], 0)
    rows, into = (np.array([6 * (n - 1) + c for n, c in at]) for at in (sensors, [force]))
    Y = np.zeros((len(sensors), freq.size), dtype=complex)
    for k in np.flatnonzero(U):
        s = 2j * np.pi * freq[k]
        x = np.linalg.solve(K * (1 + 0.02j) + s**2 * M, reduced.rows(into)[0] * U[k])
        Y[:, k] = s**2 * (reduced.rows(rows) @ x)
    u, y = np.fft.irfft(U, N)[None], np.fft.irfft(Y, N)
    return FitRecord("r", u, y, 1 / RATE, into, rows, np.ones(1), np.ones(len(rows)), 0.01 * y.std(axis=1))


SENSORS = [(7, Y), (5, Y), (4, Z), (3, Y), (7, Z)]


def test_sensors_across_the_motion_are_left_out(reduced: ReducedModel) -> None:
    record = recorded(reduced, SENSORS, (7, Y))
    (left,) = without_crossed([record], reduced, BAND, 0.01)
    assert left.out_rows.tolist() == [37, 25, 13]
    np.testing.assert_array_equal(left.y, record.y[[0, 1, 3]])
    np.testing.assert_array_equal(left.noise, record.noise[[0, 1, 3]])
    assert [row for row, _ in left.crossed] == [20, 38]
    # that many times as much as the Y of the same node moves
    along = record.y[4].std()
    assert dict(left.crossed)[38] == pytest.approx(record.y[0].std() / along, rel=0.2)
    assert min(ratio for _, ratio in left.crossed) > 50


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


def test_columns_of_an_frf_are_left_out_too(reduced: ReducedModel) -> None:
    record = recorded(reduced, SENSORS, (7, Y))
    freq = np.fft.rfftfreq(N, 1 / RATE)
    inside = (freq > BAND[0]) & (freq < BAND[1])
    H = (np.fft.rfft(record.y)[:, inside] / np.fft.rfft(record.u)[0, inside]).T
    lines = FrfLines(freq[inside], H, 0.01 * np.abs(H), float(freq[1]))
    size = np.abs(H).T
    frf = replace(record, u=np.ones((1, len(H))), y=size, dt=0.0, frf=lines, noise=0.01 * size.mean(axis=1))
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
    (said,) = _crossed(SimpleNamespace(reduced=own, problem=problem))  # type: ignore[arg-type]
    times = plain(max(ratio for _, ratio in record.crossed), 2)
    assert said.startswith(
        f"the structure moves up to {times} times as much across the sensors at node 4 Z, node 7 Z as"
    )
    assert "left out of the fit" in said
    nothing = problem.on([replace(record, crossed=())])
    assert _crossed(SimpleNamespace(reduced=own, problem=nothing)) == []  # type: ignore[arg-type]


def test_a_mesh_that_is_far_off_is_told() -> None:
    freq = np.array([30.0, 86.405, 90.0])
    far = MeshError(freq, freq, np.array([29.9, 26.201, np.nan]), np.ones(3))
    (said,) = _mesh_off(far)
    assert said.startswith("the deck's mesh puts frequencies up to +230 % off (mode 2: 86.41 Hz, 26.2 Hz refined)")
    assert _mesh_off(None) == []
    assert _mesh_off(replace(far, converged=0.97 * freq)) == []
