"""Which of the fitted modes stay: each must earn its unknowns and be known well enough."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from femend.modal.lsfd import fit_residues, synthesise
from femend.modal.refine import RefinedModes, refine_modes

__all__ = ["DroppedMode", "choose_modes", "pole_deviations"]

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]


@dataclass(frozen=True, slots=True)
class DroppedMode:
    """A stable pole that was not kept: `freq` in Hz, `zeta`, and the `reason`."""

    freq: float
    zeta: float
    reason: str


def pole_deviations(poles: Complex, pole_cov: Real) -> tuple[Real, Real]:
    """Standard deviations of frequency (Hz) and damping ratio (n_modes,) from `poles` and their covariance
    `pole_cov` (n_modes, 2, 2) of real and imaginary part, to first order. Raises nothing."""
    size = np.abs(poles)
    u, v = poles.real / size, poles.imag / size
    by_freq = np.stack([u, v], axis=1) / (2.0 * np.pi)
    by_zeta = np.stack([-(v**2), u * v], axis=1) / size[:, None]
    return (
        np.sqrt(np.maximum(np.einsum("ri,rij,rj->r", by_freq, pole_cov, by_freq), 0.0)),
        np.sqrt(np.maximum(np.einsum("ri,rij,rj->r", by_zeta, pole_cov, by_zeta), 0.0)),
    )


def choose_modes(
    freq: Real,
    H: Complex,
    d: int,
    poles: Complex,
    participation: Complex,
    residuals: str,
    noise: Real,
    max_zeta: float,
) -> tuple[RefinedModes, tuple[DroppedMode, ...]]:
    """Fits the modes (n_modes,) of `poles` with `participation` (n_modes, n_ref) to H (n_freq, n_out, n_ref), and
    drops, one at a time and fitting again, a mode that

    - left the band `freq` or has damping below 0 or above `max_zeta`,
    - has a frequency less certain than its half-power bandwidth, or a damping less certain than itself,
    - runs into its neighbour: poles nearer than three standard deviations, with the same participation,
    - lowers the squares by less than its unknowns cost by the Bayesian information criterion, counting as many
      independent lines as the residual's correlation leaves.

    `d`, `residuals` and `noise` (n_out,) as in `refine_modes`. Raises nothing.
    """
    dropped: list[DroppedMode] = []
    while True:
        fitted = refine_modes(freq, H, d, poles, participation, residuals, noise=noise)
        worst = _worst(freq, H, d, fitted, residuals, max_zeta)
        if worst is None:
            return fitted, tuple(dropped)
        row, reason = worst
        at = fitted.fit.poles[row]
        dropped.append(DroppedMode(abs(at) / (2 * np.pi), -at.real / abs(at), reason))
        keep = np.arange(fitted.fit.poles.size) != row
        poles, participation = fitted.fit.poles[keep], fitted.fit.participation[keep]


def _worst(
    freq: Real, H: Complex, d: int, fitted: RefinedModes, residuals: str, max_zeta: float
) -> tuple[int, str] | None:
    poles, part = fitted.fit.poles, fitted.fit.participation
    if not poles.size:
        return None
    f, zeta = np.abs(poles) / (2 * np.pi), -poles.real / np.abs(poles)
    outside = np.maximum(np.maximum(zeta - max_zeta, -zeta), np.maximum(freq[0] / f - 1, f / freq[-1] - 1))
    row = int(np.argmax(outside))
    if outside[row] > 0:
        return row, f"the fit moves it to {f[row]:.4g} Hz with damping {zeta[row]:.3g}"
    f_sd, z_sd = pole_deviations(poles, fitted.pole_cov)
    vague = np.maximum(f_sd / (2 * zeta * f), z_sd / zeta)
    row = int(np.argmax(vague))
    if vague[row] > 1.0:
        return row, f"not certain: {f[row]:.4g} ± {f_sd[row]:.2g} Hz, damping {zeta[row]:.2g} ± {z_sd[row]:.2g}"
    row, close = _twin(poles, part, fitted.pole_cov)
    if close:
        return row, f"not told apart from its neighbour at {close:.4g} Hz"
    return _least_worth(freq, H, d, fitted, residuals)


def _twin(poles: Complex, part: Complex, cov: Real) -> tuple[int, float]:
    unit = part / np.linalg.norm(part, axis=1, keepdims=True)
    for r in np.argsort(np.abs(poles)):
        for q in range(poles.size):
            if q == r or abs(np.vdot(unit[r], unit[q])) ** 2 < 0.95:
                continue
            apart = np.array([(poles[r] - poles[q]).real, (poles[r] - poles[q]).imag])
            if apart @ np.linalg.solve(cov[r] + cov[q] + 1e-30 * np.eye(2), apart) < 9.0:
                less = r if np.trace(cov[r]) >= np.trace(cov[q]) else q
                other = q if less == r else r
                return int(less), float(abs(poles[other]) / (2 * np.pi))
    return 0, 0.0


def _least_worth(freq: Real, H: Complex, d: int, fitted: RefinedModes, residuals: str) -> tuple[int, str] | None:
    fit = fitted.fit
    weight = np.where(fitted.noise > 0, fitted.noise, np.inf)[None, :, None]

    def squares(keep: NDArray[np.bool_]) -> float:
        part = fit_residues(freq, H, d, fit.poles[keep], fit.participation[keep], residuals)
        return float(np.sum(np.abs((H - synthesise(freq, d, part)) / weight) ** 2))

    everything = np.ones(fit.poles.size, dtype=bool)
    base = squares(everything)
    gains = np.empty(fit.poles.size)
    for r in range(fit.poles.size):
        keep = everything.copy()
        keep[r] = False
        gains[r] = squares(keep) - base
    n_out, n_ref = H.shape[1:]
    independent = 2 * H.size / fitted.correlation
    # -2 ln L = N ln(squares) at unknown noise; a mode brings its pole, its participation and its shape
    gain = independent * np.log1p(gains / max(base, 1e-300))
    cost = (2 * n_out + 2 * n_ref) * np.log(independent)
    row = int(np.argmin(gain))
    if gain[row] < cost:
        return row, f"lowers the squares too little for its unknowns (gain {gain[row]:.0f}, cost {cost:.0f})"
    return None
