"""Time output-only modes of 40 channels x 100 s at 256 Hz.

    OMP_NUM_THREADS=2 python benches/output_only.py [--runs 3]

A shear chain of 40 masses is shaken by white noise and recorded with 2 % noise. The shortest of the runs is printed,
with the number of modes found: a time without a result is no figure. 5 s on two cores is what SSI has to keep.
"""

from __future__ import annotations

import argparse
import os
import platform
import time

import numpy as np
from scipy import signal

from femend import Channel, Dof, TimeData
from femend.modal.output_only import METHODS, identify_output_only

N, RATE, SECONDS, FINER = 40, 256.0, 100.0, 4
BANDS = ((0.5, 40.0), (0.5, 100.0))


def recording(seed: int = 0) -> TimeData:
    """The chain's accelerations: modes from 2.2 to 110 Hz, 1 % damping."""
    rng = np.random.default_rng(seed)
    K = 2 * np.eye(N) - np.eye(N, k=1) - np.eye(N, k=-1)
    K[-1, -1] = 1
    squares, phi = np.linalg.eigh(K)
    omega = 2 * np.pi * 110.0 * np.sqrt(squares / squares[-1])
    force = phi.T @ rng.standard_normal((N, int(SECONDS * RATE) * FINER))
    q = np.empty_like(force)
    for r, w in enumerate(omega):
        A = np.array([[0.0, 1.0], [-(w**2), -0.02 * w]])
        system = (A, np.array([[0.0], [1.0]]), A[1:], np.array([[1.0]]))
        b, a = signal.ss2tf(*signal.cont2discrete(system, 1 / (FINER * RATE))[:4])
        q[r] = signal.lfilter(b[0], a, force[r])
    y = signal.decimate(phi @ q, FINER, ftype="fir", axis=1)
    y = y + 0.02 * y.std(axis=1, keepdims=True) * rng.standard_normal(y.shape)
    return TimeData("chain", 1 / RATE, y, tuple(Channel(Dof(i + 1, 3), "acceleration", "m/s^2") for i in range(N)))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=3, help="runs of which the shortest counts")
    runs = parser.parse_args().runs
    data = recording()
    threads = os.environ.get("OMP_NUM_THREADS", "as many as the library takes")
    print(f"{data}; {platform.machine()}, {os.cpu_count()} cores, threads: {threads}, load {os.getloadavg()[0]:.1f}")
    for band in BANDS:
        for method in METHODS:
            wall, cpu = np.inf, np.inf
            for _ in range(runs):
                start, start_cpu = time.perf_counter(), time.process_time()
                found = identify_output_only(data, band, method)
                wall = min(wall, time.perf_counter() - start)
                cpu = min(cpu, time.process_time() - start_cpu)
            print(f"{method:5s} to {band[1]:g} Hz: {wall:.2f} s ({cpu:.2f} s CPU), {found.modes.n_modes} modes")


if __name__ == "__main__":
    main()
