"""A correlation as plain values: what correlation.json holds."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from femend.analysis.tam import TamTable
from femend.bench.correlation.orthogonal import orthogonality_result
from femend.bench.correlation.run_result import run_advice, run_result
from femend.bench.correlation.weighed import weighed
from femend.bench.correlation.where_wrong import WhereWrong, where_wrong_result
from femend.bench.doubting.doubted import (
    MEND_FIRST,
    TIME_FIRST,
    at_one_dof,
    doubted_levels,
    doubted_sensors,
    doubted_times,
)
from femend.bench.doubting.doubted_faint import faint_shapes
from femend.bench.doubting.doubted_frames import with_frames_settled
from femend.bench.doubting.doubted_frequencies import FREQUENCIES_FIRST, doubted_frequencies, far_pairs
from femend.bench.doubting.doubted_solver import beyond_the_solver
from femend.bench.doubting.doubted_twice import doubted_twice, twins, without_twins
from femend.bench.reading.compared import Compared
from femend.bench.reading.measured import MeasuredModes
from femend.bench.reading.placed import Placed
from femend.bench.reading.run_compared import ComparedRun

if TYPE_CHECKING:
    from femend.bench.reading.prepared import Prepared

__all__ = ["FORMAT", "comparison_result", "correlation_result", "placed_result"]

FORMAT = "femend-correlation/1"


def correlation_result(
    prepared: Prepared,
    compared: Sequence[Compared],
    tams: Sequence[TamTable | None],
    wrong: Sequence[WhereWrong | None],
    runs: Sequence[ComparedRun] = (),
) -> dict[str, Any]:
    """The content of correlation.json; `tams` are the orthogonalities of what is `compared`, `wrong` says where the
    deck is by each, `runs` are those of a rotor."""
    faults, times = doubted_sensors(compared), doubted_times(prepared, compared, runs)
    factors = doubted_frequencies(compared)
    first = "; ".join([*([TIME_FIRST] if times else []), *([FREQUENCIES_FIRST] if factors else [])])
    told = with_frames_settled(prepared, compared, prepared.warnings)
    of_sensors = [*at_one_dof(compared), *faults, *doubted_levels(compared)]
    of_modes = [
        *beyond_the_solver(prepared, compared),
        *far_pairs(compared),
        *doubted_twice(compared),
        *faint_shapes(compared),
    ]
    warnings = [*told, *times, *factors, *of_modes, *of_sensors]
    return {
        "format": FORMAT,
        "title": prepared.study.title,
        "model": weighed(prepared.model) if prepared.solver is None else None,
        "solver": None if prepared.solver is None else prepared.solver.as_dict(),
        "sensors": placed_result(prepared.placed),
        "recordings": [
            {
                **comparison_result(c),
                "orthogonality": orthogonality_result(t),
                "where_wrong": where_wrong_result(w),
            }
            for c, t, w in zip(compared, tams, wrong, strict=True)
        ],
        "runs": [run_result(r) for r in runs],
        "warnings": [*warnings, *(r.why for r in runs if r.why)],
        "advice": "; ".join(filter(None, [first, _advice(compared, faults), *(run_advice(r) for r in runs)])),
    }


def placed_result(placed: Placed) -> dict[str, Any]:
    """Sensors and their DOFs, and what the alignment of the geometries found."""
    found: dict[str, Any] = placed.pairing.to_dict()
    if placed.alignment is not None:
        a = placed.alignment
        found["alignment"] = {
            "scale": a.scale,
            "R": a.R.tolist(),
            "offset": a.offset.tolist(),
            "rms_distance": float(np.sqrt(np.mean(a.distance**2))),
            "left_handed": a.mirrored,
            "other_turns_that_fit": a.alike,
            "applied": placed.applied,
            "notes": list(a.notes),
        }
    return found


def comparison_result(c: Compared) -> dict[str, Any]:
    """One recording's tables."""
    found = {
        **_about(c.measured),
        "summary": c.summary(),
        "model_freq": c.modes.freq.tolist(),
        "modes": c.comparison.table.to_dict(),
        "mac": c.comparison.mac.tolist(),
        "automac": c.automac.tolist(),
        "dofs": [str(d) for d in c.dofs],
        "comac": None if c.comac is None else c.comac.tolist(),
        "ecomac": None if c.ecomac is None else c.ecomac.tolist(),
        "macco": None if c.macco is None else c.macco.tolist(),
        "sensor_faults": [
            {"kind": f.kind, "sensors": list(f.names), "before": f.before, "after": f.after} for f in c.faults
        ],
    }
    if c.frfs is not None:
        m = c.frfs.matched
        found["frfs"] = {
            "kind": m.kind,
            "unit": m.unit,
            "freq": m.freq.tolist(),
            "csac": c.frfs.csac.tolist(),
            "csf": c.frfs.csf.tolist(),
            "outputs": [str(d) for d in m.outputs],
            "inputs": [str(d) for d in m.inputs],
            "frac": c.frfs.frac.tolist(),
            "faac": c.frfs.faac.tolist(),
            "mean_csac": float(np.nanmean(c.frfs.csac)),
            "mean_csf": float(np.nanmean(c.frfs.csf)),
        }
    return found


def _about(m: MeasuredModes) -> dict[str, Any]:
    freq_sd, zeta_sd = m.modes.freq_sd, m.modes.zeta_sd
    return {
        "recording": m.name,
        "role": m.role,
        "configuration": m.configuration,
        "from": m.how,
        "measured": {
            "freq": m.modes.freq.tolist(),
            "freq_sd": None if freq_sd is None else freq_sd.tolist(),
            "zeta": m.modes.zeta.tolist(),
            "zeta_sd": None if zeta_sd is None else zeta_sd.tolist(),
            "mpc": None if m.test is None else m.test.mpc.tolist(),
        },
    }


def _advice(compared: Sequence[Compared], faults: Sequence[str]) -> str:
    said = []
    if faults:
        said.append(MEND_FIRST)
    n, of = sum(c.n_test - c.n_pairs - len(twins(c)) for c in compared), sum(c.n_test for c in compared)
    if n:
        said.append(
            f"{n} of {of} measured modes have no mate in the model: look at the MAC matrix, at sensor directions and "
            "at the supports"
        )
    off = {c.measured.name: _largest_off(without_twins(c)) for c in compared}
    alike = [name for name, x in off.items() if x > 0.8]
    if alike:
        said.append(
            f"modes of {', '.join(map(repr, alike))} look alike at these sensors (AutoMAC up to "
            f"{max(off.values()):.2f}): `femend pretest` proposes places that tell them apart"
        )
    return "; ".join(said)


def _largest_off(matrix: np.ndarray) -> float:
    return float(np.nanmax(np.where(np.eye(len(matrix), dtype=bool), 0.0, matrix), initial=0.0))
