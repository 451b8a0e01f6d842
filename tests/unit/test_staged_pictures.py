"""Pictures of a study in stages have as many panels as there is to show."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from femend import Channel, Dof, Recording, TimeData
from femend.study.staged import pictures as staged_pictures
from femend.study.staged.pictures import mac_matrix, stabilisation

RATE, SECONDS = 100.0, 120.0


def ambient() -> Recording:
    """Two masses on springs, 6 and 14 Hz, under white noise, seen by three sensors."""
    n = int(RATE * SECONDS)
    rng = np.random.default_rng(6)
    w = 2 * np.pi * np.fft.rfftfreq(n, 1 / RATE)
    modal = []
    for f in (6.0, 14.0):
        W = 2 * np.pi * f
        gain = -(w**2) / (W**2 - w**2 + 2j * 0.01 * W * w)
        modal.append(np.fft.irfft(gain * np.fft.rfft(rng.standard_normal(n)), n))
    y = np.array([[1.0, 0.8], [0.7, -0.5], [0.3, 1.0]]) @ np.array(modal)
    channels = tuple(Channel(Dof(i, 3), "acceleration", "m/s^2") for i in (1, 2, 3))
    return Recording("ambient", TimeData("ambient", 1 / RATE, y, channels), excitation="ambient")


def drawn(figure: Any) -> list[bool]:
    """Whether there is something in each panel; colour bars have no title and do not count."""
    return [axis.has_data() for axis in figure.axes if axis.get_label() != "<colorbar>"]


def test_poles_of_one_recording_stand_alone() -> None:
    run: Any = SimpleNamespace(data=SimpleNamespace(frfs={}), test=[ambient()])
    assert drawn(stabilisation(run)) == [True]


def test_the_mac_of_one_stage_stands_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    shapes = np.eye(3)[:, :2]
    identified = SimpleNamespace(shapes=shapes, freq=np.array([6.0, 14.0]), dofs=())
    stage = SimpleNamespace(
        table=True, identified=identified, configuration="as modelled", name="modes", recordings=["ambient"]
    )
    run: Any = SimpleNamespace(
        final=SimpleNamespace(stages=[stage]), setup=SimpleNamespace(rows=lambda model, dofs: np.eye(3))
    )
    poles = 2 * np.pi * 1j * identified.freq
    monkeypatch.setattr(staged_pictures, "_shapes", lambda run, name: (None, poles, shapes + 0j))
    assert drawn(mac_matrix(run)) == [True]
