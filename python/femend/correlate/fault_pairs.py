"""Which mode is which where sensors are reversed or exchanged: such a sensor makes shapes look like those of other
modes, so that it cannot be told from the pairs that the shapes make as they are."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import linear_sum_assignment

from femend.correlate._arrays import finite, shape_pair
from femend.errors import CorrelationError

__all__ = ["fault_pairs"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

# a change of one sensor, or of two for each other, has to raise the sum of the pairs' MAC by this much to be made
GAIN = 0.2
# all together have to leave half, at most, of what changes without one of them leave short of a MAC of 1
CLEAR = 0.5
# mean MAC of all measured modes, and their number, below which the changed shapes tell nothing
TELLS, MODES = 0.85, 3
# fewer sensors may be changed into anything
SENSORS = 4
# of more sensors only signs are tried: two that are exchanged among so many hardly change what a shape looks like
EXCHANGED = 300
# changes whose modes are assigned one to one, the likeliest of all
TRIED = 20
# changes that are looked at at once
BLOCK = 4096


def fault_pairs(
    phi_test: ArrayLike, phi_model: ArrayLike, freq_test: ArrayLike, freq_model: ArrayLike, *, far: float = 1.5
) -> tuple[IntArray, IntArray] | None:
    """Pairs (test, model) of the modes `phi_test` (n_dof, n_test) and `phi_model` (n_dof, n_model) that meet once
    sensors are turned or exchanged, by number from 0; None where that makes nothing clear.

    Pairs are those no further than the factor `far` apart in frequency (`freq_test` (n_test,), `freq_model` (n_model,),
    Hz) with the largest sum of MAC. That sign or exchange of two sensors is taken that raises the sum most, and the
    next one after it, for a third of the sensors at most. What comes out counts where all measured modes have a mate,
    with a mean MAC of 0.85, and where without any one of the changes no others do nearly as well: `sensor_faults` then
    judges the sensors by these pairs. Nothing is told of fewer than four sensors or three modes; of more than 300
    sensors no exchanges are tried. Raises CorrelationError for sizes that do not fit and values that are not finite.

    >>> phi = np.array([[1, 1, 1, 1], [2, 1, -1, -2], [3, -1, -1, 3], [4, -2, 2, -1.0]])
    >>> turned = phi * [[1], [1], [1], [-1]]
    >>> [side.tolist() for side in fault_pairs(turned, phi, [1, 2, 3, 4], [1.1, 2.1, 3.2, 4.1])]
    [[0, 1, 2, 3], [0, 1, 2, 3]]
    """
    y, x = shape_pair(phi_test, phi_model)
    ft, fm = finite(freq_test, "frequencies of the test"), finite(freq_model, "frequencies of the model")
    if y.ndim != 2 or ft.shape != y.shape[1:] or fm.shape != x.shape[1:]:
        raise CorrelationError(f"shapes {y.shape} and {x.shape} with frequencies {ft.shape} and {fm.shape}")
    if len(y) < SENSORS or y.shape[1] < MODES or (ft <= 0).any():
        return None
    near = np.abs(np.log(np.maximum(fm, 1e-300)[:, None] / ft)) < np.log(far)
    y, x = _of_length_one(y), _of_length_one(x)
    changes, put = _search(y, x, near, set())
    if not changes:
        return None
    short = _short(put, x, near)
    # without any one of the changes others must not do as well
    if any(short > CLEAR * _short(_search(y, x, near, set(rows))[1], x, near) for rows in changes):
        return None
    products = np.abs(x.conj().T @ put) ** 2 * near
    b, a = linear_sum_assignment(-products)
    if a.size < y.shape[1] or products[b, a].mean() < TELLS:
        return None
    order = np.argsort(a)
    return a[order].astype(np.int64), b[order].astype(np.int64)


def _of_length_one(phi: NDArray) -> NDArray:
    return phi / np.maximum(np.linalg.norm(phi, axis=0), 1e-300)


def _search(y: NDArray, x: NDArray, near: NDArray[np.bool_], spared: set[int]) -> tuple[list[tuple[int, ...]], NDArray]:
    """Rows of the changes that raise the pairs' MAC, one after the other, without the rows `spared`; the shapes with
    them."""
    changes: list[tuple[int, ...]] = []
    while sum(len(rows) for rows in changes) < max(1, len(y) // 3):
        change = _change(y, x, near, spared.union(*changes))
        if change is None:
            break
        changes.append(change[0])
        y = change[1]
    return changes, y


def _short(y: NDArray, x: NDArray, near: NDArray[np.bool_]) -> float:
    """What the pairs leave short of a MAC of 1, summed over measured modes."""
    return y.shape[1] - _assigned(np.abs(x.conj().T @ y) ** 2 * near)


def _change(y: NDArray, x: NDArray, near: NDArray[np.bool_], used: set[int]) -> tuple[tuple[int, ...], NDArray] | None:
    """Rows of the sign or exchange by which the pairs' MAC rises most, and the shapes with it; None if none does."""
    free = np.array([i for i in range(len(y)) if i not in used], dtype=np.int64)
    i, j = (free[k] for k in np.triu_indices(free.size if len(y) <= EXCHANGED else 0, 1))
    rows = [(int(r),) for r in free] + [(int(p), int(q)) for p, q in zip(i, j, strict=True)]
    # what a change takes from the products of the shapes is one product of two vectors each
    left, right = np.concatenate([2 * x[free], x[i] - x[j]]).conj(), np.concatenate([y[free], y[i] - y[j]])
    now = x.conj().T @ y
    most = np.concatenate(
        [_most(now, left[k : k + BLOCK], right[k : k + BLOCK], near) for k in range(0, len(left), BLOCK)]
    )
    likely = np.argsort(-most, kind="stable")[:TRIED]
    sums = np.array([_assigned(np.abs(now - np.outer(left[k], right[k])) ** 2 * near) for k in likely])
    best = int(np.argmax(sums))
    at = rows[likely[best]]
    if sums[best] < _assigned(np.abs(now) ** 2 * near) + GAIN:
        return None
    changed = y.copy()
    changed[list(at)] = -y[list(at)] if len(at) == 1 else y[list(at[::-1])]
    return at, changed


def _most(now: NDArray, left: NDArray, right: NDArray, near: NDArray[np.bool_]) -> FloatArray:
    """Sum over measured modes of the largest MAC (n_changes,) when `left` (n_changes, n_model) times `right`
    (n_changes, n_test) is taken from the products `now` (n_model, n_test)."""
    products = np.abs(now - left[:, :, None] * right[:, None, :]) ** 2 * near
    return np.asarray(products.max(axis=1).sum(axis=1))


def _assigned(products: NDArray) -> float:
    return float(products[linear_sum_assignment(-products)].sum())
