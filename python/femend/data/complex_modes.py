"""Complex modes: poles with right and left vectors."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from femend.data._arrays import frozen
from femend.data.mode_set import ModeSet
from femend.numerals import plain

__all__ = ["ComplexModes", "PoleSet"]


@dataclass(frozen=True, slots=True, eq=False)
class PoleSet:
    """Poles (m,) in rad/s with `right` and `left` vectors (n_dof, m), `modal_a` (m,) and `residual` (m,).

    A pole's share in the receptance is `right left^T / (modal_a (s - pole))`. Arrays are read-only.
    """

    poles: NDArray[np.complex128]
    right: NDArray[np.complex128]
    left: NDArray[np.complex128]
    modal_a: NDArray[np.complex128]
    residual: NDArray[np.float64]

    def __post_init__(self) -> None:
        for name in ("poles", "right", "left", "modal_a"):
            object.__setattr__(self, name, frozen(getattr(self, name), np.complex128))
        object.__setattr__(self, "residual", frozen(self.residual, np.float64))

    @property
    def n_poles(self) -> int:
        """Number of poles."""
        return int(self.poles.size)


@dataclass(frozen=True, slots=True, eq=False)
class ComplexModes:
    """Complex modes at one speed: rigid-body modes (pole 0) first, then by |pole|; conjugates are not listed.

    `modes` holds freq = |pole| / 2 pi in Hz, zeta = -Re pole / |pole| and the shapes psi, complex, psi^H M psi = 1,
    largest component real and positive. `poles` (n_modes,) in rad/s. `left` (n_dof, n_modes): y^T D(pole) = 0, scaled
    as psi; equal to psi up to a factor where all matrices are symmetric. `modal_a` (n_modes,) is
    y^T (2 pole M + C + W G) psi; 0 for a rigid-body mode. `residual`, `residual_left` (n_modes,) are
    |D(pole) psi| / (|pole^2 M psi| + |pole C psi| + |(K + iD - sigma M) psi|) of the whole model. `condition`
    (n_modes,) is 1 where a mode is like a real one, sqrt((1 + zeta) / (1 - zeta)) for one mass on a spring, and large
    near a defective pole. `overdamped` are real poles up to the last mode, `mirrored` those of the lower half-plane
    that structural damping makes (not physical, but part of the receptance's rational function). `speed` W in rad/s.
    `info`: shift `sigma` in (rad/s)^2, undamped modes at rest by inertia `counted`, poles found late by the probe
    `n_late`, and the work done.
    """

    modes: ModeSet
    poles: NDArray[np.complex128]
    left: NDArray[np.complex128]
    modal_a: NDArray[np.complex128]
    residual: NDArray[np.float64]
    residual_left: NDArray[np.float64]
    condition: NDArray[np.float64]
    overdamped: PoleSet
    mirrored: PoleSet
    speed: float = 0.0
    info: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name in ("poles", "left", "modal_a"):
            object.__setattr__(self, name, frozen(getattr(self, name), np.complex128))
        for name in ("residual", "residual_left", "condition"):
            object.__setattr__(self, name, frozen(getattr(self, name), np.float64))

    @property
    def n_modes(self) -> int:
        """Number of modes."""
        return self.modes.n_modes

    @property
    def freq_damped(self) -> NDArray[np.float64]:
        """Im pole / 2 pi (n_modes,) in Hz."""
        return np.asarray(self.poles.imag / (2 * np.pi))

    @property
    def unstable(self) -> NDArray[np.bool_]:
        """Modes (n_modes,) whose motion grows: Re pole > 0 beyond the accuracy of the pole."""
        accuracy = np.maximum(1e-9, self.residual * self.residual_left) * np.abs(self.poles)
        return np.asarray(self.poles.real > accuracy)

    def modal_a_shapes(self) -> NDArray[np.complex128]:
        """Shapes (n_dof, n_modes) scaled to modal A = 1 (psi^T (2 pole M + C) psi = 1), for symmetric matrices.

        Raises ValueError where left vectors are not the right ones, and for rigid-body modes, which have modal A = 0.
        """
        a = np.array(self.modal_a)
        if np.any(self.poles == 0):
            raise ValueError(
                f"{int(np.sum(self.poles == 0))} modes are rigid-body motions with modal A = 0; leave them out"
            )
        psi = np.asarray(self.modes.phi)
        ratio = np.sum(psi.conj() * self.left, axis=0) / np.sum(np.abs(psi) ** 2, axis=0)
        apart = np.linalg.norm(self.left - psi * ratio, axis=0) / np.linalg.norm(self.left, axis=0)
        if np.any(apart > 1e-4):
            mode = int(np.argmax(apart))
            raise ValueError(
                f"left and right vector of mode {mode + 1} differ by {plain(apart[mode], 2)}: the matrices are not "
                "symmetric, or poles coincide; use left and modal_a"
            )
        return np.asarray(psi / np.sqrt(a / ratio))

    def __repr__(self) -> str:
        pairs = zip(self.modes.freq[:6], self.modes.zeta[:6], strict=True)
        listed = ", ".join(f"{plain(f)} Hz ({plain(100 * z, 3)} %)" for f, z in pairs)
        listed += ", …" if self.n_modes > 6 else ""
        real = f", {self.overdamped.n_poles} overdamped poles" if self.overdamped.n_poles else ""
        return f"ComplexModes({self.n_modes} at {plain(self.speed)} rad/s: {listed}{real})"
