"""What a long job tells while it works."""

from __future__ import annotations

from typing import Protocol

__all__ = ["Progress", "SilentProgress", "say", "tell"]


class Progress(Protocol):
    """What a job tells while it works. Library code takes ``progress=None`` and then says nothing."""

    def start(self, step: str, total: int | None = None) -> None:
        """A new step begins, with `total` pieces of work if that is known. Ends the step before it."""

    def advance(self, n: int = 1) -> None:
        """`n` more pieces of the present step are done."""

    def done(self) -> None:
        """The last step has ended."""


class SilentProgress:
    """Says nothing; lets library code call without asking."""

    def start(self, step: str, total: int | None = None) -> None:
        """Nothing."""

    def advance(self, n: int = 1) -> None:
        """Nothing."""

    def done(self) -> None:
        """Nothing."""


def say(progress: Progress, text: str) -> None:
    """Tells a sentence while the job goes on, where the `progress` has a way to: a mistake that is seen at once should
    not be read of minutes later. One without a method `say` says nothing."""
    shown = getattr(progress, "say", None)
    if shown is not None:
        shown(text)


def tell(progress: Progress, text: str) -> None:
    """Tells what is no warning while the job goes on, such as how long it will take, where the `progress` has a method
    `tell`; one without says nothing."""
    shown = getattr(progress, "tell", None)
    if shown is not None:
        shown(text)
