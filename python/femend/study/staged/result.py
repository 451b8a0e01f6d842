"""result.json of a staged study."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from femend.diagnose.naming.calibration import CALIBRATION
from femend.diagnose.staged import Flow, Setup, Stage, StagedData, sensor_warnings
from femend.diagnose.staged.select import NOT_TOLD, Round
from femend.model.terms.linear_terms import LinearTerm
from femend.numerals import plain
from femend.report.mode_words import frequency_errors
from femend.study.doubts.priors import bounds_told, far_told
from femend.study.result.findings import alternatives
from femend.study.result.predictions import STAGES, Prediction
from femend.study.result.result import FORMAT
from femend.study.staged.doubts import clear_rival, places_left, runs_left
from femend.units import UnitSystem, unit_system

__all__ = ["staged_result"]

# directions in which the nodes that span an area lie farthest out
_DIAGONALS = np.array([[x, y, z] for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])
# a parameter this many prior deviations away is no update any more, nor does a stage that leaves this many times the
# noise and more than this share of its recording explain it
FAR, POOR = 5.0, 0.15
# and one that moved by less is where the deck has it
MOVED = 0.3
# share of a run that is noise from which it tells nothing
DROWNED = 0.5
# what a study calls the number of the tacho's pulses
PULSES = "pulses_per_revolution"
# a stiffness over speed is told at rest and at these shares of the highest speed
SHARES = (0.0, 0.25, 0.5, 0.75, 1.0)


def staged_result(
    setup: Setup,
    data: StagedData,
    final: Flow,
    predictions: list[Prediction],
    warnings: Sequence[str] = (),
) -> dict[str, Any]:
    """The content of result.json, with the stages and the loads beside what the contract asks for; `warnings` of the
    recordings' channels are told with those of the stages."""
    findings = [_finding(setup, final, term, decision) for term, decision in _by_weight(final)]
    findings += [_force_law(c, r) for c, r in final.runs if r.other_law]
    converged = all(s.posterior.converged for s in final.stages)
    verdict, advice = _verdict(setup, data, final, findings)
    noise = {s.recordings[0]: s.noise for s in final.stages if s.name == "FRFs" or s.run is not None}
    parameters = _parameters(setup, final)
    factors = {name: entry["factor"] for name, entry in parameters.items()}
    bounds = [*bounds_told(setup.free.parameters, factors), *far_told(setup.free.parameters, factors)]
    return {
        "format": FORMAT,
        "verdict": verdict,
        "findings": findings,
        "parameters": parameters,
        "fit": [_fit(p, noise) for p in predictions if p.recorded is not None],
        "status": "converged" if converged else "stalled",
        "advice": advice,
        "stages": [_stage(s) for s in final.stages],
        "modes": {c: _modes(setup, final, c) for c in setup.configurations},
        "loads": [_loads(setup, c, r) for c, r in final.runs],
        "warnings": [*warnings, *data.warnings, *sensor_warnings(setup, data, final), *bounds, *_moved(final)],
    }


def _moved(flow: Flow) -> list[str]:
    """Runs whose unbalance sits at another node than was told."""
    return [result.moved for _, result in flow.runs if result.moved]


def _by_weight(flow: Flow) -> list[tuple[LinearTerm, Round]]:
    """What explains most comes first: by the factor by which the squares of its stage fall with it."""

    def fall(item: tuple[LinearTerm, Round]) -> float:
        decision = item[1]
        assert decision.taken is not None
        own = sum(decision.taken.posterior.squares.values())
        without = [sum(r.posterior.squares.values()) for r in decision.rivals if r.term is None]
        return min([*without, decision.without]) / own

    return sorted(flow.named, key=fall, reverse=True)


