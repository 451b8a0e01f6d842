"""Output-only modes of recordings of the shared data: methods and recordings that must agree with each other."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from femend import Channel, Dof, TimeData, read_recording
from femend.modal.output_only import OutputOnlyModes, identify_output_only
from femend.modal.output_only.stabilisation import mac

sys.path.insert(0, str(Path(__file__).parents[1]))
import oma_chain as oma

Shared = Callable[[str], Path]
RIG = "cases/rig/public/"


def agreement(a: OutputOnlyModes, b: OutputOnlyModes) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Relative frequency, MAC and position in `a` for the modes of `a` that have a partner in `b` of like shape."""
    alike = mac(a.modes.shapes, b.modes.shapes)
    near = np.abs(np.subtract.outer(a.freq, b.freq)) / a.freq[:, None]
    score = np.where(near < 0.03, alike, 0.0)
    best = score.argmax(axis=1)
    keep = np.flatnonzero(score[np.arange(a.freq.size), best] > 0.6)
    return near[keep, best[keep]], alike[keep, best[keep]], keep


@pytest.fixture(scope="module")
def rig_ambient(shared: Shared) -> OutputOnlyModes:
    data = read_recording(shared(RIG + "ambient.uff"), excitation="ambient").time
    return identify_output_only(data, (3.0, 15.0))


def test_the_methods_agree_on_the_rig(shared: Shared, rig_ambient: OutputOnlyModes) -> None:
    """Three close pairs between 5 and 12 Hz in 120 s. EFDD, which needs resolution, sees the lowest three."""
    assert rig_ambient.modes.n_modes == 6
    assert rig_ambient.status == "ok"
    data = read_recording(shared(RIG + "ambient.uff"), excitation="ambient").time
    for method, at_least in (("plscf", 5), ("efdd", 3)):
        other = identify_output_only(data, (3.0, 15.0), method)
        freq, alike, keep = agreement(rig_ambient, other)
        assert keep.size >= at_least
        assert freq.max() < 0.01
        assert np.median(alike) > 0.95


@pytest.mark.parametrize("method", ["ssi", "plscf"])
def test_the_run_up_of_the_rig_tells_the_ambient_modes(
    shared: Shared, rig_ambient: OutputOnlyModes, method: str
) -> None:
    data = read_recording(shared(RIG + "runup.uff"), excitation="ambient").time
    found = identify_output_only(data, (3.0, 15.0), method, speed=speed_of(data))
    freq, alike, keep = agreement(rig_ambient, found)
    assert keep.size >= 5
    assert freq.max() < 0.01
    assert alike.min() > 0.85


def speed_of(data: TimeData) -> np.ndarray:
    """Rotation frequency from a tacho of one clean pulse per revolution."""
    pulse = data.values[data.rows("tacho")[0]]
    level = 0.5 * (pulse.max() + pulse.min())
    edge = np.flatnonzero((pulse[1:] > level) & (pulse[:-1] <= level))
    at = data.t[edge] + data.dt * (level - pulse[edge]) / (pulse[edge + 1] - pulse[edge])
    return np.interp(data.t, 0.5 * (at[1:] + at[:-1]), 1 / np.diff(at))


@pytest.mark.parametrize("method", ["ssi", "plscf"])
def test_the_shear_frame(shared: Shared, method: str) -> None:
    """A simulated record with reference modes. Its time integration moves modes 2 to 5 down by 0.8, 1.7, 2.6 and 3.3 %
    (two published programs agree on that), so the shapes are held to the reference, and frequencies to what those
    programs find: within the stated uncertainty and the 0.3 % by which the choice of window moves pyOMA-2's mode 5.
    What the integration does to damping is not known; a tenth is allowed for it."""
    folder = shared("data/formats/oma_shearframe")
    y = np.load(folder / "data_shearframe.npy").T
    data = TimeData("shear frame", 1 / 12, y, tuple(Channel(Dof(i + 1, 1), "acceleration", "m/s^2") for i in range(5)))
    reference = np.load(folder / "omega_n.npy").ravel() / (2 * np.pi)
    moved = reference * (1 - np.array([-0.0005, 0.008, 0.017, 0.026, 0.033]))
    zeta = np.load(folder / "xi_ref.npy").ravel()
    found = identify_output_only(data, (0.08, 1.5), method)
    at = oma.nearest(found.freq, moved)
    assert len(set(at.tolist())) == 5
    assert (np.abs(found.freq[at] - moved) < 3 * found.modes.freq_sd[at] + 3e-3 * moved).all()
    assert (np.abs(found.zeta[at] - zeta) < 4 * found.modes.zeta_sd[at] + 0.1 * zeta).all()
    phi = np.load(folder / "phi_ref.npy").astype(complex)
    assert mac(found.modes.shapes[:, at], phi).diagonal().min() > 0.98


FLOORS = {1: (4, 2.0), 2: (5, 1.0), 3: (6, 1.0), 4: (3, 2.0), 5: (2, -9.8)}


def test_the_five_storey_tower(shared: Shared) -> None:
    """Three runs of a real tower, whose absorber is not the same in them: the same sway modes within 2 %."""
    runs = []
    for number in (1, 2, 3):
        table = np.loadtxt(shared(f"data/five_storey_tower/wn_0{number}.dat"))
        y = np.array([table[:, column] * factor for column, factor in FLOORS.values()])
        labels = tuple(Channel(Dof(floor, 1), "acceleration", "m/s^2") for floor in FLOORS)
        runs.append(identify_output_only(TimeData(f"wn_0{number}", 0.01, y, labels), (0.3, 8.0)))
    # peaks that the transfer from the absorber to the top floor shows, to two digits
    for run in runs:
        at = oma.nearest(run.freq, np.array([0.525, 1.77, 5.35]))
        assert run.freq[at] == pytest.approx([0.525, 1.77, 5.35], rel=0.04)
        assert run.freq[at][0] == pytest.approx(runs[0].freq[oma.nearest(runs[0].freq, np.array([0.52]))[0]], rel=0.02)
