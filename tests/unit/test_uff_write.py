"""Writing universal files: nothing is lost, nothing half-written is left behind."""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from femend import FRF, Channel, Dof, TimeData, functions_of, read_recording, read_uff, write_uff
from femend.errors import RecordingError
from femend.io.uff.writer import short_number

FORCE = Channel(Dof(1, 3), "force", "N", "hammer")
SENSOR = Channel(Dof(12, 1, -1), "acceleration", "m/s^2", "top", "acceleration node 12")


def record(n: int = 50, dt: float = 1 / 1024, t0: float = 0.0) -> TimeData:
    rng = np.random.default_rng(3)
    return TimeData("run", dt, rng.standard_normal((2, n)), (FORCE, SENSOR), t0)


def frf(freq: np.ndarray) -> FRF:
    rng = np.random.default_rng(4)
    H = rng.standard_normal((freq.size, 2, 1)) + 1j * rng.standard_normal((freq.size, 2, 1))
    outputs = (SENSOR, Channel(Dof(13, 6), "acceleration", "rad/s^2"))
    return FRF("ema", freq, H, outputs, (FORCE,), "accelerance", "m/s^2/N")


@pytest.mark.parametrize("dt", [1 / 1024, 1 / 51200, 1 / 44100, 1 / 48000, 0.01, 1 / 3, 1.23456789e-4])
@pytest.mark.parametrize("binary", [True, False])
def test_time_records_come_back(tmp_path: Path, dt: float, binary: bool) -> None:
    data = record(n=4000, dt=dt)
    write_uff(tmp_path / "a.uff", functions_of(data), binary=binary)
    back = read_recording(tmp_path / "a.uff", name="run").time
    assert back.dt == pytest.approx(dt, rel=2e-8)  # eight digits fit the column
    np.testing.assert_allclose(back.values, data.values, rtol=0 if binary else 1e-12)
    assert back.channels[1] == SENSOR


@pytest.mark.parametrize("binary", [True, False])
def test_frf_lines_do_not_move(tmp_path: Path, binary: bool) -> None:
    """4096 lines to 1000 Hz: six digits of the step would move the last line by 1e-3 Hz."""
    data = frf(np.linspace(0.0, 1000.0, 4096))
    write_uff(tmp_path / "a.uff", functions_of(data), binary=binary)
    back = read_recording(tmp_path / "a.uff").frf
    np.testing.assert_allclose(back.freq, data.freq, rtol=0, atol=1e-6 * 1000 / 4095)
    np.testing.assert_allclose(back.H, data.H, rtol=0 if binary else 1e-12, atol=0 if binary else 1e-12)
    assert [str(c.dof) for c in back.outputs] == ["12:-X", "13:+RZ"]
    assert str(back.inputs[0].dof) == "1:+Z"


def test_uneven_frequencies_stay_uneven(tmp_path: Path) -> None:
    data = frf(np.geomspace(1.0, 800.0, 100))
    write_uff(tmp_path / "a.uff", functions_of(data, single=True))
    function = read_uff(tmp_path / "a.uff").functions[0]
    assert not function.header.even
    np.testing.assert_array_equal(function.x, data.freq)


def test_single_precision_is_half_the_size(tmp_path: Path) -> None:
    data = record(n=10_000)
    write_uff(tmp_path / "s.uff", functions_of(data, single=True))
    write_uff(tmp_path / "d.uff", functions_of(data))
    sizes = [(tmp_path / f).stat().st_size for f in ("s.uff", "d.uff")]
    assert sizes[1] - sizes[0] == 2 * 10_000 * 4
    np.testing.assert_allclose(read_recording(tmp_path / "s.uff").time.values, data.values, rtol=1e-6)


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_nan_is_refused_and_the_old_file_stays(tmp_path: Path, bad: float) -> None:
    path = tmp_path / "a.uff"
    functions = functions_of(record())
    write_uff(path, functions)
    before = path.read_bytes()
    y = functions[1].y.copy()
    y[7] = bad
    functions[1] = replace(functions[1], y=y)
    with pytest.raises(RecordingError, match=r"function 2 .*value 8 is .*allow_nan=True"):
        write_uff(path, functions)
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]
    write_uff(path, functions, allow_nan=True)
    np.testing.assert_array_equal(read_uff(path).functions[1].y[7], bad)


def test_many_sets_cost_in_proportion(tmp_path: Path) -> None:
    """Four times the sets may take about four times as long; rescanning the file would take sixteen times."""

    def seconds(n: int) -> float:
        functions = functions_of(record(n=200)) * (n // 2)
        start = time.perf_counter()
        write_uff(tmp_path / "a.uff", functions)
        assert len(read_uff(tmp_path / "a.uff").functions) == n
        return time.perf_counter() - start

    few = min(seconds(100) for _ in range(3))
    assert min(seconds(400) for _ in range(3)) < 8 * few


def test_node_number_beyond_its_columns_is_refused(tmp_path: Path) -> None:
    channel = Channel(Dof(12345678901, 1), "force", "N")
    data = TimeData("r", 0.1, np.ones((1, 3)), (channel,))
    with pytest.raises(RecordingError, match="node 12345678901 does not fit 10 columns"):
        write_uff(tmp_path / "a.uff", functions_of(data))


@pytest.mark.parametrize(
    ("value", "text"),
    [(1 / 1024, "0.0009765625"), (1 / 2048, "4.8828125e-4"), (0.0, "0."), (1.0, "1."), (-2.5e-300, "-2.5e-300")],
)
def test_short_numbers(value: float, text: str) -> None:
    assert short_number(value) == text
    assert float(short_number(value)) == value
