"""The comparison of a rotor's run as plain values: what correlation.json holds of it."""

from __future__ import annotations

from typing import Any

import numpy as np

from femend.bench.correlation.amplitudes import amplitude_rows
from femend.bench.reading.run_compared import ComparedRun, OperatingResponse
from femend.bench.reading.runs import in_order
from femend.numerals import plain

__all__ = ["run_advice", "run_result"]


def run_result(c: ComparedRun) -> dict[str, Any]:
    """One run: its peaks with the model's modes, and line by line with the model's response to unbalance."""
    m = c.measured
    return {
        "recording": m.name,
        "role": m.role,
        "configuration": m.configuration,
        "order": m.order,
        "bearings": list(m.nodes),
        "axis": "XYZ"[m.axis],
        "dofs": [str(d) for d in m.dofs],
        "freq": m.freq.tolist(),
        "noise": m.noise.tolist(),
        "model_freq": c.modes.freq.tolist(),
        "peaks": [_peak(c, i) for i in range(m.peaks.size)],
        "held": [_held(c, k) for k in range(len(m.held))],
        "mac": None if c.comparison is None else c.comparison.mac.tolist(),
        "notes": [] if c.comparison is None else list(c.comparison.table.notes),
        "response": None if c.response is None else _response(c.response, c),
        "without_response": c.why,
    }


def run_advice(c: ComparedRun) -> str:
    """What to do about peaks that no mode of the model looks like; nothing where there are none."""
    lone = [f for i, f in enumerate(c.measured.peak_freq) if _mate(c, i) is None]
    if not lone:
        return ""
    listed = ", ".join(plain(f) for f in lone)
    who = f"{c.measured.name!r}{in_order(c.measured.order)}"
    return (
        f"the operating shapes of {who} at {listed} Hz look like no mode of the model: an operating "
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
        "rpm": 60.0 * freq / c.measured.order,
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


def _held(c: ComparedRun, k: int) -> dict[str, Any]:
    """The recording at a held speed on line `k`."""
    m, r = c.measured, c.response
    return {
        "recording": m.held[k],
        "freq": float(m.freq[k]),
        "rpm": 60.0 * float(m.freq[k]) / m.order,
        "noise": float(m.noise[k]),
        "csac": None if r is None else float(r.csac[k]),
        "csf": None if r is None else float(r.csf[k]),
    }


def _response(r: OperatingResponse, c: ComparedRun) -> dict[str, Any]:
    """The response to forces at the bearings; of the DAC the rows of the peaks, since all lines with all would be
    megabytes."""
    return {
        **_loads(r),
        "csac": r.csac.tolist(),
        "csf": r.csf.tolist(),
        "mean_csac": float(np.nanmean(r.csac)),
        "mean_csf": float(np.nanmean(r.csf)),
        "dac_of_peaks": r.dac[c.measured.peaks].tolist(),
        **_levels(r, c),
    }


def _levels(r: OperatingResponse, c: ComparedRun) -> dict[str, Any]:
    """Accelerations, where the unbalance is known and levels say something."""
    if not r.known:
        return {}
    return {
        "level": r.level.tolist(),
        "phase_deg": np.degrees(r.phase).tolist(),
        "mean_level": float(np.exp(np.mean(np.log(np.maximum(r.level, 1e-300))))),
        "mean_phase_deg": float(np.degrees(np.angle(np.exp(1j * r.phase).mean()))),
        "amplitudes": amplitude_rows(c),
    }


def _loads(r: OperatingResponse) -> dict[str, Any]:
    """The unbalance of order 1, or the forces of another one."""
    known, chosen = "as the study gives it", "chosen so that the responses agree best; nobody measured it"
    if r.forces is None:
        bearings = [
            {"node": n, "m_r": float(abs(u)), "phase_deg": float(np.degrees(np.angle(u)))}
            for n, u in zip(r.nodes, r.unbalance, strict=True)
        ]
        return {"unbalance": known if r.known else chosen, "sense": r.sense, "bearings": bearings}
    forces = [
        {"node": n, "force": np.abs(f).tolist(), "phase_deg": np.degrees(np.angle(f)).tolist()}
        for n, f in zip(r.nodes, r.forces, strict=True)
    ]
    return {"forces": chosen, "power_of_speed": r.power, "bearings": forces}
