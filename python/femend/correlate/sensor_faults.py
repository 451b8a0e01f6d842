"""Sensors that are reversed or exchanged, found by test shapes against those of the model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from femend.correlate._arrays import shape_pair
from femend.correlate.assurance import msf
from femend.dof import Dof
from femend.errors import CorrelationError

__all__ = ["SensorFault", "sensor_faults"]

FloatArray = NDArray[np.float64]

# the error of the sensors concerned has to fall to this share of what it was
CURED = 0.25
# shapes that share less than this with the model's, faults cured, tell nothing of single sensors
ALIKE = 0.75
# from this error on sensors look mistaken: below, two that show nearly the same differ by what tests differ by
MISTAKEN = 0.2
# and has to have been this much of all sensors' together, else it is noise that falls
PART = 0.02


@dataclass(frozen=True, slots=True)
class SensorFault:
    """`kind` "reversed" (one row) or "exchanged" (two), `rows`, `names`; `before`, `after`: relative error of those
    rows, |test - model| / |test|, over all modes."""

    kind: Literal["reversed", "exchanged"]
    rows: tuple[int, ...]
    names: tuple[str, ...]
    before: float
    after: float

    @property
    def text(self) -> str:
        """How a report says it."""
        what = " and ".join(self.names)
        verb = "look exchanged" if self.kind == "exchanged" else "looks reversed"
        return f"{what} {verb}: the error there falls from {100 * self.before:.0f} % to {100 * self.after:.0f} %"


def sensor_faults(
    phi_test: ArrayLike, phi_model: ArrayLike, dofs: Sequence[Dof | str] | None = None, *, most: int | None = None
) -> tuple[tuple[SensorFault, ...], NDArray]:
    """Faults that explain why `phi_test` (n_dof, n_modes) differs from the paired `phi_model`, and the test cured of
    them.

    Of all signs and exchanges of two sensors the one that lowers the sum over modes of 1 - MAC most is taken, as long
    as the error at these sensors falls to a quarter; at most `most` (a third of the sensors by default, since half of
    them reversed are the other half right). Shapes whose mean MAC stays below 0.75 have no fault named. `dofs` name the
    rows. Two modes are needed: a single shape hides exchanges. Raises CorrelationError for sizes that do not fit, fewer
    than three sensors or two modes.

    >>> phi = np.array([[1.0, 1.0], [2.0, -1.0], [3.0, 0.5], [4.0, -2.0]])
    >>> faults, cured = sensor_faults(phi * [[1], [1], [-1], [1]], phi, ["1:X", "2:X", "3:X", "4:X"])
    >>> faults[0].kind, faults[0].names
    ('reversed', ('3:X',))
    """
    y, x = shape_pair(phi_test, phi_model, paired=True)
    n = y.shape[0]
    if y.ndim != 2 or n < 3 or y.shape[1] < 2:
        raise CorrelationError(f"shapes {y.shape}: faults of sensors take three sensors and two paired modes or more")
    names = [str(d) for d in dofs] if dofs is not None else [f"row {i}" for i in range(n)]
    if len(names) != n:
        raise CorrelationError(f"{len(names)} names for {n} rows")
    y, x = y / np.linalg.norm(y, axis=0), x / np.linalg.norm(x, axis=0)
    scale = np.linalg.norm(np.asarray(phi_test).reshape(n, -1), axis=0)
    faults: list[SensorFault] = []
    used: set[int] = set()
    limit = max(1, n // 3) if most is None else most
    while len(used) < limit:
        fault, cured = _best(y, x, names, used)
        if fault is None:
            break
        faults.append(fault)
        used |= set(fault.rows)
        y = cured
    share = float(np.mean(np.abs(np.sum(x.conj() * y, axis=0)) ** 2))
    if faults and share < ALIKE:
        return (), np.array(phi_test).reshape(n, -1)
    return tuple(faults), y * scale


def _best(y: NDArray, x: NDArray, names: Sequence[str], used: set[int]) -> tuple[SensorFault | None, NDArray]:
    """The change that raises the MAC most, if it cures its sensors."""
    part = x.conj() * y
    total = part.sum(axis=0)
    free = np.array([i for i in range(len(y)) if i not in used], dtype=np.int64)
    flip = np.sum(np.abs(total - 2 * part[free]) ** 2, axis=1)
    i, j = (free[k] for k in np.triu_indices(free.size, 1))
    new = total - part[i] - part[j] + x[i].conj() * y[j] + x[j].conj() * y[i]
    swap = np.sum(np.abs(new) ** 2, axis=1)
    now = float(np.sum(np.abs(total) ** 2))
    options: list[tuple[float, tuple[str, tuple[int, ...]]]] = [
        (float(v), ("reversed", (int(r),))) for v, r in zip(flip, free, strict=True)
    ]
    options += [(float(v), ("exchanged", (int(p), int(q)))) for v, p, q in zip(swap, i, j, strict=True)]
    options.sort(key=lambda o: -o[0])
    everywhere = np.linalg.norm(y - x * msf(y, x)) ** 2
    for value, (kind, rows) in options[:5]:
        if value <= now:
            break
        cured = y.copy()
        at = list(rows)
        cured[at] = -y[at] if kind == "reversed" else y[at[::-1]]
        fit = x * msf(cured, x)  # the scale of the cured shapes: faults spoil that of the others
        size = max(float(np.linalg.norm(y[at])), 1e-300)
        before, after = float(np.linalg.norm(y[at] - fit[at])) / size, float(np.linalg.norm(cured[at] - fit[at])) / size
        if before >= MISTAKEN and after**2 <= CURED * before**2 and (before * size) ** 2 >= PART * everywhere:
            kind_: Literal["reversed", "exchanged"] = "reversed" if kind == "reversed" else "exchanged"
            return SensorFault(kind_, rows, tuple(names[r] for r in rows), before, after), cured
    return None, y
