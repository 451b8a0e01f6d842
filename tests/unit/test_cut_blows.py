"""Blows whose top or beginning is missing are told, and left out of a fit where others are whole."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from femend.data import Channel, Recording, Test, TimeData
from femend.dof import Dof
from femend.study.file.channels_sound import with_warnings
from femend.study.file.cut_blows import cut_blows, left_out, none_whole, of_whole_blows, without_cut_blows

DT, N = 1 / 1024, 2048


def struck(name: str, force: np.ndarray) -> Recording:
    rng = np.random.default_rng(3)
    channels = [Channel(Dof(3, 1), "force", "N"), Channel(Dof(3, 1), "acceleration", "m/s^2")]
    return Recording(name, TimeData(name, DT, np.vstack([force, rng.standard_normal(N)]), channels))


def blow(at: float, samples: float = 6.0, noise: float = 0.02) -> np.ndarray:
    """(N,) a bell of 100 N with noise that begins at the sample `at`."""
    x = (np.arange(N) - at) / samples
    u = np.where((x > 0) & (x < 1), 100 * np.sin(np.pi * x) ** 2, 0.0)
    return np.asarray(u + noise * np.random.default_rng(1).standard_normal(N))


@pytest.mark.parametrize("sense", [1, -1])
def test_a_clipped_blow_is_told_with_its_time(sense: int) -> None:
    (text,) = cut_blows(struck("a", sense * np.minimum(blow(100.3), 60.0)))
    assert "stays at its peak of 60" in text
    assert "0.1005" in text or "0.1006" in text or "0.1015" in text


@pytest.mark.parametrize("lost", [1.6, 3.0, 4.5])
def test_a_blow_that_was_begun_before_the_first_sample_is_told(lost: float) -> None:
    (text,) = cut_blows(struck("a", blow(-lost)))
    assert "begins within the blow" in text


def test_whole_blows_are_left_as_they_are() -> None:
    # an even top by symmetry, a trigger at a tenth of the peak, an offset, and a rebound are no faults
    symmetric = blow(100.5, noise=0.0)
    for force in (blow(100.3), symmetric, blow(-0.6), blow(50.0) + 2.0, blow(50.2) + 0.4 * blow(90.1)):
        found = with_warnings(struck("a", force))
        assert not [w for w in found.warnings if "force" in w], found.warnings


def test_a_fit_is_of_whole_blows_where_there_are_some() -> None:
    forces = {"whole": blow(100.3), "cut": np.minimum(blow(100.3), 60.0)}
    whole, cut = (with_warnings(struck(name, force)) for name, force in forces.items())
    assert [r.name for r in of_whole_blows([cut, whole])] == ["whole"]
    assert left_out([cut, whole]) == ["recording 'cut' is not fitted, since its blows were not recorded whole"]
    assert none_whole([cut, whole]) == []
    predicted = replace(cut, name="predicted", role="predict")
    assert [r.name for r in without_cut_blows(Test((cut, whole, predicted)))] == ["whole", "predicted"]
    # where none is whole all are fitted, and that is told
    assert [r.name for r in of_whole_blows([cut])] == ["cut"]
    assert left_out([cut]) == []
    assert len(none_whole([cut])) == 1
