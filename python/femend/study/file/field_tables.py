"""Checking the fields of factors that a study lets `femend update` change."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence

from femend.study.file.bench_settings import FieldSettings
from femend.study.file.check import Check
from femend.study.file.parameter_targets import ALL_PROPERTIES, OF_TARGET, checked_prior, whose
from femend.study.file.schema import FieldTable

__all__ = ["NEIGHBOURS", "field_settings"]

NEIGHBOURS = ("touching", "in order")
# what the parts are, and the properties that they may have
_PARTS = {
    "elements": ALL_PROPERTIES,
    "elements_of": ALL_PROPERTIES,
    "property_ids": OF_TARGET["property_id"],
    "materials": OF_TARGET["material"],
}
# the key of parts by what has the property
_LISTS = {"material": "materials", "property_id": "property_ids"}
_PRIOR_SD = 0.1


def field_settings(
    check: Check, tables: Sequence[FieldTable], parameters: Sequence[str], morphs: Sequence[str]
) -> tuple[FieldSettings, ...]:
    """``[[updating.field]]``, beside `parameters` and `morphs` of these names; raises StudyError, naming the key, for a
    name that stands twice, parts that are not told or told twice, and numbers that are none.

    Whether elements and properties are there, and touch, is found when the deck is read.
    """
    names: set[str] = set()
    for i, table in enumerate(tables):
        key = f"updating.field[{i}].name"
        if not table.name.strip():
            raise check.fail(key, "is empty; give the field a name")
        if table.name in names or table.name in morphs or (table.name in parameters):
            raise check.fail(key, f"{table.name!r} is the name of another field, morph or parameter; give it its own")
        names.add(table.name)
    return tuple(_field(check, table, f"updating.field[{i}]", parameters) for i, table in enumerate(tables))


def _field(check: Check, table: FieldTable, key: str, parameters: Sequence[str]) -> FieldSettings:
    who = f"field {table.name!r}"
    check.one_of(f"{key}.neighbours", table.neighbours, NEIGHBOURS)
    if not (math.isfinite(table.neighbour_sd) and table.neighbour_sd > 0):
        raise check.fail(
            f"{key}.neighbour_sd",
            f"{who}: {table.neighbour_sd:g} is not above 0; it is by how much neighbours differ (5 % is 0.05)",
        )
    choices = (*_PARTS, "parameters")
    given = [k for k in choices if getattr(table, k) is not None]
    if len(given) != 1:
        has = "no parts" if not given else f"its parts told {len(given)} times ({', '.join(given)})"
        raise check.fail(key, f"{who} has {has}; give exactly one of {', '.join(choices)}")
    target = given[0]
    parts = getattr(table, target)
    least = 1 if target == "elements_of" else 2
    if len(parts) < least:
        raise check.fail(f"{key}.{target}", f"{who}: {len(parts)} given; give {least} or more, alike or not")
    twice = next((part for part, times in Counter(parts).items() if times > 1), None)
    if twice is not None:
        raise check.fail(f"{key}.{target}", f"{who}: {twice!r} stands twice; each part has one factor")
    in_order = table.neighbours == "in order"
    if target == "parameters":
        return _of_parameters(check, table, key, parameters)
    if table.property is None:
        raise check.fail(f"{key}.property", f'{who}: is missing; say what the factors are on, as property = "E"')
    owner = _LISTS.get(whose(table.property) or "")
    if table.property not in _PARTS[target] and owner is not None:
        told = f"{who}: {table.property!r} is no property of {target}; give {owner} in their place"
        raise check.fail(f"{key}.property", told)
    check.one_of(f"{key}.property", table.property, _PARTS[target])
    prior_sd = _PRIOR_SD if table.prior_sd is None else table.prior_sd
    bounds = checked_prior(check, key, who, prior_sd, table.bounds)
    return FieldSettings(
        table.name, table.neighbour_sd, table.property, target, tuple(parts), (), in_order, prior_sd, bounds
    )


def _of_parameters(check: Check, table: FieldTable, key: str, parameters: Sequence[str]) -> FieldSettings:
    """A field of parameters that the study has by itself."""
    for k in ("property", "prior_sd", "bounds"):
        if getattr(table, k) is not None:
            raise check.fail(
                f"{key}.{k}", f"field {table.name!r}: the parameters have theirs; leave it out beside parameters"
            )
    names = tuple(table.parameters or ())
    for name in names:
        check.one_of(f"{key}.parameters", name, tuple(parameters))
    return FieldSettings(table.name, table.neighbour_sd, parameters=names, in_order=table.neighbours == "in order")
