"""What a modal test gives."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from femend.data import FRF, IdentifiedModes
from femend.dof import Dof
from femend.modal.checks import SensorCheck
from femend.modal.choose import DroppedMode
from femend.modal.lsfd import ModalFit, derivative_power, synthesise
from femend.modal.scaling import DrivingPoint
from femend.modal.stabilisation import Stabilisation
from femend.numerals import plain

__all__ = ["ModalTest"]

Real = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class ModalTest:
    """Modes identified from FRFs, with everything that speaks for and against them.

    `modes`; `measured`, the lines of the band that were used, and `resynthesised`, the modal model (7) on them, both as
    FRFs of the same channels; `error`, the share |H - model| / |H| over all, `frf_error` (n_out, n_in) per FRF and
    `line_error` (n_freq,) per line; `noise_share`, the share that the scatter from line to line explains.
    `roved` says which side the shapes live on: "outputs" (fixed inputs are the references) or "inputs" (roving hammer:
    fixed outputs are the references, by reciprocity). `lower`, `upper` (n_dof, n_ref) are the residual terms of the
    receptance. Per mode (n_modes,): `modal_mass` for the largest component 1 (nan without a driving point),
    `mass_sd_share`, the relative standard deviation of that mass from noise at the driving points, `mpc`, `mpd` in
    degrees, and `contribution`, the mode's share of |H|^2 within its half-power band.
    `shape_sd` (n_dof, n_modes) are the standard deviations of the shapes' real parts, once turned to real, in the size
    of `modes.shapes`: noise, and what poles are off by; what multiplies a whole shape is not in them.
    `stabilisation` is the diagram; `dropped` are stable poles that were not kept, `driving_points` and `checks` what
    was looked at. `status` is "ok", "doubtful" or "no modes"; `advice` says what to look at.
    """

    modes: IdentifiedModes
    measured: FRF
    resynthesised: FRF
    error: float
    frf_error: Real
    line_error: Real
    noise_share: float
    roved: str
    lower: Real
    upper: Real
    modal_mass: Real
    mass_sd_share: Real
    mpc: Real
    mpd: Real
    contribution: Real
    shape_sd: Real
    stabilisation: Stabilisation
    dropped: tuple[DroppedMode, ...]
    driving_points: tuple[DrivingPoint, ...]
    checks: tuple[SensorCheck, ...]
    status: str
    advice: tuple[str, ...]

    @property
    def responses(self) -> tuple[Dof, ...]:
        """DOFs of the shapes."""
        return self.modes.dofs

    def synthesise(self, freq: Real) -> NDArray[np.complex128]:
        """FRFs (n_freq, n_out, n_in) of the modal model at lines `freq` in Hz (none 0), in the kind that was measured.

        Raises nothing; outside the band the residual terms extrapolate.
        """
        modes = self.modes
        assert modes.participation is not None
        fit = ModalFit(modes.poles, modes.shapes, modes.participation, self.lower, self.upper)
        H = synthesise(np.asarray(freq, dtype=np.float64), derivative_power(self.measured.kind), fit)
        return H if self.roved == "outputs" else H.transpose(0, 2, 1)

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON, without the FRFs; what is not known is None."""
        known = {
            label: [float(v) if np.isfinite(v) else None for v in getattr(self, label)]
            for label in ("modal_mass", "mass_sd_share", "mpc", "mpd", "contribution")
        }
        return {
            "recording": self.measured.name,
            "band": [float(self.measured.freq[0]), float(self.measured.freq[-1])],
            "modes": self.modes.to_dict(),
            "roved": self.roved,
            **known,
            "error": self.error,
            "noise_share": self.noise_share,
            "driving_points": [str(p.dof) for p in self.driving_points],
            "dropped": [{"freq": d.freq, "zeta": d.zeta, "reason": d.reason} for d in self.dropped],
            "checks": [c.to_dict() for c in self.checks],
            "status": self.status,
            "advice": list(self.advice),
        }

    def table(self) -> str:
        """The modes as text, one line each: frequency and damping with deviations, MPC, modal mass."""
        m = self.modes
        lines = ["mode   f [Hz]      sd        zeta [%]  sd       MPC    mass (largest component 1)"]
        for r in range(m.n_modes):
            lines.append(
                f"{r + 1:4d}  {m.freq[r]:9.4f}  {_text(m.freq_sd, r):>8}  {100 * m.zeta[r]:8.3f}  "
                f"{_text(m.zeta_sd, r, 100.0):>7}  {self.mpc[r]:5.3f}  {_text(self.modal_mass, r)}"
            )
        return "\n".join(lines)

    def __repr__(self) -> str:
        return (
            f"ModalTest({self.measured.name!r}: {self.modes.n_modes} modes {plain(self.measured.freq[0])} to "
            f"{plain(self.measured.freq[-1])} Hz, resynthesis error {plain(100 * self.error, 2)} %, {self.status})"
        )


def _text(values: Real | None, r: int, factor: float = 1.0) -> str:
    return "-" if values is None or not np.isfinite(values[r]) else plain(factor * values[r], 2)
