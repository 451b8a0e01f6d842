"""Checking the explanations that a study asks a planned test to tell apart."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from femend.dof import parse_direction
from femend.study.file.bench_settings import CandidateSettings
from femend.study.file.check import Check
from femend.study.file.schema import CandidateTable

__all__ = ["CANDIDATE_KEYS", "candidate_settings"]

# keys that each kind of physics needs, the last one its size but for a support
CANDIDATE_KEYS: dict[str, tuple[str, ...]] = {
    "added_mass": ("node", "m"),
    "support_stiffness": ("node", "direction", "k"),
    "viscous_damper": ("node", "direction", "c"),
    "joint_stiffness": ("element", "change"),
    "compliant_support": ("nodes", "directions"),
}
# keys that one may take beside them
_MORE = {"compliant_support": ("k",)}
_KEYS = ("node", "nodes", "element", "direction", "directions", "m", "k", "c", "change")


def candidate_settings(
    check: Check, tables: Sequence[CandidateTable], parameters: Mapping[str, float]
) -> tuple[CandidateSettings, ...]:
    """``[pretest] distinguish`` of a study with `parameters`, prior deviations by name; raises StudyError, naming the
    key, for a single explanation, for one that stands twice, for physics that a modal test is not asked for, and
    for a key that is missing or not taken. Whether nodes and elements are there is found when the deck is read."""
    if len(tables) == 1:
        raise check.fail("pretest.distinguish", "has one explanation; two at least can be told apart")
    found = [_candidate(check, t, parameters, f"pretest.distinguish[{i}]") for i, t in enumerate(tables)]
    for i, one in enumerate(found):
        if one.what in [other.what for other in found[:i]]:
            raise check.fail(f"pretest.distinguish[{i}]", "stands twice; nothing can be told apart from itself")
    return tuple(found)


def _candidate(check: Check, table: CandidateTable, parameters: Mapping[str, float], key: str) -> CandidateSettings:
    if (table.parameter is None) == (table.physics is None):
        raise check.fail(key, "takes either a parameter of the study or physics that the deck lacks")
    given = [k for k in _KEYS if getattr(table, k) is not None]
    if table.parameter is not None:
        check.one_of(f"{key}.parameter", table.parameter, tuple(parameters))
        _taken(check, key, given, (), ("change",), f"parameter {table.parameter!r}")
        change = parameters[table.parameter] if table.change is None else table.change
        return CandidateSettings(parameter=table.parameter, size=_size(check, f"{key}.change", change, signed=True))
    assert table.physics is not None
    check.one_of(f"{key}.physics", table.physics, tuple(CANDIDATE_KEYS))
    needed, more = CANDIDATE_KEYS[table.physics], _MORE.get(table.physics, ())
    _taken(check, key, given, needed, more, f"physics {table.physics!r}")
    if table.physics == "compliant_support":
        return _support(check, table, key)
    how_much = needed[-1]
    value = getattr(table, how_much)
    if isinstance(value, list):
        raise check.fail(f"{key}.{how_much}", f"physics {table.physics!r} takes one number, not a list")
    size = _size(check, f"{key}.{how_much}", value, signed=how_much == "change")
    component = 0
    if table.direction is not None:
        component = _component(check, f"{key}.direction", table.direction)
        if component > 3:
            raise check.fail(f"{key}.direction", f"{table.direction!r} is a rotation; take X, Y or Z")
    return CandidateSettings(
        physics=table.physics, node=table.node, element=table.element, component=component, size=size
    )


def _support(check: Check, table: CandidateTable, key: str) -> CandidateSettings:
    """A support that gives way; in the order of its components, so that the same one is known again."""
    assert table.nodes is not None
    assert table.directions is not None
    for name, given in (("nodes", table.nodes), ("directions", table.directions)):
        if not given or len(set(given)) != len(given):
            raise check.fail(f"{key}.{name}", f"{given} is not a list of one at least, each once")
    components = [_component(check, f"{key}.directions", text) for text in table.directions]
    if len(set(components)) != len(components):
        raise check.fail(f"{key}.directions", f"{table.directions} has a direction twice")
    k = None
    if table.k is not None:
        if not isinstance(table.k, list) or len(table.k) != len(components):
            raise check.fail(f"{key}.k", f"{table.k} is not a list of {len(components)}, one for each of `directions`")
        k = [_size(check, f"{key}.k", value, signed=False) for value in table.k]
    order = sorted(range(len(components)), key=components.__getitem__)
    return CandidateSettings(
        physics=table.physics,
        nodes=tuple(sorted(table.nodes)),
        components=tuple(components[i] for i in order),
        k=None if k is None else tuple(k[i] for i in order),
    )


def _component(check: Check, key: str, text: str) -> int:
    try:
        return parse_direction(text)[0]
    except ValueError as error:
        raise check.fail(key, str(error)) from None


def _taken(check: Check, key: str, given: Sequence[str], needed: Sequence[str], more: Sequence[str], who: str) -> None:
    for k in needed:
        if k not in given:
            raise check.fail(f"{key}.{k}", f"is missing; {who} takes {', '.join(needed)}")
    for k in given:
        if k not in (*needed, *more):
            raise check.fail(f"{key}.{k}", f"{who} does not take it; it takes {', '.join((*needed, *more))}")


def _size(check: Check, key: str, value: float, *, signed: bool) -> float:
    if not (math.isfinite(value) and (value != 0 if signed else value > 0)):
        raise check.fail(key, f"{value:g} is not {'a number other than' if signed else 'above'} 0")
    return abs(value)
