"""From a recording to the signals an output-only identification works on: channels, band, rate, scale."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import signal

from femend.data import Channel, TimeData
from femend.data._arrays import frozen
from femend.dof import Dof
from femend.errors import RecordingError

__all__ = ["Signals", "motion_rows", "moving_rows", "prepare_signals"]

MOTIONS = ("displacement", "velocity", "acceleration")
# Times d/dt from displacement; shapes of mixed sensors are brought to displacement by s**-power.
POWER = {"displacement": 0, "velocity": 1, "acceleration": 2}
# The kept rate is at least this many times the upper band edge: the anti-alias filter rolls off between the edge and
# rate - edge, so that nothing folds back into the band.
RATE_OVER_EDGE = 2.8
STOP_DB = 80.0
# What moves less than this share of the liveliest channel is rounding, of a sensor that is dead or in a plane that
# nothing drives; and so is what moves less than the second share of the largest value.
STILL, ROUNDING = 1e-9, 1e-14
# A record touches its extreme value once, a coarsely digitised one a few times; a converter at its end does often.
CLIPPED = 10


@dataclass(frozen=True, slots=True, eq=False)
class Signals:
    """Responses ready for identification: `y` (n_ch, n_samples) of zero mean and unit standard deviation, `scale`
    (n_ch,) the standard deviations taken out, `dt` in s after decimation by `factor`, `band` in Hz, `channels` and
    their places `dofs`, `power` (n_ch,) the order of the time derivative each channel measures, `duration` in s of
    the whole recording, `notes` what was found on the way."""

    name: str
    dt: float
    y: NDArray[np.float64]
    scale: NDArray[np.float64]
    channels: tuple[Channel, ...]
    dofs: tuple[Dof, ...]
    power: NDArray[np.int64]
    band: tuple[float, float]
    duration: float
    factor: int
    notes: tuple[str, ...] = ()

    @property
    def n_ch(self) -> int:
        """Number of channels."""
        return int(self.y.shape[0])

    @property
    def rate(self) -> float:
        """Sampling rate after decimation, in Hz."""
        return 1.0 / self.dt

    def to_shapes(self, observed: NDArray[np.complex128], poles: NDArray[np.complex128]) -> NDArray[np.complex128]:
        """Shapes (n_ch, n_modes) of motion from those `observed` (n_ch, n_modes) in the scaled signals.

        The scale is put back, and where channels of several quantities are mixed, all rows become displacement by
        s**-power with s the `poles` (n_modes,) in rad/s.
        """
        shapes = observed * self.scale[:, None]
        if np.unique(self.power).size > 1:
            shapes = shapes / poles[None, :] ** self.power[:, None]
        return shapes


def motion_rows(data: TimeData) -> list[int]:
    """Rows of `data` that measure a motion at a DOF; raises RecordingError where there are none."""
    rows = [i for i in data.rows(*MOTIONS) if data.channels[i].dof is not None]
    if not rows:
        raise RecordingError(
            f"recording {data.name!r}: none of its {len(data.channels)} channels is a displacement, velocity or "
            "acceleration with a DOF; name the sensors' DOFs (a channel map does it)",
            recording=data.name,
        )
    return rows


def moving_rows(data: TimeData) -> list[int]:
    """Rows of `data` that measure a motion at a DOF and move; raises RecordingError where there are none."""
    rows = motion_rows(data)
    values = data.values[rows]
    spread = signal.detrend(values, axis=1).std(axis=1)
    least = max(STILL * spread.max(), ROUNDING * np.abs(values).max())
    moving = [row for row, moved in zip(rows, spread > least, strict=True) if moved]
    if not moving:
        raise RecordingError(
            f"recording {data.name!r}: none of its {len(rows)} motion channels moves; check that the recorder was fed",
            recording=data.name,
        )
    return moving


def prepare_signals(
    data: TimeData, band: tuple[float, float] | None = None, *, remove: NDArray[np.float64] | None = None
) -> Signals:
    """Picks the motion channels of `data` that move, decimates them to the `band` (Hz) and scales them to unit
    deviation; those that stand still are left out, and noted: they would be a node of every shape.

    Without a band it is 0 to 80 % of the Nyquist frequency. `remove` (n_ch, n_samples) is subtracted before (signals
    of rotating harmonics). The trend over the recording is taken out; with a lower band edge above 0 also what lies
    under half of it. Raises RecordingError for no motion channel with a DOF that moves, or a band that the sampling
    does not reach.
    """
    rows = moving_rows(data)
    channels = tuple(data.channels[i] for i in rows)
    low, high = _checked_band(data, band)
    y = data.values[rows] if remove is None else data.values[rows] - remove[rows]
    y = signal.detrend(y, axis=1)
    notes = (*_still(data, rows), *_look(data, channels, y))
    if low > 0:
        y = signal.sosfiltfilt(signal.butter(2, low / 2, "highpass", fs=data.rate, output="sos"), y, axis=1)
    factor = max(1, int(data.rate / (RATE_OVER_EDGE * high)))
    y = _decimate(y, factor, high, data.rate)
    scale = y.std(axis=1)
    return Signals(
        data.name,
        data.dt * factor,
        frozen(y / scale[:, None]),
        frozen(scale),
        channels,
        tuple(c.dof for c in channels if c.dof is not None),
        frozen([POWER[c.quantity] for c in channels], np.int64),
        (low, high),
        data.duration,
        factor,
        notes,
    )


def _checked_band(data: TimeData, band: tuple[float, float] | None) -> tuple[float, float]:
    low, high = (0.0, 0.4 * data.rate) if band is None else (float(band[0]), float(band[1]))
    if not 0 <= low < high:
        raise RecordingError(
            f"recording {data.name!r}: the band {low:.6g} to {high:.6g} Hz is empty; give (lower, upper) in Hz",
            recording=data.name,
        )
    if high > 0.45 * data.rate:
        raise RecordingError(
            f"recording {data.name!r}: the band ends at {high:.6g} Hz, but {data.rate:.6g} Hz sampling carries modes "
            f"up to {0.45 * data.rate:.6g} Hz; lower the upper edge or sample faster",
            recording=data.name,
        )
    return low, high


def _still(data: TimeData, moving: Sequence[int]) -> list[str]:
    """A note on the motion channels that do not move, rows `moving` being those that do."""
    still = [data.channels[row].text for row in motion_rows(data) if row not in moving]
    if not still:
        return []
    which = f"channel {still[0]} does" if len(still) == 1 else f"channels {', '.join(still)} do"
    return [f"{which} not move: left out (dead, or in a plane that nothing drives)"]


def _look(data: TimeData, channels: tuple[Channel, ...], y: NDArray[np.float64]) -> tuple[str, ...]:
    """Notes on clipped and doubled channels of `y` (n_ch, n_samples)."""
    spread = y.std(axis=1)
    notes = []
    for i, channel in enumerate(channels):
        raw = data.values[data.channels.index(channel)]
        for end in (raw.max(), raw.min()):
            at = raw == end
            count = int(at.sum())
            if count >= CLIPPED and np.abs(end - raw.mean()) > 2 * spread[i]:
                first = data.t0 + data.dt * int(np.argmax(at))
                notes.append(
                    f"channel {channel.text} stays at {end:.6g} {channel.unit} for {count} samples, first at "
                    f"{first:.6g} s: it looks clipped, which adds false harmonics and lowers its shape"
                )
    correlation = np.corrcoef(y) if len(channels) > 1 else np.ones((1, 1))
    for i, j in zip(*np.nonzero(np.triu(np.abs(correlation) > 1 - 1e-9, 1))):
        notes.append(f"channels {channels[i].text} and {channels[j].text} carry the same signal")
    return tuple(notes)


def _decimate(y: NDArray[np.float64], factor: int, high: float, rate: float) -> NDArray[np.float64]:
    """Every `factor`-th sample of `y` (n_ch, n_samples) after a linear-phase filter that keeps up to `high` Hz."""
    if factor == 1:
        return y
    stop = rate / factor - high
    n_taps, beta = signal.kaiserord(STOP_DB, (stop - high) / (rate / 2))
    taps = signal.firwin(n_taps | 1, (stop + high) / 2, window=("kaiser", beta), fs=rate)
    return signal.oaconvolve(y, taps[None, :], mode="same", axes=1)[:, ::factor]
