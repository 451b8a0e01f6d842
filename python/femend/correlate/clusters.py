"""Groups of close modes, and the mixtures of one group's modes that fit another group best."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from femend.correlate._arrays import finite, shape_pair
from femend.errors import CorrelationError
from femend.numerals import plain

__all__ = ["align_cluster", "close_groups"]


def close_groups(freq: ArrayLike, closeness: float) -> tuple[tuple[int, ...], ...]:
    """Groups of two and more modes whose neighbours in `freq` (n_modes,) are at most `closeness` apart, relatively.

    Neighbours at f1 <= f2 are close for f2 - f1 <= closeness * f2; chains count as one group. Rigid-body modes, at
    or about 0 Hz, are one group too: those below 1e-3 times the lowest frequency that is well above them. Numbers of
    modes, by frequency. Raises CorrelationError for frequencies that are not finite or negative.

    >>> close_groups([10.0, 3.0, 10.05, 20.0], 0.01)
    ((0, 2),)
    """
    f = finite(freq, "the frequencies")
    if f.ndim != 1 or (f < 0).any():
        raise CorrelationError(
            f"frequencies of shape {f.shape}, least {plain(np.min(f))} Hz; one per mode, from 0 Hz on"
        )
    order = np.argsort(f, kind="stable")
    values = f[order]
    rigid = _n_rigid(values)
    groups: list[list[int]] = []
    for k, mode in enumerate(order):
        near = k > 0 and (k < rigid or (k > rigid and values[k] - values[k - 1] <= closeness * values[k]))
        if near:
            groups[-1].append(int(mode))
        else:
            groups.append([int(mode)])
    return tuple(tuple(g) for g in groups if len(g) > 1)


def align_cluster(phi_a: ArrayLike, phi_b: ArrayLike) -> NDArray[Any]:
    """Mixtures of the modes `phi_b` (n_dof, n_b), one for each of `phi_a` (n_dof, n_a), closest to it: (n_dof, n_a).

    Repeated modes are any basis of their space, so they are compared after the least-squares fit b' = B (B^+ a). The
    MAC of a with b' is `subspace_mac`. Raises CorrelationError for sizes that do not fit or values that are not
    finite.

    >>> align_cluster([[1.0], [1.0]], [[1.0, 0.0], [0.0, 2.0]]).round(12).tolist()
    [[1.0], [1.0]]
    """
    a, b = shape_pair(phi_a, phi_b)
    if a.ndim != 2 or b.ndim != 2:
        raise CorrelationError(f"clusters of shapes {a.shape} and {b.shape}; one cluster is (n_dof, n_modes)")
    return b @ np.linalg.lstsq(b, a, rcond=None)[0]


def _n_rigid(values: NDArray[np.float64]) -> int:
    """How many of the sorted frequencies are rigid-body modes: a jump by 1000 or more parts them from the rest."""
    above = np.nonzero((values[:-1] < 1e-3 * values[1:]) & (np.arange(1, len(values)) <= 6))[0]
    if (values == 0).all():
        return len(values)
    return int(above[-1]) + 1 if above.size else 0
