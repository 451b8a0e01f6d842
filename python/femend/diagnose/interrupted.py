"""The diagnosis of a run that was interrupted: what is settled, no verdict, and a sentence on what is missing."""

from __future__ import annotations

from dataclasses import replace

from femend.diagnose.judge import Given, to_beat
from femend.diagnose.outcome import Diagnosis
from femend.diagnose.ranked import Ranked, tempered
from femend.diagnose.settings import Settings
from femend.diagnose.so_far import SoFar
from femend.diagnose.split import Split, split_records
from femend.numerals import plain

__all__ = ["undecided"]

# places that are told
TOLD = 3
# what is said of one effect beside which others were looked for
MAYBE_MORE = (
    'the run was interrupted in the step "{step}": what it had found leaves more than noise, and whether two effects '
    "explain it better is not decided; run the study again to its end"
)


def undecided(so_far: SoFar, step: str, settings: Settings | None = None) -> Diagnosis | None:
    """What the diagnosis `so_far` had settled when it was interrupted in the step called `step`; None where its update
    was not done. One that had come to its end is returned as it is, and so is one that looked for more effects than it
    had found, which its advice says.

    Before that the verdict is "undetermined", and the final model is the updated one.
    """
    if so_far.found is not None:
        return so_far.found
    if so_far.decided is not None:
        one = so_far.decided
        advice = "; ".join(filter(None, [one.advice, MAYBE_MORE.format(step=step)]))
        return replace(one, driven=so_far.driven, advice=advice, interrupted=True)
    start, settings = so_far.start, settings or Settings()
    if start is None:
        return None
    split = split_records(start.problem, start.null, so_far.located)
    alone = to_beat(Given(split, start.reduced, start.g_rows, start.null.p, settings), start.null)
    ranked = sorted(so_far.ranked, key=lambda r: r.score)
    return Diagnosis(
        "undetermined", start.problem, split, start.reduced, start.nominal, start.null, alone.candidate, alone.score,
        so_far.located, ranked, tempered(ranked, alone.score), None, None, None,
        _told(so_far, ranked, split, alone.candidate.chosen, step), settings, start.g_rows, alone.n_values,
        driven=so_far.driven, interrupted=True,
    )  # fmt: skip


def _told(so_far: SoFar, ranked: list[Ranked], split: Split, without: float, step: str) -> str:
    """What is settled, what is not, and how to go on."""
    assert so_far.start is not None
    begun = f'the run was interrupted in the step "{step}": the parameters are updated'
    if not so_far.located:
        return f"{begun}, no place was looked at yet; run the study again to its end for a verdict"
    before = so_far.start.null.score
    named = [f"{one.place.where} ({plain(one.fit.score, 3)})" for one in so_far.located[:TOLD]]
    said = f"{begun} and leave a misfit of {plain(before, 3)}; with a free force it is least {', '.join(named)}"
    if ranked:
        best = ranked[0]
        on = "the recordings that choose" if split.unseen else "the recording"
        said += (
            f"; of {len(ranked)} laws judged so far {best.candidate.name} {best.located.place.where} leaves least, "
            f"{plain(best.candidate.chosen, 3)} on {on} where updating alone leaves {plain(without, 3)}"
        )
    else:
        said += "; no law was judged yet"
    return f"{said}; nothing of this is decided: run the study again to its end for a verdict"
