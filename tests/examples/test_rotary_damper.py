"""The friction damper in a testing machine: named at three settings, loops of other settings predicted."""

from __future__ import annotations

import runpy
from collections.abc import Callable
from pathlib import Path

import numpy as np


def test_rotary_damper(project_root: Path, shared: Callable[[str], Path]) -> None:
    folder = shared("data/rotary_damper")
    example = runpy.run_path(str(project_root / "python" / "examples" / "rotary_damper.py"))
    fits = example["named"](folder)
    for setting, fit in fits.items():
        assert fit.best.name == "play_friction", setting
        assert fit.adequate, setting
        # it is not all there is: the band rings after it sticks, and no law of the catalogue does
        assert not fit.to_noise, setting
        # the dead zone is there to many standard deviations: plain friction is the law with none
        assert fit.best.values["gap"] > 5 * fit.best.sd["gap"]
    # a tighter band slips later
    assert np.all(np.diff([fit.best.values["f"] for fit in fits.values()]) > 0)
    # at the two tighter settings no other law comes near; the loops at 20 lb alone leave plain friction possible
    assert [fit.alike for fit in fits.values()][1:] == [("play_friction",)] * 2
    assert set(fits["20lb"].alike) <= {"play_friction", "coulomb_friction"}
    for errors in example["transferred"](folder, fits).values():
        # at a tension it was not fitted at, it predicts better than plain friction and plain hysteresis
        assert errors["play_friction"] < 0.95 * min(errors["coulomb_friction"], errors["bouc_wen"])
        assert errors["play_friction"] < 0.40
    faster = example["faster"](folder, fits)
    assert all(errors["play_friction"] < 0.26 for errors in faster.values())
    # the miss: at 80 lb Bouc and Wen's law predicts 1 Hz better (0.138 against 0.155), elsewhere it does not
    for setting in ("20lb", "35lb"):
        assert faster[setting]["play_friction"] < min(faster[setting]["bouc_wen"], faster[setting]["coulomb_friction"])
