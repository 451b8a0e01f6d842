"""Recordings: the recorder's filter, effects beside each other, and what an update of the deck may absorb of one."""

from __future__ import annotations

import dataclasses

import numpy as np
from blindgen import acquire, effects, laws, respond, setting, truth, update
from blindgen.integrate import Law


def test_recorder_folds_nothing_back() -> None:
    """Sines in the band come out as they are, without delay; above half the rate nothing is left of them."""
    n = 400
    t = np.arange(acquire.FINER * (n + acquire.AFTER)) / acquire.FINER
    inside = slice(2 * acquire.AFTER, n - acquire.AFTER)
    for f in (0.02, 0.2, 0.41):
        out = acquire.sampled(np.sin(2 * np.pi * f * t), n)
        assert np.abs(out - np.sin(2 * np.pi * f * np.arange(n)))[inside].max() < 3e-4
    for f in (0.53, 0.8, 1.1, 1.9):
        assert np.abs(acquire.sampled(np.sin(2 * np.pi * f * t), n))[inside].max() < 3e-4


def test_two_effects_add_up_where_they_are_linear(short: None) -> None:
    """A spring and a mass together: the truth with both is the truth with one whose deck already has the other."""
    rng = np.random.default_rng(3)
    test = setting.draw_test(rng, "cantilever", "", 0.02)
    x = 2e3
    spring = effects.Effect("s", [4], "Z", "ground", (1, 1), dict, law=lambda k: Law(laws.SPRING, laws.pack(k)))
    mass = effects.Effect("m", [6], "", "", (1, 1), dict, change=lambda m: truth.Change(mass={6: m}))
    both, _ = respond.record(test, ((spring, x), (mass, 0.1)), "high")
    built = truth.build(test.s, test.real, truth.Change(mass={6: 0.1}))
    changed = dataclasses.replace(test, plain=built)
    second, _ = respond.record(changed, ((spring, x),), "high")
    one, _ = respond.record(test, ((spring, x),), "high")
    assert np.linalg.norm(both - second) < 1e-6 * np.linalg.norm(both)
    assert np.linalg.norm(both - one) > 1e-2 * np.linalg.norm(both)


def test_update_absorbs_what_it_may_and_nothing_else(short: None) -> None:
    """Derivatives against differences; moduli 6 % off are fitted away, what no unknown makes stays."""
    rng = np.random.default_rng(3)
    test = setting.draw_test(rng, "cantilever", "", 0.02)
    base, _ = respond.record(test, (), "high")
    fit = update.Update(test, base)
    theta = 0.02 * rng.standard_normal(len(fit.sd))
    J, h = fit.derivatives(theta, fit.response(theta)[1]), 1e-5
    for i in range(0, len(theta), 4):
        up, down = (fit.response(theta + s * h * np.eye(len(theta))[i])[0] for s in (1, -1))
        assert np.linalg.norm(J[:, i] - (up - down) / (2 * h)) < 0.03 * np.linalg.norm(J[:, i])
    real = dataclasses.replace(test.real, factor={p: 1.06 * f for p, f in test.real.factor.items()})
    stiffer = dataclasses.replace(test, real=real, plain=truth.build(test.s, real))
    e = respond.record(stiffer, (), "high")[0] - base
    seen = np.linalg.norm(e) / np.linalg.norm(base)
    assert fit.left(e) < 0.2 * seen
    other = rng.standard_normal(base.shape) * base.std()
    assert fit.left(other) > 0.9 * np.linalg.norm(other) / np.linalg.norm(base)
