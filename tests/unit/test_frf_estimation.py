"""FRFs as records of the estimation: units, noise, windows, and factors found again."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from femend import FRF, Channel, Dof
from femend.data import Recording, Test
from femend.errors import RecordingError
from femend.estimate import Hypothesis, Problem, fit_records, modelled_band, pair_test, used_band
from femend.estimate.damped_frf import damped
from femend.estimate.frf import FrfLines, frf_lines_of, useful_band
from femend.model import Model, Parameter, ReducedModel, read_model, reduce_model

DECK = Path(__file__).parents[2] / "python" / "examples" / "three_storey" / "model.bdf"
NODES, TRUE, ZETA = (10, 20, 30), (0.75, 0.9, 1.1), 0.01
FORM = {"accelerance": (0, "m/s^2/N"), "mobility": (1, "m/s/N"), "receptance": (2, "m/N")}
EVEN = np.arange(4097) / 32
UNEVEN = np.concatenate([np.linspace(2, 20, 500), np.linspace(20.1, 40, 300)])


def chain() -> tuple[Model, NDArray[np.float64], NDArray[np.float64]]:
    """The frame with three parameters, and frequencies (rad/s) and shapes of the floors with the true factors: by hand,
    not by what is tested."""
    legs = tuple(Parameter(f"legs_{i}", "I1", "property_id", (i,), 0.15) for i in (1, 2, 3))
    k = 4 * 12 * 70e9 * 0.025 * 0.003**3 / 12 / 0.1533**3 * np.array(TRUE)
    K = np.diag([k[0] + k[1], k[1] + k[2], k[2]]) - np.diag(k[1:], 1) - np.diag(k[1:], -1)
    squares, phi = np.linalg.eigh(K / 5.201)
    return read_model(DECK, parameters=legs), np.sqrt(squares), phi / np.sqrt(5.201)


def recorded(kind: str, freq: NDArray[np.float64], noise: float = 0.0, columns: tuple[int, ...] = (0,)) -> Recording:
    """FRFs of the floors to forces at some of them; `noise` is the standard deviation of the accelerances."""
    _, omega, phi = chain()
    s = 2j * np.pi * freq[:, None]
    g = s**2 / (omega**2 + s**2 + 2 * ZETA * omega * s)
    H = np.einsum("or,kr,ir->koi", phi, g, phi[list(columns)])
    rng = np.random.default_rng(1)
    H = H + noise * (rng.standard_normal(H.shape) + 1j * rng.standard_normal(H.shape)) / np.sqrt(2)
    order, unit = FORM[kind]
    with np.errstate(divide="ignore", invalid="ignore"):
        H = np.where(s[:, :, None] == 0, 0.0, H / s[:, :, None] ** order)
    channels = [Channel(Dof(n, 1, 1), "acceleration", "m/s^2") for n in NODES]
    forces = tuple(Channel(Dof(NODES[c], 1, 1), "force", "N") for c in columns)
    return Recording("bench", FRF("bench", freq, H, tuple(channels), forces, kind, unit))


def problem_of(recording: Recording) -> tuple[Problem, ReducedModel]:
    model, _, _ = chain()
    records = fit_records([recording], model, pair_test(Test((recording,)), model))
    band = used_band(records)
    rows = sorted({int(g) for r in records for g in [*r.in_rows, *r.out_rows]})
    reduced = reduce_model(model, band[1], rows)
    return Problem(records, modelled_band(band, records, reduced.freq), 0.02, 3), reduced


def factors(recording: Recording) -> NDArray[np.float64]:
    problem, reduced = problem_of(recording)
    fit = problem.continuation(Hypothesis(reduced, np.zeros((0, reduced.r))))
    assert fit is not None
    return np.exp(fit.p[:3])


@pytest.mark.parametrize("kind", FORM)
@pytest.mark.parametrize("freq", [EVEN, UNEVEN], ids=["even", "uneven"])
def test_true_factors_are_found_again(kind: str, freq: NDArray[np.float64]) -> None:
    # the prior (15 %) and the frequency factors (0.5 % a mode) pull a little towards the deck
    assert factors(recorded(kind, freq)) == pytest.approx(TRUE, rel=3e-3)


def test_true_factors_are_found_in_noise_from_several_inputs() -> None:
    assert factors(recorded("accelerance", EVEN, 0.005, (0, 2))) == pytest.approx(TRUE, rel=5e-3)


def test_every_input_is_a_record() -> None:
    model, _, _ = chain()
    recording = recorded("mobility", EVEN, columns=(0, 2))
    records = fit_records([recording], model, pair_test(Test((recording,)), model))
    assert [r.name for r in records] == ["bench / 10:+X", "bench / 30:+X"]
    assert {r.source for r in records} == {"bench"}
    assert all(r.frf is not None and r.frf.freq[0] > 0 and r.dt == 0 for r in records)


def test_noise_is_told_from_resonances() -> None:
    """Of a periodic force, whose coherence tells that no resonance leaks out of the averages' window."""
    plain, averages = recorded("accelerance", EVEN, 0.01).frf, 10
    power = np.abs(plain.H) ** 2
    lines = frf_lines_of(with_coherence(plain, power / (power + averages * 0.01**2)), 0)
    peak = np.abs(lines.H).max(axis=1) > 2
    assert peak.sum() > 10
    for part in (peak, ~peak):
        assert np.median(lines.noise[part]) == pytest.approx(0.01, rel=0.15)


