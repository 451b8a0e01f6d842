"""Poles and participation fitted to the FRFs themselves, with their covariance.

pLSCF minimises an equation error in z; what it finds starts a least-squares fit of the modal model (7) to the FRFs
(El-Kafafy, Guillaume and Peeters, "Modal parameter estimation by combining stochastic and deterministic
frequency-domain approaches", MSSP 35 (2013) 52-68, the maximum-likelihood modal model). Shapes and residual terms are
linear and projected out (Golub and Pereyra 2003, with Kaufman's derivative), so that only poles and participation
remain; all sums over lines and outputs go through Gram matrices of a few columns per mode (8).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from femend.modal.lsfd import ModalFit, columns, stacked, unpack

__all__ = ["RefinedModes", "refine_modes", "shape_deviations"]

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]


@dataclass(frozen=True, slots=True, eq=False)
class RefinedModes:
    """`fit` with fitted poles; `pole_cov` (n_modes, 2, 2) covariance of Re(p), Im(p) in (rad/s)^2; `correlation`, the
    number of neighbouring lines whose residuals go together (>= 1, in the covariance already); `noise` (n_out,) rms of
    the residual per output; `converged`; `cost`, the weighted squares, and `freedom`, the number of real data. `cov` is
    that of all poles and participations together, as `_State.normal_equations` orders them, `scale` the factor by which
    the variance of a residual counts, for lines that go together and unknowns; `shape_sd` (n_out, n_modes) is that of
    `shape_deviations`, None as long as nobody asked."""

    fit: ModalFit
    pole_cov: Real
    correlation: float
    noise: Real
    converged: bool
    cost: float
    freedom: int
    cov: Real
    scale: float
    shape_sd: Real | None = None


def refine_modes(
    freq: Real,
    H: Complex,
    d: int,
    poles: Complex,
    participation: Complex,
    residuals: str = "both",
    *,
    noise: Real | None = None,
    centre: Complex | None = None,
    reach: Real | None = None,
    max_iter: int = 40,
    rounds: int = 3,
) -> RefinedModes:
    """Least-squares fit of the modal model to H, from `poles` (n_modes,) and `participation` (n_modes, n_ref).

    `freq` (n_freq,) in Hz without 0, `H` (n_freq, n_out, n_ref) of kind s^d times receptance, `residuals` as in
    `fit_residues`, `noise` (n_out,) standard deviations of the outputs (None: all alike at first). Outputs are
    weighted by `noise`, then by their residual, in `rounds`. Levenberg-Marquardt, at most `max_iter` steps a round.
    A pole stays within `reach` (n_modes,) in rad/s of its `centre` (n_modes,), None for no limit: a pole that runs off
    takes the place of another, or leaves for good.
    Raises nothing; a fit that did not settle says so in `converged`.
    """
    limit = _Limit(poles if centre is None else centre, np.full(poles.size, np.inf) if reach is None else reach)
    y = stacked(H)
    weight = 1.0 / (np.full(H.shape[1], float(np.sqrt(np.mean(y**2))) or 1.0) if noise is None else noise)
    state = _State(freq, d, residuals, y, poles, _normalised(participation))
    converged = True
    for _ in range(rounds):
        state, converged = _descend(state, weight, max_iter, limit)
        rms = np.sqrt(np.mean(state.residual() ** 2, axis=0))
        weight = 1.0 / np.maximum(rms, 1e-12 * np.sqrt(np.mean(y**2, axis=0)) + 1e-300)
    J2, _ = state.normal_equations(weight)
    n_lines = freq.size
    unknowns = state.n_columns + J2.shape[0] / max(1, H.shape[1])
    lost = max(1e-3, 1.0 - unknowns / (2 * n_lines * H.shape[2]))
    tau = _correlation(state.residual(), n_lines, H.shape[2])
    scale = tau / lost
    cov = np.linalg.pinv(J2, hermitian=True) * scale
    n = poles.size
    pole_cov = np.array([cov[np.ix_([r, n + r], [r, n + r])] for r in range(n)]).reshape(n, 2, 2)
    residual = state.residual()
    return RefinedModes(
        unpack(state.x, state.poles, state.participation, residuals),
        pole_cov,
        tau,
        np.sqrt(2.0 * np.mean(residual**2, axis=0)),
        converged,
        float(np.sum((residual * weight) ** 2)),
        y.size,
        cov,
        scale,
    )


def shape_deviations(freq: Real, H: Complex, d: int, fitted: RefinedModes, residuals: str = "both") -> Real:
    """Standard deviations (n_out, n_modes) of the real parts of `fitted`'s shapes, each turned to its principal axis as
    `femend.data.identified.real_shapes` does; `freq`, `H`, `d` and `residuals` are those that it was fitted to.

    The noise of an output goes through the columns to its coefficients. Poles and participations, with their
    covariance, move these too; both parts add, since the residual that tells the poles is orthogonal to the columns
    (Golub and Pereyra 2003). What multiplies all of a shape counts for nothing: no scale is compared. Raises nothing.
    """
    fit = fitted.fit
    n = fit.poles.size
    if not n:
        return np.zeros((H.shape[1], 0))
    state = _State(freq, d, residuals, stacked(H), fit.poles, fit.participation)
    inverse = np.linalg.pinv(state.Phi)[: 2 * n]
    turn = np.exp(-0.5j * np.angle(np.sum(fit.shapes**2, axis=0)))  # (n,)
    real = turn.real[:, None] * inverse[0::2] - turn.imag[:, None] * inverse[1::2]
    own = np.outer(0.5 * fitted.scale * fitted.noise**2, np.sum(real**2, axis=1))
    K, pair = state.steps(np.ones(H.shape[1]))
    B = (inverse @ state.derivatives()).reshape(2 * n, -1, 2)[:, pair]  # (2 n, unknowns, 2)
    values, vectors = np.linalg.eigh(fitted.cov)
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    moving = np.zeros(own.shape)
    for r in range(n):  # one mode after the other: all at once take n times the memory
        change = np.einsum("iu,iuo->io", B[2 * r] + 1j * B[2 * r + 1], K)
        psi = fit.shapes[:, r]
        whole = change @ psi.conj() / max(float(np.sum(np.abs(psi) ** 2)), 1e-300)
        g = (turn[r] * (change - np.outer(whole, psi))).real  # (unknowns, n_out)
        moving[:, r] = ((root.T @ g) ** 2).sum(axis=0)
    return np.asarray(np.sqrt(own + moving))


def _normalised(participation: Complex) -> Complex:
    """Rows with their largest component 1."""
    largest = participation[np.arange(participation.shape[0]), np.argmax(np.abs(participation), axis=1)]
    return participation / np.where(np.abs(largest) > 0, largest, 1.0)[:, None]


class _State:
    """The modal model at one set of poles and participation, its linear part solved."""

    def __init__(self, freq: Real, d: int, residuals: str, y: Real, poles: Complex, participation: Complex) -> None:
        self.freq, self.d, self.residuals, self.y = freq, d, residuals, y
        self.poles, self.participation = poles, participation
        Phi = columns(freq, d, poles, participation, residuals)
        size = np.linalg.norm(Phi, axis=0)
        self.Q, R = np.linalg.qr(Phi / size)
        self.n_columns = Phi.shape[1]
        self.x = np.linalg.lstsq(R, self.Q.T @ y, rcond=1e-12)[0] / size[:, None]
        self.Phi = Phi

    def residual(self) -> Real:
        return np.asarray(self.y - self.Phi @ self.x)

    def cost(self, weight: Real) -> float:
        return float(np.sum((self.residual() * weight) ** 2))

    def free(self) -> list[tuple[int, int]]:
        """Free components of the participation: all but the largest of each mode."""
        n_modes, n_ref = self.participation.shape
        fixed = np.argmax(np.abs(self.participation), axis=1)
        return [(r, j) for r in range(n_modes) for j in range(n_ref) if j != fixed[r]]

    def derivatives(self) -> Real:
        """Pairs of columns D (rows, 2 q): by the pole of each mode, then by each free participation component."""
        s = 2j * np.pi * self.freq
        scale = s**self.d
        g = scale[:, None] / (s[:, None] - self.poles)
        h = scale[:, None] / (s[:, None] - self.poles.conj())
        g2, h2 = g**2 / scale[:, None], h**2 / scale[:, None]
        free = self.free()
        n_modes, n_ref = self.participation.shape
        D = np.zeros((self.freq.size, n_ref, 2 * (n_modes + len(free))), dtype=np.complex128)
        a = g2[:, None, :] * self.participation.T[None]
        b = h2[:, None, :] * self.participation.conj().T[None]
        D[:, :, 0 : 2 * n_modes : 2] = a + b
        D[:, :, 1 : 2 * n_modes : 2] = 1j * (a - b)
        for q, (r, j) in enumerate(free, start=n_modes):
            D[:, j, 2 * q] = g[:, r] + h[:, r]
            D[:, j, 2 * q + 1] = 1j * (g[:, r] - h[:, r])
        flat = D.reshape(self.freq.size * n_ref, -1)
        return np.concatenate([flat.real, flat.imag])

    def normal_equations(self, weight: Real) -> tuple[Real, Real]:
        """J^T J and J^T r of the outputs weighted by `weight` (n_out,), unknowns: Re(p), Im(p), Re(l), Im(l) (8)."""
        D = self.derivatives()
        D -= self.Q @ (self.Q.T @ D)
        gram, moment = D.T @ D, D.T @ (self.residual() * weight)
        if not self.poles.size:
            return np.zeros((0, 0)), np.zeros(0)
        K, pair = self.steps(weight)
        n_q = D.shape[1] // 2
        KK = np.einsum("iuo,jvo->ijuv", K, K, optimize=True)
        G = gram.reshape(n_q, 2, n_q, 2).transpose(0, 2, 1, 3)[np.ix_(pair, pair)]
        return np.sum(KK * G, axis=(2, 3)), np.einsum("iuo,iuo->i", K, moment.reshape(n_q, 2, -1)[pair])

    def steps(self, weight: Real) -> tuple[Real, NDArray[np.int64]]:
        """What a step in each unknown, Re(p), Im(p), Re(l), Im(l), does to outputs weighted by `weight` (n_out,): the
        factors K (n, 2, n_out) on a pair of columns of `derivatives`, and which pair that is, (n,)."""
        n_modes = self.poles.size
        modes = np.concatenate([np.arange(n_modes), [r for r, _ in self.free()]]).astype(int)
        n_q = modes.size
        a, b = self.x[2 * modes] * weight, self.x[2 * modes + 1] * weight  # (n_q, n_out)
        # c = a + i b multiplies the first column of a pair by a and the second by b; a step along i turns c into i c
        K = np.stack([np.stack([a, b]), np.stack([-b, a])])  # (part, column of the pair, q, n_out)
        K = K.transpose(0, 2, 1, 3).reshape(2 * n_q, 2, -1)  # unknown: all real parts, then all imaginary parts
        pair = np.concatenate([np.arange(n_q), np.arange(n_q)])
        order = np.concatenate(
            [np.arange(n_modes), n_q + np.arange(n_modes), np.arange(n_modes, n_q), n_q + np.arange(n_modes, n_q)]
        )
        return K[order], pair[order]

    def moved(self, step: Real) -> _State:
        n_modes = self.poles.size
        free = self.free()
        poles = self.poles + step[:n_modes] + 1j * step[n_modes : 2 * n_modes]
        participation = self.participation.copy()
        rest = step[2 * n_modes :]
        for q, (r, j) in enumerate(free):
            participation[r, j] += rest[q] + 1j * rest[len(free) + q]
        return _State(self.freq, self.d, self.residuals, self.y, poles, participation)


@dataclass(frozen=True, slots=True, eq=False)
class _Limit:
    """Discs in which the poles stay."""

    centre: Complex
    reach: Real

    def held(self, poles: Complex, step: Real) -> NDArray[np.bool_]:
        """Poles at their rim that the step would take further out."""
        n = poles.size
        out = poles - self.centre
        outwards = (out.conj() * (step[:n] + 1j * step[n : 2 * n])).real > 0
        return np.asarray((np.abs(out) > 0.999 * self.reach) & outwards)

    def inside(self, poles: Complex, step: Real) -> Real:
        """The step with each pole stopped at its rim, and shortened so that none moves by more than half its distance
        from the imaginary axis: beyond it the FRFs around the pole no longer depend on it linearly."""
        n = poles.size
        moved = np.abs(step[:n] + 1j * step[n : 2 * n])
        step = step * min(1.0, float(np.min(0.5 * np.abs(poles.real) / np.maximum(moved, 1e-300))))
        out = poles + step[:n] + 1j * step[n : 2 * n] - self.centre
        far = np.abs(out)
        back = np.where(far > self.reach, self.reach / np.maximum(far, 1e-300), 1.0)
        stopped = self.centre + out * np.where(np.isfinite(back), back, 1.0) - poles
        return np.concatenate([stopped.real, stopped.imag, step[2 * n :]])


def _descend(state: _State, weight: Real, max_iter: int, limit: _Limit) -> tuple[_State, bool]:
    """Levenberg-Marquardt from `state`; the second value tells whether it settled."""
    n = state.poles.size
    if not n:
        return state, True
    mu, cost = 1e-4, state.cost(weight)
    for _ in range(max_iter):
        J2, gradient = state.normal_equations(weight)
        diagonal = np.diag(J2).copy()
        diagonal[diagonal <= 0] = 1.0
        improved = False
        for _ in range(8):
            step = _damped_step(J2, gradient, mu * diagonal, np.zeros(n, dtype=bool))
            held = limit.held(state.poles, step)
            if held.any():
                step = _damped_step(J2, gradient, mu * diagonal, held)
            trial = state.moved(limit.inside(state.poles, step))
            if np.all(trial.poles.real < 0) and (new := trial.cost(weight)) < cost:
                improved = True
                break
            mu *= 10.0
        if not improved:  # at the floor of rounding, or stuck: the gradient tells
            return state, bool(gradient @ step < 1e-3 * cost)
        gain, cost, state, mu = cost - new, new, trial, max(mu / 10.0, 1e-12)
        if gain <= 1e-8 * cost:
            return state, True
    return state, False


def _damped_step(J2: Real, gradient: Real, damping: Real, held: NDArray[np.bool_]) -> Real:
    """(J^T J + damping)^-1 J^T r with the poles `held` where they are."""
    free = np.ones(gradient.size, dtype=bool)
    free[: held.size] = free[held.size : 2 * held.size] = ~held
    step = np.zeros(gradient.size)
    A = (J2 + np.diag(damping))[np.ix_(free, free)]
    step[free] = np.linalg.solve(A, gradient[free])
    return step


def _correlation(residual: Real, n_lines: int, n_ref: int) -> float:
    """1 + 2 sum of the residual's autocorrelation over lines, to its first negative value; at least 1.

    Noise of neighbouring lines is independent; leakage, windows and modes that are not in the model make residuals go
    together, and the squares of fewer independent lines count.
    """
    e = residual[: n_lines * n_ref] + 1j * residual[n_lines * n_ref :]
    e = e.reshape(n_lines, -1)
    spectrum = np.sum(np.abs(np.fft.fft(e, 2 * n_lines, axis=0)) ** 2, axis=1)
    auto = np.fft.ifft(spectrum).real[: max(2, n_lines // 4)]
    if auto[0] <= 0:
        return 1.0
    rho = auto / auto[0]
    negative = np.nonzero(rho <= 0)[0]
    return float(max(1.0, 1.0 + 2.0 * np.sum(rho[1 : negative[0] if negative.size else rho.size])))
