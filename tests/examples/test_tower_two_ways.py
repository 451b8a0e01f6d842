"""The five-storey tower two ways: modes by its FRFs and by its responses alone, from the same runs."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from femend import Channel, Dof, TimeData, identify_modes
from femend.modal.output_only import identify_output_only
from femend.signal import estimate_frf

G = 9.8
# columns of the floors from the first up, with their factors to g; column 1 is the acceleration of the mass damper
FLOORS = ((4, 2.0), (5, 1.0), (6, 1.0), (3, 2.0), (2, -1.0))
DAMPER = 1500.0
BAND = (0.3, 8.0)
# where the damper's force explains less than this of a floor's motion around a mode, its FRFs do not tell the mode
COHERENT = 0.75


def tower(path: Path) -> TimeData:
    """The damper's inertia force on the fifth floor and the accelerations of all floors."""
    table = np.loadtxt(path)
    force = -DAMPER * G * table[:, 1]
    floors = np.array([G * factor * table[:, column] for column, factor in FLOORS])
    labels = tuple(Channel(Dof(n, 1), "acceleration", "m/s^2") for n in range(1, 6))
    return TimeData(path.stem, 0.01, np.vstack([force, floors]), (Channel(Dof(5, 1), "force", "N"), *labels))


def compared(data: TimeData) -> list[tuple[float, float]]:
    """Frequency by FRF and without the force, of every mode around which the coherence allows it."""
    frf = estimate_frf(data, resolution=data.rate / 8192).frf
    assert frf.coherence is not None
    test = identify_modes(frf, BAND)
    alone = identify_output_only(data.select(range(1, 6)), BAND)
    rows = []
    for freq, zeta in zip(test.modes.freq, test.modes.zeta, strict=True):
        around = np.abs(frf.freq - freq) < max(zeta * freq, 2 * frf.freq[1])
        if frf.coherence[around, :, 0].mean(axis=0).max() >= COHERENT:
            rows.append((float(freq), float(alone.freq[np.argmin(np.abs(alone.freq - freq))])))
    return rows


@pytest.mark.parametrize("run", ["wn_01", "wn_03"])
def test_modes_by_frf_and_by_responses_alone_agree(shared: Callable[[str], Path], run: str) -> None:
    """Within 1 %, but for the first: 1.2 and 1.4 %, each time lower without the force. With the force known the damper
    is none of the structure; to the responses alone its 1.5 t ride on the top floor, where one per cent of the tower's
    modal mass more is half a per cent of frequency less."""
    rows = compared(tower(shared(f"data/five_storey_tower/{run}.dat")))
    assert len(rows) == 4
    (first, alone), *higher = rows
    assert first == pytest.approx(0.525, rel=0.01)
    assert 0.98 * first < alone < first
    for by_frf, by_responses in higher:
        assert by_responses == pytest.approx(by_frf, rel=0.01)


def test_the_second_run_gives_no_modes_by_frf_and_says_why(shared: Callable[[str], Path]) -> None:
    """A limit: coherent as the FRFs of this run are, its modes explain no more than seven times what the fit leaves
    around them, and ten are asked for. They stand among the dropped ones with that reason, not in the result."""
    data = tower(shared("data/five_storey_tower/wn_02.dat"))
    test = identify_modes(estimate_frf(data, resolution=data.rate / 8192).frf, BAND)
    assert test.status == "no modes"
    assert test.advice
    refused = np.array([d.freq for d in test.dropped if "explains only" in d.reason])
    for stated in (0.525, 1.77, 5.35):
        assert np.abs(refused / stated - 1).min() < 0.02
