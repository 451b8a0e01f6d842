"""Tachos: edges, repairs, speed and angle against shafts that are known."""

from __future__ import annotations

import re

import numpy as np
import pytest
from scipy import signal

from femend.data import Channel, Speed, TimeData
from femend.errors import SignalError
from femend.signal import find_edges, repair_pulses, speed_from_edges, speed_from_profile, tacho_speed
from femend.signal import tacho as tacho_module
from femend.signal.tacho_doubts import varies_slowly

DT = 1 / 2048
T = DT * np.arange(2048 * 20)


def angle_of(t: np.ndarray) -> np.ndarray:
    """A shaft that runs up from 5 to 20 rev/s in 20 s with a slow swing."""
    return 2 * np.pi * (5 * t + 0.375 * t**2) + 0.2 * np.sin(2 * np.pi * t / 5)


def speed_of(t: np.ndarray) -> np.ndarray:
    return 5 + 0.75 * t + 0.04 * np.cos(2 * np.pi * t / 5)


def pulses(angle: np.ndarray, ppr: int = 1, width: float = 0.2, uneven: float = 0.0) -> np.ndarray:
    """Trapezoids of 5 V that rise through their middle at every 1/ppr of a turn, teeth out of place by `uneven`."""
    tooth = np.floor(angle / (2 * np.pi) * ppr + 0.5 * (1 - width))
    shift = uneven * np.sin(2.1 * np.mod(tooth, ppr)) * (np.mod(tooth, ppr) > 0)
    u = np.mod(angle / (2 * np.pi) * ppr - shift + 0.5 * (1 - width), 1) - 0.5 * (1 - width)
    flank = 0.02
    return 5 * np.clip((u + flank / 2) / flank, 0, 1) * np.clip((width + flank / 2 - u) / flank, 0, 1)


def tacho(values: np.ndarray, dt: float = DT) -> TimeData:
    return TimeData("run", dt, [values], [Channel(None, "tacho", "V", "tacho")])


def apart(speed: Speed, angle: np.ndarray, t: np.ndarray, turns: float = 1.0) -> np.ndarray:
    """Error of the angle in degrees between the first and the last pulse, whole turns (or teeth) left out."""
    inside = (t >= speed.start) & (t <= speed.stop)
    error = np.degrees(speed.at(t[inside])[1] - angle[inside])
    whole = 360 * turns
    return np.asarray((error + whole / 2) % whole - whole / 2)


def test_speed_and_angle_of_a_clean_tacho() -> None:
    speed = tacho_speed(tacho(pulses(angle_of(T))))
    assert (speed.missed, speed.doubled) == (0, 0)
    assert np.abs(apart(speed, angle_of(T), T)).max() < 0.2  # edges between samples of at most 3.5 degrees
    inner = T[(T > 1) & (T < 19)]
    assert np.abs(speed.at(inner)[0] / speed_of(inner) - 1).max() < 1e-3


def test_noise_moves_the_edges_and_the_spline_evens_them_out() -> None:
    rng = np.random.default_rng(0)
    speed = tacho_speed(tacho(pulses(angle_of(T)) + 0.3 * rng.standard_normal(T.size)))
    inner = T[(T > 1) & (T < 19)]
    assert np.abs(speed.at(inner)[0] / speed_of(inner) - 1).max() < 5e-3


def test_lost_pulses_are_put_in_and_bounces_thrown_out_and_both_counted() -> None:
    clean = find_edges(pulses(angle_of(T)), DT)
    lost = [20, 21, 90, 150]
    bounced = [40, 60, 61, 120]
    kept = np.delete(clean, lost)
    edges = np.sort(np.concatenate([kept, clean[bounced] + 0.006, clean[bounced[:1]] + 0.011]))
    train = repair_pulses(edges)
    assert (train.missed, train.doubled) == (4, 5)
    assert np.array_equal(train.t, kept)
    speed = speed_from_edges(edges)
    assert (speed.missed, speed.doubled) == (4, 5)
    assert np.abs(apart(speed, angle_of(T), T)).max() < 0.5
    assert any("2 lost pulses put in" in note for note in speed.notes)
    assert any("bounce" in note for note in speed.notes)


