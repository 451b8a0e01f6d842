"""A command of the classic chain: it runs on a study with its progress, then shows its result and where the page is."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import click

from femend.app.progress import progress_for
from femend.progress import Progress

__all__ = ["run_shown"]


def run_shown(run: Callable[[Progress], object], page: Path, quiet: bool) -> None:
    """Runs `run` with the progress that fits, and unless `quiet` shows what it returns and names the `page`."""
    progress = progress_for(quiet=quiet)
    try:
        found = run(progress)
    finally:
        progress.done()
    if not quiet:
        click.echo(found)
        click.echo(f"\nreport    {page}")
