"""Signals on recordings: the rig's run-up with its tacho, the model aircraft's without one."""

from __future__ import annotations

import re
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from femend import read_recording
from femend.data import Channel, TimeData
from femend.dof import Dof
from femend.signal import (
    check_signals,
    estimate_frf,
    find_hits,
    find_period,
    impact_frf,
    ods_of_order,
    order_spectra,
    periodic_frf,
    refine_speed,
    run_up_shapes,
    speed_from_profile,
    tacho_speed,
    vold_kalman,
)


def columns(path: Path, wanted: str) -> list[np.ndarray]:
    """Numbers in some columns of an .xlsx file's first sheet."""
    with zipfile.ZipFile(path) as archive:
        text = archive.read("xl/worksheets/sheet1.xml").decode()
    found: dict[str, list[float]] = {c: [] for c in wanted}
    cell = re.compile(r'<c r="([A-Z]+)\d+"(?: s="\d+")?>(?:<f[^>]*/>|<f[^>]*>[^<]*</f>)?<v>([^<]*)</v>')
    for column, value in cell.findall(text):
        if column in found:
            found[column].append(float(value))
    return [np.array(found[c]) for c in wanted]


@pytest.fixture(scope="module")
def run_up(shared: Callable[[str], Path]) -> TimeData:
    return read_recording(shared("cases/rig/public/runup.uff")).time


def test_the_rig_runs_up_as_its_papers_say(run_up: TimeData) -> None:
    assert [f for f in check_signals(run_up) if f.kind in ("dead", "clipped")] == []
    speed = tacho_speed(run_up)
    assert speed.doubled == 0
    assert speed.start < 0.1
    assert speed.stop > 99.9
    # "2.5 to 26 Hz in 100 s"; a straight line is how such a run is driven
    line = np.polyfit(speed.t, speed.rev_per_s, 1)
    assert line == pytest.approx([0.235, 2.5], rel=2e-3)
    assert np.std(speed.rev_per_s - np.polyval(line, speed.t)) < 2e-3


def test_the_rig_answers_its_first_order(run_up: TimeData) -> None:
    speed = tacho_speed(run_up)
    track = vold_kalman(run_up, speed, [1.0, 2.0, 3.0, 4.0])
    power = (np.abs(track.values) ** 2).sum(axis=(1, 2))
    assert power[0] > 1000 * power[1:].max()  # an unbalance, and sensors at 1 % noise
    signal = run_up.values[1:].std(axis=1)
    assert track.residual is not None
    assert np.median(track.residual / signal) < 0.05
    # away from resonance track and deconvolution show one thing; at one the track is late and low
    steady, tracked = run_up_shapes(run_up, speed), ods_of_order(track, 1.0)
    apart = {}
    for low, top in ((13.0, 15.0), (20.0, 22.5), (5.0, 7.0)):
        part = tracked.band(low, top)
        at = [int(np.argmin(np.abs(steady.freq - f))) for f in part.freq]
        apart[low] = np.linalg.norm(steady.shapes[:, at] - part.shapes) / np.linalg.norm(part.shapes)
    assert max(apart[13.0], apart[20.0]) < 0.05
    assert apart[5.0] > 0.3
    assert np.abs(steady.band(4, 8).shapes).max() > np.abs(tracked.band(4, 8).shapes).max()


