"""Where more than noise is left it is told how much, beside silence and beside laws."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from femend.data import Channel
from femend.estimate import FitRecord
from femend.model.known_mesh import Unresolved
from femend.study.result.left_over import left_beside, left_beside_sine, left_over, shares_outside
from femend.study.result.predictions import Prediction


def row(name: str, floor: float | None, left: float | None, role: str = "fit") -> dict[str, Any]:
    return {"recording": name, "role": role, "noise_floor": floor, "parameters": left}


@pytest.mark.parametrize("verdict", ["consistent", "parameters-only"])
def test_the_worst_recording_is_told(verdict: str) -> None:
    rows = [row("low", 0.02, 0.022), row("high", 0.02, 0.05), row("held", 0.01, 0.3, "validate")]
    said = left_over(verdict, rows)
    assert "2.5 times the noise of high" in said
    assert "refine the mesh" in said


def test_nothing_is_said_of_noise_or_beside_findings() -> None:
    near = [row("low", 0.02, 0.022), row("high", 0.02, 0.029)]
    assert left_over("parameters-only", near) == ""
    assert left_over("missing-physics", [row("high", 0.02, 0.5)]) == ""
    assert left_over("consistent", [row("high", None, 0.5), row("low", 0.02, None)]) == ""


def test_laws_that_leave_much_of_a_recording_are_told_with_that() -> None:
    rows = [
        {"recording": name, "role": role, "noise_floor": 0.02, "parameters": 0.5, "final": left}
        for name, role, left in (("low", "fit", 0.03), ("high", "fit", 0.16), ("held", "validate", 0.4))
    ]
    said = left_beside("missing-physics", rows)
    assert "still leaves 16 % of high, 8 times its noise" in said
    assert left_beside("missing-physics", rows[:1]) == ""
    assert left_beside("located-not-named", rows) == ""


def test_frfs_hold_no_motion_that_depends_on_its_past() -> None:
    freq = np.linspace(10.0, 100.0, 50)
    H = np.ones((50, 1, 1), dtype=complex)
    channel: Any = Channel(None, "acceleration", "m/s^2", "a")
    frf: Any = SimpleNamespace(freq=freq)
    rows = [{"recording": "frf_b", "role": "fit", "noise_floor": 0.004, "parameters": 0.8, "final": 0.06}]
    seen = Prediction("frf_b", "fit", 0.0, (channel,), {"final": 0.94 * H}, H, frf, (10.0, 100.0))
    said = left_beside("missing-physics", rows, [seen], (10.0, 100.0))
    assert "still leaves 6 % of frf_b, 15 times its noise: something else that was not found shows there" in said
    assert "past" not in said
    assert "refine the mesh and see whether it shrinks" in said
    assert "depends on its past" in left_beside("missing-physics", rows)


def test_a_sine_along_one_axis_that_leaves_much_is_no_place_to_look() -> None:
    """An unbalance that turned was told as a force of 3.8 times its size at another node, and nothing beside it."""
    sine: dict[str, Any] = {
        "physics": "unmeasured_force",
        "location": {"nodes": [22], "direction": "Z"},
        "parameters": {"frequency": {"value": 17.31}, "amplitude": {"value": 22.9}},
    }
    rows = [{"recording": "low", "role": "fit", "noise_floor": 0.02, "parameters": 0.58, "final": 0.22}]
    said = left_beside_sine(sine, rows)
    assert "at node 22 along Z leaves 22 % of low, 11 times its noise" in said
    assert "not where to look" in said
    assert left_beside_sine(sine, [{**rows[0], "final": 0.05}]) == ""
    # where any force there explains the recordings, it does act there, if not all the time alike
    there: Any = SimpleNamespace(place=SimpleNamespace(nodes=(22,), direction="Z"), fit=SimpleNamespace(score=1.0))
    changing = left_beside_sine(sine, rows, [there], 1.2)
    assert "a force of any course explains the recordings to the noise" in changing
    assert "leaves 22 % of low, 11 times its noise: its amplitude or frequency changes" in changing
    assert left_beside_sine(sine, rows, [there], 0.9) == said
    assert left_beside_sine({**sine, "parameters": {"frequency": {"value": None}}}, rows) == ""
    assert left_beside_sine({**sine, "physics": "load_misplaced", "parameters": {}}, rows) == ""


def test_what_lies_below_the_band_is_drift() -> None:
    t = np.arange(1000) * 1e-3
    quick = np.sin(2 * np.pi * 20 * t)
    channel = Channel(None, "acceleration", "m/s^2", "a")
    made = {"nominal": np.array([quick]), "parameters": np.array([quick]), "final": np.array([quick])}
    seen = Prediction("high", "fit", 1e-3, (channel,), made, np.array([quick + 0.3 * np.sin(2 * np.pi * 2 * t)]))
    assert shares_outside(seen, (5.0, 100.0)) == pytest.approx((1.0, 0.0))
    said = left_over("parameters-only", [row("high", 0.1, 0.3)], [seen], (5.0, 100.0))
    assert "100 % of its square lies below 5 Hz" in said
    assert "drift" in said
    assert "mesh" not in said


def test_what_lies_above_the_band_asks_for_no_mesh() -> None:
    t = np.arange(1000) * 1e-3
    slow, quick = np.sin(2 * np.pi * 20 * t), np.sin(2 * np.pi * 300 * t)
    channel = Channel(None, "acceleration", "m/s^2", "a")
    made = {"nominal": np.array([slow]), "parameters": np.array([slow * 0.9]), "final": np.array([slow])}
    seen = Prediction("high", "fit", 1e-3, (channel,), made, np.array([slow + 0.3 * quick]))
    assert shares_outside(seen, (5.0, 100.0)) == pytest.approx((0.0, 0.9))
    rows = [row("high", 0.1, 0.3)]
    said = left_over("parameters-only", rows, [seen], (5.0, 100.0))
    assert "90 % of its square lies above 100 Hz" in said
    assert "mesh" not in said
    less = Prediction("high", "fit", 1e-3, (channel,), made, np.array([slow + 0.0655 * quick]))
    assert shares_outside(less, (5.0, 100.0)) == pytest.approx((0.0, 0.3), abs=0.01)
    assert "refine the mesh" in left_over("parameters-only", rows, [less], (5.0, 100.0))


def test_laws_that_leave_what_lies_outside_the_band_hide_nothing() -> None:
    """A resonance above the force's band was told as something that had not been found."""
    t = np.arange(1000) * 1e-3
    slow, quick = np.sin(2 * np.pi * 20 * t), np.sin(2 * np.pi * 300 * t)
    channel = Channel(None, "acceleration", "m/s^2", "a")
    made = {"nominal": np.array([slow]), "parameters": np.array([0.8 * slow]), "final": np.array([slow])}
    rows = [{"recording": "high", "role": "fit", "noise_floor": 0.05, "parameters": 0.36, "final": 0.3}]
    seen = Prediction("high", "fit", 1e-3, (channel,), made, np.array([slow + 0.3 * quick]))
    said = left_beside("missing-physics", rows, [seen], (5.0, 100.0))
    assert "30 % of high, 6 times its noise; 100 % of its square lies outside 5 to 100 Hz" in said
    assert "not found" not in said
    assert "a force that reaches further" in said
    assert "something else that was not found" in left_beside("missing-physics", rows, [seen], (5.0, 400.0))
    # near half the sampling rate no force helps
    seen = Prediction("high", "fit", 1e-3, (channel,), made, np.array([slow + 0.3 * np.sin(2 * np.pi * 480 * t)]))
    said = left_beside("missing-physics", rows, [seen], (5.0, 450.0))
    assert "outside 5 to 450 Hz, where there are too few samples to a cycle" in said
    assert "sample at more than 1000 Hz" in said


