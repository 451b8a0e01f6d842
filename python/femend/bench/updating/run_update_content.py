"""A rotor's runs in an update on the page, in the terminal and as a table for a spreadsheet."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from femend.bench.page import Fact, Section, Table, fixed, number, percent
from femend.bench.steps import write_csv
from femend.bench.updating.run_update_result import run_name
from femend.report.words import sentence

__all__ = ["run_facts", "run_lines", "run_sections", "write_run_update_table"]

SENSES = {1: "by the right hand about the shaft's axis", -1: "against it"}


def run_facts(runs: Sequence[dict[str, Any]]) -> list[Fact]:
    """How alike the model's response to the rotor is to the fitted runs, and to those held out."""
    facts = []
    for role, title, words in (
        ("fit", "Runs", "mean CSF over the lines of the runs that count"),
        ("validate", "Runs held out", "mean CSF over the lines of runs that had no part"),
    ):
        own = [r for r in runs if r["role"] == role and r["before"] and r["after"]]
        if own:
            b, a = (fixed(float(np.mean([r[k]["csf"] for r in own]))) for k in ("before", "after"))
            facts.append(Fact(title, f"{b} → {a}", words))
    return facts


def run_sections(runs: Sequence[dict[str, Any]]) -> list[Section]:
    """A section for every run: how alike it is before and after, and the forces that were found."""
    return [_section(r) for r in runs]


def _section(r: dict[str, Any]) -> Section:
    lead = "Held out: it had no part in the update."
    tables = []
    if "lines" in r:
        lead = (
            f"Used to fit on {len(r['lines'])} lines from {number(r['lines'][0], 4)} to {number(r['lines'][-1], 4)} "
            f"Hz; left on them, in deviations (rms): {number(r['left']['before'], 3)} → "
            f"{number(r['left']['after'], 3)}. {_forces_words(r)}"
        )
        tables.append(_bearings(r))
    elif r["role"] == "fit":
        lead = "It has no part in the update."
    if r["before"] and r["after"]:
        b, a = r["before"], r["after"]
        lead += (
            f" All lines, under forces chosen for each model: CSAC {fixed(b['csac'])} → {fixed(a['csac'])}, CSF "
            f"{fixed(b['csf'])} → {fixed(a['csf'])}."
        )
    why = r["without_response"]
    return Section(f"{run_name(r)}: {r['configuration']}, run", lead, tables, notes=[sentence(why)] if why else [])


def _forces_words(r: dict[str, Any]) -> str:
    if "forces" in r:
        return (
            f"Forces at the bearings were estimated with the parameters, growing as the speed^{r['power_of_speed']:g}."
        )
    words = f"The unbalance is {r['unbalance']}, turning {SENSES[r['sense']]}"
    if "against_it" in r:
        return f"{words}; what turns the other way is {percent(r['against_it'], 1, sign=False)} of it."
    return f"{words}."


def _bearings(r: dict[str, Any]) -> Table:
    if "forces" in r:
        rows = []
        for b in r["bearings"]:
            pairs = zip(b["force"], b["phase_deg"], strict=True)
            rows.append([str(b["node"]), *(f"{number(f, 3)} at {number(p, 3)}°" for f, p in pairs)])
        return Table(("node", "force along u, highest line", "along v"), rows, "rrr", title="Forces")
    rows = [[str(b["node"]), number(b["m_r"], 4), number(b["phase_deg"], 4)] for b in r["bearings"]]
    return Table(("node", "m r", "phase, °"), rows, "rrr", title="Unbalance")


def run_lines(runs: Sequence[dict[str, Any]]) -> list[str]:
    """A line a run for the terminal."""
    out = []
    for r in runs:
        used = f"{len(r['lines'])} lines used to fit" if "lines" in r else "held out" if r["role"] == "validate" else ""
        parts = [used or "no part"]
        if "left" in r:
            parts.append(f"left {number(r['left']['before'], 3)} -> {number(r['left']['after'], 3)} deviations (rms)")
        if r["before"] and r["after"]:
            parts.append(f"CSF {fixed(r['before']['csf'])} -> {fixed(r['after']['csf'])}")
        out.append(f"run       {run_name(r)}: {', '.join(parts)}")
    return out


def write_run_update_table(folder: Path, runs: Sequence[dict[str, Any]]) -> list[str]:
    """`updating.runs.csv` into `folder` where there are runs; gives the name of the file."""
    if not runs:
        return []
    rows = []
    for r in runs:
        left = r.get("left", {"before": "", "after": ""})
        pairs = [r[k][c] if r[k] else "" for c in ("csac", "csf") for k in ("before", "after")]
        lines = len(r.get("lines", ()))
        rows.append([r["recording"], r["role"], r["order"], lines, left["before"], left["after"], *pairs])
    header = (
        "recording", "role", "order", "lines", "left before", "left after", "CSAC before", "CSAC after", "CSF before",
        "CSF after",
    )  # fmt: skip
    write_csv(folder / "updating.runs.csv", header, rows)
    return ["updating.runs.csv"]
