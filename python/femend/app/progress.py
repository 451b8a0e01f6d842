"""Progress of a long job: a bar on a terminal, plain lines elsewhere, silence by default."""

from __future__ import annotations

import sys
import time
from typing import Any, TextIO

from femend.progress import Progress, SilentProgress

__all__ = ["BarProgress", "LineProgress", "Progress", "SilentProgress", "progress_for"]


class LineProgress:
    """One plain line when a step ends, for logs and pipes."""

    def __init__(self, stream: TextIO | None = None) -> None:
        self._stream = stream if stream is not None else sys.stderr
        self._step = ""
        self._since = 0.0
        self._count = 0

    def start(self, step: str, total: int | None = None) -> None:
        """End the present step with its line and remember the new one."""
        self.done()
        self._step, self._since, self._count = step, time.perf_counter(), 0

    def advance(self, n: int = 1) -> None:
        """Count the pieces; the line at the end tells how many there were."""
        self._count += n

    def done(self) -> None:
        """Write the line of the present step."""
        if not self._step:
            return
        pieces = f", {self._count} done" if self._count else ""
        print(f"{self._step}: {time.perf_counter() - self._since:.1f} s{pieces}", file=self._stream, flush=True)
        self._step = ""

    def say(self, text: str) -> None:
        """A line of its own, beside the step that goes on."""
        self.tell(f"warning: {text}")

    def tell(self, text: str) -> None:
        """The same of what is no warning."""
        print(text, file=self._stream, flush=True)


class BarProgress:
    """A tqdm bar per step, for a terminal."""

    def __init__(self, stream: TextIO | None = None) -> None:
        self._stream = stream if stream is not None else sys.stderr
        self._bar: Any = None

    def start(self, step: str, total: int | None = None) -> None:
        """Close the present bar and open one for `step`."""
        from tqdm import tqdm

        self.done()
        known = "{desc:<34} {bar:24} {n_fmt}/{total_fmt}  {elapsed}"
        self._bar = tqdm(
            total=total, desc=step, file=self._stream, bar_format=known if total else "{desc:<34} {elapsed}"
        )

    def advance(self, n: int = 1) -> None:
        """Move the bar."""
        if self._bar is not None:
            self._bar.update(n)

    def done(self) -> None:
        """Close the bar and leave it where it stands."""
        if self._bar is not None:
            self._bar.close()
            self._bar = None

    def say(self, text: str) -> None:
        """A line of its own, above the bar."""
        self.tell(f"warning: {text}")

    def tell(self, text: str) -> None:
        """The same of what is no warning."""
        from tqdm import tqdm

        tqdm.write(text, file=self._stream)


def progress_for(stream: TextIO | None = None, *, quiet: bool = False) -> Progress:
    """The progress that fits `stream` (stderr by default): a bar on a terminal, lines elsewhere, none if `quiet`."""
    stream = stream if stream is not None else sys.stderr
    if quiet:
        return SilentProgress()
    return BarProgress(stream) if stream.isatty() else LineProgress(stream)
