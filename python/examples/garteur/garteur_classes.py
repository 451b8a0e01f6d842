"""What kind of motion a mode is, as the published picture of the measured shapes tells it.

There are no measured shapes in numbers, so a measured mode is known by its class: symmetric or not, and whether the
wing bends, twists or moves in its plane. Classes do not depend on the order of frequencies, in which modes 3 and 4 (or
6 and 7) of a model may stand the other way round.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from garteur_deck import CHORD, DRUM_MASS, DRUM_X, RHO, RIGHT, SPAN, THICK
from numpy.typing import NDArray

from femend.dof import Dof

FloatArray = NDArray[np.float64]

# 0.4, 0.6 and 0.8 of the half span or nearly
WING = (212, 217, 223)
DRUM = (401, 404, 407)
# a half's sensors, left: z along the wing, z of the drum from front to rear, x of wing and drum
_HALF = [Dof(n, 3) for n in (*WING, *DRUM)] + [Dof(n, 1) for n in (WING[1], DRUM[1])]
_BODY = [Dof(n, c) for n, c in ((101, 2), (101, 3), (114, 2), (114, 3), (505, 2), (600, 1), (604, 3), (604 + RIGHT, 3))]
SENSORS = [*_HALF, *(Dof(d.node + (RIGHT if d.node < 300 else 10), d.component) for d in _HALF), *_BODY]
# kg and kg m^2 of a wing half and of a drum with its mass, by which motions are weighed
_M_WING, _M_DRUM = RHO * CHORD * THICK * SPAN, RHO * CHORD * THICK * 2 * DRUM_X + DRUM_MASS
_J_DRUM = RHO * CHORD * THICK * 2 * DRUM_X * (2 * DRUM_X) ** 2 / 12 + DRUM_MASS * DRUM_X**2
# Hz: below are motions on the bungees
RIGID = 4.0


@dataclass(frozen=True)
class Measured:
    """The published modes: `freq` (Hz) and `damping` (fraction), (n,); `names` and `classes` (symmetry, motion,
    number)."""

    freq: FloatArray
    damping: FloatArray
    names: tuple[str, ...]
    classes: tuple[tuple[str, str, int], ...]


def read_measured(path: Path) -> Measured:
    """The table `modes.csv`."""
    lines = [line for line in path.read_text(encoding="ascii").splitlines() if line and not line.startswith("#")]
    rows = [line.split(",") for line in lines[1:]]
    return Measured(
        np.array([float(r[1]) for r in rows]),
        np.array([float(r[2]) for r in rows]) / 100,
        tuple(r[6] for r in rows),
        tuple((r[3], r[4], int(r[5])) for r in rows),
    )


def motion(shape: FloatArray) -> tuple[str, str]:
    """(symmetry, motion) of a `shape` (n_sensors,): the motion with the largest kinetic energy of wing and drums, and
    whether left and right do it alike."""
    n = len(_HALF)
    left, right = shape[:n], shape[n : 2 * n]
    best = {}
    for symmetry, half in (("symmetric", (left + right) / 2), ("antisymmetric", (left - right) / 2)):
        wing, drum, x = half[:3], half[3:6], half[6:]
        best[symmetry, "bending"] = _M_WING * np.mean(wing**2) + _M_DRUM * drum[1] ** 2
        best[symmetry, "torsion"] = _J_DRUM * ((drum[0] - drum[2]) / (2 * DRUM_X)) ** 2
        best[symmetry, "in-plane"] = _M_WING * x[0] ** 2 + _M_DRUM * x[1] ** 2
    return max(best, key=lambda key: best[key])


def classify(freq: FloatArray, phi: FloatArray) -> dict[tuple[str, str, int], int]:
    """The mode (from 0) of each class (symmetry, motion, number from 1) of `freq` (n_modes,) and `phi` (n_sensors,
    n_modes)."""
    found: dict[tuple[str, str, int], int] = {}
    count: dict[tuple[str, str], int] = {}
    for k in np.argsort(freq):
        if freq[k] > RIGID:
            kind = motion(phi[:, k])
            count[kind] = count.get(kind, 0) + 1
            found[(*kind, count[kind])] = int(k)
    return found
