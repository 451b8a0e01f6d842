"""Modal tests of structures whose modes are known: poles, shapes, modal masses and what is said about them."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from femend.data import FRF
from femend.modal import identify_modes, refine_modes
from femend.modal.choose import _worst, choose_modes
from femend.modal.identify import line_noise

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from modal_models import known_frf, shapes

LINES = np.linspace(0.05, 20.0, 400)
FREQ, ZETA = np.array([4.0, 7.0, 11.0, 16.0]), np.array([0.01, 0.02, 0.005, 0.015])
PHI = shapes(10, 4)


@pytest.mark.parametrize("kind", ["receptance", "mobility", "accelerance"])
def test_exact_frfs_give_their_modes(kind: str) -> None:
    test = identify_modes(known_frf(LINES, FREQ, ZETA, PHI, [0], kind=kind))
    # the modal model is exact and fitted to rounding
    assert test.modes.freq == pytest.approx(FREQ, rel=1e-8)
    assert test.modes.zeta == pytest.approx(ZETA, rel=1e-6)
    assert test.error < 1e-7
    assert test.modal_mass == pytest.approx(1 / np.max(np.abs(PHI), axis=0) ** 2, rel=1e-6)
    real = test.modes.to_mode_set()
    assert real.scaling == "mass"
    assert np.abs(real.phi) == pytest.approx(np.abs(PHI), rel=1e-6)
    assert np.sum(real.phi * PHI, axis=0) ** 2 == pytest.approx(np.sum(PHI**2, axis=0) ** 2, rel=1e-6)
    assert test.mpc == pytest.approx(1.0)
    assert (test.status, test.advice) == ("ok", ())


@pytest.mark.parametrize(("outside", "term"), [(120.0, "upper"), (0.2, "lower")])
def test_modes_outside_the_band_are_residual_terms(outside: float, term: str) -> None:
    phi = shapes(10, 5, seed=2)
    frf = known_frf(LINES, [*FREQ, outside], [*ZETA, 0.01], phi, [0])
    test = identify_modes(frf, (3.0, 19.0))
    assert test.modes.freq == pytest.approx(FREQ, rel=1e-4)
    # phi phi^T / (omega_r^2 + s^2) is phi phi^T / omega_r^2 above and phi phi^T / s^2 below the band, but for
    # (19 / 120)^2 and (0.2 / 3)^2
    static = 1.0 if term == "lower" else (2 * np.pi * outside) ** 2
    assert getattr(test, term)[:, 0] == pytest.approx(phi[:, 4] * phi[0, 4] / static, rel=0.04)
    without = identify_modes(frf, (3.0, 19.0), residuals="none")
    assert without.error > 10 * test.error


def test_close_modes_need_two_references_and_get_them() -> None:
    freq, zeta, phi = [6.0, 6.03, 12.0], [0.01, 0.01, 0.01], shapes(12, 3, seed=3)
    frf = known_frf(LINES, freq, zeta, phi, [0, 5], noise=0.01)  # 0.03 Hz apart, half-power bandwidth 0.12 Hz
    test = identify_modes(frf)
    assert test.modes.freq == pytest.approx(freq, rel=5e-4)
    assert test.modes.zeta == pytest.approx(zeta, rel=0.05)
    found = test.modes.to_mode_set().phi
    mac = (found.T @ phi) ** 2 / np.outer(np.sum(found**2, axis=0), np.sum(phi**2, axis=0))
    assert np.diag(mac).min() > 0.99
    assert mac[0, 1] < 0.5


def test_repeated_frequency_is_found_twice() -> None:
    phi = shapes(12, 2, seed=4)
    test = identify_modes(known_frf(LINES, [8.0, 8.0], [0.01, 0.01], phi, [0, 5], noise=0.002))
    assert test.modes.freq == pytest.approx([8.0, 8.0], rel=1e-3)


def test_strong_damping_and_overlap() -> None:
    freq, zeta = [4.0, 6.0, 9.0, 13.0], [0.10, 0.08, 0.12, 0.06]
    test = identify_modes(known_frf(LINES, freq, zeta, shapes(8, 4, seed=5), [0], noise=0.005))
    assert test.modes.n_modes == 4
    assert np.abs(test.modes.freq / freq - 1).max() < 0.01
    assert np.abs(test.modes.zeta / zeta - 1).max() < 0.1


def test_deviations_are_those_of_repeated_tests() -> None:
    z_freq, z_zeta = [], []
    for seed in range(12):
        test = identify_modes(known_frf(LINES, FREQ, ZETA, PHI[:6], [0], noise=0.02, seed=seed))
        assert test.modes.n_modes == 4
        z_freq.append((test.modes.freq - FREQ) / test.modes.freq_sd)
        z_zeta.append((test.modes.zeta - ZETA) / test.modes.zeta_sd)
    # 48 draws: the rms of a standard normal is 1 ± 0.1; scatter over orders is added to the variance, so less is honest
    for z in (z_freq, z_zeta):
        assert 0.3 < np.sqrt(np.mean(np.square(z))) < 1.3
        assert np.abs(z).max() < 4


def test_more_noise_means_more_deviation_and_a_larger_error() -> None:
    low, high = (identify_modes(known_frf(LINES, FREQ, ZETA, PHI, [0], noise=n)) for n in (0.005, 0.05))
    assert np.all(high.modes.freq_sd > 3 * low.modes.freq_sd)
    # the error is that of the noise: the modes take a small share of the degrees of freedom
    assert low.error == pytest.approx(0.005, rel=0.1)
    assert high.error == pytest.approx(0.05, rel=0.1)
    assert high.noise_share == pytest.approx(high.error, rel=0.15)


def test_roving_hammer_is_the_transposed_test() -> None:
    fixed = identify_modes(known_frf(LINES, FREQ, ZETA, PHI, [2], noise=0.01))
    frf = known_frf(LINES, FREQ, ZETA, PHI, [2], noise=0.01)
    roving = identify_modes(
        FRF("hammer", frf.freq, frf.H.transpose(0, 2, 1), frf.inputs, frf.outputs, frf.kind, frf.unit)
    )
    assert (fixed.roved, roving.roved) == ("outputs", "inputs")
    assert roving.modes.poles == pytest.approx(fixed.modes.poles, rel=1e-9)
    assert roving.modes.shapes == pytest.approx(fixed.modes.shapes, rel=1e-6)
    assert roving.resynthesised.H.shape == (400, 1, 10)
    assert roving.frf_error.shape == (1, 10)
    assert roving.synthesise(frf.freq) == pytest.approx(roving.resynthesised.H)


def test_a_reversed_driving_point_sensor_keeps_the_mass_positive() -> None:
    frf = known_frf(LINES, FREQ, ZETA, PHI, [0])
    turned = [frf.outputs[0].__class__(frf.outputs[0].dof.__class__(1, 3, -1), "acceleration", "m/s^2")]
    H = frf.H.copy()
    H[:, 0] *= -1  # measured along -Z, and labelled so
    test = identify_modes(FRF("b", frf.freq, H, (*turned, *frf.outputs[1:]), frf.inputs, frf.kind, frf.unit))
    assert test.modal_mass == pytest.approx(1 / np.max(np.abs(PHI), axis=0) ** 2, rel=1e-6)
    assert test.checks[0].verdict == "ok"
    assert test.modes.participation is not None
    assert test.modes.participation[:, 0] == pytest.approx(-test.modes.shapes[0], rel=1e-6)
    phi = test.modes.shapes * np.sqrt(2j * test.modes.poles.imag)
    assert np.abs(phi.imag).max() < 1e-6  # the phase of proportional damping


def test_without_a_driving_point_there_is_no_mass() -> None:
    test = identify_modes(known_frf(LINES, FREQ, ZETA, PHI, [0], outputs=range(1, 10)))
    assert np.isnan(test.modal_mass).all()
    assert test.modes.scaling == "unscaled"
    assert test.modes.to_mode_set().scaling == "max"
    assert any("no driving point" in line for line in test.advice)


def test_a_complex_shape_is_called_complex() -> None:
    frf = known_frf(LINES, FREQ, ZETA, PHI, [0])
    s, p = 2j * np.pi * LINES, 2 * np.pi * 9 * (-0.01 + 1j)
    psi = np.exp(1j * np.linspace(0, np.pi / 2, 10)) / np.sqrt(2j * p.imag)
    part = psi / (s[:, None] - p) + psi.conj() / (s[:, None] - p.conjugate())
    H = frf.H + (s[:, None] ** 2 * part)[:, :, None]
    test = identify_modes(FRF("b", frf.freq, H, frf.outputs, frf.inputs, frf.kind, frf.unit))
    mode = int(np.argmin(np.abs(test.modes.freq - 9)))
    # ten phases 10 degrees apart: a geometric series, and 5, 15, 25, 35 and 45 degrees from their mean
    assert test.mpc[mode] == pytest.approx((np.sin(10 * np.pi / 18) / np.sin(np.pi / 18) / 10) ** 2, rel=1e-5)
    assert test.mpd[mode] == pytest.approx(25, rel=1e-4)
    assert np.delete(test.mpc, mode) == pytest.approx(1.0, abs=1e-6)
    assert any("complex" in line and "9" in line for line in test.advice)


@pytest.mark.parametrize("seed", range(4))
def test_frfs_of_different_structures_are_not_passed_off_as_pairs(seed: int) -> None:
    # each FRF was taken with another mass on the structure: frequencies differ by 0.5 % between FRFs
    rng = np.random.default_rng(seed)
    parts = [
        known_frf(LINES, FREQ * (1 + 0.005 * rng.standard_normal()), ZETA, PHI, [0], outputs=[o], noise=0.003, seed=o).H
        for o in range(10)
    ]
    frf = known_frf(LINES, FREQ, ZETA, PHI, [0])
    mixed = FRF("b", frf.freq, np.concatenate(parts, axis=1), frf.outputs, frf.inputs, frf.kind, frf.unit)
    test = identify_modes(mixed)
    assert test.status == "doubtful"
    assert any("at different frequencies" in line for line in test.advice)


@pytest.mark.parametrize("seed", range(4))
def test_true_pairs_are_not_doubted(seed: int) -> None:
    frf = known_frf(LINES, [6.0, 6.08, 12.0], [0.01, 0.012, 0.01], shapes(8, 3, seed=seed), [0], noise=0.003)
    test = identify_modes(frf)
    assert test.modes.freq == pytest.approx([6.0, 6.08, 12.0], rel=2e-3)
    assert (test.status, test.advice) == ("ok", ())


@pytest.mark.parametrize(("size", "kept"), [(0.0, False), (0.02, False), (0.1, True), (0.2, True)])
def test_a_mode_must_earn_its_unknowns(size: float, kept: bool) -> None:
    # a fourth mode at 15 Hz whose resonance is 0, 0.6, 3 and 6 times the noise of a line, in thirty FRFs
    phi = np.c_[shapes(30, 3), size * shapes(30, 1, seed=9)]
    frf = known_frf(LINES, [4.0, 7.0, 11.0, 15.0], [0.01, 0.02, 0.005, 0.02], phi, [0], noise=0.02)
    poles = 2 * np.pi * np.array([4.0, 7.0, 11.0, 15.0]) * (-np.array([0.01, 0.02, 0.005, 0.02]) + 1j)
    noise = line_noise(frf.H)
    fitted, dropped = choose_modes(LINES, frf.H, 2, poles, np.ones((4, 1)) + 0j, "both", noise, 0.2)
    assert fitted.fit.poles.size == (4 if kept else 3)
    assert [round(d.freq) for d in dropped] == ([] if kept else [15])
    every = refine_modes(LINES, frf.H, 2, poles, np.ones((4, 1)) + 0j, noise=noise, centre=poles, reach=-poles.real)
    worst = _worst(LINES, frf.H, 2, every, poles, "both", noise, 0.2)
    assert worst is None if kept else worst is not None and worst[0] == 3 and "too little" in worst[1]


@pytest.mark.parametrize("seed", range(3))
def test_a_misfit_that_is_not_noise_is_no_mode(seed: int) -> None:
    # every FRF carries a random walk over the lines of 2 % of the largest peak, which no common pole makes
    frf = known_frf(LINES, FREQ, ZETA, PHI, [0], noise=0.001)
    rng = np.random.default_rng(seed)
    walk = np.cumsum(rng.standard_normal((400, 10, 1)) + 1j * rng.standard_normal((400, 10, 1)), axis=0)
    H = frf.H + 0.02 * np.abs(frf.H).max() * walk / np.abs(walk).max()
    test = identify_modes(FRF("b", frf.freq, H, frf.outputs, frf.inputs, frf.kind, frf.unit))
    assert test.modes.freq == pytest.approx(FREQ, rel=2e-3)
    assert test.error > 3 * test.noise_share
    if seed == 1:  # here a candidate gets as far as the fit
        assert any("explains only" in d.reason for d in test.dropped)


def test_noise_alone_has_no_modes() -> None:
    rng = np.random.default_rng(0)
    frf = known_frf(LINES, FREQ, ZETA, PHI, [0])
    for _ in range(3):
        H = rng.standard_normal(frf.H.shape) + 1j * rng.standard_normal(frf.H.shape)
        test = identify_modes(FRF("b", frf.freq, H, frf.outputs, frf.inputs, frf.kind, frf.unit))
        assert (test.modes.n_modes, test.status) == (0, "no modes")
        assert test.error == pytest.approx(1.0, abs=0.02)


def test_modes_that_are_missing_from_the_fit_show_in_the_error() -> None:
    frf = known_frf(LINES, FREQ, ZETA, PHI, [0])
    test = identify_modes(frf, max_order=3)  # one pole pair at most where there are four
    assert test.modes.n_modes < 4
    assert test.error > 0.3
    assert test.status != "ok"
    assert test.advice
