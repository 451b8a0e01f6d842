"""Mismatch map: how much of what updating leaves a free force at each node of the model would leave.

Places are sorted out in stages by `locate`, which keeps the likeliest only; the map is of all nodes. The unknowns of
every place start from those of the best one, which are near the truth whatever it lacks, as in the last stage there.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from femend.diagnose.locating.dressed import hypothesis_of
from femend.diagnose.locating.locate import Located, cost_of, fitted
from femend.estimate.fit import SENSORS
from femend.model import Place, find_places
from femend.threads import one_blas_thread

if TYPE_CHECKING:
    from femend.diagnose.deciding.outcome import Diagnosis

__all__ = ["mismatch_map"]

# lines a record; places up to which the unknowns take a step from the best one's, and up to which every node is tried,
# fewer with more sensors than `SENSORS`: a place takes 5 ms with a step and 1 ms without (plate of 221 nodes, 9
# sensors)
LINES, REFITTED, MOST = 100, 300, 1500


@one_blas_thread
def mismatch_map(diagnosis: Diagnosis) -> tuple[NDArray[np.int64], NDArray[np.float64]] | None:
    """Ids (n,) of nodes and the share (n,) of the updated model's cost, 0 to 1, that a free force there leaves.

    At a node the best of the directions counts in which a force alone was tried: against the ground, or at a member's
    end. None where no place was located, where none of the nodes can be judged, or where the updated model explains the
    recordings, so that there is nothing to map. Of a model with many nodes evenly spread ones are tried.
    """
    start = _start(diagnosis)
    if start is None or diagnosis.null.score <= diagnosis.settings.consistent:
        return None
    problem, reduced = diagnosis.problem.sparing(LINES), diagnosis.reduced
    room = min(r.y.shape[0] for r in problem.records) - 1 - problem.n_free
    places = [p for p in find_places(reduced.model) if p.n_w == 1 and p.kind in ("ground", "end", "clamp", "support")]
    most = MOST * SENSORS // max(room + 1, SENSORS)
    places = _spread([p for p in places if len(p.nodes) == 1], start, most) if room >= 1 else []
    hypotheses = [hypothesis_of(p, reduced) for p in places]
    starts = [(i, start.fit.p) for i in range(len(places))]
    fits = fitted(problem, hypotheses, starts, 0.0, int(len(places) <= REFITTED), places)
    null = diagnosis.null
    (alone,) = problem.fit([null.hypothesis], [(null.p, null.x)], iterations=0)
    if alone is None or not fits:
        return None
    before = cost_of(problem, alone, 0.0)
    left: dict[int, float] = {}
    for i, fit in fits:
        node = places[i].nodes[0]
        share = cost_of(problem, fit, 0.0) / before
        left[node] = min(left.get(node, 1.0), share)
    nodes = sorted(left)
    return np.array(nodes, dtype=np.int64), np.array([left[n] for n in nodes])


def _start(diagnosis: Diagnosis) -> Located | None:
    """The best place whose unknowns are those of the model alone."""
    n = len(diagnosis.null.p)
    return next((f for f in diagnosis.located if f.place.n_w == 1 and len(f.fit.p) == n), None)


def _spread(places: list[Place], start: Located, most: int) -> list[Place]:
    """At most about so many of the places: every k-th node, and the best place's."""
    nodes = sorted({p.nodes[0] for p in places})
    step = -(-len(places) // most)
    kept = {*nodes[::step], *start.place.nodes}
    return [p for p in places if p.nodes[0] in kept]
