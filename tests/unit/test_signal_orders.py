"""Order tracking against sweeps whose amplitudes and phases are known."""

from __future__ import annotations

import numpy as np
import pytest

from femend.data import Channel, Speed, TimeData
from femend.dof import Dof
from femend.errors import RecordingError, SignalError
from femend.signal import speed_from_profile, vold_kalman

DT, N = 1 / 256, 25600


def channel(node: int) -> Channel:
    return Channel(Dof(node, 3), "acceleration", "m/s^2", f"a{node}")


def run_up(low: float = 3.0, high: float = 25.0) -> Speed:
    t = DT * np.arange(N)
    speed = low + (high - low) * t / t[-1]
    angle = 2 * np.pi * (low * t + (high - low) * t**2 / (2 * t[-1]))
    return Speed(t, speed, angle, "known")


def record(*parts: np.ndarray, noise: float = 0.0, seed: int = 0) -> TimeData:
    values = sum(parts) + noise * np.random.default_rng(seed).standard_normal(N)
    return TimeData("sweep", DT, np.atleast_2d(values), (channel(1),))


def order_of(speed: Speed, order: float, amplitude: complex | np.ndarray) -> np.ndarray:
    return np.real(amplitude * np.exp(1j * order * speed.angle))


def inner(track_t: np.ndarray, margin: float = 3.0) -> np.ndarray:
    return (track_t > margin) & (track_t < N * DT - margin)


def test_constant_amplitudes_come_back_with_their_phases() -> None:
    speed = run_up()
    wanted = {1.0: 2.0 * np.exp(0.7j), 2.0: 0.5 * np.exp(-2.0j), 3.5: 0.1 + 0j}
    data = record(*(order_of(speed, o, a) for o, a in wanted.items()))
    track = vold_kalman(data, speed, list(wanted))
    for order, amplitude in wanted.items():
        # constants are in the filter's pass band: only the cross talk that the solve leaves, far below 1e-6
        assert np.abs(track.order(order)[0] - amplitude).max() < 1e-6


def test_the_filter_is_3_db_down_at_half_its_bandwidth() -> None:
    speed = Speed([0.0, N * DT], [20.0, 20.0], [0.0, 40 * np.pi * N * DT])
    t = DT * np.arange(N)
    envelope = np.cos(2 * np.pi * 0.5 * t)  # 0.5 Hz, half of a bandwidth of 1 Hz
    data = record(envelope * np.cos(40 * np.pi * t))
    for poles in (1, 2, 3):
        track = vold_kalman(data, speed, [1.0], bandwidth=1.0, poles=poles)
        keep = inner(track.t, 10.0)
        gain = np.real(track.values[0, 0, keep]).std() / np.cos(2 * np.pi * 0.5 * track.t[keep]).std()
        assert gain == pytest.approx(np.sqrt(0.5), abs=4e-3), poles  # the envelope is a cubic spline, not any function


def test_crossing_orders_of_two_shafts_are_told_apart() -> None:
    first, second = run_up(5.0, 25.0), run_up(20.0, 10.0)  # meet once, where each has its amplitude still
    data = record(order_of(first, 1.0, 1.0 * np.exp(0.3j)), order_of(second, 1.0, 0.6 * np.exp(-1.0j)), noise=0.02)
    track = vold_kalman(data, [first, second], [[1.0], [1.0]], bandwidth=0.5)
    gap = np.abs(track.freq[0] - track.freq[1])
    assert gap.min() < 0.05
    keep = inner(track.t)
    assert np.abs(track.order(1.0, 0)[0, keep] - np.exp(0.3j)).max() < 0.03
    assert np.abs(track.order(1.0, 1)[0, keep] - 0.6 * np.exp(-1.0j)).max() < 0.03
    # one at a time they beat against each other where they meet, which is what the joint solve is for
    alone = vold_kalman(data, first, [1.0], bandwidth=0.5)
    assert np.abs(alone.order(1.0)[0, keep] - np.exp(0.3j)).max() > 0.2


