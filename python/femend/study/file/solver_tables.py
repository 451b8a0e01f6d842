"""Checking what a study says of a solver of the user's own."""

from __future__ import annotations

import math
import os
import re
import shlex
from collections import Counter
from pathlib import Path

from femend.errors import StudyError
from femend.study.file.check import FileCheck
from femend.study.file.parameter_targets import checked_prior
from femend.study.file.schema import SolverTable
from femend.study.file.solver_settings import FORMATS, SolverSettings, SolverValue

__all__ = ["solver_settings"]

_NAME = re.compile(r"\w+")


def solver_settings(check: FileCheck, table: SolverTable | None) -> SolverSettings | None:
    """``[solver]`` of a study, None without one; raises StudyError, naming the key, for files that are not there, and
    values that stand twice or are none."""
    if table is None:
        return None
    if not table.files:
        raise check.fail("solver.files", 'the list is empty; name the input files, the deck first, as ["beam.inp"]')
    files = tuple(check.existing(f"solver.files[{i}]", name) for i, name in enumerate(table.files))
    twice = next((n for n, times in Counter(f.name for f in files).items() if times > 1), None)
    if twice is not None:
        raise check.fail(
            "solver.files", f"two are called {twice!r}; they come into one folder, give them their own names"
        )
    if not (math.isfinite(table.time_limit) and table.time_limit > 0):
        raise check.fail("solver.time_limit", f"{table.time_limit:g} is not above 0; it is in seconds")
    if table.parallel < 1:
        raise check.fail("solver.parallel", f"{table.parallel} is less than one")
    if not 0 < table.step < 1:
        raise check.fail("solver.step", f"{table.step:g} is not between 0 and 1; 0.01 is 1 % of each value")
    arguments, scripts = _arguments(check, table.command, files[0])
    result = _filled(check, "solver.result", table.result, files[0])
    return SolverSettings(
        arguments,
        files,
        result,
        _format(check, table, result),
        _values(check, table),
        table.time_limit,
        table.parallel,
        table.step,
        table.folder,
        scripts,
    )


def _filled(check: FileCheck, key: str, text: str, deck: Path) -> str:
    """`text` with {deck} and {stem}, the name of the deck's file with and without its ending."""
    found = text.replace("{deck}", deck.name).replace("{stem}", deck.stem)
    if not found.strip() or re.search(r"\{\w*\}", found):
        raise check.fail(key, f"{text!r} has something other in braces than {{deck}} and {{stem}}, or nothing in it")
    return found


def _arguments(check: FileCheck, command: str, deck: Path) -> tuple[tuple[str, ...], tuple[Path, ...]]:
    """The words of the command, those that are files beside the study with their whole paths, and these files."""
    try:
        words = shlex.split(_filled(check, "solver.command", command, deck))
    except ValueError as error:
        raise check.fail("solver.command", f"{command!r} cannot be taken apart ({error}); look at its quotes") from None
    arguments, scripts = [], []
    for word in words:
        # an input file of this name is in the folder of the run, filled
        path = None if word == deck.name else _beside(check, word)
        arguments.append(word if path is None else str(path))
        scripts += [] if path is None else [path]
    return tuple(arguments), tuple(scripts)


def _beside(check: FileCheck, word: str) -> Path | None:
    """The file of this name beside the study; None where there is none. Links are not followed: an interpreter knows
    its environment by the name it is called by."""
    try:
        check.existing("solver.command", word)
    except (StudyError, OSError):
        return None
    return Path(os.path.abspath(check.file.parent / Path(os.path.expanduser(word))))


def _format(check: FileCheck, table: SolverTable, result: str) -> str:
    """The format of the result, told by its ending where the study does not say it."""
    if table.format is not None:
        check.one_of("solver.format", table.format, tuple(FORMATS))
        return table.format
    found = next((f for f, endings in FORMATS.items() if result.lower().endswith(endings)), None)
    if found is None:
        raise check.fail(
            "solver.format",
            f"is missing, and the ending of {result!r} does not tell it; say one of {', '.join(FORMATS)}",
        )
    return found


def _values(check: FileCheck, table: SolverTable) -> tuple[SolverValue, ...]:
    if not table.value:
        raise check.fail(
            "solver.value",
            "is missing; give a [[solver.value]] for each field {{name}} of the files, with the value it has now",
        )
    check.unique("solver.value", [v.name for v in table.value])
    out = []
    for i, v in enumerate(table.value):
        key, who = f"solver.value[{i}]", f"value {v.name!r}"
        if not _NAME.fullmatch(v.name):
            raise check.fail(f"{key}.name", f"{v.name!r} is no name of a field; letters, digits and _ make one")
        if not (math.isfinite(v.value) and v.value):
            raise check.fail(
                f"{key}.value", f"{who}: {v.value:g} has no factor that changes it; give what the file has now"
            )
        bounds = checked_prior(check, key, who, v.prior_sd, v.bounds)
        out.append(SolverValue(v.name, v.value, v.prior_sd, bounds))
    return tuple(out)
