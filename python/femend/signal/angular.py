"""Order tracking by angular resampling: records over the shaft's angle, order spectra, orders fitted frame by frame."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray
from scipy.signal import firwin, get_window, resample_poly

from femend.data import Channel, OrderTrack, Speed, TimeData
from femend.errors import SignalError
from femend.numerals import plain
from femend.signal.check import notes_of
from femend.signal.resample import sample_at

__all__ = ["AngleData", "angular_orders", "order_spectra", "resample_angle"]

FloatArray = NDArray[np.float64]

# samples per revolution over twice the highest order; most samples of a record over the angle
MARGIN, MOST = 1.28, 30_000_000
# taps of the filter over the angle for every sample it keeps; condition from which orders of a frame are one
TAPS, ONE_ORDER = 40, 20.0
# highest usable frequency as a share of the sampling rate
USABLE = 0.48


@dataclass(frozen=True, slots=True, eq=False)
class AngleData:
    """Records `values` (n_ch, n) at even steps of the shaft's angle: `angle` (n,) rad, at `t` (n,) s and `speed` (n,)
    rev/s; `per_rev` samples to a revolution, the first one at a whole multiple of their step."""

    name: str
    values: FloatArray
    angle: FloatArray
    t: FloatArray
    speed: FloatArray
    per_rev: int
    rate: float
    channels: tuple[Channel, ...]
    notes: tuple[str, ...] = ()


def resample_angle(
    data: TimeData, speed: Speed, max_order: float = 10.0, *, channels: Sequence[int] | None = None
) -> AngleData:
    """`data` at even steps of the angle of `speed`, with all up to `max_order` and nothing folded from above.

    The record is interpolated at steps fine enough for its whole band at the lowest speed, low-passed over the angle
    and thinned: a filter of fixed order, as orders ask for (Fyfe and Munck, Mech. Syst. Signal Process. 11 (1997) 187).
    `channels` are rows, by default all but tachos and voltages. Raises SignalError for a dead channel, where record
    and speed do not overlap by a revolution, `max_order` is not positive, or the slowest speed asks for more than 3e7
    samples.
    """
    if not (np.isfinite(max_order) and max_order > 0):
        raise SignalError(f"a highest order of {max_order} is none; it must be positive", recording=data.name)
    rows = [i for i, c in enumerate(data.channels) if c.quantity not in ("tacho", "voltage")]
    rows = rows if channels is None else list(channels)
    notes = notes_of(data, rows)
    start = max(speed.start, data.t0)
    stop = min(speed.stop, data.t0 + (data.n_samples - 1) * data.dt)
    if stop <= start:
        raise SignalError(
            f"recording {data.name!r} ends before the speed begins or after it ends; bring them to one time axis",
            recording=data.name,
        )
    inside = (speed.t >= start) & (speed.t <= stop)
    times = np.concatenate([[start], speed.t[inside], [stop]])
    times = np.asarray(times, dtype=np.float64)
    rev, angle = speed.at(times)
    per_rev = max(8, 1 << int(np.ceil(np.log2(2 * MARGIN * max_order))))
    finer = max(1, int(np.ceil(data.rate / (per_rev * max(float(rev.min()), 1e-300)))))
    step = 2 * np.pi / (per_rev * finer)
    first, last = int(np.ceil(angle[0] / step)), int(np.floor(angle[-1] / step))
    first = -(-first // finer) * finer
    _refuse_angles(data, last - first, per_rev * finer, float(rev.min()), float(times[int(np.argmin(rev))]))
    fine = np.asarray(step * np.arange(first, last + 1), dtype=np.float64)
    t_fine = _times(speed, fine, times, angle)
    values = sample_at(data.values[rows], data.dt, np.clip(t_fine, start, stop), t0=data.t0)
    if finer > 1:
        # pass band flat to 1e-4 and nothing folded below 0.87 of the new Nyquist order
        low_pass = firwin(TAPS * finer + 1, 1 / finer, window=("kaiser", 8.0))
        values = resample_poly(values, 1, finer, axis=1, padtype="line", window=low_pass)  # type: ignore[call-overload]
    t = t_fine[::finer]
    return AngleData(
        data.name,
        values[:, : t.size],
        fine[::finer],
        t,
        speed.at(np.clip(t, start, stop))[0],
        per_rev,
        data.rate,
        tuple(data.channels[i] for i in rows),
        (*speed.notes, *notes),
    )


def _refuse_angles(data: TimeData, count: int, turn: int, slowest: float, at: float) -> None:
    """Refuses `count` samples over the angle, `turn` to a revolution, where they are too few or too many."""
    if count < turn:
        raise SignalError(
            f"recording {data.name!r} holds {plain(count / turn, 3)} revolutions; at least 1 is needed",
            recording=data.name,
        )
    if count > MOST:
        raise SignalError(
            f"recording {data.name!r}: the slowest speed of {plain(slowest)} rev/s asks for {count} samples over the "
            f"angle, "
            f"more than {MOST}; cut the slow part away",
            recording=data.name,
            time=at,
        )


def _times(speed: Speed, wanted: FloatArray, times: FloatArray, angle: FloatArray) -> FloatArray:
    """Times at which the shaft has the angles `wanted`: interpolated, then Newton."""
    t = np.interp(wanted, angle, times)
    for _ in range(3):
        rev, at = speed.at(t)
        t = np.clip(t + (wanted - at) / (2 * np.pi * np.maximum(rev, 1e-12)), times[0], times[-1])
    return t


def angular_orders(
    data: TimeData,
    speed: Speed,
    orders: Sequence[float],
    *,
    revolutions: float = 8.0,
    overlap: float = 0.75,
    channels: Sequence[int] | None = None,
) -> OrderTrack:
    """Complex amplitudes of `orders` from frames of `revolutions` under a Hann window, all orders of a frame together.

    Least squares over the frame's samples, so that orders closer than the window's resolution do not leak into each
    other as long as they differ by some 1/`revolutions`. Amplitudes are means over a frame. `speed`, `channels` as in
    `resample_angle`; frames overlap by `overlap`. Raises SignalError for orders that are not positive, equal, or too
    close, frames longer than the record, and what `resample_angle` raises.
    """
    chosen = np.asarray(list(orders), float)
    if not chosen.size or not (np.isfinite(chosen) & (chosen > 0)).all() or np.unique(chosen).size < chosen.size:
        raise SignalError(f"orders {chosen.tolist()} must be positive and different", recording=data.name)
    over = resample_angle(data, speed, float(chosen.max()), channels=channels)
    n, starts = _frames(over, revolutions, overlap)
    window = np.asarray(get_window("hann", n), float)
    local = np.outer(2 * np.pi * np.arange(n) / over.per_rev, chosen)
    basis = np.hstack([np.cos(local), -np.sin(local), np.ones((n, 1))])
    root = np.sqrt(window)[:, None]
    if np.linalg.cond(basis * root) > ONE_ORDER:
        raise SignalError(
            f"recording {data.name!r}: orders {chosen.tolist()} cannot be told apart in {plain(revolutions)} "
            "revolutions; take longer frames or the Vold-Kalman filter",
            recording=data.name,
        )
    kernel = np.linalg.pinv(basis * root) * root.T
    fitted = _apply(over.values, kernel, n, starts)  # (n_ch, n_frames, 2 n_order + 1)
    values = fitted[..., : chosen.size] + 1j * fitted[..., chosen.size : 2 * chosen.size]
    values = values * np.exp(-1j * np.outer(over.angle[starts], chosen))
    return _track(over, chosen, np.moveaxis(values, 2, 0), n, starts, f"angular, {plain(revolutions)} revolutions")


def order_spectra(
    data: TimeData,
    speed: Speed,
    max_order: float = 10.0,
    *,
    revolutions: int = 8,
    overlap: float = 0.75,
    window: str = "hann",
    channels: Sequence[int] | None = None,
) -> OrderTrack:
    """Order spectra up to `max_order` along the run: the orders k/`revolutions`, with phase against the tacho.

    Transforms of frames of whole `revolutions` over the angle of `speed` under `window` (any of scipy's), overlapping
    by `overlap`; amplitudes are peaks, so that an order on a line shows with its own. `channels` are rows as in
    `resample_angle`, which also says what SignalError is raised for.
    """
    over = resample_angle(data, speed, max_order, channels=channels)
    n, starts = _frames(over, float(int(revolutions)), overlap)
    shape = np.asarray(get_window(window, n), float)
    lines = np.arange(1, int(np.floor(max_order * revolutions)) + 1)
    chosen = lines / int(revolutions)
    values = np.empty((chosen.size, len(over.values), starts.size), complex)
    turn = np.exp(-1j * np.outer(chosen, over.angle[starts]))
    for row, x in enumerate(over.values):
        frames = sliding_window_view(x, n)[starts]
        frames = (frames - frames.mean(axis=1, keepdims=True)) * shape
        values[:, row] = np.fft.rfft(frames, axis=1)[:, lines].T * (2 / shape.sum()) * turn
    return _track(over, chosen, values, n, starts, f"order spectra, {int(revolutions)} revolutions, {window}")


def _frames(over: AngleData, revolutions: float, overlap: float) -> tuple[int, NDArray[np.int64]]:
    n = int(round(revolutions * over.per_rev))
    if not 0 <= overlap < 1 or n < 2 or n > over.angle.size:
        raise SignalError(
            f"recording {over.name!r} holds {plain(over.angle.size / over.per_rev)} revolutions; frames of "
            f"{plain(revolutions)} "
            f"with an overlap of {overlap} do not fit, shorten them",
            recording=over.name,
        )
    hop = max(1, int(round(n * (1 - overlap))))
    return n, np.arange(0, over.angle.size - n + 1, hop)


def _apply(values: FloatArray, kernel: FloatArray, n: int, starts: NDArray[np.int64]) -> FloatArray:
    return np.array([sliding_window_view(x, n)[starts] @ kernel.T for x in values])


def _track(
    over: AngleData,
    orders: FloatArray,
    values: NDArray[np.complex128],
    n: int,
    starts: NDArray[np.int64],
    method: str,
) -> OrderTrack:
    middle = starts + n // 2
    t, speed = over.t[middle], over.speed[middle]
    freq = orders[:, None] * speed
    top = orders[:, None] * np.maximum.reduce([over.speed[starts], over.speed[middle], over.speed[starts + n - 1]])
    usable = top < USABLE * over.rate
    return OrderTrack(
        over.name,
        orders,
        t,
        speed,
        freq,
        values * usable[:, None, :],
        over.channels,
        usable,
        method=method,
        notes=over.notes,
    )
