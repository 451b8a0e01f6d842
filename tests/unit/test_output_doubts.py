"""Mistakes with sensors are told where no force was measured; a verdict from modes says how far frequencies are off."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.sparse import csc_array, diags_array

from femend import Channel, Dof, Recording, Test, TimeData, correlate_study, functions_of, write_uff
from femend.correlate.exchanged import Shapes
from femend.correlate.misread import misread
from femend.estimate import pair_test
from femend.modal.output_only.principal import principal_responses
from femend.model.reduced.reduction import core_modes
from femend.report.headline import headline
from femend.report.mode_words import frequency_errors
from femend.study.doubts.plausible import doubts_found
from femend.study.run import diagnose

sys.path.insert(0, str(Path(__file__).parents[1]))
import small_study

RATE, SECONDS = 512.0, 60.0


def ambient(folder: Path, E: float = 7e10, driven: int = 13) -> tuple[small_study.Model, np.ndarray]:
    """The small cantilever, and accelerations at its sensors (4, n) of one with another modulus, driven by white forces
    at all free nodes or, `driven` 1, at the tip."""
    from femend.analysis.frf import shapes_at
    from femend.analysis.model_modes import model_modes

    model, _ = small_study.cantilever(folder)
    modes = model_modes(model, f_max=250.0, zeta=0.012, factors={"E_root": E / 7e10, "E_tip": E / 7e10})
    rng, n = np.random.default_rng(4), int(RATE * SECONDS)
    nodes = range(2, 14) if driven > 1 else [13]
    into = shapes_at(modes, [Dof(k, 3) for k in nodes])
    out = shapes_at(modes, [Dof(k, 3) for k in small_study.SENSORS])
    w, W = 2 * np.pi * np.fft.rfftfreq(n, 1 / RATE), 2 * np.pi * modes.freq[:, None]
    forces = np.fft.rfft(rng.standard_normal((len(into), n)), axis=1)
    y = np.fft.irfft(out @ (-(w**2) / (W**2 - w**2 + 0.024j * W * w) * (into.T @ forces)), n, axis=1)
    return model, y + 0.02 * y.std(axis=1, keepdims=True) * rng.standard_normal(y.shape)


def told(model: small_study.Model, y: np.ndarray, excitation: str = "ambient", dt: float = 1 / RATE) -> list[str]:
    channels = tuple(Channel(Dof(n, 3), "acceleration", "m/s^2") for n in small_study.SENSORS)
    data = TimeData("ambient", dt, y, channels)
    test = Test((Recording("ambient", data, excitation=excitation),))
    return doubts_found(model, test, pair_test(test, model), 0.01).texts


@pytest.mark.parametrize(("E", "driven", "excitation"), [(6e10, 13, "ambient"), (8e10, 1, "unknown")])
def test_a_sound_recording_of_a_structure_that_is_off_is_not_doubted(
    tmp_path: Path, E: float, driven: int, excitation: str
) -> None:
    assert told(*ambient(tmp_path, E, driven), excitation) == []


@pytest.mark.parametrize(
    ("factor", "said"),
    [(-1.0, ("looks reversed", "turn its direction")), (1 / 9.80665, ("0.1 times", "g and m/s²"))],
)
def test_one_sensor_reversed_or_in_other_units_is_named(tmp_path: Path, factor: float, said: tuple[str, ...]) -> None:
    model, y = ambient(tmp_path, 6e10)
    (text,) = told(model, y * np.array([1, 1, factor, 1])[:, None])
    assert all(word in text for word in ("10:+Z", *said)), text


def test_two_exchanged_sensors_are_named(tmp_path: Path) -> None:
    model, y = ambient(tmp_path, 6e10)
    (text,) = told(model, y[[2, 1, 0, 3]])
    assert "4:+Z and 10:+Z look exchanged" in text


@pytest.mark.parametrize(("factor", "said"), [(1000.0, "milliseconds and seconds"), (6.3, "rad/s and Hz")])
def test_a_time_step_that_is_mistaken_is_told_by_shapes(tmp_path: Path, factor: float, said: str) -> None:
    model, y = ambient(tmp_path, 6e10)
    (text,) = [text for text in told(model, y, dt=factor / RATE) if "time step" in text]
    assert "times what it should be" in text
    assert said in text


def at_another_rate(folder: Path, times: float) -> Path:
    """The study of an ambient recording whose step is so many times what it should be."""
    _, y = ambient(folder, 6e10)
    channels = tuple(Channel(Dof(n, 3), "acceleration", "m/s^2") for n in small_study.SENSORS)
    write_uff(folder / "ambient.uff", functions_of(TimeData("ambient", times / RATE, y, channels)))
    tables = '[[recording]]\nname = "ambient"\nfile = "ambient.uff"\nrole = "fit"\nexcitation = "ambient"\n'
    return small_study.write_unrecorded(folder, tables)


@pytest.mark.parametrize(("times", "doubted"), [(1000.0, True), (1.0, False)])
def test_a_correlation_tells_a_mistaken_time_axis(tmp_path: Path, times: float, doubted: bool) -> None:
    result = correlate_study(at_another_rate(tmp_path, times)).result
    said = [w for w in result["warnings"] if "milliseconds and seconds mistaken for each other give 1000" in w]
    assert len(said) == doubted
    assert result["advice"].startswith("mend the time axis of the recordings") == doubted


def test_a_study_at_the_wrong_rate_is_undetermined_and_compared_at_the_right_one(tmp_path: Path) -> None:
    result = diagnose(at_another_rate(tmp_path, 1000.0)).result
    assert (result["verdict"], result["findings"]) == ("undetermined", [])
    assert "first correct the recordings: the time step of ambient is about 1000 times too long" in result["advice"]
    assert headline(result).startswith("The recordings have to be corrected")
    (row,) = result["corrections"]
    assert (row["mistake"], row["factor"], row["left_out"]) == ("time axis", 1000.0, False)
    # the lowest modes are those of the model
    modes = [m for stage in result["stages"] for m in stage["modes"]]
    assert all(abs(m["model_freq"] / m["freq"] - 1) < 0.05 for m in modes if m["mac"] > 0.9)


def test_few_samples_and_few_sensors_tell_nothing() -> None:
    freq, h, noise = principal_responses(np.ones((4, 100)), 0.01)
    assert freq.size == 0
    assert h.shape == noise.shape == (0, 4)
    modes = Shapes(np.array([10.0]), np.array([0.01]), np.ones((2, 1)), np.ones((1, 1)))
    assert misread(np.ones((50, 2), complex), np.zeros((50, 2)), np.linspace(1, 50, 50), modes) == []


def result(errors: list[float], sd: float = 0.001, verdict: str = "parameters-only") -> dict[str, object]:
    modes = [
        {"freq": 10.0 * i, "model_freq": 10.0 * i * (1 + e), "mac": 0.99, "freq_sd": sd * 10.0 * i}
        for i, e in enumerate(errors, 1)
    ]
    modes.append({"freq": 99.0, "model_freq": 60.0, "mac": 0.3, "freq_sd": 0.1})
    return {
        "verdict": verdict, "findings": [], "parameters": {"E": {"factor": 0.9}}, "fit": [],
        "stages": [{"stage": "output-only modes", "modes": modes}],
    }  # fmt: skip


def test_a_verdict_from_modes_alone_says_how_far_they_are_off() -> None:
    near = headline(result([0.001, -0.002, 0.0005]))
    assert near.startswith("Nothing is missing as far as these modes tell: the model once updated (E −10.0 %)")
    for said in ("0.1 % off", "−0.2 % at 20 Hz", "scatter is 0.1 %", "1 more without a counterpart"):
        assert said in near
    far = headline(result([0.012, -0.015, 0.01], verdict="consistent"))
    assert far.startswith("Nothing at one place is missing")
    assert "does not explain them" in far
    assert "1.2 % off" in far


def test_errors_of_modes_without_known_scatter() -> None:
    errors = frequency_errors(result([0.001, 0.001], sd=0.0))
    assert errors is not None
    assert np.isnan(errors.scatter)
    assert "scatter" not in errors.text
    assert frequency_errors({"stages": [{"stage": "FRFs"}]}) is None


def test_matrices_of_which_one_lost_its_zeros_are_solved() -> None:
    """A sum of SciPy's has fewer entries than its parts: an ambient study of shells ended in a traceback."""
    n = 500
    K = csc_array(diags_array([-np.ones(n - 1), 2 * np.ones(n), -np.ones(n - 1)], offsets=[-1, 0, 1]))
    M = csc_array(diags_array([np.zeros(n - 1), np.ones(n), np.zeros(n - 1)], offsets=[-1, 0, 1]))
    freq, _ = core_modes(csc_array(K + csc_array((n, n))), M, 0.01)
    exact = np.sqrt(2 - 2 * np.cos(np.pi * np.arange(1, 6) / (n + 1))) / (2 * np.pi)
    np.testing.assert_allclose(freq[:5], exact, rtol=1e-6)
    assert M.nnz < K.nnz
