"""Silence of recordings that could not have shown anything is no verdict."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from femend.diagnose.deciding.too_little import too_little
from femend.diagnose.updating.update import UpdatedModel
from femend.estimate import FitRecord

sys.path.insert(0, str(Path(__file__).parents[1]))
import small_study


@pytest.fixture(scope="module")
def sound(tmp_path_factory: pytest.TempPathFactory) -> UpdatedModel:
    return small_study.updated(tmp_path_factory.mktemp("sound"), small_study.Truth(E=(6.6e10, 7e10)))


def too_little_of(sound: UpdatedModel, records: list[FitRecord]) -> str:
    problem = SimpleNamespace(band=sound.problem.band, records=records)
    return too_little(problem, sound.reduced)  # type: ignore[arg-type]


def test_recordings_that_are_long_enough_may_be_silent(sound: UpdatedModel) -> None:
    assert too_little(sound.problem, sound.reduced) == ""


def test_few_periods_say_nothing(sound: UpdatedModel) -> None:
    said = too_little_of(sound, [replace(r, u=r.u[:, 300:359], y=r.y[:, 300:359]) for r in sound.problem.records])
    assert "holds 0.115 s in 59 samples, 1.9 periods" in said
    assert "record 1.2 s or more" in said


def test_noise_hides_what_may_be_missing(sound: UpdatedModel) -> None:
    said = too_little_of(sound, [replace(r, noise=80 * r.noise) for r in sound.problem.records])
    assert "% of " in said
    assert "drive harder" in said


def test_a_blow_that_has_died_away_is_all_there_is(sound: UpdatedModel) -> None:
    first = sound.problem.records[0]
    decay = np.exp(-np.arange(59) / 10.0)

    blow = replace(first, u=first.u[:, :59] * decay, y=first.y[:, 300:359] * decay)
    assert too_little_of(sound, [blow]) == ""
