"""A correlation on the terminal, from the same values as correlation.json."""

from __future__ import annotations

from typing import Any

from femend.bench.page import fixed, number, percent
from femend.bench.reading.runs import in_order
from femend.bench.words import ends
from femend.numerals import listed
from femend.report.text_table import table

__all__ = ["correlation_text"]

# modes of the model without a mate that are named
ALONE = 6


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
        parts += _alone(r["modes"])
        if "frfs" in r:
            parts.append(f"FRFs: mean CSAC {fixed(r['frfs']['mean_csac'])}, CSF {fixed(r['frfs']['mean_csf'])}")
        if r["where_wrong"] is not None:
            parts.append(r["where_wrong"]["said"])
        parts.append("")
    for r in result["runs"]:
        parts += _run(r)
    return "\n".join([*parts, *ends(result)]).rstrip()


def _alone(modes: dict[str, Any]) -> list[str]:
    """The model's modes up to the highest measured one that have no mate: the test did not see them."""
    top = max([m["freq_a"] for m in modes["rows"]] + [f for _, f in modes["alone_a"]], default=0.0)
    lone = [f"{k + 1} ({number(f)} Hz)" for k, f in modes["alone_b"] if f <= top]
    return [f"modes of the model up to there without a mate: {listed(lone, ALONE)}"] if lone else []


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
            turned = r["response"]["mean_phase_deg"]
            phase = f"{abs(turned):.0f}° {'ahead of' if turned > 0 else 'behind'} it"
            said.append(
                f"response to the unbalance given: {level} of the test's level and {phase}, mean CSAC {csac}, CSF {csf}"
            )
        else:
            said.append(f"response to {loads} at the bearings: mean CSAC {csac}, CSF {csf}")
    return [*said, ""]
