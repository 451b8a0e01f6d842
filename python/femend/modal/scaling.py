"""Size of the shapes from driving points."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from femend.data.identified import real_shapes
from femend.dof import Dof
from femend.modal.lsfd import ModalFit

__all__ = ["DrivingPoint", "driving_points", "modal_masses", "scale_by_driving_points"]

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]


@dataclass(frozen=True, slots=True)
class DrivingPoint:
    """A reference that is a response too: rows `response` and `reference`, `sign` -1 where the senses are opposed."""

    dof: Dof
    response: int
    reference: int
    sign: int


def driving_points(responses: tuple[Dof, ...], references: tuple[Dof, ...]) -> tuple[DrivingPoint, ...]:
    """The DOFs that occur among `responses` and `references`, whatever the sense of the sensor. Raises nothing.

    >>> [(p.response, p.sign) for p in driving_points((Dof(1, 3), Dof(2, 3)), (Dof(2, 3, -1),))]
    [(1, -1)]
    """
    at = {dof.unsigned: row for row, dof in reversed(list(enumerate(responses)))}
    return tuple(
        DrivingPoint(dof, at[dof.unsigned], j, responses[at[dof.unsigned]].sign * dof.sign)
        for j, dof in enumerate(references)
        if dof.unsigned in at
    )


def scale_by_driving_points(
    shapes: Complex, participation: Complex, points: tuple[DrivingPoint, ...]
) -> tuple[Complex, Complex]:
    """Shapes (n_dof, n_modes) and participation (n_modes, n_ref) with modal A = 1: psi c and l / c.

    By reciprocity the participation is the shape at the references (Maxwell-Betti): c^2 is the least-squares factor
    between `participation` and `shapes` at the driving `points`, the phase of c is the one that makes the shape nearest
    to that of proportional damping, psi = phi / sqrt(2 i omega). Residues psi l^T stay as they are. Raises nothing;
    modes that do not move at any driving point are returned as they are.
    """
    rows = [p.response for p in points]
    columns = [p.reference for p in points]
    sign = np.array([p.sign for p in points], dtype=np.float64)[:, None]
    at_response, at_reference = shapes[rows], sign * participation[:, columns].T
    size = np.sum(np.abs(at_response) ** 2, axis=0)
    square = np.sum(at_response.conj() * at_reference, axis=0) / np.where(size > 0, size, 1.0)
    c = np.where(np.abs(square) > 0, np.sqrt(square), 1.0)
    return shapes * c, participation / c[:, None]


def modal_masses(freq: Real, d: int, fit: ModalFit, noise: Real, points: tuple[DrivingPoint, ...]) -> tuple[Real, Real]:
    """Modal masses (n_modes,) for the largest component 1, and their relative standard deviations, of scaled shapes.

    With modal A = 1, phi = psi sqrt(2 i omega_d) is mass-normalised, so the mass is 1 / max(phi)^2. Its deviation is
    that of the residue at the driving `points`: for a mode that stands alone the noise (n_out,) of the FRFs divided by
    the root of the squared length of s^d / (s - p) over the lines `freq` (Hz). Both are nan without a driving point.
    Raises nothing.
    """
    n_modes = fit.poles.size
    if not points or not n_modes:
        return np.full(n_modes, np.nan), np.full(n_modes, np.nan)
    phi = real_shapes(fit.shapes * np.sqrt(2j * fit.poles.imag))
    s = 2j * np.pi * freq
    length = np.linalg.norm((s**d)[:, None] / (s[:, None] - fit.poles), axis=0)
    rows = [p.response for p in points]
    residue = np.abs(fit.shapes[rows] * fit.participation[:, [p.reference for p in points]].T)
    sd = np.sqrt(np.sum((residue * noise[rows][:, None]) ** 2, axis=0)) / np.maximum(length, 1e-300)
    total = np.sum(residue**2, axis=0)
    share = np.where(total > 0, sd / np.where(total > 0, total, 1.0), np.inf)
    largest = np.max(np.abs(phi), axis=0)
    return 1.0 / np.where(largest > 0, largest, np.inf) ** 2, share
