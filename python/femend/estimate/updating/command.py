"""One run of the user's own solver: input files from templates, a command with a time limit, results read back."""

from __future__ import annotations

import contextlib
import os
import re
import shutil
import signal
import subprocess
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from femend.errors import ExternalSolverError, UpdatingError

__all__ = ["Command", "fill"]

# {{name}} or {{name:format}}, the format as Python writes it
FIELD = re.compile(r"\{\{\s*(\w+)\s*(?::([^}]*))?\}\}")
TAIL = 12


@dataclass(frozen=True, eq=False)
class Command:
    """A solver called as a program.

    `arguments`: the program and its arguments, run in a folder of its own that holds the filled `templates` (file name
    to text; `{{name}}` or `{{name:.6E}}` takes a value, nine decimals with exponent by default). `read` maps that
    folder to results by name (as of `State`). A run that takes longer than `time_limit` s is ended with all it started.
    `errors_in` are patterns that mean failure wherever they stand in the output, whatever the exit code (CalculiX ends
    with 0 after some errors). `depends_on` is what else its results depend on (a script, what is read): with another
    text, results that were kept are not taken.
    """

    arguments: tuple[str, ...]
    templates: Mapping[str, str]
    read: Callable[[Path], Mapping[str, NDArray[Any]]]
    time_limit: float = 600.0
    errors_in: tuple[str, ...] = (r"\*ERROR",)
    environment: Mapping[str, str] | None = None
    depends_on: str = ""

    def __post_init__(self) -> None:
        if not self.arguments or not self.templates:
            raise UpdatingError("an external solver takes a command and at least one template of an input file")
        if not self.time_limit > 0:
            raise UpdatingError(f"the time limit of the solver is {self.time_limit:g} s; it has to be above 0")

    @property
    def fields(self) -> tuple[str, ...]:
        """Names of the values that the templates take."""
        return tuple(dict.fromkeys(m.group(1) for text in self.templates.values() for m in FIELD.finditer(text)))

    def run(self, values: Mapping[str, float], folder: Path) -> dict[str, NDArray[Any]]:
        """Results at `values` of the fields, worked out in `folder`, which stays as it is for a look.

        Raises ExternalSolverError for a program that is missing, crashes, exceeds its time or leaves nothing readable.
        """
        program = shutil.which(self.arguments[0])
        if program is None:
            raise ExternalSolverError(
                f"there is no program {self.arguments[0]!r} on this machine; install it or give its path",
                reason="missing",
                folder=str(folder),
            )
        folder.mkdir(parents=True, exist_ok=True)
        for name, text in self.templates.items():
            (folder / name).write_text(fill(text, values), encoding="utf-8")
        code, output = self._called((program, *self.arguments[1:]), folder)
        at = ", ".join(f"{k} = {v:.6g}" for k, v in values.items())
        said = "\n".join(output.strip().splitlines()[-TAIL:])
        wrong = next((x.strip() for x in output.splitlines() if any(re.search(p, x) for p in self.errors_in)), None)
        if code is None:
            raise ExternalSolverError(
                f"{self.arguments[0]} took longer than {self.time_limit:g} s at {at} and was ended; raise the time "
                f"limit or look in {folder}",
                reason="time limit",
                folder=str(folder),
            )
        if code != 0 or wrong is not None:
            how = f"ended with code {code}" if code else f"wrote '{wrong}'"
            raise ExternalSolverError(
                f"{self.arguments[0]} {how} at {at}; its last words in {folder}:\n{said}",
                reason="crashed",
                folder=str(folder),
            )
        return self._results(folder, at)

    def _called(self, arguments: Sequence[str], folder: Path) -> tuple[int | None, str]:
        """Exit code, None where the time was over, and everything written to the terminal, kept in `solver.log`."""
        log = folder / "solver.log"
        environment = None if self.environment is None else {**os.environ, **self.environment}
        with log.open("wb") as file:
            try:
                process = subprocess.Popen(
                    list(arguments),
                    cwd=folder,
                    stdin=subprocess.DEVNULL,
                    stdout=file,
                    stderr=subprocess.STDOUT,
                    start_new_session=True,
                    env=environment,
                )
            except OSError as error:
                raise ExternalSolverError(
                    f"{arguments[0]} cannot be started: {error}", reason="missing", folder=str(folder)
                ) from error
            try:
                code: int | None = process.wait(timeout=self.time_limit)
            except subprocess.TimeoutExpired:
                code = None
            finally:
                # also what the program itself has started, and also when we are interrupted
                if process.poll() is None or code is None:
                    with contextlib.suppress(ProcessLookupError, PermissionError):
                        os.killpg(process.pid, signal.SIGKILL)
                    process.wait()
        return code, log.read_text(encoding="utf-8", errors="replace")

    def _results(self, folder: Path, at: str) -> dict[str, NDArray[Any]]:
        try:
            found = {name: np.asarray(value) for name, value in self.read(folder).items()}
            broken = next((n for n, v in found.items() if v.size == 0 or not np.isfinite(v).all()), None)
        except Exception as error:  # a reader meets anything in what a broken solver writes
            raise ExternalSolverError(
                f"what {self.arguments[0]} wrote at {at} cannot be read ({type(error).__name__}: {error}); look in "
                f"{folder}",
                reason="unreadable",
                folder=str(folder),
            ) from error
        if broken is not None:
            raise ExternalSolverError(
                f"{self.arguments[0]} gave a {broken!r} that is empty or not a number at {at}; look in {folder}",
                reason="unreadable",
                folder=str(folder),
            )
        return found


def fill(text: str, values: Mapping[str, float]) -> str:
    """`text` with its fields `{{name}}`, `{{name:format}}` replaced by `values`; raises UpdatingError for one not
    given.

    >>> fill("*ELASTIC\\n{{E:.3E}}, 0.3", {"E": 2.1e11})
    '*ELASTIC\\n2.100E+11, 0.3'
    """

    def one(match: re.Match[str]) -> str:
        name, form = match.group(1), match.group(2)
        if name not in values:
            raise UpdatingError(f"the template has a field {name!r} and no value for it; there are {', '.join(values)}")
        try:
            return format(values[name], (form or ".9E").strip())
        except ValueError as error:
            raise UpdatingError(f"field {name!r} has the format {form!r}: {error}") from error

    return FIELD.sub(one, text)
