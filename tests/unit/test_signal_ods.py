"""Orders over the angle, speed from the orders, operating shapes and their steady state."""

from __future__ import annotations

import numpy as np
import pytest

from femend.data import FRF, Channel, Speed, TimeData
from femend.dof import Dof
from femend.errors import SignalError
from femend.signal import (
    angular_orders,
    modal_peaks,
    ods_frf,
    ods_of_order,
    one_sided,
    order_spectra,
    peak_frequencies,
    refine_speed,
    resample_angle,
    run_up_shapes,
    speed_from_profile,
    vold_kalman,
)

from .signal_models import accelerance, acceleration, force, measured, respond

DT, N = 1 / 256, 25600
T = DT * np.arange(N)


def run_up(low: float = 3.0, high: float = 25.0) -> Speed:
    speed = low + (high - low) * T / T[-1]
    return Speed(T, speed, 2 * np.pi * (low * T + (high - low) * T**2 / (2 * T[-1])), "known")


def order(speed: Speed, number: float, amplitude: complex) -> np.ndarray:
    return np.real(amplitude * np.exp(1j * number * speed.angle))


def test_orders_over_the_angle_have_amplitude_and_phase() -> None:
    speed = run_up()
    wanted = {1.0: 2 * np.exp(0.7j), 2.0: 0.5 * np.exp(-2j), 3.5: 0.1 + 0j}
    data = TimeData("s", DT, [sum(order(speed, o, a) for o, a in wanted.items())], [acceleration(1)])
    track = angular_orders(data, speed, list(wanted))
    for number, amplitude in wanted.items():
        # interpolation is good to 1e-4 of the largest order
        assert np.abs(track.order(number)[0] - amplitude).max() < 1e-3
    spectra = order_spectra(data, speed, 5.0, revolutions=8)
    for number, amplitude in wanted.items():
        assert np.abs(spectra.order(number)[0] - amplitude).max() < 3e-3
    assert np.abs(spectra.order(2.75)).max() < 3e-3  # between the orders there is nothing


def test_orders_closer_than_a_frame_resolves_are_fitted_together_or_refused() -> None:
    speed = run_up()
    data = TimeData("s", DT, [order(speed, 1.0, 1.0) + order(speed, 1.15, 0.5j)], [acceleration(1)])
    track = angular_orders(data, speed, [1.0, 1.15], revolutions=8)
    assert np.abs(track.order(1.15)[0] - 0.5j).max() < 2e-3
    with pytest.raises(SignalError, match="cannot be told apart in 8 revolutions"):
        angular_orders(data, speed, [1.0, 1.002], revolutions=8)


def test_both_ways_of_tracking_agree() -> None:
    speed = run_up()
    swell = 1 + 0.5 * np.sin(2 * np.pi * T / 40)
    rng = np.random.default_rng(0)
    x = swell * order(speed, 1.0, 1 + 1j) + 0.05 * rng.standard_normal(N)
    data = TimeData("s", DT, [x], [acceleration(1)])
    over = angular_orders(data, speed, [1.0])
    both = vold_kalman(data, speed, [1.0], t=over.t)
    inner = (over.t > 5) & (over.t < 95)
    assert np.abs(over.values - both.values)[0, 0, inner].max() < 0.05


def test_what_lies_above_the_highest_order_does_not_fold() -> None:
    speed = run_up()
    data = TimeData("s", DT, [np.sin(2 * np.pi * 100 * T)], [acceleration(1)])  # order 33 down to order 4
    over = resample_angle(data, speed, 2.0)
    assert over.per_rev == 8
    early = over.t < 60  # order 6 and more, above half of 8
    assert np.abs(over.values[0, early]).max() < 0.02


def test_angles_that_cannot_be_are_refused() -> None:
    data = TimeData("s", DT, [T], [acceleration(1)])
    with pytest.raises(SignalError, match="holds 0.5 revolutions"):
        resample_angle(data, speed_from_profile(np.array([0.0, 0.25]), np.array([2.0, 2.0])))
    with pytest.raises(SignalError, match="frames of 2000"):
        angular_orders(data, run_up(), [1.0], revolutions=2000)
    crawl = speed_from_profile(np.array([0.0, 1.0, 99.0]), np.array([1e-5, 5.0, 50.0]))
    with pytest.raises(SignalError, match="slowest speed of 1e-05 rev/s"):
        resample_angle(data, crawl)


