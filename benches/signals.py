"""Time order tracking of a run-up: 40 channels, 100 s at 256 Hz, four orders.

    python benches/signals.py
    python benches/signals.py --channels 40 --seconds 100 --rate 256 --runs 3

Prints the best of the runs for every step. The run is synthetic, with known amplitudes; a step whose amplitudes are
wrong stops the bench: a time without a result is no figure. Set OMP_NUM_THREADS=1 for one core.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from femend.data import Channel, TimeData
from femend.dof import Dof
from femend.signal import angular_orders, correlations, order_spectra, run_up_shapes, tacho_speed, vold_kalman

ORDERS = (1.0, 2.0, 3.0, 4.0)


def run_up(channels: int, seconds: float, rate: float) -> tuple[TimeData, np.ndarray]:
    """A run from 2.5 to 26 rev/s with a tacho in row 0, and the amplitudes (n_order, n_ch) of its orders."""
    rng = np.random.default_rng(0)
    t = np.arange(int(seconds * rate)) / rate
    angle = 2 * np.pi * (2.5 * t + 23.5 * t**2 / (2 * seconds))
    shape = (len(ORDERS), channels)
    amplitude = rng.standard_normal(shape) + 1j * rng.standard_normal(shape)
    values = sum(np.real(np.outer(a, np.exp(1j * o * angle))) for a, o in zip(amplitude, ORDERS, strict=True))
    values = values + 0.1 * rng.standard_normal((channels, t.size))
    away = np.abs(np.mod(angle + np.pi, 2 * np.pi) - np.pi)
    pulses = 5 * np.clip((0.3 - away) / 0.2, 0, 1)
    labels = [Channel(Dof(i + 1, 3), "acceleration", "m/s^2") for i in range(channels)]
    data = TimeData("bench", 1 / rate, np.vstack([pulses, values]), [Channel(None, "tacho", "V", "tacho"), *labels])
    return data, amplitude


def best(what: Callable[[], Any], runs: int) -> tuple[float, Any]:
    """Least seconds of some runs, and the last result."""
    seconds = []
    for _ in range(runs):
        start = time.perf_counter()
        result = what()
        seconds.append(time.perf_counter() - start)
    return min(seconds), result


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--channels", type=int, default=40)
    parser.add_argument("--seconds", type=float, default=100.0)
    parser.add_argument("--rate", type=float, default=256.0)
    parser.add_argument("--runs", type=int, default=3)
    given = parser.parse_args()
    data, amplitude = run_up(given.channels, given.seconds, given.rate)
    print(f"{given.channels} channels, {given.seconds:g} s at {given.rate:g} Hz, orders {', '.join(map(str, ORDERS))}")
    took, speed = best(lambda: tacho_speed(data), given.runs)
    total = took
    print(f"{'speed from the tacho':34s} {took:7.2f} s")
    took, track = best(lambda: vold_kalman(data, speed, ORDERS), given.runs)
    total += took
    middle = np.argmin(np.abs(track.t - 0.5 * given.seconds))
    error = np.abs(np.abs(track.values[:, :, middle]) - np.abs(amplitude)).max()
    if error > 0.2:  # five deviations of noise 0.1 in a band of 3 Hz of 128
        sys.exit(f"the amplitudes are off by {error:.3g}")
    print(f"{'Vold-Kalman, four orders at once':34s} {took:7.2f} s")
    print(f"{'  both: tacho to complex orders':34s} {total:7.2f} s")
    steps: tuple[tuple[str, Callable[[], Any]], ...] = (
        ("orders over the angle", lambda: angular_orders(data, speed, ORDERS)),
        ("order spectra to order 10", lambda: order_spectra(data, speed, 10.0)),
        ("steady shapes by deconvolution", lambda: run_up_shapes(data, speed)),
        ("correlations, 512 lags, 4 references", lambda: correlations(data, 512, [1, 2, 3, 4])),
    )
    for text, what in steps:
        print(f"{text:34s} {best(what, given.runs)[0]:7.2f} s")


if __name__ == "__main__":
    main()
