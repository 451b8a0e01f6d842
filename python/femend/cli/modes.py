"""`femend modes`: natural frequencies of a deck, with the mass that moves with each mode."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
import numpy as np
from numpy.typing import NDArray

from femend.report.numbers import pretty_unit, significant
from femend.report.text_table import table
from femend.units import SYSTEMS, unit_system

if TYPE_CHECKING:
    from scipy.sparse import csc_array

    from femend import _core
    from femend.model.model import Model

__all__ = ["modes"]


@click.command()
@click.argument("deck", type=click.Path(path_type=Path))
@click.option("--n", "n_modes", type=click.IntRange(min=1), help="Number of modes; 10 without --fmax.")
@click.option("--fmax", type=click.FloatRange(min=0, min_open=True), help="All modes up to this frequency, Hz.")
@click.option("--units", type=click.Choice(list(SYSTEMS)), default="SI", show_default=True, help="Units of the deck.")
@click.option("--spc", type=click.IntRange(min=0), help="SPC set; the deck's case control selects it otherwise.")
@click.option("--rpm", metavar="LIST", help="Speeds of the rotor in 1/min, as 0,1500,3000: modes followed over them.")
def modes(deck: Path, n_modes: int | None, fmax: float | None, units: str, spc: int | None, rpm: str | None) -> None:
    """Compute the natural frequencies of the Nastran deck DECK.

    Effective mass is the share of the structure's mass that moves with a mode when the base moves along X, Y or Z.
    With --rpm the deck's rotors (ROTORG) turn: frequencies over the speed, whirl, damping and critical speeds.
    """
    from scipy.sparse import csc_array

    from femend import _core
    from femend.analysis.effective_mass import base_directions, effective_mass
    from femend.io.deck import read_deck
    from femend.model.model import Model

    deck_read = read_deck(deck)
    model = _core.FeModel(deck_read, spc=spc)
    if rpm is not None:
        _turning(Model(deck_read, model, (), units), rpm, n_modes, fmax, spc)
        return
    indptr, indices, k, m, _, _ = model.assemble()
    if n_modes is None and fmax is None:
        n_modes = 10
    if n_modes is not None:
        n_modes = min(n_modes, model.n_a)
    freq, phi, info = _solved(Model(deck_read, model, (), units), (indptr, indices, k, m), n_modes, fmax)
    R = base_directions(model.dof_nodes, model.dof_components, model.node_ids, model.frames)
    M = csc_array((m, indices, indptr), shape=(model.n_a, model.n_a))
    total = model.total_mass()
    share = effective_mass(np.asarray(M @ phi), R) / total * 100.0 if total > 0 else None
    mass = f"{significant(total)} {pretty_unit(unit_system(units).text('mass'))}"
    n_scalar = len(model.scalar_points)
    nodes = f"{len(model.node_ids) - n_scalar} nodes" + (f", {n_scalar} scalar points" if n_scalar else "")
    click.echo(f"{deck}: {nodes}, {model.n_a} free DOFs, mass {mass}")
    for told in _doubts(deck_read, units, spc):
        click.echo(f"warning   {told}")
    if model.auto_constrained:
        names = ", ".join(model.auto_constrained[:8]) + (", …" if len(model.auto_constrained) > 8 else "")
        click.echo(f"held because nothing resists them: {len(model.auto_constrained)} DOFs ({names})")
    K = csc_array((k, indices, indptr), shape=(model.n_a, model.n_a))
    told = _zero(Model(deck_read, model, (), units), K, freq, phi, info["n_rigid"], n_modes)
    if told:
        click.echo(told)
    if share is None:
        click.echo(f"effective masses are shares of the structure's mass, which is {significant(total)}: none are told")
    click.echo("\n" + _table(freq, share))


def _table(freq: NDArray[np.float64], share: NDArray[np.float64] | None) -> str:
    """Modes at `freq` (n,) with the `share` (n, 3) of the mass that moves, in percent, where it is one of any."""
    cells = [["–"] * 3] * (len(freq) + 1)
    if share is not None:
        cells = [[f"{s:.1f}" for s in row] for row in (*share, share.sum(axis=0))]
    rows = [
        [str(i), f"{f:.4f}" if f < 1e5 else f"{f:.6g}", *row]
        for i, (f, row) in enumerate(zip(freq, cells, strict=False), start=1)
    ]
    return table(["mode", "Hz", "X %", "Y %", "Z %"], [*rows, ["sum", "", *cells[-1]]], "rrrrr")


def _solved(
    model: Model, matrices: tuple[Any, Any, Any, Any], n_modes: int | None, f_max: float | None
) -> tuple[Any, Any, dict[str, Any]]:
    """Frequencies (n,), shapes (n_a, n) and what the solver says of them; fewer modes, which is told, where no more
    DOFs have a mass."""
    from femend import _core
    from femend.model.reduced.finite_modes import finite_modes
    from femend.model.reduced.unsolvable import told_of

    try:
        freq, phi, _, info = _core.modes(*matrices, n_modes=n_modes, f_max=f_max)
    except ValueError as error:
        fewer = finite_modes(error, n_modes)
        if fewer is None:
            raise told_of(error, model) from error
        freq, phi, _, info = _core.modes(*matrices, n_modes=fewer, f_max=f_max)
        click.echo(f"only {fewer} mode{'s' * (fewer > 1)}: no more DOFs have a mass")
    return freq, phi, info


def _zero(model: Model, K: csc_array, freq: Any, phi: Any, least: int, n_modes: int | None) -> str:
    """What is said of modes of 0 Hz, at `least` so many, among the `n_modes` asked for (None: all of a band), whose
    shapes are `phi` (n_a, n); empty where there are none."""
    from femend.model.free_body import FREE
    from femend.model.reduced.rigid_motion import count_zero, zero_modes

    phi = (model.transformation() @ phi)[np.repeat(~model.is_scalar, 6)]
    n = max(least, count_zero(model, K, freq, phi))
    if n == 0:
        return ""
    if n == n_modes and n < model.fe.n_a:
        which = "the only mode asked for is" if n == 1 else f"all {n} modes asked for are"
        return (
            f"{which} of 0 Hz (a free body has {FREE}): ask for more, as by --n {n + 10}, to see how many "
            "there are and what moves in them"
        )
    told = zero_modes(model, phi[:, :n]).text
    return f"warning   {told}" if told else f"{n} mode{'s' * (n > 1)} of a free body"


def _turning(model: Model, rpm: str, n_modes: int | None, f_max: float | None, spc: int | None) -> None:
    """The modes of a deck whose rotors turn."""
    from femend.cli.turning import speeds_of, turning_table
    from femend.model.terms.rotors import deck_rotors

    speeds = speeds_of(rpm)
    rotors = deck_rotors(model.deck)
    told = turning_table(model, rotors, speeds, n_modes, f_max)
    for warning in [*_doubts(model.deck, model.units, spc), *rotors.warnings]:
        click.echo(f"warning   {warning}")
    click.echo(told)


def _doubts(deck: _core.Deck, units: str, spc: int | None) -> list[str]:
    """What is doubtful about the deck in these units and with this SPC set."""
    from femend.model.cards.material_units import material_doubts
    from femend.model.cards.negative import negative_values
    from femend.model.cards.no_area import zero_areas
    from femend.model.cards.unheeded import unheeded
    from femend.model.cards.unselected import unselected_supports

    free = unselected_supports(deck) if spc is None else ()
    values = [*negative_values(deck), *zero_areas(deck)]
    return [*material_doubts(deck, units, "--units"), *free, *unheeded(deck, spc is None), *values]
