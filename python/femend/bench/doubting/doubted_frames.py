"""Whether shapes were recorded in a node's displacement system or in basic axes, as they themselves say."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import TYPE_CHECKING

import numpy as np

from femend.bench.reading.compared import OFF, Compared
from femend.bench.reading.placed_by_shapes import CLEAR, SUITED
from femend.correlate import ModeComparison, compare_modes
from femend.data import ModeSet
from femend.data.geometry import stated
from femend.dof import Dof
from femend.errors import FemendError
from femend.model import Model
from femend.model.sensor_frames import frames_in_question, other_frames
from femend.numerals import listed, plain

if TYPE_CHECKING:
    from femend.bench.reading.prepared import Prepared

__all__ = ["with_frames_settled"]


def with_frames_settled(prepared: Prepared, compared: Sequence[Compared], warnings: Sequence[str]) -> list[str]:
    """The `warnings` with those of displacement systems answered, where the shapes of all that is `compared` suit one
    set of axes clearly better: those that the directions are read in are right, and nothing is told, or basic ones are,
    which is told of files that state no systems too. Shapes that suit neither (frequencies in rad/s, another structure)
    answer nothing."""
    systems = stated(m.geometry for m in prepared.measured)[1]
    pairing, model = prepared.placed.pairing, prepared.model
    # of a file that states no systems the shapes are asked too
    nodes = frames_in_question(pairing, model, {p.sensor.node: systems.get(p.sensor.node, 0) for p in pairing})
    if not nodes or not compared:
        return list(warnings)
    asked = other_frames(pairing, model, systems)
    own = float(np.mean([_suits(c, c.comparison) for c in compared]))
    try:
        basic = float(np.mean([_suits(c, _in_basic_axes(prepared, c, nodes)) for c in compared]))
    except FemendError:
        return list(warnings)  # what cannot be compared answers nothing
    if abs(own - basic) < CLEAR or max(own, basic) < SUITED:
        return list(warnings)
    told = (
        f"sensors at node {_named(nodes)} were recorded in basic axes, while their directions are read in the "
        f"displacement systems (CD) of the model's nodes: the mean MAC is {plain(own, 2)} so and {plain(basic, 2)} in "
        "basic axes; turn the shapes or functions into these systems before they are exported, or give the nodes the "
        "basic system (CD 0) in the deck, with supports and springs at them turned to match"
    )
    rest = [w for w in warnings if not any(text in w for text in asked)]
    return [told, *rest] if basic > own else rest


def _named(nodes: Collection[int]) -> str:
    return listed(nodes, 6)


def _suits(c: Compared, comparison: ModeComparison) -> float:
    """MAC of the pairs near in frequency, over all measured modes."""
    near = [p.mac for p in comparison.pairing.pairs if 1 / OFF < c.modes.freq[p.b] / c.test.freq[p.a] < OFF]
    return float(np.sum(near)) / max(c.n_test, 1)


def _in_basic_axes(prepared: Prepared, c: Compared, nodes: Collection[int]) -> ModeComparison:
    """The comparison with the directions at `nodes` along basic axes."""
    model: Model = prepared.models.of(c.measured.configuration)
    at = {d: i for i, d in enumerate(c.modes.dofs)}
    phi = c.modes.phi.copy()
    for node in nodes:
        for first in (1, 4):  # translations, rotations
            rows = [at.get(Dof(node, first + k)) for k in range(3)]
            own = np.array([np.zeros(phi.shape[1]) if r is None else c.modes.phi[r] for r in rows])
            basic = model.frames[model.index(node)].T @ own
            for k, r in enumerate(rows):
                if r is not None:
                    phi[r] = basic[k]
    turned = ModeSet(c.modes.freq, c.modes.zeta, phi, c.modes.dofs, c.modes.scaling)
    mac_min = prepared.study.correlation.mac_min
    return compare_modes(c.test, turned, places=prepared.placed.places, mac_min=mac_min)
