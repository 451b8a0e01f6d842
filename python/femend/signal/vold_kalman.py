"""Order tracking by the second-generation Vold-Kalman filter, all orders at once."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline
from scipy.linalg import LinAlgError, cho_solve_banded, cholesky_banded

from femend.data import OrderTrack, Speed, TimeData
from femend.errors import SignalError
from femend.numerals import plain
from femend.signal.check import notes_of

__all__ = ["vold_kalman"]

FloatArray = NDArray[np.float64]

# knots of the envelopes per 1/bandwidth: at 8 the spline differs from the continuous filter by less than 4e-3 at its
# -3 dB point; output samples per 1/bandwidth; highest usable frequency as a share of the sampling rate
KNOTS, OUTPUT, USABLE = 8.0, 8.0, 0.48
DEGREE = 3


def vold_kalman(
    data: TimeData,
    speed: Speed | Sequence[Speed],
    orders: Sequence[float] | Sequence[Sequence[float]],
    *,
    bandwidth: float | None = None,
    relative: float = 0.2,
    poles: int = 2,
    t: FloatArray | None = None,
    channels: Sequence[int] | None = None,
) -> OrderTrack:
    """Complex amplitudes of `orders` of one shaft, or of several with a `speed` and a list of orders each.

    Minimises over all envelopes A_k together (Vold and Leuridan, SAE 931288; Tuma, Vold-Kalman order tracking
    filtration, 2005, eq. 12 and 26, for coupled orders)

        sum_n (x_n - sum_k Re(A_k(t_n) exp(i order_k angle_n)))^2 + sum_k int lambda(t) |d^p A_k/dt^p|^2 dt

    with p = `poles` (1 to 3). Since the orders share the samples, orders that cross or beat are told apart as long as
    their phases run apart within 1/bandwidth. The record enters as it is, not as an analytic signal, so that orders of
    low frequency do not meet their mirror image. Envelopes are cubic splines with 8 knots per 1/bandwidth: banded
    normal equations of their size, not of the record's.

    `bandwidth` is the full width at -3 dB in Hz, lambda = (sqrt 2 - 1) / (2 dt (pi bandwidth)^(2p)); None takes
    `relative` times the shaft's speed, the same resolution in orders all along. `t` (n_time,) s are the times of the
    result, by default 8 per 1/bandwidth; `channels` the rows to track, by default all but tachos and voltages.

    Raises SignalError for orders that are equal, not positive or nowhere below 0.48 of the sampling rate, for a speed
    that does not overlap the record, a dead channel, and for a record shorter than 2/bandwidth.
    """
    speeds = [speed] if isinstance(speed, Speed) else list(speed)
    flat, shafts = _checked_orders(data, speeds, [orders] if isinstance(speed, Speed) else list(orders))
    rows = _rows(data) if channels is None else list(channels)
    faults = notes_of(data, rows)
    span = _span(data, speeds)
    times = data.t[span]
    freq, phase = _phases(speeds, flat, shafts, times)
    width = _width(speeds[0], bandwidth, relative, poles, times)
    _refuse_short(data, times, width)
    usable = _usable(data, flat, freq)
    knots = _knots(times, width)
    lam = (np.sqrt(2) - 1) / (2 * data.dt * (np.pi * width) ** (2 * poles))
    coefs, left = _solve(data.name, times, data.values[rows][:, span], phase, usable, knots, lam, poles)
    out = _output_times(times, width) if t is None else np.asarray(t, float)
    out_freq = _phases(speeds, flat, shafts, out)[0]
    values = np.moveaxis(_design(knots, out) @ coefs.reshape(len(coefs), -1), 0, -1)
    return OrderTrack(
        data.name,
        flat,
        out,
        speeds[0].at(out)[0],
        out_freq,
        values.reshape(len(flat), len(rows), out.size) * (out_freq < USABLE * data.rate)[:, None, :],
        tuple(data.channels[i] for i in rows),
        out_freq < USABLE * data.rate,
        shafts,
        left,
        f"Vold-Kalman, {poles} poles, bandwidth {plain(width.min())} to {plain(width.max())} Hz",
        (*dict.fromkeys(note for s in speeds for note in s.notes), *faults),
    )


def _usable(data: TimeData, orders: FloatArray, freq: FloatArray) -> NDArray[np.bool_]:
    """Where the orders' frequencies (n_order, n) can be sampled; refuses an order that is so nowhere."""
    usable = freq < USABLE * data.rate
    nowhere = np.flatnonzero(~usable.any(axis=1))
    if nowhere.size:
        worst = int(nowhere[0])
        raise SignalError(
            f"recording {data.name!r}: order {plain(orders[worst])} lies from {freq[worst].min():.6g} Hz on, above "
            f"{USABLE} of the sampling rate {data.rate:.6g} Hz; leave the order out or sample faster",
            recording=data.name,
        )
    return usable


