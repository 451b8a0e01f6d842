"""Up to which frequency the elements of a deck follow its modes, and how many of them there are to a wavelength.

A beam with cubic shapes follows its bending exactly but for the inertia along its own length. The error of a mode's
frequency squared is the energy of what the interpolation leaves out (Strang and Fix, An Analysis of the Finite Element
Method, 1973, ch. 6): of a load k^4 w that is even over an element of length h, (k h)^4/720 of the kinetic energy, with
consistent masses from above, with lumped ones from below, where the ends of a member add what lumping does to its
kinetic energy; of twisting, which is interpolated linearly, (k h)^2/12. Every element counts by its share of the
mode's kinetic energy. k belongs to the frequency and the section, k^4 = rho A omega^2 / (E I), whatever the shape of
the mode, since it is the element's own inertia that is not followed. So four elements a wavelength of bending are
enough for half a per cent. Shells and solids that interpolate linearly need ten for two per cent (`form_errors`); their
wave is told by how much nodes of one element differ in a mode.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from femend.model.free_body import is_elastic
from femend.model.known_mesh import Unresolved
from femend.model.mesh.form_errors import MESH_SD, MODE_SD, basis_modes
from femend.model.mesh.refined import QUADRATIC, SHELLS, is_linear
from femend.model.model import Model
from femend.model.reduced.beam_waves import beam_errors
from femend.model.reduced.reduction import ReducedModel

__all__ = ["Resolution", "mode_resolution", "unresolved"]

FloatArray = NDArray[np.float64]

# error of a mode's frequency, in standard deviations of what the diagnosis allows it, from which its lines are left out
LIMIT = 2.0
# relative error of a frequency in linear shells and solids over (k h)^2: ten elements a wavelength make it 2 % too high
LINEAR = 0.05


@dataclass(frozen=True, eq=False)
class Resolution:
    """Modes at `freq` (n,) Hz with the relative `error` (n,) of each by the mesh, positive where it is too high, its
    size in standard deviations of what a diagnosis allows (`excess`), the elements a wavelength (`points`) of the
    element that adds most to it, and its id (`element`)."""

    freq: FloatArray
    error: FloatArray
    excess: FloatArray
    points: FloatArray
    element: NDArray[np.int64]


def unresolved(reduced: ReducedModel, band: tuple[float, float]) -> Unresolved | None:
    """What the mesh of a reduced model does not follow of a `band` (Hz); None where it follows all of its modes.

    The limit lies half way, in ratio, between the first mode that is off by more than `LIMIT` standard deviations and
    the one before.
    """
    found = mode_resolution(reduced, band[1])
    bad = np.flatnonzero(found.excess > LIMIT)
    if not bad.size:
        return None
    first = int(bad[0])
    before = found.freq[:first][found.freq[:first] >= band[0]]
    limit = float(np.sqrt(before[-1] * found.freq[first])) if before.size else 0.0
    model, element = reduced.model, int(found.element[first])
    pids = {eid: pid for eid, _, pid, _ in model.deck.elements()}
    pieces = len(model.parts.get(model.drawn_elements([element])[0], (element,)))
    return Unresolved(
        float(found.freq[first]),
        float(found.error[first]),
        float(found.points[first]) / pieces,
        pids.get(element) or 0,
        limit,
        cut=pieces > 1,
    )


def mode_resolution(reduced: ReducedModel, f_max: float) -> Resolution:
    """How well the mesh of a reduced model follows its elastic modes up to `f_max` (Hz), at the deck's values.

    What other elements than beams, linear shells and linear solids leave out is not told.
    """
    model = reduced.model
    omega, Q = basis_modes(reduced)
    kept = np.flatnonzero(is_elastic(omega) & (omega <= 2 * np.pi * f_max))
    omega, Q = omega[kept], Q[:, kept]
    told = _Told.nothing(len(kept))
    kinetic = np.zeros(len(kept))
    linear: list[tuple[int, str, Sequence[int]]] = []
    others = False
    for eid, card, nodes in model.fe.elements():
        if is_linear(card, len(nodes)):
            linear.append((eid, card, nodes))
        elif eid:
            others |= card in (*SHELLS, *QUADRATIC)
            kinetic += _kinetic(model, reduced, eid, Q)
    for eid, error, kh in beam_errors(model, reduced.V, Q, omega):
        told.add(eid, error, kh, MODE_SD)
    # of a refined mesh the linear elements are the finer ones, whose error is known mode by mode
    if linear and not others and model.refines is None:
        kh = _differences(model, reduced, linear, Q)
        told.add(linear[0][0], LINEAR * kh**2 * np.clip(1 - kinetic, 0.0, 1.0), kh, float(np.hypot(MESH_SD, MODE_SD)))
    return Resolution(
        omega / (2 * np.pi), told.error, np.abs(told.excess), 2 * np.pi / np.maximum(told.kh, 1e-12), told.element
    )


@dataclass(eq=False)
class _Told:
    """What is added up mode by mode: errors, in allowances too, and the element that adds most of it, with its wave."""

    error: FloatArray
    excess: FloatArray
    most: FloatArray
    kh: FloatArray
    element: NDArray[np.int64]

    @classmethod
    def nothing(cls, n: int) -> _Told:
        return cls(np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n, dtype=np.int64))

    def add(self, element: int, error: FloatArray, kh: FloatArray, allowed: float) -> None:
        """Adds the errors (n,) that an element makes, of which a standard deviation of `allowed` is nothing new."""
        self.error += error
        self.excess += error / allowed
        more = np.abs(error) > self.most
        self.most, self.kh = np.where(more, np.abs(error), self.most), np.where(more, kh, self.kh)
        self.element[more] = element


def _kinetic(model: Model, reduced: ReducedModel, eid: int, Q: FloatArray) -> FloatArray:
    """Share (n,) of an element in the kinetic energy of modes Q (r, n)."""
    rows, _, M = model.fe.element_matrices(eid, np.ones(len(model.parameters)))
    phi = reduced.V[rows] @ Q
    return np.asarray((phi * (M @ phi)).sum(axis=0))


def _differences(
    model: Model, reduced: ReducedModel, elements: Sequence[tuple[int, str, Sequence[int]]], Q: FloatArray
) -> FloatArray:
    """Radians an element (n,) of the waves of modes Q (r, n) over shells and solids: by how much nodes at the ends of
    an edge differ against how much they move, each element by its size."""
    top, bottom = np.zeros(Q.shape[1]), np.zeros(Q.shape[1])
    frames = model.frames
    for card in {card for _, card, _ in elements}:
        at = np.array([[model.index(n) for n in nodes] for _, own, nodes in elements if own == card], dtype=np.int64)
        used, local = np.unique(at, return_inverse=True)
        local = local.reshape(at.shape)
        moved = np.stack([reduced.V[6 * used + c] @ Q for c in range(3)], axis=1)
        moved = np.einsum("nij,njm->nim", frames[used], moved)
        corners, edges = QUADRATIC[card] if card in QUADRATIC else (SHELLS[card], _ring(SHELLS[card]))
        xyz = model.xyz[used][local]
        # directions of a brick are three, of a shell two, each with as many edges as the others
        directions = 3 if card in QUADRATIC else 2
        lengths = np.array([np.linalg.norm(xyz[:, j] - xyz[:, i], axis=1) for i, j in edges])
        size = lengths.mean(axis=0) ** directions
        for i, j in edges:
            change = moved[local[:, j]] - moved[local[:, i]]
            top += (size[:, None] * (change**2).sum(axis=1)).sum(axis=0) * directions / len(edges)
        for i in range(corners):
            bottom += (size[:, None] * (moved[local[:, i]] ** 2).sum(axis=1)).sum(axis=0) / corners
    return np.asarray(np.sqrt(top / np.maximum(bottom, 1e-300)))


def _ring(n: int) -> tuple[tuple[int, int], ...]:
    return tuple((i, (i + 1) % n) for i in range(n))