def _verdict(setup: Setup, data: StagedData, flow: Flow, findings: list[dict[str, Any]]) -> tuple[str, str]:
    advice = "; ".join(filter(None, [flow.beside, *flow.unseen]))
    doubts = [result.doubt for _, result in flow.runs if result.doubt]
    if doubts:
        return "undetermined", "; ".join(filter(None, [*doubts, advice]))
    poor = [s for s in flow.stages if s.run is not None and s.unexplained > max(POOR, FAR * s.noise)]
    if poor:
        verdict = "located-not-named" if findings else "undetermined"
        return verdict, "; ".join(filter(None, [_unexplained(data, poor[0]), advice]))
    runs = {r.name for own in data.runs.values() for r in own}
    drowned = [s for s in flow.stages if s.run is not None and s.noise > DROWNED]
    if drowned and not findings and all(s.recordings[0] in runs for s in flow.stages):
        said = (
            f"{plain(100 * drowned[0].noise, 2)} % of {drowned[0].recordings[0]} is no response to the speeds it goes "
            "through (noise, or what rings on above them), so that it tells nothing of the model; record a longer run "
            "over more speeds, or some minutes of ambient vibration"
        )
        return "undetermined", "; ".join(filter(None, [said, advice]))
    if findings:
        worst = max((d.inflation for s in flow.stages for d in s.rounds), default=1.0)
        if worst > setup.settings.adequate:
            left = f"the best terms leave {plain(worst, 2)} times what noise and the form of the model explain"
            return "located-not-named", f"{left}; {advice}" if advice else left
        left = runs_left(flow, setup.settings)
        return "missing-physics", "; ".join(filter(None, [places_left(setup, flow), left, advice]))
    rival = clear_rival(flow, setup.settings)
    if rival:
        return "undetermined", "; ".join(filter(None, [rival, advice]))
    if not any(s.name == "FRFs" or s.run is not None for s in flow.stages):
        errors = frequency_errors({"stages": [_stage(s) for s in flow.stages]})
        if errors is not None and errors.unlike:
            said = (
                f"the model as updated is not that of these modes: {errors.text}; check supports, sensors' nodes and "
                "directions, and units (`femend correlate` shows mode by mode), then what the parameters and their "
                "priors leave free; a hammer or shaker test with its force would tell more"
            )
            return "undetermined", "; ".join(filter(None, [said, advice]))
    posterior = flow.posterior
    moved = []
    for parameter in setup.free.parameters:
        i = posterior.unknowns.index(parameter.name)
        moved.append(abs(posterior.p[i]) / parameter.prior_sd)
    advice = "; ".join(filter(None, [runs_left(flow, setup.settings), advice]))
    if max(moved, default=0.0) > FAR:
        return "located-not-named", advice
    return ("parameters-only" if max(moved, default=0.0) > MOVED else "consistent"), advice


def _unexplained(data: StagedData, stage: Stage) -> str:
    """What stays unexplained of a run, and what may be why."""
    name, runs = stage.recordings[0], {r.name for own in data.runs.values() for r in own}
    said = f"{plain(100 * stage.unexplained, 2)} % of {name} stays unexplained"
    if any(text.startswith(f"recording {name!r}: ") and PULSES in text for text in data.warnings):
        return f"{said}; first correct {PULSES} of its [recording.rotating] (see the warnings) and run again"
    causes = (
        f"check {PULSES}, axis and nodes of its [recording.rotating], and the units and directions of the sensors; if "
        "they are right,"
    )
    ambient = any(m.name not in runs for m in data.output_only.get(stage.configuration, []))
    if ambient:
        return f"{said}, though ambient vibration was recorded: {causes} what is missing is none of what was tried"
    return f"{said}: {causes} record some minutes of ambient vibration in the same configuration"


def _finding(setup: Setup, flow: Flow, term: LinearTerm, decision: Round) -> dict[str, Any]:
    system = unit_system(setup.free.units)
    said: dict[str, float] = {}
    for rival in decision.rivals:
        name = rival.physics or "nothing"
        said[name] = said.get(name, 0.0) + rival.probability
    # the probability of a name is that of all its places, also of those not told apart
    probability = said.pop(term.physics, 0.0)
    location = _location(setup, term)
    location["also_possible"] += _elsewhere(decision, term)
    return {
        "physics": term.physics,
        "probability": round(min(probability, CALIBRATION.surest), 3),
        "location": location,
        "parameters": _over_speed(setup, flow, term, system) or _values(setup, flow, term, system),
        "alternatives": alternatives(said),
        "configurations": list(term.configurations) or list(setup.configurations),
    }


def _elsewhere(decision: Round, term: LinearTerm) -> list[list[int]]:
    """Nodes of the same physics at other places that the recordings do not tell from the one taken."""
    if decision.taken is None:
        return []
    near = [r for r in decision.rivals if r.term is not None and decision.taken.score - r.score < NOT_TOLD]
    places = [list(r.term.nodes) for r in near if r.term is not None and r.physics == term.physics]
    return [nodes for nodes in places if nodes != list(term.nodes)]


