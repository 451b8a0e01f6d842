"""Back to the user's deck: updated values where they stand, everything else byte for byte, and the difference to look
at."""

from __future__ import annotations

import difflib
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from femend.errors import UpdatingError
from femend.io.atomic import write_atomic
from femend.io.deck import patch_deck
from femend.model import Model
from femend.model.patched.deck_changes import deck_changes, kept_told, kept_values
from femend.model.patched.grid_changes import grid_changes
from femend.model.patched.read_back import deck_faults

__all__ = ["UpdatedDeck", "updated_deck"]


@dataclass(frozen=True, eq=False)
class UpdatedDeck:
    """New contents of the `files` that change, the unified `diff`, and parameters `left_out` since no field of the deck
    holds their value (element by element, or values that follow from others), with these values in words (`kept`, by
    name). `faults` are sentences on where the new deck, read again, is not the updated model: such a deck must not be
    used. `folder` is that of the deck."""

    files: Mapping[Path, bytes]
    diff: str
    left_out: tuple[str, ...]
    faults: tuple[str, ...] = ()
    kept: Mapping[str, str] = field(default_factory=dict)
    folder: Path | None = None

    @property
    def warnings(self) -> tuple[str, ...]:
        """Sentences on what the new deck does not hold: those left out, and the faults."""
        return (*([kept_told(self.left_out, self.kept)] if self.left_out else []), *self.faults)

    def write(self, folder: str | Path, root: str | Path | None = None) -> list[Path]:
        """Writes the changed files, and no others, under `folder` by their paths relative to `root` (by default the
        deck's folder, or one above it where a changed file is not in it): put over a copy of the deck's files they are
        the new deck. Each is complete or not at all; gives what was written. The originals stay.

        Raises UpdatingError for a deck with `faults`, of which nothing is written.
        """
        if self.faults:
            raise UpdatingError("; ".join(self.faults))
        if not self.files:
            return []
        held = [*([self.folder] if self.folder is not None else []), *(p.parent for p in self.files)]
        top = Path(root) if root is not None else Path(os.path.commonpath(held))
        written = []
        for path, content in self.files.items():
            target = Path(folder) / path.relative_to(top)
            target.parent.mkdir(parents=True, exist_ok=True)
            write_atomic(target, content)
            written.append(target)
        return written


def updated_deck(model: Model, factors: Mapping[str, float]) -> UpdatedDeck:
    """The deck of `model` with its parameters times `factors` and its morphs at `factors`, by name (1 and 0 where not
    given): nodes that move have new coordinates on their GRID, in the system it is given in.

    Comments, includes, formats and column widths stay; numbers have as many digits as their columns hold. The new deck
    is read again and compared with the updated model (`faults` of what is given back). Raises UpdatingError for a name
    that is no parameter, a factor that is not above 0 and an amplitude that is no number, and DeckError for a value
    that its columns cannot hold.
    """
    names, morphs = [p.name for p in model.parameters], [m.name for m in model.morphs]
    for name in factors:
        if name not in names and name not in morphs:
            known = ", ".join(names + morphs)
            there = f"there are {known}" if known else "none was given: read_model(..., parameters=[Parameter(...)])"
            raise UpdatingError(f"the deck has no parameter {name!r}; {there}")
        if name in names and not (np.isfinite(factors[name]) and factors[name] > 0):
            raise UpdatingError(
                f"the factor of {name!r} is {factors[name]:g}: what it stands for in the deck is multiplied by it; "
                "give one above 0, 1 for no change"
            )
        if name in morphs and not np.isfinite(factors[name]):
            raise UpdatingError(f"the amplitude of the morph {name!r} is {factors[name]:g}; give a number, 0 for none")
    changes = deck_changes(model, {n: {"factor": float(factors.get(n, 1.0))} for n in names})
    changes += grid_changes(model, {n: float(factors.get(n, 0.0)) for n in morphs})
    files = patch_deck(model.deck, changes)
    diff: list[str] = []
    for path, new in files.items():
        old = path.read_bytes().decode("utf-8", errors="replace").splitlines(keepends=True)
        lines = new.decode("utf-8", errors="replace").splitlines(keepends=True)
        diff += difflib.unified_diff(old, lines, f"{path.name}", f"{path.name} (updated)", n=1)
    kept = kept_values(model, factors)
    faults = deck_faults(model, files, factors)
    return UpdatedDeck(files, "".join(diff), tuple(kept), faults, kept, Path(model.deck.path).parent)
