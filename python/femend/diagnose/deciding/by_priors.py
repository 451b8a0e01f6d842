"""What a finding rests on where the updated model explains the recordings without it: the priors that it leaves."""

from __future__ import annotations

import numpy as np

from femend.diagnose.deciding.accepted import explains_alone
from femend.diagnose.deciding.outcome import Diagnosis
from femend.numerals import listed, plain

__all__ = ["rests_on_priors"]

# prior standard deviations from which an unknown is told; parameters that are named
FAR, NAMED = 3.0, 3


def rests_on_priors(found: Diagnosis) -> str:
    """What the updated model would have to be like for the recordings to lack nothing, where they do not tell a law
    that was found from that; nothing where they do, or where no law was found."""
    null = found.null
    if found.best is None or found.verdict != "missing-physics" or not explains_alone(found):
        return ""
    reduced = null.hypothesis.reduced
    mean, sd = found.problem.prior(reduced)
    off = (null.p - mean) / sd
    own = [int(i) for i in np.argsort(-np.abs(off[: len(reduced.model.parameters)])) if abs(off[i]) > FAR]
    parts = [
        f"{reduced.names[i]!r} at {plain(float(np.exp(null.p[i])))} times the deck's value ({plain(abs(off[i]), 2)} of "
        "its prior standard deviations)"
        for i in own
    ]
    tuned = off[len(reduced.names) : len(reduced.names) + found.problem.n_tuned]
    scatter = off[len(reduced.model.parameters) : len(reduced.names)]
    for what, worst in (
        ("frequencies of modes", float(np.abs(tuned).max(initial=0.0))),
        ("what members differ by", float(np.abs(scatter).max(initial=0.0))),
    ):
        if worst > FAR:
            parts.append(f"{what} {plain(worst, 2)} standard deviations off")
    needs = listed(parts, NAMED) if parts else "many small departures from its priors together"
    return (
        f"without what was found the updated model explains the recordings as well, but needs {needs} for it: the "
        "finding rests on these priors, not on the misfit. Where such values are plausible, widen prior_sd and run "
        "it again"
    )
