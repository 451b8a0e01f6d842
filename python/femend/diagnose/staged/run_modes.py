"""Modes of a structure from the operating shapes of a run."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from femend.data import FRF, Channel
from femend.diagnose.staged.prepare import ModesData, RunData
from femend.dof import Dof
from femend.estimate.joint import ods_frf
from femend.modal import identify_modes
from femend.numerals import plain

__all__ = ["run_modes", "too_short_for_modes"]

FloatArray = NDArray[np.float64]

# fewer lines than this hold no modes (those a modal test needs)
FEWEST_LINES = 12


def mode_lines(data: RunData) -> tuple[FloatArray, float]:
    """Lines (K,) in Hz on which a run's modes are sought, and the least step in Hz that its length allows."""
    low, high = float(data.rev_per_s.min()), float(data.rev_per_s.max())
    step = 2.0 / (data.y.shape[1] * data.dt)
    return np.arange(1.25 * low, 0.97 * high, max(step, 0.0015 * high)), step


def too_short_for_modes(data: RunData) -> str:
    """A sentence where a run is too short, or its range of speeds too narrow, for the modes of the structure; else
    nothing."""
    freq, step = mode_lines(data)
    if len(freq) >= FEWEST_LINES:
        return ""
    low, high = (float(v) / data.order for v in (data.rev_per_s.min(), data.rev_per_s.max()))
    return (
        f"recording {data.name!r}: {plain(data.y.shape[1] * data.dt)} s from {plain(low)} to {plain(high)} rev/s hold "
        f"{len(freq)} lines {plain(step, 3)} Hz apart, too few for the modes they go through (at least "
        f"{FEWEST_LINES}); record a longer run over more speeds, or an ambient recording of this configuration"
    )


def run_modes(data: RunData) -> ModesData | None:
    """Modes of a run's operating shapes: over frequency, per unit course, they are FRFs to a load that turns.

    Poles by pLSCF as in a modal test; the shapes are those of the responses, of arbitrary size. None where no mode was
    found, or where the run is too short or too narrow in speed for any (`mode_lines`).
    """
    freq, step = mode_lines(data)
    if len(freq) < FEWEST_LINES:
        return None
    high = float(data.rev_per_s.max())
    shapes = ods_frf(data.run, data.y, freq, max(2.5 * step, 0.004 * high))
    outputs = tuple(Channel(d, "acceleration", "m/s^2") for d in data.sensors)
    load = (Channel(Dof(data.nodes[0], (data.axis + 1) % 3 + 1), "force", "N"),)
    frf = FRF(data.name, shapes.freq, shapes.Y[:, :, None], outputs, load, "accelerance", "(m/s^2)/N")
    modes = identify_modes(frf).modes
    return ModesData(data.name, modes) if modes.n_modes else None
