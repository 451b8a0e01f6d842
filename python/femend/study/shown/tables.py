"""The tables of the report: places, laws, parameters, what was asked of the data, remarks on the input."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

from femend.diagnose.deciding.own_frequency import own_frequency
from femend.diagnose.fitting.candidates import Candidate
from femend.diagnose.naming.calibration import CALIBRATION
from femend.diagnose.naming.ranked import Ranked
from femend.estimate import noise_floor
from femend.numerals import listed, plain
from femend.report import words
from femend.report.content import Check, LawRow, ParameterRow, Place
from femend.report.numbers import factor_as_percent, significant
from femend.study.shown.curves import accepted

if TYPE_CHECKING:
    from femend.diagnose import Diagnosis
    from femend.diagnose.locating.split import Split
    from femend.study.result.study_run import StudyRun

__all__ = ["checks", "laws", "notes", "parameters", "places"]

# rows of the table of laws
LAW_ROWS = 16
# DOFs named in a remark before the rest is counted
NAMED = 8
# what the rows of laws that come out as the one named add at least before it is said
LIKE = 0.01
# misfit on the unseen record, in that of the best law, up to which another one explains about as much; and in that
# without any law, from which it gains too little (nothing but words hangs on these)
AS_MUCH, LITTLE = 1.05, 0.5
# the row of what is none of the others
UNTRIED = "untried"
NOT_ADEQUATE, SO_FAR = "the best of them, but not adequate", "the likeliest so far"


def places(diagnosis: Diagnosis) -> tuple[Place, ...]:
    """The places whose law-free fit came to its end."""
    if not diagnosis.located:
        return ()
    best = min(found.cost for found in diagnosis.located)
    return tuple(
        Place(
            found.place.text,
            found.cost,
            tuple(found.place.nodes),
            found.place.direction,
            found.cost - best < diagnosis.settings.margin,
        )
        for found in diagnosis.located
    )


def laws(diagnosis: Diagnosis) -> tuple[LawRow, ...]:
    """The candidates in their order, the updated model without any addition, and with probabilities what is left of
    them for something that was not tried."""
    taken = accepted(diagnosis) if diagnosis.best is not None else None
    free = diagnosis.rival.ranked if diagnosis.rival is not None else None
    probability = list(diagnosis.probabilities)
    pairs = list(zip(diagnosis.ranked, probability, strict=True))
    first = sorted(pairs, key=lambda pair: not _finite(pair[0]))[:LAW_ROWS]
    rows = [_law_row(diagnosis, r, p, r is taken) for r, p in first]
    if diagnosis.load is not None:
        load = diagnosis.load
        named = diagnosis.by_load
        where = f"node {', '.join(map(str, load.nodes))}, {load.direction}"
        rows.insert(0, _row(load.physics, where, load.candidate, None, "", named))
    if free is not None:
        where = "" if free.located is None else free.located.place.text
        rows.insert(0, _row("free form", where, free.candidate, None, "a smooth force, no law", True))
    quiet = diagnosis.verdict in ("consistent", "parameters-only")
    # what of the probability of all that was tried the laws do not have
    none = max(0.0, CALIBRATION.surest - sum(probability)) if probability else None
    rows.append(_row("none", "", diagnosis.null_chosen, none, "", quiet))
    rows += [_untried()] if probability else []
    # among some of the laws, or laws of which none is it, no probability says anything
    nameless = diagnosis.verdict == "located-not-named" and (diagnosis.best is None or free is not None)
    silent = diagnosis.interrupted or nameless
    if silent:
        return tuple(replace(row, probability=None) for row in rows if row.physics != UNTRIED)
    return tuple(rows)


def _untried() -> LawRow:
    """What the calibration leaves to whatever was not tried, however clearly one law wins."""
    told, right = CALIBRATION.told, CALIBRATION.right
    remark = f"whatever the fits say: of {told} names told on generated cases {told - right} were wrong"
    return LawRow(UNTRIED, "", None, None, None, 1.0 - CALIBRATION.surest, remark)


def _finite(ranked: Ranked) -> bool:
    return math.isfinite(ranked.score) and math.isfinite(ranked.candidate.chosen)


def _law_row(diagnosis: Diagnosis, ranked: Ranked, probability: float, taken: bool) -> LawRow:
    place = "" if ranked.located is None else ranked.located.place.text
    remark = _remark(diagnosis, ranked)
    if taken:
        likeliest = SO_FAR if diagnosis.interrupted else NOT_ADEQUATE
        remark = _with_like(diagnosis, ranked) if diagnosis.verdict == "missing-physics" else likeliest
    return _row(ranked.candidate.name, place, ranked.candidate, probability, remark, taken)


def _row(name: str, place: str, candidate: Candidate, probability: float | None, remark: str, chosen: bool) -> LawRow:
    return LawRow(name, place, candidate.n_law, candidate.fitted, candidate.chosen, probability, remark, chosen)


def _remark(diagnosis: Diagnosis, ranked: Ranked) -> str:
    """Why a law was not taken, from the figures in its row."""
    if not _finite(ranked):
        return "its fit does not stay finite"
    if diagnosis.interrupted:
        return "not decided"
    own, best = ranked.candidate.chosen, min(r.candidate.chosen for r in diagnosis.ranked if _finite(r))
    without = diagnosis.null_chosen.chosen
    if not own < without:
        return "explains the unseen record no better than no addition"
    if diagnosis.best is None:
        return "gains too little on the unseen record" if own > LITTLE * without else "not adequate"
    if ranked.candidate.name == diagnosis.best.name and own <= AS_MUCH * best:
        return "the same law at a place that explains about as much"
    if own > AS_MUCH * best:
        return f"leaves {significant(own / best, 2)} times what the best one leaves"
    if ranked.name == diagnosis.best.name:
        return f"with these values the same as {words.physics_name(ranked.name)}, for which it counts"
    return "explains about as much, with more parameters or a less likely model"


def _with_like(diagnosis: Diagnosis, taken: Ranked) -> str:
    """What the name is told with, where other laws that come out as the same add to it."""
    name = taken.name or taken.candidate.name
    pairs = list(zip(diagnosis.ranked, diagnosis.probabilities, strict=True))
    whole = sum(p for r, p in pairs if (r.name or r.candidate.name) == name)
    own = next((p for r, p in pairs if r is taken), whole)
    return f"{100 * whole:.0f} % with the laws that come out as the same" if whole > own + LIKE else ""


def parameters(run: StudyRun) -> tuple[ParameterRow, ...]:
    """Factors as in the result, with prior standard deviations and how many of them each has moved."""
    rows = []
    for parameter in run.model.parameters:
        entry = words.mapping(words.mapping(run.result.get("parameters")).get(parameter.name))
        factor, sd = words.number(entry.get("factor")), words.number(entry.get("sd"))
        if factor is None:
            continue
        at = run.diagnosis.reduced.names.index(parameter.name)
        prior = float(run.diagnosis.reduced.prior_sd[at])
        z = math.log(factor) / prior if factor > 0 and prior > 0 else None
        rows.append(ParameterRow(parameter.name, factor, math.nan if sd is None else sd, parameter.prior_sd, z))
    return tuple(rows)


def checks(run: StudyRun) -> tuple[Check, ...]:
    """The questions on which the verdict rests, with their answers and figures."""
    diagnosis, settings = run.diagnosis, run.diagnosis.settings
    misfit = diagnosis.null.score
    quiet = misfit <= settings.consistent
    found = [
        Check(
            "Does the updated model explain the recordings as far as their noise allows?",
            "yes" if quiet else "no",
            f"misfit {significant(misfit)}; up to {significant(settings.consistent)} is explained",
        )
    ]
    z = [abs(row.z) for row in parameters(run) if row.z is not None]
    if z:
        far = max(z) > settings.parameter_z
        found.append(
            Check(
                "Did a parameter move further than was thought possible?",
                "yes" if far else "no",
                f"{significant(max(z), 2)} prior standard deviations; {significant(settings.parameter_z, 2)} is far",
            )
        )
    mode = own_frequency(diagnosis)
    if mode is not None:
        far = mode.deviations > settings.parameter_z
        found.append(
            Check(
                "Did a mode need a frequency of its own, beyond what mesh and idealisation are off by?",
                "yes" if far else "no",
                f"{factor_as_percent(1.0 + mode.shift)} at {plain(mode.freq, 3)} Hz, {significant(mode.deviations, 2)} "
                f"standard deviations; {significant(settings.parameter_z, 2)} is far",
            )
        )
    # an interrupted run may not have come to these
    found += [] if diagnosis.interrupted else [*_gain_checks(diagnosis), _load_check(diagnosis)]
    stopped = "" if diagnosis.null.converged else "the update stopped before it had converged"
    found.append(Check("Did the update converge?", "yes" if diagnosis.null.converged else "no", stopped))
    return tuple(found)


def _load_check(diagnosis: Diagnosis) -> Check:
    """Whether the recorded force acts elsewhere than recorded."""
    load = diagnosis.load if diagnosis.load is not None and diagnosis.load.physics == "load_misplaced" else None
    return Check(
        "Would the recorded force explain more at another place?",
        "no" if load is None else "yes",
        "" if load is None else f"at node {load.nodes[0]}, {load.direction}: misfit {significant(load.fit.score)}",
    )


def _chosen_on(split: Split) -> str:
    """The recordings that choose between laws, in words."""
    if split.held is not None and split.held.cut > 0:
        return f"the last {plain(split.held.seconds, 3)} s of {split.held.name}, held back for choosing"
    kept = [r.name for r in split.unseen]
    if not kept:
        return "on the only recording there is to fit"
    seen = [r.name for r in split.choosing.records if r.name not in kept]
    beside = f", with {', '.join(seen)}, the only one that shows it" if seen else ""
    return f"recording {', '.join(kept)}, kept for choosing{beside}"


def _gain_checks(diagnosis: Diagnosis) -> list[Check]:
    """Gain of the best candidate on the record no law was fitted to, and what a free force there leaves."""
    finite = [r for r in diagnosis.ranked if _finite(r)]
    if not finite:
        return []
    settings, best = diagnosis.settings, accepted(diagnosis) or finite[0]
    where = _chosen_on(diagnosis.split)
    before, after = diagnosis.null_chosen.chosen, best.candidate.chosen
    gain = math.log(before / after) if before > 0 and 0 < after < math.inf else -math.inf
    score = diagnosis.null_score - best.score
    seen = gain > settings.gain_chosen and score > settings.gain_cost
    figures = f"misfit {significant(before)} → {significant(after)}"
    rows = [Check(f"Does an addition predict better ({where})?", "yes" if seen else "no", figures)]
    reference = best.candidate.reference
    if math.isfinite(reference) and reference > 0:
        limit = max(reference, 1.0) * settings.adequate
        # a smooth force that beats the laws has no name
        name = words.physics_name(best.candidate.name)
        what = f"the best law ({name})" if name else "the smooth force without a law"
        rows.append(
            Check(
                f"Does {what} explain about as much as a free force there?",
                "yes" if after <= limit else "no",
                f"{'law' if name else 'smooth force'} {significant(after)}, free force {significant(reference)}; "
                f"{significant(limit)} is enough",
            )
        )
    return rows


def notes(run: StudyRun) -> tuple[str, ...]:
    """What was read without influence, paired by distance, held of itself or repaired on reading."""
    found = [
        f"{card}: {count} card{'s' if count != 1 else ''} of the deck without influence here"
        for card, count in sorted(run.model.deck.ignored().items())
    ]
    held = list(run.model.fe.auto_constrained)
    if held:
        found.append(f"held because nothing resists or loads them: {listed(held, NAMED)}")
    found += run.pairing.notes
    for recording in run.test:
        found += [f"recording {recording.name}: {note}" for note in recording.notes]
    for record in run.records:
        level = noise_floor(record, run.diagnosis.problem.band)
        repeats = f"repeats every {plain(record.period * record.dt)} s" if record.period else "does not repeat itself"
        if record.frf is not None:
            low, high = run.diagnosis.problem.band
            repeats = f"frequency responses, used from {plain(low)} to {plain(high)} Hz"
        found.append(f"recording {record.name}: {repeats}; noise {significant(level, 2)} of the response")
    return tuple(found)
