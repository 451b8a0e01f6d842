"""What a study says of a solver of the user's own, checked and with defaults."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

__all__ = ["FORMATS", "SolverSettings", "SolverValue"]

# formats of results, with the endings that tell them
FORMATS = {"calculix": (".dat",), "universal": (".unv", ".uff"), "table": (".csv",)}


@dataclass(frozen=True, slots=True)
class SolverValue:
    """``[[solver.value]]``: the field called `name` of the input files has `value`, of which a factor with the 1-sigma
    `prior_sd` and `bounds` is updated."""

    name: str
    value: float
    prior_sd: float = 0.1
    bounds: tuple[float, float] | None = None


@dataclass(frozen=True, slots=True)
class SolverSettings:
    """``[solver]``: `arguments` of the program, with the paths of files beside the study; the input `files` with
    fields, the first of which is the deck; the `result` that it leaves, in `format` (a key of `FORMATS`); its `values`.

    A run takes `time_limit` s at most, `parallel` go on together, derivatives are differences over `step`, a share of
    each value. `folder` keeps what runs gave, beside the study. `scripts` are the files among the arguments.
    """

    arguments: tuple[str, ...] = ()
    files: tuple[Path, ...] = ()
    result: str = ""
    format: str = ""
    values: tuple[SolverValue, ...] = ()
    time_limit: float = 600.0
    parallel: int = 1
    step: float = 0.01
    folder: str = "solver_runs"
    scripts: tuple[Path, ...] = ()
