"""Time the correlation criteria on sizes a user has.

    python benches/correlation.py                # the agreed limit: MAC of 5000 DOFs x 200 x 200 modes in 50 ms
    python benches/correlation.py --runs 20

Each figure is the least and the median of several runs in one process, and the median of the processor time they took
(of all threads together): a machine that does other work shows in the clock and not in that. Set OMP_NUM_THREADS to
bound the threads of the matrix product.
"""

from __future__ import annotations

import argparse
import os
import platform
import statistics
import time
from collections.abc import Callable, Iterator

import numpy as np

from femend import correlate as co


def cases() -> Iterator[tuple[str, Callable[[], object]]]:
    """Name and call of each case."""
    rng = np.random.default_rng(0)
    a, b = rng.standard_normal((2, 5000, 200))
    yield "MAC, 5000 DOFs x 200 x 200 modes, real", lambda: co.mac(a, b)
    c, d = a + 1j * b, b - 1j * a
    yield "MAC, the same, complex", lambda: co.mac(c, d)
    mass = rng.uniform(0.5, 2.0, 5000)
    yield "cross-orthogonality, the same, diagonal mass", lambda: co.cross_orthogonality(a, b, mass)
    freq = np.sort(rng.uniform(10, 500, 200))
    yield "pairing, 200 x 200 modes, 5000 DOFs", lambda: co.pair_modes(a, a + 0.5 * b, freq, freq)
    H_a, H_b = rng.standard_normal((2, 4000, 100, 3)) * (1 + 0.5j)
    yield "CSAC, 4000 lines x 100 outputs x 3 inputs", lambda: co.csac(H_a, H_b)
    yield "FRAC, the same", lambda: co.frac(H_a, H_b)
    yield "FDAC, 1000 x 1000 lines, 100 outputs, 1 input", lambda: co.fdac(H_a[:1000, :, :1], H_b[:1000, :, :1])


def main() -> None:
    """Run the bench and print one line per case."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=7, help="runs per case (default 7)")
    arguments = parser.parse_args()
    if arguments.runs < 1:
        parser.error(f"--runs is {arguments.runs}; one run is the least")
    threads = os.environ.get("OMP_NUM_THREADS", "all")
    print(f"{platform.machine()}, {os.cpu_count()} cores, OMP_NUM_THREADS {threads}, numpy {np.__version__}")
    for name, call in cases():
        call()
        seconds, busy = [], []
        for _ in range(arguments.runs):
            start, start_busy = time.perf_counter(), time.process_time()
            call()
            seconds.append(time.perf_counter() - start)
            busy.append(time.process_time() - start_busy)
        clock, processor = 1e3 * statistics.median(seconds), 1e3 * statistics.median(busy)
        print(f"{name:50s} least {1e3 * min(seconds):7.1f} ms, median {clock:7.1f} ms, processor {processor:7.1f} ms")


if __name__ == "__main__":
    main()
