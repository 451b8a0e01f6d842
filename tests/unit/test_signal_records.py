"""Records: what is wrong with them, integrals and derivatives, other rates, several on one axis, correlations."""

from __future__ import annotations

import numpy as np
import pytest

from femend.data import Channel, Speed, TimeData
from femend.dof import Dof
from femend.errors import SignalError
from femend.signal import (
    angular_orders,
    check_signals,
    correlations,
    cross_spectra,
    find_gaps,
    half_spectra,
    merge,
    ods_frf,
    require_duration,
    require_sound,
    resample,
    sample_at,
    to_quantity,
    vold_kalman,
)

from .signal_models import acceleration

DT = 1 / 256
T = DT * np.arange(2560)


def data(*rows: np.ndarray, quantity: str = "acceleration", unit: str = "m/s^2", dt: float = DT) -> TimeData:
    channels = [Channel(Dof(i + 1, 3), quantity, unit, f"c{i + 1}") for i in range(len(rows))]
    return TimeData("rec", dt, np.vstack(rows), channels)


def noise(seed: int = 0, n: int = 2560) -> np.ndarray:
    return np.random.default_rng(seed).standard_normal(n)


def test_sound_channels_have_no_faults() -> None:
    record = data(noise(1), np.sin(T), np.round(3 * np.sin(2 * np.pi * T / 5) * 50) / 50, noise(2) * 5)
    assert check_signals(record) == ()
    assert require_sound(record) is record


def test_a_dead_channel_is_named() -> None:
    faults = check_signals(data(noise(), np.full(2560, 0.3)))
    assert [(f.kind, f.row, f.count) for f in faults] == [("dead", 1, 2560)]
    with pytest.raises(SignalError, match=r"channel acceleration 2:\+Z \(c2\) is 0.3 in all 2560 samples") as caught:
        require_sound(data(noise(), np.full(2560, 0.3)))
    assert caught.value.channel == "acceleration 2:+Z (c2)"


def test_a_clipped_channel_is_named_with_the_time() -> None:
    x = np.clip(np.sin(2 * np.pi * 3 * T) * np.where(T > 4, 2.0, 0.8), -1.2, 1.5)
    faults = check_signals(data(noise(), x))
    # both ends of its range in one: a sentence on several channels would name it twice, beside itself
    assert [f.kind for f in faults] == ["clipped"]
    assert 4.0 < faults[0].start < 4.4
    assert faults[0].stop > 9.0
    assert faults[0].row == 1
    assert "its largest value 1.5 m/s^2 and its smallest value -1.2 m/s^2 on" in faults[0].text
    with pytest.raises(SignalError, match="it is clipped") as caught:
        require_sound(data(noise(), x))
    assert caught.value.time == pytest.approx(faults[0].start)


def test_crests_of_coarse_quantisation_are_no_clips() -> None:
    assert check_signals(data(np.round(20 * np.sin(2 * np.pi * 0.5 * T)) / 20)) == ()


def test_a_held_stretch_and_a_weak_channel() -> None:
    x = noise()
    x[1000:1100] = x[1000]
    faults = check_signals(data(x, noise(1), noise(2), 1e-5 * noise(3)))
    assert [(f.kind, f.row) for f in faults] == [("held", 0), ("weak", 3)]
    assert faults[0].start == pytest.approx(1000 * DT)
    assert faults[0].count == 100


def test_gaps_are_found_in_values_and_in_stamps() -> None:
    t = np.delete(T, slice(500, 510))
    values = np.vstack([noise(), noise(1)])[:, : t.size].copy()
    values[1, 100:120] = np.nan
    faults = find_gaps(t, values, [acceleration(1), acceleration(2)], name="raw")
    assert [(f.kind, f.row, f.count) for f in faults] == [("gap", 1, 20), ("gap", -1, 10)]
    assert faults[0].start == pytest.approx(100 * DT)
    with pytest.raises(SignalError, match="turn back after"):
        find_gaps(t[::-1], values, [acceleration(1), acceleration(2)])


def test_a_record_too_short_for_the_lowest_frequency_is_refused() -> None:
    assert require_duration(data(noise()), 0.5) is not None
    with pytest.raises(SignalError, match=r"10 s holds 2 periods of the lowest wanted frequency 0.2 Hz; .* 25 s"):
        require_duration(data(noise()), 0.2)


