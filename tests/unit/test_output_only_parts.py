"""The parts of output-only identification against what they stand for, and input it must refuse."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from femend import Channel, Dof, TimeData
from femend.errors import RecordingError
from femend.modal.output_only import correlations as correlations_module
from femend.modal.output_only import find_harmonics, identify_output_only, merge_setups, remove_harmonics
from femend.modal.output_only.correlations import block_correlations, principal_references
from femend.modal.output_only.perturbation import block_effects, influences
from femend.modal.output_only.plscf import fraction_poles, half_spectrum
from femend.modal.output_only.prepare import prepare_signals
from femend.modal.output_only.ssi import order_poles, subspace

sys.path.insert(0, str(Path(__file__).parents[1]))
import oma_chain as oma

CHAIN = oma.Chain()
BAND = (0.5, 11.0)


def decays(n_lags: int, dt: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Poles, shapes and the correlations (n_lags, 3, 2) that they make: free decays."""
    rng = np.random.default_rng(4)
    omega, zeta = 2 * np.pi * np.array([3.0, 3.2, 8.0]), np.array([0.01, 0.02, 0.005])
    mu = -zeta * omega + 1j * omega * np.sqrt(1 - zeta**2)
    phi = rng.standard_normal((3, 3)) + 0.2j * rng.standard_normal((3, 3))
    g = rng.standard_normal((3, 2)) + 0.2j * rng.standard_normal((3, 2))
    t = dt * np.arange(1, n_lags + 1)
    R = 2 * np.einsum("or,tr,rj->toj", phi, np.exp(np.outer(t, mu)), g).real
    return mu, phi, R


def test_subspace_of_exact_correlations_gives_the_poles_and_shapes() -> None:
    mu, phi, R = decays(40, 0.05)
    space = subspace(R, 20, 6, 0.05)
    found = order_poles(space, 6)
    at = oma.nearest(found.mu, mu)
    assert found.mu[at] == pytest.approx(mu, abs=1e-8)
    shapes = (space.U[:3, :6] @ found.psi)[:, at]
    assert shapes / shapes[0] == pytest.approx(phi / phi[0], abs=1e-7)


def test_fractions_of_exact_half_spectra_give_the_poles_and_shapes() -> None:
    # The window's end of 1 % is what the half spectrum of exact decays is wrong by; poles are far less.
    mu, phi, R = decays(800, 0.05)
    half = half_spectrum(R, (1.0, 9.5), 0.05)
    found = fraction_poles(half, [12], 3)[0]
    at = oma.nearest(found.mu, mu)
    assert found.mu[at] == pytest.approx(mu, rel=2e-4)
    shapes = found.shapes[:, at]
    assert shapes / shapes[0] == pytest.approx(phi / phi[0], rel=0.05)


def test_influences_are_the_derivatives_of_the_identification() -> None:
    signals = prepare_signals(oma.ambient(CHAIN, 0, 100.0), BAND)
    references = principal_references(signals, 3)
    R = block_correlations(signals.y, references @ signals.y, 40, 25, signals.dt)
    space = subspace(R.mean, 20, 20, signals.dt)
    found = order_poles(space, 12)
    which = np.arange(found.mu.size)
    influence = influences(space, block_effects(space, R.blocks), found, which)
    assert influence.mu.sum(axis=0) == pytest.approx(0, abs=1e-8)
    block, step = 7, 1e-6
    sides = []
    for sign in (1, -1):
        moved = subspace(R.mean + sign * step * (R.blocks[block] - R.mean), 20, 20, signals.dt)
        poles = order_poles(moved, 12)
        at = oma.nearest(poles.mu, found.mu)
        shapes = (moved.U[:4, :12] @ poles.psi)[:, at]
        sides.append((poles.mu[at], shapes / shapes[0]))
    slope = (sides[0][0] - sides[1][0]) / (2 * step)
    assert influence.mu[block] == pytest.approx(slope, rel=1e-4)
    shapes = space.U[:4, :12] @ found.psi
    change = influence.shape[block]
    expected = change / shapes[0] - shapes * change[0] / shapes[0] ** 2
    assert (sides[0][1] - sides[1][1]) / (2 * step) == pytest.approx(
        expected, rel=1e-3, abs=1e-4 * np.abs(expected).max()
    )


