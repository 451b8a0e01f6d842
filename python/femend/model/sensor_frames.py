"""Sensors at nodes that have a displacement system of their own: which axes their directions are read in."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from femend.errors import DeckError
from femend.model.model import Model
from femend.model.pairing import Pairing
from femend.numerals import listed

__all__ = ["frames_in_question", "other_frames"]

# nodes that a sentence names at most
NAMED = 6


def frames_in_question(pairing: Pairing, model: Model, systems: Mapping[int, int]) -> dict[int, tuple[int, int]]:
    """Nodes of the `model` that have sensors of `pairing`, and displacement axes that differ from basic ones, with the
    number of their system there and of the other one that the test file states (`systems`, 0 for basic)."""
    if not systems:
        return {}
    frames = model.frames
    found: dict[int, tuple[int, int]] = {}
    for pair in pairing:
        stated, node = systems.get(pair.sensor.node), pair.dof.node
        if stated is None or node in found or np.allclose(frames[model.index(node)], np.eye(3)):
            continue
        own = _system(model, node)
        if own != stated:
            found[node] = own, stated
    return found


def other_frames(pairing: Pairing, model: Model, systems: Mapping[int, int]) -> tuple[str, ...]:
    """What is to be told of sensors of `pairing` whose nodes in `model` have displacement axes that differ from basic
    ones, where the test file states another system for the test node (`systems`, 0 for basic): one sentence or none."""
    found = frames_in_question(pairing, model, systems)
    if not found:
        return ()
    first, (own, stated) = next(iter(found.items()))
    others = listed(list(found)[1:], NAMED - 1)
    also = f" (and {others} likewise)" if others else ""
    named = f"displacement system {own} (CD)" if own else "displacement axes of its own"
    return (
        f"sensor node {first} has {named} in the model while the test file states "
        f"{'the basic system' if stated == 0 else f'system {stated}'} for it{also}: directions are read in the "
        "displacement system of the model's node; if they were recorded in basic axes, turn the shapes or functions "
        "into these systems before they are exported, or give the nodes the basic system (CD 0) in the deck, with "
        "supports and springs at them turned to match",
    )


def _system(model: Model, node: int) -> int:
    """The number of the displacement system of `node`, 0 where the deck does not give it with the node."""
    try:
        text = model.deck.field_text("GRID", node, 7).strip()
    except DeckError:  # a deck of another program
        return 0
    return int(text) if text.lstrip("+-").isdigit() else 0
