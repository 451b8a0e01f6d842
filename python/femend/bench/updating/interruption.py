"""What an update says when it was stopped by hand."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from femend.bench.updating.update_run import UpdateRun

__all__ = ["UpdateInterrupted", "search_stopped", "what_is_lacking"]


class UpdateInterrupted(KeyboardInterrupt):
    """An update that was stopped by hand after its search from the deck, while it followed other starts or drew from
    the posterior.

    Attributes: `run` has what was found until then, with a warning of what it lacks. `out` is the folder it was written
    to, None for none.
    """

    def __init__(self, run: UpdateRun, step: str, out: Path | None, partly: str = "") -> None:
        where = "is in `run`" if out is None else f"was written to {out}"
        lacking = what_is_lacking(step, partly)
        super().__init__(f'interrupted in the step "{step}"; what was found before {where}: {lacking}')
        self.run = run
        self.out = out


def what_is_lacking(step: str, partly: str = "") -> str:
    """What a result lacks that was stopped in the `step`, of which it has a part where `partly` says what is missing of
    it."""
    if partly:
        return f"{partly}, and what comes after it is missing; run the same again to its end for them"
    return f'the step "{step}" and what comes after it are missing; run the same again to its end for them'


def search_stopped(history: Path | None) -> KeyboardInterrupt:
    """The interruption of the search from the deck, of which `history` keeps the steps."""
    if history is None or not history.is_file():
        kept = "with --history FILE (`history` in Python) a run that is stopped goes on where it was"
    else:
        kept = f"{history} keeps the steps made, from which the same run goes on"
    return KeyboardInterrupt(f'interrupted in the step "update parameters"; no result was written: {kept}')
