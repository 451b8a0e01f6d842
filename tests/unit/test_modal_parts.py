"""The parts of a modal test one by one: poles over orders, residues, indicators, sensor checks, and what is refused."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from femend.data import FRF, Channel, Geometry
from femend.dof import Dof
from femend.errors import RecordingError
from femend.modal import (
    cmif,
    driving_point_checks,
    identify_modes,
    mif,
    plscf_poles,
    reciprocity_checks,
    refine_modes,
    rigid_body_check,
    stabilise,
    swap_check,
)
from femend.modal.advice import _split_modes
from femend.modal.checks import SensorCheck, rigid_body_rows
from femend.modal.fraction import lag_sums
from femend.modal.lsfd import columns, stacked
from femend.modal.plscf import PoleTable
from femend.modal.refine import _State
from femend.modal.scaling import DrivingPoint

sys.path.insert(0, str(Path(__file__).parents[1]))
from modal_models import known_frf, shapes

LINES = np.linspace(0.05, 20.0, 400)
FREQ, ZETA = [4.0, 7.0, 11.0], [0.01, 0.02, 0.005]
FULL = known_frf(LINES, FREQ, ZETA, shapes(5, 3), range(5), noise=0.005)


# ------------------------------------------------------------------------------------------------ poles over orders


@pytest.mark.parametrize("offset", [0, 1, 37])
def test_sums_by_fft_are_sums(offset: int) -> None:
    x = np.random.default_rng(0).standard_normal((101, 2)) + 0j
    theta = np.pi * (offset + np.arange(101)) / (offset + 100)
    direct = np.tensordot(np.exp(1j * np.outer(np.arange(-9, 10), theta)), x, axes=(1, 0))
    assert lag_sums(theta, x, 9) == pytest.approx(direct, abs=1e-9)
    uneven = np.sort(np.r_[theta[:-1], 0.37])
    direct = np.tensordot(np.exp(1j * np.outer(np.arange(-9, 10), uneven)), x, axes=(1, 0))
    assert lag_sums(uneven, x, 9) == pytest.approx(direct, abs=1e-9)


def test_poles_settle_on_the_true_ones_and_the_rest_is_unstable() -> None:
    frf = known_frf(LINES, FREQ, ZETA, shapes(8, 3), [0, 1], noise=1e-4)
    table = plscf_poles(frf.freq, frf.H, 30)
    top = table.order == 30
    for f, z in zip(FREQ, ZETA):
        near = np.argmin(np.abs(table.freq[top] - f))
        assert table.freq[top][near] == pytest.approx(f, rel=1e-4)
        assert table.zeta[top][near] == pytest.approx(z, rel=0.01)
    assert top.sum() <= 6  # of 30 that order 30 and two references have, the others have positive real parts


def test_uneven_lines_give_the_same_poles() -> None:
    uneven = np.sort(np.random.default_rng(1).uniform(0.05, 20, 400))
    frf = known_frf(uneven, FREQ, ZETA, shapes(8, 3), [0])
    test = identify_modes(frf)
    assert test.modes.freq == pytest.approx(FREQ, rel=1e-6)


def test_the_order_needs_lines() -> None:
    frf = known_frf(LINES[:20], FREQ, ZETA, shapes(4, 3), [0])
    with pytest.raises(RecordingError, match="order 30 needs at least 62 frequency lines, the band has 20"):
        plscf_poles(frf.freq, frf.H, 30)


def test_clusters_follow_poles_and_say_why_not() -> None:
    orders = np.arange(2, 22)
    stable = 2 * np.pi * 5 * (-0.01 + 1j) * np.ones(20)
    passing = 2 * np.pi * 8 * (-0.01 + 1j) * np.ones(3)
    damped = 2 * np.pi * 12 * (-0.4 + 1j) * np.ones(20)
    table = PoleTable(
        np.r_[orders, orders[:3], orders], np.r_[stable, passing, damped], np.ones((43, 1), dtype=np.complex128)
    )
    diagram = stabilise(table)
    five, eight, twelve = diagram.clusters
    assert (five.chosen, eight.chosen, twelve.chosen) == (True, False, False)
    assert five.presence == 1.0
    assert "in 3 of 20 orders" in eight.reason
    assert "damping" in twelve.reason
    assert diagram.level[table.order == 2].max() == 0  # nothing below to compare with
    assert diagram.level[0:20][1:].min() == 3
    assert diagram.to_dict()["level"][1] == "stable"


# ---------------------------------------------------------------------------------------------- fit and derivatives


@pytest.mark.parametrize("n_ref", [1, 2])
def test_gradient_of_the_fit_is_its_finite_difference(n_ref: int) -> None:
    frf = known_frf(LINES[::4], FREQ, ZETA, shapes(4, 3), range(n_ref), noise=0.01)
    poles = 2 * np.pi * np.array(FREQ) * (-np.array(ZETA) * 1.2 + 1.002j)
    participation = np.ones((3, n_ref)) + 0.1j * np.arange(n_ref)
    weight = np.array([1.0, 2.0, 0.5, 1.0])
    state = _State(frf.freq, 2, "both", stacked(frf.H), poles, participation)
    _, gradient = state.normal_equations(weight)
    for k in range(gradient.size):
        step = np.zeros(gradient.size)
        step[k] = 1e-5
        slope = (state.moved(step).cost(weight) - state.moved(-step).cost(weight)) / 2e-5
        # Kaufman's derivative is exact in the gradient of the projected cost; differences are good to h^2
        assert -2 * gradient[k] == pytest.approx(slope, rel=1e-4, abs=1e-6 * np.abs(gradient).max())


def test_columns_are_those_of_the_modal_model() -> None:
    poles, participation = np.array([-0.3 + 30j]), np.array([[1.0 + 0.5j, 0.2]])
    Phi = columns(LINES, 1, poles, participation, "upper")
    psi, upper = 2.0 - 1j, np.array([0.3, 0.4])
    s = 2j * np.pi * LINES[:, None]
    direct = s * (psi * participation / (s - poles) + np.conj(psi * participation) / (s - poles.conj()) + upper)
    x = np.r_[psi.real, psi.imag, upper]
    assert Phi @ x == pytest.approx(np.r_[direct.real.ravel(), direct.imag.ravel()])


def test_a_fit_stays_within_reach() -> None:
    frf = known_frf(LINES, FREQ, ZETA, shapes(4, 3), [0])
    start = 2 * np.pi * np.array(FREQ) * (-np.array(ZETA) + 1.01j)
    fitted = refine_modes(frf.freq, frf.H, 2, start, np.ones((3, 1)) + 0j, reach=np.full(3, 0.1))
    assert np.abs(fitted.fit.poles - start).max() <= 0.1 * (1 + 1e-9)


# ------------------------------------------------------------------------------------------------------- indicators


def test_indicators_mark_the_modes() -> None:
    for kind in ("receptance", "mobility", "accelerance"):
        frf = known_frf(LINES, FREQ, ZETA, shapes(8, 3), [0, 1], kind=kind)
        dips, peaks = mif(frf)[:, 0], cmif(frf)[:, 0]
        for f in FREQ:
            around = np.abs(LINES - f) < 0.3
            assert LINES[around][np.argmin(dips[around])] == pytest.approx(f, abs=0.051)  # a line apart
            assert dips[around].min() < 0.1
            assert LINES[around][np.argmax(peaks[around])] == pytest.approx(f, abs=0.051)
        assert np.median(dips) > 0.8
        assert dips.min() >= 0.0


def test_second_indicator_shows_a_close_pair() -> None:
    frf = known_frf(LINES, [8.0, 8.02], [0.01, 0.01], shapes(8, 2, seed=4), [0, 1])
    at = np.argmin(np.abs(LINES - 8.0))
    assert mif(frf)[at].max() < 0.2
    single = known_frf(LINES, [8.0, 15.0], [0.01, 0.01], shapes(8, 2, seed=4), [0, 1])
    assert mif(single)[at, 1] > 0.8


# ---------------------------------------------------------------------------------------------------- sensor checks


def with_H(change: dict[int, int], sign: dict[int, float]) -> FRF:
    """FULL with outputs exchanged and reversed."""
    order = [change.get(i, i) for i in range(5)]
    factor = np.array([sign.get(i, 1.0) for i in range(5)])
    return replace(FULL, H=FULL.H[:, order] * factor[:, None])


def test_a_sound_test_passes() -> None:
    assert {c.verdict for c in reciprocity_checks(FULL) + driving_point_checks(FULL)} == {"ok"}
    assert len(reciprocity_checks(FULL)) == 10
    assert swap_check(FULL) is None


def test_two_frfs_of_noise_alone_are_not_compared() -> None:
    rng = np.random.default_rng(1)
    H = FULL.H.copy()
    noise = 0.01 * np.abs(H).max() * (rng.standard_normal(H.shape) + 1j * rng.standard_normal(H.shape))
    H[:, 0, 1:], H[:, 1:, 0] = noise[:, 0, 1:], noise[:, 1:, 0]
    checks = reciprocity_checks(replace(FULL, H=H))
    assert {c.subject for c in checks if c.verdict == "not decided"} == {f"1:+Z / {n}:+Z" for n in (2, 3, 4, 5)}
    assert {c.verdict for c in checks} == {"ok", "not decided"}
    # where one of the two has a signal it is told
    H[:, 0, 1] = FULL.H[:, 0, 1]
    told = [c for c in reciprocity_checks(replace(FULL, H=H)) if c.message]
    assert [c.subject for c in told] == ["1:+Z / 2:+Z"]


def test_what_sensors_pick_up_across_is_not_compared() -> None:
    H = FULL.H.copy()
    H[:, 0, 1], H[:, 1, 0] = 0.02 * FULL.H[:, 0, 0], -0.01 * FULL.H[:, 1, 1]
    (check,) = [c for c in reciprocity_checks(replace(FULL, H=H)) if c.subject == "1:+Z / 2:+Z"]
    assert check.verdict == "not decided"


def test_a_reversed_sensor_is_named_by_all_its_pairs() -> None:
    frf = with_H({}, {2: -1.0})
    bad = [c for c in reciprocity_checks(frf) if c.verdict != "ok"]
    assert {c.verdict for c in bad} == {"reversed"}
    assert len(bad) == 4
    assert all("3:+Z" in c.subject and "3:+Z" in c.message for c in bad)
    assert [c.subject for c in driving_point_checks(frf) if c.verdict == "reversed"] == ["3:+Z"]
    assert identify_modes(frf).status == "doubtful"


def test_a_sensor_without_coordinates_leaves_the_modes_of_the_others_to_be_found() -> None:
    frf = known_frf(LINES, FREQ, ZETA, shapes(10, 3), [0], noise=0.005)
    nodes = [d.node for d in frf.output_dofs if d is not None][:-1]
    geometry = Geometry(np.array(nodes), np.random.default_rng(0).standard_normal((9, 3)))
    assert identify_modes(frf, geometry=geometry).modes.n_modes == 3


def test_a_sensor_that_says_it_points_down_is_no_fault() -> None:
    frf = with_H({}, {2: -1.0})
    outputs = tuple(Channel(Dof(3, 3, -1), c.quantity, c.unit) if i == 2 else c for i, c in enumerate(frf.outputs))
    frf = replace(frf, outputs=outputs)
    assert {c.verdict for c in reciprocity_checks(frf) + driving_point_checks(frf)} == {"ok"}


def test_exchanged_sensors_are_named() -> None:
    check = swap_check(with_H({1: 3, 3: 1}, {}))
    assert check is not None
    assert check.verdict == "swapped"
    assert check.subject == "2:+Z and 4:+Z"


def test_a_test_that_no_exchange_mends_is_not_called_swapped() -> None:
    rng = np.random.default_rng(0)
    frf = replace(FULL, H=FULL.H * rng.choice([-1.0, 1.0], FULL.H.shape[1:]))
    assert swap_check(frf) is None


def rigid(n: int = 12) -> tuple[NDArray, tuple[Dof, ...], Geometry]:
    rng = np.random.default_rng(2)
    geometry = Geometry(np.arange(1, n // 3 + 1), rng.uniform(-1, 1, (n // 3, 3)))
    dofs = tuple(Dof(node, c) for node in range(1, n // 3 + 1) for c in (1, 2, 3))
    return rigid_body_rows(dofs, geometry) @ rng.standard_normal((6, 5)) + 0j, dofs, geometry


def test_rigid_motion_names_the_sensor() -> None:
    motion, dofs, geometry = rigid()
    assert rigid_body_check(motion, dofs, geometry).verdict == "ok"
    turned = motion.copy()
    turned[4] *= -1
    check = rigid_body_check(turned, dofs, geometry)
    assert (check.verdict, check.subject) == ("reversed", str(dofs[4]))
    swapped = motion.copy()
    swapped[[1, 9]] = motion[[9, 1]]
    check = rigid_body_check(swapped, dofs, geometry)
    assert (check.verdict, check.subject) == ("swapped", f"{dofs[1]} and {dofs[9]}")


def test_an_elastic_part_is_not_accused() -> None:
    _, dofs, geometry = rigid()
    elastic = np.random.default_rng(3).standard_normal((12, 5)) + 0j
    assert rigid_body_check(elastic, dofs, geometry).verdict == "not decided"
    with pytest.raises(RecordingError, match="node 99 has no coordinates"):
        rigid_body_check(elastic, (*dofs[:-1], Dof(99, 1)), geometry)


# ------------------------------------------------------------------------------------------------------ what is refused


def test_bad_input_is_named() -> None:
    with pytest.raises(RecordingError, match="0 lines lie in the band 30 to 40 Hz"):
        identify_modes(FULL, (30.0, 40.0))
    with pytest.raises(RecordingError, match="residuals 'some' is none of both, upper, lower, none"):
        identify_modes(FULL, residuals="some")
    nameless = replace(FULL, outputs=(Channel(None, "acceleration", "m/s^2", "left"), *FULL.outputs[1:]))
    with pytest.raises(RecordingError, match=r"acceleration \(left\) has no DOF"):
        identify_modes(nameless)
    twice = replace(FULL, outputs=(FULL.outputs[1], *FULL.outputs[1:]))
    said = r"DOF 2:\+Z stands twice among the 5 outputs, as channel 1, \w+ 2:\+Z, and channel 2, \w+ 2:\+Z: correct"
    with pytest.raises(RecordingError, match=said):
        identify_modes(twice)


def test_a_channel_of_another_test_is_named_by_its_own_modes() -> None:
    frf = known_frf(LINES, FREQ, ZETA, shapes(8, 3), [0], noise=0.005)
    H = frf.H.copy()
    H[:, 3] = np.roll(H[:, 3], 57, axis=0)  # its resonances are elsewhere
    test = identify_modes(replace(frf, H=H))
    foreign = [f for f in test.modes.freq if np.abs(np.array(FREQ) - f).min() > 0.1]
    assert len(foreign) == 3
    (told,) = [line for line in test.advice if "one channel alone moves" in line]
    assert told.count("(4:+Z)") == 3


def test_a_channel_that_the_modes_do_not_explain_is_named() -> None:
    frf = known_frf(LINES, FREQ, ZETA, shapes(8, 3), [0], noise=0.005)
    H = frf.H.copy()
    H[:, 3, 0] *= np.exp(2j * np.pi * np.random.default_rng(0).random(400))
    test = identify_modes(replace(frf, H=H))
    assert test.modes.freq == pytest.approx(FREQ, rel=1e-3)
    assert test.status == "doubtful"
    assert [line for line in test.advice if "FRF 4:+Z / 1:+Z" in line]
    assert not [line for line in test.advice if "FRF 5:+Z / 1:+Z" in line]


def test_a_dead_channel_and_poor_coherence_are_named() -> None:
    frf = known_frf(LINES, FREQ, ZETA, shapes(8, 3), [0], noise=0.005)
    H = frf.H.copy()
    H[:, 4] = 0.0
    coherence = np.where(np.abs(LINES - 7.0) < 0.5, 0.4, 0.99)[:, None, None] * np.ones((1, 8, 1))
    test = identify_modes(replace(frf, H=H, coherence=coherence))
    assert test.status == "doubtful"
    assert [line for line in test.advice if "5:+Z / 1:+Z is 0 on all lines" in line]
    assert [line[:6] for line in test.advice if "coherence around it is 0.40" in line] == ["mode 2"]
    low = identify_modes(replace(frf, coherence=np.full(frf.H.shape, 0.5)))
    (told,) = [line for line in low.advice if "coherence" in line]
    assert told.startswith("modes 1 at ")
    assert told.endswith(" Hz (0.50): the coherence around them is low; average more, or look for nonlinearity")


def test_zero_hertz_is_left_out() -> None:
    f = np.arange(400) * 0.05
    test = identify_modes(known_frf(f, FREQ, ZETA, shapes(4, 3), [0]))
    assert test.measured.freq[0] == 0.05
    assert test.modes.freq == pytest.approx(FREQ, rel=1e-8)


def test_two_poles_of_different_shapes_are_no_split_mode() -> None:
    """Sways of a frame along its two axes, a bandwidth apart, were told as one mode of a structure that changed."""
    poles = 2j * np.pi * np.array([35.97, 36.61]) - 2.0

    def told(shapes: list[list[complex]]) -> list[str]:
        modes = SimpleNamespace(poles=poles, freq=np.abs(poles) / (2 * np.pi), n_modes=2, participation=None)
        modes.shapes = np.array(shapes).T
        modes.dofs = (Dof(1, 1), Dof(2, 1), Dof(1, 2), Dof(2, 2))
        test: Any = SimpleNamespace(modes=modes, mpc=np.array([0.7, 1.0]), driving_points=(), mass_sd_share=0.0)
        return _split_modes(test)

    assert told([[1.0, 0.5 + 0.4j, 0.0, 0.0], [0.0, 0.0, 1.0, 0.6]]) == []
    (said,) = told([[1.0, 0.5 + 0.4j, 0.0, 0.1], [1.0, 0.6, 0.1, 0.0]])
    assert said.startswith("modes 1 and 2 at 35.9")
    assert "probably one mode" in said


def test_a_driving_point_that_hardly_moves_makes_no_split_mode() -> None:
    """Mounts of unlike damping turn the phase where a mode has next to no motion: 104 degrees at 4 % of the residue."""
    poles = 2j * np.pi * np.array([52.69, 53.59]) - 3.4

    def told(weak: complex, *checks: SensorCheck) -> list[str]:
        phi = np.array([[0.2, 0.34], [weak, 0.24]])
        modes = SimpleNamespace(poles=poles, freq=np.abs(poles) / (2 * np.pi), n_modes=2, shapes=phi)
        modes.participation = (phi / (2j * poles.imag)).T
        modes.dofs = (Dof(1, 1), Dof(2, 1))
        points = tuple(DrivingPoint(d, i, i, 1) for i, d in enumerate(modes.dofs))
        test: Any = SimpleNamespace(modes=modes, mpc=np.ones(2), driving_points=points, mass_sd_share=np.zeros(2))
        test.checks = checks
        return _split_modes(test)

    assert told(0.04 * np.exp(0.5j * np.radians(104))) == []
    (said,) = told(0.2 * np.exp(0.5j * np.radians(104)))
    assert "driving-point residue 52 degrees off" in said
    # a sensor that is told to be upside down is the reason itself
    reversed_ = SensorCheck("driving point", "2:+X", "reversed", -1.0, "upside down")
    assert told(0.2 * np.exp(0.5j * np.radians(104)), reversed_) == []


def test_frfs_of_the_other_sign_of_time_are_told_as_such() -> None:
    """Poles of conjugate FRFs grow; it was said that sensor or blow is upside down, and to try another band."""
    frf = known_frf(LINES, FREQ, ZETA, shapes(6, 3), [0], noise=0.005)
    test = identify_modes(replace(frf, H=frf.H.conj()))
    assert test.status == "no modes"
    (said,) = test.advice
    assert "and 3 in their complex conjugates: they follow exp(-i omega t)" in said
    assert "upside down" not in said
