"""What the commands say on the terminal, from the same values as their JSON files."""

from __future__ import annotations

from typing import Any

from femend.bench.field_result import field_lines
from femend.bench.links import link_lines
from femend.bench.page import deviation, fixed, number, percent
from femend.bench.run_update_content import run_lines
from femend.bench.runs import in_order
from femend.bench.strength import strength_lines
from femend.numerals import plain
from femend.report.text_table import table

__all__ = ["WIDER_SD", "correlation_text", "pretest_text", "update_text"]

# how deviations are called that allow for what an update leaves unmet
WIDER_SD = "sd with misfit"


def correlation_text(result: dict[str, Any]) -> str:
    """A correlation: each recording's mode table, what is doubtful, and what to do."""
    parts = []
    for r in result["recordings"]:
        s = r["summary"]
        parts.append(
            f"{r['recording']} ({r['role']}, {r['configuration']}): {s['paired']} of {s['measured']} modes {r['from']} "
            "are paired"
        )
        rows = [
            [str(m["a"] + 1), str(m["b"] + 1), number(m["freq_a"]), number(m["freq_b"]), percent(m["freq_difference"]),
             percent(m["zeta_a"], sign=False), fixed(m["mac"])]
            for m in r["modes"]["rows"]
        ]  # fmt: skip
        rows += [[str(k + 1), "-", number(f), "-", "-", "-", "-"] for k, f in r["modes"]["alone_a"]]
        parts.append(table(["test", "model", "f test Hz", "f model Hz", "df", "damping", "MAC"], rows, "rrrrrrr"))
        if "frfs" in r:
            parts.append(f"FRFs: mean CSAC {fixed(r['frfs']['mean_csac'])}, CSF {fixed(r['frfs']['mean_csf'])}")
        if r["where_wrong"] is not None:
            parts.append(r["where_wrong"]["said"])
        parts.append("")
    for r in result["runs"]:
        parts += _run(r)
    return "\n".join([*parts, *_ends(result)]).rstrip()


def _run(r: dict[str, Any]) -> list[str]:
    """A rotor's run, its peaks with the modes, or its held speeds; and the response to forces at the bearings."""
    order = in_order(r["order"])
    who = f"{r['recording']} ({r['role']}, {r['configuration']})"
    if r["held"]:
        said = [f"{who}: operating shapes at {len(r['held'])} held speed{'s' * (len(r['held']) > 1)}{order}"]
        rows = [
            [h["recording"], number(h["rpm"]), number(h["freq"]), percent(h["noise"], sign=False), fixed(h["csac"]),
             fixed(h["csf"])]
            for h in r["held"]
        ]  # fmt: skip
        said.append(table(["recording", "1/min", "f Hz", "noise", "CSAC", "CSF"], rows, "lrrrrr"))
    else:
        mates = sum(p["mode"] is not None for p in r["peaks"])
        said = [f"{who}: {mates} of {len(r['peaks'])} peaks of the run's operating shapes{order} look like a mode"]
    rows = [
        [str(p["peak"]), number(p["rpm"]), number(p["freq"]), "-" if p["mode"] is None else str(p["mode"]),
         number(p["model_freq"]), percent(p["freq_difference"]), fixed(p["mac"]),
         fixed(p.get("likest_response", {}).get("dac")), number(p.get("likest_response", {}).get("freq"))]
        for p in r["peaks"]
    ]  # fmt: skip
    if rows:
        header = ["peak", "1/min", "f test Hz", "model", "f model Hz", "df", "MAC", "DAC", "at Hz"]
        said.append(table(header, rows, "rrrrrrrrr"))
    if r["response"] is not None:
        csac, csf = fixed(r["response"]["mean_csac"]), fixed(r["response"]["mean_csf"])
        loads = "unbalance" if "forces" not in r["response"] else "forces"
        if "level" in r["response"]:
            level = fixed(r["response"]["mean_level"])
            said.append(f"response to the unbalance given: {level} of the test's level, mean CSAC {csac}, CSF {csf}")
        else:
            said.append(f"response to {loads} at the bearings: mean CSAC {csac}, CSF {csf}")
    return [*said, ""]


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
        rows = [
            [str(m["mode"]), number(m["freq"]), number(m["freq_before"]), number(m["freq_after"]),
             percent(m["error_before"]), percent(m["error_after"]), fixed(m["mac_before"]), fixed(m["mac_after"])]
            for m in r["modes"]
        ]  # fmt: skip
        header = ["mode", "f test Hz", "before", "after", "error", "after", "MAC", "after"]
        parts += ["", f"{r['recording']} ({used}, {r['configuration']})", table(header, rows, "rrrrrrrr")]
    if result["runs"]:
        parts += ["", *run_lines(result["runs"])]
    return "\n".join([*parts, "", *_ends(result)]).rstrip()


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
    return "\n".join([*parts, "", *_ends(result)]).rstrip()


def _ends(result: dict[str, Any]) -> list[str]:
    """Warnings and advice."""
    said = [f"warning   {w}" for w in result["warnings"]]
    return [*said, f"advice    {result['advice']}"] if result["advice"] else said
