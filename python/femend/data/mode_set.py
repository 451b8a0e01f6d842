"""Modes, measured or computed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from femend.data._arrays import frozen
from femend.dof import Dof
from femend.errors import RecordingError
from femend.numerals import plain

__all__ = ["SCALINGS", "ModeSet"]

SCALINGS = ("mass", "max", "unscaled", "modal A")


@dataclass(frozen=True, slots=True, eq=False)
class ModeSet:
    """Modes: `freq` (n_modes,) in Hz, `zeta` (n_modes,) as fractions, `phi` (n_dof, n_modes) real or complex.

    `dofs` label the rows of `phi`; `scaling` is "mass" (phi^T M phi = 1, the default of femend), "max" (largest
    component 1), "unscaled" or "modal A". Arrays are read-only. Raises RecordingError for shapes that do not fit or
    values that are not finite.
    """

    freq: NDArray[np.float64]
    zeta: NDArray[np.float64]
    phi: NDArray[Any]
    dofs: tuple[Dof, ...]
    scaling: str = "mass"

    def __post_init__(self) -> None:
        kind = np.complex128 if np.iscomplexobj(self.phi) else np.float64
        object.__setattr__(self, "freq", frozen(self.freq, np.float64))
        object.__setattr__(self, "zeta", frozen(self.zeta, np.float64))
        object.__setattr__(self, "phi", frozen(self.phi, kind))
        object.__setattr__(self, "dofs", tuple(self.dofs))
        n_modes = self.freq.size
        if self.freq.ndim != 1 or self.zeta.shape != (n_modes,) or self.phi.shape != (len(self.dofs), n_modes):
            raise RecordingError(
                f"modes: freq {self.freq.shape}, zeta {self.zeta.shape}, phi {self.phi.shape} and {len(self.dofs)} "
                "DOFs do not fit; phi is (n_dof, n_modes)"
            )
        if self.scaling not in SCALINGS:
            raise RecordingError(f"modes: scaling {self.scaling!r} is none of {', '.join(SCALINGS)}")
        for label, array in (("freq", self.freq), ("zeta", self.zeta), ("phi", self.phi)):
            if not np.isfinite(array).all():
                mode = int(np.nonzero(~np.isfinite(array))[-1][0])
                raise RecordingError(f"modes: {label} of mode {mode + 1} is not a number")

    @property
    def n_modes(self) -> int:
        """Number of modes."""
        return int(self.freq.size)

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON, without the shapes."""
        return {
            "freq": self.freq.tolist(),
            "zeta": self.zeta.tolist(),
            "n_dof": len(self.dofs),
            "scaling": self.scaling,
        }

    def __repr__(self) -> str:
        listed = ", ".join(plain(f) for f in self.freq[:6]) + (", …" if self.n_modes > 6 else "")
        return f"ModeSet({self.n_modes} modes at {len(self.dofs)} DOFs: {listed} Hz; {self.scaling} scaling)"
