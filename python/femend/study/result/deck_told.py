"""What is said of the updated deck of a diagnosis: values it does not hold, and where it is not the updated model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from femend.io.deck import FieldChange, patch_deck
from femend.model import Model
from femend.model.patched.deck_changes import deck_changes, kept_told, kept_values
from femend.model.patched.read_back import deck_faults, unreadable

__all__ = ["deck_told"]


def deck_told(model: Model, factors: Mapping[str, float], complete: Mapping[Path, bytes]) -> list[str]:
    """Sentences on the deck of `model` with the `factors` of its parameters by name: what is left out, and where it is
    not the updated model. With the terms found it is another one on purpose: of the `complete` changed files it is
    told where they cannot be read."""
    changes: Sequence[FieldChange] = deck_changes(model, {name: {"factor": f} for name, f in factors.items()})
    kept = kept_values(model, factors)
    told = [kept_told(list(kept), kept)] if kept else []
    return [*told, *deck_faults(model, patch_deck(model.deck, changes), factors), *unreadable(model, complete)]
