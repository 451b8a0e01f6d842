"""What sensors pick up of motion across their direction, and are off by in their own.

An accelerometer is mounted a degree off, and is specified to pick up a few per cent of what moves across it (transverse
sensitivity; ISO 16063-31 says how it is measured). Where the structure moves twenty times as much across a sensor as
along it, as in the weak direction of a bar that is shaken in its strong one, one per cent of that is a fifth of the
signal, and a fit that believes the sensor to its noise bends the model to follow what is not its motion, or tells
physics where there is none. So a sensor's signal may hold an unknown share of the motion in each of the two other axes,
as the model predicts it; the shares are eliminated with the free decays, and what the prediction may be wrong by counts
as noise. Sensors are calibrated to a few per cent, too: the same is done with a share of the motion along each, again
as predicted. (A share of what was recorded would make everything that is left smaller by as much: a model that does not
explain the recordings would be fitted with sensors that show too much.)
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from femend.data.bands import within_band
from femend.estimate.lines import FitRecord, amplitudes, modal_accelerances
from femend.estimate.picked_up import ACROSS_SD
from femend.model import ReducedModel

__all__ = ["STILL", "ForcesBeside", "crossed", "less_than_moved", "with_across"]

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

# band, in multiples of the one used, of the motion predicted, and length of the time it is predicted for, in that of
# the record: what rings on at its end would else come round to its beginning
WIDER, LONGER = 1.3, 2
# motion, as a share of the liveliest sensor's, below which one stands still, in a recording and in a model: of 24 bits
# the last is 6e-8 of what a recorder is set for, and what a computation with 16 digits shows of it is rounding
STILL = 1e-9
# share of what a sensor is believed to, below which what it may pick up is not looked at
NEGLIGIBLE = 0.1


@dataclass(frozen=True, eq=False)
class ForcesBeside:
    """Forces that act beside those recorded, along `w` (n_w, r) in the basis of a reduced model: in a record `made`
    (n_w, n) by its name, complex on the lines of an FRF."""

    w: FloatArray
    made: Mapping[str, FloatArray | ComplexArray]


def with_across(
    records: Sequence[FitRecord],
    reduced: ReducedModel,
    band: tuple[float, float],
    modal: tuple[FloatArray, FloatArray, FloatArray],
    beside: ForcesBeside | None = None,
) -> list[FitRecord]:
    """The records with what moves across their sensors and along them, under the recorded forces in a `band` (Hz) and
    those `beside`, as the modes `modal` predict it: omega (rad/s) and zeta (r,), shapes (r, r) in the basis of the
    reduced model.

    Records without recorded forces have none.
    """
    return [_with(r, reduced, band, modal, beside) for r in records]


def _with(
    record: FitRecord,
    reduced: ReducedModel,
    band: tuple[float, float],
    modal: tuple[FloatArray, FloatArray, FloatArray],
    beside: ForcesBeside | None,
) -> FitRecord:
    if not record.driven:
        return record
    n = LONGER * record.n
    freq = np.asarray(np.fft.rfftfreq(n, record.dt) if record.frf is None else record.frf.freq)
    into, u = reduced.rows(record.in_rows, record.in_signs), record.u
    if beside is not None:
        into, u = np.vstack([into, beside.w]), np.vstack([u, beside.made[record.name]])
    force = (np.fft.rfft(u, n, axis=1) if record.frf is None else u).T
    inside = within_band(freq, (band[0] / WIDER, band[1] * WIDER)) & (freq > 0)
    made = np.zeros((3, len(record.out_rows), len(freq)), dtype=np.complex128)
    at = 2j * np.pi * freq[inside], np.asarray(force[inside], dtype=np.complex128)
    made[:, :, inside] = _motion(record, reduced, into, *at, modal)
    across: FloatArray | ComplexArray = made
    if record.frf is None:
        across = np.asarray(np.fft.irfft(made, n, axis=2)[:, :, : record.n])
    return replace(record, across=across)


def crossed(records: Sequence[FitRecord], band: tuple[float, float]) -> dict[int, float]:
    """How many times as much the structure moves across a sensor as along it, in a `band` (Hz), for every sensor by its
    row of the g-set: the least of all records. Nothing where sensors are believed, or could hardly pick anything up."""
    least: dict[int, float] = {}
    for r in records:
        if r.across is None or not _picks_up(r, r.across):
            return {}
        for row, ratio in zip(r.out_rows.tolist(), _crossing(r, band).tolist(), strict=True):
            least[row] = min(ratio, least.get(row, np.inf))
    return least


def less_than_moved(records: Sequence[FitRecord], band: tuple[float, float]) -> dict[int, float]:
    """How many times as much the model moves along a sensor as that records, in a `band` (Hz), for every sensor by its
    row of the g-set: the least of all records that know what moves along them. Where the model has rounding alone it
    moves nothing."""
    least: dict[int, float] = {}
    for r in records:
        if r.across is None:
            continue
        for row, ratio in zip(
            r.out_rows.tolist(), (_over_recorded(r, r.across[2:], band) * _moves(r, band)).tolist(), strict=True
        ):
            least[row] = min(ratio, least.get(row, np.inf))
    return least


def _picks_up(record: FitRecord, across: FloatArray | ComplexArray) -> bool:
    """Whether what some sensor may pick up counts beside noise and one per cent of its own motion, which is what else a
    model is not asked to explain."""
    picked = ACROSS_SD * np.sqrt((np.abs(across[:2]) ** 2).mean(axis=2)).max(axis=0)
    believed = np.sqrt(record.noise**2 + ACROSS_SD**2 * (record.y**2).mean(axis=1))
    return bool((picked > NEGLIGIBLE * believed).any())


def _crossing(record: FitRecord, band: tuple[float, float]) -> FloatArray:
    """Motion across every sensor over the recorded one along it (n_out,)."""
    assert record.across is not None
    return _over_recorded(record, record.across[:2], band)


def _moves(record: FitRecord, band: tuple[float, float]) -> NDArray[np.bool_]:
    """Where the model moves along a sensor (n_out,) in a `band` (Hz), beside the liveliest of those axes at the
    sensors that are of its kind, translations or rotations."""
    assert record.across is not None
    moved = _size_in(record, record.across, band)
    turning = np.asarray(record.out_rows) % 6 >= 3
    liveliest = [moved[:, turning == kind].max(initial=0.0) for kind in (False, True)]
    return np.asarray(moved[2] > STILL * np.where(turning, liveliest[1], liveliest[0]))


def _size_in(record: FitRecord, moved: FloatArray | ComplexArray, band: tuple[float, float]) -> FloatArray:
    """Size (axes, n_out) of what moves (axes, n_out, n) at the sensors of a record, in a `band` (Hz)."""
    moved = np.abs(moved if record.frf is not None else np.fft.rfft(moved, axis=2))
    return np.asarray(np.sqrt((moved[:, :, within_band(amplitudes(record)[0], band)] ** 2).sum(axis=2)))


def _over_recorded(record: FitRecord, moved: FloatArray | ComplexArray, band: tuple[float, float]) -> FloatArray:
    """Motion `moved` (axes, n_out, n) at every sensor over what it recorded (n_out,), in a `band` (Hz)."""
    freq, own = amplitudes(record)
    along = np.sqrt((own[:, within_band(freq, band)] ** 2).sum(axis=1))
    return np.asarray(np.linalg.norm(_size_in(record, moved, band), axis=0) / np.maximum(along, 1e-300))


def _motion(
    record: FitRecord,
    reduced: ReducedModel,
    into: FloatArray,
    s: ComplexArray,
    force: ComplexArray,
    modal: tuple[FloatArray, FloatArray, FloatArray],
) -> ComplexArray:
    """Accelerations (3, n_out, K) along the two other axes of every sensor's node, none for a sensor of rotation, and
    along its own, on lines s (K,) under `force` (K, n_in) along `into` (n_in, r)."""
    omega, zeta, Q = modal
    moved = modal_accelerances(omega, zeta, s) * (force @ (into @ Q))
    axis = np.asarray(record.out_rows) % 6
    made = []
    for turn in (1, 2):
        other = np.where(axis < 3, record.out_rows - axis + (axis + turn) % 3, record.out_rows)
        seen = (reduced.rows(other) @ Q) * (axis < 3)[:, None]
        made.append(seen @ moved.T)
    made.append((reduced.rows(record.out_rows) @ Q) @ moved.T)
    return np.asarray(made)
