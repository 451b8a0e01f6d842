"""`femend demo`: the bundled case, from its study to the check on recordings the diagnosis never saw."""

from __future__ import annotations

from pathlib import Path

import click

from femend.cli.diagnose import run_study
from femend.cli.summary import read_result, summary
from femend.report.numbers import ratio
from femend.report.text_table import table

__all__ = ["demo"]


@click.command()
@click.option(
    "--out",
    "-o",
    type=click.Path(path_type=Path),
    default=Path("femend-demo"),
    show_default=True,
    help="Folder for the results.",
)
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Seed of everything random.")
@click.option("--quiet", "-q", is_flag=True, help="Show no progress.")
def demo(out: Path, seed: int, quiet: bool) -> None:
    """Diagnose the bundled case: a structure simulated by another program, with something its model leaves out."""
    from femend.demo import STUDY, concealed, held_out_errors

    click.echo(f"Diagnosing the bundled case: {STUDY}")
    run_study(STUDY, out, seed, quiet)
    click.echo("")
    click.echo(summary(read_result(out)))
    truth = concealed()
    if truth is not None:
        click.echo(f"\nconcealed {truth}")
    scores = held_out_errors(out)
    if scores:
        rows = [[s.recording, ratio(s.nominal), ratio(s.parameters), ratio(s.final)] for s in scores]
        click.echo("\nPrediction error (NRMSE) on recordings that were held out from the study:")
        click.echo(table(["recording", "as given", "parameters updated", "final model"], rows, "lrrr"))
    click.echo(f"\nreport    {out / 'report.html'}")
