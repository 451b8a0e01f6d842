"""How well a modal test knows its shapes: errors against known ones in the deviations it tells, and what they weigh."""

from __future__ import annotations

import numpy as np

from femend import Channel, Dof, identify_modes
from femend.data import FRF
from femend.data.identified import real_shapes

FREQ, ZETA = np.array([5.0, 11.0, 19.0]), np.array([0.01, 0.008, 0.01])
WEAK = 1  # hardly moves where the force acts
LINES = np.arange(2.0, 24.0, 0.1)


def shapes() -> np.ndarray:
    phi = np.random.default_rng(7).standard_normal((8, 3))
    phi[0] = 0.8, 0.02, -0.9
    return phi


def measured(noise: float, seed: int) -> FRF:
    """Accelerances with one force at the first DOF, and noise of a share of each."""
    phi, w, wn = shapes(), 2 * np.pi * LINES, 2 * np.pi * FREQ
    q = 1 / (wn**2 - w[:, None] ** 2 + 2j * ZETA * wn * w[:, None])
    H = (-(w**2)[:, None] * ((q * phi[0]) @ phi.T))[:, :, None]
    rng = np.random.default_rng(seed)
    size = noise * np.sqrt(np.mean(np.abs(H) ** 2, axis=0)) / np.sqrt(2)
    H = H + size * (rng.standard_normal(H.shape) + 1j * rng.standard_normal(H.shape))
    outputs = [Channel(Dof(i + 1, 3), "acceleration", "m/s^2") for i in range(8)]
    return FRF("bench", LINES, H, outputs, [Channel(Dof(1, 3), "force", "N")], "accelerance", "m/s^2/N")


def test_errors_of_shapes_are_what_their_deviations_say() -> None:
    phi, squares, known = shapes(), [], []
    for seed in range(6):
        test = identify_modes(measured(0.03, seed))
        assert test.modes.n_modes == 3
        found = real_shapes(test.modes.shapes)
        assert test.shape_sd.shape == found.shape
        w = test.shape_sd**-2.0
        error = found - phi * (w * phi * found).sum(axis=0) / (w * phi**2).sum(axis=0)
        squares.append((error / test.shape_sd) ** 2)
        known.append((test.shape_sd / np.abs(found).max(axis=0)).mean(axis=0))
    # of six tests and eight DOFs, one scale a mode taken out: 42 free values each
    by_mode = np.mean(squares, axis=(0, 1)) * 8 / 7
    assert ((by_mode > 0.5) & (by_mode < 1.8)).all(), by_mode
    share = np.mean(known, axis=0)
    # a mode that the force moves a fiftieth as much is known so much worse
    assert share[WEAK] > 10 * share[0]
    assert share[WEAK] > 0.02


def test_noise_of_a_shape_widens_the_deviation_of_its_mac() -> None:
    from types import SimpleNamespace

    from femend.bench.updating.problem import _mac_sd

    rng = np.random.default_rng(2)
    phi, noise = shapes()[:, :2], np.array([0.0, 0.4])
    counted = SimpleNamespace(phi=phi, phi_sd=np.hypot(0.05, np.ones((8, 1)) * noise))
    sd = _mac_sd(counted, 0.05)  # type: ignore[arg-type]
    assert sd[0] == 0.05
    noisy = phi[:, 1] + 0.4 * rng.standard_normal((4000, 8))
    mac = (noisy @ phi[:, 1]) ** 2 / ((noisy**2).sum(axis=1) * (phi[:, 1] ** 2).sum())
    lost = np.mean(1 / np.sqrt(mac) - 1)
    # to first order in the share of noise
    assert abs(np.sqrt(sd[1] ** 2 - 0.05**2) / lost - 1) < 0.35