def _force_law(configuration: str, result: Any) -> dict[str, Any]:
    """Bearing forces that grow with another power of the speed than unbalances do."""
    law, simple = result.laws["power"], result.laws["unbalance"]
    odds = float(np.exp(np.clip(simple.log_evidence - law.log_evidence, -700.0, 0.0)))
    return {
        "physics": "unbalance_law",
        "probability": round(min(1.0 / (1.0 + odds), CALIBRATION.surest), 3),
        "location": {"nodes": list(result.unbalance.nodes), "to": "", "direction": "", "also_possible": []},
        "parameters": {"exponent": {"value": _round(law.exponent), "sd": _round(law.sd), "unit": ""}},
        "alternatives": alternatives({"nothing": odds / (1.0 + odds)}),
        "configurations": [configuration],
    }


def _location(setup: Setup, term: LinearTerm) -> dict[str, Any]:
    """The place. Of an area: the nodes at its centre, where one spring in place of the layer would stand; beside them
    those that span it, and all of it as `region`."""
    where: dict[str, Any] = {"nodes": list(term.nodes), "to": term.to, "direction": term.direction, "also_possible": []}
    region = next((r for rs in setup.regions.values() for r in rs if r.nodes == term.nodes), None)
    if term.area <= 0.0 or region is None:
        return where
    at = setup.free.xyz_of
    xyz = np.array([at[n] for n in region.nodes])
    centre = region.areas @ xyz / region.area
    apart = np.linalg.norm(xyz - centre, axis=1)
    nearest = np.flatnonzero(apart <= apart.min() * (1 + 1e-6) + 1e-12)[:2]
    corners = sorted({int(np.argmax(xyz @ d)) for d in _DIAGONALS})
    where["nodes"] = [region.nodes[i] for i in nearest]
    where["also_possible"] = [[region.nodes[i] for i in corners]]
    where["region"] = list(region.nodes)
    return where


def _values(setup: Setup, flow: Flow, term: LinearTerm, system: UnitSystem) -> dict[str, Any]:
    """Values with deviations: estimated ones and that for the form of the model; totals beside those per area."""
    posterior, form = flow.posterior, setup.settings.form
    values, deviations = posterior.values, posterior.sd
    found: dict[str, Any] = {}
    for u in term.unknowns:
        if u.name not in posterior.unknowns.names:
            continue
        i = posterior.unknowns.index(u.name)
        name = u.name.split(": ")[-1].split(" [")[0]
        sd = float(np.hypot(deviations[i], form * values[i]))
        found[name] = {"value": _round(values[i]), "sd": _round(sd), "unit": unit_text(u.unit, system)}
        if u.unit.endswith("/area"):
            total = u.unit.removesuffix("/area")
            found[f"{name}_total"] = {
                "value": _round(values[i] * term.area),
                "sd": _round(sd * term.area),
                "unit": unit_text(total, system),
            }
    return found


def _over_speed(setup: Setup, flow: Flow, term: LinearTerm, system: UnitSystem) -> dict[str, Any]:
    """A stiffness over speed at a few speeds, "k at 10.4 rev/s" or as a factor on the deck's; nothing of other terms.

    Of springs with one stiffness the study's parameter that updates it is in the values.
    """
    if term.physics != "speed_stiffness":
        return {}
    posterior, form = flow.posterior, setup.settings.form
    u, C = posterior.unknowns, posterior.covariance
    at = [u.index(own.name) for own in term.unknowns]
    base = term.base_parameter(setup.free.parameters) if term.size is not None else None
    found: dict[str, Any] = {}
    for share in SHARES:
        slopes = np.zeros(len(u))
        slopes[at] = [u.items[i].scale * share ** (n + 1) for n, i in enumerate(at)]
        factor = float(slopes @ posterior.p) + (1.0 if base is None else float(posterior.values[u.index(base)]))
        if base is not None:
            slopes[u.index(base)] = posterior.values[u.index(base)]
        sd = float(np.hypot(np.sqrt(slopes @ C @ slopes), form * factor))
        size, unit = (1.0, "") if term.size is None else (term.size, unit_text("k", system))
        name = f"{'factor' if term.size is None else 'k'} at {plain(share * term.reference / (2 * np.pi), 3)} rev/s"
        found[name] = {"value": _round(size * factor), "sd": _round(size * sd), "unit": unit}
    return found


def unit_text(unit: str, system: UnitSystem) -> str:
    """How the unit of an unknown is written in a unit system."""
    F, L, m = system.force_text, system.length_text, system.mass_text
    return {
        "k": f"{F}/{L}", "k/area": f"{F}/{L}^3", "k_rot": f"{F}*{L}/rad", "c": f"{F}*s/{L}", "c/area": f"{F}*s/{L}^3",
        "c_rot": f"{F}*{L}*s/rad", "coupling": f"{F}/rad", "m": m, "m_r": f"{m}*{L}", "Ip": f"{m}*{L}^2",
    }.get(unit, unit)  # fmt: skip


