"""An update as plain values: what updating.json holds."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from femend.bench.correlation.correlation_result import comparison_result, placed_result
from femend.bench.doubting.doubted import (
    TIME_FIRST,
    at_one_dof,
    doubted_levels,
    doubted_times,
)
from femend.bench.doubting.doubted_faint import faint_shapes
from femend.bench.doubting.doubted_frames import with_frames_settled
from femend.bench.doubting.doubted_frequencies import FREQUENCIES_FIRST, doubted_frequencies, far_pairs
from femend.bench.doubting.doubted_solver import beyond_the_solver
from femend.bench.reading.compared import Compared
from femend.bench.reading.links import deck_priors, kept_as_drawn, links_result
from femend.bench.updating.contradicting import contradicting
from femend.bench.updating.counted import Counted
from femend.bench.updating.damped_shifts import shifted_by_damping
from femend.bench.updating.drawn import Drawn
from femend.bench.updating.field_result import fields_result, grouped, made_for_fields
from femend.bench.updating.left import Unmet, what_is_left
from femend.bench.updating.paired_otherwise import paired_otherwise
from femend.bench.updating.starts import Starts
from femend.bench.updating.strength import Strength
from femend.bench.updating.surface_start import SurfaceStart
from femend.bench.updating.update_advice import MODAL, few_modes, mesh_advice, missing_modes, passed_over, update_advice
from femend.bench.updating.without_mistaken import Sound
from femend.correlate import match_frfs
from femend.estimate.updating import Sensitivity, UpdatedDeck, UpdateResult
from femend.model.patched.deck_changes import kept_told
from femend.study.file.study import AS_MODELLED

if TYPE_CHECKING:
    from femend.bench.reading.prepared import Prepared

__all__ = ["FORMAT", "update_result"]

FORMAT = "femend-update/1"


def update_result(
    sound: Sound,
    counted: Sequence[Counted],
    told: Sensitivity,
    found: UpdateResult,
    after: Sequence[Compared],
    deck: UpdatedDeck,
    strength: Strength | None = None,
    surface: SurfaceStart | None = None,
    starts: Starts | None = None,
    drawn: Drawn | None = None,
) -> dict[str, Any]:
    """The content of updating.json."""
    prepared, recordings = sound.prepared, _recordings(sound, after)
    unmet = what_is_left(found, counted)
    more = [one for one in (strength, surface, starts, drawn) if one is not None]
    advice = [
        *contradicting(counted),
        *update_advice(found, told, recordings, unmet, made_for_fields(prepared.study, prepared.model)),
        *passed_over(counted, recordings),
        *shifted_by_damping(prepared, found, counted, after),
        *([mesh_advice(prepared, counted)] if unmet.off else []),
        *(text for one in more for text in one.advice()),
    ]
    warnings = [text for one in (surface, starts) if one is not None for text in one.warnings()]
    warnings += [*_kept(prepared, found, deck), *deck.faults, *paired_otherwise(found, counted, after)]
    return {
        "format": FORMAT,
        "title": prepared.study.title,
        "status": found.status,
        **_said(sound, counted, advice, warnings, unmet.believable(found), len(found.let_go())),
        "iterations": len(found.history) - 1,
        "cost": {"before": found.before.cost, "after": found.after.cost},
        "squares": {"before": found.before.squares, "after": found.after.squares, "values": found.after.n_values},
        "log_evidence": found.log_evidence,
        "wider": sorted(unmet.wide(found)),
        "parameters": _parameters(prepared, told, found, unmet),
        "correlation_of_estimates": _correlation(found.covariance),
        "not_told_apart": [
            {"condition": c.condition, "parameters": list(c.names), "weights": list(c.weights)} for c in told.collinear
        ],
        "hardly_seen": list(told.insensitive),
        "regularisation": None if strength is None else strength.as_dict(),
        "response_surface": None if surface is None else surface.as_dict(),
        "starts": None if starts is None else starts.as_dict(),
        "posterior": None if drawn is None else drawn.as_dict(),
        "solver": None if prepared.solver is None else prepared.solver.as_dict(),
        "fields": fields_result(prepared.study, prepared.model, found),
        "links": links_result(prepared.study, prepared.model, found.values),
        "fit": _fit(found),
        "left": unmet.as_list(),
        "responses": list(prepared.study.updating.responses),
        "counted": [_counted(c) for c in counted],
        "recordings": recordings,
        "history": [
            {"cost": i.cost, "squares": i.squares, "radius": i.radius, "notes": list(i.notes)} for i in found.history
        ],
        "sensors": placed_result(prepared.placed),
    }


def _said(
    sound: Sound,
    counted: Sequence[Counted],
    advice: Sequence[str],
    warnings: Sequence[str],
    believable: bool,
    let_go: int,
) -> dict[str, Any]:
    """How many modes count, whether the update is `doubtful` as a whole (as one is whose deviations are not
    `believable`, or whose search `let_go` of so many modes), and all advice and warnings: those of the
    measurement first, then those of what was found."""
    # what looks mistaken is told of the recordings as they are
    prepared, before = sound.prepared, sound.recorded
    n_counted = sum(c.freq.size for c in counted) - let_go
    measured = n_counted + let_go + sum(len(c.left_out) for c in counted)
    few = few_modes(n_counted, measured) if MODAL & set(prepared.study.updating.responses) else []
    times, factors = doubted_times(prepared, before), doubted_frequencies(before)
    faults = sound.doubts
    missing = missing_modes(prepared.measured)
    first = [
        *few,
        *missing,
        *([TIME_FIRST] if times else []),
        *([FREQUENCIES_FIRST] if factors else []),
        *sound.mend,
    ]
    settled = with_frames_settled(prepared, before, prepared.warnings)
    told = [*settled, *times, *factors, *at_one_dof(before), *faults, *doubted_levels(before, of_all=True)]
    told += beyond_the_solver(prepared, before)
    told += [*far_pairs([b for b in before if b.measured.role == "validate"]), *faint_shapes(before)]
    told += [text for c in counted for text in c.left_out]
    return {
        "doubtful": bool(few or missing or times or factors or faults or let_go) or not believable,
        "modes": {"measured": measured, "counted": n_counted},
        "advice": "; ".join(text for text in [*first, *advice] if text),
        "warnings": list(dict.fromkeys([*told, *warnings])),
    }


def _kept(prepared: Prepared, found: UpdateResult, deck: UpdatedDeck) -> list[str]:
    """What stays in the updated deck as it was: parameters that have no part, are told by other configurations alone,
    or stand in no field."""
    if prepared.solver is not None:
        return prepared.solver.warnings
    n = len(prepared.study.updating.structure)
    pooled = f"{n} [[updating.structure]] are updated as one; `femend population` tells how they scatter"
    other = [pooled] if n else []
    other += kept_as_drawn(prepared.study, prepared.model, found.values, AS_MODELLED)
    if not deck.left_out:
        return other
    field_of = made_for_fields(prepared.study, prepared.model)
    of_fields = any(n in field_of for n in deck.left_out)
    more = ", or give groups of elements properties of their own and name these ([[updating.field]] property_ids)"
    return [*other, kept_told(grouped(deck.left_out, field_of), deck.kept) + more * of_fields]


def _fit(found: UpdateResult) -> dict[str, Any]:
    """Mean frequency error and MAC over the modes that count, before and after; NaN where there are none."""
    let_go = found.let_go()
    rows = [r for r in found.modes() if (r.configuration, r.mode) not in let_go]

    def mean(values: list[float]) -> float:
        known = [v for v in values if np.isfinite(v)]
        return float(np.mean(known)) if known else float("nan")

    return {
        "freq_error": {
            "before": mean([abs(r.freq_before / r.freq - 1) for r in rows]),
            "after": mean([abs(r.freq_after / r.freq - 1) for r in rows]),
        },
        "mac": {"before": mean([r.mac_before for r in rows]), "after": mean([r.mac_after for r in rows])},
    }


def _parameters(prepared: Prepared, told: Sensitivity, found: UpdateResult, unmet: Unmet) -> dict[str, Any]:
    """Every unknown; those of the deck have a factor, positions and damping have a value."""
    determined = set(found.determined())
    units = {u.name: u.unit for u in found.problem.unknowns.items}
    prior = deck_priors(prepared.study, prepared.model)
    factors = {n for n, (mean, _) in prior.items() if mean == 1.0}
    size = dict(zip(told.names, told.size.tolist(), strict=True))
    out = {}
    for row in found.parameters():
        kind = {"factor": row.value} if row.name in factors else {"value": row.value, "unit": units[row.name]}
        out[row.name] = {
            **kind,
            "sd": row.sd,
            "widened_sd": row.sd * unmet.widened[row.name],
            "before": row.before,
            "prior_sd": prior[row.name][1] if row.name in prior else None,
            "moved_by_prior_sd": row.z,
            "learned": row.learned,
            "determined": row.name in determined,
            "at_bound": row.at_bound,
            "sensitivity": size[row.name],
        }
    return out


def _correlation(covariance: np.ndarray) -> list[list[float | None]]:
    sd = np.sqrt(np.diag(covariance))
    with np.errstate(invalid="ignore", divide="ignore"):
        found: list[list[float | None]] = (covariance / np.outer(sd, sd)).tolist()
    return found


def _counted(c: Counted) -> dict[str, Any]:
    found = {
        "name": c.name,
        "configuration": c.configuration,
        "recordings": list(c.sources),
        "modes": list(c.numbers),
        "freq": c.freq.tolist(),
        "freq_sd": c.freq_sd.tolist(),
        "zeta": c.zeta.tolist(),
        "zeta_sd": c.zeta_sd.tolist(),
        "shape_sd": np.sqrt(np.mean(c.phi_sd**2, axis=0)).tolist(),
    }
    if c.frf is not None:
        found["frf_lines"] = c.frf.freq.tolist()
    return found


def _recordings(sound: Sound, after: Sequence[Compared]) -> list[dict[str, Any]]:
    """All recordings before and after, with their sensors that were left out."""
    lost = {o.recording: [str(d) for d in o.dofs] for o in sound.left_out}
    both = zip(sound.compared, after, strict=True)
    return [_recording(b, a) | {"sensors_left_out": lost.get(b.measured.name, [])} for b, a in both]


def _recording(before: Compared, after: Compared) -> dict[str, Any]:
    own = comparison_result(before)
    keep = {k: own[k] for k in ("recording", "role", "configuration", "from")}
    pairs = {r.a: r for r in before.comparison.table.rows}
    mates = {r.a: r for r in after.comparison.table.rows}
    modes = []
    for k, freq in enumerate(before.test.freq.tolist()):
        b, a = pairs.get(k), mates.get(k)
        modes.append(
            {
                "mode": k + 1,
                "freq": freq,
                "freq_before": None if b is None else b.freq_b,
                "freq_after": None if a is None else a.freq_b,
                "error_before": None if b is None else b.freq_difference,
                "error_after": None if a is None else a.freq_difference,
                "mac_before": None if b is None else b.mac,
                "mac_after": None if a is None else a.mac,
                "model_mode_before": None if b is None else b.b + 1,
                "model_mode_after": None if a is None else a.b + 1,
            }
        )
    found = {**keep, "before": _summary(before), "after": _summary(after), "modes": modes}
    return found


def _summary(c: Compared) -> dict[str, Any]:
    """Errors of modes, and of FRFs: mean CSAC and CSF, and the rms of the log ratio of magnitudes in dB."""
    found = c.summary()
    if c.frfs is not None and c.measured.frf is not None and c.frf is not None:
        m = match_frfs(c.measured.frf, c.frf)
        loud = (np.abs(m.H_a) > 1e-12 * np.abs(m.H_a).max()) & (np.abs(m.H_b) > 0)
        db = 20 * np.log10(np.abs(m.H_b[loud]) / np.abs(m.H_a[loud]))
        found |= {
            "csac": float(np.nanmean(c.frfs.csac)),
            "csf": float(np.nanmean(c.frfs.csf)),
            "frf_error_db": float(np.sqrt(np.mean(db**2))),
        }
    return found
