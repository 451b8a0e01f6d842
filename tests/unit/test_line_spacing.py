"""Of lines that are much closer than resonances are wide one is taken."""

from __future__ import annotations

import numpy as np
import pytest

from femend.estimate import FitRecord, spectral_lines
from femend.estimate.line_spacing import A_RESONANCE, AT_LEAST, MANY, spaced

DT, BAND, ZETA = 0.002, (10.0, 200.0), 0.01


class _Reduced:
    """A basis of two vectors; the lines alone are looked at."""

    def rows(self, rows: np.ndarray, signs: np.ndarray) -> np.ndarray:
        return np.ones((len(rows), 2))


def record(seconds: float) -> FitRecord:
    rng = np.random.default_rng(int(seconds))
    n, rows = int(seconds / DT), np.array([0])
    u, y = rng.standard_normal((2, 1, n))
    return FitRecord("long", u, y, DT, rows, rows, np.ones(1), np.ones(1), np.full(1, 1e-3))


def lines_of(seconds: float, **more: float):  # type: ignore[no-untyped-def]
    return spectral_lines(record(seconds), _Reduced(), BAND, zeta=ZETA, **more)  # type: ignore[arg-type]


def test_lines_that_are_far_apart_are_all_taken() -> None:
    freq = np.arange(0.0, 250.0, 0.5)
    index = np.flatnonzero((freq >= 10.0) & (freq <= 200.0))
    np.testing.assert_array_equal(spaced(index, freq, np.ones(len(freq)), ZETA), index)


def test_a_resonance_has_so_many_lines_and_the_strongest_ones() -> None:
    freq = np.arange(0.0, 250.0, 0.002)
    power = np.random.default_rng(1).uniform(size=len(freq))
    index = np.flatnonzero((freq >= 50.0) & (freq <= 200.0))
    kept = spaced(index, freq, power, ZETA)
    for f in (60.0, 100.0, 150.0):
        inside = np.abs(freq[kept] - f) < ZETA * f
        assert A_RESONANCE - 2 <= inside.sum() <= A_RESONANCE * 1.4
    assert power[kept].mean() > 0.85
    assert (np.diff(kept) > 0).all()


@pytest.mark.parametrize(("first", "within"), [(10.0, A_RESONANCE * MANY / 4796), (0.002, AT_LEAST)])
def test_many_resonances_have_fewer_lines_each(first: float, within: float) -> None:
    freq = np.arange(0.0, 250.0, 0.0002)
    index = np.flatnonzero((freq >= first) & (freq <= 200.0))
    kept = spaced(index, freq, None, ZETA)
    inside = np.abs(freq[kept] - 150.0) < ZETA * 150.0
    assert inside.sum() == pytest.approx(within, abs=1.5)


def test_without_a_force_what_the_noise_shows_decides_nothing() -> None:
    freq = np.arange(0.0, 250.0, 0.002)
    index = np.flatnonzero((freq >= 10.0) & (freq <= 200.0))
    noise = np.random.default_rng(2).exponential(size=len(freq))
    assert noise[spaced(index, freq, None, ZETA)].mean() == pytest.approx(1.0, abs=0.06)
    assert len(spaced(index, freq, None, ZETA)) == len(spaced(index, freq, noise, ZETA))


def test_an_uneven_axis_keeps_its_lines_where_they_are_far_apart() -> None:
    freq = np.concatenate([np.arange(20.0, 40.0, 1.0), np.arange(40.0, 41.0, 0.001)])
    kept = spaced(np.arange(len(freq)), freq, np.ones(len(freq)), ZETA)
    assert (kept[:19] == np.arange(19)).all()
    assert len(kept) < 19 + 1000 / 20


def test_a_longer_record_has_no_more_evidence_of_an_error_that_all_lines_share() -> None:
    """Residuals of one per cent of the response on all lines cost as much in four times as long a record."""
    short, long = lines_of(120.0), lines_of(480.0)
    assert len(lines_of(12.0).freq) == pytest.approx((BAND[1] - BAND[0]) * 12.0, abs=1)

    def evidence(line) -> float:  # type: ignore[no-untyped-def]
        return float(line.share * (np.abs(0.01 * line.Y * line.weight) ** 2).sum())

    assert evidence(long) == pytest.approx(evidence(short), rel=0.2)
    everything = [spectral_lines(record(t), _Reduced(), BAND) for t in (120.0, 480.0)]  # type: ignore[arg-type]
    assert evidence(everything[1]) == pytest.approx(4.0 * evidence(everything[0]), rel=0.1)


def test_fewer_lines_still_count_as_all_that_tell_something() -> None:
    whole, few = lines_of(120.0), lines_of(120.0, limit=200)
    assert few.share * len(few.freq) == pytest.approx(whole.share * len(whole.freq), rel=0.05)
    damped = lines_of(120.0, sigma=4.0)
    assert damped.share * len(damped.freq) == pytest.approx(whole.share * len(whole.freq), rel=0.05)