@pytest.mark.slow
def test_the_aircraft_without_a_tacho_shows_more_than_ten_orders(shared: Callable[[str], Path]) -> None:
    folder = shared("data/model_aircraft/02_03_BSA")
    rows = [columns(folder / name, "AB") for name in ("a0_1r.xlsx", "a1_r2.xlsx", "a2_r4.xlsx", "a3_r5.xlsx")]
    stamps = rows[0][0] * 86400
    step = float(np.diff(stamps).mean())
    channels = [Channel(Dof(i + 1, 3), "acceleration", "m/s^2", f"wing {i + 1}") for i in range(4)]
    data = TimeData("run-up", step, [r[1] for r in rows], channels)
    t, volts = columns(folder / "Spannung.xlsx", "AB")
    t = t * 86400 - stamps[0]
    turning = np.flatnonzero((t > 9.2) & (t < data.duration))[::20]  # the motor starts at 9 s
    rough = speed_from_profile(t[turning], (572.14 * volts[turning] - 93) / 60, source="motor voltage")
    speed = refine_speed(data, rough, np.arange(1.0, 11.0))
    assert speed.band()[1] == pytest.approx(42, rel=0.02)
    before, after = (order_spectra(data, s, 15.5) for s in (rough, speed))
    # the share of the power within half an order that stands on the order's own line: 2/3 under a Hann window for an
    # order that stays where it should
    shares = []
    for spectra in (before, after):
        power = (np.abs(spectra.values) ** 2).sum(axis=(1, 2))
        near = [np.abs(spectra.orders - k) < 0.5 for k in range(1, 15)]
        shares.append([power[spectra.index(k)] / power[n].sum() for k, n in zip(range(1, 15), near, strict=True)])
    assert (np.array(shares[1]) > 0.55).sum() > 10
    assert (np.array(shares[0]) > 0.55).sum() < 5
    track = vold_kalman(data, speed, np.arange(1.0, 16.0), relative=0.3)
    assert (track.residual / data.values.std(axis=1)).max() < 0.6  # type: ignore[operator]


def test_the_aircraft_under_the_hammer(shared: Callable[[str], Path]) -> None:
    folder = shared("data/model_aircraft/01_Modformen_Modfrequenzen/Messungen_python")
    t, f, a = columns(folder / "5r_5r_Python.xlsx", "ACD")
    channels = [Channel(Dof(5, 3), "force", "N", "hammer"), Channel(Dof(5, 3), "acceleration", "m/s^2", "5r")]
    data = TimeData("5r", float(np.diff(t).mean()), [f, a], channels)
    (strict,) = find_hits(data, 8.0)
    assert not strict.kept  # the hammer came back 10 ms later
    assert "second peak of 9% at 1.46" in strict.reasons[0]
    found = impact_frf(data, 8.0, end=0.05, double=0.15)
    assert [hit.kept for hit in found.hits] == [True]
    H = np.abs(found.frf.H[:, 0, 0])
    band = (found.frf.freq > 40) & (found.frf.freq < 55)
    peak = found.frf.freq[band][np.argmax(H[band])]
    assert peak == pytest.approx(46.3, rel=0.02) or peak == pytest.approx(49.7, rel=0.02)  # the stated close pair


def test_the_fighter_is_excited_periodically(shared: Callable[[str], Path]) -> None:
    path = shared("data/f16_gvt/F16Data_FullMSine_Level1.csv")
    table = np.loadtxt(path, delimiter=",", skiprows=1, usecols=range(5))
    channels = [
        Channel(Dof(1, 3), "force", "N", "shaker"),
        *(Channel(Dof(i, 3), "acceleration", "m/s^2", f"a{i}") for i in (1, 2, 3)),
    ]
    data = TimeData("f16", 1 / 400, table[:, [0, 2, 3, 4]].T, channels)
    assert find_period(data) == 8192
    found = periodic_frf(data, band=(2.0, 15.0))
    assert found.n_periods + found.skipped == 9
    H, noise = np.abs(found.frf.H), np.sqrt(found.noise_variance)
    assert np.median(noise / H) < 0.05
    # the stated modes stand out of a periodic average as out of a Welch average
    welch = estimate_frf(data, resolution=400 / 8192)
    near = np.interp(found.frf.freq, welch.frf.freq, np.abs(welch.frf.H[:, 0, 0]))
    assert np.corrcoef(np.log(near), np.log(H[:, 0, 0]))[0, 1] > 0.95
