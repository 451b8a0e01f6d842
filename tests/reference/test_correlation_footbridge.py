"""A real footbridge whose modes 1 and 2 change places between the test and the model (Georgia Tech SMU data)."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import scipy.io
import scipy.linalg
import scipy.sparse.linalg

from femend.correlate import mac, pair_modes


def test_five_modes_find_their_mates_although_two_change_places(shared: Callable[[str], Path]) -> None:
    folder = shared("data/pedestrian_bridge")
    test = scipy.io.loadmat(folder / "ExpModeInfo_FEM.mat")
    model = scipy.io.loadmat(folder / "SteelPedestrianBridgeExp.mat")
    K = scipy.sparse.csc_array(sum(v for k, v in model.items() if k.startswith("K_") and k != "K_whole"))
    M = scipy.sparse.csc_array(model["M0"])
    values, phi = scipy.sparse.linalg.eigsh(K, 10, M, sigma=0.0)
    order = np.argsort(values)
    freq = np.sqrt(values[order]) / (2 * np.pi)
    freq_test = np.sqrt(test["lambdaExp"].ravel()) / (2 * np.pi)
    rows = model["measDOFs"].ravel().astype(int) - 1
    at_sensors = phi[np.ix_(rows, order)]

    pairing = pair_modes(test["psiExp_m"], at_sensors, freq_test, freq)
    found = {p.a: p.b for p in pairing.pairs}
    assert set(found) == {0, 1, 2, 3, 4}
    assert found[0] > found[1], "the first two change places"
    # by shape alone every mode has one clear mate, and the pairing has to be that one
    assert found == dict(enumerate(np.argmax(mac(test["psiExp_m"], at_sensors), axis=1)))
