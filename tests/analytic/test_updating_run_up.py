"""Bearings of a rotor updated on a run-up that was stepped in time, its unbalance unknown."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from femend.data import ODS, OrderTrack, Speed, TimeData
from femend.estimate.updating import (
    Configuration,
    OrderDifferences,
    Problem,
    Unknown,
    Unknowns,
    UpdateResult,
    factor,
    modal_system,
    update,
)
from femend.signal import run_up_shapes, vold_kalman

sys.path.insert(0, str(Path(__file__).parents[1]))
from operating_models import RIGID, rigid_rotor, run_up

TRUTH = {"ky": 0.85, "kz": 1.2, "beta": 2e-4}
UNBALANCE = np.array([3e-3 * np.exp(0.4j), 1.5e-3 * np.exp(2.2j)])


def updated(run: OrderTrack | ODS, **said: object) -> tuple[UpdateResult, OrderDifferences]:
    response, frfs = OrderDifferences.of(run, RIGID, (1, 2), 0, **said)  # type: ignore[arg-type]
    system = modal_system(rigid_rotor(), list(range(4)), 0, frfs=frfs)
    unknowns = Unknowns.of([factor("ky", 0.3), factor("kz", 0.3), Unknown("beta", 1e-4, sd=1.0)])
    return update(Problem(unknowns, (Configuration("run", system, (response,)),))), response


@pytest.fixture(scope="module")
def recorded() -> tuple[TimeData, Speed]:
    """Accelerations up to 1000 m/s^2 with noise of 0.05 m/s^2 (1-sigma)."""
    return run_up(*TRUTH.values(), UNBALANCE, noise=0.05)


@pytest.fixture(scope="module")
def steady(recorded: tuple[TimeData, Speed]) -> ODS:
    return run_up_shapes(*recorded)


@pytest.mark.parametrize("sense", [0, 1])
def test_stiffness_damping_and_unbalance_of_a_run(steady: ODS, sense: int) -> None:
    result, response = updated(steady, sd=0.05, floor=0.02, sense=sense)
    assert result.status == "converged"
    # what the deconvolution leaves of a run's ends, not noise, is what the values are off by
    for name, share in (("ky", 5e-4), ("kz", 5e-4), ("beta", 5e-3)):
        assert result.values[name] == pytest.approx(TRUTH[name], rel=share), name
    found, _ = response.found(result.after.states[0])
    wanted = UNBALANCE if sense else np.array([u * f for u in UNBALANCE for f in (1, -1j)])
    np.testing.assert_allclose(found, wanted, atol=0.01 * np.abs(UNBALANCE).max())


def test_an_order_track_shows_a_quick_runs_resonances_late(recorded: tuple[TimeData, Speed], steady: ODS) -> None:
    """Why the steady shapes are taken: 0.45 Hz/s is quick for modes of 1 % damping."""
    track, _ = updated(vold_kalman(*recorded, [1.0]), floor=0.02, step=0.5)
    off = {name: abs(track.values[name] / TRUTH[name] - 1) for name in ("ky", "kz")}
    assert 0.003 < max(off.values()) < 0.03
    deconvolved, _ = updated(steady, sd=0.05, floor=0.02)
    assert max(abs(deconvolved.values[n] / TRUTH[n] - 1) for n in off) < 0.1 * max(off.values())


def test_a_slow_run_needs_less_of_it(recorded: tuple[TimeData, Speed]) -> None:
    """The order track of a run fifteen times as slow lags behind the steady state that much less."""
    off = []
    for data, speed in (recorded, run_up(*TRUTH.values(), UNBALANCE, seconds=900.0, noise=0.05)):
        result, _ = updated(vold_kalman(data, speed, [1.0]), floor=0.02, step=0.1, sense=1)
        off.append(max(abs(result.values[n] / TRUTH[n] - 1) for n in ("ky", "kz")))
    quick, slow = off
    assert slow < 2.5e-3 < 4 * slow < quick


def test_an_unbalance_that_is_wrong_or_turns_the_other_way(steady: ODS) -> None:
    """A third more at one bearing and the wrong sense are left over; the free one is found."""
    free, _ = updated(steady, sd=0.05, floor=0.02, sense=1)
    right, _ = updated(steady, sd=0.05, floor=0.02, sense=1, unbalance={1: UNBALANCE[0], 2: UNBALANCE[1]})
    wrong, _ = updated(steady, sd=0.05, floor=0.02, sense=1, unbalance={1: 1.33 * UNBALANCE[0], 2: UNBALANCE[1]})
    against, _ = updated(steady, sd=0.05, floor=0.02, sense=-1)
    assert right.values["beta"] == pytest.approx(TRUTH["beta"], rel=0.01)
    assert abs(wrong.values["beta"] / TRUTH["beta"] - 1) > 0.1
    assert wrong.after.squares > 5 * right.after.squares
    assert against.after.squares > 20 * free.after.squares
