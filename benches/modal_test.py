"""Seconds for the poles of a large FRF set over all orders, and for the whole modal test of it.

    python benches/modal_test.py [--lines 1000] [--references 3] [--responses 100] [--order 60] [--runs 3]

The set has 25 modes between 5 and 95 Hz with 1 % damping, and 1 % noise. Most of the time goes into eigenvalue problems
of size order x references, which gain little from BLAS threads and lose much to them on busy cores: set OMP_NUM_THREADS
to the number of free cores.
"""

from __future__ import annotations

import argparse
import time

import numpy as np

from femend.data import FRF, Channel
from femend.dof import Dof
from femend.modal import identify_modes, plscf_poles


def frf_set(n_lines: int, n_ref: int, n_out: int) -> FRF:
    """Accelerances of 25 random modes, the references among the responses."""
    rng = np.random.default_rng(0)
    f = np.linspace(0.1, 100.0, n_lines)
    omega, zeta = 2 * np.pi * np.linspace(5.0, 95.0, 25), 0.01
    phi = rng.standard_normal((n_out, 25))
    s = 2j * np.pi * f[:, None]
    g = s**2 / (omega**2 + 2 * zeta * omega * s + s**2)
    H = np.einsum("or,kr,ir->koi", phi, g, phi[:n_ref], optimize=True)
    scatter = rng.standard_normal(H.shape) + 1j * rng.standard_normal(H.shape)
    H += 0.01 * np.sqrt(np.mean(np.abs(H) ** 2) / 2) * scatter
    outputs = tuple(Channel(Dof(i + 1, 3), "acceleration", "m/s^2") for i in range(n_out))
    inputs = tuple(Channel(Dof(i + 1, 3), "force", "N") for i in range(n_ref))
    return FRF("bench", f, H, outputs, inputs, "accelerance", "m/s^2/N")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    for name, value in (("lines", 1000), ("references", 3), ("responses", 100), ("order", 60), ("runs", 3)):
        parser.add_argument(f"--{name}", type=int, default=value)
    given = parser.parse_args()
    frf = frf_set(given.lines, given.references, given.responses)
    what = f"{given.lines} lines, {given.references} x {given.responses} FRFs, orders 2 to {given.order}"
    for label, run in (
        ("poles of all orders", lambda: plscf_poles(frf.freq, frf.H, given.order).order.size),
        ("the whole modal test", lambda: identify_modes(frf, max_order=given.order).modes.n_modes),
    ):
        wall, cpu = [], []
        for _ in range(given.runs):
            start, worked = time.perf_counter(), time.process_time()
            count = run()
            wall.append(time.perf_counter() - start)
            cpu.append(time.process_time() - worked)
        print(f"{label}: {what}: best of {given.runs} {min(wall):.2f} s (CPU {min(cpu):.2f} s), {count} found")


if __name__ == "__main__":
    main()
