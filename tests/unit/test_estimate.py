"""From records to weighted lines: noise, repetition, windowed spectra and the interpolated force."""

from __future__ import annotations

import sys
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from femend.diagnose.fitting.closed_loop import upsampled
from femend.errors import RecordingError
from femend.estimate import Fit, FitRecord, Hypothesis, Problem, check_sampling, noise_of, period_of, spectral_lines
from femend.model import ReducedModel, read_model, reduce_model

sys.path.insert(0, str(Path(__file__).parents[1]))
import small_study

fit_module = import_module("femend.estimate.fit")

DT = 1 / 512


def decay(n: int, freq: float, zeta: float) -> np.ndarray:
    """Impulse response of an oscillator."""
    omega, t = 2 * np.pi * freq, DT * np.arange(n)
    return np.exp(-zeta * omega * t) * np.sin(omega * np.sqrt(1 - zeta**2) * t)


def filtered(u: np.ndarray, freq: float = 40.0) -> np.ndarray:
    n = len(u)
    h = decay(n, freq, 0.02)
    return np.fft.irfft(np.fft.rfft(u, 2 * n) * np.fft.rfft(h, 2 * n), 2 * n)[:n]


def test_noise_of_a_random_record() -> None:
    rng = np.random.default_rng(1)
    n = 8192
    u = small_study.force(1.0, 3, n)
    clean = np.array([filtered(u), filtered(u, 90.0)])
    sd = np.array([0.02, 0.05]) * clean.std(axis=1)
    y = clean + sd[:, None] * rng.standard_normal(clean.shape)
    np.testing.assert_allclose(noise_of(u[None], y, 0), sd, rtol=0.1)


def test_noise_of_a_repeating_record() -> None:
    rng = np.random.default_rng(2)
    period = small_study.force(1.0, 5, 1024)
    u = np.tile(period, 6)
    clean = filtered(u)[None]
    y = clean + 0.03 * rng.standard_normal(clean.shape)
    assert noise_of(u[None], y, 1024)[0] == pytest.approx(0.03, rel=0.1)


def driven_together(u: np.ndarray, modes: np.ndarray) -> np.ndarray:
    """Responses (n_out, n) to one force (n,) of two modes with amplitudes `modes` (n_out, 2)."""
    return np.asarray(modes @ np.array([filtered(u), 2.0 * filtered(u, 90.0)]))


