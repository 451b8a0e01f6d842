"""The comparison of a rotor's run as plain values: what correlation.json holds of it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from femend.bench.run_compared import ComparedRun, OperatingResponse

__all__ = ["run_advice", "run_result"]


def run_result(c: ComparedRun) -> dict[str, Any]:
    """One run: its peaks with the model's modes, and line by line with the model's response to unbalance."""
    m = c.measured
    return {
        "recording": m.name,
        "role": m.role,
        "configuration": m.configuration,
        "order": 1.0,
        "bearings": list(m.nodes),
        "axis": "XYZ"[m.axis],
        "dofs": [str(d) for d in m.dofs],
        "freq": m.freq.tolist(),
        "noise": m.noise.tolist(),
        "model_freq": c.modes.freq.tolist(),
        "peaks": [_peak(c, i) for i in range(m.peaks.size)],
        "mac": None if c.comparison is None else c.comparison.mac.tolist(),
        "notes": [] if c.comparison is None else list(c.comparison.table.notes),
        "response": None if c.response is None else _response(c.response, m.peaks.tolist()),
        "without_response": c.why,
    }


def run_advice(c: ComparedRun) -> str:
    """What to do about peaks that no mode of the model looks like; nothing where there are none."""
    lone = [f for i, f in enumerate(c.measured.peak_freq) if _mate(c, i) is None]
    if not lone:
        return ""
    listed = ", ".join(f"{f:.4g}" for f in lone)
    return (
        f"the operating shapes of {c.measured.name!r} at {listed} Hz look like no mode of the model: an operating "
        "shape mixes close modes; where the response to unbalance is unlike it too (DAC), look at supports and sensor "
        "directions"
    )


def _mate(c: ComparedRun, peak: int) -> Any:
    assert c.comparison is not None
    return next((r for r in c.comparison.table.rows if r.a == peak), None)


def _peak(c: ComparedRun, i: int) -> dict[str, Any]:
    """The peak `i`: where it is, which mode it looks like, and where the model's response is likest to it."""
    assert c.comparison is not None
    k = int(c.measured.peaks[i])
    freq, row = float(c.measured.peak_freq[i]), _mate(c, i)
    mac = np.nan_to_num(c.comparison.mac[i])
    found: dict[str, Any] = {
        "peak": i + 1,
        "freq": freq,
        "rpm": 60.0 * freq,
        "noise": float(c.measured.noise[k]),
        "mode": None if row is None else row.b + 1,
        "model_freq": None if row is None else row.freq_b,
        "freq_difference": None if row is None else row.freq_difference,
        "mac": float(mac.max(initial=0.0)) if row is None else row.mac,
    }
    if c.response is not None:
        there = c.response.likest(k)
        at, line = float(c.measured.freq[there]), float(c.measured.freq[k])
        found |= {
            "likest_response": {"freq": at, "freq_difference": at / line - 1, "dac": float(c.response.dac[k, there])},
            "csac": float(c.response.csac[k]),
            "csf": float(c.response.csf[k]),
        }
    return found


def _response(r: OperatingResponse, peaks: Sequence[int]) -> dict[str, Any]:
    """The response to unbalance; of the DAC the rows of the peaks, since all lines with all would be megabytes."""
    return {
        "unbalance": "chosen so that the responses agree best; nobody measured it",
        "sense": r.sense,
        "bearings": [
            {"node": n, "m_r": float(abs(u)), "phase_deg": float(np.degrees(np.angle(u)))}
            for n, u in zip(r.nodes, r.unbalance, strict=True)
        ],
        "csac": r.csac.tolist(),
        "csf": r.csf.tolist(),
        "mean_csac": float(np.nanmean(r.csac)),
        "mean_csf": float(np.nanmean(r.csf)),
        "dac_of_peaks": r.dac[peaks].tolist(),
    }
