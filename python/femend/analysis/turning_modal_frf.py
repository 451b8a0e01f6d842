"""FRFs of a model with parts that turn, in the space of its real modes at rest."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from femend.analysis.frf import shapes_at
from femend.analysis.rotor import gyroscopic_matrices
from femend.data.mode_set import ModeSet
from femend.dof import Dof
from femend.model.model import Model
from femend.model.terms.spinning import SpinningPart

__all__ = ["modal_gyroscopic", "turning_modal_frf"]

FloatArray = NDArray[np.float64]


def modal_gyroscopic(
    model: Model, modes: ModeSet, parts: Sequence[SpinningPart], factors: Mapping[str, float] | None = None
) -> FloatArray:
    """phi^T G phi (n_modes, n_modes) per rad/s of the `parts` of `model` between its `modes` (`model_modes`), at
    `factors` on parameters; raises what `gyroscopic_matrices` raises."""
    fe = model.fe
    phi = shapes_at(modes, [Dof(int(n), int(c)) for n, c in zip(fe.dof_nodes, fe.dof_components, strict=True)])
    G = np.zeros((modes.n_modes, modes.n_modes))
    for part in parts:
        own, _ = gyroscopic_matrices(model, part.axis, elements=part.elements, axes=part.axes, factors=factors)
        G += part.ratio * (phi.T @ (own @ phi))
    return G


def turning_modal_frf(
    modes: ModeSet, G: FloatArray, freq: ArrayLike, speed: ArrayLike, outputs: Sequence[Dof], inputs: Sequence[Dof]
) -> NDArray[np.complex128]:
    """Accelerances (n_freq, n_out, n_in) at `freq` (n_freq,) in Hz, each line at its own `speed` (n_freq,) in rad/s.

    `modes` are mass-normalised, at rest, and G (n_modes, n_modes) is their gyroscopic matrix (`modal_gyroscopic`),
    which couples them:

        H = -w^2 phi_out (diag(omega^2 - w^2 + 2 i zeta omega w) + i w speed G)^-1 phi_in^T

    (Genta, Dynamics of Rotating Systems, 2005, section 4.6). Modes left out are left out of the coupling too. Raises
    ValueError for a DOF of `outputs` or `inputs` that the modes do not have.
    """
    w = 2 * np.pi * np.asarray(freq, dtype=np.float64)
    omega = 2 * np.pi * modes.freq
    out, into = shapes_at(modes, outputs), shapes_at(modes, inputs)
    rest = omega**2 - w[:, None] ** 2 + 2j * modes.zeta * omega * w[:, None]
    H = np.empty((w.size, len(outputs), len(inputs)), dtype=np.complex128)
    for k, (line, turns) in enumerate(
        zip(w, np.broadcast_to(np.asarray(speed, dtype=np.float64), w.shape), strict=True)
    ):
        Z = (1j * line * turns) * G
        Z[np.diag_indices_from(Z)] += rest[k]
        H[k] = -(line**2) * (out @ np.linalg.solve(Z, into.T))
    return H
