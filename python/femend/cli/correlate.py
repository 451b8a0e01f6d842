"""`femend correlate`: the deck of a study against its test."""

from __future__ import annotations

from pathlib import Path

import click

from femend.cli.diagnose import study_file
from femend.cli.shown import run_shown

__all__ = ["correlate"]


@click.command()
@click.argument("study", type=click.Path(path_type=Path))
@click.option("--out", "-o", type=click.Path(path_type=Path), required=True, help="Folder for the results.")
@click.option("--quiet", "-q", is_flag=True, help="Say nothing but errors.")
def correlate(study: Path, out: Path, quiet: bool) -> None:
    """Compare the deck of STUDY, as it stands, with its test.

    STUDY is a study.toml, or a folder that holds one. Modes are identified from the FRFs or time records of its
    recordings, or read from universal files that hold them (data sets 55); operating shapes are taken from a rotor's
    runs. Sensors are placed on the model, modes and peaks of operating shapes are paired with the model's modes.
    Written are correlation.json, correlation.html and tables as CSV: frequencies, damping, MAC, CoMAC and eCoMAC by
    sensor, orthogonality over reduced masses, FRAC, CSAC and CSF of FRFs, DAC, CSAC and CSF of operating shapes with
    the response to unbalance. The table [correlation] of the study sets band and least MAC.
    """
    from femend.bench import correlate as run  # imported here: the other commands need none of it

    run_shown(lambda progress: run(study_file(study), out, progress), out / "correlation.html", quiet)