@pytest.mark.parametrize(("pid", "error"), [(2, 0.013), (0, -0.02)])
def test_a_band_that_ends_where_the_mesh_does_asks_for_no_other_force(pid: int, error: float) -> None:
    """The force reached 70 Hz, the mesh 54.3 Hz, and it was said to excite too little above that."""
    t = np.arange(1000) * 1e-3
    slow, quick = np.sin(2 * np.pi * 20 * t), np.sin(2 * np.pi * 300 * t)
    channel = Channel(None, "acceleration", "m/s^2", "a")
    made = {"parameters": slow[None], "final": slow[None]}
    seen = Prediction("high", "fit", 1e-3, (channel,), made, (slow + 0.3 * quick)[None])
    rows = [{"recording": "high", "role": "fit", "noise_floor": 0.05, "parameters": 0.3, "final": 0.3}]
    missed = Unresolved(105.0, error, 1.5, pid, 100.0)
    what = f"refine property {pid}" if pid else "refine the mesh, or let its masses be consistent (PARAM,COUPMASS,1)"
    for verdict, tell in (("parameters-only", left_over), ("missing-physics", left_beside)):
        said = tell(verdict, rows, [seen], (5.0, 100.0), (), missed)
        assert "where the deck's mesh is too coarse for models to be compared" in said
        assert said.endswith(what)
        assert "force" not in said
        # where the band ends before the mesh does, it is the force
        assert "the force excites too little" in tell(verdict, rows, [seen], (5.0, 90.0), (), missed)
        # what stands below the band is none of the mesh's
        drift = Prediction("high", "fit", 1e-3, (channel,), made, (slow + 0.3 * np.sin(2 * np.pi * 2 * t))[None])
        assert "mesh" not in tell(verdict, rows, [drift], (5.0, 100.0), (), missed)


