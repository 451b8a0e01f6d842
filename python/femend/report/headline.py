"""The sentence at the top of the report, and the errors before and after that it tells.

Works on the content of result.json alone, so that the command line and the page say the same.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from femend.numerals import plain
from femend.report.entries import Result, mapping, number, rows
from femend.report.mode_words import FrequencyErrors, frequency_errors
from femend.report.noise import BEYOND_NOISE, farthest_from_noise, noise_without
from femend.report.numbers import factor_as_percent, ratio
from femend.report.vocabulary import PHYSICS
from femend.report.words import (
    acts_where_recorded,
    by_importance,
    is_tentative,
    law_of,
    misplaced_text,
    parameter_text,
    percent,
    physics_name,
    place_text,
    sentence,
    verdict_name,
)

__all__ = ["BY_PRIORS", "INTERRUPTED", "ErrorGain", "InBand", "final_error", "headline", "tells_in_band"]

# what errors are of
UNSEEN, FITTED = "unseen recordings", "the fitted recordings"
# what is said in place of errors on the fitted recordings that are the same with and without what was found
BY_PRIORS = "; without it the updated model explains the recordings only far outside its priors"
_CHANGED = {"parameters": "without and with the missing term", "nominal": "model as given and final model"}
# errors in the band that models are compared in are told where what is left in it and over all differs by a factor of
# more than two in square
APART = 2**0.5
# status of a run that was stopped before it could decide
INTERRUPTED = "interrupted"


@dataclass(frozen=True)
class InBand:
    """Mean NRMSE before and after in the `band` (Hz) that models are compared in."""

    band: tuple[float, float]
    before: float
    after: float

    @property
    def where(self) -> str:
        """The band in words."""
        low, high = self.band
        ends = f"from {plain(low, 3)} to {plain(high, 3)} Hz" if low > 0 else f"up to {plain(high, 3)} Hz"
        return f"{ends}, where models are compared"


@dataclass(frozen=True)
class ErrorGain:
    """Mean NRMSE over the recordings that speak (`which`) before and after, what changed between, their noise, and the
    same in the band that models are compared in, where errors over all frequencies say something else."""

    which: str
    stage: str
    before: float
    after: float
    noise: float | None
    inside: InBand | None = None


def error_gain(result: Result, before: str, after: str) -> ErrorGain | None:
    """NRMSE at two stages (nominal, parameters, final), averaged over the held-out recordings.

    Those used for the fit speak where nothing was held out, of them those with a noise floor where some have one: the
    others were left out of the fit. None where no figures are given.
    """
    for role, which in (("validate", UNSEEN), ("fit", FITTED)):
        table = [r for r in rows(result.get("fit")) if r.get("role") == role]
        if role == "fit":
            table = [r for r in table if number(r.get("noise_floor")) is not None] or table
        pairs = [(number(r.get(before)), number(r.get(after))) for r in table]
        known = [(b, a) for b, a in pairs if b is not None and a is not None]
        if known:
            noise = [v for v in (number(r.get("noise_floor")) for r in table) if v is not None]
            changed = "after updating the parameters" if after == "parameters" else _CHANGED[before]
            gain = ErrorGain(
                which,
                changed,
                sum(b for b, _ in known) / len(known),
                sum(a for _, a in known) / len(known),
                sum(noise) / len(noise) if noise else None,
            )
            return replace(gain, inside=_inside(result, gain, table, (before, after)))
    return None


def _inside(result: Result, gain: ErrorGain, table: Sequence[Result], stages: tuple[str, str]) -> InBand | None:
    """The errors of the rows of a `table` in the band, at two `stages`; None where they are not known, like those over
    all frequencies, or these are noise's."""
    rows_in = [mapping(row.get("in_band")) for row in table]
    known = [(number(row.get(stages[0])), number(row.get(stages[1]))) for row in rows_in]
    pairs = [(b, a) for b, a in known if b is not None and a is not None]
    bands = {tuple(number(f) or 0.0 for f in row.get("band") or ()) for row in rows_in}
    if len(pairs) < len(table) or len(bands) != 1 or len(band := bands.pop()) != 2:
        return None
    before, after = (sum(values) / len(pairs) for values in zip(*pairs, strict=True))
    floors = [v for r in rows(result.get("fit")) if (v := number(r.get("noise_floor"))) is not None]
    of_noise = bool(floors) and gain.after < BEYOND_NOISE * sum(floors) / len(floors)
    turned = gain.after > gain.before and after < before
    apart = max(after, gain.after) > APART * min(after, gain.after)
    return InBand((band[0], band[1]), before, after) if turned or (apart and not of_noise) else None


