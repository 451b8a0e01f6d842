"""An update on the terminal, from the same values as updating.json."""

from __future__ import annotations

from typing import Any

from femend.bench.page import fixed, number, percent
from femend.bench.reading.links import link_lines
from femend.bench.updating.field_result import field_lines
from femend.bench.updating.run_update_content import run_lines
from femend.bench.updating.strength import strength_lines
from femend.bench.words import ends
from femend.numerals import plain
from femend.report.text_table import table

__all__ = ["WIDER_SD", "update_text"]

# how deviations are called that allow for what an update leaves unmet
WIDER_SD = "sd with misfit"


def update_text(result: dict[str, Any]) -> str:
    """An update: status, parameters, modes before and after, and what to do."""
    cost = result["cost"]
    costs = f"cost {number(cost['before'])} -> {number(cost['after'])}"
    modes = result["modes"]
    if modes["counted"] < modes["measured"]:
        costs += f"; {modes['counted']} of {modes['measured']} measured modes count{'s' * (modes['counted'] == 1)}"
    parts = [f"{result['status']} after {result['iterations']} steps, {costs}", ""]
    rows = []
    wider = [WIDER_SD] if result["wider"] else []
    in_fields = {n for f in result["fields"] if f["property"] for n in f["parts"]}
    for name, p in result["parameters"].items():
        if name in in_fields:
            continue
        factor = p.get("factor")
        rows.append(
            [name, number(p["value"]) if factor is None else f"{factor:.4f}", number(p["sd"], 2),
             *[number(p["widened_sd"], 2) for _ in wider], number(p["prior_sd"], 2), fixed(p["moved_by_prior_sd"], 1),
             ("data" if p["determined"] else "prior") + (", at its limit" if p["at_bound"] else "")]
        )  # fmt: skip
    header = ["parameter", "value", "sd", *wider, "prior sd", "moved by", "told by"]
    parts += [table(header, rows, "lrr" + "r" * len(wider) + "rrl")] if rows else []
    parts += [*field_lines(result["fields"]), *link_lines(result["links"]), *strength_lines(result["regularisation"])]
    parts += _estimates(result)
    for r in result["recordings"]:
        used = "used to fit" if r["role"] == "fit" else "held out"
        used += f", without {', '.join(r['sensors_left_out'])}" if r["sensors_left_out"] else ""
        rows = [
            [str(m["mode"]), number(m["freq"]), number(m["freq_before"]), number(m["freq_after"]),
             percent(m["error_before"]), percent(m["error_after"]), fixed(m["mac_before"]), fixed(m["mac_after"])]
            for m in r["modes"]
        ]  # fmt: skip
        header = ["mode", "f test Hz", "before", "after", "error", "after", "MAC", "after"]
        parts += ["", f"{r['recording']} ({used}, {r['configuration']})", table(header, rows, "rrrrrrrr")]
    if result["runs"]:
        parts += ["", *run_lines(result["runs"])]
    return "\n".join([*parts, "", *ends(result)]).rstrip()


def _estimates(result: dict[str, Any]) -> list[str]:
    """The response surface, other starts and the drawn posterior, where there are any."""
    parts = []
    surface = result["response_surface"]
    if surface is not None:
        cost = surface["cost"]
        parts += [
            "",
            f"surface   {surface['points']} points, {plain(100 * surface['left_of_variance'], 2)} % of the variance "
            f"left; least point foretold {number(cost['foretold'])}, in the models {number(cost['there'])}, deck "
            f"{number(cost['deck'])}; begun {'there' if surface['begun_there'] else 'at the deck'}",
        ]
    starts, posterior = result["starts"], result["posterior"]
    if starts is not None:
        n = len(starts["minima"])
        others = f"{n} different ends" if n > 1 else "no other end"
        parts += ["", f"starts    {starts['end_there']} of {starts['starts']} end there; {others}"]
    if posterior is not None:
        rows = [
            [name, number(p["mean"], 5), number(p["sd"], 2), *(number(q, 5) for q in p["quantiles"].values()),
             fixed(p["sd_over_laplace"], 2)]
            for name, p in posterior["parameters"].items()
        ]  # fmt: skip
        header = ["posterior", "mean", "sd", "2.5 %", "50 %", "97.5 %", "sd / Laplace's"]
        evidence = f"ln evidence {posterior['log_evidence']:.2f} ± {posterior['log_evidence_se']:.2f}"
        laplace = result["log_evidence"]
        beside = "" if laplace is None or laplace != laplace else f", Laplace's {laplace:.2f}"
        parts += ["", table(header, rows, "lrrrrrr"), f"{posterior['draws']} draws, {evidence}{beside}"]
    return parts
