"""The command line: `femend diagnose`, `femend demo`, `femend inspect`, `femend modes`."""

from __future__ import annotations

from femend.cli.group import main

__all__ = ["main"]
