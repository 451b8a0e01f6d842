"""Names, places and values of a result in plain words.

Works on the content of result.json alone, so that the command line and the page say the same.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from typing import Any

from femend.report.entries import mapping, number, rows
from femend.report.numbers import pretty_unit, quantity
from femend.report.vocabulary import DIRECTIONS, PARAMETERS, PHYSICS, VERDICTS

__all__ = [
    "by_importance",
    "certainty",
    "mapping",
    "nodes_text",
    "number",
    "parameter_text",
    "physics_name",
    "place_text",
    "rows",
    "sentence",
    "span_text",
    "verdict_name",
]


def verdict_name(verdict: str) -> str:
    """The verdict as a title; an unknown one is returned as it is."""
    return VERDICTS.get(verdict, verdict)


def physics_name(physics: str, parameters: Mapping[str, Any] | None = None) -> str:
    """Plain name of a physics of the contract; the sides of a contact are part of it.

    >>> physics_name("clearance", {"sides": {"value": 1}})
    'one-sided contact'
    """
    name = PHYSICS.get(physics, physics.replace("_", " "))
    if physics == "clearance":
        sides = number(mapping(parameters).get("sides"))
        if sides in (1.0, -1.0):
            return "one-sided contact"
        if sides == 2.0:
            return "two-sided contact"
    return name


def place_text(location: Mapping[str, Any]) -> str:
    """Where a finding sits: "at node 4 in Z, to ground", "between nodes 4 and 7 in X".

    >>> place_text({"nodes": [4], "to": "ground", "direction": "Z"})
    'at node 4 in Z, to ground'
    >>> place_text({"nodes": [15, 16], "to": "ground", "region": list(range(1, 31))})
    'over 30 nodes around nodes 15–16'
    """
    nodes = [int(n) for n in location.get("nodes") or ()]
    direction = str(location.get("direction") or "")
    to = location.get("to")
    in_direction = "" if not direction else " in rotation" if direction == "R" else f" in {direction}"
    region = location.get("region") or ()
    if len(region) > len(nodes):
        return f"over {len(region)} nodes around {nodes_text(nodes)}{in_direction}"
    if not nodes:
        return f"in direction {direction}" if direction else "at no single place"
    if len(nodes) == 1:
        place = f"at node {nodes[0]}{in_direction}"
        if to == "ground":
            return f"{place}, to ground"
        return f"{place}, to {f'node {to}' if isinstance(to, int) else to}" if to else place
    if len(nodes) == 2:
        return f"between nodes {nodes[0]} and {nodes[1]}{in_direction}"
    shown = ", ".join(str(n) for n in nodes[:6]) + (", …" if len(nodes) > 6 else "")
    return f"at nodes {shown}{in_direction}" + (", to ground" if to == "ground" else "")


def span_text(location: Mapping[str, Any]) -> str:
    """The corners of a place that is an area: "nodes 1–6–25–30"; empty for another place."""
    also = location.get("also_possible") or ()
    return nodes_text(also[0]) if location.get("region") and also else ""


def sensor_text(location: Mapping[str, Any]) -> str:
    """What sensor would split the set of places: "a sensor at node 7 in Z would tell 2 of 3 from it"; empty where none
    is known to."""
    sensor = mapping(location.get("next_sensor"))
    if not sensor:
        return ""
    apart, rivals = int(sensor.get("tells_apart") or 0), int(sensor.get("of") or 0)
    which = "the other" if rivals == 1 else f"all {rivals}" if apart == rivals else f"{apart} of {rivals}"
    return f"a sensor at node {sensor.get('node')} in {sensor.get('direction')} would tell {which} from it"


def sentence(text: str) -> str:
    """`text` with a capital at its beginning."""
    return text[:1].upper() + text[1:]


def nodes_text(nodes: Any) -> str:
    """A place given by its nodes alone: "node 5", "nodes 4–7"."""
    numbers = [str(n) for n in nodes] if isinstance(nodes, list | tuple) else [str(nodes)]
    return f"node {numbers[0]}" if len(numbers) == 1 else f"nodes {'–'.join(numbers)}"


def _by_axis(name: str, unit: str) -> str:
    """`k_x`, `k_rot_z`, `c_y_total` in words; another name as it is."""
    found = re.fullmatch(r"([kc])(_rot)?_([xyz])(_total)?", name)
    if found is None:
        return name
    what = {"k": "stiffness", "c": "damping"}[found[1]]
    extent = " in total" if found[4] else " per area" if unit.endswith(("/m^3", "/mm^3", "/in^3", "/ft^3")) else ""
    return f"{'rotational ' if found[2] else ''}{what} {found[3].upper()}{extent}"


def parameter_text(name: str, entry: Any, physics: str = "", *, with_sd: bool = True) -> tuple[str, str]:
    """Name and value of a parameter of the law `physics`: ("gap", "0.63 ± 0.02 mm"), or without the plus-minus."""
    label = PARAMETERS.get(name) or _by_axis(name, str(mapping(entry).get("unit") or ""))
    if physics in ("compliant_support", "support_stiffness", "joint_stiffness") and name in DIRECTIONS:
        label = f"stiffness {DIRECTIONS[name]}"
    if name == "node":
        return label, f"{number(mapping(entry).get('value', entry)) or 0:.0f}"
    if name == "sides" and number(entry) is not None:
        return label, {1.0: "one", 2.0: "two"}.get(abs(number(entry) or 0.0), str(number(entry)))
    if not isinstance(entry, Mapping):
        value = number(entry)
        return label, str(entry) if value is None else quantity(value)
    value, sd, unit = number(entry.get("value")), number(entry.get("sd")), str(entry.get("unit") or "")
    if value is None:
        shown = entry.get("value")
        return label, "–" if shown is None else f"{shown} {pretty_unit(unit)}".strip()
    text = quantity(value, unit, sd)
    return label, text if with_sd else _without_sd(text)


def _without_sd(text: str) -> str:
    text = re.sub(r"\((\S+) ± \S+\)(×10\S+)", r"\1\2", text)
    value, plus_minus, rest = text.partition(" ± ")
    return f"{value} {rest.partition(' ')[2]}".strip() if plus_minus else text


def certainty(probability: float | None) -> str:
    """A probability among the hypotheses tried, in words and percent."""
    if probability is None or not math.isfinite(probability):
        return "no probability given"
    if probability >= 0.99:
        return "more than 99 % among the hypotheses tried"
    word = "" if probability >= 0.8 else ", tentative" if probability < 0.5 else ", not certain"
    return f"{probability * 100:.0f} % among the hypotheses tried{word}"


def by_importance(parameters: Mapping[str, Any]) -> list[tuple[str, Any]]:
    """Gap and mass before stiffness before the rest: what the eye looks for first."""
    first = {"gap": 0, "m": 1, "f": 2, "k": 3, "k3": 3}
    return sorted(parameters.items(), key=lambda item: first.get(item[0], 9))