def test_a_tacho_that_bounces_at_every_pulse_is_repaired_or_refused_never_doubled() -> None:
    clean = find_edges(pulses(angle_of(T)), DT)
    edges = np.sort(np.concatenate([clean, clean + 0.004]))
    with pytest.raises(SignalError, match=r"edges are bounces \(\d+%, first at"):
        repair_pulses(edges)
    assert np.array_equal(repair_pulses(edges, most=1.1).t, clean)


def test_uneven_teeth_give_an_even_angle() -> None:
    values = pulses(angle_of(T), ppr=4, uneven=0.04)
    speed = tacho_speed(tacho(values), pulses_per_revolution=4, level=2.5)
    assert np.abs(speed.at(T[4000:-4000])[0] / speed_of(T[4000:-4000]) - 1).max() < 2e-3
    error = apart(speed, angle_of(T), T, 0.25)
    assert np.ptp(error) < 0.6  # its first pulse may be any tooth, out of place by up to 3.6 degrees
    assert np.abs(error).max() < 3.6 + 0.6
    as_they_are = speed_from_edges(find_edges(values, DT, level=2.5), smoothing=0.0)  # every tooth a turn of its own
    assert np.std(as_they_are.at(T[4000:-4000])[0] / 4 / speed_of(T[4000:-4000])) > 0.02


@pytest.mark.parametrize("noise", [0.0, 0.05])
def test_pulses_of_one_sample_still_give_the_angle(noise: float) -> None:
    dt = 1 / 256
    t = dt * np.arange(256 * 60)
    angle = 2 * np.pi * (2.5 * t + 23.5 * t**2 / 120) + 0.3 * np.sin(2 * np.pi * t / 7)
    away = np.abs(np.mod(angle - 0.4 + np.pi, 2 * np.pi) - np.pi)
    values = 5 * np.clip((0.3 - away) / 0.2, 0, 1) + noise * np.random.default_rng(1).standard_normal(t.size)
    speed = tacho_speed(tacho(values, dt))
    error = apart(speed, angle - 0.2, t)  # the trapezoid rises through its middle at 0.2 rad
    # 36 degrees to a sample at the top speed, edges are off by up to 10; the waveform's angle by a fraction of one
    assert np.abs(error[256:-256]).max() < 1.0
    assert abs(error.mean()) < 0.3
    assert any("whole waveform" in note for note in speed.notes)


def test_a_tacho_without_pulses_is_refused_by_name() -> None:
    with pytest.raises(SignalError, match=r"recording 'run', channel tacho \(tacho\): the tacho stays at 3") as caught:
        tacho_speed(tacho(np.full(1000, 3.0)))
    assert caught.value.channel == "tacho (tacho)"
    with pytest.raises(SignalError, match="has 0 tacho channels"):
        tacho_speed(TimeData("run", DT, [T], [Channel(None, "voltage", "V", "u")]))
    one = np.zeros(1000)
    one[500:510] = 5.0
    with pytest.raises(SignalError, match="has 1 pulses; at least 4"):
        tacho_speed(tacho(one))


@pytest.mark.parametrize("what", ["speed", "noisy speed", "angle", "counter", "up and down"])
def test_a_channel_that_holds_a_speed_or_an_angle_is_told(what: str) -> None:
    turns = angle_of(T) / (2 * np.pi)
    values = {
        "speed": 60 * speed_of(T),
        "noisy speed": 60 * speed_of(T) + np.random.default_rng(1).standard_normal(T.size),
        "angle": turns,
        "counter": np.floor(turns),
        "up and down": np.minimum(T, 20 - T),
    }[what]
    told = r"goes slowly between (\S+) and (\S+), as .* pulses are needed: name the channel that holds them"
    with pytest.raises(SignalError, match=told) as caught:
        tacho_speed(tacho(values))
    low, high = (float(v) for v in re.search(told, str(caught.value)).groups())  # type: ignore[union-attr]
    assert (low, high) == pytest.approx((values.min(), values.max()), abs=0.01 * np.ptp(values))


