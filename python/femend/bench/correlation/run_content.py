"""The comparison of a rotor's runs on the page of a correlation, and as a table for a spreadsheet."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from femend.bench.correlation.amplitudes import amplitude_table
from femend.bench.page import Section, Table, figures, fixed, number, percent
from femend.bench.reading.run_compared import ComparedRun
from femend.bench.reading.runs import in_order
from femend.bench.steps import write_csv
from femend.report import plots
from femend.report.content import Picture
from femend.report.numbers import pretty_unit
from femend.report.words import sentence
from femend.units import UnitSystem

__all__ = ["run_section", "write_run_table"]

# lines of the map that are drawn: more are thinner than a pixel
DRAWN = 300
HEADER = ("peak", "1/min", "f test, Hz", "model", "f model, Hz", "Δf", "MAC", "likest at, Hz", "DAC", "CSAC", "CSF")


HELD_HEADER = ("recording", "1/min", "f, Hz", "noise", "CSAC", "CSF")


def run_section(c: ComparedRun, told: Mapping[str, Any], units: UnitSystem) -> Section:
    """A run's part of the page, or that of recordings at held speeds, from the comparison and its plain values
    `told`, which are in the model's `units`."""
    m, r = c.measured, told["response"]
    lone = frozenset(i for i, p in enumerate(told["peaks"]) if p["mode"] is None)
    tables = []
    if told["peaks"]:
        tables.append(Table(HEADER, [_row(p) for p in told["peaks"]], "rrrrrrrrrrr", lone, "Peaks"))
    if told["held"]:
        rows = [
            [h["recording"], number(h["rpm"]), number(h["freq"]), percent(h["noise"], sign=False), fixed(h["csac"]),
             fixed(h["csf"])]
            for h in told["held"]
        ]  # fmt: skip
        tables.append(Table(HELD_HEADER, rows, "lrrrrr", title="Held speeds"))
    words = _held_words(c) if m.held else _run_words(c)
    if r is not None:
        words += _response_words(told)
        tables.append(_loads(r, told, units))
        if r.get("amplitudes"):
            tables.append(amplitude_table(r["amplitudes"], units))
    return Section(
        f"{m.name}: {m.configuration}, {'held speeds' if m.held else 'run'}{in_order(m.order)}",
        words,
        tables,
        _pictures(c),
        notes=[*told["notes"], *([sentence(c.why)] if c.why else [])],
    )


def _run_words(c: ComparedRun) -> str:
    m = c.measured
    held = "" if m.role == "fit" else ", held out (only ever scored)"
    rpm = 60 * m.freq / m.order
    return (
        f"Order {m.order:g} of a run against its tacho{held}, {number(rpm[0])} to {number(rpm[-1])} 1/min, as it "
        f"would be at each speed held, at {len(m.dofs)} DOFs. Each peak of the operating shapes is compared with the "
        "model's modes; marked rows look like none."
    )


def _held_words(c: ComparedRun) -> str:
    m = c.measured
    out = "" if m.role == "fit" else ", held out (only ever scored)"
    return (
        f"Order {m.order:g} of recordings at held speeds against the tacho{out}, at {len(m.dofs)} DOFs. Each is the "
        "mean over stretches of whole revolutions, whose scatter is the noise."
    )


def _response_words(told: Mapping[str, Any]) -> str:
    if "level" in told["response"]:
        return (
            " The model's response is that to the unbalance which the study gives, so that its levels (CSF, model / "
            "test) and phases are the model's own."
        )
    if told["order"] == 1.0:
        return (
            " The model's response is that to unbalance at the bearings, with the sizes and phases under which it "
            "agrees best: nobody measured them, so that levels (CSF) say less than shapes (CSAC, DAC)."
        )
    return (
        " The model's response is that to forces across the shaft at the bearings, each component free, with the sizes "
        "and phases and the power of the speed under which it agrees best: nobody measured them, so that levels (CSF) "
        "say less than shapes (CSAC, DAC)."
    )


def _loads(r: Mapping[str, Any], told: Mapping[str, Any], units: UnitSystem) -> Table:
    if "forces" not in r:
        bearings = [[str(b["node"]), number(b["m_r"]), number(b["phase_deg"])] for b in r["bearings"]]
        turns = f"Unbalance, turning {'with' if r['sense'] > 0 else 'against'} the right hand about {told['axis']}"
        mass = units.text("mass")
        unit = f"{mass}*{units.text('length')}" if "/" not in mass else f"{units.text('force')}*s^2"
        product = f"m r, {pretty_unit(unit)}"
        return Table(("node" if "level" in r else "bearing", product, "phase, degrees"), bearings, "rrr", title=turns)
    after = "XYZ".index(told["axis"])
    across = ["XYZ"[(after + i) % 3] for i in (1, 2)]
    rows = [
        [str(b["node"]), direction, number(force), number(phase)]
        for b in r["bearings"]
        for direction, force, phase in zip(across, b["force"], b["phase_deg"], strict=True)
    ]
    title = f"Forces at the highest speed, growing with its power {r['power_of_speed']:g}"
    return Table(("bearing", "direction", f"force, {units.text('force')}", "phase, degrees"), rows, "rlrr", title=title)


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
        if c.response is not None and not m.held:
            few = np.unique(np.linspace(0, m.freq.size - 1, min(DRAWN, m.freq.size)).round().astype(np.int64))
            made = plots.figure("column", 66)
            rpm = 60 * m.freq[few] / m.order
            plots.draw_dac(made.axes[0], np.nan_to_num(c.response.dac[np.ix_(few, few)]), rpm, rpm)
            drawn.append((f"{m.name}: DAC of the run and of the model's response to unbalance", made))
            made = plots.figure("page", 60)
            curves = {"CSAC (shape)": np.nan_to_num(c.response.csac), "CSF (level)": np.nan_to_num(c.response.csf)}
            plots.draw_signature(made.axes[0], m.freq, curves, criterion="CSAC, CSF")
            drawn.append((f"{m.name}: agreement with the response to unbalance line by line", made))
        return figures(drawn)


def write_run_table(folder: Path, runs: Sequence[Mapping[str, Any]]) -> list[str]:
    """The peaks of all `runs` and the speeds held, plain values, as CSV into `folder`; gives the names of the files,
    nothing without runs."""
    if not runs:
        return []
    rows, held = [], []
    for r in runs:
        for p in r["peaks"]:
            likest = p.get("likest_response", {})
            keys = ("peak", "rpm", "freq", "mode", "model_freq", "freq_difference", "mac", "noise")
            rows.append(
                [r["recording"], r["role"], r["order"], *(p[k] for k in keys), likest.get("freq"), likest.get("dac"),
                 p.get("csac"), p.get("csf")]
            )  # fmt: skip
        for h in r["held"]:
            held.append(
                [h["recording"], r["role"], r["order"], *(h[k] for k in ("rpm", "freq", "noise", "csac", "csf"))]
            )
    header = ("recording", "role", "order", "peak", "1/min", "f test Hz", "model mode", "f model Hz", "df", "MAC")
    write_csv(folder / "correlation.runs.csv", (*header, "noise", "likest at Hz", "DAC", "CSAC", "CSF"), rows)
    if not held:
        return ["correlation.runs.csv"]
    own = ("recording", "role", "order", "1/min", "f Hz", "noise", "CSAC", "CSF")
    write_csv(folder / "correlation.held.csv", own, held)
    return ["correlation.runs.csv", "correlation.held.csv"]
