"""`femend update`: the parameters of a study updated on its modes and FRFs."""

from __future__ import annotations

from pathlib import Path

import click

from femend.cli.diagnose import study_file
from femend.cli.shown import run_shown

__all__ = ["update"]


@click.command()
@click.argument("study", type=click.Path(path_type=Path))
@click.option("--out", "-o", type=click.Path(path_type=Path), required=True, help="Folder for the results.")
@click.option("--history", type=click.Path(path_type=Path), help="File that keeps every step; a stopped run goes on.")
@click.option("--quiet", "-q", is_flag=True, help="Say nothing but errors.")
def update(study: Path, out: Path, history: Path | None, quiet: bool) -> None:
    """Update the parameters of STUDY on measured modes, and FRFs where asked for.

    STUDY is a study.toml, or a folder that holds one. Frequencies and shapes of the recordings with role fit are met
    within the priors of the parameters; its table [updating] chooses responses and weights, more starts than the deck
    as it stands, draws from the posterior, and positions and fields that may change too; its table [solver] names a
    program of your own in the place of the deck. Recordings with role validate only show
    whether it helped. Written are updating.json, updating.html, model.updated.bdf with the changed
    values where they stood, model.diff, and tables as CSV. It adds nothing to the model: what is missing in it,
    `femend diagnose` finds. Interrupted (Ctrl-C) while it follows other starts or draws, it writes what was found
    before; --history keeps the steps of the search itself.
    """
    from femend.bench import update as run  # imported here: the other commands need none of it

    run_shown(lambda progress: run(study_file(study), out, progress, history), out / "updating.html", quiet)