@pytest.mark.parametrize("cycles", [2, 3])
@pytest.mark.parametrize("noise", [0.0, 0.05])
def test_a_sine_of_few_cycles_holds_pulses(cycles: float, noise: float) -> None:
    values = np.sin(2 * np.pi * cycles * T / 20 - 0.3) + noise * np.random.default_rng(1).standard_normal(T.size)
    assert varies_slowly(values) == ""
    if not noise:  # which crosses a level more often
        with pytest.raises(SignalError, match=f"has {cycles} pulses; at least 4"):
            tacho_speed(tacho(values))


@pytest.mark.parametrize("apart_by", [0.4, 0.3, 0.15])
def test_two_pulses_at_uneven_places_of_a_turn(apart_by: float) -> None:
    """They were refused as pauses, or as bounces, whatever number the study stated."""
    angle = angle_of(T)
    values = np.maximum(pulses(angle, width=0.06), pulses(angle - 2 * np.pi * apart_by, width=0.06))
    speed = tacho_speed(tacho(values), pulses_per_revolution=2)
    assert (speed.missed, speed.doubled) == (0, 0)
    error = apart(speed, angle, T)
    first = -360 * apart_by if apart(speed, angle, T).mean() < -10 else 0.0  # angle 0 is at the first pulse's tooth
    assert np.abs((error - first + 180) % 360 - 180).std() < 0.1
    assert abs((error.mean() - first + 180) % 360 - 180) < 0.2
    told = (
        r"repeat themselves every 2 pulses, as 0\.\d\d to 0\.\d\d of a turn: is pulses_per_revolution = 2 instead of 1"
    )
    with pytest.raises(SignalError, match=told):
        tacho_speed(tacho(values))


def test_a_wheel_with_a_missing_tooth_is_counted_either_way() -> None:
    t = np.arange(8192 * 20) / 8192
    angle = angle_of(t)
    tooth = np.mod(np.floor(angle / (2 * np.pi) * 12 + 0.3), 12)
    values = np.where(tooth == 0, 0.0, pulses(angle, ppr=12, width=0.4))
    for stated, missed in ((12, True), (11, False)):
        speed = tacho_speed(tacho(values, 1 / 8192), pulses_per_revolution=stated)
        assert (speed.missed > 0) == missed
        inner = t[(t > 1) & (t < 19)]
        assert np.abs(speed.at(inner)[0] / speed_of(inner) - 1).max() < 1e-2


def test_pulses_that_halve_or_double_at_once_are_noted_with_the_time() -> None:
    """From 10 s on, or before it, every second pulse is lost: the speed fell to a half without a word."""
    clean = find_edges(pulses(angle_of(T)), DT)
    for lost, times in ((clean > 10.0, "2.0|1.9"), (clean < 10.0, "0.4|0.5")):
        speed = speed_from_edges(np.delete(clean, np.flatnonzero(lost)[::2]))
        (said,) = (note for note in speed.notes if "at once" in note)
        assert re.match(rf"from about (9\.[5-9]|10\.[0-5])\d* s on pulses are ({times})\d times as far apart", said)
    assert not any("at once" in note for note in speed_from_edges(clean).notes)
    steps = np.where(T < 10, 5.0, np.clip(5 + 50 * (T - 10), 5, 10))  # a drive that takes a tenth of a second
    drive = speed_from_edges(find_edges(pulses(2 * np.pi * np.cumsum(steps) * DT), DT))
    assert not any("at once" in note for note in drive.notes)


@pytest.mark.parametrize("rest", ["before", "after"])
def test_a_shaft_that_starts_or_stops_keeps_its_pulses(rest: str) -> None:
    """The last interval of one that stops, longer by far, made bounces of two thirds of all pulses before it."""
    rev = np.clip(18 - T if rest == "after" else T - 2, 0, None)
    angle = 2 * np.pi * np.cumsum(rev) * DT
    speed = tacho_speed(tacho(pulses(angle)))
    assert speed.doubled == 0
    assert speed.missed <= 2
    fast = T[(rev > 2) & (speed.start < T) & (speed.stop > T)]
    assert np.abs(speed.at(fast)[0] / np.interp(fast, T, rev) - 1).max() < 0.02


