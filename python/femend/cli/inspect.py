"""`femend inspect`: what is in a deck or a file of recordings, before a study is written around it."""

from __future__ import annotations

from pathlib import Path

import click
import numpy as np

from femend.data import FRF, Geometry, IdentifiedModes, Recording, Spectra, TimeData
from femend.errors import DeckError, FormatError
from femend.numerals import plain
from femend.report.numbers import significant
from femend.report.text_table import table

__all__ = ["inspect"]

_DECKS = (".bdf", ".dat", ".nas", ".blk")


@click.command()
@click.argument("file", type=click.Path(path_type=Path))
def inspect(file: Path) -> None:
    """Say what is in FILE.

    Of a Nastran deck (.bdf .dat .nas): cards, size, parameters. Of recordings (.uff .unv): channels, directions, units,
    rates and levels, or of mode shapes: frequencies and damping. Of tables (.csv .txt .mat .h5 .wav ...): columns with
    the numbers and names by which a study maps them, rate and levels. Of OUTPUT4 files (.op4): matrices with their
    sizes and types.
    """
    from femend.cli.inspect_table import table_text
    from femend.io import read_modes, read_recordings, read_uff
    from femend.io.tables import EXTENSIONS

    if file.suffix.lower() in _DECKS:
        click.echo(_deck_or_table_text(file))
        return
    if file.suffix.lower() == ".op4":
        click.echo(_op4_text(file))
        return
    if file.suffix.lower() in EXTENSIONS and file.is_file():
        click.echo(table_text(file))
        return
    if file.suffix.lower() == ".toml":
        raise FormatError(f"{file} is a study, not a deck or a recording; femend diagnose reads it", file=str(file))
    modes = read_modes(file) if file.is_file() else None
    if modes is not None:
        click.echo(_modes_text(file, *modes))
        if not read_uff(file).functions:
            return
        click.echo("")
    test = read_recordings(file, role="predict")
    for recording in test:
        click.echo(_recording_text(recording))
        for note in recording.notes:
            click.echo(f"note: {note}")


def _deck_or_table_text(file: Path) -> str:
    """Decks and tables are both called .dat: what cannot be read as the one may be the other."""
    from femend.cli.inspect_table import table_text
    from femend.io.tables import EXTENSIONS

    try:
        return _deck_text(file)
    except DeckError:
        if file.suffix.lower() not in EXTENSIONS or not file.is_file():
            raise
        try:
            return table_text(file)
        except FormatError:
            pass
        raise


def _deck_text(file: Path) -> str:
    from femend.io.deck import read_deck

    deck = read_deck(file)
    xyz = deck.xyz
    n_scalar = len(deck.scalar_points)
    points = f", {n_scalar} scalar points" if n_scalar else ""
    lines = [f"{file}: Nastran deck, {len(deck.node_ids)} nodes{points}, {len(deck.elements())} elements"]
    if len(xyz):
        sides = " by ".join(f"{side:.6g}" for side in np.ptp(xyz, axis=0))
        lines.append(f"{sides} along X, Y, Z in units of the deck")
    if len(deck.files) > 1:
        lines.append(f"files: {', '.join(deck.files)}")
    lines += ["", table(["card", "count"], [[name, str(n)] for name, n in sorted(deck.card_counts().items())], "lr")]
    settings = [f"{name} {value}" for name, value in sorted(deck.params().items())]
    if settings:
        lines += ["", f"PARAM: {', '.join(settings)}"]
    ignored = [f"{name} ({n})" for name, n in sorted(deck.ignored().items())]
    if ignored:
        lines.append(f"without influence on modes, left out: {', '.join(ignored)}")
    return "\n".join(lines)


def _modes_text(file: Path, modes: IdentifiedModes, geometry: Geometry | None, notes: tuple[str, ...]) -> str:
    """Mode shapes (data sets 55): frequencies, damping, DOFs."""
    nodes = len({d.node for d in modes.dofs})
    places = "" if geometry is None else f", coordinates of {len(geometry.ids)} nodes"
    head = f"{file}: {modes.n_modes} mode shapes (data sets 55) at {len(modes.dofs)} DOFs of {nodes} nodes{places}"
    rows = [[str(i), f"{f:.5g}", plain(100 * z, 3)] for i, (f, z) in enumerate(zip(modes.freq, modes.zeta), start=1)]
    told = "".join(f"\nnote: {note}" for note in notes)
    return f"{head}\n\n{table(['mode', 'Hz', 'damping %'], rows, 'rrr')}{told}"


def _op4_text(file: Path) -> str:
    from femend.io.op4 import read_op4
    from femend.io.op4.matrix import FORMS, TYPES

    matrices = read_op4(file)
    rows = [
        [m.name, str(m.shape[0]), str(m.shape[1]), FORMS.get(m.form, str(m.form)), TYPES[m.type], str(m.data.nnz)]
        for m in matrices
    ]
    head = f"{file}: Nastran OUTPUT4, {len(matrices)} matrices"
    return f"{head}\n\n{table(['matrix', 'rows', 'columns', 'form', 'type', 'terms'], rows, 'lrrllr')}"


def _recording_text(recording: Recording) -> str:
    data = recording.data
    if isinstance(data, TimeData):
        return _time_text(data)
    if isinstance(data, FRF):
        return _frf_text(data)
    return _spectra_text(data)


def _time_text(data: TimeData) -> str:
    head = (
        f"{data.name}: time records, {len(data.channels)} channels, {data.n_samples} samples at {data.rate:.6g} Hz, "
        f"{data.duration:.6g} s"
    )
    rows = []
    for channel, y in zip(data.channels, data.values, strict=True):
        dof = "" if channel.dof is None else str(channel.dof)
        level = [significant(float(np.sqrt(np.mean(y**2)))), significant(float(np.abs(y).max()))]
        rows.append([dof, channel.quantity, channel.unit, *level, channel.name or channel.label])
    return f"{head}\n\n{table(['DOF', 'quantity', 'unit', 'rms', 'peak', 'name'], rows, 'lllrrl')}"


def _frf_text(data: FRF) -> str:
    head = (
        f"{data.name}: FRFs ({data.kind}, {data.unit}), {len(data.outputs)} outputs by {len(data.inputs)} inputs, "
        f"{data.n_freq} lines from {data.freq[0]:.6g} to {data.freq[-1]:.6g} Hz"
    )
    rows = []
    for o, output in enumerate(data.outputs):
        for i, source in enumerate(data.inputs):
            size = np.abs(data.H[:, o, i])
            at = int(np.argmax(size))
            rows.append([output.text, source.text, significant(float(size[at])), f"{data.freq[at]:.6g}"])
    return f"{head}\n\n{table(['output', 'input', 'peak', 'at Hz'], rows, 'llrr')}"


def _spectra_text(data: Spectra) -> str:
    head = (
        f"{data.name}: {data.kind}, {len(data.channels)} channels, {len(data.freq)} lines from {data.freq[0]:.6g} "
        f"to {data.freq[-1]:.6g} Hz"
    )
    rows = []
    for channel, reference, y in zip(data.channels, data.references, data.values, strict=True):
        size = np.abs(y)
        at = int(np.argmax(size))
        other = "" if reference is None else reference.text
        rows.append([channel.text, other, channel.unit, significant(float(size[at])), f"{data.freq[at]:.6g}"])
    return f"{head}\n\n{table(['channel', 'against', 'unit', 'peak', 'at Hz'], rows, 'lllrr')}"
