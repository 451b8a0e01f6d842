"""What an update found of a study's fields, as plain values and in words."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from femend.bench.reading.fields import field_members, neighbours
from femend.estimate.updating import UpdateResult
from femend.model import Model
from femend.numerals import plain
from femend.study.file.study import Study

__all__ = ["field_lines", "fields_result", "grouped", "made_for_fields"]

# fewer parts of a field than this are named one by one
FEW = 4


def fields_result(study: Study, model: Model, found: UpdateResult) -> list[dict[str, Any]]:
    """What updating.json holds of each field: its parts with their factors, the least and the largest of them, by how
    much neighbours differ (rms), and of how many parts the data tell more than half."""
    told, sd = set(found.determined()), found.sd
    out = []
    for s in study.updating.field:
        members = [n for n in field_members(model.deck, s) if n in found.values]
        value = {n: found.values[n] for n in members}
        pairs = [(a, b) for a, b in neighbours(model, s) if a in value and b in value]
        steps = np.array([value[a] - value[b] for a, b in pairs])
        ends = {end: {"part": n, "factor": value[n], "sd": sd[n]} for end, n in _ends(value).items()}
        out.append(
            {
                "name": s.name,
                "property": s.property,
                "parts": value,
                "neighbours": [list(pair) for pair in pairs],
                "neighbour_sd": s.neighbour_sd,
                "neighbours_differ": float(np.sqrt(np.mean(steps**2))) if len(steps) else 0.0,
                "determined": sum(n in told for n in members),
                **ends,
            }
        )
    return out


def _ends(value: Mapping[str, float]) -> dict[str, str]:
    return {"least": min(value, key=value.__getitem__), "largest": max(value, key=value.__getitem__)} if value else {}


def made_for_fields(study: Study, model: Model) -> dict[str, str]:
    """Names of parameters that stand in no [[parameter]] but are parts of a field, with the field's name."""
    return {n: s.name for s in study.updating.field if not s.parameters for n in field_members(model.deck, s)}


def grouped(names: Iterable[str], field_of: Mapping[str, str]) -> list[str]:
    """The `names` as they are said: parts of one field together, where they are several."""
    names = list(names)
    of: dict[str, list[str]] = {}
    for n in names:
        if n in field_of:
            of.setdefault(field_of[n], []).append(n)
    long = {field for field, own in of.items() if len(own) >= FEW}
    said = [f"{len(of[f])} parts of {f}" for f in of if f in long]
    return [n for n in names if field_of.get(n) not in long] + said


def field_lines(fields: Sequence[Mapping[str, Any]]) -> list[str]:
    """A line for each field on the terminal."""
    out = []
    for f in fields:
        least, largest = f["least"], f["largest"]
        out.append(
            f"field     {f['name']}: {len(f['parts'])} parts from {plain(least['factor'])} ± {plain(least['sd'], 2)} "
            f"({least['part']}) to {plain(largest['factor'])} ± {plain(largest['sd'], 2)} ({largest['part']}); "
            f"neighbours differ by {plain(100 * f['neighbours_differ'], 2)} % (rms), "
            f"{plain(100 * f['neighbour_sd'], 2)} % allowed for; the data tell {f['determined']}"
        )
    return out