def tells_in_band(result: Result) -> bool:
    """Whether errors in the band that models are compared in say something else than those over all frequencies."""
    stages = (("nominal", "nominal"), ("nominal", "parameters"), ("parameters", "final"), ("nominal", "final"))
    gains = (error_gain(result, before, after) for before, after in stages)
    return any(gain is not None and gain.inside is not None for gain in gains)


def final_error(result: Result) -> ErrorGain | None:
    """The gain that belongs to the verdict: of the added physics where there is a finding that adds something, else of
    the update."""
    if rows(result.get("findings")):
        gain = error_gain(result, "parameters", "final")
        added = gain is not None and gain.after != gain.before
        return (gain if added else error_gain(result, "nominal", "parameters")) or gain
    return error_gain(result, "nominal", "parameters") or error_gain(result, "nominal", "final")


def headline(result: Result) -> str:
    """The one sentence an engineer takes away."""
    verdict = str(result.get("verdict", ""))
    findings = rows(result.get("findings"))
    if verdict == "missing-physics" and findings:
        return _missing(findings, result)
    if verdict == "located-not-named" and findings:
        return _located(findings, result)
    if verdict in ("consistent", "parameters-only") and (by_modes := _by_modes(result)):
        return by_modes
    if verdict in ("consistent", "parameters-only") and (left := _left(result)):
        return left
    if verdict == "consistent":
        return "Nothing is missing: the model as given explains the recordings" + _level(result) + "."
    if verdict == "parameters-only":
        gain = _gain(result, "nominal", "parameters")
        return f"Nothing is missing: the model explains the recordings{_updated(result)}{gain}."
    if verdict == "undetermined" and result.get("status") == INTERRUPTED:
        fit = _gain(result, "nominal", "parameters")
        return f"Interrupted before it was decided whether something is missing; the parameters are updated{fit}."
    if verdict == "undetermined" and any(not row.get("left_out") for row in rows(result.get("corrections"))):
        return "The recordings have to be corrected before they can tell whether something is missing in the model."
    if verdict == "undetermined" and (errors := _modes_alone(result)) is not None and errors.unlike:
        return f"The modes cannot tell whether something is missing, since the model is not theirs: {errors.text}."
    if verdict == "undetermined":
        return "The recordings cannot tell whether something is missing in the model."
    return f"{verdict_name(verdict)}." if verdict else "No verdict was reached."


def _left(result: Result) -> str:
    """The sentence for a model without findings that leaves more of a fitted recording than noise; empty for another
    one. Recordings held out have no noise floor, so that they cannot say it."""
    times, worst = farthest_from_noise(rows(result.get("fit")), "parameters")
    if worst is None or times < BEYOND_NOISE:
        return ""
    consistent = result.get("verdict") == "consistent"
    gain = error_gain(result, "nominal", "parameters")
    unseen = _gain(result, "nominal", "parameters") if gain is not None and gain.which != FITTED else ""
    model = f"the model{', updated or not,' if consistent else _updated(result)}"
    # what lies outside the band in which models are compared
    if noise_without(times, number(worst.get("outside_band")) or 0.0):
        return (
            f"Nothing is missing in the band that the force excites: {model} explains the recordings there; outside it "
            f"{worst.get('recording')} shows more than noise{unseen}."
        )
    return (
        f"Nothing at one place is missing as far as these recordings tell, but {model} leaves an error of "
        f"{ratio(number(worst.get('parameters')))} on {worst.get('recording')} where noise is "
        f"{ratio(number(worst.get('noise_floor')))}: its mesh or idealisation is off, or more than one thing is "
        f"missing{unseen}."
    )


