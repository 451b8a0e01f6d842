"""Spectra of a universal file."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from femend.data import Channel, Spectra
from femend.io.uff.abscissa import axis_key, frequencies
from femend.io.uff.labels import Context, label_of, quantity_of_axis, side_of
from femend.io.uff.reader import UniversalFile
from femend.io.uff.set58 import Function58
from femend.units import SYSTEMS

__all__ = ["spectra_blocks"]

_SPECTRA = {2: "autospectrum", 3: "cross-spectrum", 6: "coherence", 9: "psd", 10: "esd", 12: "spectrum"}


def spectra_blocks(file: UniversalFile, functions: Sequence[Function58], name: str) -> tuple[list[Spectra], list[str]]:
    """Spectra (types 2, 3, 6, 9, 10, 12), one Spectra per kind and frequency axis, in the file's units, with notes.

    Raises RecordingError where an abscissa is no frequency.
    """
    context = Context(file, name, SYSTEMS["SI"])
    groups: dict[tuple[object, ...], list[Function58]] = {}
    for function in functions:
        kind = _SPECTRA.get(function.header.func_type)
        if kind is not None:
            groups.setdefault((kind, axis_key(context, function)), []).append(function)
    blocks = []
    for key, members in groups.items():
        channels, references = [], []
        for f in members:
            (dof, text), (ref, ref_text) = side_of(f, "rsp"), side_of(f, "ref")
            axis = f.header.ordinate
            channels.append(Channel(dof, quantity_of_axis(axis, dof, text), axis.unit, text, label_of(f)))
            references.append(None if ref is None else Channel(ref, "unknown", f.header.denominator.unit, ref_text))
        values = np.array([f.y for f in members])
        blocks.append(
            Spectra(name, frequencies(context, members[0]), values, tuple(channels), str(key[0]), tuple(references))
        )
    return blocks, context.notes