@pytest.mark.parametrize("driven", [True, False])
def test_near_half_the_sampling_rate_it_is_the_force_only_where_nothing_follows_it(driven: bool) -> None:
    """Of a blow that still excites there, what the anti-alias filter changed was told as too little force."""
    rng = np.random.default_rng(3)
    t = np.arange(4096) / 1024.0
    blow = np.where(t < 3e-3, np.sin(np.pi * t / 3e-3), 0.0)
    U = np.fft.rfft(blow)
    freq = np.fft.rfftfreq(len(t), t[1])
    if not driven:
        U[freq > 440.0] = 0.0
    u = np.fft.irfft(U) + 1e-5 * rng.standard_normal(len(t))
    near = (
        np.where(freq > 450.0, U, 0.0) if driven else np.where(freq > 450.0, np.fft.rfft(rng.standard_normal(4096)), 0)
    )
    beyond = np.fft.irfft(near)
    slow = np.sin(2 * np.pi * 20 * t)
    y = slow + 0.3 * beyond / beyond.std() * slow.std()
    row_of, sign = np.zeros(1, dtype=np.int64), np.ones(1)
    record = FitRecord("high", u[None], y[None], t[1], row_of, row_of, sign, sign, 0.01 * np.ones(1))
    channel = Channel(None, "acceleration", "m/s^2", "a")
    seen = Prediction("high", "fit", t[1], (channel,), {"parameters": slow[None], "final": slow[None]}, y[None])
    said = left_over("parameters-only", [row("high", 0.1, 0.3)], [seen], (5.0, 450.0), [record])
    assert "100 % of its square lies above 450 Hz" in said
    assert ("near half the sampling rate of 1024 Hz, where the recorder's anti-alias filter acts" in said) is driven
    assert ("sample at more than 1024 Hz" in said) is driven
    assert ("the force excites too little" in said) is not driven
    rows = [{"recording": "high", "role": "fit", "noise_floor": 0.05, "parameters": 0.3, "final": 0.3}]
    said = left_beside("missing-physics", rows, [seen], (5.0, 450.0), [record])
    assert ("too few samples to a cycle" in said) is driven


def test_an_error_in_a_band_is_of_what_lies_in_it_alone() -> None:
    t = np.arange(2000) * 1e-3
    slow, quick = np.sin(2 * np.pi * 10 * t), np.sin(2 * np.pi * 300 * t)
    channel = Channel(None, "acceleration", "m/s^2", "a")
    seen = Prediction("high", "fit", 1e-3, (channel,), {"final": 0.9 * slow[None]}, (slow + quick)[None])
    assert seen.error("final") == pytest.approx(np.sqrt((0.1**2 + 1) / 2))
    assert seen.error_within("final", (5.0, 100.0)) == pytest.approx(0.1)
    assert seen.error_within("final", (200.0, 400.0)) == pytest.approx(1.0)
