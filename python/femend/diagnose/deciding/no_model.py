"""Where nothing is missing in a model that does not explain the recordings all the same: what it lacks counted as
noise."""

from __future__ import annotations

import numpy as np

from femend.diagnose.deciding.outcome import Diagnosis
from femend.diagnose.deciding.plain_error import whole_errors
from femend.diagnose.updating.noise import Louder
from femend.numerals import plain

__all__ = ["no_model"]

# share of the recordings that an updated model leaves, and multiple of the noise, from which it is no model of what was
# tested: what a mesh or an idealisation is off by is far less
FOLLOWS_LITTLE, FAR_ABOVE = 0.3, 3.0


def no_model(found: Diagnosis, raised: Louder | None) -> str:
    """What has to be said where nothing is missing in an updated model that follows hardly any of the recordings, and
    what it leaves counted as noise, `raised`; "" elsewhere, and where a force was not recorded."""
    driven = found.problem.load is None and all(r.driven for r in found.problem.records)
    if raised is None or found.verdict not in ("consistent", "parameters-only") or not driven:
        return ""
    before, _ = whole_errors(found)
    times = float(np.sqrt(max(raised.factor.values())))
    if before < FOLLOWS_LITTLE or times < FAR_ABOVE:
        return ""
    return (
        f"the updated model leaves {plain(100 * before, 2)} % of the recordings, {plain(times, 2)} times their noise, "
        "and no parameter, force or law at one place takes that away: this is no model of what was tested, or not of "
        "how. Check which node and direction each sensor and the force stand at (`femend correlate` names what does "
        "not fit), the supports and the units of deck and recordings"
    )
