"""What the checks of a study's tables raise their errors with."""

from __future__ import annotations

from pathlib import Path
from typing import Protocol

from femend.errors import StudyError

__all__ = ["Check", "FileCheck"]


class Check(Protocol):
    """What makes a message that names the study file and the key."""

    def fail(self, key: str, fact: str) -> StudyError:
        """The error to be raised."""

    def one_of(self, key: str, value: str, allowed: tuple[str, ...]) -> None:
        """Raises it for a value that is not among those `allowed`."""


class FileCheck(Check, Protocol):
    """What looks for files beside the study file, `file`, too."""

    file: Path

    def existing(self, key: str, text: str) -> Path:
        """The whole path of a file; raises the error where there is none."""

    def unique(self, table: str, names: list[str]) -> None:
        """Raises the error for a name that stands twice or is empty."""