def test_correlations_by_products_and_by_transforms_are_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    y = np.random.default_rng(0).standard_normal((3, 2000))
    products = block_correlations(y, y[:2], 50, 7, 0.1).blocks
    monkeypatch.setattr(correlations_module, "FEW_LAGS", 10)
    assert block_correlations(y, y[:2], 50, 7, 0.1).blocks == pytest.approx(products, abs=1e-13)


def with_sine(data: TimeData, freq: float, share: float) -> TimeData:
    wave = share * data.values.std() * np.sin(2 * np.pi * freq * data.t + 0.3)
    return data.with_values(data.values + np.outer([1.0, -0.5, 0.2, 0.8], wave))


def test_a_rotating_harmonic_is_found_named_and_taken_out() -> None:
    clean = oma.ambient(CHAIN, 1, 200.0)
    assert find_harmonics(clean, [0, 1, 2, 3], BAND) == []
    data = with_sine(clean, 6.4321, 1.0)
    (found,) = find_harmonics(data, [0, 1, 2, 3], BAND, 3.21605)
    assert found.freq == pytest.approx(6.4321, abs=0.05 / 200.0)
    assert found.order == pytest.approx(2.0, abs=1e-3)
    assert found.kurtosis == pytest.approx(1.5, abs=0.1)
    left = data.values - remove_harmonics(data, [0, 1, 2, 3], [found])
    # what is left differs from the record without the sine by what of the noise looks like it: a line of 6400
    assert np.abs(left - clean.values).max() < 0.1 * clean.values.std()
    modes = identify_output_only(data, BAND)
    assert modes.modes.n_modes == 4
    assert modes.freq == pytest.approx(identify_output_only(clean, BAND).freq, rel=2e-3)
    assert any("6.4321" in note for note in modes.notes)


def test_a_harmonic_on_a_mode_is_said() -> None:
    freq, _ = CHAIN.modes()
    data = with_sine(oma.ambient(CHAIN, 2, 200.0), freq[1] + 0.01, 2.0)
    flagged = identify_output_only(data, BAND, harmonics="flag")
    at = int(np.argmin(np.abs(flagged.freq - freq[1])))
    assert flagged.harmonic[at]
    assert flagged.harmonic.sum() == 1
    assert "rotating harmonic" in flagged.flags[at]
    assert flagged.structural.n_modes == flagged.modes.n_modes - 1
    removed = identify_output_only(data, BAND)
    at = int(np.argmin(np.abs(removed.freq - freq[1])))
    assert "taken out here" in removed.flags[at]
    assert not removed.harmonic.any()
    assert abs(removed.freq[at] - freq[1]) < 4 * removed.modes.freq_sd[at]


def test_an_order_of_varying_speed_is_a_line_against_the_angle() -> None:
    clean = oma.ambient(CHAIN, 3, 200.0)
    speed = 6.0 + 0.3 * np.sin(2 * np.pi * clean.t / 50)
    wave = 0.7 * clean.values.std() * np.sin(2 * np.pi * np.cumsum(speed) * clean.dt)
    data = clean.with_values(clean.values + wave)
    assert find_harmonics(data, [0, 1, 2, 3], BAND) == []
    (found,) = find_harmonics(data, [0, 1, 2, 3], BAND, speed)
    assert found.order == pytest.approx(1.0, abs=1e-3)
    left = data.values - remove_harmonics(data, [0, 1, 2, 3], [found], speed)
    assert np.std(left - clean.values) < 0.1 * np.std(data.values - clean.values)


def test_the_sense_of_a_sensor_is_merged_away() -> None:
    chain = oma.Chain()
    first = oma.ambient(chain, 1, 300.0)
    turned = oma.ambient(chain, 2, 300.0)
    labels = (*turned.channels[:2], Channel(Dof(3, 1, -1), "acceleration", "m/s^2"), turned.channels[3])
    flipped = TimeData("turned", turned.dt, turned.values * np.array([[1.0], [1.0], [-1.0], [1.0]]), labels)
    merged = merge_setups([identify_output_only(one, BAND) for one in (first, flipped)])
    assert merged.status == "ok"
    assert merged.reference_mac.min() > 0.99


