"""The history of an updating run, kept in a file after every step so that it can be taken up again."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from femend.errors import UpdatingError
from femend.estimate.updating.problem import Problem
from femend.estimate.updating.problem_told import differences, told_problem
from femend.io.atomic import write_atomic

__all__ = ["Iteration", "read_history", "write_history"]

FORMAT = "femend-updating/1"


@dataclass(frozen=True, slots=True)
class Iteration:
    """One accepted point: p, its cost and squares, the radius of the next step, modes (first test mode 0) by
    configuration with their mates (-1: none), and what happened on the way there, in words; `mac` are the modes'
    agreements with their mates, `let_go` how often each had lost its mate and was let go."""

    p: tuple[float, ...]
    cost: float
    squares: float
    radius: float
    mates: tuple[tuple[int, ...], ...]
    notes: tuple[str, ...] = ()
    mac: tuple[tuple[float, ...], ...] = ()
    let_go: tuple[tuple[int, ...], ...] = ()


def write_history(path: str | Path, problem: Problem, iterations: list[Iteration], status: str) -> None:
    """Writes `iterations` of `problem` with their `status` to `path`, complete or not at all."""
    content = {
        "format": FORMAT,
        "problem": problem.fingerprint,
        "unknowns": list(problem.unknowns.names),
        "told": told_problem(problem),
        "status": status,
        "iterations": [asdict(i) for i in iterations],
    }
    write_atomic(path, json.dumps(content, indent=1))


def read_history(path: str | Path, problem: Problem) -> list[Iteration]:
    """The iterations kept in `path`; raises UpdatingError where they are not of this `problem`, naming what differs, or
    cannot be read."""
    try:
        content = json.loads(Path(path).read_text(encoding="utf-8"))
        found = [
            Iteration(
                tuple(i["p"]),
                i["cost"],
                i["squares"],
                i["radius"],
                tuple(tuple(m) for m in i["mates"]),
                tuple(i["notes"]),
                # files of earlier versions have neither
                tuple(tuple(m) for m in i.get("mac", ())),
                tuple(tuple(m) for m in i.get("let_go", ())),
            )
            for i in content["iterations"]
        ]
        same = content["format"] == FORMAT and content["problem"] == problem.fingerprint
        differ = differences(content["told"], problem) if not same and content.get("told") else ""
    except (OSError, ValueError, KeyError, TypeError, AttributeError, IndexError) as error:
        raise UpdatingError(f"{path} is no history of an updating run: {error}") from error
    if not same:
        raise UpdatingError(
            f"{path} is the history of another problem ({differ or 'unknowns, priors, limits or data differ'}): put "
            "that back to go on from it, or start anew with another file"
        )
    if not found or not np.isfinite(found[-1].p).all():
        raise UpdatingError(f"{path} holds no iteration to go on from; start anew with another file")
    return found


def point(iteration: Iteration) -> NDArray[np.float64]:
    """p (n,) of an iteration."""
    return np.array(iteration.p)
