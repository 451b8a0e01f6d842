"""A rotor's runs in an update as plain values: what updating.json holds of them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from femend.bench.reading.run_compared import ComparedRun
from femend.bench.reading.runs import in_order
from femend.bench.updating.counted_runs import CountedRun
from femend.estimate.updating import OrderDifferences, State, UpdateResult

__all__ = ["run_name", "runs_result"]


def runs_result(
    counted: Sequence[CountedRun],
    found: UpdateResult,
    before: Sequence[ComparedRun],
    after: Sequence[ComparedRun],
) -> list[dict[str, Any]]:
    """Every run compared before and after; those `counted`, whose configurations are the last of the problem, with
    their lines, what is left on them, and the forces that suit best.

    `csac`, `csf` are means over all lines of the run, under forces chosen anew for each model (`compare_run`).
    """
    first = len(found.problem.configurations) - len(counted)
    places = {(c.measured.name, c.measured.order): first + i for i, c in enumerate(counted)}
    out = []
    for b, a in zip(before, after, strict=True):
        m = b.measured
        told: dict[str, Any] = {
            "recording": m.name,
            "role": m.role,
            "configuration": m.configuration,
            "order": m.order,
            "without_response": b.why or a.why,
            "before": _agreement(b),
            "after": _agreement(a),
        }
        at = places.get((m.name, m.order))
        if at is not None:
            run = counted[at - first]
            response = found.problem.configurations[at].responses[0]
            assert isinstance(response, OrderDifferences)
            told |= {
                "lines": run.shapes.freq.tolist(),
                "left": {
                    when: _left(response, e.states[at])
                    for when, e in (("before", found.before), ("after", found.after))
                },
                **_forces(run, response, found.after.states[at]),
            }
        out.append(told)
    return out


def _agreement(c: ComparedRun) -> dict[str, float] | None:
    if c.response is None:
        return None
    return {"csac": float(np.nanmean(c.response.csac)), "csf": float(np.nanmean(c.response.csf))}


def _left(response: OrderDifferences, state: State) -> float:
    """Root mean square of what is left, in deviations."""
    compared = response.compare(state, None, False)
    return float(np.sqrt((compared.residual**2).sum() / max(compared.residual.size - compared.taken, 1)))


def _forces(run: CountedRun, response: OrderDifferences, state: State) -> dict[str, Any]:
    """The unbalance of order 1, in the sense in which more of it turns where neither is known, or the forces of another
    order."""
    m = run.measured
    if response.unbalance is not None:
        return {"unbalance": "as the study gives it", "sense": run.sense, "bearings": _turning(run, response.unbalance)}
    u, _ = response.found(state)
    if m.order != 1.0:
        top = (2 * np.pi * float(response.speed.max())) ** run.power
        forces = [
            {"node": n, "force": np.abs(f).tolist(), "phase_deg": np.degrees(np.angle(f)).tolist()}
            for n, f in zip(run.nodes, top * u.reshape(-1, 2), strict=True)
        ]
        return {"forces": "estimated", "power_of_speed": run.power, "bearings": forces}
    if run.sense:
        return {"unbalance": "estimated", "sense": run.sense, "bearings": _turning(run, u)}
    pairs = u.reshape(-1, 2)
    either = {sense: 0.5 * (pairs[:, 0] + 1j * sense * pairs[:, 1]) for sense in (1, -1)}
    size = {sense: float(np.linalg.norm(part)) for sense, part in either.items()}
    sense = max(size, key=lambda s: size[s])
    return {
        "unbalance": "estimated",
        "sense": sense,
        "against_it": size[-sense] / max(size[sense], 1e-300),
        "bearings": _turning(run, either[sense]),
    }


def _turning(run: CountedRun, u: np.ndarray) -> list[dict[str, Any]]:
    return [
        {"node": n, "m_r": float(abs(x)), "phase_deg": float(np.degrees(np.angle(x)))}
        for n, x in zip(run.nodes, u, strict=True)
    ]


def run_name(run: dict[str, Any]) -> str:
    """A run of the result as it is told of."""
    return f"{run['recording']}{in_order(run['order'])}"
