"""The part of the only fit recording that chooses between laws and that none is fitted to."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from femend.diagnose.fitting.known_force import Known
from femend.diagnose.locating.held_back import HELD_BACK, before, hold_back, since
from femend.diagnose.locating.split import Split, split_records
from femend.estimate import FitRecord, Problem, spectral_lines
from femend.estimate.frf import FrfLines
from femend.model import Place

N, DT, BAND = 2000, 0.005, (5.0, 80.0)
CUT = 1300


def record(u: np.ndarray | None = None, **changes: object) -> FitRecord:
    rng = np.random.default_rng(1)
    u = rng.standard_normal((1, N)) if u is None else u
    rows = np.array([0])
    made = FitRecord("only", u, rng.standard_normal((1, N)), DT, rows, rows, np.ones(1), np.ones(1), np.ones(1))
    return replace(made, **changes)  # type: ignore[arg-type]


def split_of(r: FitRecord, n_tuned: int = 5) -> Split:
    return split_records(Problem([r], BAND, 0.01, n_tuned))


def test_laws_are_fitted_to_what_comes_before_the_part_that_chooses() -> None:
    found = split_of(record())
    (whole,), (early,), (late,) = found.whole.records, found.fitting.records, found.choosing.records
    assert (early.n, late.start, late.n) == (CUT, CUT, N)
    np.testing.assert_array_equal(early.y, whole.y[:, :CUT])
    assert [r.name for r in found.unseen] == ["only"]
    assert found.told() == ("laws were chosen on the last 35 % (3.5 s) of recording 'only', which none was fitted to")


def test_laws_that_were_compared_in_the_beginning_alone_were_fitted_to_it() -> None:
    assert "which they were fitted to as well, since they cannot be followed" in split_of(record()).told(sigma=1.0)


class _Reduced:
    """A basis of two vectors; the lines alone are looked at."""

    def rows(self, rows: np.ndarray, signs: np.ndarray) -> np.ndarray:
        return np.ones((len(rows), 2))


def test_the_lines_that_choose_are_those_of_the_part_alone() -> None:
    r = since(record(), CUT)
    changed = replace(r, y=np.hstack([r.y[:, :CUT] + 7.0, r.y[:, CUT:]]))
    lines, others = (spectral_lines(x, _Reduced(), BAND) for x in (r, changed))  # type: ignore[arg-type]
    assert (lines.first, lines.n) == (CUT, N - CUT)
    np.testing.assert_array_equal(lines.Y, others.Y)
    np.testing.assert_allclose(np.diff(lines.freq), 1 / ((N - CUT) * DT), rtol=1e-9)
    windowed = spectral_lines(r, _Reduced(), BAND, sigma=1.0)  # type: ignore[arg-type]
    assert (windowed.first, windowed.n) == (0, N)


@pytest.mark.parametrize(("tuned", "chooses"), [(5, True), (40, False)])
def test_a_part_with_few_lines_a_mode_does_not_choose(tuned: int, chooses: bool) -> None:
    found = split_of(record(), tuned)
    assert (found.choosing is not found.fitting) is chooses
    assert ("lines of the band" in found.told()) is not chooses


def test_a_sweep_or_a_blow_excites_other_modes_in_each_part() -> None:
    t = DT * np.arange(N)
    sweep = np.sin(2 * np.pi * (BAND[0] * t + 0.5 * (BAND[1] - BAND[0]) / t[-1] * t**2))[None]
    blow = np.zeros((1, N))
    blow[0, 10:13] = 1.0
    for u, share in ((sweep, "of the force's energy between 5 and 17.5 Hz"), (blow, "hold 0 % of the force's energy")):
        held = hold_back(Problem([record(u)], BAND, 0.01, 5))
        assert held.cut == 0
        assert share in held.text


def test_an_frf_and_a_force_that_nobody_recorded_are_not_cut() -> None:
    lines = FrfLines.__new__(FrfLines)
    assert "an FRF has no part" in hold_back(Problem([record(frf=lines)], BAND, 0.01, 5)).why
    assert "force was not recorded" in hold_back(Problem([record(np.zeros((0, N)))], BAND, 0.01, 5)).why


def test_the_same_cut_with_other_noise_and_other_records() -> None:
    found = split_of(record())
    louder = Problem([record(noise=np.full(1, 2.0))], BAND, 0.01, 5)
    again = found.of(louder)
    assert [r.noise[0] for r in (*again.fitting.records, *again.choosing.records)] == [2.0, 2.0]
    assert again.choosing.records[0].start == CUT
    turned = found.changed(lambda r: replace(r, in_signs=-r.in_signs))
    assert [p.records[0].in_signs[0] for p in (turned.whole, turned.fitting, turned.choosing)] == [-1.0] * 3
    assert turned.fitting.records[0].n == CUT
    assert turned.told() == found.told()


def test_a_record_that_repeats_itself_less_than_twice_before_the_cut_does_not_repeat() -> None:
    assert before(record(period=600), CUT).period == 600
    assert before(record(period=800), CUT).period == 0
    assert round(HELD_BACK * N) == N - CUT


def test_a_force_taken_as_known_ends_with_the_part_that_is_fitted() -> None:
    place = Place("ground", (1,), "X", "ground", (np.array([0]),), (np.ones(1),))
    force = np.arange(float(N))[None]
    found = Known((place,), {"only": (force,)}).split(split_of(record()))
    (early,), (late,) = found.fitting.records, found.choosing.records
    np.testing.assert_array_equal(early.u[1], force[0, :CUT])
    np.testing.assert_array_equal(late.u[1], force[0])
    assert late.start == CUT