def test_beating_orders_are_told_apart() -> None:
    speed = run_up(20.0, 25.0)
    data = record(order_of(speed, 1.0, 1.0 + 0j), order_of(speed, 1.02, 0.5j))
    track = vold_kalman(data, speed, [1.0, 1.02], bandwidth=0.2)  # 0.4 to 0.5 Hz apart
    keep = inner(track.t, 10.0)
    assert np.abs(track.order(1.0)[0, keep] - 1).max() < 1e-3
    assert np.abs(track.order(1.02)[0, keep] - 0.5j).max() < 1e-3


def test_noise_is_reduced_as_the_bandwidth_says() -> None:
    speed = Speed([0.0, N * DT], [20.0, 20.0], [0.0, 40 * np.pi * N * DT])
    track = vold_kalman(record(np.zeros(N), noise=1.0), speed, [1.0], bandwidth=1.0)
    keep = inner(track.t, 5.0)
    # |H|^2 of two poles, 1/(1 + (sqrt 2 - 1)(2 f/B)^4)^2, has a noise bandwidth of 1.0387 B; the envelope's density
    # is 4 dt over f both sides (2 dt for each of real and imaginary part)
    wanted = 4 * DT * 1.0387
    power = float(np.mean(np.abs(track.values[0, 0, keep]) ** 2))
    assert power == pytest.approx(wanted, rel=0.35)  # some 90 independent values


def test_an_order_above_the_nyquist_frequency_is_marked_or_refused() -> None:
    speed = run_up()
    data = record(order_of(speed, 1.0, 1.0 + 0j))
    track = vold_kalman(data, speed, [1.0, 10.0])
    assert track.usable[0].all()
    assert not track.usable[1, -1]
    assert track.usable[1, 0]
    assert not track.values[1, 0, ~track.usable[1]].any()
    with pytest.raises(SignalError, match="order 60 lies from 180"):
        vold_kalman(data, speed, [60.0])


@pytest.mark.parametrize("orders", [[], [0.0], [-1.0], [1.0, 1.0], [float("nan")]])
def test_orders_that_are_none_are_refused(orders: list[float]) -> None:
    with pytest.raises(SignalError, match="order"):
        vold_kalman(record(np.zeros(N)), run_up(), orders)


def test_a_speed_of_another_time_and_a_short_record_are_refused() -> None:
    data = record(np.ones(N), noise=0.1)
    late = speed_from_profile(np.array([200.0, 300.0]), np.array([5.0, 6.0]))
    with pytest.raises(SignalError, match="do not overlap"):
        vold_kalman(data, late, [1.0])
    with pytest.raises(SignalError, match="too short for a bandwidth of 0.01"):
        vold_kalman(data, run_up(), [1.0], bandwidth=0.01)


def test_a_track_is_cut_chosen_and_asked_by_order() -> None:
    speed = run_up()
    track = vold_kalman(record(order_of(speed, 1.0, 1 + 1j)), speed, [1.0, 2.0])
    part = track.between(20.0, 30.0)
    assert part.t.min() >= 20
    assert part.t.max() <= 30
    assert np.array_equal(part.order(2.0), track.order(2.0)[:, (track.t >= 20) & (track.t <= 30)])
    assert track.select([0]).channels == track.channels
    assert track.freq[1] == pytest.approx(2 * track.speed)
    with pytest.raises(KeyError, match=r"order 3 of shaft 0 was not tracked in 'sweep'; there are 1, 2"):
        track.order(3.0)
    with pytest.raises(RecordingError, match="nothing lies between 200 and 300"):
        track.between(200.0, 300.0)


def test_what_the_orders_leave_is_told_for_every_channel() -> None:
    speed = run_up()
    track = vold_kalman(record(order_of(speed, 1.0, 1 + 1j), noise=0.1), speed, [1.0])
    assert track.residual is not None
    assert track.residual[0] == pytest.approx(0.1, rel=0.03)  # of 25600 samples, less some per cent in the band


def test_filters_that_are_none_are_refused() -> None:
    data = record(np.ones(N), noise=0.1)
    with pytest.raises(SignalError, match="filter of 4 poles"):
        vold_kalman(data, run_up(), [1.0], poles=4)
    with pytest.raises(SignalError, match="bandwidth of 0 Hz"):
        vold_kalman(data, run_up(), [1.0], bandwidth=0.0)