W = 2 * np.pi * 6.3


@pytest.mark.parametrize(("quantity", "true"), [("velocity", W * np.cos(W * T)), ("displacement", np.sin(W * T))])
def test_integrals_have_no_drift(quantity: str, true: np.ndarray) -> None:
    record = data(-(W**2) * np.sin(W * T) + 5.0 + 3 * T, unit="mm/s^2")
    found = to_quantity(record, quantity, high_pass=1.0)
    assert found.channels[0].unit == ("mm/s" if quantity == "velocity" else "mm")
    inner = slice(512, -512)  # two periods of the high pass
    assert np.abs(found.values[0] - true)[inner].max() < 2e-3 * np.abs(true).max()
    assert np.abs(found.values[0] - true).max() < np.abs(true).max()  # nothing runs away at the ends


def test_the_gain_of_the_high_pass_is_the_one_that_is_told() -> None:
    for f, lowest, highest in ((0.5, 0.0, 0.3), (2.0, 0.996, 1.0), (5.0, 0.999, 1.001), (40.0, 0.999, 1.001)):
        w = 2 * np.pi * f
        t = DT * np.arange(256 * 60)
        found = to_quantity(data(-(w**2) * np.sin(w * t)), "displacement", high_pass=1.0)
        inner = slice(256 * 10, -256 * 10)
        gain = found.values[0, inner].std() / np.sin(w * t[inner]).std()
        assert lowest <= gain <= highest, f


def test_derivatives_are_exact_inside() -> None:
    found = to_quantity(data(np.sin(W * T), quantity="displacement", unit="mm"), "acceleration")
    assert found.channels[0].unit == "mm/s^2"
    assert np.abs(found.values[0] + W**2 * np.sin(W * T))[256:-256].max() < 1e-6 * W**2


def test_g_becomes_metres_and_forces_stay() -> None:
    record = TimeData(
        "rec", DT, [-(W**2) * np.sin(W * T), T], [Channel(Dof(1, 3), "acceleration", "g"), Channel(None, "force", "N")]
    )
    found = to_quantity(record, "velocity", high_pass=1.0)
    assert found.channels[0].unit == "m/s"
    assert found.values[0, 512:-512].std() == pytest.approx(9.80665 * W / np.sqrt(2), rel=5e-3)
    assert np.array_equal(found.values[1], T)


def test_integrals_that_cannot_be_are_refused() -> None:
    with pytest.raises(SignalError, match="1 periods of the high pass at 0.1 Hz; integrate with at least 0.2 Hz"):
        to_quantity(data(noise()), "velocity", high_pass=0.1)
    with pytest.raises(SignalError, match="'jerk' is none of"):
        to_quantity(data(noise()), "jerk")
    with pytest.raises(SignalError, match=r"force 1:\+Z \(c1\) cannot become a velocity"):
        to_quantity(data(noise(), quantity="force", unit="N"), "velocity", rows=[0])
    slow = TimeData("rec", 1e-4, [noise(n=200_000)], [acceleration(1)])
    with pytest.raises(SignalError, match="too low to integrate 10000 Hz"):
        to_quantity(slow, "displacement", high_pass=0.2)


@pytest.mark.parametrize("rate", [100.0, 512.0, 200.123])
def test_resampling_keeps_what_fits_and_takes_out_what_would_fold(rate: float) -> None:
    record = data(np.sin(2 * np.pi * 20 * T), np.sin(2 * np.pi * 122 * T))
    found = resample(record, rate)
    assert found.rate == pytest.approx(rate, rel=1e-12)
    inner = slice(40, -40)
    assert np.abs(found.values[0] - np.sin(2 * np.pi * 20 * found.t))[inner].max() < 2e-3
    if rate < 220:
        assert np.abs(found.values[1])[inner].max() < 5e-3


def test_samples_between_samples() -> None:
    times = np.sort(np.random.default_rng(0).uniform(0.2, 9.7, 500))
    found = sample_at(np.sin(2 * np.pi * 90 * T + 0.4), DT, times)
    assert np.abs(found[0] - np.sin(2 * np.pi * 90 * times + 0.4)).max() < 1e-4
    with pytest.raises(SignalError, match="asked for from 11 to 12 s, the record has 0 to"):
        sample_at(T, DT, np.array([11.0, 12.0]))


