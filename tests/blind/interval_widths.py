#!/usr/bin/env python3
"""How much an estimate is off by beside what its noise explains:  interval_widths.py RESULTS SET [RESULTS SET ...]

Standard deviations in `result.json` are those of the noise and, in squares, a share of the value: one for the model's
parameters, one for a law's, and one for a law's whose place is not told from others. Of the findings with the right
name in all pairs of folders it prints which share of the intervals of 90 % would hold the truth with other shares.
"""

from __future__ import annotations

import json
import sys
from collections import defaultdict
from pathlib import Path
from typing import Any

import numpy as np
from scoring import Z90

from femend.study.result.findings import OFF_LAW, OPEN_PLACE
from femend.study.result.result import OFF_MODEL

SHARES = (0.0, 0.01, 0.015, 0.02, 0.03, 0.04, 0.06, 0.08, 0.1, 0.15, 0.2, 0.3, 0.4, 0.5)
NOW = {"model": OFF_MODEL, "law, place told": OFF_LAW, "law, place open": OPEN_PLACE}
# value, standard deviation, truth
Row = tuple[float, float, float]


def rows_of(result: dict[str, Any], truth: dict[str, Any]) -> list[tuple[str, Row]]:
    """What a case says of parameters whose true values are known; nothing without a right name."""
    found = []
    effects = truth.get("effects") or [truth]
    right = [(f, e) for e in effects for f in result["findings"] if f["physics"] == e["effect"]]
    if result["verdict"] != "missing-physics" or not right:
        return []
    for name, true in truth.get("E_factor", {}).items():
        told = result["parameters"].get(f"E_{name}", {})
        found.append(("model", (told.get("factor"), told.get("sd"), true)))
    for finding, effect in right:
        kind = "law, place open" if finding["location"].get("also_possible") else "law, place told"
        for name, true in effect["parameters"].items():
            told = finding["parameters"].get(name, {})
            found.append((kind, (told.get("value"), told.get("sd"), true)))
    return [(kind, row) for kind, row in found if all(isinstance(x, int | float) and x for x in row)]


def main() -> None:
    """Print a table."""
    rows: dict[str, list[Row]] = defaultdict(list)
    for results, cases in zip(sys.argv[1::2], sys.argv[2::2], strict=True):
        for file in sorted(Path(results).glob("b*/result.json")):
            truth = json.loads((Path(cases) / file.parent.name / "sealed" / "truth.json").read_text())
            for kind, row in rows_of(json.loads(file.read_text()), truth):
                rows[kind].append(row)
    print("share".ljust(28) + "".join(f"{share:8g}" for share in SHARES))
    for kind, share in NOW.items():
        value, sd, true = np.array(rows[kind]).reshape(-1, 3).T
        own = np.sqrt(np.maximum(sd**2 - (share * value) ** 2, 0.0))
        held = [np.mean(np.abs(value - true) <= Z90 * np.hypot(own, s * value)) for s in SHARES]
        now = np.mean(np.abs(value - true) <= Z90 * sd)
        print(f"{kind} ({len(value)}, now {100 * now:.1f} %)".ljust(28) + "".join(f"{100 * h:8.1f}" for h in held))


if __name__ == "__main__":
    main()
