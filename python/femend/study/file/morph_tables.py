"""Checking the positions that a study lets `femend update` change."""

from __future__ import annotations

import math
from collections.abc import Sequence

from femend.study.file.bench_settings import MorphSettings
from femend.study.file.check import Check
from femend.study.file.schema import MorphTable

__all__ = ["MOVES", "morph_settings"]

Vector = tuple[float, float, float]

# keys that each move needs, and those it may have beside them
MOVES: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "joint": (("nodes", "direction", "held"), ()),
    "nodes": (("nodes", "direction", "radius"), ("held",)),
    "offset": ((), ("properties", "elements")),
    "growth": (("nodes", "point"), ("axis", "along")),
    "vectors": (("vectors",), ()),
}
_KEYS = ("nodes", "direction", "held", "radius", "properties", "elements", "point", "axis", "along", "vectors")
# unknowns that stand beside the parameters where damping or FRFs are compared
_DAMPING = ("alpha", "beta", "eta")


def morph_settings(check: Check, tables: Sequence[MorphTable], taken: Sequence[str]) -> tuple[MorphSettings, ...]:
    """``[[updating.morph]]``, beside parameters whose names are `taken`; raises StudyError, naming the key, for a name
    that stands twice, a key that the move needs or does not take, and numbers that are none.

    Whether nodes and elements are there is found when the deck is read.
    """
    names: set[str] = set()
    for i, table in enumerate(tables):
        key = f"updating.morph[{i}].name"
        if not table.name.strip():
            raise check.fail(key, "is empty; give the morph a name")
        if table.name in taken or table.name in names or table.name in _DAMPING:
            whose = "a [[parameter]]" if table.name in taken else "the damping" if table.name in _DAMPING else "another"
            raise check.fail(key, f"{table.name!r} is the name of {whose} too; give the morph its own")
        names.add(table.name)
    return tuple(_morph(check, table, f"updating.morph[{i}]") for i, table in enumerate(tables))


def _morph(check: Check, table: MorphTable, key: str) -> MorphSettings:
    check.one_of(f"{key}.move", table.move, tuple(MOVES))
    needed, more = MOVES[table.move]
    who = f"morph {table.name!r}"
    given = [k for k in _KEYS if getattr(table, k) is not None]
    for k in needed:
        if k not in given:
            raise check.fail(f"{key}.{k}", f"{who}: is missing; move = {table.move!r} needs {', '.join(needed)}")
    for k in given:
        if k not in needed + more:
            raise check.fail(
                f"{key}.{k}", f"{who}: move = {table.move!r} does not take it; it takes {', '.join(needed + more)}"
            )
        if getattr(table, k) == []:
            raise check.fail(f"{key}.{k}", f"{who}: the list is empty")
    if table.move == "offset" and not given:
        raise check.fail(f"{key}.properties", f"{who}: is missing; name the shells by properties or elements")
    if table.along and table.axis is None:
        raise check.fail(f"{key}.axis", f"{who}: is missing; along = true grows along an axis")
    if not (math.isfinite(table.prior_sd) and table.prior_sd > 0):
        raise check.fail(f"{key}.prior_sd", f"{who}: {table.prior_sd:g} is not above 0")
    if table.radius is not None and not (math.isfinite(table.radius) and table.radius > 0):
        raise check.fail(f"{key}.radius", f"{who}: {table.radius:g} is no length above 0")
    return MorphSettings(
        table.name,
        table.move,
        table.prior_sd,
        _bounds(check, f"{key}.bounds", who, table.bounds),
        tuple(table.nodes or ()),
        _vector(check, f"{key}.direction", who, table.direction),
        tuple(table.held or ()),
        table.radius,
        tuple(table.properties or ()),
        tuple(table.elements or ()),
        _vector(check, f"{key}.point", who, table.point, length=False),
        _vector(check, f"{key}.axis", who, table.axis),
        bool(table.along),
        tuple(
            (v.node, _three(check, f"{key}.vectors[{j}].vector", who, v.vector))
            for j, v in enumerate(table.vectors or ())
        ),
    )


def _bounds(check: Check, key: str, who: str, value: list[float] | None) -> tuple[float, float] | None:
    if value is None:
        return None
    if len(value) != 2 or not (value[0] <= 0 <= value[1] and value[0] < value[1] and all(map(math.isfinite, value))):
        raise check.fail(
            key,
            f"{who}: {value} is not [lower, upper] about 0, which is the deck as it stands; amplitudes are no factors",
        )
    return value[0], value[1]


def _vector(check: Check, key: str, who: str, value: list[float] | None, length: bool = True) -> Vector | None:
    if value is None:
        return None
    found = _three(check, key, who, value)
    if length and not any(found):
        raise check.fail(key, f"{who}: {value} has no length")
    return found


def _three(check: Check, key: str, who: str, value: list[float]) -> Vector:
    if len(value) != 3 or not all(map(math.isfinite, value)):
        raise check.fail(key, f"{who}: {value} are not three numbers, in basic axes")
    return value[0], value[1], value[2]
