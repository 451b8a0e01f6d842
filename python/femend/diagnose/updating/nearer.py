"""An update that stopped far from the truth, begun again from where free forces put the model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from femend.diagnose.locating.locate import FINAL_LINES, Located
from femend.diagnose.settings import Settings
from femend.diagnose.updating.update import UpdatedModel

__all__ = ["nearer"]

# places from whose free forces an updated model that leaves more than noise is fitted again
STARTS = 3


def nearer(start: UpdatedModel, located: Sequence[Located], settings: Settings) -> UpdatedModel:
    """The updated model, fitted again from where free forces at the best places put it: an update may stop far from the
    truth though nothing is missing, and a force, whatever it is, leads past."""
    problem, null = start.problem, start.null
    if null.score <= settings.consistent:
        return start
    tries = [f.fit.p for f in located if len(f.fit.p) == len(null.p)][:STARTS]
    if not tries:
        return start
    few = problem.sparing(FINAL_LINES)
    found = few.fit([null.hypothesis] * (1 + len(tries)), [(p, null.x) for p in (null.p, *tries)])
    best = min((f for f in found if f is not None), key=lambda f: f.cost, default=null)
    (fit,) = problem.fit([null.hypothesis], [(best.p, best.x)])
    return replace(start, null=fit) if fit is not None and fit.cost < null.cost else start
