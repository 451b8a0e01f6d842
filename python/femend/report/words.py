"""Names, places and values of a result in plain words.

Works on the content of result.json alone, so that the command line and the page say the same.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from typing import Any

from femend.numerals import listed
from femend.report.entries import mapping, number, rows
from femend.report.numbers import pretty_unit, quantity
from femend.report.vocabulary import DIRECTIONS, PARAMETERS, PHYSICS, STATUS, VERDICTS

__all__ = [
    "TENTATIVE",
    "by_importance",
    "certainty",
    "considered_text",
    "how_much",
    "is_tentative",
    "is_unnamed",
    "law_of",
    "mapping",
    "misplaced_text",
    "nodes_text",
    "number",
    "parameter_text",
    "percent",
    "physics_name",
    "place_text",
    "rows",
    "sentence",
    "span_text",
    "status_text",
    "sure_text",
    "verdict_name",
]

# probability of a finding below which it is called tentative
TENTATIVE = 0.5
# laws that are listed beside a finding
CONSIDERED = 3


def verdict_name(verdict: str) -> str:
    """The verdict as a title; an unknown one is returned as it is."""
    return VERDICTS.get(verdict, verdict)


def status_text(status: str) -> str:
    """What a status means and what to do; "" of one that says it by its name, or whose advice does."""
    return STATUS.get(status, "")


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


# physics that nothing connects to the ground
_HANGING = ("added_mass", "tuned_absorber")


def place_text(location: Mapping[str, Any], physics: str = "") -> str:
    """Where a finding of a `physics` sits: "at node 4 in Z, to ground", "between nodes 4 and 7 in X".

    >>> place_text({"nodes": [4], "to": "ground", "direction": "Z"})
    'at node 4 in Z, to ground'
    >>> place_text({"nodes": [4], "to": "ground", "direction": "Z"}, "added_mass")
    'at node 4 in Z'
    >>> place_text({"nodes": [5], "to": "member to node 6", "direction": "RY"})
    'at node 5 in RY, at the end of the member to node 6'
    >>> place_text({"nodes": [15, 16], "to": "ground", "region": list(range(1, 31))})
    'over 30 nodes around nodes 15–16'
    >>> place_text({"nodes": [1, 9], "to": "ground", "direction": "Z", "region": [1, 3, 9], "shares": [1 / 3] * 3})
    'under 3 nodes between nodes 1–9 in Z, to ground'
    >>> place_text({"nodes": [1, 7], "to": "ground", "direction": "Z", "elements": [701, 702], "each": True})
    'in each of the connections 701, 702 (at nodes 1, 7) in Z'
    """
    nodes = [int(n) for n in location.get("nodes") or ()]
    direction = str(location.get("direction") or "")
    # a mass hangs on its node, and so does an oscillator
    to = None if physics in _HANGING else location.get("to")
    in_direction = "" if not direction else " in rotation" if direction == "R" else f" in {direction}"
    region = location.get("region") or ()
    if location.get("shares"):
        return f"under {len(region)} nodes between {nodes_text(nodes)}{in_direction}, to ground"
    if location.get("each"):
        elements, at = (listed(ids, 6) for ids in (location.get("elements") or (), nodes))
        return f"in each of the connections {elements} (at nodes {at}){in_direction}"
    if len(region) > len(nodes):
        return f"over {len(region)} nodes around {nodes_text(nodes)}{in_direction}"
    if not nodes:
        return f"in direction {direction}" if direction else "at no single place"
    if len(nodes) == 1:
        place = f"at node {nodes[0]}{in_direction}"
        if to == "ground":
            return f"{place}, to ground"
        if isinstance(to, str) and to.startswith("member"):
            return f"{place}, at the end of the {to}"
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
    word = "" if probability >= 0.8 else ", tentative" if probability < TENTATIVE else ", not certain"
    return f"{probability * 100:.0f} % among the hypotheses tried{word}"


def law_of(finding: Mapping[str, Any]) -> str:
    """Name of the law of a finding or of an alternative: its own, where the contract tells it by another's."""
    return str(finding.get("law") or finding.get("physics") or "")


