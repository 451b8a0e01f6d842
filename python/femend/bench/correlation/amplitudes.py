"""Levels of a run where its unbalance is known: accelerations of test and model, at peaks and at held speeds."""

from __future__ import annotations

from typing import Any

import numpy as np

from femend.bench.page import Table, fixed, number
from femend.bench.reading.run_compared import ComparedRun
from femend.report.numbers import pretty_unit
from femend.units import UnitSystem

__all__ = ["amplitude_rows", "amplitude_table"]


def amplitude_rows(c: ComparedRun) -> list[dict[str, Any]]:
    """At every peak, or every held speed, the sensor that moves most, its acceleration in the test and in the model
    (the model's unit of length over s^2), and over all sensors the `level` of the model, its length over the test's,
    and its `phase_deg` against it; with peaks the level where the model's response is likest, too. Nothing where the
    unbalance is not known."""
    m, r = c.measured, c.response
    if r is None or not r.known:
        return []
    lines = range(m.freq.size) if m.held else m.peaks.tolist()
    rows = []
    for k in lines:
        course = (2 * np.pi * float(m.freq[k])) ** 2
        i = int(np.argmax(np.abs(m.shapes[k])))
        row: dict[str, Any] = {
            "freq": float(m.freq[k]),
            "rpm": 60.0 * float(m.freq[k]) / m.order,
            "sensor": str(m.dofs[i]),
            "test": course * float(np.abs(m.shapes[k, i])),
            "model": course * float(np.abs(r.shapes[k, i])),
            "level": float(r.level[k]),
            "phase_deg": float(np.degrees(r.phase[k])),
        }
        if not m.held:
            there = r.likest(k)
            size = np.linalg.norm(r.shapes[there]) / np.linalg.norm(m.shapes[k])
            row["level_likest"] = float(size * (m.freq[there] / m.freq[k]) ** 2)
        rows.append(row)
    return rows


def amplitude_table(rows: list[dict[str, Any]], units: UnitSystem) -> Table:
    """The rows of `amplitude_rows` for the page, in the model's `units`."""
    unit = pretty_unit(units.text("acceleration"))
    header = ("1/min", "sensor", f"test, {unit}", f"model, {unit}", "model / test", "where likest", "phase, degrees")
    shown = [
        [number(a["rpm"]), a["sensor"], number(a["test"]), number(a["model"]), fixed(a["level"]),
         fixed(a.get("level_likest")), number(a["phase_deg"])]
        for a in rows
    ]  # fmt: skip
    return Table(header, shown, "rlrrrrr", title="Accelerations at the sensor that moves most, and over all sensors")
