"""`femend population`: mean and scatter of the parameters over nominally equal structures."""

from __future__ import annotations

from pathlib import Path

import click

from femend.cli.diagnose import study_file
from femend.cli.shown import run_shown

__all__ = ["population"]


@click.command()
@click.argument("study", type=click.Path(path_type=Path))
@click.option("--out", "-o", type=click.Path(path_type=Path), required=True, help="Folder for the results.")
@click.option("--quiet", "-q", is_flag=True, help="Say nothing but errors.")
def population(study: Path, out: Path, quiet: bool) -> None:
    """Mean and scatter of the parameters of STUDY over nominally equal structures.

    STUDY is a study.toml, or a folder that holds one, whose tables [[updating.structure]] say which recordings are of
    which structure, three or more. Each structure has its own values, normal about the mean; mean and scatter are those
    under which the recordings of all are likeliest. Written are population.json, population.html, model.mean.bdf with
    the mean values where they stood, model.diff, and tables as CSV.
    """
    from femend.bench import population as run  # imported here: the other commands need none of it

    run_shown(lambda progress: run(study_file(study), out, progress), out / "population.html", quiet)