def test_records_of_other_rate_or_length_are_refused_or_brought_together() -> None:
    one, other = data(np.sin(2 * np.pi * 5 * T)), data(np.sin(2 * np.pi * 5 * np.arange(1000) / 100), dt=0.01)
    with pytest.raises(SignalError, match="'rec' has 100 Hz, 'rec' 256 Hz; say the rate"):
        merge([one, other])
    late = TimeData("late", DT, one.values[:, 256:], [acceleration(9)], 1.0)
    with pytest.raises(SignalError, match=r"'late' has 2304 samples from 1 s on, 'rec' 2560 from 0 s on") as caught:
        merge([one, late])
    assert caught.value.time == 1.0
    both = merge([one, late], cut=True)
    assert (both.t0, both.n_samples) == (1.0, 2304)
    assert np.array_equal(both.values[0], both.values[1])
    same = merge([one, other], rate=128.0, cut=True)
    inner = slice(50, -50)
    assert np.abs(same.values[0] - same.values[1])[inner].max() < 2e-3


def test_correlations_at_positive_lags_and_their_half_spectra() -> None:
    zeta, f = 0.03, 20.0
    w = 2 * np.pi * f
    pole = w * (-zeta + 1j * np.sqrt(1 - zeta**2))
    n = 256
    R = np.exp(pole * DT * np.arange(n)).real[:, None, None]
    found = correlations(data(noise(), noise(1)), 100)
    assert found.R.shape == (100, 2, 2)
    x = noise() - noise().mean()
    assert found.R[7, 0, 0] == pytest.approx((x[7:] * x[:-7]).sum() / (2560 - 7), rel=1e-10)
    y = noise(1) - noise(1).mean()
    assert found.R[7, 1, 0] == pytest.approx((y[7:] * x[:-7]).sum() / (2560 - 7), rel=1e-10)  # E[y(t + lag) x(t)]
    half = half_spectra(type(found)("h", DT, R, found.channels[:1], found.references[:1], 2560), end=0.01)
    s = 2j * np.pi * half.freq - (pole - half.decay)
    mirror = 2j * np.pi * half.freq - (pole.conjugate() - half.decay)
    inner = half.freq < 60
    exact = 0.5 / s + 0.5 / mirror
    assert np.abs(half.S[inner, 0, 0] - exact[inner]).max() < 0.02 * np.abs(exact).max()  # sums for integrals
    with pytest.raises(SignalError, match="2000 lags of 2560 samples"):
        correlations(data(noise()), 2000)


def test_cross_spectra_hold_the_mean_square_and_the_delay() -> None:
    x = noise(n=2**15)
    record = data(x, np.roll(x, 3))
    S = cross_spectra(record, [0], resolution=1.0)
    assert S.S[:, 0, 0].real.sum() * S.freq[1] == pytest.approx(x.var(), rel=0.03)
    lines = (S.freq > 5) & (S.freq < 100)
    assert np.abs(np.angle(S.S[lines, 1, 0] * np.exp(2j * np.pi * S.freq[lines] * 3 * DT))).max() < 0.1


def test_results_of_faulty_channels_are_refused_or_say_so() -> None:
    n = 25600
    t = DT * np.arange(n)
    speed = Speed([0.0, 100.0], [10.0, 10.0], [0.0, 2000 * np.pi])
    wave = np.cos(20 * np.pi * t)
    clipped = np.minimum(wave, 0.6)
    dead = data(wave, np.zeros(n))
    for make in (
        lambda d: vold_kalman(d, speed, [1.0]),
        lambda d: angular_orders(d, speed, [1.0]),
        lambda d: ods_frf(d, 0),
    ):
        with pytest.raises(SignalError, match=r"channel acceleration 2:\+Z \(c2\) is 0 in all 25600 samples"):
            make(dead)
        found = make(data(wave, clipped))
        assert any("acceleration 2:+Z (c2) stays at its largest value 0.6 m/s^2" in note for note in found.notes)
