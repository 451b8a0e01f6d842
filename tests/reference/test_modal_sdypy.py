"""Poles of sdypy-EMA (LSCF, complex coefficients, common denominator) on the same FRFs, within the stated deviations.

Its estimate has a bias that falls with the order (at order 40 it is tens of our deviations), so order 80 is compared.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import numpy as np
from numpy.typing import NDArray

from femend import read_recording
from femend.modal import ModalTest, identify_modes

sys.path.insert(0, str(Path(__file__).parents[1]))
from modal_models import known_frf, shapes


def disagreement(ema: ModuleType, test: ModalTest) -> NDArray[np.float64]:
    """Their poles nearest to ours: differences in frequency and damping (2, n_modes) over our deviations."""
    frf = test.measured
    H = frf.H.reshape(frf.n_freq, -1).T
    model = ema.Model(
        H, frf.freq, lower=frf.freq[0], upper=frf.freq[-1], pol_order_high=80, frf_form=frf.kind, pyfrf=False
    )
    model.get_poles(method="lscf", show_progress=False)
    poles = np.asarray(model.all_poles[-1])
    theirs = np.array([poles[np.argmin(np.abs(poles - p))] for p in test.modes.poles])
    freq, zeta = np.abs(theirs) / (2 * np.pi), -theirs.real / np.abs(theirs)
    modes = test.modes
    return np.array([(freq - modes.freq) / modes.freq_sd, (zeta - modes.zeta) / modes.zeta_sd])


def test_known_modes(optional_module: Callable[[str], ModuleType]) -> None:
    ema = optional_module("sdypy.EMA")
    freq, zeta = [4.0, 7.0, 7.3, 11.0, 16.0], [0.01, 0.02, 0.01, 0.005, 0.015]
    test = identify_modes(known_frf(np.arange(801) * 0.05, freq, zeta, shapes(10, 5), [0], noise=0.01))
    assert test.modes.n_modes == 5
    # two estimates of one noise: sdypy's differs from ours by more than ours scatters, but not by much more
    assert np.abs(disagreement(ema, test)).max() < 4


def test_the_rig(optional_module: Callable[[str], ModuleType], shared: Callable[[str], Path]) -> None:
    ema = optional_module("sdypy.EMA")
    test = identify_modes(read_recording(shared("cases/rig/public/ema_hammer.uff")))
    assert test.modes.n_modes == 5
    assert np.abs(disagreement(ema, test)).max() < 4
