"""An end for a diagnosis that takes too long: it stops as if by hand, and what is settled is written."""

from __future__ import annotations

import _thread
import math
import signal
from threading import Lock, Timer, current_thread, main_thread
from time import monotonic
from types import TracebackType
from typing import Any

from femend.errors import StudyError

__all__ = ["TimeLimit"]


class TimeLimit:
    """So many `seconds` from now on, None for no end. Within a `with` block the main thread is interrupted
    (KeyboardInterrupt) when they are over, at once where they were over before; `reached` says whether it was. It is
    interrupted as by SIGTERM, which a job in the background does not ignore as it may SIGINT.

    Raises StudyError for seconds that are no positive number, and for a limit in another thread than the main one,
    which alone can be interrupted.
    """

    def __init__(self, seconds: float | None) -> None:
        if seconds is not None and not (math.isfinite(seconds) and seconds > 0):
            raise StudyError(f"a time limit of {seconds:g} s is none; give a positive number of seconds")
        if seconds is not None and current_thread() is not main_thread():
            raise StudyError(
                "a time limit interrupts the main thread, and this diagnosis runs in another one; run it in the main "
                "thread or in a process of its own, or leave the limit out"
            )
        self.seconds = seconds
        self.reached = False
        self._end = math.inf if seconds is None else monotonic() + seconds
        self._lock = Lock()
        self._timer: Timer | None = None
        self._handler: Any = None
        self._open = False

    @property
    def told(self) -> str:
        """That it was reached."""
        return f"the time limit of {self.seconds:g} s was reached"

    def __enter__(self) -> TimeLimit:
        if self.seconds is not None:
            before = signal.signal(signal.SIGTERM, signal.default_int_handler)
            self._handler = signal.SIG_DFL if before is None else before
            self._open = True
            self._timer = Timer(max(0.0, self._end - monotonic()), self._over)
            self._timer.daemon = True
            self._timer.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._timer is None:
            return
        try:  # an interruption that was on its way may be told at any of these steps, once
            self._timer.cancel()
            with self._lock:
                self._open = False
            signal.signal(signal.SIGTERM, self._handler)
        finally:
            self._open = False
            signal.signal(signal.SIGTERM, self._handler)

    def _over(self) -> None:
        # not once the block is left: what follows must not be interrupted
        with self._lock:
            if self._open:
                self.reached = True
                _thread.interrupt_main(signal.SIGTERM)
