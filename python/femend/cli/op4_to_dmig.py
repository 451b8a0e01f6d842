"""`femend op4-to-dmig`: a superelement's reduced matrices into cards that a deck includes."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click
import numpy as np

from femend.report.numbers import significant
from femend.report.text_table import table

if TYPE_CHECKING:
    from femend.io.superelement import Superelement

__all__ = ["op4_to_dmig"]

# Nastran's reductions of free parts leave less than this of the energy that the diagonal alone would store.
RIGID = 1e-4


@click.command("op4-to-dmig")
@click.argument("file", type=click.Path(path_type=Path))
@click.option("--dofs", "dof_map", type=click.Path(path_type=Path), required=True, help="DOF of each row: see below.")
@click.option("--out", "-o", type=click.Path(path_type=Path), required=True, help="Bulk data to be written.")
@click.option("--name", help="Name of the superelement, up to 6 characters; by default from the file's.")
@click.option("--stiffness", metavar="NAME", help="Stiffness matrix in FILE; by default KXX, KAA ...")
@click.option("--mass", metavar="NAME", help="Mass matrix; by default MXX, MAA ...")
@click.option("--damping", metavar="NAME", help="Viscous damping matrix; by default BXX, BAA ...")
@click.option("--structural", metavar="NAME", help="Structural damping matrix; by default K4XX, K4AA ...")
@click.option(
    "--deck", type=click.Path(path_type=Path), help="Deck that will include it: nodes, energy and mass checked."
)
@click.option("--no-spoints", is_flag=True, help="Write no SPOINT: the deck has them.")
def op4_to_dmig(
    file: Path,
    dof_map: Path,
    out: Path,
    name: str | None,
    stiffness: str | None,
    mass: str | None,
    damping: str | None,
    structural: str | None,
    deck: Path | None,
    no_spoints: bool,
) -> None:
    """Write the reduced matrices of a superelement in the OUTPUT4 file FILE as DMIG cards.

    The DOFs are those of the .pch that EXTSEOUT punches (EXTRN), of ASET, BSET and QSET cards, or of a plain list with
    a node and its components in each line ("3 123456"), 0 for modal coordinates, which become scalar points.
    """
    from femend.io.superelement import case_control, read_dof_map, read_superelement, write_superelement

    superelement = read_superelement(
        file, read_dof_map(dof_map), stiffness=stiffness, mass=mass, damping=damping, structural=structural
    )
    name = name or _name(file)
    write_superelement(out, superelement, name, scalar_points=not no_spoints)
    n_scalar = len(superelement.scalar_points)
    click.echo(
        f"{out}: {superelement.source}; {len(superelement.dofs) - n_scalar} DOFs of {len(superelement.nodes)} nodes, "
        f"{n_scalar} scalar points"
    )
    if deck is not None:
        click.echo(_check(superelement, deck))
    click.echo("\nPut into the deck's case control (names of several superelements behind each other, by commas)")
    for line in case_control(superelement, name):
        click.echo(f"  {line}")
    click.echo(f"and into its bulk data\n  INCLUDE '{out.name}'")


def _name(file: Path) -> str:
    """The file's name as far as it can be a name."""
    return "".join(c for c in file.stem.upper() if c.isascii() and c.isalnum())[:6] or "SE"


def _check(superelement: Superelement, deck: Path) -> str:
    from femend import _core
    from femend.io.deck import read_deck

    model = _core.FeModel(read_deck(deck), spc=0)
    found = superelement.rigid_check(model.node_ids, model.xyz, model.frames)
    rows = [["strain energy / diagonal's", *(f"{e:.1e}" if e == e else "–" for e in found.energy)]]
    if superelement.M is not None:
        rows.append(["mass", *(significant(float(m)) for m in found.mass), "", "", ""])
    text = "\n" + table(["moved as one body", "X", "Y", "Z", "RX", "RY", "RZ"], rows, "lrrrrrr")
    if np.any(found.energy > RIGID):
        text += (
            "\nwarning: it resists rigid motion: either it has supports inside, or the map does not name its DOFs in "
            "the order of the matrices"
        )
    return text