@pytest.mark.parametrize("end", [slice(None), slice(None, None, -1)])
def test_a_pulse_lost_first_is_put_in_unless_the_shaft_starts(end: slice) -> None:
    """From rest intervals become shorter by more than a tenth each, not just one of them."""
    lost = np.concatenate([[2.05, 1.12, 1.0], np.full(20, 0.99)])[end]
    start = np.concatenate([[2.41, 1.0], np.diff(np.sqrt(np.arange(2.0, 24)) / 0.4142)])[end]
    assert repair_pulses(np.cumsum(np.append(0.0, lost))).missed == 1
    assert repair_pulses(np.cumsum(np.append(0.0, start))).missed == 0


def test_a_shaft_that_stops_is_refused_with_the_time() -> None:
    values = pulses(angle_of(T))
    edges = find_edges(values, DT)
    start = float(edges[100])
    edges = np.concatenate([edges[:101], start + 10.45 * (edges[101] - edges[100]) + (edges[101:] - edges[101])])
    with pytest.raises(SignalError, match="pauses for") as caught:
        speed_from_edges(edges)
    assert caught.value.time == pytest.approx(start, abs=1e-6)


def test_a_profile_of_standstill_is_refused() -> None:
    with pytest.raises(SignalError, match="speed is 0 rev/s at 1 s"):
        speed_from_profile(np.array([0.0, 1.0, 2.0]), np.array([1.0, 0.0, 1.0]))


def test_a_speed_is_not_told_outside_its_pulses() -> None:
    speed = speed_from_profile(np.array([0.0, 2.0]), np.array([5.0, 5.0]))
    with pytest.raises(SignalError, match="known from 0 to 2 s, asked for"):
        speed.at(np.array([2.5]))
    with pytest.raises(SignalError, match="does not increase|falls by"):
        Speed([0.0, 2.0, 1.0], [1.0, 1, 1], [0.0, 1, 2])


@pytest.mark.parametrize(
    ("shape", "falling", "zero"), [("dips", False, 0.6), ("dips", True, 0.2), ("square", False, 0.0)]
)
def test_tachos_of_either_sense_at_few_samples(shape: str, falling: bool, zero: float) -> None:
    dt = 1 / 256
    t = dt * np.arange(256 * 60)
    angle = 2 * np.pi * (26 * t - 23.5 * t**2 / 120) + 0.3 * np.sin(2 * np.pi * t / 7)  # a run-down
    away = np.abs(np.mod(angle - 0.4 + np.pi, 2 * np.pi) - np.pi)
    values = 5.0 * (np.sin(angle) > 0) if shape == "square" else 5 - 5 * np.clip((0.3 - away) / 0.2, 0, 1)
    data = TimeData("run", dt, [values], [Channel(None, "tacho", "V", "tacho")], 7.0)  # the record need not begin at 0
    speed = tacho_speed(data, falling=falling)
    error = apart(speed, angle - zero, t + 7.0)[128:-128]
    # a square wave has no flank between samples: each edge is known to a twelfth root of 36 degrees, ten are averaged
    assert np.abs(error).max() < (4.0 if shape == "square" else 1.5)
    assert error.std() < (1.5 if shape == "square" else 0.3)


def soft(angle: np.ndarray, width: float, flank: float) -> np.ndarray:
    """Pulses of 5 V with smooth flanks that rise through their middle at every turn."""
    u = np.mod(angle / (2 * np.pi) + 0.3, 1) - 0.3
    rise, fall = (np.clip(v, 0, 1) for v in ((u + flank / 2) / flank, (width + flank / 2 - u) / flank))
    return 5 * rise**2 * (3 - 2 * rise) * fall**2 * (3 - 2 * fall)


@pytest.mark.parametrize("rate", [256, 512, 2048])
@pytest.mark.parametrize("shape", ["sine", "flanks"])
def test_soft_flanks_with_noise_are_not_biased(rate: int, shape: str) -> None:
    """Noise of 1 % of the range: a level taken from percentiles is off by it, and so is each crossing by itself."""
    t = np.arange(rate * 30) / rate
    angle = angle_of(t)
    clean = 2.5 + 2.5 * np.sin(angle) if shape == "sine" else soft(angle, 0.2, 0.15)
    speed = tacho_speed(tacho(clean + 0.05 * np.random.default_rng(1).standard_normal(t.size), 1 / rate))
    error = apart(speed, angle, t)
    assert abs(error.mean()) < 0.1
    assert error.std() < 0.2
    assert any("whole waveform" in note for note in speed.notes)


