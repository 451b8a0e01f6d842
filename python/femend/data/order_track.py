"""Complex amplitudes of orders over time and speed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from femend.data._arrays import frozen
from femend.data.channel import Channel
from femend.errors import RecordingError
from femend.numerals import plain

__all__ = ["OrderTrack"]


@dataclass(frozen=True, slots=True, eq=False)
class OrderTrack:
    """Orders of a run: channel c holds the sum over k of Re(values[k, c] exp(i orders[k] angle)).

    Attributes:
        name: of the recording.
        orders: (n_order,) multiples of the shaft's speed; `shafts` (n_order,) the number of the shaft.
        t: (n_time,) s, increasing.
        speed: (n_time,) rev/s of shaft 0.
        freq: (n_order, n_time) Hz of every order.
        values: (n_order, n_ch, n_time) complex peak amplitudes in the channels' units; phase 0 is a cosine with its
            crest at the tacho's pulse.
        channels: (n_ch,) labels; the sign of a sensor's DOF is not applied.
        usable: (n_order, n_time) False where the order lies outside what the record can show; values are 0 there.
        residual: (n_ch,) rms of what the orders leave, or None.
        method: how it was found; `notes` say what to mind.

    Arrays are read-only. Raises RecordingError for shapes that do not fit, values that are not finite (naming channel
    and time), or a time axis that does not increase.
    """

    name: str
    orders: NDArray[np.float64]
    t: NDArray[np.float64]
    speed: NDArray[np.float64]
    freq: NDArray[np.float64]
    values: NDArray[np.complex128]
    channels: tuple[Channel, ...]
    usable: NDArray[np.bool_] | None = None
    shafts: NDArray[np.int64] | None = None
    residual: NDArray[np.float64] | None = None
    method: str = ""
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for key in ("orders", "t", "speed", "freq"):
            object.__setattr__(self, key, frozen(getattr(self, key), np.float64))
        object.__setattr__(self, "values", frozen(self.values, np.complex128))
        object.__setattr__(self, "channels", tuple(self.channels))
        object.__setattr__(self, "notes", tuple(self.notes))
        n_order, n_time = self.orders.size, self.t.size
        usable = np.ones((n_order, n_time), bool) if self.usable is None else self.usable
        shafts = np.zeros(n_order, np.int64) if self.shafts is None else self.shafts
        object.__setattr__(self, "usable", frozen(usable, np.bool_))
        object.__setattr__(self, "shafts", frozen(shafts, np.int64))
        wanted = {
            "speed": (n_time,),
            "freq": (n_order, n_time),
            "values": (n_order, len(self.channels), n_time),
            "usable": (n_order, n_time),
            "shafts": (n_order,),
        }
        if self.residual is not None:
            object.__setattr__(self, "residual", frozen(self.residual, np.float64))
            wanted["residual"] = (len(self.channels),)
        for key, shape in wanted.items():
            if getattr(self, key).shape != shape:
                raise RecordingError(
                    f"order track {self.name!r}: {key} of shape {getattr(self, key).shape} is not {shape}",
                    recording=self.name,
                )
        if n_time > 1 and np.diff(self.t).min() <= 0:
            raise RecordingError(f"order track {self.name!r}: the time axis does not increase", recording=self.name)
        self._refuse_gaps()

    def _refuse_gaps(self) -> None:
        bad = ~np.isfinite(self.values)
        if bad.any():
            order, row, at = (int(i[0]) for i in np.nonzero(bad))
            raise RecordingError(
                f"order track {self.name!r}: order {plain(self.orders[order])} of {self.channels[row].text} is not a "
                f"number at {self.t[at]:.6g} s; leave the channel or the time out",
                recording=self.name,
                channel=self.channels[row].text,
            )

    @property
    def n_orders(self) -> int:
        """Number of orders."""
        return int(self.orders.size)

    def index(self, order: float, shaft: int = 0) -> int:
        """Position of the order nearest `order` of `shaft`; raises KeyError where none is within 1e-6 of it."""
        assert self.shafts is not None
        own = np.flatnonzero(self.shafts == shaft)
        if own.size:
            best = int(own[np.argmin(np.abs(self.orders[own] - order))])
            if abs(float(self.orders[best]) - order) <= 1e-6 * max(1.0, abs(order)):
                return best
        there = ", ".join(plain(o) for o in self.orders[own])
        raise KeyError(f"order {order:.6g} of shaft {shaft} was not tracked in {self.name!r}; there are {there}")

    def order(self, order: float, shaft: int = 0) -> NDArray[np.complex128]:
        """Amplitudes (n_ch, n_time) of `order` of `shaft`; raises KeyError where it was not tracked."""
        return self.values[self.index(order, shaft)]

    def between(self, start: float, stop: float) -> OrderTrack:
        """The track from `start` to `stop` in s; raises RecordingError where nothing lies there."""
        keep = (self.t >= start) & (self.t <= stop)
        if not keep.any():
            raise RecordingError(
                f"order track {self.name!r} reaches from {self.t[0]:.6g} to {self.t[-1]:.6g} s; nothing lies between "
                f"{start:.6g} and {stop:.6g} s",
                recording=self.name,
            )
        assert self.usable is not None
        return replace(
            self,
            t=self.t[keep],
            speed=self.speed[keep],
            freq=self.freq[:, keep],
            values=self.values[..., keep],
            usable=self.usable[:, keep],
        )

    def select(self, rows: Sequence[int]) -> OrderTrack:
        """The track of some channels, by position `rows`."""
        chosen = list(rows)
        return replace(
            self,
            values=self.values[:, chosen],
            channels=tuple(self.channels[i] for i in chosen),
            residual=None if self.residual is None else self.residual[chosen],
        )

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON, without the amplitudes."""
        return {
            "name": self.name,
            "method": self.method,
            "orders": self.orders.tolist(),
            "span": [float(self.t[0]), float(self.t[-1])],
            "speed": [float(self.speed.min()), float(self.speed.max())],
            "n_time": int(self.t.size),
            "channels": [c.to_dict() for c in self.channels],
            "notes": list(self.notes),
        }

    def __repr__(self) -> str:
        return (
            f"OrderTrack({self.name!r}: {self.n_orders} orders, {len(self.channels)} channels, {self.t.size} times, "
            f"{plain(self.speed.min())} to {plain(self.speed.max())} rev/s, {self.method})"
        )
