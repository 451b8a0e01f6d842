"""Complex modes of small systems from the dense eigenproblem, each made exact on both sides by inverse iteration."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from femend.analysis.conservative import groups
from femend.analysis.turning import TurningSystem
from femend.errors import TooFewModesError

__all__ = ["LARGEST", "dense_modes", "refined_modes"]

Complex = NDArray[np.complex128]
Pencil = tuple[Any, Any, Any]  # M, C + W G and K + ... at a speed, sparse

LARGEST = 200  # DOFs up to which the eigenproblem of twice the size takes a fraction of a second
REAL = 1e-7  # |Im| of a pole beside it up to which it is overdamped, as in the core
# mu = 1 / omega^2 below this beside the largest is rounding: directions without mass get that much of it for the first
# estimate, and poles beyond half of the frequency that comes of it are none of the system's
LOST = 1e-15
# shares within which poles are iterated together: while they are rough, then those that coincide; and how often
TOGETHER, ROUNDS = (1e-4, 1e-8), 2
BESIDE = 1e-10  # how far beside a pole the dynamic stiffness is factorised, a share


def dense_modes(system: TurningSystem, speed: float, n_modes: int | None, f_max: float | None) -> dict[str, Any] | None:
    """What the core's `modes` gives at `speed` (rad/s), from the whole eigenproblem; None for a `system` whose
    stiffness at rest is not positive definite.

    In coordinates of the modes at rest, scaled by their frequencies, the state matrix of an undamped rotor is skew
    and its poles those of a Hermitian matrix, whatever the range of the frequencies (Meirovitch, AIAA J. 12 (1974)
    1337). Each pole is then refined by inverse iteration on both sides with D(p), in blocks where poles are close,
    and by the quotient y^T D(p) psi / y^T D'(p) psi (Lancaster, Numer. Math. 3 (1961) 69). Raises ValueError where
    fewer modes oscillate than asked for.
    """
    pencil = _pencil(system, speed)
    found = _all_poles(system, pencil)
    if found is None:
        return None
    poles, right, left = found
    kinds, at = _selected(poles, system.D is not None, n_modes, f_max)
    poles, right, left = _refined(pencil, poles[at], right[:, at], left[:, at])
    poles = np.where(kinds == "overdamped", poles.real, poles)
    return _told(pencil, kinds, poles, right, left)


def _all_poles(system: TurningSystem, pencil: Pencil) -> tuple[Complex, Complex, Complex] | None:
    """Finite poles (m,), right and left vectors (n, m), as good as one eigensolution gives them."""
    import scipy.linalg

    M, C, K = (a.toarray() for a in pencil)
    try:
        mu, phi = scipy.linalg.eigh(M, system.K.toarray())
    except np.linalg.LinAlgError:
        return None
    omega = 1.0 / np.sqrt(np.maximum(mu, LOST * mu[-1]))
    # z = (omega q, q') of q scaled to mass 1; phi is scaled to stiffness 1
    damping = phi.T @ C @ phi * omega * omega[:, None]
    stiffness = phi.T @ (K - system.K.toarray()) @ phi * omega[:, None] + np.diag(omega)
    A = np.block([[np.zeros_like(damping), np.diag(omega)], [-stiffness, -damping]])
    skew = np.max(np.abs(A + A.T)) <= 1e-14 * np.max(np.abs(A)) and not np.iscomplexobj(A)
    skew = skew and system.C is None and system.N is None and system.S is None
    if skew:
        freq, z = scipy.linalg.eigh(-0.5j * (A - A.T))
        poles = 1j * freq
    else:
        poles, z = scipy.linalg.eig(A)
    there = np.abs(poles) < 0.5 / np.sqrt(LOST * mu[-1])
    upper = phi @ z[: omega.size, there]
    return poles[there], upper, upper.conj()


def _selected(
    poles: Complex, structural: bool, n_modes: int | None, f_max: float | None
) -> tuple[NDArray[np.object_], NDArray[np.int64]]:
    """Kinds and places of the wanted poles: oscillatory by |pole|, then overdamped up to the last of them, with
    structural damping the mirrored ones."""
    size = np.abs(poles)
    real = np.abs(poles.imag) <= REAL * size
    by_size = np.argsort(size, kind="stable")

    def some(those: NDArray[np.bool_]) -> NDArray[np.int64]:
        return by_size[those[by_size]]

    above = some(~real & (poles.imag > 0))
    if f_max is None and n_modes is not None and above.size < n_modes:
        raise TooFewModesError(
            f"n_modes = {n_modes}, but the model has only {above.size} oscillatory modes at this speed "
            f"({int(real.sum())} poles are overdamped); ask for fewer, or pass f_max",
            available=int(above.size),
        )
    limit = np.inf if f_max is None else 2 * np.pi * f_max
    above = above[:n_modes]
    above = above[size[above] <= limit]
    if structural:
        kind, more = "mirrored", some(~real & (poles.imag < 0))[: above.size]
    else:
        reach = size[above[-1]] if above.size and f_max is None else limit
        kind, more = "overdamped", some(real & (size <= reach))
    kinds = np.array(["oscillatory"] * above.size + [kind] * more.size, dtype=object)
    return kinds, np.concatenate([above, more])


def refined_modes(system: TurningSystem, speed: float, found: dict[str, Any]) -> dict[str, Any]:
    """What the core `found` at `speed` (rad/s) with oscillatory modes made exact on both sides, as in `dense_modes`.

    For systems that fill the core's space: it has nothing to add there to left vectors that rounding took.
    """
    at = np.flatnonzero(np.array(found["kinds"], dtype=object) == "oscillatory")
    pencil = _pencil(system, speed)
    right = found["right"][:, at]
    told = _told(pencil, found["kinds"], *_refined(pencil, found["poles"][at], right, right.conj()))
    out = dict(found)
    for name in ("poles", "right", "left", "modal_a", "residual", "residual_left", "condition"):
        out[name] = np.array(found[name])
        out[name][..., at] = told[name]
    return out


def _pencil(system: TurningSystem, speed: float) -> Pencil:
    return (system.M, system.matrix("damping", speed), system.matrix("stiffness", speed))


def _refined(pencil: Pencil, poles: Complex, right: Complex, left: Complex) -> tuple[Complex, Complex, Complex]:
    """Poles and vectors of both sides after inverse iteration; left ones bi-orthogonal where poles coincide."""
    from scipy.sparse import diags_array
    from scipy.sparse.linalg import splu

    # rows of one size: displacements and rotations, stiff and soft ones
    size = np.abs(pencil[2].diagonal())
    scale = 1.0 / np.sqrt(np.where(size > 0, size, 1.0))
    M, C, K = (diags_array(scale) @ a @ diags_array(scale) for a in pencil)
    poles, right, left = poles.copy(), right / scale[:, None], left / scale[:, None]
    for share in TOGETHER:
        for group in groups(poles, share):
            p = complex(poles[group].mean())
            slope = 2 * p * M + C
            shifted = p * (1 + BESIDE)
            x, y = right[:, group], left[:, group]
            try:
                factor: Any = splu((shifted**2 * M + shifted * C + K).tocsc())
                for _ in range(ROUNDS):
                    x = np.linalg.qr(factor.solve(slope @ x))[0]
                    y = np.linalg.qr(factor.solve(slope.T @ y, trans="T"))[0]
                steep = y.T @ (slope @ x)
                change, mix = np.linalg.eig(-np.linalg.solve(steep, y.T @ (p * p * (M @ x) + p * (C @ x) + K @ x)))
                other = np.linalg.inv(steep @ mix).T
            except (RuntimeError, np.linalg.LinAlgError):
                continue  # a defective pole stays as it was found
            if np.isfinite(other).all():
                poles[group], right[:, group], left[:, group] = p + change, x @ mix, y @ other
    return poles, right * scale[:, None], left * scale[:, None]


def _told(pencil: Pencil, kinds: Any, poles: Complex, right: Complex, left: Complex) -> dict[str, Any]:
    """Scaled as the core scales them: mass 1, the largest component real and positive; with the same evidence."""
    M, C, K = pencil
    right, left = _scaled(M, right), _scaled(M, left)
    slope = np.sum(left * (C @ right), axis=0)
    mass = np.sum(left * (M @ right), axis=0)
    a = 2 * poles * mass + slope
    sizes = np.ones(poles.size)
    for v in (right, left):
        sizes = sizes * np.sqrt(np.maximum(np.sum(v.conj() * (M @ v), axis=0).real, 0.0))
    with np.errstate(divide="ignore", invalid="ignore"):
        condition = (2 * np.abs(poles) * sizes + np.abs(slope)) / np.abs(a)
    n = M.shape[0]
    return {
        "poles": poles, "kinds": list(kinds), "right": right, "left": left, "modal_a": a,
        "residual": _residual(pencil, poles, right), "residual_left": _residual((M.T, C.T, K.T), poles, left),
        "condition": condition, "sigma": 0.0, "counted": None, "n_rigid": 0, "n_late": 0,
        "vectors": n, "solves": n, "rounds": 1,
    }  # fmt: skip


def _scaled(M: NDArray[Any], v: Complex) -> Complex:
    mass = np.sum(v.conj() * (M @ v), axis=0).real
    size = np.sqrt(np.where(mass > 0, mass, np.sum(np.abs(v) ** 2, axis=0)))
    largest = v[np.argmax(np.abs(v), axis=0), np.arange(v.shape[1])]
    return np.asarray(v * (np.conj(largest) / np.abs(largest) / size))


def _residual(pencil: Pencil, poles: Complex, v: Complex) -> NDArray[np.float64]:
    terms = (poles**2 * (pencil[0] @ v), poles * (pencil[1] @ v), pencil[2] @ v)
    sizes = [np.linalg.norm(t, axis=0) for t in terms]
    return np.asarray(np.linalg.norm(sum(terms), axis=0) / sum(sizes))
