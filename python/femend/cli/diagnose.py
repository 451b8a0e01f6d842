"""`femend diagnose`: from a study file to a folder with the diagnosis."""

from __future__ import annotations

from pathlib import Path

import click

from femend.app.progress import progress_for
from femend.cli.summary import read_result, summary
from femend.errors import StudyError

__all__ = ["diagnose", "run_study"]


def run_study(
    study: Path, out: Path, seed: int, quiet: bool, laws: str | None = None, time_limit: float | None = None
) -> None:
    """Diagnose `study` into the folder `out`, with `seed`, `laws` (names with commas, None for the default ones) and a
    `time_limit` in seconds.

    Shows progress unless `quiet`.
    """
    from femend.study.run import diagnose as run  # imported here: the other commands need none of it

    progress = progress_for(quiet=quiet)
    try:
        run(study, out=out, progress=progress, seed=seed, laws=laws, time_limit=time_limit)
    finally:
        progress.done()


@click.command()
@click.argument("study", type=click.Path(path_type=Path))
@click.option("--out", "-o", type=click.Path(path_type=Path), required=True, help="Folder for the results.")
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Seed of everything random.")
@click.option(
    "--laws",
    metavar="NAME[,NAME]",
    help='Laws to try in place of the default ones; "default" and "all" stand for many. Each costs seconds.',
)
@click.option(
    "--time-limit",
    type=click.FloatRange(min=0, min_open=True),
    metavar="SECONDS",
    help="Stop after so many seconds, and write what is settled by then.",
)
@click.option("--quiet", "-q", is_flag=True, help="Say nothing but errors.")
def diagnose(study: Path, out: Path, seed: int, laws: str | None, time_limit: float | None, quiet: bool) -> None:
    """Update the model of STUDY, find what it leaves out, and write the diagnosis to a folder.

    STUDY is a study.toml, or a folder that holds one. Written are result.json, report.html, run.json,
    model.updated.bdf and predictions/, when the run comes to its end. Interrupted (Ctrl-C), or at its time limit, after
    the parameters were updated, it writes what is settled so far: the likeliest law among those judged, as located and
    not named, or the verdict undetermined. A second Ctrl-C ends it at once.
    """
    study = study_file(study)
    run_study(study, out, seed, quiet, laws, time_limit)
    if not quiet:
        click.echo(summary(read_result(out)))
        click.echo(f"\nreport    {out / 'report.html'}")


def study_file(study: Path) -> Path:
    """The study file named by `study`, a file or its folder; raises StudyError where there is none."""
    if study.is_dir():
        if not (study / "study.toml").is_file():
            raise StudyError(f"the folder {study} holds no study.toml; name the study file itself")
        return study / "study.toml"
    if not study.exists():
        raise StudyError(f"there is no study {study}; name a study.toml or the folder that holds it")
    return study
