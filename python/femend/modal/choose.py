"""Which of the fitted modes stay: each must earn its unknowns and be known well enough."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from femend.modal.indicators import lines_near
from femend.modal.lsfd import columns, stacked
from femend.modal.refine import RefinedModes, refine_modes
from femend.numerals import plain

__all__ = ["DroppedMode", "choose_modes", "pole_deviations"]

# Ten times the squares is three times the amplitude; see `choose_modes`.
MIN_SHARPNESS = 10.0
RIM = 0.99  # of a disc's radius: here a pole counts as stopped

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
    """Fits the modes among the candidates `poles` (n,) with `participation` (n, n_ref) that H (n_freq, n_out, n_ref)
    asks for.

    Forward: the candidates that lower the squares most, one per neighbourhood (poles nearer than twice the sum of their
    distances from the imaginary axis), join while they earn their unknowns by the Bayesian information criterion; all
    poles are fitted again after each round, each inside a disc around the pole of pLSCF. Backward, one at a time, that
    with the least `sharpness` first and fitting again, a mode goes that

    - left the band `freq` or has damping above `max_zeta`,
    - has a frequency less certain than its half-power bandwidth, or a damping less certain than itself,
    - runs into its neighbour: poles nearer than three standard deviations, with the same participation,
    - does not earn its unknowns on the lines around it, by the same criterion,
    - has a `sharpness` below 10 where the fit leaves more than twice the squares of `noise`: within its half-power band
      no output needs it by ten times what is left with it, and what is left is not noise, so that a neighbour's tail or
      a structure that is not quite linear could stand for it;

    and when all others pass, one that stopped at the rim of its disc: the two estimators do not agree that it is there.

    `d`, `residuals` and `noise` (n_out,) as in `refine_modes`. Raises nothing.
    """
    joined, fitted = _forward(freq, H, d, poles, participation, residuals, noise)
    fit, used = fitted.fit, np.array(joined, dtype=np.int64)
    left: set[int] = set()  # candidates a pole went away from since the last mode was dropped
    dropped: list[DroppedMode] = []
    while True:
        at = poles[used]
        fitted = refine_modes(
            freq, H, d, fit.poles, fit.participation, residuals, noise=noise, centre=at, reach=_reach(at)
        )
        fit = fitted.fit
        if _recentred(fit.poles, used, poles, left):
            continue
        worst = _worst(freq, H, d, fitted, at, residuals, noise, max_zeta)
        if worst is None:
            break
        row, reason = worst
        dropped.append(_dropped(fit.poles[row], reason))
        used, left = np.delete(used, row), set()
        fit = replace(fit, poles=np.delete(fit.poles, row), participation=np.delete(fit.participation, row, axis=0))
    never = np.setdiff1d(np.arange(poles.size), joined)
    dropped += [_dropped(poles[c], "lowers the squares too little for its unknowns") for c in never]
    return fitted, tuple(dropped)


def _recentred(fitted: Complex, used: NDArray[np.int64], candidates: Complex, left: set[int]) -> bool:
    """Gives a pole stopped at the rim of its candidate's disc, but within that of another that is not in use, the other
    one in `used`: pLSCF does have a pole where the fit wants it. The first one is `left`, so that this ends."""
    reach = _reach(candidates)
    for r in np.nonzero(np.abs(fitted - candidates[used]) > RIM * reach[used])[0]:
        apart = np.abs(candidates - fitted[r]) / reach
        apart[used] = apart[sorted(left)] = np.inf
        if apart.min() < RIM:
            left.add(int(used[r]))
            used[r] = int(np.argmin(apart))
            return True
    return False


def _dropped(pole: complex, reason: str) -> DroppedMode:
    return DroppedMode(float(abs(pole) / (2 * np.pi)), float(-pole.real / abs(pole)), reason)


def _reach(centre: Complex) -> Real:
    """How far the fit may take a pole from where pLSCF has it, rad/s: the half-power bandwidth, for pLSCF finds poles
    that noise nearly hides with too little damping. At least a tenth of a percent of the frequency, as it scatters."""
    return np.asarray(np.maximum(2.0 * np.abs(centre.real), 1e-3 * np.abs(centre)))


def _forward(
    freq: Real, H: Complex, d: int, poles: Complex, participation: Complex, residuals: str, noise: Real
) -> tuple[list[int], RefinedModes]:
    """Candidates in the order in which they joined, and the modes fitted to them."""
    n_out, n_ref = H.shape[1:]
    y = stacked(H / noise[:, None])
    cost = 2 * (n_out + n_ref) * np.log(2 * H.size)
    joined: list[int] = []
    fitted = refine_modes(freq, H, d, poles[:0], participation[:0], residuals, noise=noise)
    while True:
        Q = np.linalg.qr(_unit(columns(freq, d, fitted.fit.poles, fitted.fit.participation, residuals)))[0]
        left = y - Q @ (Q.T @ y)
        base = max(float(np.sum(left**2)), 1e-300)
        gains = np.array([_gain(freq, d, poles[c], participation[c], Q, left) for c in range(poles.size)])
        gains[joined] = 0.0
        share = np.minimum(gains / base, 1.0 - 1e-15)
        new: list[int] = []
        for c in np.argsort(-share):
            if -2 * H.size * np.log1p(-share[c]) < cost:
                break
            reach = 2.0 * (abs(poles[c].real) + np.abs(poles[new].real))
            if np.all(np.abs(poles[new] - poles[c]) > reach):
                new.append(int(c))
        if not new:
            return joined, fitted
        joined += new
        fitted = refine_modes(
            freq,
            H,
            d,
            np.concatenate([fitted.fit.poles, poles[new]]),
            np.concatenate([fitted.fit.participation, participation[new]]),
            residuals,
            noise=noise,
            centre=poles[joined],
            reach=_reach(poles[joined]),
            max_iter=4,
            rounds=1,
        )


def _unit(Phi: Real) -> Real:
    return np.asarray(Phi / np.linalg.norm(Phi, axis=0))


def _gain(freq: Real, d: int, pole: complex, participation: Complex, Q: Real, left: Real) -> float:
    """Squares of `left` that a mode takes away which is not in the span of Q yet."""
    Phi = _unit(columns(freq, d, np.array([pole]), participation[None], "none"))
    Phi = Phi - Q @ (Q.T @ Phi)
    q, r = np.linalg.qr(Phi)
    # what is left of the columns after the projection must be more than rounding
    keep = np.abs(np.diag(r)) > 1e-6
    return float(np.sum((q[:, keep].T @ left) ** 2))


def _worst(
    freq: Real,
    H: Complex,
    d: int,
    fitted: RefinedModes,
    at: Complex,
    residuals: str,
    noise: Real,
    max_zeta: float,
) -> tuple[int, str] | None:
    """The mode that fails a criterion and is needed least."""
    poles = fitted.fit.poles
    if not poles.size:
        return None
    gain, cost, sharpness, excess = _worth(freq, H, d, fitted, residuals, noise)
    order = np.argsort(sharpness)
    for r in order:
        reason = _reason(int(r), freq, fitted, max_zeta)
        if not reason and gain[r] < cost[r]:
            reason = f"lowers the squares too little for its unknowns (gain {gain[r]:.0f}, cost {cost[r]:.0f})"
        if not reason and sharpness[r] < MIN_SHARPNESS and excess[r] > 2.0:
            reason = f"explains only {sharpness[r]:.1f} times what the fit leaves in its half-power band"
        if reason:
            return int(r), reason
    for r in order:
        if abs(poles[r] - at[r]) > RIM * _reach(at)[r]:
            f, zeta = abs(at[r]) / (2 * np.pi), -at[r].real / abs(at[r])
            return int(r), (
                f"not found twice: pLSCF has it at {plain(f)} Hz with damping {plain(zeta, 2)}, the fit moves it away "
                f"to {plain(abs(poles[r]) / (2 * np.pi))} Hz and {plain(-poles[r].real / abs(poles[r]), 2)}, or further"
            )
    return None


def _reason(r: int, freq: Real, fitted: RefinedModes, max_zeta: float) -> str:
    """Why mode r cannot stay, or nothing."""
    poles = fitted.fit.poles
    f, zeta = float(abs(poles[r]) / (2 * np.pi)), float(-poles[r].real / abs(poles[r]))
    if zeta > max_zeta or not freq[0] <= f <= freq[-1]:
        return f"the fit moves it to {plain(f)} Hz with damping {plain(zeta, 3)}"
    f_sd, z_sd = (float(v[0]) for v in pole_deviations(poles[[r]], fitted.pole_cov[[r]]))
    if f_sd > 2 * zeta * f or z_sd > zeta:
        return f"not certain: {plain(f)} ± {plain(f_sd, 2)} Hz, damping {plain(zeta, 2)} ± {plain(z_sd, 2)}"
    other = _twin(r, fitted)
    return f"not told apart from its neighbour at {plain(other)} Hz" if other else ""


def _twin(r: int, fitted: RefinedModes) -> float:
    """Frequency of a better known mode with the same participation within three standard deviations of mode r, or 0."""
    poles, cov = fitted.fit.poles, fitted.pole_cov
    unit = fitted.fit.participation / np.linalg.norm(fitted.fit.participation, axis=1, keepdims=True)
    for q in range(poles.size):
        if q == r or np.trace(cov[q]) > np.trace(cov[r]) or abs(np.vdot(unit[r], unit[q])) ** 2 < 0.95:
            continue
        apart = np.array([(poles[r] - poles[q]).real, (poles[r] - poles[q]).imag])
        if apart @ np.linalg.solve(cov[r] + cov[q] + 1e-30 * np.eye(2), apart) < 9.0:
            return float(abs(poles[q]) / (2 * np.pi))
    return 0.0


def _worth(
    freq: Real, H: Complex, d: int, fitted: RefinedModes, residuals: str, noise: Real
) -> tuple[Real, Real, Real, Real]:
    """What each mode (n_modes,) lowers -2 ln L by; what its unknowns cost by the Bayesian information criterion; and
    its sharpness: the most that any output's squares in the half-power band rise without it, over those with it; and
    the excess there: the squares that the fit leaves over those of `noise` (n_out,).

    Likelihood and count of data are those of the lines within f (1 ± 3 zeta), at least nine: elsewhere the misfit of
    stronger modes is larger than the whole of a weak one.
    """
    poles, participation = fitted.fit.poles, fitted.fit.participation
    n_out, n_ref = H.shape[1:]
    y = stacked(H / np.where(fitted.noise > 0, fitted.noise, np.inf)[:, None])
    Q, R = np.linalg.qr(_unit(columns(freq, d, poles, participation, residuals)))
    left = (y - Q @ (Q.T @ y)).reshape(2, freq.size, n_ref, n_out)
    # Q R^-T is dual to the columns: its pair of a mode is what that mode has and all the others have not.
    dual = np.linalg.lstsq(R, Q.T, rcond=1e-12)[0].T
    gain, cost, sharpness, excess = (np.zeros(poles.size) for _ in range(4))
    for r in range(poles.size):
        own = np.linalg.qr(dual[:, 2 * r : 2 * r + 2])[0]
        amplitude = own.T @ y

        def squares(lines: NDArray[np.int64], own: Real = own, amplitude: Real = amplitude) -> tuple[Real, Real]:
            """Of the outputs (n_out,) on some lines, with the mode and without it."""
            more = own.reshape(2, freq.size, n_ref, 2)[:, lines] @ amplitude
            return np.sum(left[:, lines] ** 2, axis=(0, 1, 2)), np.sum((left[:, lines] + more) ** 2, axis=(0, 1, 2))

        around = lines_near(freq, poles[r], 3.0, 9)
        base, without = squares(around)
        n_data = 2 * around.size * n_out * n_ref
        # -2 ln L = N ln(squares) at unknown noise; a mode brings its pole, its participation and its shape
        gain[r] = n_data * np.log(max(1.0, float(without.sum()) / max(float(base.sum()), 1e-300)))
        cost[r] = 2 * (n_out + n_ref) * np.log(n_data)
        inside = lines_near(freq, poles[r], 1.0, 3)
        base, without = squares(inside)
        excess[r] = np.mean(base * (fitted.noise / noise) ** 2) / (inside.size * n_ref)
        sharpness[r] = max(0.0, float(np.max(without / np.maximum(base, 1e-300) - 1.0)))
    return gain, cost, sharpness, excess
