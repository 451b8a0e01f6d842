"""An update as plain values: what updating.json holds."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from femend.bench.compared import Compared
from femend.bench.correlation_result import comparison_result, placed_result
from femend.bench.counted import Counted
from femend.bench.doubted import MEND_FIRST, TIME_FIRST, doubted_levels, doubted_sensors, doubted_times
from femend.bench.drawn import Drawn
from femend.bench.starts import Starts
from femend.bench.surface_start import SurfaceStart
from femend.correlate import match_frfs
from femend.estimate.updating import Sensitivity, UpdatedDeck, UpdateResult
from femend.study.bench_settings import UpdatingSettings

if TYPE_CHECKING:
    from femend.bench.correlate import Prepared

__all__ = ["FORMAT", "update_result"]

FORMAT = "femend-update/1"
# a held-out recording is met worse when its error grows by more than this share
WORSE = 0.02
# rms of what is left, in deviations, from which it is told that they do not explain it
LEFT = 3.0
# a frequency so many times freq_sd off is told by itself
FREQ_LEFT = 5.0


def update_result(
    prepared: Prepared,
    counted: Sequence[Counted],
    told: Sensitivity,
    found: UpdateResult,
    before: Sequence[Compared],
    after: Sequence[Compared],
    deck: UpdatedDeck,
    starts: Starts | None = None,
    drawn: Drawn | None = None,
    surface: SurfaceStart | None = None,
) -> dict[str, Any]:
    """The content of updating.json."""
    settings = prepared.study.updating
    recordings = [_recording(b, a) for b, a in zip(before, after, strict=True)]
    faults, times = doubted_sensors(before), doubted_times(prepared, before)
    warnings = [*prepared.warnings, *times, *faults, *doubted_levels(before, of_all=True)]
    warnings += [text for c in counted for text in c.left_out]
    warnings += [text for one in (surface, starts) if one is not None for text in one.warnings()]
    more = [text for one in (surface, starts, drawn) if one is not None for text in one.advice()]
    warnings += deck.warnings
    return {
        "format": FORMAT,
        "title": prepared.study.title,
        "status": found.status,
        "advice": "; ".join(
            [
                *([TIME_FIRST] if times else []),
                *([MEND_FIRST] if faults else []),
                *_advice(found, told, recordings),
                *_frequencies_left(found, settings),
                *more,
            ]
        ),
        "iterations": len(found.history) - 1,
        "cost": {"before": found.before.cost, "after": found.after.cost},
        "squares": {"before": found.before.squares, "after": found.after.squares, "values": found.after.n_values},
        "log_evidence": found.log_evidence,
        "parameters": _parameters(prepared, told, found),
        "correlation_of_estimates": _correlation(found.covariance),
        "not_told_apart": [
            {"condition": c.condition, "parameters": list(c.names), "weights": list(c.weights)} for c in told.collinear
        ],
        "hardly_seen": list(told.insensitive),
        "response_surface": None if surface is None else surface.as_dict(),
        "starts": None if starts is None else starts.as_dict(),
        "posterior": None if drawn is None else drawn.as_dict(),
        "fit": _fit(found),
        "responses": list(settings.responses),
        "counted": [_counted(c) for c in counted],
        "recordings": recordings,
        "history": [
            {"cost": i.cost, "squares": i.squares, "radius": i.radius, "notes": list(i.notes)} for i in found.history
        ],
        "sensors": placed_result(prepared.placed),
        "warnings": list(dict.fromkeys(warnings)),
    }


def _fit(found: UpdateResult) -> dict[str, Any]:
    """Mean frequency error and MAC over the modes that count, before and after; NaN where there are none."""
    rows = found.modes()

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


def _parameters(prepared: Prepared, told: Sensitivity, found: UpdateResult) -> dict[str, Any]:
    """Every unknown; those of the deck have a factor, positions and damping have a value."""
    determined = set(found.determined())
    units = {u.name: u.unit for u in found.problem.unknowns.items}
    factors = {p.name for p in prepared.study.parameters}
    prior = {p.name: p.prior_sd for p in prepared.study.parameters}
    prior |= {m.name: m.prior_sd for m in prepared.study.updating.morph}
    size = dict(zip(told.names, told.size.tolist(), strict=True))
    out = {}
    for row in found.parameters():
        kind = {"factor": row.value} if row.name in factors else {"value": row.value, "unit": units[row.name]}
        out[row.name] = {
            **kind,
            "sd": row.sd,
            "before": row.before,
            "prior_sd": prior.get(row.name),
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


def _left(found: UpdateResult) -> float:
    """Rms of what is left, in deviations."""
    return float(np.sqrt(found.after.squares / max(found.after.n_values, 1)))


def _frequencies_left(found: UpdateResult, settings: UpdatingSettings) -> list[str]:
    """Frequencies that stay far off though shapes, which are known less well and are more, keep the mean down."""
    if "frequencies" not in settings.responses or _left(found) > LEFT:
        return []  # the latter is told of all
    off = [(abs(r.freq_after / r.freq - 1), r) for r in found.modes() if np.isfinite(r.freq_after)]
    worst, row = max(off, key=lambda pair: pair[0], default=(0.0, None))
    if row is None or worst <= FREQ_LEFT * settings.freq_sd:
        return []
    times = worst / settings.freq_sd
    return [
        f"mode {row.mode} of {row.configuration} stays {100 * worst:.2f} % off in frequency, {times:.0f} times "
        "freq_sd: the parameters do not meet the frequencies together; is another part uncertain too, or does the "
        "model lack something (`femend diagnose` looks for it)?"
    ]


def _advice(found: UpdateResult, told: Sensitivity, recordings: Sequence[dict[str, Any]]) -> list[str]:
    said = [found.advice] if found.advice else []
    left = _left(found)
    if left > LEFT:
        said.append(
            f"what is left is {left:.1f} times the deviations on average: these are too tight ([updating] freq_sd, "
            "shape_sd ...), modes are paired wrongly, or the model lacks something (`femend diagnose` looks for it); "
            "the parameters are less sure than their deviations say"
        )
    lost = found.unpaired()
    if lost:
        modes = ", ".join(f"{c} {n}" for c, n in lost[:6])
        said.append(f"measured modes without a mate of the asked MAC at the end: {modes}")
    far = found.left_prior()
    if far:
        said.append(
            f"{', '.join(far)} moved further than two prior deviations: is the prior right, or do they make up for "
            "something the model lacks?"
        )
    groups = [" and ".join(c.names) for c in told.collinear]
    if groups:
        said.append(f"the data tell only combinations of {'; '.join(groups)}: join them, or measure more")
    if told.insensitive:
        said.append(f"the data hardly see {', '.join(told.insensitive)}, which stay at their prior")
    for r in recordings:
        b, a = r["before"]["freq_error"], r["after"]["freq_error"]
        if r["role"] == "validate" and np.isfinite([a, b]).all() and a > b + WORSE * max(b, 1e-6) and a > 1e-3:
            said.insert(
                0,
                f"the held-out recording {r['recording']!r} is met worse than before ({100 * b:.2f} % to {100 * a:.2f} "
                "% of its frequencies): do not use the update without finding out why",
            )
    return said
