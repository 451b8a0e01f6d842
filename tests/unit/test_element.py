"""The law of an element measured by itself, on loops made with laws whose parameters are known."""

from __future__ import annotations

import doctest
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from femend import _core
from femend.diagnose.element import element
from femend.diagnose.element.element import fit_element, refit_element
from femend.errors import LawParameterError, RecordingError

DT = 1 / 200
TRUE: dict[str, Mapping[str, float]] = {
    "play_friction": {"f": 2.0, "kt": 30.0, "gap": 0.08},
    "coulomb_friction": {"f": 2.0, "kt": 30.0},
    "bouc_wen": {"k": 20.0, "alpha": 0.0, "n": 1.5, "beta": 30.0, "gamma": 12.0},
    "cubic_stiffness": {"k3": 4.0},
    "clearance": {"k": 12.0, "gap": 0.5, "sides": 2.0},
    "quadratic_damping": {"c": 0.6},
    "viscoelastic": {"k0": 1.0, "k1": 5.0, "tau": 0.2},
}
RIVALS = [*TRUE, "displacement_damping", "saturating_stiffness", "quadratic_stiffness"]


def loop(law: str, seed: int, *, noise: float = 0.02) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A sine that grows and decays with a slower one beside it, and the law's force with a spring and noise."""
    t = np.arange(3000) * DT
    window = np.sin(np.pi * t / t[-1]) ** 0.5
    phase = np.random.default_rng(seed).uniform(0, 6)
    d = window * (np.sin(2 * np.pi * 0.7 * t) + 0.3 * (np.sin(2 * np.pi * 0.23 * t + phase) - np.sin(phase)))
    v = np.gradient(d, DT)
    f = _core.law_force(law, TRUE[law], d, v, np.gradient(v, DT), DT) + 0.5 * d + 0.02 * v + 0.1
    return d, v, f + noise * f.std() * np.random.default_rng(seed + 1).standard_normal(len(f))


@pytest.mark.parametrize("law", TRUE)
def test_the_law_is_named_with_its_parameters(law: str) -> None:
    d, v, f = loop(law, 3)
    fit = fit_element(d, v, f, DT, laws=RIVALS)
    assert fit.best.name == law, repr(fit)
    assert fit.adequate
    assert fit.to_noise
    assert fit.margin > 4
    # another motion, nothing fitted: the noise (2 %) is left and little more
    assert fit.best.nrmse(*loop(law, 8), DT) < 0.025
    assert fit.best.force(*loop(law, 8)[:2], DT).shape == (3000,)
    if law in ("play_friction", "coulomb_friction", "cubic_stiffness", "clearance"):
        for name, true in TRUE[law].items():
            assert fit.best.values[name] == pytest.approx(true, rel=0.03), name


def test_deviations_cover_what_was_put_in() -> None:
    away = []
    for seed in range(12):
        law = fit_element(*loop("play_friction", 10 * seed), DT, laws=["play_friction"])["play_friction"]
        away += [(law.values[name] - true) / law.sd[name] for name, true in TRUE["play_friction"].items()]
    # 36 numbers of variance one: their mean square is within 0.4 to 2 but once in a thousand
    assert 0.4 < np.mean(np.square(away)) < 2.0


def test_a_linear_element_gets_no_law() -> None:
    d, v, _ = loop("cubic_stiffness", 1)
    f = 3 * d + 0.2 * v + 0.02 * np.random.default_rng(0).standard_normal(len(d))
    fit = fit_element(d, v, f, DT, laws=RIVALS)
    assert fit.best.name == "spring and dashpot", repr(fit)
    assert (fit.best.k, fit.best.c) == pytest.approx((3, 0.2), rel=0.01)


def test_a_law_outside_those_tried_is_not_adequate() -> None:
    d, v, f = loop("clearance", 2)
    fit = fit_element(d, v, f, DT, laws=["quadratic_damping", "bouc_wen"])
    assert not fit.adequate


