"""The command `femend`, also as `python -m femend`."""

from __future__ import annotations

import os
import signal
import sys
from contextlib import suppress
from typing import Any

__all__ = ["main"]

# exit code of a command that was stopped by hand
INTERRUPTED = 130


def main() -> None:
    """Runs the command line. What it takes is imported here, so that Ctrl-C ends that too with a sentence and code 130:
    nothing has begun then, and an exception would be raised in the middle of a library that may make another of it."""
    before = signal.getsignal(signal.SIGINT)
    if before is signal.default_int_handler:
        signal.signal(signal.SIGINT, _end)
    from femend.cli import main as command

    if before is signal.default_int_handler:
        signal.signal(signal.SIGINT, before)
    try:
        command(prog_name="femend")
    except SystemExit as end:
        if end.code != INTERRUPTED:
            raise
        _leave()
    except KeyboardInterrupt:  # once more, while the first one was told
        _leave()


def _leave() -> None:
    """Ends with the code of an interruption. On its usual way out the interpreter would end by the signal itself if it
    had come while a text was executed, as it is where a dataclass is made, or if it came again."""
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError):  # nobody reads it any more
            stream.flush()
    os._exit(INTERRUPTED)


def _end(number: int, frame: Any) -> None:
    """Says what an interruption says of itself that nothing was written before, and ends."""
    os.write(2, b"\ninterrupted; no result was written\n")
    os._exit(INTERRUPTED)


if __name__ == "__main__":
    main()
