"""Sensors at nodes that have a displacement system of their own: which axes their directions are read in."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from femend.dof import Dof
from femend.errors import DeckError
from femend.model.model import Model
from femend.model.pairing import Pairing
from femend.numerals import listed, plain

__all__ = ["basic_direction", "frames_in_question", "other_frames", "planned_frames"]

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


def basic_direction(dof: Dof, model: Model) -> NDArray[np.float64]:
    """The signed direction (3,) of a `dof` of `model` in basic axes; of a rotation its axis."""
    # 0.0 + : no -0 in what is written
    return 0.0 + dof.sign * np.asarray(model.frames[model.index(dof.node)][(dof.component - 1) % 3], dtype=np.float64)


def planned_frames(dofs: Sequence[Dof], model: Model) -> tuple[str, ...]:
    """What is to be told of planned sensors and exciters (`dofs`) at nodes of `model` whose displacement axes differ
    from basic ones, where they point in basic axes: one sentence or none. Who mounts them knows no system of a deck."""
    turned = [d for d in dofs if not np.allclose(model.frames[model.index(d.node)], np.eye(3))]
    if not turned:
        return ()
    nodes = list(dict.fromkeys(d.node for d in turned))
    systems = list(dict.fromkeys(_system(model, n) for n in nodes))
    named = f"displacement system {listed(systems, NAMED)} (CD)" if all(systems) else "displacement axes of their own"
    each = listed((f"{d} is {_text(basic_direction(d, model))}" for d in dict.fromkeys(turned)), NAMED)
    said = f"directions at node{'s' * (len(nodes) > 1)} {listed(nodes, NAMED)} are those of {named}, not basic ones"
    return (
        f"{said}: in basic axes {each}; mount what is planned there so, or give the nodes CD 0 in the deck, with "
        "supports and springs at them turned to match",
    )


def _text(direction: NDArray[np.float64]) -> str:
    return f"({', '.join(plain(float(x), 3) for x in np.where(np.abs(direction) > 1e-9, direction, 0.0))})"


def _system(model: Model, node: int) -> int:
    """The number of the displacement system of `node`, 0 where the deck does not give it with the node."""
    try:
        text = model.deck.field_text("GRID", node, 7).strip()
    except DeckError:  # a deck of another program
        return 0
    return int(text) if text.lstrip("+-").isdigit() else 0