def test_resonances_as_wide_as_a_few_lines_are_as_far_off_as_their_window_makes_them() -> None:
    """Averages of noise in Hann windows smooth a resonance over its lines, however many there are."""
    _, omega, phi = chain()
    rate, m, averages = 64.0, 1024, 24
    rng = np.random.default_rng(4)
    force = rng.standard_normal(m * averages)
    freq = np.fft.rfftfreq(force.size, 1 / rate)
    s = 2j * np.pi * freq[:, None]
    exact = (s**2 / (omega**2 + s**2 + 2 * ZETA * omega * s) * phi[0]) @ phi.T
    motion = np.fft.irfft(exact * np.fft.rfft(force)[:, None], force.size, axis=0)
    motion += 0.01 * motion.std(axis=0) * rng.standard_normal(motion.shape)
    begins = range(0, force.size - m + 1, m // 2)
    window = np.hanning(m + 1)[:-1]
    U = np.array([np.fft.rfft(window * force[b : b + m]) for b in begins])[:, :, None]
    Y = np.array([np.fft.rfft(window[:, None] * motion[b : b + m], axis=0) for b in begins])
    uu, yu, yy = (np.sum(x, axis=0) for x in (np.abs(U) ** 2, Y * U.conj(), np.abs(Y) ** 2))
    like, lines = recorded("accelerance", np.fft.rfftfreq(m, 1 / rate)).frf, slice(0, 480)
    H = (yu / uu)[lines, :, None]
    frf = FRF("h", like.freq[lines], H, like.outputs, like.inputs, like.kind, like.unit)
    found = frf_lines_of(with_coherence(frf, (np.abs(yu) ** 2 / (uu * yy))[lines, :, None]), 0)
    unknown = frf_lines_of(frf, 0)
    error = np.abs(found.H - exact[::averages][1:480])
    peak = np.abs(found.H).max(axis=1) > 0.5 * np.abs(found.H).max()
    assert 0.5 < np.mean((error / found.noise)[~peak] ** 2) < 1.6
    assert np.mean((error / found.noise)[peak] ** 2) < 5.0
    # without coherence nothing tells, and the model is asked for less of it
    assert np.mean((error / unknown.noise)[peak] ** 2) > 20.0
    assert unknown.allowance > found.allowance


def with_coherence(frf: FRF, coherence: NDArray[np.float64]) -> FRF:
    return FRF("c", frf.freq, frf.H, frf.outputs, frf.inputs, frf.kind, frf.unit, coherence)


def test_coherence_shapes_the_noise() -> None:
    plain = recorded("accelerance", EVEN, 0.01).frf
    coherence = np.full(plain.H.shape, 0.99)
    coherence[:100] = 0.5
    relative = frf_lines_of(with_coherence(plain, coherence), 0).noise / np.abs(plain.H[1:, :, 0])
    assert relative[50, 0] / relative[200, 0] == pytest.approx(np.sqrt(99), rel=1e-9)


def accelerances(stiffer: float, s: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """Accelerances (K, 3) of the floors to a force at the first, frequencies `stiffer` times the true ones."""
    _, omega, phi = chain()
    omega, s = stiffer * omega, s[:, None]
    return np.asarray((s**2 / (omega**2 + s**2 + 2 * ZETA * omega * s) * phi[0]) @ phi.T)


@pytest.mark.parametrize("stiffer", [1.0, 1.05])
@pytest.mark.parametrize(("freq", "within"), [(EVEN, 0.003), (EVEN[(EVEN > 4) & (EVEN < 21)], 0.2)])
def test_the_window_is_added_damping(freq: NDArray[np.float64], within: float, stiffer: float) -> None:
    """Also of FRFs that end among the modes; those are told from a model that is about right."""
    lines, sigma = frf_lines_of(recorded("receptance", freq, 0.01).frf, 0), 6.0
    H, variance = damped(lines, sigma, lambda s: accelerances(stiffer, s))
    exact = accelerances(1.0, sigma + 2j * np.pi * lines.freq)
    error = np.abs(H - exact)
    assert error.max() < within * np.abs(exact).max()
    # what is not known is as large as told
    assert np.mean(error**2 / variance) < 1.5
    if len(freq) < len(EVEN):
        deaf, _ = damped(lines, sigma, lambda s: np.zeros((len(s), 3), dtype=complex))
        assert np.abs(deaf - exact).std() > 1.5 * error.std()


@pytest.mark.parametrize("band", [(4.0, 15.0), (6.0, 22.0)])
def test_the_true_model_is_right_on_damped_lines_of_frfs_that_end_among_the_modes(band: tuple[float, float]) -> None:
    low, high = band
    inside = (low < EVEN) & (high > EVEN)
    problem, reduced = problem_of(recorded("accelerance", EVEN[inside], 0.005))
    p = problem.prior(reduced)[0]
    p[:3], p[-4:] = np.log(TRUE), np.log(ZETA)
    alone = Hypothesis(reduced, np.zeros((0, reduced.r)))
    for sigma in (3.0, 12.0):
        (fit,) = problem.fit([alone], [(p, np.zeros(0))], sigma=sigma, iterations=0)
        assert fit is not None
        assert fit.score < 1.5


def test_the_band_leaves_out_lines_of_noise() -> None:
    low, high = useful_band(frf_lines_of(recorded("accelerance", EVEN, 0.02).frf, 0))
    assert 1.0 < low < 6.0
    assert high == 128.0


def test_a_narrow_first_resonance_below_noise_is_in_the_band() -> None:
    """A mode at 24.7 Hz, which three lines show, was left out of a modal test without a word."""
    freq = np.arange(10.0, 320.0, 0.25)
    at = 2j * np.pi * freq[:, None]
    modes = [(24.68, 0.003, 1.0), (60.0, 0.01, 30.0), (140.0, 0.01, 100.0)]
    H = sum(size * at**2 / (at**2 + 4 * np.pi * z * f * at + (2 * np.pi * f) ** 2) for f, z, size in modes)
    flat = np.zeros_like(H) + 30.0
    assert useful_band(FrfLines(freq, H, np.full(H.shape, 12.0), 0.25))[0] < 24.0
    rng = np.random.default_rng(1)
    for _ in range(100):
        noise = rng.standard_normal((len(freq), 2)) @ [1, 1j]
        lines = FrfLines(freq, np.where(freq > 100.0, 200.0, 20.0 * noise)[:, None], flat, 0.25)
        assert useful_band(lines)[0] > 90.0


def test_too_few_lines_are_refused() -> None:
    with pytest.raises(RecordingError, match="needs at least 16"):
        frf_lines_of(recorded("accelerance", EVEN[:10]).frf, 0)
