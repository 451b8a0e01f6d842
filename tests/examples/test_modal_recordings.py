"""Modes of real structures: what others stated about them is found."""

from __future__ import annotations

import re
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import csd

from femend.data import FRF, Channel
from femend.dof import Dof
from femend.modal import identify_modes

Find = Callable[[str], Path]


def frf_of(f: NDArray, H: NDArray, outputs: list[Dof], force: Dof, unit: str = "m/s^2/N") -> FRF:
    channels = tuple(Channel(dof, "acceleration", "m/s^2") for dof in outputs)
    return FRF("real", f, H[:, :, None], channels, (Channel(force, "force", "N"),), "accelerance", unit)


def nearest(found: NDArray[np.float64], stated: list[float]) -> NDArray[np.float64]:
    return np.array([found[np.argmin(np.abs(found - f))] for f in stated])


def test_three_storey_frame(shared: Find) -> None:
    lines = shared("data/three_storey/Experimental_drive_floor1.csv").read_text().split()
    table = np.array([[complex(v) for v in line.split(";")] for line in lines])
    floors = [Dof(n, 1) for n in (10, 20, 30)]
    test = identify_modes(frf_of(table[:, 0].real, table[:, 1:], floors, Dof(10, 1)), (2.0, 100.0))
    # the chain's three modes, and the two motions a chain does not have
    stated = [6.50, 17.47, 26.50, 42.0, 76.8]
    assert nearest(test.modes.freq, stated) == pytest.approx(stated, rel=0.004)
    assert test.modes.n_modes <= 6
    assert test.error < 0.05
    assert test.checks[0].verdict == "ok"
    # a chain of equal storeys: sum over its modes of phi^2 is 1 / mass at every floor, and the mass is 5.201 kg
    phi = test.modes.to_mode_set().phi[:, :3]
    assert 1 / np.sum(phi**2, axis=1) == pytest.approx(5.201, rel=0.05)


def test_f16_at_low_level(shared: Find) -> None:
    path = shared("data/f16_gvt/F16Data_FullMSine_Level1.csv")
    values = np.loadtxt(path, delimiter=",", skiprows=1, usecols=range(5), max_rows=9 * 8192)
    spectra = np.fft.rfft(values.reshape(9, 8192, 5)[1:], axis=1).mean(axis=0)  # without the first, transient period
    f = np.fft.rfftfreq(8192, 1 / 400)
    force = np.abs(spectra[:, 0])
    excited = (force > 0.1 * np.median(force[(f > 3) & (f < 14)])) & (f > 2) & (f < 15)
    H = spectra[excited, 2:] / spectra[excited, :1]
    test = identify_modes(frf_of(f[excited], H, [Dof(n, 3) for n in (1, 2, 3)], Dof(1, 3)))
    stated = [5.2, 7.3, 9.2]
    assert nearest(test.modes.freq, stated) == pytest.approx(stated, rel=0.01)
    strongest = np.sort(test.modes.freq[np.argsort(test.modal_mass)[:2]])
    assert strongest == pytest.approx([7.3, 9.2], rel=0.01)  # the wing-tip payload's modes


def test_five_storey_tower(shared: Find) -> None:
    # the mass damper's inertia force excites the fifth floor; runs without control
    folder, g = shared("data/five_storey_tower"), 9.8
    found = []
    for run in ("wn_01.dat", "wn_03.dat"):
        d = np.loadtxt(folder / run)
        force = -1500.0 * g * d[:, 1]
        floors = g * np.stack([2 * d[:, 4], d[:, 5], d[:, 6], 2 * d[:, 3], -d[:, 2]])
        f, cross = csd(force, floors, fs=100, nperseg=8192)
        _, auto = csd(force, force, fs=100, nperseg=8192)
        frf = frf_of(f, (cross / auto).T, [Dof(n, 1) for n in (1, 2, 3, 4, 5)], Dof(5, 1))
        found.append(identify_modes(frf, (0.3, 8.0)))
    stated = [0.525, 1.77, 5.35]  # peaks of the transfer functions, read to 0.5, 2 and 1 %
    for test in found:
        assert nearest(test.modes.freq, stated) == pytest.approx(stated, rel=0.025)
    # run to run the structure itself shifts (damping 2 %, level not the same): 2 %, not the modes' own 0.2 %
    a, b = (nearest(test.modes.freq, stated) for test in found)
    assert a == pytest.approx(b, rel=0.02)


NAMES = ["1r", "2r", "3r", "4r", "5r", "1g", "2g"]  # wing and fuselage; on the tail (1b, 2b) the hammer bounced
CELL = re.compile(rb'<c r="([ACD])\d+"[^>]*><v>([^<]*)</v>')


def blow(path: Path) -> tuple[NDArray, NDArray, float]:
    """Force and acceleration from just before the blow, over 8 s, and the time step. The force is a pulse of at most
    10 ms: what else its channel has is noise."""
    with zipfile.ZipFile(path) as book:
        sheet = book.read("xl/worksheets/sheet1.xml")
    columns: dict[bytes, list[float]] = {b"A": [], b"C": [], b"D": []}
    for column, text in CELL.findall(sheet):
        columns[column].append(float(text))
    t, force, a = (np.array(columns[c][-16500:]) for c in (b"A", b"C", b"D"))
    dt = (t[-1] - t[0]) / (t.size - 1)
    force = force - np.median(force)
    peak = int(np.argmax(np.abs(force)))
    force[np.abs(np.arange(force.size) - peak) > 0.01 / dt] = 0.0
    keep = slice(peak - 16, peak - 16 + int(8 / dt))
    return force[keep], (a - a[: peak - 20].mean())[keep], dt


def test_close_pair_of_a_model_aircraft(shared: Find) -> None:
    folder = shared("data/model_aircraft/01_Modformen_Modfrequenzen/Messungen_python")
    H = []
    for name in NAMES:
        force, a, dt = blow(folder / f"{name}_5r_Python.xlsx")
        H.append(np.fft.rfft(a) / np.fft.rfft(force))
    f = np.fft.rfftfreq(force.size, dt)
    dofs = [Dof(n, 3) for n in range(1, 8)]
    # blows go down and accelerometers point up
    frf = frf_of(f, np.array(H).T, dofs, Dof(5, 3, -1))
    roll = identify_modes(frf, (3.5, 9.0))
    assert roll.modes.freq == pytest.approx([5.048], rel=0.01)
    pair = identify_modes(frf, (40.0, 56.0))
    assert pair.modes.n_modes == 2
    assert pair.modes.freq[0] == pytest.approx(46.34, rel=0.01)
    # 49.7 Hz was read off one line; the imaginary parts of these seven FRFs peak between 49.9 and 50.9 Hz
    assert pair.modes.freq[1] == pytest.approx(49.707, rel=0.02)
    assert pair.modes.freq[1] - pair.modes.freq[0] > 3
    assert pair.checks[0].verdict == "ok"
    wrong = identify_modes(frf_of(f, np.array(H).T, dofs, Dof(5, 3)), (40.0, 56.0))
    assert wrong.checks[0].verdict == "reversed"
