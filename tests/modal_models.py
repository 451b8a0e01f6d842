"""FRFs of known modal models, computed here and not by what is tested."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from femend.data import FRF, Channel
from femend.dof import Dof

ORDER = {"receptance": (0, "displacement", "m/N"), "mobility": (1, "velocity", "m/s/N")}
ORDER["accelerance"] = (2, "acceleration", "m/s^2/N")


def known_frf(
    f: NDArray[np.float64],
    freq: Sequence[float],
    zeta: Sequence[float],
    phi: NDArray[np.float64],
    inputs: Sequence[int],
    *,
    outputs: Sequence[int] | None = None,
    kind: str = "accelerance",
    noise: float = 0.0,
    seed: int = 0,
) -> FRF:
    """FRFs of mass-normalised real modes `phi` (n_dof, n_modes), damping ratios `zeta`: phi phi^T / (omega_r^2 + 2 zeta
    omega_r s + s^2). `noise` is the deviation of complex white noise as a share of the rms of all FRFs. DOF i is node
    i + 1, direction Z."""
    d, quantity, unit = ORDER[kind]
    rows = list(range(phi.shape[0])) if outputs is None else list(outputs)
    omega, s = 2 * np.pi * np.asarray(freq), 2j * np.pi * f[:, None]
    g = s**d / (omega**2 + 2 * np.asarray(zeta) * omega * s + s**2)
    H = np.einsum("or,kr,ir->koi", phi[rows], g, phi[list(inputs)])
    rng = np.random.default_rng(seed)
    scatter = rng.standard_normal(H.shape) + 1j * rng.standard_normal(H.shape)
    H = H + noise * np.sqrt(np.mean(np.abs(H) ** 2) / 2) * scatter
    return FRF(
        "bench",
        f,
        H,
        tuple(Channel(Dof(i + 1, 3), quantity, unit.split("/N")[0]) for i in rows),
        tuple(Channel(Dof(i + 1, 3), "force", "N") for i in inputs),
        kind,
        unit,
    )


def shapes(n_dof: int, n_modes: int, seed: int = 1) -> NDArray[np.float64]:
    """Shapes (n_dof, n_modes) without nodes near any DOF: 0.4 to 1.4 with either sign."""
    rng = np.random.default_rng(seed)
    return (0.4 + rng.random((n_dof, n_modes))) * np.where(rng.random((n_dof, n_modes)) < 0.5, -1.0, 1.0)
