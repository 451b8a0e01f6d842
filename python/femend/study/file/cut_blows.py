"""Blows that were not recorded whole: their top cut off by the range of the channel, or their beginning by a trigger.

A model answers the force that was recorded. What is missing of it is missing at all sensors as if a force acted where
the hammer strikes, so that laws there, and whatever else moves alike, seem to be what the model lacks.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from femend.data import Recording, Remark, Test, TimeData
from femend.numerals import listed, plain
from femend.signal.suited import blows

__all__ = ["cut_blows", "left_out", "none_whole", "of_whole_blows", "without_cut_blows"]

# the step into a flat top, as a share of the peak: that of a pulse which happens to have two equal samples at its top,
# or whose crest quantisation flattens, is none
STEP = 0.01
# shares of the peak within which samples are equal
EQUAL = 1e-6
# share of its peak at which a blow stands at the first sample where a trigger cut its beginning off: below a fifth of
# the peak less than 2 % of the impulse of a half sine or a cosine bell is missing
BEGUN = 0.2
# faults of what is said of them
CUT_OFF, BEGUN_BEFORE = "blow cut off", "blow begun"


def cut_blows(recording: Recording) -> list[str]:
    """What is said of blows in a time `recording` that were not recorded whole; nothing of other recordings."""
    if not recording.is_time or recording.excitation != "measured":
        return []
    data = recording.time
    if not blows(data).size:
        return []
    row = data.rows("force")[0]
    x = data.values[row] - np.median(data.values[row])
    x = x if x.max() >= -x.min() else -x
    told: list[str] = []
    flat, begun = _flat_top(x), float(x[0] / x.max())
    if flat is not None:
        first, last = flat
        said = (
            f"stays at its peak of {plain(float(x[first]))} {data.channels[row].unit} from {_time(data, first)} to "
            f"{_time(data, last)} s, into which it steps: the blow is cut off by the channel's range, and no model "
            "answers a force that was not recorded. Strike softer or widen the range, and leave such blows out"
        )
        told.append(Remark(recording.name, said, data.channels[row].text, CUT_OFF))
    if begun > BEGUN:
        said = (
            f"stands at {plain(100 * begun, 2)} % of its peak at the first sample: the recording begins within the "
            "blow, and what it did before, which the structure answers as well, is not known. Record with a "
            "pre-trigger, and leave such blows out"
        )
        told.append(Remark(recording.name, said, data.channels[row].text, BEGUN_BEFORE))
    return told


def of_whole_blows(recordings: Sequence[Recording]) -> list[Recording]:
    """The `recordings` of whose blows, if any, nothing was said when they were read; all of them where none are so."""
    return [r for r in recordings if not _is_cut(r)] or list(recordings)


def without_cut_blows(test: Test) -> Test:
    """`test` without the fit recordings that are left out for their blows."""
    fit = [r for r in test if r.role == "fit"]
    used = of_whole_blows(fit)
    return test if len(used) == len(fit) else Test(tuple(r for r in test if r.role != "fit" or r in used))


def none_whole(recordings: Sequence[Recording]) -> list[str]:
    """What is said where of the `recordings` that are fitted none has blows that were recorded whole."""
    if not recordings or not all(_is_cut(r) for r in recordings):
        return []
    return [
        "of no fit recording the blows were recorded whole (each is told): what is missing of the forces looks like "
        "something that acts where the hammer strikes; strike again"
    ]


def left_out(recordings: Sequence[Recording]) -> list[str]:
    """What is said where some of the `recordings` that are fitted are left out for their blows."""
    used = of_whole_blows(recordings)
    out = [r.name for r in recordings if r not in used]
    if not out:
        return []
    one = len(out) == 1
    return [
        f"recording{'' if one else 's'} {listed([repr(name) for name in out], 6)} {'is' if one else 'are'} not fitted, "
        f"since {'its' if one else 'their'} blows were not recorded whole"
    ]


def _is_cut(recording: Recording) -> bool:
    return any(isinstance(text, Remark) and text.fault in (CUT_OFF, BEGUN_BEFORE) for text in recording.warnings)


def _flat_top(x: NDArray[np.float64]) -> tuple[int, int] | None:
    """First and last sample of the first flat top of a force x (n,) whose largest value is its peak; None without."""
    peak = float(x.max())
    top = np.append(x >= peak * (1 - EQUAL), False)
    for i in np.flatnonzero(top[:-1] & top[1:]):
        last = int(i) + int(np.argmin(top[i:])) - 1
        if i == 0 or top[i - 1] or last + 1 == x.size or peak - x[i - 1] <= STEP * peak:
            continue
        # a pulse without noise that is sampled to both sides of its crest alike has two equal samples, and equal flanks
        if last > i + 1 or abs(x[i - 1] - x[last + 1]) > EQUAL * peak:
            return int(i), last
    return None


def _time(data: TimeData, sample: int) -> str:
    return f"{data.t0 + sample * data.dt:.6g}"
