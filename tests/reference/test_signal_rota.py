"""The Vold-Kalman filter against another implementation of the same least squares (PyPI: rota-order)."""

from __future__ import annotations

from collections.abc import Callable
from types import ModuleType

import numpy as np

from femend.data import Channel, Speed, TimeData
from femend.dof import Dof
from femend.signal import vold_kalman


def test_crossing_shafts_as_another_filter_tracks_them(optional_module: Callable[[str], ModuleType]) -> None:
    extract = optional_module("rota.extract")
    rate, n = 256.0, 256 * 30
    t = np.arange(n) / rate
    speeds, waves = [], []
    for low, slope, amplitude in ((8.0, 0.5, 1 + 0.3 * np.sin(2 * np.pi * t / 9)), (22.0, -0.4, 0.6 * np.exp(1j))):
        angle = 2 * np.pi * (low * t + 0.5 * slope * t**2)
        speeds.append(Speed(t, low + slope * t, angle, "known"))
        waves.append(np.real(amplitude * np.exp(1j * angle)))
    x = sum(waves) + 0.1 * np.random.default_rng(0).standard_normal(n)
    data = TimeData("x", 1 / rate, [x], [Channel(Dof(1, 3), "acceleration", "m/s^2")])
    ours = vold_kalman(data, speeds, [[1.0, 2.0], [1.0]], bandwidth=1.0, t=t)
    rpm = 60 * np.column_stack([s.rev_per_s for s in speeds])
    # its bandwidth is one-sided, half of ours; its angles begin at 0 as ours do
    parts = extract.order_waveform(x, rate, rpm, [1.0, 2.0, 1.0], bandwidth=0.5, shafts=[0, 0, 1])
    theirs = np.asarray(parts.envelopes).reshape(n, 3).T  # (sample, order)
    inner = (t > 2) & (t < 28)
    apart = np.abs(ours.values[:, 0, inner] - theirs[:, inner])
    assert apart.max() < 2e-4  # one least squares: splines against samples, and angles that it integrates
