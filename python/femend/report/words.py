"""The diagnosis in plain words: names of physics, places, and the sentence at the top of the report.

Works on the content of result.json alone, so that the command line and the page say the same.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from femend.report.entries import Result, mapping, number, rows
from femend.report.mode_words import FrequencyErrors, frequency_errors
from femend.report.numbers import factor_as_percent, pretty_unit, quantity, ratio
from femend.report.vocabulary import DIRECTIONS, PARAMETERS, PHYSICS, VERDICTS

__all__ = [
    "BEYOND_NOISE",
    "INTERRUPTED",
    "ErrorGain",
    "by_importance",
    "certainty",
    "final_error",
    "headline",
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

_CHANGED = {"parameters": "without and with the missing term", "nominal": "model as given and final model"}


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


# status of a run that was stopped before it could decide
INTERRUPTED = "interrupted"
# error of an updated model, in units of the noise, beyond which it cannot be said to explain the recordings
BEYOND_NOISE = 1.5


@dataclass(frozen=True)
class ErrorGain:
    """Mean NRMSE over the recordings that speak (`which`) before and after, what changed between, and their noise."""

    which: str
    stage: str
    before: float
    after: float
    noise: float | None


def error_gain(result: Result, before: str, after: str) -> ErrorGain | None:
    """NRMSE at two stages (nominal, parameters, final), averaged over the held-out recordings.

    Those used for the fit speak where nothing was held out; None where no figures are given.
    """
    for role, which in (("validate", "unseen recordings"), ("fit", "the fitted recordings")):
        table = [r for r in rows(result.get("fit")) if r.get("role") == role]
        pairs = [(number(r.get(before)), number(r.get(after))) for r in table]
        known = [(b, a) for b, a in pairs if b is not None and a is not None]
        if known:
            noise = [v for v in (number(r.get("noise_floor")) for r in table) if v is not None]
            changed = "after updating the parameters" if after == "parameters" else _CHANGED[before]
            return ErrorGain(
                which,
                changed,
                sum(b for b, _ in known) / len(known),
                sum(a for _, a in known) / len(known),
                sum(noise) / len(noise) if noise else None,
            )
    return None


def final_error(result: Result) -> ErrorGain | None:
    """The gain that belongs to the verdict: of the added physics where there is a finding, else of the update."""
    if rows(result.get("findings")):
        gain = error_gain(result, "parameters", "final")
        return gain or error_gain(result, "nominal", "parameters")
    return error_gain(result, "nominal", "parameters") or error_gain(result, "nominal", "final")


def headline(result: Result) -> str:
    """The one sentence an engineer takes away."""
    verdict = str(result.get("verdict", ""))
    findings = rows(result.get("findings"))
    if verdict == "missing-physics" and findings:
        return _missing(findings, result)
    if verdict == "located-not-named" and findings:
        return _located(findings[0], result)
    if verdict in ("consistent", "parameters-only") and (by_modes := _by_modes(result)):
        return by_modes
    if verdict == "consistent":
        return "Nothing is missing: the model as given explains the recordings" + _level(result) + "."
    if verdict == "parameters-only":
        updated = _updated(result)
        gain = error_gain(result, "nominal", "parameters")
        if gain is not None and gain.noise is not None and gain.after > BEYOND_NOISE * gain.noise:
            return (
                f"Nothing at one place is missing as far as these recordings tell, but the model{updated} leaves an "
                f"error of {ratio(gain.after)} on {gain.which} where noise is {ratio(gain.noise)}: its mesh or "
                "idealisation is off, or more than one thing is missing."
            )
        return (
            f"Nothing is missing: the model explains the recordings{updated}{_gain(result, 'nominal', 'parameters')}."
        )
    if verdict == "undetermined" and result.get("status") == INTERRUPTED:
        fit = _gain(result, "nominal", "parameters")
        return f"Interrupted before it was decided whether something is missing; the parameters are updated{fit}."
    if verdict == "undetermined" and any(not row.get("left_out") for row in rows(result.get("corrections"))):
        return "The recordings have to be corrected before they can tell whether something is missing in the model."
    if verdict == "undetermined" and (errors := _modes_alone(result)) is not None and errors.unlike:
        return f"The modes cannot tell whether something is missing, since the model is not theirs: {errors.text}."
    if verdict == "undetermined":
        return "The recordings cannot tell whether something is missing in the model."
    return f"{verdict_name(verdict)}." if verdict else "No verdict was reached."


def _updated(result: Result) -> str:
    moved = _moved(result)
    return f" once updated ({moved})" if moved else " once its parameters are updated"


def _modes_alone(result: Result) -> FrequencyErrors | None:
    """The errors of frequencies of a study of which nothing but modes was compared; None of another one."""
    return None if error_gain(result, "nominal", "nominal") else frequency_errors(result)


def _by_modes(result: Result) -> str:
    """The sentence for a model without findings of which nothing but modes was compared; empty for another one."""
    errors = _modes_alone(result)
    if errors is None:
        return ""
    how = " as given" if result.get("verdict") == "consistent" else _updated(result)
    if errors.beyond:
        return (
            f"Nothing at one place is missing as far as these modes tell, but the model{how} does not explain them: "
            f"{errors.text}; its mesh or idealisation is off, or more than one thing is missing."
        )
    return f"Nothing is missing as far as these modes tell: the model{how} explains them; {errors.text}."


def _missing(findings: Sequence[Result], result: Result) -> str:
    parts = []
    for finding in findings:
        parameters, physics = mapping(finding.get("parameters")), str(finding.get("physics", ""))
        values = [
            " ".join(parameter_text(name, entry, physics, with_sd=False))
            for name, entry in _told(parameters, len(findings))
        ]
        what = physics_name(physics, parameters)
        parts.append(", ".join([f"{what} {place_text(mapping(finding.get('location')))}", *values]))
    return f"Missing: {'; and '.join(parts)}{_gain(result, 'parameters', 'final')}."


def _told(parameters: Mapping[str, Any], n_findings: int) -> list[tuple[str, Any]]:
    """What the headline says of a law: everything of a short one, the stiffnesses by axis of a long one, and nothing of
    a long one that is not alone."""
    every = [row for row in by_importance(parameters) if row[0] != "sides"]
    by_axis = [row for row in every if re.fullmatch(r"k(_rot)?_[xyz]", row[0])]
    if by_axis and n_findings > 1:
        return []
    return by_axis if by_axis and len(every) > len(by_axis) else every


def _located(finding: Result, result: Result) -> str:
    physics = str(finding.get("physics") or "")
    what = physics_name(physics) if physics in PHYSICS else "something"
    place = place_text(mapping(finding.get("location")))
    gain = _gain(result, "parameters", "final")
    if finding.get("class"):
        what = f"a force ({finding['class']})"
    elif physics in PHYSICS and finding.get("parameters"):
        return f"Likeliest missing: {what} {place}, though it does not explain all that is left{gain}."
    return f"The model lacks {what} {place}, but no law tried explains it well enough to be named{gain}."


def _gain(result: Result, before: str, after: str) -> str:
    gain = error_gain(result, before, after)
    if gain is None:
        return ""
    kind = "prediction error" if gain.which == "unseen recordings" else "error"
    decimals = 2 if min(gain.before, gain.after) >= 0.0095 else 3
    return f"; {kind} on {gain.which} {gain.before:.{decimals}f} → {gain.after:.{decimals}f}"


def _level(result: Result) -> str:
    gain = error_gain(result, "nominal", "nominal")
    if gain is None:
        return ""
    floor = f", noise {ratio(gain.noise)}" if gain.noise is not None else ""
    return f" (error on {gain.which} {ratio(gain.before)}{floor})"


def _moved(result: Result) -> str:
    """The three parameters that moved most, with their change."""
    rows = [(str(name), number(mapping(p).get("factor"))) for name, p in mapping(result.get("parameters")).items()]
    known = [(name, f) for name, f in rows if f is not None and f > 0 and abs(f - 1.0) >= 0.005]
    known.sort(key=lambda row: -abs(math.log(row[1])))
    return ", ".join(f"{name} {factor_as_percent(factor)}" for name, factor in known[:3])


def by_importance(parameters: Mapping[str, Any]) -> list[tuple[str, Any]]:
    """Gap and mass before stiffness before the rest: what the eye looks for first."""
    first = {"gap": 0, "m": 1, "f": 2, "k": 3, "k3": 3}
    return sorted(parameters.items(), key=lambda item: first.get(item[0], 9))
