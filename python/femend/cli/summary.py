"""What a diagnosis says on the terminal: the same words as the report, from the same result.json."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from femend.report import words
from femend.report.headline import headline
from femend.report.numbers import factor_as_percent, ratio
from femend.report.text_table import table

__all__ = ["read_result", "summary"]


def read_result(out: Path) -> dict[str, Any]:
    """The content of `out`/result.json."""
    found = json.loads((out / "result.json").read_text(encoding="utf-8"))
    return found if isinstance(found, dict) else {}


def summary(result: Mapping[str, Any]) -> str:
    """Headline, verdict, findings with their certainty, parameters, fit figures, advice."""
    parts = [headline(result), "", f"verdict   {words.verdict_name(str(result.get('verdict', '')))}"]
    findings = words.rows(result.get("findings"))
    for finding in findings:
        if len(findings) > 1:  # else the headline says it
            physics = str(finding.get("physics", ""))
            name = words.physics_name(physics, words.mapping(finding.get("parameters")))
            parts.append(f"finding   {name} {words.place_text(words.mapping(finding.get('location')), physics)}")
        parts.append(f"certainty {words.sure_text(finding, str(result.get('verdict', '')))}")
        unsure = words.is_unnamed(finding) or words.is_tentative(finding)
        if unsure and (nearest := words.considered_text(finding)):
            parts.append(f"          {nearest}")
        parts += [f"          {name} {value}" for name, value in words.how_much(finding)]
        location = words.mapping(finding.get("location"))
        also = location.get("also_possible") or ()
        span = words.span_text(location)
        if span:
            parts.append(f"          an area that {span} span")
        elif also:
            parts.append(f"          not told apart from {', '.join(words.nodes_text(place) for place in also)}")
            if sensor := words.sensor_text(location):
                parts.append(f"          {sensor}")
    updated = [
        f"{name} {factor_as_percent(factor)}"
        for name, entry in words.mapping(result.get("parameters")).items()
        if (factor := words.number(words.mapping(entry).get("factor"))) is not None
    ]
    if updated:
        parts.append(f"updated   {', '.join(updated)}")
    status = str(result.get("status") or "")
    if status not in ("", "converged"):
        told = words.status_text(status)
        parts.append(f"status    {status}{': ' if told else ''}{told}")
    fit = _fit_table(result)
    if fit:
        parts += ["", fit]
    parts += [f"{'' if i else chr(10)}warning   {text}" for i, text in enumerate(result.get("warnings") or ())]
    if result.get("advice"):
        parts += ["", f"advice    {result['advice']}"]
    return "\n".join(parts)


def _fit_table(result: Mapping[str, Any]) -> str:
    rows = [
        [str(r.get("recording", "")), str(r.get("role", ""))]
        + [ratio(words.number(r.get(key))) for key in ("noise_floor", "nominal", "parameters", "final")]
        for r in words.rows(result.get("fit"))
    ]
    header = ["recording", "role", "noise floor", "as given", "parameters", "final"]
    return table(header, rows, "llrrrr") if rows else ""
