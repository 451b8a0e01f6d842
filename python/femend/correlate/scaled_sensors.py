"""Sensors of modal tests that hardly move, or move too much, in all shapes alike, found by those of the model.

One such sensor spoils the MAC of every mode, so that pairs are looked for without it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from femend.correlate._arrays import shape_pair
from femend.correlate.assurance import msf
from femend.correlate.doubts import level_hint
from femend.correlate.pairing import ModePairing, pair_modes
from femend.dof import Dof
from femend.numerals import plain

__all__ = ["ScaledSensor", "scaled_sensors"]

FloatArray = NDArray[np.float64]

# a sensor whose motion over all modes is this factor from what the others' is, against the model, is looked into
SUSPECT = 2.5
# what it shows has to go with the model over the modes like this (cosine), or no factor is the mistake
ALIKE = 0.9
# a sensor that shows less than this share of what the model moves there is dead, unless that goes with the model like
# this: g read as m/s² are 0.102 of it, and in step, as noise is not
DEAD, IN_STEP = 0.1, 0.95
# mean MAC of the pairs without the sensor, and their number, below which the model tells nothing of single sensors
TELLS, PAIRS = 0.85, 3
# share of the mean motion of a sensor that the model has to have there
MOVES = 0.3


@dataclass(frozen=True, slots=True)
class ScaledSensor:
    """A sensor, `row` and `name`, that shows `factor` times what the others do, each against the model, in `n_modes`
    modes alike; next to nothing where `factor` is 0. `mac` is the mean MAC of these without it."""

    row: int
    name: str
    factor: float
    n_modes: int
    mac: float

    @property
    def text(self) -> str:
        """How a report says it."""
        without = f"without it {self.n_modes} modes are paired, MAC {plain(self.mac, 2)} on average"
        if self.factor == 0:
            return (
                f"{self.name} hardly moves in any mode, where the model does: it looks dead, loose or not connected "
                f"({without}): take it out of the recording"
            )
        turned = ", upside down" if self.factor < 0 else ""
        return (
            f"{self.name} shows {plain(abs(self.factor), 3)} times what the other sensors do{turned}, each against the "
            f"model, in all modes alike ({without}): {level_hint(abs(self.factor))}"
        )


def scaled_sensors(
    phi_test: ArrayLike,
    phi_model: ArrayLike,
    dofs: Sequence[Dof | str],
    freq_test: ArrayLike,
    freq_model: ArrayLike,
) -> tuple[ScaledSensor, ...]:
    """Sensors `dofs` whose rows of the shapes `phi_test` (n_dof, n_test) are a factor from those of `phi_model`
    (n_dof, n_model), or next to nothing; `freq_test` (n_test,), `freq_model` (n_model,) in Hz.

    Told of four sensors or more, where three modes or more are paired without the sensor and agree with the model
    there. Raises CorrelationError for sizes that do not fit and values that are not finite.
    """
    y, x = shape_pair(phi_test, phi_model)
    if len(y) < 4:
        return ()
    size_y, size_x = _sizes(y), _sizes(x)
    moves = size_x > MOVES * size_x.mean()
    ratio = np.where(moves, np.log(np.maximum(size_y, 1e-12) / np.where(moves, size_x, 1.0)), np.nan)
    away = np.abs(ratio - np.nanmedian(ratio))
    rows = [int(r) for r in np.argsort(-np.nan_to_num(away)) if away[r] > np.log(SUSPECT)]
    found = []
    for row in rows[: max(1, len(y) // 4)]:
        rest = np.delete(np.arange(len(y)), row)
        pairing = pair_modes(y[rest], x[rest], freq_test, freq_model)
        one = _told(row, str(dofs[row]), y, x, rest, pairing)
        if one is not None:
            found.append(one)
    return tuple(found)


def _sizes(phi: NDArray) -> FloatArray:
    """Motion of each sensor (n_dof,) over all shapes, each to the scale of its middle sensor: one that is far off would
    move the scale of a shape's length."""
    middle = np.median(np.abs(phi), axis=0)
    scale = np.where(middle > 0, middle, np.maximum(np.linalg.norm(phi, axis=0), 1e-300))
    return np.asarray(np.sqrt(np.mean(np.abs(phi / scale) ** 2, axis=1)))


def _told(
    row: int, name: str, y: NDArray, x: NDArray, rest: NDArray[np.int64], pairing: ModePairing
) -> ScaledSensor | None:
    mac = float(np.mean([p.mac for p in pairing.pairs])) if pairing.pairs else 0.0
    if len(pairing.pairs) < PAIRS or mac < TELLS:
        return None
    a, b = y[:, pairing.a], x[:, pairing.b]
    length = np.linalg.norm(a[rest], axis=0)
    shown, expected = a[row] / length, b[row] * msf(a[rest], b[rest]) / length
    energy, own = float(np.sum(np.abs(expected) ** 2)), float(np.sum(np.abs(shown) ** 2))
    if energy == 0:
        return None
    along = float(np.real(np.sum(expected.conj() * shown)))
    if own < DEAD**2 * energy and abs(along) < IN_STEP * np.sqrt(energy * own):
        return ScaledSensor(row, name, 0.0, len(pairing.pairs), mac)
    factor = along / energy
    if abs(along) < ALIKE * np.sqrt(energy * own) or not (abs(factor) > SUSPECT or abs(factor) < 1 / SUSPECT):
        return None
    return ScaledSensor(row, name, factor, len(pairing.pairs), mac)