@pytest.mark.parametrize("repeats", [1, 4])
def test_the_noise_of_responses_to_a_force_that_nobody_recorded(repeats: int) -> None:
    """The force has power on every line, so that no stretch of a spectrum is noise alone; sensors that move by
    different amounts, and noise of different levels, are told apart."""
    rng = np.random.default_rng(3)
    u = np.tile(rng.standard_normal(8192 // repeats), repeats)
    clean = driven_together(u, np.array([[1.0, 0.3], [0.7, -0.5], [0.4, 0.8], [0.1, 0.2]]))
    sd = np.array([0.02, 0.05, 0.01, 0.03]) * clean.std(axis=1)
    y = clean + sd[:, None] * rng.standard_normal(clean.shape)
    np.testing.assert_allclose(noise_of(np.zeros((0, y.shape[1])), y, 0), sd, rtol=0.15)


def test_sensors_that_move_alike_share_the_noise_that_they_differ_by() -> None:
    rng = np.random.default_rng(4)
    clean = driven_together(rng.standard_normal(8192), np.array([[1.0, 0.5]] * 3))
    sd = 0.03 * clean.std(axis=1)
    y = clean + sd[:, None] * rng.standard_normal(clean.shape)
    np.testing.assert_allclose(noise_of(np.zeros((0, 8192)), y, 0), sd, rtol=0.15)


@pytest.mark.parametrize("period", [300, 512, 777])
def test_the_period_of_a_force(period: int) -> None:
    rng = np.random.default_rng(period)
    u = np.tile(rng.standard_normal(period), 5)
    assert period_of((u + 0.01 * rng.standard_normal(u.size))[None]) == period
    assert period_of(rng.standard_normal((1, 5 * period))) == 0


@pytest.fixture
def reduced(tmp_path: Path) -> ReducedModel:
    (tmp_path / "model.bdf").write_text(small_study.deck())
    model = read_model(tmp_path / "model.bdf", parameters=small_study.PARAMETERS)
    return reduce_model(model, 150.0, [6 * model.index(13) + 2])


def record_of(reduced: ReducedModel, u: np.ndarray, y: np.ndarray, dt: float = DT, name: str = "r") -> FitRecord:
    row = np.array([6 * reduced.model.index(13) + 2])
    return FitRecord(name, u, y, dt, row, row, np.ones(1), np.ones(1), np.full(1, 1e-3))


@pytest.mark.parametrize("sigma", [0.0, 3.0, 20.0])
def test_lines_are_the_transform_of_a_decay(reduced: ReducedModel, sigma: float) -> None:
    """A sampled decay r^n has the geometric sum (1 - z^N) / (1 - z), z = r exp(-s dt), at s = sigma + i omega."""
    n = 2048
    pole = 2 * np.pi * 45.0 * (-0.01 + 1j)
    y = np.exp(pole * DT * np.arange(n)).real[None]
    lines = spectral_lines(record_of(reduced, np.ones((1, n)), y), reduced, (5.0, 150.0), sigma)
    s = sigma + 2j * np.pi * lines.freq
    expected = np.zeros(len(s), dtype=complex)
    for p in (pole, pole.conjugate()):
        z = np.exp((p - s) * DT)
        expected += 0.5 * (1 - z**n) / (1 - z)
    np.testing.assert_allclose(lines.Y[:, 0], expected, rtol=0, atol=1e-9 * np.abs(expected).max())
    step = max(1, round(sigma * n * DT / (4 * np.pi)))
    assert (np.diff(lines.index) <= 2 * step - 1).all()
    assert lines.share == pytest.approx(0.1 * step)
    assert lines.freq.min() >= 5.0
    assert lines.freq.max() <= 150.0


def test_weights_know_noise_and_model(reduced: ReducedModel) -> None:
    n = 2048
    u = small_study.force(1.0, 3, n)
    y = filtered(u)[None]
    lines = spectral_lines(record_of(reduced, u[None], y), reduced, (10.0, 140.0))
    assert lines.weight.max() <= 1 / (1e-3 * np.sqrt(n)) * (1 + 1e-12)
    peak = np.argmax(np.abs(lines.Y[:, 0]))
    assert lines.weight[peak, 0] < 0.9 * lines.weight.max()


@pytest.mark.parametrize("freq", [5.0, 60.0, 180.0])
def test_an_interpolated_force_keeps_its_amplitude_in_the_band(freq: float) -> None:
    """The transform of the broken line through the new samples is that of the force: its samples times sinc squared."""
    n, factor = 1024, 8
    k = round(freq * n * DT)
    u = np.sin(2 * np.pi * k * np.arange(n) / n) * np.hanning(n)
    fine = upsampled(u[None], factor)[0]
    line = np.fft.rfft(fine, 2 * n * factor)[2 * k] / factor
    kept = line * np.sinc(2 * k / (2 * n * factor)) ** 2
    assert abs(kept - np.fft.rfft(u, 2 * n)[2 * k]) < 1e-3 * abs(kept)


def test_sampling_is_checked_against_band_and_model(reduced: ReducedModel) -> None:
    good, slow = (record_of(reduced, np.ones((1, 8)), np.ones((1, 8)), dt, "r") for dt in (DT, 1 / 200))
    check_sampling([good], (5.0, 150.0), reduced.freq)
    with pytest.raises(RecordingError, match="'r' is sampled at 200 Hz, the band of the fit recordings is 5 to 150 Hz"):
        check_sampling([good, slow], (5.0, 150.0), reduced.freq)
    with pytest.raises(RecordingError, match="lowest mode is at 400 Hz"):
        check_sampling([good], (5.0, 150.0), np.array([1e-8, 400.0, 900.0]))


def of_a_cantilever(folder: Path) -> tuple[Problem, Hypothesis]:
    """A record of a cantilever that lacks nothing, and that hypothesis."""
    (folder / "model.bdf").write_text(small_study.deck())
    model = read_model(folder / "model.bdf", parameters=list(small_study.PARAMETERS))
    u = small_study.force(1.0, 3, 1024)
    y = small_study.respond(folder, small_study.Truth(), u)
    rows = np.array([6 * model.index(node) + 2 for node in small_study.SENSORS])
    at = np.array([6 * model.index(small_study.SHAKER) + 2])
    record = FitRecord("one", u[None], y, 1 / small_study.RATE, at, rows, np.ones(1), np.ones(4), 0.01 * y.std(axis=1))
    reduced = reduce_model(model, small_study.BAND[1], sorted({*rows.tolist(), int(at[0])}))
    problem = Problem([record], small_study.BAND, 0.01, 3)
    nothing = Hypothesis(reduced, np.zeros((0, reduced.r)))
    return problem, nothing


def test_a_fit_that_breaks_down_at_its_start_is_none_and_a_continuation_begins_anew(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    problem, nothing = of_a_cantilever(tmp_path)
    reduced = nothing.reduced
    far = problem.prior(reduced)[0] + 1e3
    assert problem.fit([nothing], [(far, np.zeros(0))]) == [None]
    whole = problem.continuation(nothing)
    assert whole is not None
    fit, calls = problem.fit, []

    def broken(*args: object, sigma: float = 0.0, **more: object) -> object:
        """Lines as recorded break down where the damped ones led."""
        calls.append(sigma)
        return [None] if sigma == 0 and calls.count(0.0) == 1 else fit(*args, sigma=sigma, **more)  # type: ignore[arg-type]

    monkeypatch.setattr(problem, "fit", broken)
    again = problem.continuation(nothing)
    assert again is not None
    assert calls.count(0.0) == 2
    assert again.score == pytest.approx(whole.score, rel=0.01)


def test_of_many_starts_those_that_cost_least_are_followed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    problem, nothing = of_a_cantilever(tmp_path)
    mean = problem.prior(nothing.reduced)[0]
    starts = [(mean + step, np.zeros(0)) for step in (1e3, 1.0, 0.5, -0.3, 0.2, 0.0)]
    whole = problem.continuation(nothing, starts)
    assert whole is not None
    followed: list[list[float]] = []
    fit = Problem.fit

    def counted(self: Problem, *args: Any, **more: Any) -> list[Fit | None]:
        if more.get("iterations"):
            followed.append([float(p[0] - mean[0]) for p, _ in args[1]])
        return fit(self, *args, **more)

    monkeypatch.setattr(Problem, "fit", counted)
    found = problem.continuation(nothing, starts, cheapest=2)
    assert found is not None
    assert max(len(at) for at in followed) == 2
    # neither the one that breaks down, though it is the first, nor the one that is furthest off
    assert not {1e3, 1.0} & set(followed[0])
    assert found.cost == pytest.approx(whole.cost, rel=1e-6)


def test_many_sensors_are_followed_on_fewer_lines_and_fitted_on_all(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    problem, nothing = of_a_cantilever(tmp_path)
    whole = problem.continuation(nothing)
    assert whole is not None
    monkeypatch.setattr(fit_module, "SENSORS", 3)
    monkeypatch.setattr(fit_module, "FOLLOWED_LINES", 80)
    lines: list[int] = []
    fit = Problem.fit

    def counted(self: Problem, *args: Any, **more: Any) -> list[Fit | None]:
        lines.append(len(self.lines(nothing.reduced, more.get("sigma", 0.0))[0].s))
        return fit(self, *args, **more)

    monkeypatch.setattr(Problem, "fit", counted)
    found = problem.continuation(nothing)
    assert found is not None
    n = len(problem.lines(nothing.reduced)[0].s)
    assert max(lines[:-1]) <= 80 < n == lines[-1]
    assert found.cost == pytest.approx(whole.cost, rel=1e-3)
    np.testing.assert_allclose(found.p, whole.p, atol=1e-2)
    # a problem on few lines stays on them
    lines.clear()
    assert problem.thinned(40).continuation(nothing) is not None
    assert max(lines) <= 40
