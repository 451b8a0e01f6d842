"""How many elements of a deck there are to a wavelength, by how much they put its frequencies off, and what is left
out for it."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from femend.diagnose.updating.update import modelled
from femend.estimate import FitRecord
from femend.model import Model, ReducedModel, read_model, reduce_model
from femend.model.known_mesh import Unresolved
from femend.model.mesh.form_errors import MESH_SD, MODE_SD
from femend.model.mesh.resolution import LIMIT, mode_resolution, unresolved

sys.path.insert(0, str(Path(__file__).parents[1]))
import small_study

Array = NDArray[np.float64]
LENGTH = 0.72


def bars(path: Path, n: int, offset: str = "", lumped: bool = False) -> Model:
    """A uniform cantilever of n bars in the X-Z plane without lumps."""
    lines = ["SOL 103", "CEND", "SPC = 1", "BEGIN BULK", "" if lumped else "PARAM,COUPMASS,1"]
    lines += ["MAT1,1,7.0+10,,0.33,2700.", "PBAR,7,1,3.3-4,3.3275-9,2.475-8,1.0-8"]
    lines += [f"GRID,{i + 1},,{LENGTH * i / n:.9f},0.,0." for i in range(n + 1)]
    lines += [f"CBAR,{i + 1},7,{i + 1},{i + 2},0.,0.,1.{offset}" for i in range(n)]
    lines += ["SPC1,1,123456,1", f"SPC1,1,246,2,THRU,{n + 1}", "ENDDATA", ""]
    path.write_text("\n".join(lines))
    return read_model(path)


def frequencies(model: Model, n: int) -> Array:
    return np.asarray(small_study.dense_modes(model)[0][:n] / (2 * np.pi))


def reduced_to(model: Model, f_max: float) -> ReducedModel:
    last = model.node_ids[-1]
    return reduce_model(model, f_max, [6 * model.index(int(last)) + 2])


@pytest.mark.parametrize("lumped", [False, True])
@pytest.mark.parametrize("n", [3, 4])
def test_the_error_of_bars_is_that_of_their_frequencies(tmp_path: Path, n: int, lumped: bool) -> None:
    truth = frequencies(bars(tmp_path / "fine.bdf", 40), n)
    model = bars(tmp_path / "m.bdf", n, lumped=lumped)
    found = mode_resolution(reduced_to(model, 1.2 * truth[-1]), 1.2 * truth[-1])
    own = frequencies(model, n) / truth - 1
    np.testing.assert_allclose(found.freq[:2], frequencies(model, n)[:2], rtol=1e-6)
    # the first term of a series: within half as much again where there are three elements or more a wavelength
    clear = (np.abs(own) > 1e-5) & (found.points[:n] > 3.0)
    assert clear.sum() >= 2
    ratio = found.error[:n][clear] / own[clear]
    assert np.all((ratio > 0.6) & (ratio < 1.6)), ratio
    np.testing.assert_allclose(found.excess, np.abs(found.error) / MODE_SD)
    assert bool(own[0] < 0) is lumped


def test_points_are_elements_to_a_bending_wave(tmp_path: Path) -> None:
    found = mode_resolution(reduced_to(bars(tmp_path / "m.bdf", 8), 2000.0), 2000.0)
    # the waves of a clamped-free bar: k L = 1.8751, 4.6941, 7.8548 (Blevins 1979, table 8-1)
    expected = 2 * np.pi / (np.array([1.8751, 4.6941, 7.8548]) / 8)
    np.testing.assert_allclose(found.points[:3], expected, rtol=2e-3)


def test_an_offset_changes_nothing_of_the_wave(tmp_path: Path) -> None:
    plain, aside = (
        mode_resolution(reduced_to(bars(tmp_path / f"{i}.bdf", 6, text), 700.0), 700.0)
        for i, text in enumerate(("", ",,,,,0.,0.,0.05,0.,0.,0.05"))
    )
    np.testing.assert_allclose(aside.points[:2], plain.points[:2], rtol=0.02)
    np.testing.assert_allclose(aside.error[:2], plain.error[:2], rtol=0.2)


def test_the_band_ends_between_the_last_mode_that_is_right_and_the_first_that_is_not(tmp_path: Path) -> None:
    model = bars(tmp_path / "m.bdf", 3)
    f = frequencies(model, 4)
    found = mode_resolution(reduced_to(model, 1.1 * f[3]), 1.1 * f[3])
    first = int(np.argmax(found.excess > LIMIT))
    assert 1 <= first < 4
    missed = unresolved(reduced_to(model, 1.1 * f[3]), (5.0, 1.1 * f[3]))
    assert missed is not None
    assert missed.limit == pytest.approx(np.sqrt(found.freq[first - 1] * found.freq[first]))
    assert (missed.pid, missed.freq) == (7, pytest.approx(found.freq[first]))
    assert unresolved(reduced_to(model, missed.limit), (5.0, missed.limit)) is None
    alone = unresolved(reduced_to(model, 1.1 * f[3]), (0.99 * found.freq[first], 1.1 * f[3]))
    assert alone is not None
    assert alone.limit == 0
    assert "no lines are left out: refine property 7" in alone.text


def record(model: Model, top: float) -> FitRecord:
    """A record with as much power on every line up to `top` (Hz)."""
    n, dt = 4096, 1 / (2.6 * top)
    freq = np.fft.rfftfreq(n, dt)
    phase = np.exp(2j * np.pi * np.random.default_rng(3).random(len(freq)))
    u = np.fft.irfft(np.where((freq > 10.0) & (freq < top), phase, 0.0), n)[None]
    row, one = np.array([6 * (len(model.node_ids) - 1) + 2]), np.ones(1)
    return FitRecord("high", u, u.copy(), dt, row, row, one, one, 0.01 * u.std(axis=1))


def test_lines_above_are_left_out_and_their_power_is_told(tmp_path: Path) -> None:
    model = bars(tmp_path / "m.bdf", 2)
    top = 1.1 * frequencies(bars(tmp_path / "fine.bdf", 12), 4)[3]
    used, reduced, problem = modelled(model, [record(model, top)], 0.01)
    missed = used.unresolved
    assert missed is not None
    assert reduced.model is used
    assert problem.band[1] == missed.limit < top
    assert missed.share == pytest.approx(1 - missed.limit / top, abs=0.03)
    assert problem.lines(reduced)[0].freq.max() <= missed.limit
    assert f"up to {missed.limit:.3g} Hz it has" in missed.text
    assert f"{100 * missed.share:.2g} % of the recorded power; refine property 7" in missed.text


def test_a_mesh_that_is_fine_enough_keeps_its_band(tmp_path: Path) -> None:
    coarse, fine = bars(tmp_path / "m.bdf", 3), bars(tmp_path / "fine.bdf", 12)
    top = 1.1 * frequencies(coarse, 4)[3]
    used, _, problem = modelled(fine, [record(fine, top)], 0.01)
    assert used is fine
    assert problem.band[1] > 0.95 * top


def strip(path: Path, n: int) -> Model:
    """A plate of n x 1 shells, clamped at one end, bending about Y."""
    lines = [
        "SOL 103",
        "CEND",
        "SPC = 1",
        "BEGIN BULK",
        "PARAM,COUPMASS,1",
        "MAT1,1,7.0+10,,0.,2700.",
        "PSHELL,4,1,.01,1,,1",
    ]
    lines += [f"GRID,{2 * i + j + 1},,{LENGTH * i / n:.9f},{0.08 * j},0." for i in range(n + 1) for j in range(2)]
    lines += [f"CQUAD4,{i + 1},4,{2 * i + 1},{2 * i + 3},{2 * i + 4},{2 * i + 2}" for i in range(n)]
    lines += ["SPC1,1,123456,1,2", f"SPC1,1,1246,3,THRU,{2 * n + 2}", "ENDDATA", ""]
    path.write_text("\n".join(lines))
    return read_model(path)


def test_waves_of_shells_are_told_by_how_much_their_nodes_differ(tmp_path: Path) -> None:
    model = strip(tmp_path / "m.bdf", 10)
    f = frequencies(model, 3)
    found = mode_resolution(reduced_to(model, 1.1 * f[2]), 1.1 * f[2])
    # k L = 7.8548: eight elements a wavelength
    assert found.points[2] == pytest.approx(2 * np.pi / 0.78548, rel=0.15)
    assert found.excess[2] == pytest.approx(found.error[2] / np.hypot(MESH_SD, MODE_SD))
    refined = replace(model, refines=model)
    assert not mode_resolution(reduced_to(refined, 1.1 * f[2]), 1.1 * f[2]).error.any()


def test_nothing_is_known_of_a_mesh_without_modes_in_the_band(tmp_path: Path) -> None:
    model = bars(tmp_path / "m.bdf", 3)
    assert unresolved(reduced_to(model, 10.0), (0.1, 10.0)) is None
    assert "refine the mesh" in Unresolved(10.0, 0.1, 3.0, 0, 5.0, 0.2).text
