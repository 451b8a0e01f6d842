"""Left vectors of modes without damping: the conjugates of the right ones."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from femend.analysis.turning import TurningSystem

__all__ = ["COINCIDE", "conservative", "groups", "is_conservative"]

COINCIDE = 1e-8  # share of their size within which poles coincide, as in the core
SKEW = 1e-12  # asymmetry beside the largest entry that is rounding


def is_conservative(system: TurningSystem) -> bool:
    """Whether all terms are elastic, inertial or gyroscopic: no damping, nothing circulatory."""
    if any(a is not None for a in (system.C, system.D, system.N)):
        return False
    own = ((system.G, 1.0), (system.S, -1.0))
    return all(a is None or abs(a + sign * a.T).max() <= SKEW * abs(a).max() for a, sign in own)


def conservative(system: TurningSystem, speed: float, found: dict[str, Any]) -> dict[str, Any]:
    """What the core `found` for a conservative `system` at `speed` (rad/s), with left vectors of its oscillatory modes
    that are as good as the right ones.

    With M and K symmetric and G skew D(i w) is Hermitian, so that y = conj(psi) (Meirovitch, AIAA J. 12 (1974) 1337).
    Poles that coincide have vectors that are orthogonal in psi^H (2 i w M + W G) psi. Poles off the imaginary axis
    (a stiffness that the speed made negative) are left as they are.
    """
    kinds = np.array(found["kinds"], dtype=object)
    poles = found["poles"]
    damping = system.matrix("damping", speed)
    right, left, a = (np.array(found[name]) for name in ("right", "left", "modal_a"))
    residual_left, condition = np.array(found["residual_left"]), np.array(found["condition"])
    own = np.flatnonzero((kinds == "oscillatory") & (np.abs(poles.real) <= COINCIDE * np.abs(poles)))
    for group in groups(poles[own], COINCIDE):
        at = own[group]
        p, x = 1j * poles[at].imag.mean(), right[:, at]
        slope = 2 * p * (system.M @ x) + damping @ x
        if at.size > 1:
            form = -1j * (x.conj().T @ slope)
            mix = np.linalg.eigh((form + form.conj().T) / 2)[1]
            x, slope = x @ mix, slope @ mix
        mass = np.sqrt(np.sum(x.conj() * (system.M @ x), axis=0).real)
        largest = x[np.argmax(np.abs(x), axis=0), np.arange(at.size)]
        scale = largest.conj() / np.abs(largest) / mass
        x, slope = x * scale, slope * scale
        right[:, at], left[:, at] = x, x.conj()
        a[at] = np.sum(x.conj() * slope, axis=0)
        residual_left[at] = found["residual"][at].max()
        with np.errstate(divide="ignore"):
            condition[at] = (2 * abs(p) + np.abs(np.sum(x.conj() * (damping @ x), axis=0))) / np.abs(a[at])
    told = {"right": right, "left": left, "modal_a": a, "residual_left": residual_left, "condition": condition}
    return {**found, **told}


def groups(poles: NDArray[np.complex128], share: float) -> list[NDArray[np.int64]]:
    """Places of poles that lie within a `share` of their size of one another, in chains.

    >>> [g.tolist() for g in groups(np.array([1j, 5j, 1.0000001j]), 1e-6)]
    [[0, 2], [1]]
    """
    left, out = list(range(poles.size)), []
    while left:
        group = [left.pop(0)]
        for i in group:
            near = [j for j in left if abs(poles[j] - poles[i]) <= share * abs(poles[i])]
            group += near
            left = [j for j in left if j not in near]
        out.append(np.array(group))
    return out
