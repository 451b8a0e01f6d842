"""What the checks of a study's tables raise their errors with."""

from __future__ import annotations

from typing import Protocol

from femend.errors import StudyError

__all__ = ["Check"]


class Check(Protocol):
    """What makes a message that names the study file and the key."""

    def fail(self, key: str, fact: str) -> StudyError:
        """The error to be raised."""

    def one_of(self, key: str, value: str, allowed: tuple[str, ...]) -> None:
        """Raises it for a value that is not among those `allowed`."""
