"""Recordings that hold the same stretch of time: a file that is a part of another one, or two that overlap."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from femend.data import Recording, TimeData
from femend.numerals import plain

__all__ = ["overlaps"]

FloatArray = NDArray[np.float64]

# samples of the pieces that are looked for in other recordings, and of them those that are compared first
PIECE, POINTS = 256, 8
# samples are the same that differ by less than this share of their rms: exporters round, and no test repeats itself so
SAME = 1e-3
# what scatters by less, over the largest sample, stands still
ROUNDING = 1e-12
# rates are the same to this share
RATE = 1e-6
# places of a piece in the other recording that are followed
MOST = 100


@dataclass(frozen=True, slots=True)
class _Shared:
    """`n` samples from sample `a` of one recording are those from sample `b` of the other."""

    a: int
    b: int
    n: int


def overlaps(recordings: Sequence[Recording]) -> list[str]:
    """What is told of pairs of time recordings with roles fit and validate that hold the same samples of a sensor.

    Looked for is a piece of either one, where it begins and where it is loudest, in the other: where two stretches of
    one record overlap, one of them begins inside the other. Raises nothing.
    """
    told = []
    used = [r for r in recordings if r.is_time and r.role in ("fit", "validate")]
    for one, other in combinations(used, 2):
        if one.role == other.role == "validate":
            continue
        found = _shared(one.time, other.time)
        if found is not None:
            told.append(_words(one, other, found))
    return told


def _words(one: Recording, other: Recording, found: _Shared) -> str:
    dt = one.time.dt
    parts = []
    for r, at in ((one, found.a), (other, found.b)):
        share = found.n / r.time.n_samples
        part = "all" if share > 1.0 - SAME else f"{plain(100 * share, 2)} %"
        parts.append(f"{part} of {r.name!r} from {plain(at * dt, 3)} s on")
    said = (
        f"recordings {one.name!r} and {other.name!r} hold the same {plain(found.n * dt, 3)} s ({parts[0]}, {parts[1]})"
    )
    if one.role == other.role:
        return f"{said}: what counts twice makes deviations too narrow; leave one of them out, or cut it"
    held, fitted = (one, other) if one.role == "validate" else (other, one)
    return (
        f"{said}: {held.name!r} is held out, and so much of it is what {fitted.name!r} is fitted to, which confirms "
        "nothing; hold out a stretch of its own"
    )


def _shared(a: TimeData, b: TimeData) -> _Shared | None:
    """The samples that two records have in common, by the first sensor that both have."""
    if abs(a.rate / b.rate - 1.0) > RATE:
        return None
    pair = next(
        (
            (i, j)
            for i, p in enumerate(a.channels)
            for j, q in enumerate(b.channels)
            if p.dof is not None and q.dof is not None and p.quantity == q.quantity != "force"
            if p.dof.unsigned == q.dof.unsigned and p.unit == q.unit
        ),
        None,
    )
    if pair is None:
        return None
    sign = 1.0 if a.channels[pair[0]].dof == b.channels[pair[1]].dof else -1.0
    x, y = a.values[pair[0]], sign * b.values[pair[1]]
    for at in _pieces(x):
        for there in _places(x[at : at + PIECE], y):
            if (found := _common(x, y, at - there)) is not None:
                return found
    for at in _pieces(y):
        for there in _places(y[at : at + PIECE], x):
            if (found := _common(x, y, there - at)) is not None:
                return found
    return None


def _pieces(x: FloatArray) -> list[int]:
    """Where the pieces of a record begin that are looked for: the first that moves, and the loudest."""
    if x.size < 2 * PIECE:
        return []
    whole = np.array([x[k : k + PIECE].std() for k in range(0, x.size - PIECE + 1, PIECE)])
    moving = np.flatnonzero(whole > ROUNDING * np.abs(x).max())
    if not moving.size:
        return []
    return list(dict.fromkeys([int(moving[0]) * PIECE, int(np.argmax(whole)) * PIECE]))


def _places(piece: FloatArray, y: FloatArray) -> NDArray[np.int64]:
    """Where the piece may stand in `y` (n,): some of its samples do."""
    near = SAME * float(piece.std())
    if y.size < PIECE or near == 0:
        return np.zeros(0, dtype=np.int64)
    mean = piece.mean()
    # those that are furthest from the mean are found least elsewhere
    points = np.argsort(-np.abs(piece - mean), kind="stable")[:POINTS]
    places = np.flatnonzero(np.abs(y[points[0] : y.size - PIECE + 1 + points[0]] - piece[points[0]]) <= 3 * near)
    for k in points[1:]:
        places = places[np.abs(y[places + k] - piece[k]) <= 3 * near]
    return places[:MOST]


def _common(x: FloatArray, y: FloatArray, shift: int) -> _Shared | None:
    """The overlap of `x` (n,) and `y` (m,), sample `shift` of x being the first of y, if it is the same in both."""
    a, b = max(shift, 0), max(-shift, 0)
    n = min(x.size - a, y.size - b)
    if n < PIECE:
        return None
    left, right = x[a : a + n], y[b : b + n]
    if float(np.std(left - right)) > SAME * float(left.std()):
        return None
    return _Shared(a, b, n)
