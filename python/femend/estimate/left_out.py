"""Sensors whose signal may be of motion across their direction as much as along it, or that stand still, left out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from femend.estimate.cross_axis import STILL, crossed, less_than_moved, with_across
from femend.estimate.lines import FitRecord
from femend.model import ReducedModel
from femend.model.mesh.form_errors import basis_modes

__all__ = ["CROSSED", "without_crossed", "without_still"]

# motion across a sensor, in multiples of that along it, from which it is left out: 0.6 degrees, or 1 % of transverse
# sensitivity, then give half as much signal as its own motion, and a mesh that couples the two directions a little more
# or less than the structure does. From ten on, where that is a tenth, two of four effects in solids were lost with what
# such sensors told beside it (generated cases, seed 148)
CROSSED = 50.0
# sensors that stay whatever they are
FEWEST = 3


def without_crossed(
    records: Sequence[FitRecord], reduced: ReducedModel, band: tuple[float, float], zeta: float
) -> list[FitRecord]:
    """The records without the sensors across which the structure moves `CROSSED` times as much as along them in every
    record, and without those that stand still in all of them, which `FitRecord.crossed` then names; those across which
    it moves stay where fewer than three would be kept.

    Of one that stands still where the model moves nothing either that is without end. How much it moves across is the
    model's at the deck's values, with damping ratio `zeta` in all modes, under the recorded forces in a `band` (Hz).
    Without recorded forces nothing is left out.
    """
    omega, Q = basis_modes(reduced)
    known = with_across(records, reduced, band, (omega, np.full(len(omega), zeta), Q))
    across = {row: ratio for row, ratio in crossed(known, band).items() if ratio > CROSSED}
    little = less_than_moved(known, band)
    still = _still(records) & little.keys()
    across = {row: ratio if little[row] > 0 or row not in still else np.inf for row, ratio in across.items()}
    # what shows rounding alone is fitted to a noise of rounding, whether or not anything moves across it
    alone = {row: across.get(row, np.inf) for row in still}
    for out, fewest in (({**across, **alone}, FEWEST), (alone, 1)):
        left = [_without(r, out, little) for r in records]
        if out and min(len(r.out_rows) for r in left) >= fewest:
            return left
    return list(records)


def without_still(records: Sequence[FitRecord]) -> list[FitRecord]:
    """Records of responses alone without the sensors that stand still in all of them, dead or in a plane that nothing
    drives, which `FitRecord.crossed` then names, crossed without end; the same ones where they would keep fewer than
    three, and with recorded forces, which tell more of such sensors.

    Their noise is rounding, too, and a model whose own rounding is another would be held to that.
    """
    if any(len(r.u) or r.frf is not None for r in records):
        return list(records)
    still = dict.fromkeys(_still(records), np.inf)
    left = [_without(r, still, dict.fromkeys(still, 0.0)) for r in records]
    return left if still and min(len(r.out_rows) for r in left) >= FEWEST else list(records)


def _still(records: Sequence[FitRecord]) -> set[int]:
    """Rows of the g-set of the sensors that stand still in all of the records."""
    every: set[int] = set()
    moving: set[int] = set()
    for r in records:
        moved = r.y.std(axis=1)
        every.update(r.out_rows.tolist())
        moving.update(r.out_rows[moved > STILL * moved.max(initial=0.0)].tolist())
    return every - moving


def _without(record: FitRecord, across: dict[int, float], little: dict[int, float]) -> FitRecord:
    """The record without the sensors at rows `across` of the g-set, each with how much it is crossed, and how `little`
    it records."""
    rows = record.out_rows.tolist()
    keep = np.array([row not in across for row in rows])
    frf = record.frf
    return replace(
        record,
        y=record.y[keep],
        out_rows=record.out_rows[keep],
        out_signs=record.out_signs[keep],
        noise=record.noise[keep],
        frf=None if frf is None else replace(frf, H=frf.H[:, keep], noise=frf.noise[:, keep]),
        crossed=(*record.crossed, *((row, across[row], little[row]) for row in rows if row in across)),
    )
