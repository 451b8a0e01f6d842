"""The steps of a run: told while it works, and timed for run.json."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager

from femend.progress import Progress, tell
from femend.report.runinfo import RunInfo

__all__ = ["Steps"]


class Steps:
    """Times the steps and tells the progress; `now` is the step, or its part, that was begun last."""

    def __init__(self, info: RunInfo, progress: Progress) -> None:
        self._info, self._progress = info, progress
        self.now = ""

    @contextmanager
    def step(self, name: str) -> Iterator[None]:
        """The step `name`, timed and told; of the diagnosis its parts are told instead."""
        self.now = name
        if name != "diagnose":
            self._progress.start(name)
        with self._info.step(name):
            yield

    def tell(self, text: str) -> None:
        """Tells a sentence that is no warning."""
        tell(self._progress, text)

    @contextmanager
    def parts(self, name: str) -> Iterator[Progress]:
        """Progress that also times what it is told to start, as parts of the step `name`."""
        told = _Parts(self, self._info, self._progress, name)
        try:
            yield told
        finally:
            told.end()


class _Parts:
    """Progress that passes on what it is told, and times each part until the next one starts."""

    def __init__(self, steps: Steps, info: RunInfo, progress: Progress, whole: str) -> None:
        self._steps, self._info, self._progress, self._whole = steps, info, progress, whole
        self._open = ExitStack()

    def start(self, step: str, total: int | None = None) -> None:
        self.end()
        self._steps.now = step
        self._open.enter_context(self._info.step(f"{self._whole}: {step}"))
        self._progress.start(step, total)

    def advance(self, n: int = 1) -> None:
        self._progress.advance(n)

    def done(self) -> None:
        self.end()
        self._progress.done()

    def end(self) -> None:
        """Ends the part that runs."""
        self._open.close()