def test_white_noise_has_no_modes() -> None:
    noise = np.random.default_rng(1).standard_normal((4, 6400))
    found = identify_output_only(TimeData("noise", 1 / 32, noise, oma.channels(4)), BAND)
    assert found.status == "no modes"
    assert "no mode stands" in found.advice[0]
    assert found.modes.shapes.shape == (4, 0)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"method": "ssi-data"}, "none of ssi, plscf, efdd"),
        ({"harmonics": "ignore"}, "none of remove, flag"),
        ({"band": (3.0, 2.0)}, "is empty"),
        ({"band": (1.0, 15.0)}, "lower the upper edge"),
        ({"speed": -3.0}, "positive value"),
        ({"speed": np.ones(5)}, "positive value"),
        ({"references": ("9:+X",)}, "no channel answers"),
    ],
)
def test_misuse_is_refused_by_name(change: dict, message: str) -> None:
    with pytest.raises(RecordingError, match=message):
        identify_output_only(oma.ambient(CHAIN, 1, 60.0), **{"band": BAND, **change})


def test_channels_that_stand_still_are_left_out() -> None:
    data = oma.ambient(CHAIN, 1, 100.0)
    dead = data.values.copy()
    dead[2] = 1e-14 * dead[2] + 3.0
    found = identify_output_only(data.with_values(dead), BAND)
    assert data.channels[2].dof not in found.modes.dofs
    assert len(found.modes.dofs) == len(data.channels) - 1
    assert any("channel acceleration 3:+X" in note and "left out" in note for note in found.notes)
    without = identify_output_only(data.select([i for i in range(len(data.channels)) if i != 2]), BAND)
    assert found.modes.freq == pytest.approx(without.modes.freq, rel=1e-9)
    both = data.values.copy()
    both[1:3] = 0.0
    notes = identify_output_only(data.with_values(both), BAND).notes
    assert any("2:+X" in note and "3:+X" in note and "do not move" in note for note in notes)


def test_records_without_motion_are_refused() -> None:
    data = oma.ambient(CHAIN, 1, 100.0)
    with pytest.raises(RecordingError, match="none of its . motion channels moves"):
        identify_output_only(data.with_values(np.ones_like(data.values)), BAND)
    forces = TimeData("force", data.dt, data.values[:1], (Channel(Dof(1, 1), "force", "N"),))
    with pytest.raises(RecordingError, match="none of its 1 channels"):
        identify_output_only(forces, BAND)


def test_a_clipped_channel_is_noted_with_its_time() -> None:
    data = oma.ambient(CHAIN, 1, 100.0)
    values = data.values.copy()
    end = 2.2 * values[1].std()
    values[1] = np.clip(values[1], -end, end)
    notes = identify_output_only(data.with_values(values), BAND).notes
    assert any("2:+X stays at" in note and "clipped" in note for note in notes)


def test_mixed_quantities_give_shapes_of_displacement() -> None:
    """The same chain seen by accelerometers, and with one channel integrated twice over: the same shapes."""
    freq, phi = CHAIN.modes()
    data = oma.ambient(CHAIN, 4, 400.0, noise=0.001)
    spectrum = np.fft.rfft(data.values[0])
    omega = 2 * np.pi * np.fft.rfftfreq(data.n_samples, data.dt)
    spectrum[omega < 2 * np.pi * 0.4] = 0
    displacement = np.fft.irfft(spectrum / -(np.maximum(omega, 1e-3) ** 2), data.n_samples)
    values = np.vstack([displacement, data.values[1:]])
    labels = (Channel(Dof(1, 1), "displacement", "m"), *data.channels[1:])
    found = identify_output_only(TimeData("mixed", data.dt, values, labels), BAND)
    at = oma.nearest(found.freq, freq)
    ratio = (found.modes.shapes[0] / found.modes.shapes[1])[at]
    assert ratio.real == pytest.approx(phi[0] / phi[1], rel=0.05)
