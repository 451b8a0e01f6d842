"""The command line: `femend diagnose`, `femend demo`, `femend inspect`, `femend modes`, `femend selftest`."""

from __future__ import annotations

from femend.cli.group import main

__all__ = ["main"]
