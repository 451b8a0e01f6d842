"""What is known of a deck's own mesh: its error mode by mode, and what it does not follow of a band."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from femend.model.free_body import is_elastic
from femend.numerals import plain

__all__ = ["MeshError", "Unresolved"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class MeshError:
    """Frequencies in Hz (n,) of the deck's modes `freq`, of the `refined` model's, and what a mesh without error would
    have (`converged`); NaN where no refined mode has the shape. `mac` (n,) compares the shapes at the deck's nodes;
    `halved` says whether the refined solids are of half the size too."""

    freq: FloatArray
    refined: FloatArray
    converged: FloatArray
    mac: FloatArray
    halved: bool = False

    @property
    def error(self) -> FloatArray:
        """Relative error (n,) of the deck's frequencies, positive where they are too high; NaN without a pair, and for
        rigid-body modes."""
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.where(is_elastic(self.freq), self.freq / self.converged - 1.0, np.nan)

    @property
    def worst(self) -> int:
        """The mode that is furthest off, from 0."""
        return int(np.nanargmax(np.abs(self.error)))

    def text(self) -> str:
        """The modes as a table."""
        lines = [f"{'mode':>5} {'deck Hz':>10} {'refined Hz':>11} {'converged Hz':>13} {'error %':>8} {'MAC':>6}"]
        columns = (self.freq, self.refined, self.converged, 100.0 * self.error, self.mac)
        for i, (f, r, c, e, m) in enumerate(zip(*columns, strict=True), 1):
            shown = [f"{v:{how}}" if np.isfinite(v) else "-" for v, how in ((r, ".5g"), (c, ".5g"), (e, "+.2f"))]
            lines.append(f"{i:>5} {f:>10.5g} {shown[0]:>11} {shown[1]:>13} {shown[2]:>8} {m:>6.2f}")
        return "\n".join(lines)

    __str__ = text


@dataclass(frozen=True, slots=True)
class Unresolved:
    """A band whose upper part the mesh does not follow.

    `freq` (Hz) is of the first mode that it puts `error` (relative) off, `points` the elements a wavelength there of
    the element that adds most to it, of property `pid`, as the deck has them; `limit` (Hz) is where lines end that are
    used, 0 where even the first mode of the band is off and nothing is left out; `share` is what of the recorded power
    is left out; `cut` says that the mode is off although the elements were refined.
    """

    freq: float
    error: float
    points: float
    pid: int
    limit: float
    share: float = 0.0
    cut: bool = False

    @property
    def what_to_do(self) -> str:
        """What makes the mesh follow more."""
        where = f"refine property {self.pid}" if self.pid else "refine the mesh"
        return where + (", or let its masses be consistent (PARAM,COUPMASS,1)" if self.error < 0 else "")

    @property
    def text(self) -> str:
        """The warning."""
        seen = (
            f"the mesh has {plain(self.points, 2)} points a wavelength at {plain(self.freq, 3)} Hz, which puts a mode "
            f"there {plain(100 * self.error, 2, signed=True)} % off{' even refined' if self.cut else ''}"
        )
        if self.limit == 0:
            return f"{seen}; it is the first mode of the band, so that no lines are left out: {self.what_to_do}"
        # of bending waves, whose length goes with the square root of the frequency
        there = self.points * np.sqrt(self.freq / self.limit)
        return (
            f"{seen}; up to {plain(self.limit, 3)} Hz it has {plain(there, 2)} or more: lines above are left out, "
            f"{plain(100 * self.share, 2)} % of the recorded power; {self.what_to_do}"
        )
