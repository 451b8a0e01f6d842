"""The plan of a test as plain values: what pretest.json holds."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from femend.correlate import automac
from femend.dof import Dof
from femend.model import Model
from femend.model.sensor_frames import basic_direction, planned_frames
from femend.numerals import plain
from femend.pretest import VirtualTest, suspension_points
from femend.pretest.exciters import RESIDUE_MIN
from femend.study.file.study import Study

if TYPE_CHECKING:
    from femend.bench.planning.pretest_run import Plan

__all__ = ["FORMAT", "largest_off_diagonal", "pretest_result"]

FORMAT = "femend-pretest/1"
# above this AutoMAC two modes are hard to tell apart at the sensors
ALIKE = 0.3
# a frequency that the sensors' mass moves by more than this is another one
SHIFT = 0.005
RANKED, HUNG = 10, 4


def pretest_result(
    study: Study, model: Model, plan: Plan, virtual: VirtualTest | None, note: str, told: Sequence[str]
) -> dict[str, Any]:
    """The content of pretest.json; `note` says why there is no virtual test where there is none."""
    rows = plan.placement.rows
    phi = plan.targets.shapes(plan.places)
    mac = automac(phi[rows])
    first = plan.targets.rigid
    found: dict[str, Any] = {
        "format": FORMAT,
        "title": study.title,
        "configuration": study.pretest.configuration or "as modelled",
        "targets": [
            {
                "mode": int(i) - first + 1,
                "freq": float(plan.targets.modes.freq[i]),
                "effective_mass": list(plan.targets.table.rows[i].mass),
            }
            for i in plan.targets.at
        ],
        "effective_mass_of_targets": np.sum(
            [plan.targets.table.rows[i].mass for i in plan.targets.at], axis=0
        ).tolist(),
        "places": len(plan.places),
        "method": plan.placement.method,
        "sensors": [_sensor(d, model, d in study.pretest.placed) for d in plan.sensors],
        "automac": mac.tolist(),
        "largest_off_diagonal": largest_off_diagonal(mac),
        "largest_off_diagonal_of_all_places": largest_off_diagonal(automac(phi)),
        "methods": {
            name: _measures(plan, phi, p.rows)
            for name, p in ((plan.placement.method, plan.placement), *plan.others.items())
        },
        "exciters": _exciters(plan, model),
        "free": first > 0,
    }
    if first > 0:
        found["suspension"] = [str(plan.places[i]) for i in suspension_points(phi, min(HUNG, len(plan.places)))]
    if plan.loading is not None:
        found["mass_loading"] = {
            "mass": study.pretest.sensor_mass,
            "shift": plan.loading.shift[plan.targets.at].tolist(),
        }
    units = {m.name: m.unit for m in model.morphs}  # amplitudes, which are no shares
    if plan.planned is not None:
        found["forecast"] = {
            "variance_left": plan.planned.variance_left(rows),
            "parameters": [
                {**f._asdict(), **({"unit": units[f.name]} if f.name in units else {})}
                for f in plan.planned.forecast(rows)
            ],
            "not_told_apart": [list(c.names) for c in plan.planned.collinear(rows)],
        }
    if plan.explanations is not None:
        found["distinguish"] = plan.explanations.as_list()
    found["virtual_test"] = {"note": note} if virtual is None else _virtual(virtual)
    frames = planned_frames((*plan.sensors, *plan.exciters), model)
    found["warnings"] = [*told, *frames, *_unrehearsed(study, virtual, note)]
    found["advice"] = _advice(found, plan)
    return found


def _unrehearsed(study: Study, virtual: VirtualTest | None, note: str) -> list[str]:
    """Why a virtual test that was asked for was not done."""
    return [f"no virtual test: {note}"] if virtual is None and study.pretest.virtual_test else []


def largest_off_diagonal(mac: ArrayLike) -> float:
    """The largest value of a MAC matrix `mac` (n, n) off its diagonal, 0 for a single mode.

    >>> largest_off_diagonal([[1.0, 0.2], [0.2, 1.0]])
    0.2
    """
    table = np.array(mac, dtype=np.float64)
    np.fill_diagonal(table, 0.0)
    return float(np.nanmax(table, initial=0.0))


def _sensor(dof: Dof, model: Model, placed: bool) -> dict[str, Any]:
    return {
        "dof": str(dof),
        "node": dof.node,
        "direction": dof.direction,
        "xyz": model.xyz[model.index(dof.node)].tolist(),
        "basic": basic_direction(dof, model).tolist(),
        "placed": placed,
    }


def _measures(plan: Plan, phi: np.ndarray, rows: np.ndarray) -> dict[str, Any]:
    sign, logdet = np.linalg.slogdet(phi[rows].T @ phi[rows])
    return {
        "sensors": [str(plan.places[int(i)]) for i in rows],
        "largest_off_diagonal": largest_off_diagonal(automac(phi[rows])),
        "ln_det": float(logdet) if sign > 0 else float("-inf"),
        "variance_left": None if plan.planned is None else plan.planned.variance_left(rows),
    }


def _exciters(plan: Plan, model: Model) -> dict[str, Any]:
    least = plan.residues.min(axis=1)
    order = np.argsort(-least, kind="stable")[:RANKED]
    return {
        "chosen": [_sensor(d, model, False) for d in plan.exciters],
        "indicator": plan.driven.indicator.tolist(),
        "relative_residue": plan.driven.excitation.tolist(),
        "ranking": [
            {"dof": str(plan.drives[i]), "least_relative_residue": float(least[i]),
             "weakest_mode": int(plan.targets.at[int(np.argmin(plan.residues[i]))]) - plan.targets.rigid + 1}
            for i in order
        ],
    }  # fmt: skip


def _virtual(v: VirtualTest) -> dict[str, Any]:
    freq = v.identified.modes.freq
    mates = {p.a: p for p in v.pairing.pairs}
    return {
        "note": v.note,
        "found": len(v.found),
        "modes": [
            {"freq": float(f), "identified": float(freq[mates[i].b]) if i in mates else None,
             "mac": mates[i].mac if i in mates else None}
            for i, f in enumerate(v.modes.freq)
        ],
        "missed": [float(v.modes.freq[i]) for i in v.missed],
        "parameters": [
            {"name": r.name, "truth": t, "found": r.value, "sd": r.sd, "within_three_sd": ok}
            for r, t, ok in v.parameters()
        ],
    }  # fmt: skip


def _advice(found: dict[str, Any], plan: Plan) -> str:
    said = []
    if found["largest_off_diagonal"] > ALIKE:
        said.append(
            f"two target modes look alike at these sensors (AutoMAC {found['largest_off_diagonal']:.2f}; all "
            f"{found['places']} places together: {found['largest_off_diagonal_of_all_places']:.2f}): take more "
            "sensors, more places, or another method"
        )
    weak = [
        t["mode"]
        for t, r in zip(found["targets"], found["exciters"]["relative_residue"], strict=True)
        if r < RESIDUE_MIN
    ]
    if weak:
        said.append(
            f"the exciters hardly drive mode {', '.join(str(w) for w in weak)}: allow other places or directions, "
            "or one more exciter"
        )
    hidden = [
        t["mode"] for t, m in zip(found["targets"], found["exciters"]["indicator"], strict=True)
        if m > 0.5 and t["mode"] not in weak
    ]  # fmt: skip
    if hidden:
        said.append(f"mode {', '.join(str(h) for h in hidden)} hides behind neighbours with these exciters")
    shifts = found.get("mass_loading", {}).get("shift", ())
    heavy = [t["mode"] for t, x in zip(found["targets"], shifts, strict=False) if abs(x) > SHIFT]
    if heavy:
        said.append(
            f"the sensors' mass moves mode {', '.join(str(h) for h in heavy)} by up to "
            f"{100 * max(map(abs, shifts)):.1f} %: put it into the model (added_mass), or take lighter ones"
        )
    forecast = found.get("forecast")
    if forecast:
        open_ones = [p["name"] for p in forecast["parameters"] if not p["determined"]]
        if open_ones:
            said.append(f"the test would leave {', '.join(open_ones)} where the prior has them")
        for group in forecast["not_told_apart"]:
            said.append(f"it would tell only a combination of {' and '.join(group)}")
    said += [] if plan.explanations is None else plan.explanations.advice()
    missed = found["virtual_test"].get("missed")
    if missed:
        said.append(f"the virtual test missed modes at {', '.join(plain(f) for f in missed)} Hz")
    said += _misled(found)
    return "; ".join(said)


def _misled(found: dict[str, Any]) -> list[str]:
    """That an update from a test like this would end at wrong values and think itself sure of them."""
    wrong = [p for p in found["virtual_test"].get("parameters", ()) if not p["within_three_sd"]]
    if not wrong:
        return []
    each = ", ".join(
        f"{p['name']} {plain(p['found'], 4)} ± {plain(p['sd'], 2)} where the structure has {plain(p['truth'], 4)}"
        for p in wrong
    )
    alike = found["largest_off_diagonal"] > ALIKE
    why = (
        "modes that look alike at these sensors are taken for each other" if alike else "the update starts too far off"
    )
    mend = "take sensors that tell them apart" if alike else "start it several times ([updating] starts)"
    return [f"an update from this test would come out wrong and not show it ({each}): {why}; {mend}"]
