"""`femend pretest`: a test planned on the model of a study."""

from __future__ import annotations

from pathlib import Path

import click

from femend.cli.diagnose import study_file
from femend.cli.shown import run_shown

__all__ = ["pretest"]


@click.command()
@click.argument("study", type=click.Path(path_type=Path))
@click.option("--out", "-o", type=click.Path(path_type=Path), required=True, help="Folder for the results.")
@click.option("--quiet", "-q", is_flag=True, help="Say nothing but errors.")
def pretest(study: Path, out: Path, quiet: bool) -> None:
    """Plan a test on the model of STUDY: target modes, sensors, exciters, and what it would tell.

    STUDY is a study.toml, or a folder that holds one; recordings are not needed. Its table [pretest] says the band,
    how many sensors, where they may go, and which are placed already. Written are pretest.json, pretest.html and CSV
    tables of sensors, exciters and modes. The plan is rehearsed on the model: FRFs with noise, identified and updated
    on.
    """
    from femend.bench import pretest as run  # imported here: the other commands need none of it

    run_shown(lambda progress: run(study_file(study), out, progress), out / "pretest.html", quiet)
