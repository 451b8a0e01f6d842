"""The stabilisation diagram as data: every pole of every order, with its uncertainty and the mode it belongs to."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from femend.data._arrays import frozen

__all__ = ["Stabilisation", "mac", "modal_phase_collinearity", "unit_shapes"]


@dataclass(frozen=True, slots=True, eq=False)
class Stabilisation:
    """Poles of all model orders: `order` (n,), `poles` (n,) in rad/s, `shapes` (n_dof, n) complex with largest
    component 1, `freq_sd` (n,) in Hz, `zeta_sd` (n,), `shape_sd` (n_dof, n) of the shape's components, `cluster` (n,)
    the number of the mode a pole belongs to (order of frequency, from 0), -1 where to none, `orders` (n_orders,) all
    orders that were tried. Arrays are read-only."""

    order: NDArray[np.int64]
    poles: NDArray[np.complex128]
    shapes: NDArray[np.complex128]
    freq_sd: NDArray[np.float64]
    zeta_sd: NDArray[np.float64]
    shape_sd: NDArray[np.float64]
    cluster: NDArray[np.int64]
    orders: NDArray[np.int64]

    def __post_init__(self) -> None:
        for label in ("order", "poles", "shapes", "freq_sd", "zeta_sd", "shape_sd", "cluster", "orders"):
            object.__setattr__(self, label, frozen(getattr(self, label)))

    @property
    def freq(self) -> NDArray[np.float64]:
        """Frequencies |p| / 2 pi in Hz, (n,)."""
        return np.abs(self.poles) / (2 * np.pi)

    @property
    def zeta(self) -> NDArray[np.float64]:
        """Damping ratios, (n,)."""
        return -self.poles.real / np.abs(self.poles)

    @property
    def shape_var(self) -> NDArray[np.float64]:
        """Sum of the variances of the shape's components over the sum of their squares, (n,)."""
        return (self.shape_sd**2).sum(axis=0) / (np.abs(self.shapes) ** 2).sum(axis=0)

    @property
    def determined(self) -> NDArray[np.bool_]:
        """Poles (n,) known to better than their own half bandwidth: freq_sd <= zeta freq and zeta_sd <= zeta.

        A structural mode observed for 2 pi zeta f T > 4 is (its freq_sd is below 0.4 zeta freq by Au's law, see
        `needed_duration`); a pole that fits noise is not. Where deviations are not known (nan) nothing is excluded.
        """
        known = ~np.isnan(self.freq_sd)
        with np.errstate(invalid="ignore"):
            return ~known | ((self.freq_sd <= self.zeta * self.freq) & (self.zeta_sd <= self.zeta))

    def with_clusters(self, cluster: NDArray[np.int64]) -> Stabilisation:
        """The same poles with the modes `cluster` (n,) they belong to."""
        return replace(self, cluster=cluster)

    def without_deviations(self) -> Stabilisation:
        """The same poles, their deviations not known (nan)."""
        unknown = np.full(self.order.size, np.nan)
        return replace(self, freq_sd=unknown, zeta_sd=unknown, shape_sd=np.full(self.shapes.shape, np.nan))

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON and drawing, without the shapes; deviations that are not known are None."""
        return {
            "order": self.order.tolist(),
            "freq": self.freq.tolist(),
            "zeta": self.zeta.tolist(),
            "freq_sd": [None if np.isnan(v) else float(v) for v in self.freq_sd],
            "zeta_sd": [None if np.isnan(v) else float(v) for v in self.zeta_sd],
            "determined": self.determined.tolist(),
            "cluster": self.cluster.tolist(),
            "orders": self.orders.tolist(),
        }


def mac(a: NDArray[Any], b: NDArray[Any]) -> NDArray[np.float64]:
    """Modal assurance criterion (n_a, n_b) of the columns of `a` (n_dof, n_a) and `b` (n_dof, n_b), |a^H b|^2 /
    (a^H a b^H b) (Allemang and Brown 1982).

    >>> mac(np.array([[1.0], [0.0]]), np.array([[1.0, 0.0], [1.0, 1.0]]))
    array([[0.5, 0. ]])
    """
    cross = np.abs(a.conj().T @ b) ** 2
    size = np.outer((np.abs(a) ** 2).sum(axis=0), (np.abs(b) ** 2).sum(axis=0))
    return cross / np.where(size > 0, size, 1.0)


def modal_phase_collinearity(shapes: NDArray[np.complex128]) -> NDArray[np.float64]:
    """How real `shapes` (n_dof, n_modes) are, (n_modes,): 1 where all components share a phase line, 0 for a circle;
    ((Sxx - Syy)^2 + 4 Sxy^2) / (Sxx + Syy)^2 without subtraction of the mean (Pappa, Elliott and Schenk 1993).

    >>> modal_phase_collinearity(np.array([[1j, 1.0], [2j, 1j]]))
    array([1., 0.])
    """
    x, y = shapes.real, shapes.imag
    xx, yy, xy = (x * x).sum(axis=0), (y * y).sum(axis=0), (x * y).sum(axis=0)
    size = (xx + yy) ** 2
    return ((xx - yy) ** 2 + 4 * xy**2) / np.where(size > 0, size, 1.0)


def unit_shapes(shapes: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """`shapes` (n_dof, n_modes) turned and scaled so that the largest component of each is 1.

    >>> unit_shapes(np.array([[1j], [-2j]])).ravel().real
    array([-0.5,  1. ])
    """
    pivot = shapes[np.argmax(np.abs(shapes), axis=0), np.arange(shapes.shape[1])]
    return shapes / np.where(pivot == 0, 1.0, pivot)