def _rows(data: TimeData) -> list[int]:
    return [i for i, c in enumerate(data.channels) if c.quantity not in ("tacho", "voltage")]


def _checked_orders(data: TimeData, speeds: list[Speed], given: Sequence[Any]) -> tuple[FloatArray, NDArray[np.int64]]:
    lists = [[float(o) for o in some] for some in given]
    if len(speeds) != len(lists) or not speeds:
        raise SignalError(f"{len(speeds)} speeds and {len(lists)} lists of orders do not fit; give one list per speed")
    flat = np.array([o for some in lists for o in some], dtype=float)
    shafts = np.array([i for i, some in enumerate(lists) for _ in some], dtype=np.int64)
    if not flat.size or not (np.isfinite(flat) & (flat > 0)).all():
        raise SignalError(f"recording {data.name!r}: orders {flat.tolist()} must be positive numbers, at least one")
    for i, some in enumerate(lists):
        if len(set(some)) < len(some):
            raise SignalError(f"recording {data.name!r}: orders {some} of shaft {i} hold one order twice; name it once")
    return flat, shafts


def _span(data: TimeData, speeds: list[Speed]) -> slice:
    """Samples of the record that all speeds cover."""
    start, stop = max(s.start for s in speeds), min(s.stop for s in speeds)
    first = max(0, int(np.ceil((start - data.t0) / data.dt - 1e-9)))
    last = min(data.n_samples - 1, int(np.floor((stop - data.t0) / data.dt + 1e-9)))
    if last - first < 8:
        raise SignalError(
            f"recording {data.name!r} reaches from {data.t0:.6g} to {data.t0 + data.duration:.6g} s, the speed from "
            f"{start:.6g} to {stop:.6g} s; they do not overlap, bring them to one time axis",
            recording=data.name,
            time=start,
        )
    return slice(first, last + 1)


