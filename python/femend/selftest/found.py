"""A self-test as far as it came."""

from __future__ import annotations

from dataclasses import dataclass

from femend.selftest.score import Outcome

__all__ = ["Selftest"]


@dataclass(frozen=True)
class Selftest:
    """A self-test as far as it came: the study's title, seed, cases asked for, outcomes in order, cases that could
    not be made or diagnosed with the reason, and whether it was interrupted."""

    title: str
    seed: int
    asked: int
    outcomes: tuple[Outcome, ...]
    failed: dict[int, str]
    interrupted: bool = False
