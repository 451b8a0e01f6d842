"""Sensors whose signal may be of motion across their direction as much as along it, which no model predicts.

An accelerometer is mounted a degree off, and is specified to pick up a few per cent of what moves across it (transverse
sensitivity; ISO 16063-31 says how it is measured). Where the structure moves a hundred times as much across a sensor as
along it, as in the weak direction of a bar that is shaken in its strong one, a fit that believes the sensor to its
noise bends the model to follow what is not its motion; and the model, whose mesh couples the two directions a little
more or less than the structure does, is no better there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from femend.data.bands import within_band
from femend.estimate.lines import FitRecord, amplitudes
from femend.model import ReducedModel
from femend.model.form_errors import basis_modes

__all__ = ["CROSSED", "without_crossed"]

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

# motion across a sensor, in multiples of that along it, from which it is left out: 0.6 degrees, or 1 % of transverse
# sensitivity, then give half as much signal as its own motion. From ten on, where that is a tenth, two of four effects
# in solids were lost with what such sensors told beside it (generated cases, seed 148)
CROSSED = 50.0
# sensors that stay whatever they are
FEWEST = 3


def without_crossed(
    records: Sequence[FitRecord], reduced: ReducedModel, band: tuple[float, float], zeta: float
) -> list[FitRecord]:
    """The records without the sensors across which the structure moves `CROSSED` times as much as along them in every
    record, which `FitRecord.crossed` then names; the same ones where they would keep fewer than three.

    How much it moves across is the model's at the deck's values, with damping ratio `zeta` in all modes, under the
    recorded forces in a `band` (Hz). Without recorded forces nothing is left out.
    """
    if not all(r.driven for r in records):
        return list(records)
    least: dict[int, float] = {}
    for r in records:
        for row, ratio in zip(r.out_rows.tolist(), _crossing(r, reduced, band, zeta).tolist(), strict=True):
            least[row] = min(ratio, least.get(row, np.inf))
    crossed = {row: ratio for row, ratio in least.items() if ratio > CROSSED}
    left = [_without(r, crossed) for r in records]
    return left if crossed and min(len(r.out_rows) for r in left) >= FEWEST else list(records)


def _without(record: FitRecord, crossed: dict[int, float]) -> FitRecord:
    """The record without the sensors at rows `crossed` of the g-set, each with how much it is crossed."""
    rows = record.out_rows.tolist()
    keep = np.array([row not in crossed for row in rows])
    frf = record.frf
    return replace(
        record,
        y=record.y[keep],
        out_rows=record.out_rows[keep],
        out_signs=record.out_signs[keep],
        noise=record.noise[keep],
        frf=None if frf is None else replace(frf, H=frf.H[:, keep], noise=frf.noise[:, keep]),
        crossed=tuple((row, crossed[row]) for row in rows if row in crossed),
    )


def _crossing(record: FitRecord, reduced: ReducedModel, band: tuple[float, float], zeta: float) -> FloatArray:
    """Motion across every sensor over the recorded one along it (n_out,)."""
    freq, own = amplitudes(record)
    force = (np.fft.rfft(record.u, axis=1) if record.frf is None else record.u).T
    inside = within_band(freq, band) & (freq > 0)
    along = np.sqrt((own[:, inside] ** 2).sum(axis=1))
    across = _across(record, reduced, np.asarray(2j * np.pi * freq[inside]), np.asarray(force[inside]), zeta)
    return np.asarray(across / np.maximum(along, 1e-300))


def _across(record: FitRecord, reduced: ReducedModel, s: ComplexArray, force: ComplexArray, zeta: float) -> FloatArray:
    """Root of the summed squares (n_out,) of the accelerations across every sensor on lines s (K,) under `force`
    (K, n_in); none across a sensor of rotation."""
    omega, Q = basis_modes(reduced)
    into = reduced.rows(record.in_rows, record.in_signs) @ Q
    modal = (s[:, None] ** 2 / (s[:, None] ** 2 + 2 * zeta * omega * s[:, None] + omega**2)) * (force @ into)
    axis = np.asarray(record.out_rows) % 6
    square = np.zeros(len(axis))
    for turn in (1, 2):
        other = np.where(axis < 3, record.out_rows - axis + (axis + turn) % 3, record.out_rows)
        moved = modal @ (reduced.rows(other) @ Q).T
        square += np.where(axis < 3, (np.abs(moved) ** 2).sum(axis=0), 0.0)
    return np.asarray(np.sqrt(square))
