"""Modes that a test cannot see, told by a model before the test and after it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from femend.data import ModeSet
from femend.data.bands import within_band
from femend.dof import Dof
from femend.errors import RecordingError
from femend.numerals import plain

__all__ = ["UnseenMode", "unseen_modes"]


@dataclass(frozen=True, slots=True)
class UnseenMode:
    """Mode `number` (from 1) of a model at `freq` in Hz, whose references move by `share` of its largest component."""

    number: int
    freq: float
    share: float
    message: str


def unseen_modes(
    modes: ModeSet, references: Iterable[Dof], band: tuple[float, float] | None = None, *, least: float = 0.02
) -> tuple[UnseenMode, ...]:
    """Modes of a model in `band` (Hz) in which no reference moves by `least` of the largest component of the shape.

    `references` are the fixed sensors of a roving hammer or the fixed inputs of a shaker test; a mode appears in FRFs
    in proportion to its motion there. Components compare within translations and within rotations, a reference with
    its own kind. Raises RecordingError for a reference that is not among the DOFs of `modes`.

    >>> phi = np.array([[1.0, 0.001], [0.5, 1.0]])
    >>> model = ModeSet(np.array([5.0, 15.0]), np.zeros(2), phi, (Dof(1, 3), Dof(1, 1)))
    >>> [(m.number, m.share) for m in unseen_modes(model, [Dof(1, 3)])]
    [(2, 0.001)]
    """
    at = {dof.unsigned: row for row, dof in enumerate(modes.dofs)}
    rotation = np.array([dof.is_rotation for dof in modes.dofs], dtype=bool)
    share = np.zeros(modes.n_modes)
    named = []
    for dof in references:
        if dof.unsigned not in at:
            raise RecordingError(
                f"reference {dof} is none of the {len(modes.dofs)} DOFs of the modes; give its row too"
            )
        row = at[dof.unsigned]
        largest = np.max(np.abs(modes.phi[rotation == rotation[row]]), axis=0)
        share = np.maximum(share, np.abs(modes.phi[row]) / np.where(largest > 0, largest, 1.0))
        named.append(str(dof))
    found = []
    for r in np.nonzero((share < least) & within_band(modes.freq, (0.0, np.inf) if band is None else band))[0]:
        message = (
            f"mode {r + 1} of the model at {plain(modes.freq[r])} Hz cannot be seen from {', '.join(named)}: there it "
            f"moves by {plain(100 * share[r], 2)} % of its largest component; add a reference where it moves"
        )
        found.append(UnseenMode(int(r) + 1, float(modes.freq[r]), float(share[r]), message))
    return tuple(found)