def is_unnamed(finding: Mapping[str, Any]) -> bool:
    """Whether a finding is a place without a name: no law, or a free force of which a class alone is told."""
    return not law_of(finding) or bool(finding.get("class"))


def is_tentative(finding: Mapping[str, Any]) -> bool:
    """Whether a finding is less likely than not by its own probability, where it has one."""
    probability = number(finding.get("probability"))
    return probability is not None and probability < TENTATIVE


def sure_text(finding: Mapping[str, Any], verdict: str = "") -> str:
    """How sure a finding is, in words; of one without a name, that it has none, and of the likeliest law of a `verdict`
    without a name, that it does not explain what is left.

    >>> sure_text({"physics": "", "probability": 0.0})
    'no name: none of the laws tried explains it well enough'
    """
    if is_unnamed(finding):
        return "no name: none of the laws tried explains it well enough"
    if finding.get("as_read"):
        return "none: it is the law that follows the force which was read there, and no simulation could follow it"
    if finding.get("probability") is None:
        return "none: the run was stopped before all laws were tried"
    said = certainty(number(finding.get("probability")))
    return f"{said}, of which none explains all that is left" if verdict == "located-not-named" else said


def considered_text(finding: Mapping[str, Any]) -> str:
    """What else was considered: "also considered: cubic stiffness (5 %)", or the nearest laws of a finding without a
    name, of which no probability is told; empty where there is none."""
    others = [
        (physics_name(law_of(a)), percent(a.get("probability"))) for a in rows(finding.get("alternatives"))[:CONSIDERED]
    ]
    if not others:
        return ""
    if is_unnamed(finding):
        return f"nearest laws tried: {', '.join(name for name, _ in others)}"
    return f"also considered: {', '.join(f'{name} ({share})' for name, share in others)}"


def misplaced_text(finding: Mapping[str, Any]) -> str:
    """Where a force that was recorded elsewhere, or in another direction, acts; empty for another finding.

    >>> acts = {"node": {"value": 1217}, "direction": {"value": "+Z"}}
    >>> found = {"physics": "load_misplaced", "parameters": acts, "recorded": [{"node": 2017, "direction": "+Z"}]}
    >>> misplaced_text(found)
    'the force recorded at node 2017 in +Z acts at node 1217 in +Z'
    """
    acts = mapping(finding.get("parameters"))
    if finding.get("physics") != "load_misplaced" or number(acts.get("node")) is None:
        return ""
    recorded = " and ".join(f"node {r.get('node')} in {r.get('direction')}" for r in rows(finding.get("recorded")))
    force = f"the force recorded at {recorded}" if recorded else "the recorded force"
    direction = mapping(acts.get("direction")).get("value")
    if acts_where_recorded(finding):
        return f"{force} acts there along {direction}"
    return f"{force} acts at node {number(acts['node']):.0f} in {direction}"


def acts_where_recorded(finding: Mapping[str, Any]) -> bool:
    """Whether a misplaced load acts at the one node where it was recorded, in another direction."""
    node = number(mapping(mapping(finding.get("parameters")).get("node")).get("value"))
    return node is not None and [number(r.get("node")) for r in rows(finding.get("recorded"))] == [node]


def how_much(finding: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Names and values of a finding's parameters; none of a misplaced load, whose place is what it is about."""
    if misplaced_text(finding):
        return []
    physics, parameters = law_of(finding), mapping(finding.get("parameters"))
    told = [parameter_text(name, entry, physics) for name, entry in by_importance(parameters)]
    # of a bedding the stiffness is that of all its springs
    whole = " in all" if mapping(finding.get("location")).get("shares") else ""
    return [(f"{label}{whole}", text) for label, text in told]


def percent(probability: Any) -> str:
    """A probability: "93 %", "< 1 %", or an en dash."""
    value = number(probability)
    if value is None:
        return "–"
    if value < 0.01:
        return "< 1 %"
    return "> 99 %" if value > 0.99 else f"{value * 100:.0f} %"


def by_importance(parameters: Mapping[str, Any]) -> list[tuple[str, Any]]:
    """Gap and mass before stiffness before the rest: what the eye looks for first."""
    first = {"gap": 0, "m": 1, "f": 2, "k": 3, "k3": 3}
    return sorted(parameters.items(), key=lambda item: first.get(item[0], 9))
