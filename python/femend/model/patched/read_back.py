"""An updated deck read again and compared with the updated model, so that no wrong value passes unseen."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from numpy.typing import NDArray

from femend.errors import FemendError
from femend.io.deck import read_deck
from femend.io.updated_files import updated_files
from femend.model.cards.real_field import real
from femend.model.model import Model, model_of
from femend.model.patched.deck_fields import parameter_fields
from femend.model.patched.matrix_difference import Difference, Matrices, difference
from femend.numerals import plain

__all__ = ["deck_faults", "unreadable"]

FloatArray = NDArray[np.float64]

# share by which a number may change when it is written: eight columns hold three digits at least (-1.23-10)
ROUNDING = 5e-3
# share of the largest coordinate by which one may change when it is written: -12345.7
COORDINATE = 1e-4
# share by which values differ that were worked out from the same numbers in another order
EXACT = 1e-8
# by how much more a value of K may change than the number it is made of: plies enter with the cube of their thickness
STEEPEST = 10.0
DO_NOT_USE = "do not use the deck, and report it with this deck"


def deck_faults(model: Model, files: Mapping[Path, bytes], factors: Mapping[str, float]) -> tuple[str, ...]:
    """Sentences on where the deck of `model` with its changed `files`, read again, is not the model with its parameters
    times `factors` and its morphs at `factors`, by name (1 and 0 where not given); none where it is.

    K, M, C and H are compared value by value with what the numbers make as they are written, and these with what they
    should be. Parameters whose value no fields hold are taken as the deck has them.
    """
    if not files:
        return ()
    try:
        return _compared(model, _read(model, files), factors)
    except FemendError as error:
        return (_unreadable(error),)


def unreadable(model: Model, files: Mapping[Path, bytes]) -> tuple[str, ...]:
    """A sentence on why the deck of `model` with its changed `files` cannot be read again; none where it can."""
    try:
        _read(model, files)
    except FemendError as error:
        return (_unreadable(error),)
    return ()


def _unreadable(error: FemendError) -> str:
    return f"the updated deck cannot be read again: {error}; {DO_NOT_USE}"


def _read(model: Model, files: Mapping[Path, bytes]) -> Model:
    with TemporaryDirectory() as folder:
        for name, content in updated_files(Path(model.deck.path), files, anywhere=True).items():
            (Path(folder) / name).write_bytes(content)
        deck = read_deck(Path(folder) / "model.updated.bdf")
    return model_of(deck, units=model.units, spc=model.spc, added_mass=model.added_mass)


def _compared(model: Model, again: Model, factors: Mapping[str, float]) -> tuple[str, ...]:
    same = np.array_equal(again.fe.dof_nodes, model.fe.dof_nodes)
    if not same or not np.array_equal(again.fe.dof_components, model.fe.dof_components):
        return (
            f"the updated deck, read again, has {again.fe.n_a} free DOFs, not the {model.fe.n_a} of the model; "
            f"{DO_NOT_USE}",
        )
    own = _as_written(model, again, factors)
    faults = [*own.faults, *_misplaced(model, again, factors)]
    nodes = model.fields.nodes.tolist() if model.morphs else []
    moved = again.xyz[[again.index(n) for n in nodes]] if nodes else None
    wanted = Matrices.of(model, own.factors, None if moved is None else (nodes, moved))
    found = difference(wanted, Matrices.of(again), EXACT + STEEPEST * own.spread)
    return (*faults, *(_told(model, one) for one in found.parts(model, own.factors)))


@dataclass(frozen=True, eq=False)
class _Written:
    """Factors (n_par,) that the numbers make as they are written, by how much those of one parameter are apart, and
    `faults`: numbers that are others than by rounding."""

    factors: FloatArray
    spread: float
    faults: list[str]


def _as_written(model: Model, again: Model, factors: Mapping[str, float]) -> _Written:
    places = parameter_fields(model)
    wanted: dict[tuple[str, int, int], float] = {}
    for name, fields in places.items():
        for place in fields:
            wanted[place] = wanted.get(place, 1.0) * float(factors.get(name, 1.0))
    values, spread, faults, taken = [], 0.0, [], set()
    for p in model.parameters:
        ratios = []
        for place in places[p.name]:
            old, new = real(model.deck.field_text(*place)), real(again.deck.field_text(*place))
            # rounding of a field that several parameters scale counts with the first of them
            if place in taken or old == 0:
                continue
            taken.add(place)
            ratio = new / (old * wanted[place])
            if abs(ratio - 1.0) > ROUNDING:
                card, id_, field = place
                faults.append(
                    f"the updated deck has {plain(new, 6)} in field {field} of {card} {id_} where "
                    f"{plain(old * wanted[place], 6)} is meant (parameter {p.name!r}); {DO_NOT_USE}"
                )
            ratios.append(ratio)
        mean = float(np.mean(ratios)) if ratios else 1.0
        spread = max([spread, *(abs(r / mean - 1.0) for r in ratios)])
        values.append(mean * float(factors.get(p.name, 1.0)) if places[p.name] else 1.0)
    return _Written(np.array(values), spread, faults)


def _misplaced(model: Model, again: Model, factors: Mapping[str, float]) -> list[str]:
    """Nodes that are elsewhere than where the morphs put them."""
    there = model.moved({m.name: float(factors.get(m.name, 0.0)) for m in model.morphs})
    # scalar points have no place of their own
    off = np.where(model.is_scalar, 0.0, np.abs(again.xyz - there).max(axis=1, initial=0.0))
    at = int(np.argmax(off)) if off.size else 0
    if not off.size or off[at] <= COORDINATE * np.abs(there).max():
        return []
    return [
        f"the updated deck, read again, has node {model.node_ids[at]} {plain(float(off[at]))} away from where it is "
        f"meant to be; {DO_NOT_USE}"
    ]


def _told(model: Model, part: Difference) -> str:
    at = [(int(model.fe.dof_nodes[k]), int(model.fe.dof_components[k])) for k in (part.row, part.column)]
    where = " and ".join(dict.fromkeys(f"node {node}, component {component}" for node, component in at))
    cards = dict.fromkeys(f"{card} {id_}" for card, id_, _ in parameter_fields(model).get(part.parameter, ()))
    listed = [*list(cards)[:3], *(["..."] if len(cards) > 3 else [])]
    on = f" ({', '.join(listed)})" if listed else ""
    of = f"; it looks as if parameter {part.parameter!r}{on} is written otherwise than it was found"
    # as many digits as tell the two apart
    apart = abs(part.found - part.wanted) / max(abs(part.found), abs(part.wanted))
    digits = 6 if apart > 1e-4 else 12
    values = f"{plain(part.found, digits)} instead of {plain(part.wanted, digits)}"
    return (
        f"the updated deck, read again, is not the updated model: {part.matrix} at {where} is {values}"
        f"{of if part.parameter else ''}; {DO_NOT_USE}"
    )
