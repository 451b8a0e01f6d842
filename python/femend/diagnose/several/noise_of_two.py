"""What no two forces explain: noise to two laws, as what no single force explains is to one.

What is wrong with a model everywhere, its mesh or its idealisation, is left beside whatever acts at two places. Held to
the sensors' noise, no two laws would explain such recordings, and the model's unknowns would follow what is wrong.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from femend.diagnose.locating.locate import Located
from femend.diagnose.naming.judge import Given
from femend.diagnose.several.other_split import judged_with
from femend.diagnose.several.pairs import Searched, updated
from femend.diagnose.updating.noise import UNDERRATED

__all__ = ["beyond_two_forces"]


def beyond_two_forces(first: Searched, second: Located) -> Searched:
    """The search with as much noise as two free forces leave, the fit of both with the `second` place; as it is where
    that is hardly more than there was."""
    left = second.fit
    if left.score <= UNDERRATED:
        return first
    factor = [max(float(m), 1.0) for m in left.misfit]
    records = first.problem.records
    problem = first.problem.on([replace(r, noise=r.noise * np.sqrt(f)) for r, f in zip(records, factor, strict=True)])
    louder = replace(first, problem=problem)
    null = updated(louder)
    if null is None:
        return first
    given = Given(first.split.of(problem), first.reduced, first.g_rows, null.p, first.settings)
    return judged_with(louder, given, null, first.sigma)
