"""Branches of periodic motions: closed forms, sweeps over their jumps, laws side by side, misuse."""

from __future__ import annotations

import numpy as np
import pytest

from femend.analysis.nonlinear_frf import NonlinearBranch, branches_of_modes, nonlinear_frf
from femend.data.mode_set import ModeSet
from femend.dof import Dof
from femend.errors import ConvergenceError, LawParameterError

TIP, ROOT = Dof(2, 3), Dof(1, 3)
MODES = ModeSet([10.0, 62.0], [0.01, 0.01], [[0.3, 0.8], [1.0, -0.9]], (ROOT, TIP))
CUBIC = ("cubic_stiffness", {"k3": 4e5})


def branch(*laws: tuple[str, dict[str, float]], level: float = 15.0, **settings: object) -> NonlinearBranch:
    (found,) = nonlinear_frf(
        MODES, {TIP: 1.0}, laws, {ROOT: 1.0}, [level], (5.0, 20.0), outputs=[TIP, ROOT], **settings
    )
    return found


def test_output_at_the_place_is_its_motion() -> None:
    found = branch(CUBIC)
    assert found.y.shape == (len(found.freq), 2, 8)
    # all modes are there, so the coordinate has no other compliance
    assert found.y[:, 0] == pytest.approx(found.d, rel=1e-7, abs=1e-9 * found.amplitude.max())
    assert abs(found.y[:, 1, 1]).max() < found.amplitude.max()


def test_sweeps_part_between_the_jumps_and_meet_outside() -> None:
    found = branch(CUBIC)
    up, down = found.jump("up"), found.jump("down")
    assert up is not None
    assert down is not None
    assert found.ended == "upper"
    f = np.array([down.freq - 0.5, 0.5 * (down.freq + up.freq), up.freq + 0.5, 25.0])
    rising, falling = (abs(found.sweep(f, way)[:, 1]) for way in ("up", "down"))
    assert rising[[0, 2]] == pytest.approx(falling[[0, 2]])
    assert rising[1] > 3 * falling[1]
    assert np.isnan(rising[3])
    assert rising[1] < up.amplitude
    assert f"up {up.freq:.5g} Hz" in repr(found)


def test_the_first_jump_is_the_same_where_the_branch_ends_there() -> None:
    short, whole = branch(CUBIC, max_jumps=1), branch(CUBIC)
    assert short.ended == "max_folds"
    assert short.jumps == whole.jumps[:1]
    assert short.jump("down") is None


def test_friction_and_structural_damping_hold_what_the_describing_function_says() -> None:
    # one mode in resonance: the force equals what the laws lose of it, 4 f / pi of dry friction and k eta A
    omega, force, slip, lost = 50.0, 6.0, 1.5, 40.0
    laws = [("coulomb_friction", {"f": slip, "kt": 1e6}), ("structural_damping", {"k": 1e-3, "eta": lost / 1e-3})]
    ((found,),) = branches_of_modes(
        [omega], [0.0], [[1.0]], [[1.0]], [1.0], [laws], [force], [1.0], (7.0, 9.0), samples=512, max_step=0.02
    )
    assert found.amplitude.max() == pytest.approx((force - 4 * slip / np.pi) / lost, rel=5e-3)


def test_sets_and_levels_come_in_their_order() -> None:
    sets = [[("cubic_stiffness", {"k3": k3})] for k3 in (0.8, 0.2)]
    found = branches_of_modes([1], [0.01], [[1]], np.zeros((0, 1)), [1], sets, [1], [0.05, 0.1], (0.1, 0.5))
    jumps = [[b.jump("up").freq for b in of_set] for of_set in found]
    # the motion of half the force and four times the cubic stiffness is half as large, at the same frequencies
    assert jumps[0][0] == pytest.approx(jumps[1][1], rel=1e-9)
    assert jumps[0][1] > jumps[0][0] > jumps[1][0]
    assert found[0][1].level == 0.1


def test_misuse_is_refused() -> None:
    with pytest.raises(LawParameterError, match="k3"):
        branch(("cubic_stiffness", {}))
    with pytest.raises(ValueError, match="level"):
        branch(CUBIC, level=-1.0)
    with pytest.raises(ValueError, match="twice the harmonics"):
        branch(CUBIC, samples=8)
    with pytest.raises(ValueError, match="mass-normalised"):
        nonlinear_frf(ModeSet([1.0], [0.1], [[1.0]], (TIP,), "max"), {TIP: 1.0}, [CUBIC], {TIP: 1.0}, [1.0], (0.5, 2.0))
    with pytest.raises(ValueError, match="no DOF"):
        nonlinear_frf(MODES, {Dof(9, 3): 1.0}, [CUBIC], {TIP: 1.0}, [1.0], (5.0, 20.0))
    # an even force that throws the motion out on one side: no motion to begin with
    with pytest.raises(ConvergenceError, match="where the branch starts"):
        branch(("quadratic_stiffness", {"k2": 1e8}), level=1e6)
