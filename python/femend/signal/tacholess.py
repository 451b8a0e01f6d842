"""Speed of a shaft from the orders in its vibration, where a rough speed is known."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray
from scipy.interpolate import BSpline, make_lsq_spline
from scipy.ndimage import median_filter
from scipy.signal import get_window

from femend.data import Speed, TimeData
from femend.errors import SignalError
from femend.numerals import plain
from femend.signal.angular import AngleData, resample_angle
from femend.signal.tacho import speed_from_profile

__all__ = ["refine_speed"]

FloatArray = NDArray[np.float64]

# finer lines than the frame's own by zero padding; changes tried within the range; share of the range left per round
PADDING, TRIED, SHRINK = 8, 201, 0.25
# mean of log(1 + P / median P) of noise, 2 E1(ln 2)
QUIET = 0.757
# smallest gain over that, in nepers, of the mean over K orders and channels: SEEN / sqrt K + SEEN_LEAST is
# passed by some three in a thousand frames of white noise; and the share of the frames that must pass it
SEEN, SEEN_LEAST, FRAMES = 2.2, 0.05, 0.03
# price of a change of the correction from frame to frame by the whole resolution of a frame, per order and channel
STIFF = 1.0


def refine_speed(
    data: TimeData,
    rough: Speed,
    orders: Sequence[float] = (1.0, 2.0, 3.0, 4.0),
    *,
    span: float = 0.1,
    revolutions: float = 16.0,
    rounds: int = 3,
    channels: Sequence[int] | None = None,
) -> Speed:
    """The speed near `rough` that puts most power on `orders` of the responses of `data`.

    In frames of `revolutions` of the rough angle, the factor 1 + c on the speed with the largest sum of
    log(1 + power on the order / power around it) over orders and channels is sought, |c| <= `span`, so that neither one
    strong order nor a resonance decides alone; the path through all frames is the best one under a price for jumps
    (dynamic programming), smoothed by a spline. This is done `rounds` times with frames and range adapted, each time
    over the angle of the round before. Zhao et al., Mech. Syst. Signal Process. 39 (2013) 1, sec. 3, on tacholess
    tracking by the ridge of an order; here all orders vote.

    The angle is counted from the beginning: phases between channels are right, those against the shaft are unknown.
    `channels` are rows, by default all responses. The result begins where `rough` does or where orders are seen first
    and ends where they are last seen; a note says so.

    Raises SignalError where no frame shows orders (naming how strong they are), for orders that are none, a `span` not
    between 0 and 0.5, and what `resample_angle` raises.
    """
    chosen = np.asarray(list(orders), float)
    if not chosen.size or not (np.isfinite(chosen) & (chosen > 0)).all():
        raise SignalError(f"orders {chosen.tolist()} must be positive numbers, at least one", recording=data.name)
    if not 0 < span < 0.5:
        raise SignalError(f"a span of {span} is not between 0 and 0.5", recording=data.name)
    current, reach = rough, float(span)
    seen: tuple[float, float] = (rough.start, rough.stop)
    for step in range(rounds):
        over = resample_angle(data, current, float(chosen.max()) * (1 + reach), channels=channels)
        middle, score, tried, fine = _scores(over, chosen, revolutions, reach)
        gain = score.max(axis=1) - QUIET
        seen_from = SEEN / np.sqrt(chosen.size * len(over.values)) + SEEN_LEAST
        good = gain > (seen_from if step == rounds - 1 else 0.0)  # a speed that is wrong still smears its orders
        if good.sum() < max(3, FRAMES * good.size):
            raise SignalError(
                f"recording {data.name!r}: orders {chosen.tolist()} of the speed {rough.source!r} stand out by "
                f"{plain(gain.max(), 2)} nepers at most and above {plain(seen_from, 2)} in {good.sum()} of {good.size} "
                f"frames; check the rough speed, span and orders",
                recording=data.name,
            )
        path = _path(score, tried, fine)
        t = over.t[middle]
        seen = (float(t[good][0]), float(t[good][-1]))
        factor = _smoothed(t, path, np.where(good, gain, 0.0))
        times = current.t
        rev = current.rev_per_s * (1 + factor(np.clip(times, *seen)))
        current = speed_from_profile(times, rev, source=f"orders near {rough.source}")
        reach = max(SHRINK * reach, 2 * fine)
    half = 0.5 * revolutions / float(current.at(np.array([0.5 * (seen[0] + seen[1])]))[0][0])
    first, last = max(seen[0] - half, rough.start), min(seen[1] + half, rough.stop)
    note = f"orders are seen from {plain(first)} to {plain(last)} s"
    return replace(current, notes=(*current.notes, note, "no tacho: phases against the shaft are unknown"))


def _scores(
    over: AngleData, orders: FloatArray, revolutions: float, reach: float
) -> tuple[NDArray[np.int64], FloatArray, FloatArray, float]:
    """Middles of the frames, score (n_frames, n_tried) per order and channel, changes tried, and resolution."""
    n = int(round(revolutions * over.per_rev))
    hop = max(1, n // 4)
    if over.angle.size < n + 2 * hop:
        raise SignalError(
            f"recording {over.name!r} holds {plain(over.angle.size / over.per_rev)} revolutions, fewer than three "
            f"frames of "
            f"{plain(revolutions)}; shorten them",
            recording=over.name,
        )
    starts = np.arange(0, over.angle.size - n + 1, hop)
    window = np.asarray(get_window("hann", n), float)
    size = PADDING * n
    per_order = size / over.per_rev
    tried = np.linspace(-reach, reach, TRIED)
    at = np.outer(1 + tried, orders) * per_order  # (n_tried, n_order) places on the padded lines
    lower = at.astype(np.int64)
    share = at - lower
    top = int(lower.max()) + 2
    score = np.zeros((starts.size, TRIED))
    visible = orders * over.speed[starts + n // 2][:, None] * (1 + reach) < 0.45 * over.rate
    for x in over.values:
        for first in range(0, starts.size, 64):
            part = slice(first, first + 64)
            frames = sliding_window_view(x, n)[starts[part]] * window
            power = np.abs(np.fft.rfft(frames, size, axis=1)[:, :top]) ** 2
            # the floor: half an order around each place, the lines of the order itself being few of them
            floor = median_filter(power[:, ::PADDING], size=(1, max(3, int(revolutions))), mode="nearest")
            rows = np.arange(len(power))[:, None, None]
            on = power[rows, lower] * (1 - share) + power[rows, lower + 1] * share
            ground = floor[rows, np.minimum(lower // PADDING, floor.shape[1] - 1)]
            gains = np.log1p(on / np.maximum(ground, 1e-300 + 1e-12 * power.max()))
            score[part] += (gains * visible[part][:, None, :]).sum(axis=2)
    count = np.maximum(visible.sum(axis=1), 1) * len(over.values)
    finest = 1 / (revolutions * float(orders.max()))
    return starts + n // 2, score / count[:, None], tried, finest


def _path(score: FloatArray, tried: FloatArray, fine: float) -> FloatArray:
    """The changes (n_frames,) with the largest sum of scores less the price of their jumps, between lines refined."""
    apart = (tried[:, None] - tried[None, :]) / fine
    price = STIFF * np.minimum(apart**2, 25.0) * 0.25
    best = score[0]
    back = np.zeros(score.shape, np.int64)
    for k in range(1, len(score)):  # frames: some hundreds
        total = best[None, :] - price
        back[k] = np.argmax(total, axis=1)
        best = score[k] + total[np.arange(len(tried)), back[k]]
    at = np.empty(len(score), np.int64)
    at[-1] = int(np.argmax(best))
    for k in range(len(score) - 1, 0, -1):
        at[k - 1] = back[k, at[k]]
    inner = np.clip(at, 1, len(tried) - 2)
    rows = np.arange(len(score))
    left, middle, right = score[rows, inner - 1], score[rows, inner], score[rows, inner + 1]
    bend = np.minimum(left - 2 * middle + right, -1e-12)
    step = np.where(at == inner, np.clip(0.5 * (left - right) / bend, -1, 1), 0.0)
    return np.asarray(tried[at] + step * (tried[1] - tried[0]))


def _smoothed(t: FloatArray, path: FloatArray, weight: FloatArray) -> BSpline:
    """Cubic spline with a knot every four frames, weighted by how clearly orders are seen; straight for few frames."""
    count = len(t) // 4
    degree = 3 if len(t) >= 8 else 1
    places = np.linspace(0, len(t) - 1, max(count, 1) + 1)[1:-1]
    knots = np.concatenate([[t[0]] * (degree + 1), np.interp(places, np.arange(len(t)), t), [t[-1]] * (degree + 1)])
    floor = 1e-3 * float(weight.max())
    return make_lsq_spline(t, path, knots, degree, w=np.sqrt(np.maximum(weight, floor)))
