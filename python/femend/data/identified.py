"""Modes as a test identifies them: complex poles and shapes, with how well they are known."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from femend.data._arrays import frozen
from femend.data.mode_set import ModeSet
from femend.dof import Dof
from femend.errors import RecordingError
from femend.numerals import plain

__all__ = ["IDENTIFIED_SCALINGS", "IdentifiedModes", "real_shapes"]

IDENTIFIED_SCALINGS = ("modal A", "unscaled")


def real_shapes(shapes: NDArray[np.complex128]) -> NDArray[np.float64]:
    """Real shapes (n_dof, n_modes) nearest to complex `shapes` (n_dof, n_modes), their common phase taken out.

    Each column is turned by the angle that leaves the least imaginary part (the principal axis of its components in
    the complex plane, exp(-i arg(psi^T psi) / 2)) and its real part is kept; the largest component becomes positive.
    The size of a column is not changed otherwise. Raises nothing.

    >>> real_shapes(np.array([[1j], [-2j]])).ravel()
    array([-1.,  2.])
    """
    turned = shapes * np.exp(-0.5j * np.angle(np.sum(shapes**2, axis=0)))
    real = np.ascontiguousarray(turned.real)
    if real.size:
        largest = real[np.argmax(np.abs(real), axis=0), np.arange(real.shape[1])]
        real = real * np.where(largest < 0, -1.0, 1.0)
    return real + 0.0  # no minus zeros


@dataclass(frozen=True, slots=True, eq=False)
class IdentifiedModes:
    """Modes from a test, in the order of their natural frequency.

    `poles` (n_modes,) complex in rad/s with positive imaginary part, p = -zeta omega + i omega sqrt(1 - zeta^2);
    their conjugates are meant too. `shapes` (n_dof, n_modes) complex, rows labelled by the response DOFs `dofs`.
    `participation` (n_modes, n_ref) complex or None, columns labelled by `reference_dofs`: the receptance is

        H(s) = sum_r shapes[:, r] participation[r, :] / (s - poles[r]) + conjugate terms (+ residuals).

    `freq_sd` (n_modes,) in Hz and `zeta_sd` (n_modes,) as a fraction are absolute standard deviations, nan where they
    are not known. `scaling` "modal A": a driving point was measured and participation is the shape at the references
    (modal A = 1: residues psi psi^T, s-plane scaling); "unscaled": the size and phase of each shape are arbitrary.
    Modes are sorted on construction; arrays are read-only. Raises RecordingError for shapes that do not fit, an
    unknown scaling, values that are not finite (nan is allowed in the deviations), or poles with Im(p) <= 0.

    >>> modes = IdentifiedModes((Dof.parse("1:+Z"),), np.array([-0.1 + 10j]), np.array([[1.0 + 0j]]))
    >>> float(round(modes.zeta[0], 6)), modes.scaling
    (0.01, 'unscaled')
    """

    dofs: tuple[Dof, ...]
    poles: NDArray[np.complex128]
    shapes: NDArray[np.complex128]
    participation: NDArray[np.complex128] | None = None
    reference_dofs: tuple[Dof, ...] = ()
    freq_sd: NDArray[np.float64] | None = None
    zeta_sd: NDArray[np.float64] | None = None
    scaling: str = "unscaled"

    def __post_init__(self) -> None:
        poles = np.asarray(self.poles, dtype=np.complex128)
        order = np.argsort(np.abs(poles), kind="stable") if poles.ndim == 1 else np.arange(0)
        unknown = np.full(poles.shape, np.nan)
        object.__setattr__(self, "dofs", tuple(self.dofs))
        object.__setattr__(self, "reference_dofs", tuple(self.reference_dofs))
        self._check_shapes(poles)
        object.__setattr__(self, "poles", frozen(poles[order]))
        object.__setattr__(self, "shapes", frozen(np.asarray(self.shapes, dtype=np.complex128)[:, order]))
        if self.participation is not None:
            object.__setattr__(
                self, "participation", frozen(np.asarray(self.participation, dtype=np.complex128)[order])
            )
        for label in ("freq_sd", "zeta_sd"):
            given = getattr(self, label)
            values = unknown if given is None else np.asarray(given, dtype=np.float64)
            object.__setattr__(self, label, frozen(values[order]))
        self._check_values()

    def _check_shapes(self, poles: NDArray[np.complex128]) -> None:
        n_modes, n_ref = poles.size, len(self.reference_dofs)
        expected: dict[str, tuple[Any, tuple[int, ...]]] = {
            "poles": (poles, (n_modes,)),
            "shapes": (self.shapes, (len(self.dofs), n_modes)),
            "participation": (self.participation, (n_modes, n_ref)),
            "freq_sd": (self.freq_sd, (n_modes,)),
            "zeta_sd": (self.zeta_sd, (n_modes,)),
        }
        for label, (array, shape) in expected.items():
            if array is not None and np.shape(array) != shape:
                raise RecordingError(
                    f"identified modes: {label} has shape {np.shape(array)}, not {shape}, for {n_modes} poles, "
                    f"{len(self.dofs)} response and {n_ref} reference DOFs"
                )
        if self.scaling not in IDENTIFIED_SCALINGS:
            raise RecordingError(
                f"identified modes: scaling {self.scaling!r} is none of {', '.join(IDENTIFIED_SCALINGS)}"
            )

    def _check_values(self) -> None:
        for label in ("poles", "shapes", "participation"):
            array = getattr(self, label)
            if array is not None and not np.isfinite(array).all():
                bad = np.nonzero(~np.isfinite(array))
                mode = int(bad[1 if label == "shapes" else 0][0])
                raise RecordingError(f"identified modes: {label} of mode {mode + 1} is not a number")
        if (self.poles.imag <= 0).any():
            mode = int(np.nonzero(self.poles.imag <= 0)[0][0])
            raise RecordingError(
                f"identified modes: pole {self.poles[mode]:.6g} rad/s of mode {mode + 1} does not oscillate with "
                "positive frequency; give the pole of each conjugate pair with Im(p) > 0, leave real poles out"
            )

    @property
    def n_modes(self) -> int:
        """Number of modes."""
        return int(self.poles.size)

    @property
    def freq(self) -> NDArray[np.float64]:
        """Natural frequencies |p| / 2 pi in Hz, (n_modes,)."""
        return np.abs(self.poles) / (2.0 * np.pi)

    @property
    def zeta(self) -> NDArray[np.float64]:
        """Damping ratios -Re(p) / |p| as fractions, (n_modes,)."""
        return -self.poles.real / np.abs(self.poles)

    def select(self, modes: Any) -> IdentifiedModes:
        """The modes at positions, a slice or a mask `modes`."""
        keep = np.arange(self.n_modes)[modes]
        return IdentifiedModes(
            self.dofs,
            self.poles[keep],
            self.shapes[:, keep],
            None if self.participation is None else self.participation[keep],
            self.reference_dofs,
            None if self.freq_sd is None else self.freq_sd[keep],
            None if self.zeta_sd is None else self.zeta_sd[keep],
            self.scaling,
        )

    def to_mode_set(self) -> ModeSet:
        """The nearest real modes.

        With "modal A" scaling they are mass-normalised (scaling "mass"): with proportional damping
        psi = phi / sqrt(2 i omega_d), omega_d = Im(p), where phi^T M phi = 1. Else the largest component is 1
        (scaling "max"). A row keeps the sense of its sensor, so a `dof` with sign -1 means what it says.
        """
        if self.scaling == "modal A":
            return ModeSet(
                self.freq, self.zeta, real_shapes(self.shapes * np.sqrt(2j * self.poles.imag)), self.dofs, "mass"
            )
        phi = real_shapes(self.shapes)
        size = np.max(np.abs(phi), axis=0, initial=0.0)
        return ModeSet(self.freq, self.zeta, phi / np.where(size > 0, size, 1.0), self.dofs, "max")

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON, without the shapes; deviations that are not known are None."""
        sd = {
            label: [None if np.isnan(v) else float(v) for v in getattr(self, label)] for label in ("freq_sd", "zeta_sd")
        }
        return {
            "freq": self.freq.tolist(),
            "zeta": self.zeta.tolist(),
            **sd,
            "n_dof": len(self.dofs),
            "references": [str(dof) for dof in self.reference_dofs],
            "scaling": self.scaling,
        }

    def __repr__(self) -> str:
        listed = ", ".join(plain(f) for f in self.freq[:6]) + (", …" if self.n_modes > 6 else "")
        return f"IdentifiedModes({self.n_modes} modes at {len(self.dofs)} DOFs: {listed} Hz; {self.scaling})"
