"""Checking the links between parameters that a study has `femend update` keep."""

from __future__ import annotations

import math
from collections.abc import Sequence

from femend.study.file.bench_settings import LinkSettings
from femend.study.file.check import Check
from femend.study.file.schema import LinkTable

__all__ = ["link_settings"]


def link_settings(
    check: Check,
    tables: Sequence[LinkTable],
    parameters: Sequence[str],
    morphs: Sequence[str],
    configurations: Sequence[str],
) -> tuple[LinkSettings, ...]:
    """``[[updating.link]]`` of a study with `parameters`, `morphs` and `configurations` (all, "as modelled" too) of
    these names; raises StudyError, naming the key, for a name that is none, a parameter that is linked twice in one
    configuration or to one that is linked itself, and numbers that are none."""
    found = tuple(
        _link(check, table, f"updating.link[{i}]", parameters, morphs, configurations) for i, table in enumerate(tables)
    )
    for i, a in enumerate(found):
        key = f"updating.link[{i}]"
        for b in found[:i]:
            if a.parameter == b.parameter and (both := _both(a, b, configurations)):
                raise check.fail(
                    f"{key}.parameter", f"{a.parameter!r} is linked twice in configuration {both[0]!r}; once is enough"
                )
        for b in found:
            if b.parameter in a.to and (both := _both(a, b, configurations)):
                raise check.fail(
                    f"{key}.to",
                    f"{a.parameter!r} is linked to {b.parameter!r}, which is linked itself in configuration "
                    f"{both[0]!r}; link both to the same",
                )
    return found


def _both(a: LinkSettings, b: LinkSettings, configurations: Sequence[str]) -> list[str]:
    return [c for c in configurations if a.holds_in(c) and b.holds_in(c)]


def _link(
    check: Check,
    table: LinkTable,
    key: str,
    parameters: Sequence[str],
    morphs: Sequence[str],
    configurations: Sequence[str],
) -> LinkSettings:
    known = (*parameters, *morphs)
    check.one_of(f"{key}.parameter", table.parameter, known)
    for name in table.configurations:
        check.one_of(f"{key}.configurations", name, tuple(configurations))
    who = f"link of {table.parameter!r}"
    where = tuple(dict.fromkeys(table.configurations))
    if table.own:
        if table.to or table.powers is not None or table.scale != 1.0:
            raise check.fail(
                f"{key}.own", f"{who}: own = true stands beside to, powers or scale; it takes none of them"
            )
        if not where:
            raise check.fail(
                f"{key}.configurations", f'{who}: is missing; say in which it has a value of its own, as ["clamped"]'
            )
        name = f"{table.parameter} ({', '.join(where)})"
        return LinkSettings(table.parameter, (name,), (1.0,), 1.0, where, True)
    if not table.to:
        raise check.fail(f"{key}.to", f"{who}: is missing; name what it follows, or say own = true")
    for name in table.to:
        check.one_of(f"{key}.to", name, known)
        if name == table.parameter or table.to.count(name) > 1:
            raise check.fail(f"{key}.to", f"{who}: {name!r} is itself, or stands twice")
    powers = [1.0] * len(table.to) if table.powers is None else table.powers
    if len(powers) != len(table.to) or not all(math.isfinite(x) and x for x in powers):
        raise check.fail(
            f"{key}.powers", f"{who}: {powers} are not {len(table.to)} numbers other than 0, one for each of to"
        )
    _kinds(check, table, key, who, powers, morphs)
    return LinkSettings(table.parameter, tuple(table.to), tuple(map(float, powers)), table.scale, where)


def _kinds(check: Check, table: LinkTable, key: str, who: str, powers: Sequence[float], morphs: Sequence[str]) -> None:
    """Factors follow factors, an amplitude one other, by a scale that leaves them what they are."""
    of_morphs = [name in morphs for name in (table.parameter, *table.to)]
    if any(of_morphs) and not (all(of_morphs) and list(powers) == [1.0]):
        raise check.fail(
            f"{key}.to",
            f"{who}: the amplitude of a morph follows that of one other morph, times scale; factors follow factors",
        )
    if not math.isfinite(table.scale) or table.scale == 0 or (table.scale < 0 and not any(of_morphs)):
        raise check.fail(f"{key}.scale", f"{who}: {table.scale:g} is not above 0")
