"""A digit too many in a modulus, and a time axis at the wrong rate, are told before anything is fitted."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from femend import Recording, Test
from femend.correlate.exchanged import Shapes
from femend.correlate.resonances import clear_lines_of, common_factor, explained
from femend.estimate import pair_test
from femend.model import read_model
from femend.study import load_study
from femend.study.doubts import plausible_frequencies
from femend.study.doubts.corrections import corrections_of
from femend.study.doubts.plausible import Doubts, doubts_found

sys.path.insert(0, str(Path(__file__).parents[1]))
import small_study

FREQ = np.linspace(5.0, 90.0, 300)
SHAPES = np.random.default_rng(3).standard_normal((5, 3))
MODES = np.array([12.0, 33.0, 71.0])


def accelerances(freq: np.ndarray = MODES) -> np.ndarray:
    """Accelerances (300, 5, 1) of three modes, for a force at the first sensor."""
    w, W = 2 * np.pi * FREQ[:, None], 2 * np.pi * freq
    gain = -(w**2) / (W**2 - w**2 + 0.02j * W * w)
    return np.einsum("om,fm,m->fo", SHAPES, gain, SHAPES[0])[:, :, None]


def against(freq: np.ndarray, H: np.ndarray | None = None) -> list:
    H = accelerances() if H is None else H
    model = Shapes(freq, np.full(freq.size, 0.01), SHAPES[:, : freq.size], SHAPES[:1, : freq.size])
    return clear_lines_of(H, np.full(H.shape, 1e-3 * np.abs(H).max()), FREQ, model)


@pytest.mark.parametrize("digits", [0.01, 0.1, 10.0])
def test_resonances_elsewhere_by_one_factor_are_told_with_it(digits: float) -> None:
    off = common_factor(against(MODES * np.sqrt(digits)))
    assert off is not None
    assert off.factor == pytest.approx(np.sqrt(digits), rel=0.15)
    assert off.modes >= 2


@pytest.mark.parametrize("factor", [0.5, 0.8, 1.0, 2.0])
def test_a_model_that_is_a_little_off_is_not_doubted(factor: float) -> None:
    found = against(MODES * np.sqrt(factor))
    assert common_factor(found) is None
    assert explained(found).min() > 1


def test_one_resonance_few_sensors_and_no_force_tell_nothing() -> None:
    w, W = 2 * np.pi * FREQ, 2 * np.pi * 30.0
    alone = (SHAPES[:, 0] * (w**2 / (W**2 - w**2 + 0.02j * W * w))[:, None])[:, :, None]
    assert common_factor(against(MODES[:1] * 10, alone)) is None
    H, model = accelerances(), Shapes(MODES, np.full(3, 0.01), SHAPES, SHAPES[:1])
    assert clear_lines_of(H[:, :2], np.zeros((300, 2, 1)), FREQ, replace(model, out=SHAPES[:2])) == []
    assert clear_lines_of(H, np.zeros(H.shape), FREQ, replace(model, into=np.zeros((1, 3)))) == []
    assert common_factor([]) is None


def doubts(folder: Path, E: tuple[float, float], times: float = 1.0) -> tuple[Doubts, tuple]:
    """What is doubted where the deck says `E` and the structure has 7e10 throughout, its time step `times` too long."""
    study = load_study(small_study.write_study(folder, small_study.Truth()))
    study.model_file.write_text(small_study.deck(E))
    model = read_model(study.model_file, parameters=small_study.PARAMETERS)
    found = []
    for r in study.read_recordings():
        found.append(replace(r, data=replace(r.time, dt=r.time.dt * times)) if isinstance(r, Recording) else r)
    test = Test(tuple(found))
    pairing = pair_test(test, model)
    return doubts_found(model, test, pairing, 0.01), (model, pairing, 0.01, test)


@pytest.mark.parametrize(
    ("E", "said"),
    [
        ((7e9, 7e9), ("resonances are about 3.", "as high as the model's", "A modulus is off by about")),
        ((7e11, 7e11), ("resonances are about 3.", "as low as the model's", "A modulus is off by about")),
        ((7e9, 7e10), ("E_root (E of material 1) about 10 times what the deck says", "a digit")),
    ],
)
def test_a_digit_in_a_modulus_is_told_and_what_follows_from_it_is_not(
    tmp_path: Path, E: tuple[float, float], said: tuple[str, ...]
) -> None:
    found, _ = doubts(tmp_path, E)
    (text,) = found.texts
    assert all(word in text for word in said), text


def test_digits_are_not_tried_on_models_whose_modes_take_long(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(plausible_frequencies, "MOST_DOFS", 10)
    found, _ = doubts(tmp_path, (7e9, 7e10))
    assert "parameter" not in {one.doubt.kind for one in found.of_recordings}


@pytest.mark.parametrize("factor", [0.5, 1.0, 2.0])
def test_a_modulus_that_is_off_by_two_is_for_the_update(tmp_path: Path, factor: float) -> None:
    kinds = {one.doubt.kind for one in doubts(tmp_path, (7e10 * factor, 7e10 * factor))[0].of_recordings}
    assert not kinds & {"frequencies", "parameter", "time axis"}


def test_a_time_axis_in_milliseconds_is_told_once_and_mended(tmp_path: Path) -> None:
    found, given = doubts(tmp_path, (7e10, 7e10), 1000.0)
    (one,) = found.of_recordings
    assert (one.doubt.kind, one.doubt.factor, one.recordings) == ("time axis", 1000.0, ("low", "high"))
    right = corrections_of(*given, found.of_recordings)
    assert "first correct the recordings: the time step of low and high is about 1000 times too long" in right.advice
    assert right.start is not None
    assert right.start.null.score < 2