def _updated(result: Result) -> str:
    moved = _moved(result)
    if not moved and not result.get("parameters"):
        return " once what its modes and members may be off by is taken into account (the study has no parameters)"
    return f" once updated ({moved})" if moved else " once its parameters are updated"


def _modes_alone(result: Result) -> FrequencyErrors | None:
    """The errors of frequencies of a study of which nothing but modes was compared; None of another one."""
    return None if error_gain(result, "nominal", "nominal") else frequency_errors(result)


def _by_modes(result: Result) -> str:
    """The sentence for a model without findings of which nothing but modes was compared; empty for another one."""
    errors = _modes_alone(result)
    if errors is None:
        return ""
    how = " as given" if result.get("verdict") == "consistent" else _updated(result)
    if errors.beyond:
        return (
            f"Nothing at one place is missing as far as these modes tell, but the model{how} does not explain them: "
            f"{errors.text}; its mesh or idealisation is off, or more than one thing is missing."
        )
    return f"Nothing is missing as far as these modes tell: the model{how} explains them; {errors.text}."


def _missing(findings: Sequence[Result], result: Result) -> str:
    parts = []
    for finding in findings:
        if moved := misplaced_text(finding):
            parts.append(moved)
            continue
        parameters, physics = mapping(finding.get("parameters")), law_of(finding)
        values = [
            " ".join(parameter_text(name, entry, physics, with_sd=False))
            for name, entry in _told(parameters, len(findings))
        ]
        what = physics_name(physics, parameters)
        parts.append(
            ", ".join([f"{what} {place_text(mapping(finding.get('location')), physics)}", *values])
            + _or_rather(finding)
        )
    if misplaced := misplaced_text(findings[0]):
        # the parameters are updated with a force that was turned where it is
        before = "nominal" if acts_where_recorded(findings[0]) else "parameters"
        return f"{sentence(misplaced)}{_gain(result, before, 'final')}."
    errors = error_gain(result, "parameters", "final")
    gain = "" if errors is None else _gain_text(errors)
    if any(map(_rests_on_priors, findings)):
        gain = f"{BY_PRIORS}{gain if errors is not None and errors.which == UNSEEN else ''}"
    lead = "Most likely missing" if any(map(is_tentative, findings)) else "Missing"
    if any(map(_or_rather, findings)):
        lead = "Possibly missing"
    return f"{lead}: {'; and '.join(parts)}{gain}."


def _rests_on_priors(finding: Result) -> bool:
    """Whether a finding takes back what the update paid its priors for, and nothing of the errors."""
    return finding.get("rests_on") == "priors"


def _or_rather(finding: Result) -> str:
    """Another name that all places together make likelier than that of a finding, which is the simplest; empty where
    there is none."""
    own = number(finding.get("probability"))
    other = next(iter(rows(finding.get("alternatives"))), None)
    likelier = None if other is None else number(other.get("probability"))
    if other is None or own is None or likelier is None or likelier <= own:
        return ""
    return f", or {physics_name(law_of(other))} ({percent(likelier)})"


def _told(parameters: Mapping[str, Any], n_findings: int) -> list[tuple[str, Any]]:
    """What the headline says of a law: everything of a short one, the stiffnesses by axis of a long one, and nothing of
    a long one that is not alone."""
    every = [row for row in by_importance(parameters) if row[0] != "sides"]
    by_axis = [row for row in every if re.fullmatch(r"k(_rot)?_[xyz]", row[0])]
    if by_axis and n_findings > 1:
        return []
    return by_axis if by_axis and len(every) > len(by_axis) else every