def test_a_rough_speed_is_refined_by_the_orders() -> None:
    dt = 1 / 512
    t = dt * np.arange(512 * 50)
    true = 8 + 0.4 * t + 0.5 * np.sin(2 * np.pi * t / 20)
    angle = 2 * np.pi * np.cumsum(true) * dt
    rng = np.random.default_rng(0)
    x = sum(np.cos(o * angle + o) / o for o in (1, 2, 3, 5)) + 0.5 * rng.standard_normal(t.size)
    data = TimeData("s", dt, [x], [acceleration(1)])
    rough = speed_from_profile(np.linspace(0, 49.9, 200), 1.05 * (8 + 0.4 * np.linspace(0, 49.9, 200)), source="guess")
    found = refine_speed(data, rough, [1, 2, 3, 5])
    inner = t[(t > 2) & (t < 48)]
    error = found.at(inner)[0] / np.interp(inner, t, true) - 1
    assert np.abs(error).max() < 6e-3  # from 5 to 10 %; half a line of 16 revolutions at order 5 is 6e-3
    assert error.std() < 1.5e-3
    track = vold_kalman(data, found, [1, 2, 3, 5], relative=0.2)
    keep = (track.t > 3) & (track.t < 47)
    assert np.abs(track.values[:, 0, keep]).mean(axis=1) == pytest.approx(
        [1, 1 / 2, 1 / 3, 1 / 5], abs=0.03
    )  # noise adds to small ones
    assert any("phases against the shaft are unknown" in note for note in found.notes)


def test_noise_has_no_orders_and_says_so() -> None:
    data = TimeData("s", DT, [np.random.default_rng(0).standard_normal(N)], [acceleration(1)])
    with pytest.raises(SignalError, match=r"stand out by [\d.]+ nepers at most and above"):
        refine_speed(data, run_up(), [1, 2, 3])


def unbalance(speed: Speed, phase: float = 0.6) -> tuple[TimeData, np.ndarray]:
    """Accelerations of the two-mode structure to an unbalance of 0.02 kg m at DOF 1, every 8th of finer samples."""
    fine = DT / 8 * np.arange(8 * N)
    _, angle = speed.at(np.minimum(fine, speed.stop))
    omega = 2 * np.pi * speed.at(np.minimum(fine, speed.stop))[0]
    y = respond((0.02 * omega**2 * np.cos(angle + phase))[None], DT / 8)[:, ::8]
    return TimeData("run", DT, y, [acceleration(1), acceleration(2)]), y


def steady(freq: np.ndarray, phase: float = 0.6) -> np.ndarray:
    return (accelerance(freq, DT / 8, 1)[:, :, 0] * (0.02 * (2 * np.pi * freq) ** 2 * np.exp(1j * phase))[:, None]).T


def test_the_steady_state_is_found_in_a_run_up_whose_track_is_far_from_it() -> None:
    speed = run_up()
    data, _ = unbalance(speed)
    shapes = run_up_shapes(data, speed)
    keep = (shapes.freq > 6) & (shapes.freq < 22)
    true = steady(shapes.freq)[:, keep]
    norm = np.sqrt((np.abs(true) ** 2).mean())
    error = np.sqrt((np.abs(shapes.shapes[:, keep] - true) ** 2).mean()) / norm
    assert error < 0.01
    track = ods_of_order(vold_kalman(data, speed, [1.0]), 1.0)
    inner = (track.freq > 6) & (track.freq < 22)
    late = np.abs(track.shapes[:, inner] - steady(track.freq)[:, inner])
    assert np.sqrt((late**2).mean()) / norm > 0.1  # 0.22 Hz/s through half-power widths of 0.5 Hz


def test_a_slow_run_shows_the_steady_state_in_its_track() -> None:
    speed = Speed(T, 16 + 0.02 * T, 2 * np.pi * (16 * T + 0.01 * T**2), "slow")
    data, _ = unbalance(speed)
    shapes = ods_of_order(vold_kalman(data, speed, [1.0], bandwidth=0.5), 1.0, 0.2)
    inner = slice(2, -2)
    true = steady(shapes.freq)
    assert np.abs(shapes.shapes - true)[:, inner].max() < 0.02 * np.abs(true).max()
    assert shapes.kind == "order"
    assert shapes.reference is None
    assert shapes.speed is not None
    assert shapes.speed == pytest.approx(shapes.freq)


