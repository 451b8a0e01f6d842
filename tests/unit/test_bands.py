"""How far up recordings are compared with a model."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from bent_beam import RATE, N, answers, bent_beam, record, row
from femend.diagnose.updating import update
from femend.estimate import FitRecord, further_band, spectral_lines, used_band
from femend.estimate.power import holds_power, may_be_noise
from femend.model import ReducedModel
from femend.model.known_mesh import Unresolved

SENSORS = [row(n, 1) for n in (3, 5, 7)]
DT = 1 / RATE
FREQ = np.fft.rfftfreq(2 * N, DT)


@pytest.fixture
def beam(tmp_path: Path) -> ReducedModel:
    return bent_beam(tmp_path, [1], 400.0)


def third(beam: ReducedModel) -> float:
    """Frequency (Hz) of the third mode, the second in which the sensors move."""
    return float(beam.freq[2])


def recorded(beam: ReducedModel, gain: NDArray[np.float64], noise: float = 1e-4, seed: int = 4) -> FitRecord:
    """A random force whose spectrum has `gain` (2049,), of which `noise` of its size is noise, and the answer to it."""
    rng = np.random.default_rng(seed)
    U = np.where(FREQ > 5, gain, 0.0) * np.fft.rfft(np.where(np.arange(2 * N) < 0.5 * N, rng.standard_normal(2 * N), 0))
    y = answers(beam, U, beam.rows([row(5, 1)])[0], beam.rows(SENSORS), np.zeros((beam.r, beam.r)))
    u = np.fft.irfft(U)[:N]
    return record(1, u + noise * u.std() * rng.standard_normal(N), y, row(5, 1), np.array(SENSORS))


def falling(beam: ReducedModel, share: float) -> NDArray[np.float64]:
    """A force that ends at 0.85 of the third mode, but for a `share` of its size up to 1.4 times that mode."""
    return np.where(0.85 * third(beam) > FREQ, 1.0, np.where(1.4 * third(beam) > FREQ, share, 0.0))


def both(beam: ReducedModel, share: float, noise: float = 1e-4) -> list[FitRecord]:
    """Two recordings of such a force."""
    return [recorded(beam, falling(beam, share), noise, seed) for seed in (4, 5)]


def test_a_resonance_just_above_the_force_is_in_the_band(beam: ReducedModel) -> None:
    pair = both(beam, 0.08)
    band = used_band(pair)
    assert band[1] < 0.95 * third(beam)
    further = further_band(band, pair)
    assert further[0] == band[0]
    assert third(beam) < further[1] <= 1.5 * band[1]
    problem = update.modelled(beam.model, pair, 0.01)[2]
    assert problem.band == further
    assert {r.known_to for r in problem.records} == {band[1]}


def test_a_band_ends_where_the_force_is_not_known_or_nothing_shows(beam: ReducedModel) -> None:
    for pair in (both(beam, 0.08, noise=0.05), both(beam, 0.0)):
        assert further_band(used_band(pair), pair) == used_band(pair)
    all_of_it = [recorded(beam, np.ones(len(FREQ)), seed=seed) for seed in (4, 5)]
    assert further_band(used_band(all_of_it), all_of_it) == used_band(all_of_it)
    unknown = [replace(r, u=r.u[:0], in_rows=r.in_rows[:0], in_signs=r.in_signs[:0]) for r in all_of_it]
    assert further_band((10.0, 50.0), unknown) == (10.0, 50.0)


def test_harmonics_above_the_force_are_no_answer_to_it(beam: ReducedModel) -> None:
    """Strong responses that do not follow the force are of what is nonlinear below."""
    pair = both(beam, 0.08)
    band = used_band(pair)
    assert further_band(band, pair) != band
    rng = np.random.default_rng(8)
    freq = np.fft.rfftfreq(N, DT)
    near = (freq > band[1]) & (freq < 1.2 * band[1])
    made = [r.y + 3 * r.y.std() * np.fft.irfft(near * np.fft.rfft(rng.standard_normal(r.y.shape))) for r in pair]
    assert further_band(band, [replace(r, y=y) for r, y in zip(pair, made, strict=True)]) == band
    # nor is there a way to tell of one recording
    assert further_band(band, pair[:1]) == band


def test_a_mesh_that_does_not_follow_what_lies_above_is_not_asked_to(
    beam: ReducedModel, monkeypatch: pytest.MonkeyPatch
) -> None:
    pair = both(beam, 0.08)
    plain = used_band(pair)

    def missed(reduced: ReducedModel, band: tuple[float, float]) -> Unresolved | None:
        return Unresolved(band[1], 0.1, 4.0, 1, plain[0]) if band[1] > plain[1] else None

    monkeypatch.setattr(update, "unresolved", missed)
    model, _, problem = update.modelled(beam.model, pair, 0.01)
    assert problem.band == plain
    assert model.unresolved is None


def test_what_may_be_noise_of_a_force() -> None:
    """As much of a line as the lines with the least power say."""
    rng = np.random.default_rng(3)
    freq = np.fft.rfftfreq(N, DT)
    gain = np.where(freq < 90, 1.0, np.where(freq < 200, 0.05, 0.0))
    clean = np.fft.irfft(gain * np.fft.rfft(rng.standard_normal(N)))
    noise = 0.002 * rng.standard_normal(N)
    share = may_be_noise((clean + noise)[None], DT)
    end = holds_power(clean[None], DT)[1]
    assert 80 < end < 90
    assert (share[freq <= end] < 1e-3).all()
    known = np.median(np.abs(np.fft.rfft(noise)) ** 2) / np.median(
        np.abs(np.fft.rfft(clean)[(freq > 95) & (freq < 195)]) ** 2
    )
    assert np.median(share[(freq > 95) & (freq < 195)]) == pytest.approx(known, rel=0.3)
    assert (share[(freq > 210) & (freq < 400)] > 0.2).all()


def test_lines_of_a_force_in_doubt_count_less(beam: ReducedModel) -> None:
    sure, doubted = (recorded(beam, falling(beam, 0.08), noise) for noise in (0.0, 0.02))
    end = holds_power(sure.u, DT)[1]
    lines, less = (
        spectral_lines(replace(doubted, known_to=known), beam, (5.0, 1.2 * third(beam))) for known in (np.inf, end)
    )
    ratio = lines.weight / less.weight
    np.testing.assert_array_equal(ratio[lines.freq <= end], 1.0)
    assert ratio[lines.freq > 1.05 * end].mean() > 1.3
