"""The diagnosis of a run that was interrupted: what is settled, what is likeliest, and a sentence on what is not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from femend.diagnose.deciding.accepted import accepted
from femend.diagnose.deciding.outcome import Diagnosis
from femend.diagnose.deciding.so_far import SoFar
from femend.diagnose.deciding.verdict import refitted_to_all
from femend.diagnose.locating.split import Split, split_records
from femend.diagnose.naming.judge import Given, to_beat
from femend.diagnose.naming.ranked import Ranked, tempered
from femend.diagnose.settings import Settings
from femend.numerals import plain

__all__ = ["undecided"]

# places that are told
TOLD = 3
# share of what the updated model leaves up to which a law explains most of it
MOST = 0.5
# what is said of one effect beside which others were looked for
MAYBE_MORE = (
    '{why} in the step "{step}": what it had found leaves more than noise, and whether two effects '
    "explain it better is not decided; run the study again to its end"
)

AGAIN = "nothing of this is decided: run the study again to its end for a verdict"
# what is said where the updated model explains the recordings
AT_THE_NOISE = (
    "the updated model explains the recordings, the ones that choose too; whether a law would relieve its parameters "
    "is not decided: run the study again to its end for a verdict"
)
# what is said where one force at one place explains them
PLACE_ALONE = "one force there explains the recordings, by which law is not decided: run the study again to its end"


def undecided(
    so_far: SoFar, step: str, settings: Settings | None = None, why: str = "the run was interrupted"
) -> Diagnosis | None:
    """What the diagnosis `so_far` had settled when it was interrupted in the step called `step`, for the reason `why`;
    None where its update was not done. One that had come to its end is returned as it is, and so is one that looked for
    more effects than it had found, which its advice says.

    Before that the best law judged so far is the likeliest of something that is located and not named, if it brings
    what a law has to bring. Without one the place is told where the updated model is far from the noise and one force
    there explains the recordings; else the verdict is "undetermined". The final model is the updated one then.
    """
    if so_far.found is not None:
        return so_far.found
    if so_far.decided is not None:
        one = so_far.decided
        advice = "; ".join(filter(None, [one.advice, MAYBE_MORE.format(why=why, step=step)]))
        return replace(one, off=so_far.off, driven=so_far.driven, advice=advice, interrupted=True)
    start, settings = so_far.start, settings or Settings()
    if start is None:
        return None
    split = split_records(start.problem, start.null, so_far.located)
    alone = to_beat(Given(split, start.reduced, start.g_rows, start.null.p, settings), start.null)
    ranked = sorted(so_far.ranked, key=lambda r: r.score)
    found = Diagnosis(
        "undetermined", start.problem, split, start.reduced, start.nominal, start.null, alone.candidate, alone.score,
        so_far.located, ranked, tempered(ranked, alone.score), None, None, None, "", settings, start.g_rows,
        alone.n_values, off=so_far.off, driven=so_far.driven, interrupted=True,
    )  # fmt: skip
    settled = _settled(so_far, ranked, split, alone.candidate.chosen, f'{why} in the step "{step}"')
    likeliest = _likeliest(found)
    if likeliest is None and _explained_there(found):
        place = found.located[0]
        return replace(found, verdict="located-not-named", place=place, advice=f"{settled}; {PLACE_ALONE}")
    if likeliest is None:
        at_noise = max(start.null.score, alone.candidate.chosen) <= settings.consistent
        return replace(found, advice=f"{settled}; {AT_THE_NOISE if so_far.located and at_noise else AGAIN}")
    law = refitted_to_all(found, likeliest, simulated=False)
    advice = f"{settled}; it is in the final model as the likeliest so far; {AGAIN}"
    return replace(found, verdict="located-not-named", best=law, place=likeliest.located, advice=advice)


def _likeliest(found: Diagnosis) -> Ranked | None:
    """The best law judged so far, if it brings what a law has to bring on whole records and explains most of what the
    updated model leaves of unseen data; None where the force is not known, since a law has to hold with the force free
    again."""
    best = found.ranked[0] if found.ranked else None
    if best is None or best.candidate.sigma > 0 or found.problem.load is not None or not np.isfinite(best.score):
        return None
    most = max(found.settings.adequate, MOST * found.null_chosen.chosen)
    return best if best.candidate.chosen <= most and accepted(found, best) else None


def _explained_there(found: Diagnosis) -> bool:
    """Whether the updated model is far from the noise, and one force at the first place explains the recordings; not
    where none was recorded, beside which any force explains much."""
    if not found.located or found.problem.load is not None:
        return False
    there, settings = found.located[0].fit, found.settings
    return bool(
        found.null.score > settings.far and there.score <= settings.adequate and not settings.bends(there.prior)
    )


def _settled(so_far: SoFar, ranked: list[Ranked], split: Split, without: float, stopped: str) -> str:
    """What is settled of a run that was `stopped`."""
    assert so_far.start is not None
    begun = f"{stopped}: the parameters are updated"
    if not so_far.located:
        return f"{begun}, no place was looked at yet"
    before = so_far.start.null.score
    named = [f"{one.place.where} ({plain(one.fit.score, 3)})" for one in so_far.located[:TOLD]]
    said = f"{begun} and leave a misfit of {plain(before, 3)}; with a free force it is least {', '.join(named)}"
    if ranked:
        best, name = ranked[0], ranked[0].candidate.name.replace("_", " ")
        on = "the recordings that choose" if split.unseen else "the recording"
        said += (
            f"; of {len(ranked)} laws judged so far {name} {best.located.place.where} leaves least, "
            f"{plain(best.candidate.chosen, 3)} on {on} where updating alone leaves {plain(without, 3)}"
        )
    else:
        said += "; no law was judged yet"
    return said
