"""A cantilever of six bars, 0.6 m, with a lump at its tip, for studies of what its recordings are off by."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from femend.estimate import FitRecord
from femend.model import Place, ReducedModel, read_model, reduce_model

Array = NDArray[np.float64]
# band (Hz), rate (1/s) and samples of the recordings
BAND, RATE, N = (5.0, 200.0), 1024.0, 2048


def row(node: int, axis: int) -> int:
    """Row of the g-set of a node's displacement along an axis (1 is Y)."""
    return 6 * (node - 1) + axis


def bent_beam(folder: Path, axes: Sequence[int], f_max: float) -> ReducedModel:
    """The cantilever with its displacements along `axes` in the basis, up to `f_max` (Hz)."""
    lines = ["SOL 103", "CEND", "SPC = 1", "BEGIN BULK", "MAT1,1,7.+10,,0.33,2700.", "PBAR,1,1,4.-4,3.-9,1.2-8,8.-9"]
    lines += [f"GRID,{i + 1},,{0.1 * i},0.,0." for i in range(7)]
    lines += [f"CBAR,{i},1,{i},{i + 1},0.,1.,0." for i in range(1, 7)]
    path = folder / "m.bdf"
    path.write_text("\n".join([*lines, "SPC1,1,123456,1", "CONM2,90,7,,0.2", "ENDDATA", ""]))
    return reduce_model(read_model(path), f_max, [row(n, axis) for n in range(2, 8) for axis in axes])


def burst(seed: int) -> NDArray[np.complex128]:
    """Spectrum of a random force in the band that ends after a quarter of twice the recording."""
    rng = np.random.default_rng(seed)
    made = np.where(np.arange(2 * N) < 0.5 * N, rng.standard_normal(2 * N), 0.0)
    freq = np.fft.rfftfreq(2 * N, 1 / RATE)
    return np.where((freq > BAND[0]) & (freq < BAND[1]), np.fft.rfft(made), 0)


def answers(reduced: ReducedModel, U: NDArray[np.complex128], into: Array, rows: Array, spring: Array) -> Array:
    """Accelerations (n_out, N) at `rows` (n_out, r) of the basis under a force of spectrum `U` (N + 1,) along `into`
    (r,), with the stiffness `spring` (r, r) beside the structure's, at 2 % of structural damping."""
    K, M = reduced.as_drawn()
    K = K * (1 + 0.02j) + spring
    Y = np.zeros((len(rows), len(U)), dtype=complex)
    for k in np.flatnonzero(U):
        s = 2j * np.pi * k * RATE / (2 * N)
        Y[:, k] = s**2 * (rows @ np.linalg.solve(K + s**2 * M, into * U[k]))
    return np.asarray(np.fft.irfft(Y)[:, :N])


def record(seed: int, u: Array, y: Array, into: int, rows: NDArray[np.int64], floor: float = 0.0) -> FitRecord:
    """A recording of a force u (N,) at row `into` of the g-set and accelerations y (n_out, N) at `rows`, with noise of
    1 % of each, and of a share `floor` of all."""
    noise = 0.01 * y.std(axis=1) + floor * y.std()
    y = y + noise[:, None] * np.random.default_rng([seed, 1]).standard_normal(y.shape)
    at, signs = np.array([into]), np.ones(len(rows))
    return FitRecord(str(seed), u[None], y, 1 / RATE, at, np.asarray(rows), np.ones(1), signs, noise)


def grounds() -> list[Place]:
    """Places between every free node and the ground, along Y."""
    return [Place("ground", (n,), "Y", "ground", (np.array([row(n, 1)]),), (np.ones(1),)) for n in range(2, 8)]
