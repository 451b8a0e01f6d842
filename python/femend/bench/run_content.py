"""The comparison of a rotor's runs on the page of a correlation, and as a table for a spreadsheet."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from femend.bench.page import Section, Table, figures, fixed, number, percent
from femend.bench.run_compared import ComparedRun
from femend.bench.steps import write_csv
from femend.report import plots
from femend.report.content import Picture
from femend.report.words import sentence

__all__ = ["run_section", "write_run_table"]

# lines of the map that are drawn: more are thinner than a pixel
DRAWN = 300
HEADER = ("peak", "1/min", "f test, Hz", "model", "f model, Hz", "Δf", "MAC", "likest at, Hz", "DAC", "CSAC", "CSF")


def run_section(c: ComparedRun, told: Mapping[str, Any]) -> Section:
    """A run's part of the page, from the comparison and its plain values `told`."""
    m, r = c.measured, told["response"]
    rows = [_row(p) for p in told["peaks"]]
    lone = frozenset(i for i, p in enumerate(told["peaks"]) if p["mode"] is None)
    held = "" if m.role == "fit" else ", held out (only ever scored)"
    words = (
        f"Order 1 of a run against its tacho{held}, {number(60 * m.freq[0])} to {number(60 * m.freq[-1])} 1/min, as it "
        f"would be at each speed held, at {len(m.dofs)} DOFs. Each peak of the operating shapes is compared with the "
        "model's modes; marked rows look like none."
    )
    tables = [Table(HEADER, rows, "rrrrrrrrrrr", lone, "Peaks")] if rows else []
    if r is not None:
        words += (
            " The model's response is that to unbalance at the bearings, with the sizes and phases under which it "
            "agrees best: nobody measured them, so that levels (CSF) say less than shapes (CSAC, DAC)."
        )
        bearings = [[str(b["node"]), number(b["m_r"]), number(b["phase_deg"])] for b in r["bearings"]]
        turns = f"Unbalance, turning {'with' if r['sense'] > 0 else 'against'} the right hand about {told['axis']}"
        tables.append(Table(("bearing", "m r", "phase, degrees"), bearings, "rrr", title=turns))
    return Section(
        f"{m.name}: {m.configuration}, run",
        words,
        tables,
        _pictures(c),
        notes=[*told["notes"], *([sentence(c.why)] if c.why else [])],
    )


def _row(p: Mapping[str, Any]) -> list[str]:
    likest = p.get("likest_response", {})
    return [
        str(p["peak"]),
        number(p["rpm"]),
        number(p["freq"]),
        "–" if p["mode"] is None else str(p["mode"]),
        number(p["model_freq"]),
        percent(p["freq_difference"]),
        fixed(p["mac"]),
        number(likest.get("freq")),
        fixed(likest.get("dac")),
        fixed(p.get("csac")),
        fixed(p.get("csf")),
    ]


def _pictures(c: ComparedRun) -> tuple[Picture, ...]:
    m, drawn = c.measured, []
    with plots.paper_style():
        if c.comparison is not None:
            shown = max(1, int(np.sum(c.modes.freq <= 1.3 * m.freq[-1])))
            pairs = [(p.a, p.b) for p in c.comparison.pairing.pairs if p.b < shown]
            made = plots.figure("column", 66)
            plots.draw_mac(
                made.axes[0], np.nan_to_num(c.comparison.mac[:, :shown]), m.peak_freq.tolist(),
                c.modes.freq[:shown].tolist(), pairs=pairs, name_a="peak of the run",
            )  # fmt: skip
            drawn.append((f"{m.name}: MAC of the shapes at the peaks and the model's modes, pairs framed", made))
        if c.response is not None:
            few = np.unique(np.linspace(0, m.freq.size - 1, min(DRAWN, m.freq.size)).round().astype(np.int64))
            made = plots.figure("column", 66)
            rpm = 60 * m.freq[few]
            plots.draw_dac(made.axes[0], np.nan_to_num(c.response.dac[np.ix_(few, few)]), rpm, rpm)
            drawn.append((f"{m.name}: DAC of the run and of the model's response to unbalance", made))
            made = plots.figure("page", 60)
            curves = {"CSAC (shape)": np.nan_to_num(c.response.csac), "CSF (level)": np.nan_to_num(c.response.csf)}
            plots.draw_signature(made.axes[0], m.freq, curves, criterion="CSAC, CSF")
            drawn.append((f"{m.name}: agreement with the response to unbalance line by line", made))
        return figures(drawn)


def write_run_table(folder: Path, runs: Sequence[Mapping[str, Any]]) -> list[str]:
    """The peaks of all `runs`, plain values, as CSV into `folder`; gives the name of the file, nothing without runs."""
    if not runs:
        return []
    rows = []
    for r in runs:
        for p in r["peaks"]:
            likest = p.get("likest_response", {})
            keys = ("peak", "rpm", "freq", "mode", "model_freq", "freq_difference", "mac", "noise")
            rows.append(
                [r["recording"], r["role"], *(p[k] for k in keys), likest.get("freq"), likest.get("dac"), p.get("csac"),
                 p.get("csf")]
            )  # fmt: skip
    header = ("recording", "role", "peak", "1/min", "f test Hz", "model mode", "f model Hz", "df", "MAC", "noise")
    write_csv(folder / "correlation.runs.csv", (*header, "likest at Hz", "DAC", "CSAC", "CSF"), rows)
    return ["correlation.runs.csv"]
