"""A test that contradicts its deck as a whole (units, a time step, supports that are not selected): what the updated
model leaves of it has no place, and no law makes up for it."""

from __future__ import annotations

from dataclasses import replace

from femend.diagnose.deciding.interrupted import undecided
from femend.diagnose.deciding.outcome import Diagnosis
from femend.diagnose.deciding.plain_error import whole_errors
from femend.diagnose.deciding.so_far import SoFar
from femend.diagnose.updating.update import UpdatedModel
from femend.numerals import plain

__all__ = ["nothing_followed"]

# share of the recordings that an updated model leaves which follows none of them; one that stands still leaves all
NOTHING = 0.8


def nothing_followed(start: UpdatedModel) -> Diagnosis | None:
    """The diagnosis of a test that is doubted as a whole and of which the updated model follows hardly anything, so
    that there is nothing to look for; None where it does follow."""
    settled = undecided(SoFar(start=start), "")
    assert settled is not None  # there is an update
    before, _ = whole_errors(settled)
    if before < NOTHING:
        return None
    advice = (
        f"the updated model leaves {plain(100 * before, 3)} % of the recordings, and deck and recordings contradict "
        "each other as a whole: nothing was looked for beside that"
    )
    return replace(settled, interrupted=False, advice=advice)