def _phases(
    speeds: list[Speed], orders: FloatArray, shafts: NDArray[np.int64], times: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Frequency (n_order, n) Hz and phase (n_order, n) rad of every order."""
    both = [s.at(times) for s in speeds]
    freq = np.array([o * both[i][0] for o, i in zip(orders, shafts, strict=True)])
    return freq, np.array([o * both[i][1] for o, i in zip(orders, shafts, strict=True)])


def _width(speed: Speed, bandwidth: float | None, relative: float, poles: int, times: FloatArray) -> FloatArray:
    """Bandwidth (n,) Hz at every sample; refuses one that is none, and poles that cubic envelopes cannot have."""
    if poles not in (1, 2, 3):
        raise SignalError(f"a filter of {poles} poles is not made here; take 1, 2 or 3")
    if bandwidth is not None:
        width = np.full(times.size, float(bandwidth))
    else:
        width = relative * speed.at(times)[0]
    if not (np.isfinite(width).all() and width.min() > 0):
        raise SignalError(f"a bandwidth of {width.min():.6g} Hz tracks nothing; it must be positive")
    return width


def _refuse_short(data: TimeData, times: FloatArray, width: FloatArray) -> None:
    turns = float(width.mean() * (times[-1] - times[0]))
    if turns < 2:
        raise SignalError(
            f"recording {data.name!r}: {plain(times[-1] - times[0])} s with a speed are too short for a bandwidth of "
            f"{plain(width.mean())} Hz, which needs {plain(2 / width.mean())} s; widen the bandwidth or record longer",
            recording=data.name,
            time=float(times[0]),
        )


def _cumulated(times: FloatArray, width: FloatArray) -> FloatArray:
    steps = 0.5 * np.diff(times) * (width[1:] + width[:-1])
    return np.concatenate([[0.0], np.cumsum(steps)])


def _knots(times: FloatArray, width: FloatArray) -> FloatArray:
    """Knots of the envelopes, KNOTS to every 1/bandwidth but no closer than two samples."""
    grown = _cumulated(times, np.minimum(width, 0.5 / (KNOTS * (times[1] - times[0]))))
    count = max(4, int(np.ceil(KNOTS * grown[-1])))
    inner = np.interp(np.linspace(0, grown[-1], count + 1), grown, times)
    return np.concatenate([[inner[0]] * DEGREE, inner, [inner[-1]] * DEGREE])


def _output_times(times: FloatArray, width: FloatArray) -> FloatArray:
    dt = float(times[1] - times[0])
    step = dt * max(1.0, np.floor(1 / (OUTPUT * width.max() * dt)))
    return np.asarray(np.arange(times[0], times[-1] + 0.01 * dt, step)).clip(times[0], times[-1])


def _design(knots: FloatArray, times: FloatArray):  # type: ignore[no-untyped-def]
    return BSpline.design_matrix(np.clip(times, knots[0], knots[-1]), knots, DEGREE)


def _penalties(knots: FloatArray, lam: FloatArray, poles: int) -> FloatArray:
    """Integrals (n_int, 4, 4) of lambda B_i^(p) B_j^(p) over every knot interval."""
    inner = knots[DEGREE : len(knots) - DEGREE]
    h = np.diff(inner)
    u = np.array([0.1, 0.37, 0.63, 0.9])
    rows = _design(knots, (inner[:-1, None] + h[:, None] * u).ravel())
    # cubic of every spline on every interval from four points: powers (n_int, 4 powers, 4 splines)
    powers = np.linalg.solve(np.vander(u, 4, increasing=True)[None], rows.data.reshape(-1, 4, 4))
    D = np.zeros((4, 4))
    for a in range(poles, 4):
        for b in range(poles, 4):
            fall = np.prod([(a - k) * (b - k) for k in range(poles)])
            D[a, b] = fall / (a + b - 2 * poles + 1)
    return np.asarray(np.einsum("jai,ab,jbk->jik", powers, D, powers) * (lam * h ** (1.0 - 2 * poles))[:, None, None])


def _solve(
    name: str,
    times: FloatArray,
    x: FloatArray,
    phase: FloatArray,
    usable: NDArray[np.bool_],
    knots: FloatArray,
    lam: FloatArray,
    poles: int,
) -> tuple[NDArray[np.complex128], FloatArray]:
    """Spline coefficients (n_knots, n_order, n_ch) and the rms (n_ch,) of what is left."""
    n_order, n_ch = len(phase), len(x)
    q = 2 * n_order
    n_int = len(knots) - 2 * DEGREE - 1
    waves = np.empty((times.size, q))
    waves[:, 0::2], waves[:, 1::2] = (np.cos(phase) * usable).T, (-np.sin(phase) * usable).T
    splines = _design(knots, times).data.reshape(-1, 4)
    inner = knots[DEGREE : len(knots) - DEGREE]
    edges = np.searchsorted(times, inner[1:-1], side="left")
    edges = np.concatenate([[0], edges, [times.size]])
    middle = np.interp(0.5 * (inner[1:] + inner[:-1]), times, lam)
    penalty = _penalties(knots, middle, poles)
    size = (n_int + DEGREE) * q
    band = np.zeros((4 * q, size))
    right = np.zeros((size, n_ch))
    r, c = np.tril_indices(4 * q)
    eye = np.eye(q)
    for j in range(n_int):  # knot intervals: every sample of one touches the same four splines
        part = slice(edges[j], edges[j + 1])
        W = (splines[part, :, None] * waves[part, None, :]).reshape(-1, 4 * q)
        G = W.T @ W + np.kron(penalty[j], eye)
        band[r - c, j * q + c] += G[r, c]
        right[j * q : (j + 4) * q] += W.T @ x[:, part].T
    band[0] *= 1 + 1e-12
    try:
        found = cho_solve_banded((cholesky_banded(band, lower=True), True), right)
    except LinAlgError:
        raise SignalError(
            f"recording {name!r}: the {n_order} orders cannot be told apart anywhere in {plain(times[-1] - times[0])} "
            "s; track fewer, or with a smaller bandwidth",
            recording=name,
        ) from None
    left = x.copy()
    for j in range(n_int):
        part = slice(edges[j], edges[j + 1])
        W = (splines[part, :, None] * waves[part, None, :]).reshape(-1, 4 * q)
        left[:, part] -= (W @ found[j * q : (j + 4) * q]).T
    found = found.reshape(-1, n_order, 2, n_ch)
    return found[:, :, 0] + 1j * found[:, :, 1], np.sqrt((left**2).mean(axis=1))
