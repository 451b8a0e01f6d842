"""Shapes at the sensors to shapes at all DOFs, and how well sensors are foretold that were left out."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from femend.errors import ExpansionError
from femend.expansion._matrices import measured_rows, sensor_shapes
from femend.expansion.reductions import dynamic

__all__ = ["LeftOut", "expand_dynamic", "leave_one_out"]

FloatArray = NDArray[np.float64]


def expand_dynamic(K: Any, M: Any, rows: ArrayLike, phi: ArrayLike, freq: ArrayLike) -> NDArray[Any]:
    """Shapes (n, n_modes) from `phi` (n_a, n_modes) at `rows` (n_a,), each by `dynamic` at its own frequency.

    `K`, `M` (n, n), `freq` (n_modes,) in Hz. Exact for errorless modes of the model itself. Raises ExpansionError as
    `dynamic`, and for sizes that do not fit.
    """
    at = np.asarray(rows, dtype=np.int64).ravel()
    x = sensor_shapes(phi, len(at))
    f = np.asarray(freq, dtype=np.float64).ravel()
    if f.shape != (x.shape[1],):
        raise ExpansionError(f"{f.size} frequencies for {x.shape[1]} shapes; one each")
    parts = [dynamic(K, M, at, float(fr)).expand(x[:, [r]]) for r, fr in enumerate(f)]
    return np.asarray(np.hstack(parts))


@dataclass(frozen=True, eq=False)
class LeftOut:
    """Error of an expansion at sensors that it was not given.

    `predicted` (n_a, n_modes), `error` (n_a, n_modes) predicted - measured, `per_mode` (n_modes,) and `per_sensor`
    (n_a,) the root of the sum of squares over that of what was measured; NaN where a sensor cannot be left out.
    """

    predicted: NDArray[Any]
    error: NDArray[Any]

    measured: NDArray[Any]

    @property
    def per_mode(self) -> FloatArray:
        """Relative error of each mode over all sensors."""
        return _relative(self.error, self.measured, 0)

    @property
    def per_sensor(self) -> FloatArray:
        """Error of each sensor over the root mean square sensor's motion: a large one is wrong, or the model is."""
        mean = np.sqrt(np.nanmean(np.abs(self.measured) ** 2, axis=0, keepdims=True))
        part = np.abs(self.error) / np.where(mean > 0, mean, 1.0)
        return np.asarray(np.sqrt(np.mean(part**2, axis=1)))


def leave_one_out(
    expand: Callable[[NDArray[np.int64], NDArray[Any]], NDArray[Any]], rows: ArrayLike, phi: ArrayLike
) -> LeftOut:
    """Each sensor in turn is left out and foretold from the others.

    `expand(rows, phi)` makes shapes (n, n_modes) from shapes (n_a - 1, n_modes) at rows, such as
    ``lambda rows, phi: guyan(K, rows).expand(phi)``; `rows` (n_a,), `phi` (n_a, n_modes). A sensor without which
    `expand` raises ExpansionError has NaN. Raises ExpansionError for sizes that do not fit.

    >>> K = np.array([[2.0, -1.0, 0], [-1.0, 2.0, -1.0], [0, -1.0, 1.0]])
    >>> from femend.expansion import guyan
    >>> left = leave_one_out(lambda r, x: guyan(K, r).expand(x), [0, 1, 2], [[1.0], [2.0], [3.0]])
    >>> left.predicted.ravel().round(9).tolist()  # statically 1 is halfway to 2, 2 between 1 and 3, 3 goes with 2
    [1.0, 2.0, 2.0]
    """
    given = np.asarray(rows, dtype=np.int64).ravel()
    at = measured_rows(given, int(given.max(initial=0)) + 1)
    x = sensor_shapes(phi, len(at))
    predicted = np.full(x.shape, np.nan, dtype=x.dtype if np.iscomplexobj(x) else np.float64)
    for i in range(len(at)):
        keep = np.arange(len(at)) != i
        try:
            predicted[i] = expand(at[keep], x[keep])[at[i]]
        except ExpansionError:
            continue
    return LeftOut(predicted, predicted - x, x)


def _relative(error: NDArray[Any], measured: NDArray[Any], axis: int) -> FloatArray:
    there = np.isfinite(error)
    top = np.sum(np.where(there, np.abs(error) ** 2, 0.0), axis=axis)
    base = np.sum(np.where(there, np.abs(measured) ** 2, 0.0), axis=axis)
    return np.asarray(np.sqrt(np.divide(top, base, out=np.full(top.shape, np.nan), where=base > 0)))
