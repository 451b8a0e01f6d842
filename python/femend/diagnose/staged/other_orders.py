"""Orders of a run that no unbalance makes: what turns with multiples of its speed is taken off before it is fitted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from femend.data import Channel, TimeData
from femend.diagnose.staged.prepare import RunData, envelope_of
from femend.numerals import listed, plain
from femend.signal import vold_kalman

__all__ = ["without_other_orders"]

FloatArray = NDArray[np.float64]

# orders that are looked for, as far as the run's band reaches, and what stands beside each: there is nothing at half
# an order more, so that what is found there is noise
ORDERS, BESIDE = (2.0, 3.0, 4.0), 0.5
# bandwidth in orders: all of an order that passes a resonance, and as little of its neighbours as may be
WIDTH = 0.4
# share of the power from which an order is taken off: the square of what the form of the model leaves of a run. Runs
# of order 1 alone show 1.3e-5 at order 2 and less (nine run-ups of 12 to 100 s)
SHARE = 1e-3
# and by how many times it has to be above what is found beside it
ABOVE_NOISE = 5.0
# share of the power at order 1 below which the speed is not that of the shaft: pulses were counted wrongly
OWN = 0.05


def without_other_orders(data: RunData) -> tuple[RunData, str]:
    """A run without its orders 2 to 4, and a sentence about them; the run itself and nothing where it has none.

    A structure that is linear answers an unbalance at order 1 alone. Misalignment, a bent coupling, teeth and blades
    drive it at multiples: no unbalance and no term explains that, it is no noise either, and what a term has to take of
    a run's samples counts it. All orders are tracked at once, so that order 1 keeps what is its own (Vold-Kalman).
    """
    t = data.dt * np.arange(data.y.shape[1])
    inside = (t >= data.speed.start) & (t <= data.speed.stop)
    reach = float(data.rev_per_s.min())
    orders = [order for order in ORDERS if (order + BESIDE) * reach < data.f_max]
    if not len(data.y) or not orders:
        return data, ""
    parts = _tracked(data, np.asarray(t[inside], dtype=np.float64), [1.0, *orders])
    total = float((data.y**2).sum())
    share = {order: float((part**2).sum()) / total for order, part in parts.items()}
    found = [order for order in orders if share[order] > max(SHARE, ABOVE_NOISE * share[order + BESIDE])]
    if not found or share[1.0] < OWN:
        return data, ""
    y = data.y.copy()
    y[:, inside] -= sum(parts[order] for order in found)
    held = (f"{plain(100 * share[order], 2)} % of its power at order {plain(order)}" for order in found)
    told = listed(held, len(ORDERS))
    return replace(data, y=y, envelope=envelope_of(y, data.dt)), (
        f"recording {data.name!r}: the channels show {told} of the speed, which unbalance does not drive "
        "(misalignment, a coupling, teeth or blades do): it is taken off before the run is fitted, and "
        "stays in the errors told of it"
    )


def _tracked(data: RunData, t: FloatArray, orders: list[float]) -> dict[float, FloatArray]:
    """What channels show of the `orders` at the times t (n,) s, and of what stands beside those from 2 on: (n_out, n)
    each."""
    channels = tuple(Channel(d, "acceleration", "m/s^2") for d in data.sensors)
    every = [orders[0], *(o + more for o in orders[1:] for more in (0.0, BESIDE))]
    track = vold_kalman(TimeData(data.name, data.dt, data.y, channels), data.speed, every, relative=WIDTH, t=t)
    angle = data.speed.at(t)[1]
    return {
        order: np.real(values * np.exp(1j * order * angle)) for order, values in zip(every, track.values, strict=True)
    }
