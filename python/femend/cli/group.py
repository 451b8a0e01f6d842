"""The command `femend`: which subcommands there are, and how bad news reaches the terminal.

Exit codes: 0 the command did its work (whatever the verdict), 2 the input is broken or the command was misused,
130 interrupted (then it says what was written, if anything). A traceback appears only for a fault of femend itself.
"""

from __future__ import annotations

import difflib
import math
import signal
import sys
import threading
import warnings
from collections.abc import Sequence
from time import monotonic
from types import FrameType
from typing import Any

import click

from femend import __version__
from femend.cli.correlate import correlate
from femend.cli.demo import demo
from femend.cli.diagnose import diagnose
from femend.cli.inspect import inspect
from femend.cli.modes import modes
from femend.cli.op4_to_dmig import op4_to_dmig
from femend.cli.population import population
from femend.cli.pretest import pretest
from femend.cli.selftest import selftest
from femend.cli.update import update
from femend.errors import FemendError

__all__ = ["Commands", "main"]

# seconds within which signals to end are of one wish
TOGETHER = 1.0


class Commands(click.Group):
    """A group whose errors are one clear message each."""

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """The command that is asked for; click.UsageError, with those there are, where it is none."""
        if args and not args[0].startswith("-") and self.get_command(ctx, args[0]) is None:
            raise click.UsageError(_no_command(args[0], self.list_commands(ctx)), ctx)
        return super().resolve_command(ctx, args)

    def main(
        self,
        args: Sequence[str] | None = None,
        prog_name: str | None = None,
        complete_var: str | None = None,
        standalone_mode: bool = True,
        **extra: Any,
    ) -> Any:
        """Run the command line and exit with its code; the arguments are those of `click.Group.main`."""
        if not standalone_mode:
            return super().main(args, prog_name, complete_var, False, **extra)
        if not sys.warnoptions:
            # numerics of libraries: what matters of them has a status, and no user can act on the rest
            warnings.filterwarnings("ignore", category=RuntimeWarning)
        _stop_as_by_hand()
        try:
            code = super().main(args, prog_name, complete_var, False, **extra)
        except click.ClickException as error:
            error.show()
            sys.exit(error.exit_code)
        except (click.Abort, KeyboardInterrupt) as stop:
            click.echo(_stopped(stop), err=True)
            sys.exit(130)
        except FemendError as error:
            click.echo(f"error: {_with_place(error)}", err=True)
            for note in (*getattr(error, "__notes__", ()), *_numerics(error)):
                click.echo(f"note: {note}", err=True)
            sys.exit(2)
        except OSError as error:
            click.echo(f"error: {_os_message(error)}", err=True)
            sys.exit(2)
        sys.exit(code if isinstance(code, int) else 0)


def _no_command(wanted: str, known: Sequence[str]) -> str:
    """What is said of a command that does not exist: the nearest one, or the one for the main job, and all others."""
    close = difflib.get_close_matches(wanted.lower(), known, n=1)
    meant = f"did you mean {close[0]!r}?" if close else "'diagnose' runs a study."
    return f"there is no command {wanted!r}; {meant} The commands are {', '.join(known)}"


class _Stop:
    """Handler of signals that end a run: one that follows another at once is of the same wish (a time limit of the
    shell, or a queue of jobs, tells the process and then its group), and does not interrupt what the first one made it
    write."""

    def __init__(self) -> None:
        self._told = -math.inf

    def __call__(self, number: int, frame: FrameType | None) -> None:
        before, self._told = self._told, monotonic()
        if self._told - before > TOGETHER:
            signal.default_int_handler(number, frame)


def _stop_as_by_hand() -> None:
    """A job that is told to end (SIGTERM: a time limit, a machine that goes down) writes what is settled, as with
    Ctrl-C."""
    if threading.current_thread() is not threading.main_thread():
        return
    stop = _Stop()
    signal.signal(signal.SIGTERM, stop)
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, stop)


def _stopped(stop: BaseException) -> str:
    """What an interruption says of itself; click puts its own exception around it."""
    cause = stop.__cause__ if isinstance(stop, click.Abort) else stop
    return str(cause) if isinstance(cause, KeyboardInterrupt) and cause.args else "interrupted; no result was written"


def _with_place(error: FemendError) -> str:
    """The message, with file and line in front where the exception knows them and the message does not say them."""
    message = str(error)
    file, line = getattr(error, "file", None), getattr(error, "line", None)
    if file is None or str(file) in message:
        return message
    return f"{file}:{line}: {message}" if line is not None else f"{file}: {message}"


def _numerics(error: FemendError) -> list[str]:
    """What to do where the core's algebra ended, which knows neither deck nor recordings."""
    if not str(error).startswith(("matrix is", "factorisation failed")):
        return []
    return [
        "a mass or stiffness of the model has no inverse where one is needed: `femend modes` on the deck tells "
        "negative and missing values and what moves freely, `femend correlate` units and levels of the recordings; "
        "where both are sound, this is a fault of femend: please report it"
    ]


def _os_message(error: OSError) -> str:
    if error.strerror is None:
        return str(error)
    return f"{error.strerror}: {error.filename}" if error.filename is not None else error.strerror


@click.group(cls=Commands, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__, "--version", "-V", prog_name="femend", message="%(prog)s %(version)s")
def main() -> None:
    """Update a finite-element model with recordings, and say what physics it leaves out, where, and how much."""


main.add_command(correlate)
main.add_command(diagnose)
main.add_command(demo)
main.add_command(inspect)
main.add_command(modes)
main.add_command(op4_to_dmig)
main.add_command(population)
main.add_command(pretest)
main.add_command(selftest)
main.add_command(update)
