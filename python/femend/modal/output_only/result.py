"""What an output-only identification found, how well, and what to make of it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from femend.data import IdentifiedModes
from femend.data._arrays import frozen
from femend.modal.output_only.harmonics import Harmonic
from femend.modal.output_only.stabilisation import Stabilisation, modal_phase_collinearity
from femend.numerals import plain

__all__ = ["OutputOnlyModes"]


@dataclass(frozen=True, slots=True, eq=False)
class OutputOnlyModes:
    """Modes from responses alone.

    `modes` are poles and shapes (n_dof, n_modes), each shape with its largest component 1, unscaled because the
    force is unknown; `shape_sd` (n_dof, n_modes) the standard deviation of each component (nan where not known);
    `support` (n_modes,) the share of model orders a mode was found in (1 for EFDD); `flags` one text per mode,
    empty where nothing is to be said, else what is doubtful about it; `harmonic` (n_modes,) True where the peak is
    a rotating harmonic or is covered by one. `status` is "ok", "doubtful" (some mode has a flag, or a spectral peak
    gave no mode), or "no modes"; `advice` says what to do, `notes` what was found in the recording, `harmonics` the
    rotating ones among it. `stabilisation` holds all poles of all orders (None for EFDD).
    """

    recording: str
    method: str
    band: tuple[float, float]
    duration: float
    modes: IdentifiedModes
    shape_sd: NDArray[np.float64]
    support: NDArray[np.float64]
    flags: tuple[str, ...]
    harmonic: NDArray[np.bool_]
    status: str
    advice: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    harmonics: tuple[Harmonic, ...] = ()
    stabilisation: Stabilisation | None = None

    def __post_init__(self) -> None:
        for label, kind in (("shape_sd", np.float64), ("support", np.float64), ("harmonic", np.bool_)):
            object.__setattr__(self, label, frozen(getattr(self, label), kind))

    @property
    def freq(self) -> NDArray[np.float64]:
        """Natural frequencies in Hz, (n_modes,)."""
        return self.modes.freq

    @property
    def zeta(self) -> NDArray[np.float64]:
        """Damping ratios, (n_modes,)."""
        return self.modes.zeta

    @property
    def structural(self) -> IdentifiedModes:
        """The modes that are no rotating harmonic."""
        return self.modes.select(~self.harmonic)

    @property
    def mpc(self) -> NDArray[np.float64]:
        """Modal phase collinearity of each shape, 1 for a real one, (n_modes,)."""
        return modal_phase_collinearity(self.modes.shapes)

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON, without the shapes."""
        return {
            "recording": self.recording,
            "method": self.method,
            "band": list(self.band),
            "duration": self.duration,
            **self.modes.to_dict(),
            "mpc": self.mpc.tolist(),
            "support": self.support.tolist(),
            "flags": list(self.flags),
            "harmonic": self.harmonic.tolist(),
            "harmonics": [h.to_dict() for h in self.harmonics],
            "status": self.status,
            "advice": list(self.advice),
            "notes": list(self.notes),
        }

    def __repr__(self) -> str:
        listed = ", ".join(plain(f) for f in self.freq[:6]) + (", …" if self.modes.n_modes > 6 else "")
        return (
            f"OutputOnlyModes({self.recording!r}, {self.method}: {self.modes.n_modes} modes {listed} Hz; {self.status})"
        )
