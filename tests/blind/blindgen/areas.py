"""Effects that are spread over lines and areas: a weak patch of a plate, an elastic bedding."""

from __future__ import annotations

import numpy as np

from .effects import AXIS, Effect, Scene, Unsuitable
from .plates import Plate
from .solids import Solid
from .truth import Change


def weak_patch(sc: Scene) -> Effect:
    """A rectangle of a plate's cells, within one of its groups, whose stiffness is down by 30-60 %."""
    s, rng = sc.s, sc.rng
    if not isinstance(s, Plate) or s.layers > 1:
        raise Unsuitable("no plate of two halves")
    half, ny = s.cells[0] // 2, s.cells[1]
    wide, high = int(rng.integers(half // 2, half + 1)), int(rng.integers(ny // 3, ny // 2 + 1))
    i0 = half * int(rng.integers(2)) + int(rng.integers(half - wide + 1))
    j0 = int(rng.integers(ny - high + 1))
    factor = rng.uniform(0.4, 0.7)
    return Effect(
        "joint_stiffness",
        [s.node(i, j) for j in (j0, j0 + high) for i in (i0, i0 + wide)],
        "",
        "",
        (1.0, 1.0),
        lambda x: {"factor": factor},
        change=lambda x: Change(patch=(i0, i0 + wide, j0, j0 + high, factor)),
        fixed=True,
        extra={"kind": "patch"},
    )


def bedding(sc: Scene) -> Effect:
    """An elastic bedding to ground that nobody drew: under a member of a frame, along half an edge or under a rectangle
    of a plate, along half a lower edge of a solid; named by its ends or corners."""
    s, rng = sc.s, sc.rng
    if isinstance(s, Plate):
        if s.layers > 1:
            raise Unsuitable("no single plate")
        nx, ny = s.cells
        i0, along = nx // 2 * int(rng.integers(2)), nx // 2
        edge = rng.random() < 0.5
        j0, j1 = (ny * int(rng.integers(2)),) * 2 if edge else (ny // 4 * int(rng.integers(3)), 0)
        j1 = j0 if edge else j0 + ny // 2
        grid = [(i, j) for j in range(j0, j1 + 1) for i in range(i0, i0 + along + 1)]
        nodes = [s.node(i, j) for i, j in grid]
        ends = [s.node(i, j) for j in dict.fromkeys((j0, j1)) for i in (i0, i0 + along)]
        comp = 3
    elif isinstance(s, Solid):
        i0, along = s.cells[0] // 2 * int(rng.integers(2)), s.cells[0] // 2
        nodes = [s.node(i, 0, 0) for i in range(i0, i0 + along + 1)]
        ends, comp = [nodes[0], nodes[-1]], int(rng.choice([2, 3]))
    else:
        m = s.members[int(rng.integers(len(s.members)))]
        nodes, ends = list(m.chain), [m.chain[0], m.chain[-1]]
        comp = int(rng.choice(s.axes))
        axis = s.xyz[m.j] - s.xyz[m.i]
        if abs(axis[comp - 1]) > 0.9 * np.linalg.norm(axis):
            raise Unsuitable("along the member")
    free = [n for n in nodes if n not in s.clamped]
    k = min(sc.look([n], comp).k for n in s.free)
    # a node inside stands for a whole cell along every side, one at an end for half of it
    share = np.array([0.5 ** (n in ends) for n in nodes])
    share = dict(zip(nodes, share / share.sum(), strict=True))
    return Effect(
        "support_stiffness",
        ends,
        AXIS[comp],
        "ground",
        (3e-3, 30.0),
        lambda x: {"k": x * k},
        change=lambda x: Change(support={(n, comp): x * k * share[n] for n in free}),
        extra={"kind": "bedding"},
    )