def test_run_ups_that_cannot_be_deconvolved_are_refused() -> None:
    speed = run_up()
    data, _ = unbalance(speed)
    with pytest.raises(SignalError, match="responses of 40 s cannot be told apart in a run of 100 s"):
        run_up_shapes(data, speed, memory=40.0)
    with pytest.raises(SignalError, match="order 1 passes 3 to 25 Hz"):
        run_up_shapes(data, speed, band=(40.0, 50.0))


def test_ods_frf_has_the_response_magnitude_and_the_phase_of_the_reference() -> None:
    rng = np.random.default_rng(0)
    data = measured(rng.standard_normal((1, 2**16)), DT).select([1, 2])
    shapes = ods_frf(data, "a1", resolution=0.25)
    H = accelerance(shapes.freq, DT, 1)[:, :, 0].T
    keep = (shapes.freq > 5) & (shapes.freq < 60)
    true = np.abs(H) * np.exp(1j * (np.angle(H) - np.angle(H[0])))
    ratio = shapes.shapes[1, keep] / shapes.shapes[0, keep]
    near = np.abs(H[0, keep]) > 0.3
    assert np.abs(ratio - true[1, keep] / true[0, keep])[near].max() < 0.1
    assert np.abs(np.angle(shapes.shapes[0])).max() < 1e-9
    tone = TimeData("t", DT, [3 * np.cos(2 * np.pi * 20 * T), np.cos(2 * np.pi * 20 * T + 1)], data.channels)
    for hold in ("mean", "peak"):
        shape = ods_frf(tone, 0, resolution=0.5, hold=hold).at(20.0)
        assert shape == pytest.approx([3, np.exp(1j)], rel=1e-6)
    with pytest.raises(SignalError, match="reference acceleration 1"):
        ods_frf(tone.with_values(np.vstack([0 * T, tone.values[1]])), 0)


def test_one_sided_shapes_have_poles_once() -> None:
    freq = np.arange(0, 128.01, 0.25)
    pole = 2 * np.pi * 20 * (-0.02 + 1j)
    s = 2j * np.pi * freq
    cross = np.real(1 / (s - pole) + 1 / (s - pole.conjugate())) + 0j  # a pole and its mirror: what a response's
    from femend.data import ODS  # power has

    given = ODS("x", freq, cross[None], [acceleration(1)], "ods-frf")
    found = one_sided(given, end=1.0).shapes[0]
    exact = 0.5 * (1 / (s - pole) + 1 / (s - pole.conjugate()))
    keep = (freq > 10) & (freq < 40)
    assert np.abs(found - exact)[keep].max() < 0.05 * np.abs(exact).max()
    assert np.abs(np.imag(cross)).max() == 0  # the phase comes from the deconvolution
    with pytest.raises(SignalError, match="not evenly spaced"):
        one_sided(given.lines(np.array([1, 2, 7])))


def test_modal_peaks_stand_at_the_natural_frequencies() -> None:
    freq = np.arange(0.1, 60, 0.1)
    H = accelerance(freq, DT, 1) * np.exp(1j * np.pi * freq * DT)[:, None, None]  # forces held are half a sample late
    frf = FRF("f", freq, H, [acceleration(1), acceleration(2)], [force(1)], "accelerance", "m/s^2/N")
    found = peak_frequencies(freq, modal_peaks(frf))
    assert found == pytest.approx([12.0, 31.0], rel=2e-3)
    assert modal_peaks(frf).max() == 1
    assert peak_frequencies(freq, modal_peaks(frf), n=1).size == 1


def test_ods_rows_and_lines() -> None:
    from femend.data import ODS
    from femend.errors import RecordingError

    shapes = ODS("x", [1.0, 2.0, 3.0], np.arange(6).reshape(2, 3) + 1j, [acceleration(1), acceleration(2)], "ods")
    assert shapes.band(1.5, 3.5).freq.tolist() == [2.0, 3.0]
    assert shapes.select([1]).shapes[0, 0] == 3 + 1j
    assert shapes.at(2.2).tolist() == [1 + 1j, 4 + 1j]
    with pytest.raises(RecordingError, match="reach from 1 to 3 Hz, not to 9 Hz"):
        shapes.at(9.0)
    with pytest.raises(RecordingError, match=r"acceleration 2:\+Z \(a2\) is not a number at 1 Hz"):
        ODS("x", [1.0, 2.0], [[1, 1], [np.nan, 1]], [acceleration(1), acceleration(2)], "ods")
    with pytest.raises(RecordingError, match="kind 'odd'"):
        ODS("x", [1.0], [[1]], [Channel(Dof(1, 1), "velocity", "m/s")], "odd")
