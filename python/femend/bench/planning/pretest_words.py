"""The plan of a test on the terminal, from the same values as pretest.json."""

from __future__ import annotations

from typing import Any

from femend.bench.page import deviation, fixed, number, percent
from femend.bench.words import ends
from femend.report.text_table import table

__all__ = ["pretest_text"]


def pretest_text(result: dict[str, Any]) -> str:
    """A plan: targets, sensors, exciters, what the test would tell, and doubts."""
    targets = result["targets"]
    e = result["exciters"]
    parts = [
        f"{len(targets)} target modes from {number(targets[0]['freq'])} to {number(targets[-1]['freq'])} Hz",
        f"sensors   {' '.join(s['dof'] + ('*' if s['placed'] else '') for s in result['sensors'])}",
        f"          by {result['method']} among {result['places']} places; AutoMAC up to "
        f"{fixed(result['largest_off_diagonal'])} off the diagonal",
        f"exciters  {' '.join(c['dof'] for c in e['chosen'])}",
        "",
    ]
    rows = [
        [
            str(t["mode"]),
            number(t["freq"]),
            *(percent(m, 1, sign=False) for m in t["effective_mass"]),
            fixed(x),
            fixed(m),
        ]
        for t, x, m in zip(targets, e["relative_residue"], e["indicator"], strict=True)
    ]
    parts.append(table(["mode", "Hz", "mass X", "mass Y", "mass Z", "residue", "indicator"], rows, "rrrrrrr"))
    forecast = result.get("forecast")
    if forecast:
        rows = [
            [p["name"], deviation(p, "prior_sd"), deviation(p, "expected_sd"),
             "test" if p["determined"] else "prior"]
            for p in forecast["parameters"]
        ]  # fmt: skip
        parts += ["", table(["parameter", "prior sd", "expected", "told by"], rows, "lrrl")]
    if result.get("distinguish"):
        rows = [
            [d["truth"], d["rival"], fixed(d["detected"], 1), fixed(d["distance"], 1), "yes" if d["told"] else "no"]
            for d in result["distinguish"]
        ]
        parts += ["", table(["if there is", "taken for", "shown", "left by it", "told apart"], rows, "llrrl")]
    v = result["virtual_test"]
    if "modes" in v:
        parts += ["", f"virtual test: {v['found']} of {len(v['modes'])} modes found"]
        parts += [
            f"{p['name']}: true {p['truth']:.4f}, found {p['found']:.4f} ± {p['sd']:.4f}" for p in v["parameters"]
        ]
    return "\n".join([*parts, "", *ends(result)]).rstrip()
