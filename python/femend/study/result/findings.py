"""The findings of result.json: what is missing, where, how much, and what is as likely."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from femend.diagnose import Diagnosis
from femend.diagnose.fitting.candidates import Candidate, standard_deviations
from femend.diagnose.loads.loads import LoadFinding
from femend.diagnose.locating.locate import Located
from femend.diagnose.locating.next_sensor import next_sensor
from femend.diagnose.naming.calibration import CALIBRATION
from femend.diagnose.naming.ranked import Ranked, tempered
from femend.dof import Dof
from femend.model import Place
from femend.model.places.places import Topology, stretches, topology
from femend.physics import CATALOGUE, FitCoordinates, companion_jacobian, physics, with_companion
from femend.report.vocabulary import DIRECTIONS
from femend.study.result.open_place import answers_elsewhere, over_places
from femend.study.result.told import told
from femend.units import UnitSystem, unit_system

__all__ = ["ALSO", "alternatives", "findings", "law_words", "rounded"]

# places that are said to be possible too
ALSO = 5
# directions (unit vectors) that have less than this in common are at right angles
ROUND_OFF = 1e-6
# laws that are listed beside the named one, and from which probability on
ALTERNATIVES, LEAST = 5, 0.001
# what estimates of a law's parameters are off by beside what noise explains, relative, and those of one whose place is
# not told from others at least; set on generated cases for 90 % intervals that hold nine of ten (`interval_widths.py`
# of tests/blind on sets 86, 153 to 155, 157 and 158)
OFF_LAW, OPEN_PLACE = 0.06, 0.3


def findings(diagnosis: Diagnosis) -> list[dict[str, Any]]:
    """The findings of a `diagnosis`: a load, one name, or one of each effect; none where the verdict has none."""
    if diagnosis.load is not None and diagnosis.by_load:
        return [_load_finding(diagnosis, diagnosis.load)]
    if diagnosis.place is None or diagnosis.verdict not in ("missing-physics", "located-not-named"):
        return []
    if diagnosis.further is not None:
        return [
            _finding(diagnosis, term.located, term.candidate, _by_name(ranked, tempered(ranked)))
            for term, ranked in zip(diagnosis.further.terms.terms, diagnosis.further.laws, strict=True)
        ]
    probabilities = _by_name(diagnosis.ranked, diagnosis.probabilities)
    return [_finding(diagnosis, diagnosis.place, diagnosis.best, probabilities)]


def _load_finding(diagnosis: Diagnosis, load: LoadFinding) -> dict[str, Any]:
    """A force or a motion of the base that was not recorded, or not as it was."""
    alike = [] if diagnosis.place is None else _not_told_apart(diagnosis, diagnosis.place)[0][:ALSO]
    location = {
        "nodes": list(load.nodes),
        "to": "ground" if load.physics == "base_motion" else "",
        "direction": load.direction.lstrip("+-"),
        "also_possible": alike if load.physics == "unmeasured_force" else [],
    }
    values = {
        name: {"value": rounded(v) if isinstance(v, float) else v, "sd": None, "unit": _load_unit(diagnosis, unit)}
        for name, (v, unit) in load.values.items()
    }
    others = _load_alternatives(diagnosis, load)
    found = {
        "physics": load.physics,
        "probability": round(CALIBRATION.surest - sum(others.values()), 3),
        "location": location,
        "parameters": values,
        "alternatives": alternatives(others),
        "configurations": ["as modelled"],
    }
    return {**found, "recorded": _recorded(diagnosis)} if load.physics == "load_misplaced" else found


def _recorded(diagnosis: Diagnosis) -> list[dict[str, Any]]:
    """Nodes and directions at which the force was recorded, each once."""
    nodes = diagnosis.reduced.model.node_ids
    rows = [zip(r.in_rows.tolist(), r.in_signs.tolist(), strict=True) for r in diagnosis.problem.records]
    dofs = dict.fromkeys(Dof(int(nodes[row // 6]), row % 6 + 1, int(sign)) for of_it in rows for row, sign in of_it)
    return [{"node": dof.node, "direction": dof.direction} for dof in dofs]


def _load_alternatives(diagnosis: Diagnosis, load: LoadFinding) -> dict[str, float]:
    """A motion of the base in place of a force that nobody recorded, or the other way round, with its probability,
    where sensors hardly tell them apart: by what either leaves, free on every line."""
    kinds = {"unmeasured_force": ("ground", "base"), "base_motion": ("base", "ground")}
    if load.physics not in kinds or load.force is not None:
        return {}
    costs = [
        min((f.cost for f in diagnosis.located if f.place.kind == kind), default=np.inf) for kind in kinds[load.physics]
    ]
    behind = costs[1] - costs[0]
    if not behind <= diagnosis.settings.margin:
        return {}
    other = next(name for name in kinds if name != load.physics)
    return {other: CALIBRATION.surest / (1 + float(np.exp(0.5 * behind)))}


def _finding(
    diagnosis: Diagnosis, place: Located, best: Candidate | None, probabilities: dict[str, float]
) -> dict[str, Any]:
    """One name (or none) at one place, with the laws that are as likely; of those tried in vain what is left of being
    sure that it is none of them. Of the likeliest law of a run that was stopped nothing is sure."""
    read = None if diagnosis.read is None else diagnosis.read.law
    name = best.name if best is not None else read.name if read is not None else ""
    named: float | None = probabilities.pop(name, 0.0)
    if best is not None and diagnosis.interrupted and diagnosis.verdict == "located-not-named":
        named, probabilities = None, {}
    if read is not None:  # simulations, by which probabilities are told, could not follow it
        named, probabilities = None, {}
    if best is None or diagnosis.rival is not None:
        probabilities = {law: p * (1.0 - CALIBRATION.surest) for law, p in probabilities.items()}
    others, rivals = _not_told_apart(diagnosis, place)
    where = _location(diagnosis, place, others, rivals)
    answers = answers_elsewhere(diagnosis, place.place, rivals) if others else None
    found = {
        **law_words(name),
        "probability": None if named is None else round(named, 3),
        "location": where,
        "parameters": _told_parameters(diagnosis, best, answers),
        "alternatives": alternatives(probabilities),
        "configurations": ["as modelled"],
    }
    found = {**found, "as_read": True} if read is not None else found
    return found if diagnosis.rival is None else {**found, "class": ", ".join(diagnosis.rival.labels)}


def _load_unit(diagnosis: Diagnosis, quantity: str) -> str:
    """Unit of a load's parameter in the deck's system; frequencies are Hz in all of them."""
    system = unit_system(diagnosis.reduced.model.units)
    written = {"force": system.force_text, "acceleration": f"{system.length_text}/s^2"}
    return written.get(quantity, quantity)


def _by_name(laws: Sequence[Ranked], probabilities: Sequence[float]) -> dict[str, float]:
    total: dict[str, float] = {}
    for ranked, p in zip(laws, probabilities, strict=True):
        name = ranked.name or ranked.candidate.name
        total[name] = total.get(name, 0.0) + p
    return total


def _along(nodes: tuple[int, ...], single: list[int], top: Topology) -> list[int]:
    """Those of the nodes `single` that a stretch stands for."""
    return [node for node in single if stretches(top, [*nodes, node]) == [nodes]]


def _not_told_apart(diagnosis: Diagnosis, place: Located) -> tuple[list[list[int]], list[Place]]:
    """Places that the recordings cannot tell from one, by their nodes, and those of them that are no beddings:
    look-alikes, first where the model suggests that something is attached, then places that fit as well."""
    top = topology(diagnosis.reduced.model)
    like = [p for p in place.alike if p.direction == place.place.direction and p.kind == place.place.kind]
    single = [p.nodes[0] for p in like if len(p.nodes) == 1]
    group = {node: nodes for nodes in stretches(top, single) for node in _along(nodes, single, top)}
    others: list[list[int]] = []
    rivals: list[Place] = []
    # with several effects the places of one alone are no measure, and more free forces fit more by themselves
    close = [
        found.place
        for found in (diagnosis.located if diagnosis.further is None else ())
        if found.cost - place.cost < diagnosis.settings.margin
        and found.place.kind != "base"
        and found.place.n_w <= max(place.place.n_w, 1)
    ]
    beds = [] if diagnosis.further is not None else _beddings(diagnosis, place)
    covered = set(place.place.nodes)
    for other in (*beds, *sorted(place.alike, key=lambda p: p.unlikely), *close):
        nodes = group.get(other.nodes[0], other.nodes) if other in like else other.nodes
        several = other.kind in ("pair", "bed") and set(nodes) != set(place.place.nodes)
        # what acts between two nodes may act on one of them from the ground
        several |= (place.place.kind, other.kind) == ("pair", "ground") and _moves_with(place.place, other)
        if list(nodes) not in others and (several or not covered.issuperset(other.nodes)):
            others.append(list(nodes))
            rivals += [] if other.bed else [other]
            covered.update(() if other.bed else other.nodes)
    return others, rivals


def _location(
    diagnosis: Diagnosis, place: Located, others: Sequence[list[int]], rivals: Sequence[Place]
) -> dict[str, Any]:
    """The place, `others` that the recordings cannot tell from it, and the sensor that would."""
    said: dict[str, Any] = {
        "nodes": list(place.place.nodes),
        "to": place.place.to,
        "direction": place.place.direction,
        "also_possible": list(others[:ALSO]),
    }
    if place.place.kind in ("region", "connection", "bushes"):
        # of what the factor is, or which have the law each; the nodes are the corners of a region
        said["elements"] = list(diagnosis.reduced.model.drawn_elements(place.place.elements))
    if place.place.kind == "bushes":
        said["each"] = True
    if place.place.bed:
        # all nodes with the shares of the stiffness; `nodes` are its ends or corners
        said["region"] = list(place.place.bed_nodes)
        said["shares"] = [rounded(float(x @ x) / place.place.bed_stiffness) for _, _, x in place.place.bed]
    # with several effects the force at one place is not what its fit says
    sensor = None if diagnosis.further is not None else _next_sensor(diagnosis, place, rivals[:ALSO])
    return said if sensor is None else {**said, "next_sensor": sensor}


def _moves_with(pair: Place, ground: Place) -> bool:
    """Whether a force between two nodes, along an axis or the line between them, has a part along the direction of a
    place that one of them has to ground."""
    on = [
        dict(zip(p.g_rows[0].tolist(), p.g_values[0].tolist(), strict=True)) if p.n_w == 1 else {}
        for p in (pair, ground)
    ]
    return abs(sum(value * on[1].get(row, 0.0) for row, value in on[0].items())) > ROUND_OFF


def _beddings(diagnosis: Diagnosis, place: Located) -> list[Place]:
    """Beddings on which the law at a place, a spring to ground or a bedding, was tried and is not told apart."""
    told = next((r for r in diagnosis.ranked if r.located.place is place.place), None)
    if told is None or told.candidate.name != "support_stiffness":
        return []
    near = told.score + diagnosis.settings.margin
    beds = [r.located.place for r in diagnosis.ranked if r.located.place.bed and r.score < near]
    return [bed for bed in beds if bed is not place.place]


def _next_sensor(diagnosis: Diagnosis, place: Located, rivals: Sequence[Place]) -> dict[str, Any] | None:
    """The sensor that would split the set of places."""
    found = next_sensor(diagnosis.problem, diagnosis.reduced, place, rivals, diagnosis.settings.margin)
    if found is None:
        return None
    return {"node": found.node, "direction": found.axis, "tells_apart": found.apart, "of": found.rivals}


def _told_parameters(
    diagnosis: Diagnosis, best: Candidate | None, answers: NDArray[np.float64] | None
) -> dict[str, Any]:
    """What a law is told by; of one that was read off alone without deviations, nothing of a free-form force."""
    if diagnosis.read is not None and diagnosis.read.held is not None:
        best = diagnosis.read.held
    if best is not None and not diagnosis.rival:
        return _law_parameters(diagnosis, best, answers)
    if diagnosis.read is None or diagnosis.read.law is None or diagnosis.place is None:
        return {}
    start, system = diagnosis.read.law.start, unit_system(diagnosis.reduced.model.units)
    turning = diagnosis.place.place.direction.startswith("R")
    values = with_companion(start.physics, start.values, start.k)
    return {
        p.name: {"value": rounded(values[p.name]), "sd": None, "unit": p.unit(system, rotational=turning)}
        for p in start.physics.parameters
    }


def _law_parameters(diagnosis: Diagnosis, best: Candidate, answers: NDArray[np.float64] | None) -> dict[str, Any]:
    """What a law is told by, with deviations; `answers` of places that are not told apart as `answers_elsewhere` has
    them, None where there are none."""
    system = unit_system(diagnosis.reduced.model.units)
    if best.physics is None:
        return _part_parameters(best, system, OFF_LAW if answers is None else OPEN_PLACE)
    turning = best.joint is not None and best.joint.place.direction.startswith("R")
    parameters, values, J = told(diagnosis, best)
    least = {p.name: OFF_LAW if answers is None else max(OPEN_PLACE, over_places(p, answers)) for p in parameters}
    own = _law_sd(best, [p.name for p in parameters], J)
    # what is chosen, as the sides of a contact, has none
    sd = {name: float(np.hypot(s, least[name] * values[name])) if s > 0 else s for name, s in own.items()}
    return {
        p.name: {
            "value": rounded(values[p.name]),
            "sd": rounded(sd.get(p.name)),
            "unit": p.unit(system, rotational=turning),
        }
        for p in parameters
    }


def _part_parameters(best: Candidate, system: UnitSystem, least: float) -> dict[str, Any]:
    """A member's factor, which has no unit, the stiffness k of a bedding, or k1 to k6 of a soft clamp; `least` as of
    `OFF_LAW`."""
    told = {}
    ln_sd = None if best.covariance is None else standard_deviations(best.covariance, left=best.fitted)
    for i, (name, value) in enumerate(best.values.items()):
        spring = name == "k" or name in DIRECTIONS
        unit = (
            physics("compliant_support").parameters[0].unit(system, rotational="R" in DIRECTIONS.get(name, ""))
            if spring
            else ""
        )
        sd = None if ln_sd is None else rounded(float(value * np.hypot(ln_sd[i], least)))
        told[name] = {"value": rounded(value), "sd": sd, "unit": unit}
    return told


def _law_sd(best: Candidate, names: Sequence[str], J: NDArray[np.float64] | None) -> dict[str, float]:
    """Standard deviations of what a law is told by, from the Gauss-Newton matrix, inflated by what is left above the
    noise; `J` as of `told`."""
    if best.covariance is None or best.physics is None:
        return {}
    if best.nonlinear and isinstance(best.coordinates, FitCoordinates):
        n = len(best.coordinates.free)
        own = best.coordinates.jacobian(best.x[:n])
        told_by = companion_jacobian(best.physics, best.values, best.k)
        J = np.hstack([told_by[:, :-1] @ own, told_by[:, -1:] * best.extra["k_scale"]])
        covariance = J @ best.covariance[: n + 1, : n + 1] @ J.T
    elif J is not None:
        covariance = J @ best.covariance @ J.T
    else:
        scale = np.array([best.values[name] for name in best.physics.parameter_names])
        covariance = best.covariance * np.outer(scale, scale)
    sd = standard_deviations(covariance, left=best.fitted)
    return dict(zip(names, sd.tolist(), strict=True))


def alternatives(probabilities: Mapping[str, float]) -> list[dict[str, Any]]:
    """What is listed beside a name: others by their `probabilities`, likeliest first.

    >>> alternatives({"added_mass": 0.02, "nothing": 0.0002, "clearance": 0.3})
    [{'physics': 'clearance', 'probability': 0.3}, {'physics': 'added_mass', 'probability': 0.02}]
    """
    likeliest = sorted(probabilities.items(), key=lambda item: -item[1])[:ALTERNATIVES]
    return [{**law_words(name), "probability": round(p, 3)} for name, p in likeliest if p >= LEAST]


def law_words(name: str) -> dict[str, str]:
    """A law by the contract's name, and by its `law` where the contract has none of its own for it.

    >>> law_words("preloaded_contact")
    {'physics': 'bilinear_stiffness', 'law': 'preloaded_contact'}
    >>> law_words("clearance")
    {'physics': 'clearance'}
    """
    reported = CATALOGUE[name].reported if name in CATALOGUE else name
    return {"physics": name} if reported == name else {"physics": reported, "law": name}


def rounded(value: float | None) -> float | None:
    """`value` with the digits that result.json has; None for one that is none."""
    return None if value is None or not np.isfinite(value) else float(f"{value:.4g}")
