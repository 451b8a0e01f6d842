"""What a study says when it was stopped by hand."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from femend.study.result.study_run import StudyRun

__all__ = ["StudyInterrupted", "nothing_settled"]


class StudyInterrupted(KeyboardInterrupt):
    """A study that was stopped by hand after its parameters were updated.

    Attributes: `run` is what is settled, as of a finished run, with the status "interrupted" unless the diagnosis was
    complete already: the verdict of the first effect while more are looked for, "located-not-named" with the likeliest
    law so far where one brings what a law has to bring, else "undetermined". `out` is the folder it was written to,
    None for none.
    """

    def __init__(self, run: StudyRun, step: str, out: Path | None) -> None:
        super().__init__(_told(run, step, out))
        self.run = run
        self.out = out


def nothing_settled(step: str) -> KeyboardInterrupt:
    """The interruption in the step called `step`, before anything was settled."""
    return KeyboardInterrupt(
        f'interrupted in the step "{step}", before the parameters were updated; no result was written: run it again'
    )


def _told(run: StudyRun, step: str, out: Path | None) -> str:
    if not run.diagnosis.interrupted:
        where = "is in `run`" if out is None else f"was written to {out}"
        return f"interrupted when the diagnosis was complete; all of it {where}"
    d = run.diagnosis
    settled = "the updated parameters, their errors"
    settled += f", {len(d.located)} ranked places" if d.located else ""
    settled += f", {len(d.ranked)} laws judged so far" if d.ranked else ""
    kept = "`run` has" if out is None else f"written to {out}:"
    if d.verdict == "undetermined":
        decided = "what the model lacks, if anything, is not decided: run the same again to its end for a verdict"
    else:
        decided = "whether the model lacks more than that is not decided: run the same again to its end for it"
    return f'interrupted in the step "{step}"; {kept} {settled} (verdict {d.verdict}, status interrupted); {decided}'