def _located(findings: Sequence[Result], result: Result) -> str:
    finding, gain = findings[0], _final_gain(result)
    physics = law_of(finding)
    place = place_text(mapping(finding.get("location")), physics)
    what = physics_name(physics) if finding.get("physics") in PHYSICS else "something"
    if finding.get("class"):
        what = f"a force ({finding['class']})"
    elif likeliest := _likeliest(findings):
        if result.get("status") == INTERRUPTED:
            told = "Interrupted before it was decided what is missing; likeliest so far"
            return f"{told}: {'; and '.join(likeliest)}{gain}."
        do = "do not" if len(likeliest) > 1 else "does not"
        whole = "though together they" if len(likeliest) > 1 else "though it"
        return f"Likeliest missing: {'; and '.join(likeliest)}, {whole} {do} explain all that is left{gain}."
    where = f"{what}, most likely {place}" if _open(finding) else f"{what} {place}"
    if result.get("status") == INTERRUPTED:
        return f"Interrupted before it was decided what the model lacks: {where}{gain}."
    return f"The model lacks {where}, but no law tried explains it well enough to be named{gain}."


def _open(finding: Result) -> bool:
    """Whether the place of a finding is not to be stated as a fact: others are not told from it, or nothing that acts
    there was found to explain the recordings."""
    return bool(mapping(finding.get("location")).get("also_possible")) or (
        not finding.get("class") and is_tentative(finding)
    )


def _final_gain(result: Result) -> str:
    """The errors of `final_error` in words; they say so where the update alone changed them."""
    gain = final_error(result)
    if gain is None:
        return ""
    added = gain.stage == _CHANGED["parameters"]
    return _gain_text(gain) if added else f"{_gain_text(gain)} by updating its parameters"


def _likeliest(findings: Sequence[Result]) -> list[str]:
    """Laws with their places, the surest first; none where the first finding has no law."""
    if not _is_law(findings[0]):
        return []
    surest = sorted(filter(_is_law, findings), key=lambda f: -(number(f.get("probability")) or 0.0))
    return [
        f"{physics_name(name)} {place_text(mapping(f.get('location')), name)}"
        for f, name in ((f, law_of(f)) for f in surest)
    ]


def _is_law(finding: Result) -> bool:
    return str(finding.get("physics") or "") in PHYSICS and bool(finding.get("parameters"))


def _gain(result: Result, before: str, after: str) -> str:
    gain = error_gain(result, before, after)
    return "" if gain is None else _gain_text(gain)


def _gain_text(gain: ErrorGain) -> str:
    kind = "prediction error" if gain.which == UNSEEN else "error"
    if (inside := gain.inside) is not None:
        over_all = f"{_fall(gain.before, gain.after)} over all frequencies"
        return f"; {kind} on {gain.which} {_fall(inside.before, inside.after)} {inside.where} ({over_all})"
    # over all of the recordings, also where the models are not compared
    no_better = ", over all frequencies no better" if gain.after > gain.before else ""
    return f"; {kind} on {gain.which} {_fall(gain.before, gain.after)}{no_better}"


def _fall(before: float, after: float) -> str:
    """Two errors, with as many decimals as tell them apart."""
    told_apart = f"{before:.2f}" != f"{after:.2f}"
    decimals = 2 if told_apart and min(before, after) >= 0.0095 else 3
    return f"{before:.{decimals}f} → {after:.{decimals}f}"


def _level(result: Result) -> str:
    gain = error_gain(result, "nominal", "nominal")
    if gain is None:
        return ""
    floor = f", noise {ratio(gain.noise)}" if gain.noise is not None else ""
    error = f"error on {gain.which} {ratio(gain.before)}"
    if (inside := gain.inside) is not None:
        error = (
            f"error on {gain.which} {ratio(inside.before)} {inside.where}; {ratio(gain.before)} over all frequencies"
        )
    return f" ({error}{floor})"


def _moved(result: Result) -> str:
    """The three parameters that moved most, with their change."""
    rows = [(str(name), number(mapping(p).get("factor"))) for name, p in mapping(result.get("parameters")).items()]
    known = [(name, f) for name, f in rows if f is not None and f > 0 and abs(f - 1.0) >= 0.005]
    known.sort(key=lambda row: -abs(math.log(row[1])))
    return ", ".join(f"{name} {factor_as_percent(factor)}" for name, factor in known[:3])
