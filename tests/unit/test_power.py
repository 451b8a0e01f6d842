"""What the excitation cannot tell is said."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from femend.diagnose.deciding.power import untold
from femend.estimate import FitRecord
from femend.estimate.frf import FrfLines


def record(name: str, level: float, period: int = 0) -> FitRecord:
    u = level * np.random.default_rng(0).standard_normal((1, 64))
    at = np.array([0])
    return FitRecord(name, u, u, 0.01, at, at, np.ones(1), np.ones(1), np.ones(1), period)


def test_nothing_is_untold_of_what_repeats_itself_at_several_levels() -> None:
    assert untold([record("low", 1.0, 16), record("high", 2.5, 16)]) == []


def test_one_level_does_not_tell_hardening_from_stiffness() -> None:
    (said,) = untold([record("a", 1.0, 16), record("b", 1.5, 16)])
    assert said.startswith("one level only (a, b): a hardening or softening stiffness may pass for a linear one")


def test_without_repetition_a_weak_nonlinearity_counts_as_noise() -> None:
    (said,) = untold([record("low", 1.0), record("high", 3.0)])
    assert said.startswith("no recording repeats itself: what a weak nonlinearity")
    assert len(untold([record("only", 1.0)])) == 2


def test_frfs_hold_no_level() -> None:
    frf = replace(record("f", 1.0), frf=FrfLines.__new__(FrfLines))
    (said,) = untold([frf])
    assert said.startswith("FRFs alone hold no level")
