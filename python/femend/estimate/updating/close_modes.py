"""Close modes as one space: what small errors mix counts as noise of a measured shape.

Close modes are any mixture of each other: an error of frequencies of the size of their distance turns them within their
space. A measured shape is so compared as if the model's close modes were added to it by amounts that are not known,
with deviations that grow from 0 at the distance `CLOSENESS` beyond all bounds at equal frequencies. Whitened, what lies
in the space of double modes drops out, that of modes further apart counts as it stands, and modes that approach each
other pass from the one to the other without a jump.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["CLOSENESS", "CloseMode", "close_modes", "mixed", "reach"]

FloatArray = NDArray[np.float64]

# modes nearer to each other, relatively, are one space, as in `correlate.pair_modes`
CLOSENESS = 0.02
# share of a shape's length below which its direction is rounding
ROUNDING = 1e-12


@dataclass(frozen=True, slots=True)
class CloseMode:
    """The model's `mode`, close to the mate of a measured one: by `gap`, the distance of the two in frequency
    relative to the higher, of derivative `ahead` over that of the mode's and `behind` over that of the mate's;
    `free` is the square of what the distance of the measured modes lets them mix by, 0 where they are not close."""

    mode: int
    gap: float
    ahead: float
    behind: float
    free: float


def close_modes(
    mate: NDArray[np.int64], test: FloatArray, freq: FloatArray, n_sensors: int
) -> tuple[tuple[CloseMode, ...], ...]:
    """For each measured mode with a mate the model's modes that its shape may hold besides: those close to its mate,
    and mates of measured modes close to it.

    `mate` (n_test,) are the model's modes or -1, `test` (n_test,) and `freq` (n_modes,) the frequencies. As in
    `pair_modes` a crowd of more than half of the `n_sensors` (but for a pair) explains nothing and is no space.

    >>> [len(one) for one in close_modes(np.array([0, 2]), np.array([9.0, 12.0]), np.array([9.0, 9.1, 12.0]), 8)]
    [1, 0]
    """
    paired = np.flatnonzero(mate >= 0)
    apart, gaps = _gaps(freq[mate[paired]], freq), _gaps(test[paired], test[paired])
    model, measured = apart < CLOSENESS, gaps < CLOSENESS
    out = []
    for row, own in enumerate(mate[paired].tolist()):
        near = {int(j): 0.0 for j in np.flatnonzero(model[row]) if j != own}
        for other in np.flatnonzero(measured[row]):
            gap = float(gaps[row, other])
            if other != row:
                near[int(mate[paired[other]])] = ((CLOSENESS - gap) / gap) ** 2 if gap > 0 else np.inf
        crowd = len(near) + 1 > max(2, n_sensors // 2) or len(near) + 1 >= n_sensors
        out.append(() if crowd else tuple(_close(j, own, freq, free) for j, free in near.items()))
    return tuple(out)


def _gaps(a: FloatArray, b: FloatArray) -> FloatArray:
    """Distances of frequencies (n_a, n_b), relative to the higher of two."""
    return np.asarray(np.abs(a[:, None] - b) / np.maximum(np.maximum(a[:, None], b), 1e-300))


def _close(j: int, own: int, freq: FloatArray, free: float) -> CloseMode:
    f, g = max(float(freq[j]), 1e-300), max(float(freq[own]), 1e-300)
    if f > g or (f == g and j > own):
        return CloseMode(j, 1.0 - g / f, g / f**2, -1.0 / f, free)
    return CloseMode(j, 1.0 - f / g, -1.0 / g, f / g**2, free)


def reach(mate: NDArray[np.int64], freq: FloatArray) -> int:
    """How many of the lowest modes hold all of `mate` (n_test,), and those close to them in `freq` (n_modes,)."""
    mates = mate[mate >= 0]
    if not mates.size:
        return 0
    top = freq[mates].max()
    return max(int(mates.max()) + 1, int(np.count_nonzero(freq - top < CLOSENESS * freq)))


def mixed(
    vectors: FloatArray, slopes: FloatArray | None, gaps: FloatArray | None, close: tuple[CloseMode, ...]
) -> tuple[FloatArray, FloatArray | None]:
    """A measured shape and the mate's, whitened by what `close` modes may add to the first: (2, n), and derivatives
    (n_parameters, 2, n) where `slopes` are given.

    Rows of `vectors` (2 + n_close, n), all over the deviations of the sensors, are the measured shape, the mate and the
    close modes; `slopes` (n_parameters, 2 + n_close, n) are their derivatives, `gaps` (n_parameters, n_close) those of
    the gaps.
    """
    z = vectors.copy()
    first = d = slopes
    size = float(z[0] @ z[0])
    lengths = np.sqrt((z[2:] ** 2).sum(axis=1))
    for k, (c, length) in enumerate(zip(close, lengths, strict=True), start=2):
        v = z[k]
        left = float(np.sqrt(v @ v))
        if left <= ROUNDING * length:
            continue
        u = v / left
        # the share of its first length that the modes before it have left of it
        part = (left / length) ** 2
        keep, of_gap, of_part = _kept(c, size, part)
        on = z @ u
        if d is not None and first is not None and gaps is not None:
            along = d[:, k] @ u
            du = (d[:, k] - along[:, None] * u) / left
            dpart = 2 * part * (along / left - _growth(vectors[k], first[:, k]))
            dkeep = of_gap * gaps[:, k - 2] + of_part * dpart
            don = d @ u + du @ z.T
            d = d - (1 - keep) * (don[:, :, None] * u + on[:, None] * du[:, None, :])
            d += dkeep[:, None, None] * (on[:, None] * u)
        z = z - (1 - keep) * on[:, None] * u
    return z[:2], None if d is None else d[:, :2]


def _growth(v: FloatArray, dv: FloatArray) -> FloatArray:
    """d ln|v| (n_parameters,)."""
    return np.asarray(dv @ v / (v @ v))


def _kept(c: CloseMode, size: float, part: float) -> tuple[float, float, float]:
    """What is kept of the component along a close mode, and its derivatives over the gap and over `part`, the share of
    its direction that is left; `size` is the square of the measured shape in deviations."""
    if not np.isfinite(c.free):
        return 0.0, 0.0, 0.0
    g, m = c.gap, max(CLOSENESS - c.gap, 0.0)
    q = size * (g**2 * c.free + m**2)
    dq = size * (2 * g * c.free - 2 * m)
    D = g**2 + part * q
    if D <= 0:
        return 1.0, 0.0, 0.0
    return g / D**0.5, D**-0.5 - 0.5 * g * D**-1.5 * (2 * g + part * dq), -0.5 * g * D**-1.5 * q
