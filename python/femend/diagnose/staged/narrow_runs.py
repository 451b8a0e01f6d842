"""Runs that go through too few speeds to be fitted: what is told of them, and what to do."""

from __future__ import annotations

from collections.abc import Sequence

from femend.diagnose.staged.loads import FEWEST_LINES, ods_lines_of
from femend.diagnose.staged.prepare import RunData
from femend.diagnose.staged.run_modes import too_short_for_modes
from femend.numerals import listed, plain

__all__ = ["is_too_narrow", "narrow_runs"]

# share of the mean up to which a speed that moves is one that is held
HELD = 0.05
# names that are listed at most
LISTED = 6


def is_too_narrow(data: RunData) -> bool:
    """Does a run hold fewer lines of operating shapes than its forces can be told from?"""
    return len(ods_lines_of(data)) < FEWEST_LINES


def narrow_runs(runs: Sequence[RunData]) -> list[str]:
    """A sentence for each of the `runs` that go through too few speeds, one for all whose speed is held."""
    held = [run for run in runs if _is_held(run)]
    told = [_narrow(run) for run in runs if run not in held]
    return [*told, *([_held(held)] if held else [])]


def _is_held(data: RunData) -> bool:
    return float(data.rev_per_s.max() - data.rev_per_s.min()) <= HELD * float(data.rev_per_s.mean())


def _narrow(data: RunData) -> str:
    return (
        f"{too_short_for_modes(data)}. It is left out; if it did go through more speeds, check that channel "
        f"{data.speed.source} holds the tacho, and the time axis"
    )


def _held(runs: Sequence[RunData]) -> str:
    """What is told of runs at held speeds."""
    speeds = [float(run.rev_per_s.mean()) for run in runs]
    names = listed((repr(run.name) for run in runs), LISTED)
    if len(runs) == 1:
        at, they, todo = (
            f"at {plain(speeds[0])} rev/s",
            "it is",
            f"; if it did run up, check that channel {runs[0].speed.source} holds the tacho",
        )
    else:
        at, they, todo = f"at {plain(min(speeds))} to {plain(max(speeds))} rev/s", "they are", ""
    return (
        f"recording{'s' * (len(runs) > 1)} {names}: the speed is held, {at}, and the forces of a run are told "
        f"from {FEWEST_LINES} lines of one recording at least, so that {they} left out{todo}; record a run-up, or all "
        "steps in one file without a stop. `femend correlate` compares held speeds, and `femend update` fits them with "
        "'orders' in [updating] responses"
    )
