"""Bands with more modes than one pLSCF model has poles for: these are looked for in parts of the band."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from femend.data import FRF
from femend.modal import ModalTest, identify_modes
from femend.modal.held_band import held_band
from femend.modal.parts import octaves

sys.path.insert(0, str(Path(__file__).parents[1]))
from modal_models import known_frf, shapes

MODES = np.geomspace(9.0, 440.0, 28) * (1 + 0.06 * np.sin(7.0 * np.arange(28)))


def wide(noise: float = 0.002) -> FRF:
    """Accelerances of 28 modes in five octaves, from one shaker."""
    f = np.linspace(0.0, 480.0, 6001)[60:]
    return known_frf(f, MODES, np.full(28, 0.006), shapes(6, 28), [0], noise=noise, seed=3)


@pytest.fixture(scope="module", name="test")
def identified() -> ModalTest:
    return identify_modes(wide())


def test_modes_of_a_wide_band_are_found(test: ModalTest) -> None:
    """One model of order 60 has 30 pairs of poles for these 28 modes: 13 were found, none of the lowest thirteen."""
    found = test.modes.freq
    apart = np.abs(found[:, None] / MODES - 1).min(axis=1)
    assert (apart < 1e-3).all(), found
    assert found.size >= 26
    assert test.error < 2 * test.noise_share
    assert test.status == "ok", test.advice


def test_the_diagram_of_parts_has_the_poles_of_its_clusters(test: ModalTest) -> None:
    diagram = test.stabilisation
    assert diagram.level.size == diagram.table.order.size
    for cluster in diagram.clusters:
        near = np.abs(diagram.table.freq[cluster.rows] / cluster.freq - 1)
        assert np.median(near) < 0.01


def test_an_order_that_is_given_stays_that_of_the_whole_band() -> None:
    assert identify_modes(wide(), max_order=60).error > 0.2


def test_it_is_told_where_modes_hold_in_hz() -> None:
    """The lowest thirteen of these modes are missing; the band that is told holds modes alone that are found."""
    missed = identify_modes(wide(), max_order=60)
    band = held_band(missed)
    assert band is not None
    low, high = band
    assert high == missed.measured.freq[-1]
    assert MODES[0] < low < MODES[-1] / 2
    inside = MODES[(low <= MODES) & (high >= MODES)]
    assert np.abs(inside[:, None] / missed.modes.freq - 1).min(axis=1).max() < 1e-3
    again = identify_modes(wide(), band, max_order=60)
    assert again.error < 0.05
    assert any(f"; from {low:.4g} to {high:.4g} Hz the modes found explain them" in text for text in missed.advice)


def test_nothing_is_told_of_modes_that_hold_everywhere(test: ModalTest) -> None:
    assert held_band(test) is None


def test_octaves_from_the_upper_end_down_have_the_lines_asked_for() -> None:
    freq = np.linspace(1.0, 100.0, 1000)
    spans = octaves(freq, 100)
    assert spans[0][0] == 0
    assert spans[-1][1] == 1000
    assert all(b - a >= 100 for a, b in spans)
    assert [round(float(freq[a])) for a, _ in spans] == [1, 13, 25, 50]
    assert octaves(np.linspace(60.0, 100.0, 1000), 100) == [(0, 1000)]