@pytest.mark.parametrize(
    "force",
    [
        lambda d, v: 4 * d**5,
        lambda d, v: np.sign(v) * np.abs(v) ** 0.5,
        lambda d, v: v * np.abs(d),
        lambda d, v: 3 * np.sin(3 * d),
        lambda d, v: 4 * d**3 + np.tanh(v / 0.05),
    ],
)
def test_what_no_single_law_is_does_not_pass_for_noise(force) -> None:  # type: ignore[no-untyped-def]
    d, v, _ = loop("cubic_stiffness", 5)
    f = force(d, v) + 0.5 * d
    f = f + 0.03 * f.std() * np.random.default_rng(1).standard_normal(len(f))
    assert not fit_element(d, v, f, DT, laws=[*RIVALS, "hertz_contact"]).to_noise


def test_several_records_and_no_velocity() -> None:
    one, two = loop("play_friction", 1), loop("play_friction", 2)
    fit = fit_element([one[0], two[0]], None, [one[2], two[2]], DT, laws=["play_friction", "coulomb_friction"])
    assert fit.best.values["gap"] == pytest.approx(0.08, rel=0.03)


def test_one_parameter_of_another_setting() -> None:
    law = fit_element(*loop("play_friction", 1), DT, laws=["play_friction"])["play_friction"]
    d, v, _ = loop("play_friction", 2)
    tighter = {**TRUE["play_friction"], "f": 3.0}
    f = _core.law_force("play_friction", tighter, d, v, np.gradient(v, DT), DT) + 0.5 * d + 0.02 * v + 0.1
    new = refit_element(law, ["f"], d, v, f, DT)
    assert new.values["f"] == pytest.approx(3.0, rel=0.01)
    assert new.values["gap"] == law.values["gap"]
    assert new.fitted**0.5 < 0.02
    with pytest.raises(LawParameterError, match="no free parameter 'k'"):
        refit_element(law, ["k"], d, v, f, DT)


def test_a_search_passes_the_unit_of_what_it_looks_for() -> None:
    """On its way from 0.98 to 2.75 of a real damper it stopped at 1, where steps relative to a logarithm vanish."""
    d, v, f = loop("play_friction", 1)
    law = fit_element(d, v, f, DT, laws=["play_friction"])["play_friction"]
    at_one = replace(law, values={**law.values, "f": 1.0 + 1e-12})
    tighter = {**law.values, "f": 3.0}
    more = _core.law_force("play_friction", tighter, d, v, np.gradient(v, DT), DT)
    new = refit_element(at_one, ["f"], d, v, more + law.k * d + law.c * v + law.f0, DT)
    assert new.values["f"] == pytest.approx(3.0, rel=1e-3)


def test_a_scale_of_units_changes_nothing() -> None:
    d, v, f = loop("play_friction", 4)
    plain = fit_element(d, v, f, DT, laws=["play_friction", "bouc_wen"])
    scaled = fit_element(25.4 * d, 25.4 * v, 4448 * f, DT, laws=["play_friction", "bouc_wen"])
    assert scaled.best.name == plain.best.name
    assert scaled.best.values["gap"] == pytest.approx(25.4 * plain.best.values["gap"], rel=1e-3)
    assert scaled.best.chosen == pytest.approx(plain.best.chosen, rel=1e-3)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda d, v, f: (d[:-1], v, f), "equally long"),
        (lambda d, v, f: (d[:20], v[:20], f[:20]), "20 samples are too few"),
        (lambda d, v, f: (0 * d, 0 * v, f), "does not move"),
        (lambda d, v, f: (d, v, 0 * f), "zero throughout"),
        (lambda d, v, f: (d, v, np.where(d > 0.5, np.nan, f)), "NaN"),
        (lambda d, v, f: ([d, d], [v], [f]), "do not pair up"),
    ],
)
def test_broken_records_are_refused(change, said: str) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(RecordingError, match=said):
        fit_element(*change(*loop("cubic_stiffness", 1)), DT)


def test_a_name_that_is_no_law_is_refused() -> None:
    with pytest.raises(LawParameterError, match="play_friction"):
        fit_element(*loop("play_friction", 1), DT, laws=["play_fricton"])


def test_the_docstring_example_holds() -> None:
    assert doctest.testmod(element).failed == 0