@pytest.mark.parametrize(("rate", "cut"), [(2048, 60.0), (512, 60.0), (256, 60.0), (256, 100.0)])
def test_filtered_pulses_do_not_drift_with_the_speed(rate: int, cut: float) -> None:
    """Behind a filter without delay pulses get lower and wider as the shaft gets faster."""
    often = 8
    fine = np.arange(rate * often * 20) / (rate * often)
    low = signal.butter(2, cut, fs=rate * often, output="sos")
    values = signal.sosfiltfilt(low, pulses(angle_of(fine), width=0.2 if cut == 60.0 else 0.1))[::often]
    t = np.arange(values.size) / rate
    speed = tacho_speed(tacho(values + 0.02 * np.random.default_rng(2).standard_normal(t.size), 1 / rate))
    error = apart(speed, angle_of(t), t)
    quarters = [part.mean() for part in np.array_split(error, 4)]
    assert max(quarters) - min(quarters) < 0.2
    assert error.std() < 0.2
    assert abs(error.mean()) < 0.2


def narrow(duty: float) -> tuple[np.ndarray, np.ndarray, float]:
    """Pulses that last the share `duty` of a turn of 1280 samples, behind a filter of 0.4 of the rate without delay,
    with noise of 0.2 %; turns that the shaft has made, and the rate."""
    rate, often, seconds = 25600, 16, 4
    t = np.arange(rate * often * seconds) / (rate * often)
    turns = 20.0 * t + np.sin(2 * np.pi * 0.5 * t) / (2 * np.pi)
    low = signal.butter(8, 0.4 * rate, fs=rate * often, output="sos")
    values = signal.sosfiltfilt(low, ((turns % 1) < duty).astype(float))[::often]
    return values + 0.002 * np.random.default_rng(0).standard_normal(values.size), turns[::often], float(rate)


@pytest.mark.parametrize("duty", [0.004, 0.01, 0.03])
def test_narrow_filtered_pulses_are_read_at_their_edges(duty: float) -> None:
    """5 to 13 samples of 1280 a turn above the middle: fitted as a waveform they were up to 18 degrees off."""
    values, turns, rate = narrow(duty)
    speed = tacho_speed(tacho(values, 1 / rate))
    error = apart(speed, 2 * np.pi * turns, np.arange(values.size) / rate)
    assert error.std() < 0.02
    assert np.abs(error).max() < 0.1  # a sample is 0.28 degrees


def test_what_memory_does_not_hold_is_refined_by_less(monkeypatch: pytest.MonkeyPatch) -> None:
    values, turns, rate = narrow(0.01)
    t = np.arange(values.size) / rate
    sizes = []
    find = tacho_module.find_edges

    def seen(x: np.ndarray, *args: float, **kwargs: float) -> np.ndarray:
        sizes.append(x.size)
        return find(x, *args, **kwargs)

    monkeypatch.setattr(tacho_module, "find_edges", seen)
    for times in (10.0, 2.5, 1.5):
        monkeypatch.setattr(tacho_module, "MOST_REFINED", int(times * values.size))
        error = apart(tacho_speed(tacho(values, 1 / rate)), 2 * np.pi * turns, t)
        assert max(sizes) <= times * values.size
        assert error.std() < (0.02 if times > 2 else 2.0)  # the waveform of few samples, as without a filter
        sizes.clear()


@pytest.mark.parametrize("falling", [False, True])
def test_crossings_of_a_slow_flank_are_late_as_often_as_early(falling: bool) -> None:
    """Noise crosses the level several times on the flank of a sine: the last crossing alone is 3 degrees late."""
    t = DT * np.arange(2048 * 60)
    values = np.sin(2 * np.pi * 5.003 * t) + 0.1 * np.random.default_rng(3).standard_normal(t.size)
    edges = find_edges(values, DT, level=0.0, falling=falling)
    error = 360 * (5.003 * edges - np.round(5.003 * edges + 0.5 * falling) + 0.5 * falling)
    assert edges.size == pytest.approx(300, abs=1)
    assert abs(error.mean()) < 0.4  # 300 edges of 2 degrees each
