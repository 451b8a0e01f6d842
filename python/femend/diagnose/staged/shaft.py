"""Where on the shaft the unbalance sits, and along which axis it turns, where a run contradicts what its study says."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from femend.correlate import csac
from femend.diagnose.staged.loads import RunResult, predicted_ods
from femend.diagnose.staged.nodes import on_the_line, with_elements
from femend.diagnose.staged.prepare import RunData
from femend.diagnose.staged.setup import Setup
from femend.dof import Dof
from femend.errors import LoadError
from femend.estimate.joint import DELAY, ForceLaw, compare_force_laws
from femend.model.terms.linear_terms import LinearTerm
from femend.numerals import plain

__all__ = ["at_its_node", "axis_doubt", "shape_likeness", "shaft_nodes", "with_shaft"]

# nodes of a shaft that are tried at most
MOST = 24
# mean CSAC below which another axis is asked for, that from which another one is right, and by how much it is better
UNLIKE, LIKE, BETTER = 0.5, 0.7, 0.3


def shaft_nodes(setup: Setup, bearings: Sequence[int], axis: int) -> tuple[int, ...]:
    """Nodes with elements on the line through the first of the `bearings` along the shaft's `axis` (0, 1, 2), in its
    order; of more than `MOST` evenly some."""
    free = setup.free
    found = on_the_line(setup, with_elements(setup), bearings[0], axis)
    found.sort(key=lambda n: float(free.xyz[free.index(n)][axis]))
    few = np.unique(np.linspace(0, max(len(found) - 1, 0), min(MOST, len(found))).astype(int))
    return tuple(found[i] for i in few.tolist())


def with_shaft(setup: Setup, nodes: Sequence[int]) -> Setup:
    """The study with static responses to forces at the `nodes` in every basis."""
    rows = [setup.free.row(Dof(n, c)) for n in nodes for c in (1, 2, 3)]
    return replace(setup, g_rows=tuple(sorted({*setup.g_rows, *rows})))


def at_its_node(
    setup: Setup,
    terms: Sequence[LinearTerm],
    run: RunData,
    result: RunResult,
    refit: Callable[..., RunResult],
) -> tuple[Setup, RunData, RunResult, str]:
    """A `run` whose forces grow with another power of the speed than 2 at the nodes its study names, as one of plain
    unbalance at another node of the shaft, where that explains it as well: simpler is what needs no law of its own.

    `refit(setup, data=run)` fits a run in a study. Returns the study with that node in its bases, the run at it, its
    result and a sentence; what was given and no sentence where no other node does.
    """
    wide = with_shaft(setup, shaft_nodes(setup, run.nodes, run.axis))
    for node in _as_good(wide, terms, run, result)[:1]:
        moved = replace(run, nodes=(node,))
        again = refit(wide, data=moved)
        if again.error <= result.error and not again.other_law:
            return wide, moved, again, _told(run, result, node, again)
    return setup, run, result, ""


def _told(run: RunData, result: RunResult, node: int, again: RunResult) -> str:
    named = " and ".join(map(str, run.nodes))
    return (
        f"recording {run.name!r}: forces that grow with the speed squared at node {node} leave "
        f"{plain(100 * again.error, 2)} % of it, at {named} of [recording.rotating] they would have to grow with its "
        f"power {plain(result.data.power[0], 3)} and leave {plain(100 * result.error, 2)} %: it is fitted at node "
        f"{node}; name in 'nodes' where the unbalance sits"
    )


def _as_good(setup: Setup, terms: Sequence[LinearTerm], run: RunData, result: RunResult) -> list[int]:
    """Nodes of the shaft at which unbalance predicts unseen sensors and lines of a run no worse than another power
    does at the nodes named, the best first."""
    if result.laws is None:
        return []
    power = result.laws["power"]
    model = setup.model(result.model.name, result.posterior.unknowns, terms)
    delay = float(result.posterior.values[result.posterior.unknowns.index(DELAY)])
    out = setup.rows(model, run.sensors)

    def plain_law(node: int) -> ForceLaw | None:
        moved = replace(run, nodes=(node,))
        try:
            return compare_force_laws(
                model, result.posterior.p, result.shapes, replace(result.unbalance, nodes=(node,)), out,
                moved.bearings(setup, model), delay=delay, model_error=setup.settings.model_run,
            )["unbalance"]  # fmt: skip
        except LoadError:
            return None

    laws = {n: plain_law(n) for n in shaft_nodes(setup, run.nodes, run.axis) if (n,) != run.nodes}
    good = [
        (law.unseen, n)
        for n, law in laws.items()
        if law is not None and law.unseen <= power.unseen and law.unseen_lines <= power.unseen_lines
    ]
    return [n for _, n in sorted(good)]


def shape_likeness(setup: Setup, result: RunResult) -> float:
    """Mean CSAC over the lines of a run's operating shapes with those that its result computes."""
    P = predicted_ods(setup, result.data, result.model, result.posterior.p, result.unbalance, result.shapes.freq)
    return float(np.nanmean(csac(result.shapes.Y[:, :, None], P[:, :, None])))


def axis_doubt(name: str, axis: int, likeness: Callable[[int], float]) -> str:
    """That the shaft of recording `name` turns about another axis than `axis` (0, 1, 2), where the `likeness` (mean
    CSAC of operating shapes) with an axis says so; nothing else. Other axes are asked for only where it is low."""
    own = likeness(axis)
    if own >= UNLIKE:
        return ""
    every: Mapping[int, float] = {i: own if i == axis else likeness(i) for i in range(3)}
    best = max(every, key=lambda i: every[i])
    if every[best] < LIKE or every[best] - own < BETTER:
        return ""
    return (
        f"recording {name!r}: its operating shapes have a CSAC of {plain(own, 2)} with the model's with axis "
        f"{'XYZ'[axis]}, {plain(every[best], 2)} with axis {'XYZ'[best]}: check 'axis' in [recording.rotating]"
    )
