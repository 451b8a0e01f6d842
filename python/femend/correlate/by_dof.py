"""Where two sets of paired modes differ: CoMAC, enhanced CoMAC, and what each DOF does to the MAC."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from femend.correlate._arrays import fraction, modulus2, scaled, shape_pair, square
from femend.correlate.assurance import mac, msf
from femend.errors import CorrelationError

__all__ = ["DofElimination", "comac", "ecomac", "eliminate_dofs", "macco"]


def comac(phi_a: ArrayLike, phi_b: ArrayLike, *, normalise: bool = True) -> NDArray[np.float64]:
    """Coordinate MAC of paired modes `phi_a`, `phi_b` (n_dof, n_modes): (n_dof,) in [0, 1].

    CoMAC_q = |sum_r a_qr conj(b_qr)|^2 / (sum_r |a_qr|^2 sum_r |b_qr|^2) (Lieven and Ewins, IMAC VI, 1988; in this
    form Allemang 2003, "COMAC"). The formula wants shapes that are scaled and signed alike: with `normalise` each is
    brought to unit length and `phi_b` to the phase of `phi_a`; without it, the shapes are taken as given. Some texts
    put the modulus inside the sum, which needs no signs and does not see any. A sensor that is upside down in every
    mode keeps CoMAC = 1: `ecomac` sees it. NaN where a DOF moves in no mode. Raises CorrelationError for sizes that do
    not fit or values that are not finite.

    >>> comac([[1.0, 1.0], [1.0, -1.0]], [[1.0, 1.0], [1.0, 1.0]], normalise=False).tolist()
    [1.0, 0.0]
    """
    a, b = shape_pair(phi_a, phi_b, paired=True)
    if normalise:
        a, b = _unit_and_aligned(a, b)
    a, b = scaled(a, -1), scaled(b, -1)
    return fraction(modulus2(np.sum(a * b.conj(), axis=-1)), square(a, -1) * square(b, -1))


def ecomac(phi_a: ArrayLike, phi_b: ArrayLike) -> NDArray[np.float64]:
    """Enhanced coordinate MAC of paired modes `phi_a`, `phi_b` (n_dof, n_modes): (n_dof,), 0 where they agree.

    eCoMAC_q = sum_r |a_qr - b_qr| / (2 n_modes) (Hunt, IMAC X, 1992), with `phi_a` scaled to largest component 1 and
    `phi_b` to `phi_a` by its modal scale factor. Large values name wrong sensors: an upside-down one gives about the
    mean of |a_q|. Raises CorrelationError for sizes that do not fit, values that are not finite, or a zero shape.

    >>> ecomac([1.0, 0.5, 0.5, -1.0], [1.0, 0.5, -0.5, -1.0]).round(12).tolist()
    [0.1, 0.05, 0.45, 0.1]
    """
    a, b = shape_pair(phi_a, phi_b, paired=True)
    peak = np.max(np.abs(a), axis=-2, keepdims=True)
    if (peak == 0).any() or not np.abs(b).max(axis=-2).all():
        raise CorrelationError("eCoMAC: a shape is zero at all DOFs compared; leave the pair out")
    a = a / peak
    return np.sum(np.abs(a - msf(a, b)[..., None, :] * b), axis=-1) / (2 * a.shape[-1])


def macco(phi_a: ArrayLike, phi_b: ArrayLike) -> NDArray[np.float64]:
    """What each DOF does to the MAC of paired modes `phi_a`, `phi_b` (n_dof, n_modes): (n_dof, n_modes).

    MACCo_qr = MAC_r without DOF q - MAC_r (MAC contribution; Balmes, SDT reference manual, `ii_mac` MACCO). Positive:
    without this DOF the pair agrees better. NaN where without the DOF nothing moves. Raises CorrelationError for
    sizes that do not fit, values that are not finite, or a single DOF.

    >>> macco([1.0, 1.0, 1.0], [1.0, 1.0, -1.0]).round(6).tolist()
    [[-0.111111], [-0.111111], [0.888889]]
    """
    a, b = shape_pair(phi_a, phi_b, paired=True)
    if a.shape[-2] < 2:
        raise CorrelationError("MACCo leaves one DOF out at a time; there is only one DOF")
    a, b = scaled(a, -2), scaled(b, -2)
    cross, aa, bb = a.conj() * b, modulus2(a), modulus2(b)
    without = [np.sum(x, axis=-2, keepdims=True) - x for x in (cross, aa, bb)]
    # What is left of a shape that moves at one DOF alone is rounding: nothing.
    rest = [np.where(w > 1e-14 * (w + x), w, 0.0) for w, x in zip(without[1:], (aa, bb), strict=True)]
    full = fraction(modulus2(np.sum(cross, axis=-2)), np.sum(aa, axis=-2) * np.sum(bb, axis=-2))
    return fraction(modulus2(without[0]), rest[0] * rest[1]) - full[..., None, :]


@dataclass(frozen=True, slots=True)
class DofElimination:
    """DOFs in the order of their elimination, `dofs` (row numbers), and `mean_mac` before each and after the last."""

    dofs: tuple[int, ...]
    mean_mac: tuple[float, ...]


def eliminate_dofs(phi_a: ArrayLike, phi_b: ArrayLike, n_remove: int) -> DofElimination:
    """The `n_remove` DOFs without which the mean MAC of paired `phi_a`, `phi_b` (n_dof, n_modes) is best, greedily.

    Each step leaves out the DOF with the largest mean MACCo (see `macco`) of those still there. A few DOFs that raise
    the MAC much are suspicious sensors; a MAC that rises slowly and steadily is a model that is wrong everywhere.
    Raises CorrelationError as `macco` does, or where fewer than two DOFs would be left.

    >>> eliminate_dofs([1.0, 1.0, 1.0, 1.0], [1.0, 1.0, -1.0, 1.0], 1)
    DofElimination(dofs=(2,), mean_mac=(0.25, 1.0))
    """
    a, b = shape_pair(phi_a, phi_b, paired=True)
    if n_remove < 0 or a.shape[0] - n_remove < 2:
        raise CorrelationError(f"{n_remove} of {a.shape[0]} DOFs cannot be left out; two at least have to stay")
    rows = list(range(a.shape[0]))
    removed: list[int] = []
    history = [_mean_mac(a, b)]
    for _ in range(n_remove):
        # A shape that would vanish without the DOF counts as a MAC of 0.
        gain = np.nan_to_num(macco(a[rows], b[rows]), nan=-1.0).mean(axis=-1)
        removed.append(rows.pop(int(np.argmax(gain))))
        history.append(_mean_mac(a[rows], b[rows]))
    return DofElimination(tuple(removed), tuple(history))


def _mean_mac(a: NDArray, b: NDArray) -> float:
    return float(np.nanmean(np.diagonal(mac(a, b))))


def _unit_and_aligned(a: NDArray, b: NDArray) -> tuple[NDArray, NDArray]:
    """Both sets at unit length, the second in the phase of the first; zero shapes stay zero."""
    a, b = scaled(a, -2), scaled(b, -2)
    la, lb = (np.sqrt(square(x, -2))[..., None, :] for x in (a, b))
    a = np.divide(a, la, out=np.zeros_like(a), where=la > 0)
    b = np.divide(b, lb, out=np.zeros_like(b), where=lb > 0)
    turn = np.sum(b.conj() * a, axis=-2, keepdims=True)
    size = np.abs(turn)
    return a, b * np.divide(turn, size, out=np.ones_like(turn), where=size > 0)
