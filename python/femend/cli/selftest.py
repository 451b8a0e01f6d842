"""`femend selftest`: what would be found, named, missed and falsely claimed with this test."""

from __future__ import annotations

import sys
from pathlib import Path

import click

from femend.app.progress import progress_for
from femend.cli.diagnose import study_file

__all__ = ["selftest"]


@click.command()
@click.argument("study", type=click.Path(path_type=Path))
@click.option("--out", "-o", type=click.Path(path_type=Path), default=Path("femend-selftest"), show_default=True,
              help="Folder for the cases and the report; a self-test that is there is continued.")  # fmt: skip
@click.option("--cases", "-n", type=click.IntRange(min=1), default=24, show_default=True, help="How many cases.")
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Seed of everything random.")
@click.option("--jobs", "-j", type=click.IntRange(min=1), default=1, show_default=True, help="Processes side by side.")
@click.option("--quiet", "-q", is_flag=True, help="Show no progress.")
def selftest(study: Path, out: Path, cases: int, seed: int, jobs: int, quiet: bool) -> None:
    """Try the diagnosis on concealed cases made with the model, sensors and forces of STUDY.

    STUDY is a study.toml, or a folder that holds one. Each case is a truth the deck does not know: other damping and
    parameters, members and masses a little off, and in two of three cases something left out. Printed is what would be
    found, named, missed and falsely claimed. Written are selftest.json, selftest.html and the cases. Interrupted
    (Ctrl-C), what is finished is reported, and the same command goes on from there.
    """
    from femend.selftest import as_text, run_selftest  # imported here: the other commands need none of it

    found = run_selftest(study_file(study), out, cases=cases, seed=seed, jobs=jobs, progress=progress_for(quiet=quiet))
    click.echo(as_text(found))
    click.echo(f"\nreport    {out / 'selftest.html'}")
    if found.interrupted:
        click.echo("interrupted; the same command continues", err=True)
        sys.exit(130)
