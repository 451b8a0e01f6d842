"""Forces that reach further than the band that models are compared in: modes above it ring when the record ends."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from femend.diagnose.updating.update import modelled, update_model
from femend.estimate import FitRecord, Hypothesis
from femend.model import Model, Parameter, read_model

sys.path.insert(0, str(Path(__file__).parents[1]))
import small_study

RATE, SECONDS, NOISE, ZETA = 2048.0, 4.0, 0.01, 0.01
# a bar of eight elements, of which the mesh follows the first two of four modes that the force drives
BAR = (
    "SOL 103\nCEND\nSPC=1\nBEGIN BULK\nMAT1,1,7.0+10,,0.33,2700.\nPBAR,1,1,6.0-4,2.0-8,4.5-8,5.0-8\n"
    + "".join(f"GRID,{i + 1},,{0.1 * i:.1f},0.,0.\n" for i in range(9))
    + "".join(f"CBAR,{i},1,{i},{i + 1},0.,0.,1.\n" for i in range(1, 9))
    + "SPC1,1,123456,1\nSPC1,1,1246,2,THRU,9\nENDDATA\n"
)


@pytest.fixture(scope="module")
def deck(tmp_path_factory: pytest.TempPathFactory) -> Model:
    path = tmp_path_factory.mktemp("reach") / "bar.bdf"
    path.write_text(BAR)
    return read_model(path, parameters=(Parameter("E", "E", "material", (1,)),))


@pytest.fixture(scope="module")
def record(deck: Model) -> FitRecord:
    """White noise up to half the sampling rate at node 7, and what the deck's modes make of it; all ends at once."""
    rows = np.array([6 * deck.index(node) + 2 for node in (7, 4, 6, 9)])
    omega, phi = small_study.dense_modes(deck)
    n, rng = int(RATE * SECONDS), np.random.default_rng(3)
    u = rng.standard_normal(n)
    s = 2j * np.pi * np.fft.rfftfreq(2 * n, 1 / RATE)[:, None]
    modes = s**2 / (s**2 + 2 * ZETA * omega * s + omega**2) * phi[rows[0]]
    y = np.fft.irfft((modes @ phi[rows[1:]].T) * np.fft.rfft(u, 2 * n)[:, None], axis=0)[:n].T
    noise = np.full(3, NOISE * y.std())
    y = y + noise[:, None] * rng.standard_normal(y.shape)
    return FitRecord("r", u[None], y, 1 / RATE, rows[:1], rows[1:], np.ones(1), np.ones(3), noise)


def test_modes_above_the_band_that_the_force_drives_ring_on(deck: Model, record: FitRecord) -> None:
    """What the record's end cuts off of them is no misfit: held to their skirts in the band they left 1.7 times the
    noise at the true values, and friction of no size was told."""
    _, reduced, problem = modelled(deck, [record], ZETA, as_built_in=(5.0, 267.0))
    alone = Hypothesis(reduced, np.zeros((0, reduced.r)))
    (fit,) = problem.fit([alone], [(problem.prior(reduced)[0], np.zeros(0))], iterations=0)
    assert fit is not None
    assert 0.8 < fit.score < 1.1
    assert record.driven_to > 2 * np.pi * 900.0


def test_a_deck_that_recordings_were_simulated_with_is_compared_in_all_of_their_band(
    deck: Model, record: FitRecord
) -> None:
    start = update_model(deck, [record], ZETA)
    assert start.reduced.model.simulated
    assert start.problem.band[1] > 900.0
    assert start.null.score < 1.1
    assert start.null.p[0] == pytest.approx(0.0, abs=1e-3)