def _parameters(setup: Setup, flow: Flow) -> dict[str, Any]:
    posterior = flow.posterior
    found = {}
    for parameter in setup.free.parameters:
        i = posterior.unknowns.index(parameter.name)
        sd = float(np.hypot(posterior.sd[i], setup.settings.form * posterior.values[i]))
        found[parameter.name] = {"factor": _round(posterior.values[i]), "sd": _round(sd)}
    return found


def _fit(prediction: Prediction, noise: dict[str, float]) -> dict[str, Any]:
    row: dict[str, Any] = {
        "recording": prediction.name, "role": prediction.role, "noise_floor": _round(noise.get(prediction.name)),
    }  # fmt: skip
    row.update({stage: _round(prediction.error(stage)) for stage in STAGES})
    return row


def _modes(setup: Setup, flow: Flow, configuration: str) -> list[dict[str, Any]]:
    """Frequencies (Hz) and damping ratios of the final model in a configuration, up to the band's end."""
    posterior = flow.in_configuration(configuration)
    model = setup.model(configuration, posterior.unknowns, flow.terms)
    lam, _ = model.damped_modes(posterior.p)
    inside = lam[np.abs(lam) < 2 * np.pi * setup.f_max]
    return [{"freq": _round(float(abs(x)) / (2 * np.pi)), "zeta": _round(float(-x.real / abs(x)))} for x in inside]


def _stage(stage: Any) -> dict[str, Any]:
    own = {
        "stage": stage.name,
        "configuration": stage.configuration,
        "recordings": list(stage.recordings),
        "unexplained": _round(stage.unexplained),
        "noise": _round(stage.noise),
        "remarks": list(stage.remarks),
    }
    if stage.table:
        own["modes"] = [
            dict(zip(("freq", "zeta", "model_freq", "model_zeta", "mac", "freq_sd"), map(_round, row), strict=True))
            for row in stage.table
        ]
    return own


def _loads(setup: Setup, configuration: str, result: Any) -> dict[str, Any]:
    system = unit_system(setup.free.units)
    U, phase = result.unbalances()
    return {
        "recording": result.data.name,
        "configuration": configuration,
        "nodes": list(result.unbalance.nodes),
        "axis": "XYZ"[result.unbalance.axis],
        "sense": result.unbalance.sense,
        "unbalance": [_round(float(u)) for u in U],
        "unit": unit_text("m_r", system),
        "phase_deg": [round(float(np.degrees(a)), 2) for a in phase],
        "power": _round(result.data.power[0]),
        "exponent": _round(result.exponent[0]),
        "exponent_sd": _round(result.exponent[1]),
        "reliable_hz": [_round(float(f)) for f in _ends(result.after.freq[result.after.reliable])],
        "correlation": {"value": _round(result.correlation[0]), "with": result.correlation[1]},
        "laws": _laws(result.laws),
        "data": _data(result.choice),
    }


def _data(choice: Any) -> list[dict[str, Any]] | None:
    """Sensors and bands with what they tell, and why one was left out."""
    if choice is None:
        return None
    return [
        {
            "sensor": part.pair.split(" / ")[0],
            "band_hz": [_round(f) for f in part.band],
            "information": _round(part.information),
            "gain": _round(part.gain),
            "noise": _round(part.noise),
            "likeness": _round(part.likeness),
            "left_out": part.reason or None,
        }
        for part in choice.parts
    ]


def _laws(laws: Any) -> dict[str, Any] | None:
    """The rivals of the unbalance's law, best first, and which one is named."""
    if laws is None:
        return None
    rows = [
        {
            "law": law.name,
            "exponent": _round(law.exponent),
            "sd": _round(law.sd) if law.name == "power" else None,
            "log_evidence": _round(law.log_evidence),
            "unseen_sensors": _round(law.unseen),
            "unseen_lines": _round(law.unseen_lines),
        }
        for law in laws.laws
    ]
    return {"named": laws.best, "reason": laws.reason, "rivals": rows}


def _ends(freq: Any) -> list[float]:
    return [float(freq.min()), float(freq.max())] if len(freq) else []


def _round(value: float | None) -> float | None:
    return None if value is None or not np.isfinite(value) else float(f"{value:.5g}")
