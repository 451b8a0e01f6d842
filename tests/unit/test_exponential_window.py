"""An exponential window on a hammer's record is told by its noise and taken off; what only looks like one is none."""

from __future__ import annotations

import numpy as np
import pytest

from femend.data import Channel, Recording, TimeData
from femend.dof import Dof
from femend.signal.exponential import exponential_window_of, window_taken_off
from femend.study.file.channels_sound import with_warnings

DT, N, STRIKE = 1 / 1024, 4096, 120
T = DT * np.arange(N)


def struck(
    noise: float = 0.02, seed: int = 0, modes: tuple[tuple[float, float], ...] = ((14.0, 0.01), (61.0, 0.01))
) -> np.ndarray:
    """(4, N) a blow and three accelerations of `modes` (Hz, damping ratio), with white noise, a share of their rms."""
    rng = np.random.default_rng(seed)
    t = T - STRIKE * DT
    shapes = rng.uniform(-1, 1, (3, len(modes)))
    each = [np.where(t >= 0, np.exp(-2 * np.pi * f * z * t) * np.sin(2 * np.pi * f * t), 0.0) for f, z in modes]
    y = shapes @ np.array(each)
    u = np.where((t >= 0) & (t < 0.004), 100 * np.sin(np.pi * t / 0.004) ** 2, 0.0)
    y = y + noise * y.std(axis=1, keepdims=True) * rng.standard_normal(y.shape)
    return np.vstack([u + 0.05 * rng.standard_normal(N) * (noise > 0), y])


def recorded(values: np.ndarray) -> TimeData:
    channels = [Channel(Dof(1, 3), "force", "N")]
    channels += [Channel(Dof(k, 3), "acceleration", "m/s^2") for k in (1, 2, 3)]
    return TimeData("hit", DT, values, channels)


@pytest.mark.parametrize("end", [0.3, 0.05, 0.001])
@pytest.mark.parametrize("begin", [0, STRIKE])
def test_a_window_is_taken_off(end: float, begin: int) -> None:
    plain = struck()
    decay = -np.log(end) / T[-1]
    window = np.exp(-decay * np.maximum(T - begin * DT, 0.0))
    data = recorded((plain * window).astype("f4").astype(float))
    found = exponential_window_of(data)
    assert found is not None
    assert found.rows == (0, 1, 2, 3)
    # noise of 4096 samples at three sensors tells a rate to some hundredths of 1/s
    assert found.decay == pytest.approx(decay, abs=0.05)
    back = window_taken_off(data, found).values
    # what is missed of the beginning, which noise before the blow hardly tells, is a factor of force and motion alike
    gain = back[0].max() / plain[0].max()
    assert 0.8 < gain < 1.25
    early = slice(0, N // 4)
    for i in (1, 2, 3):
        left = np.linalg.norm(back[i, early] / gain - plain[i, early])
        assert left < 0.03 * np.linalg.norm(plain[i, early])


def test_a_force_without_the_window_is_left_as_it_is() -> None:
    values = struck()
    values[1:] *= np.exp(-1.2 * T)
    found = exponential_window_of(recorded(values))
    assert found is not None
    assert found.rows == (1, 2, 3)


@pytest.mark.parametrize(
    ("noise", "modes"),
    [
        (0.02, ((14.0, 0.01), (61.0, 0.01))),
        # what falls is not noise: a mode of little damping near the Nyquist frequency, and rounding without noise
        (1e-4, ((14.0, 0.01), (430.0, 0.0005))),
        (0.0, ((14.0, 0.01), (61.0, 0.01))),
    ],
)
def test_records_without_one_are_left_as_they_are(noise: float, modes: tuple[tuple[float, float], ...]) -> None:
    for seed in range(6):
        values = struck(noise, seed, modes).astype("f4").astype(float)
        assert exponential_window_of(recorded(values)) is None


def test_noise_that_falls_only_after_the_blow_and_was_none_before_is_no_window() -> None:
    values = struck(0.0)
    rng = np.random.default_rng(1)
    values[1:, STRIKE:] += 0.05 * np.exp(-1.5 * T[: N - STRIKE]) * rng.standard_normal((3, N - STRIKE))
    assert exponential_window_of(recorded(values)) is None


def test_it_is_told() -> None:
    values = struck() * np.exp(-2.0 * T)
    told = with_warnings(Recording("hit", recorded(values)))
    (text,) = [w for w in told.warnings if "exponential window" in w]
    assert "and the force" in text
    assert "exp(-2" in text
    assert np.abs(told.time.values[1, -400:]).mean() > 10 * np.abs(values[1, -400:]).mean()
