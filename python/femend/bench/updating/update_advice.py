"""What is to be done after an update, as its page and updating.json say it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from femend.bench.updating.counted import Counted
from femend.bench.updating.field_result import grouped
from femend.bench.updating.left import Unmet
from femend.estimate.updating import Sensitivity, UpdateResult
from femend.modal.held_band import held_band
from femend.modal.parts import misses
from femend.model import affordable_refinement
from femend.numerals import plain

if TYPE_CHECKING:
    from femend.bench.reading.measured import MeasuredModes
    from femend.bench.reading.prepared import Prepared

__all__ = ["MODAL", "few_modes", "mesh_advice", "missing_modes", "passed_over", "update_advice"]

# responses that are of modes
MODAL = frozenset({"frequencies", "shapes", "mac", "damping"})
# of the measured modes less than this share counts: the update is not one of the test
FEW = 0.5
# a held-out recording is met worse when its error grows by more than this share
WORSE = 0.02
# the same of a mode that does not count, and the error from which it is told
AGAIN, OFF = 0.5, 0.005


def few_modes(counted: int, measured: int) -> list[str]:
    """That less than half of the measured modes count, where that is so."""
    if counted >= FEW * measured:
        return []
    return [
        f"only {counted} of {measured} measured modes count{'s' * (counted == 1)}: what was found is told by these "
        "alone, and may be chance; find out first why the others do not (`femend correlate`: sensors and their "
        "directions, units of the frequencies, supports)"
    ]


def missing_modes(measured: Sequence[MeasuredModes]) -> list[str]:
    """That modes of recordings the update is fitted to were not found, where their FRFs say so."""
    found = [(m.name, m.test) for m in measured if m.role == "fit" and m.test is not None]
    missed = [(name, t) for name, t in found if misses(t.error**2, 1.0, t.noise_share**2)]
    if not missed:
        return []
    poor = [
        f"{plain(100 * t.error, 2)} % of the FRFs of {name!r} (scatter explains {plain(100 * t.noise_share, 2)} %)"
        for name, t in missed
    ]
    held = [(name, held_band(t)) for name, t in missed]
    known = [f"{plain(b[0])} to {plain(b[1])} Hz of {name!r}" for name, b in held if b is not None]
    where = f": {', '.join(known)}" if known else " (`femend correlate` draws their FRFs)"
    return [
        f"the modes that were found leave {', '.join(poor)} unexplained: some are missing, and neighbours stand for "
        "them; parameters may be off by more than their deviations: narrow [correlation] band to what the modes "
        f"explain{where}, and update on that"
    ]


def passed_over(counted: Sequence[Counted], recordings: Sequence[dict[str, Any]]) -> list[str]:
    """That modes which do not count are met worse than before: parameters that are right mend these too."""
    counting = {c.sources[0]: set(c.numbers) for c in counted if len(c.sources) == 1}
    worse = []
    for r in recordings:
        for row in r["modes"] if r["recording"] in counting and r["role"] == "fit" else ():
            if row["mode"] in counting[r["recording"]] or None in (row["error_before"], row["error_after"]):
                continue
            before, after = abs(row["error_before"]), abs(row["error_after"])
            if np.isfinite([before, after]).all() and after > max((1 + AGAIN) * before, OFF):
                worse.append((after, before, row, r["recording"]))
    if not worse:
        return []
    after, before, row, name = max(worse, key=lambda one: one[0])
    which = f"{len(worse)} modes that do not count are" if len(worse) > 1 else "a mode that does not count is"
    return [
        f"{which} met worse than before, most of all mode {row['mode']} of {name!r} at {plain(row['freq'])} Hz "
        f"({plain(100 * before, 2)} % off, now {plain(100 * after, 2)} %): parameters that are right mend these too; "
        "let more modes count ([updating] modes), or ask whether other parameters make the difference"
    ]


def mesh_advice(prepared: Prepared, counted: Sequence[Counted]) -> str:
    """How far the deck's own mesh puts frequencies off, where that is told cheaply and is more than `freq_sd`; ""
    otherwise."""
    counting = [c for c in counted if c.freq.size]
    if not counting or prepared.solver is not None:
        return ""  # whose mesh is not the deck's
    first = counting[0]
    finer = affordable_refinement(prepared.models.of(first.configuration), float(first.freq.max()))
    if finer is None or finer.mesh_error is None:
        return ""
    error = finer.mesh_error
    worst = error.worst
    off = float(error.error[worst])
    if abs(off) <= prepared.study.updating.freq_sd:
        return ""
    return (
        f"the deck's own mesh puts frequencies up to {plain(100 * off, 2, signed=True)} % off "
        f"({plain(error.freq[worst])} Hz, {plain(error.converged[worst])} Hz refined; `femend.mesh_error`), which "
        "parameters make up for if they can: refine it before the update"
    )


def update_advice(
    found: UpdateResult,
    told: Sensitivity,
    recordings: Sequence[dict[str, Any]],
    unmet: Unmet,
    field_of: Mapping[str, str],
) -> list[str]:
    """What the search, what it left `unmet`, parameters and held-out recordings ask for; parts of a field (`field_of`
    gives its name by theirs) are said together, and those that neighbours stand in for ask for nothing."""
    said = [text for text in (found.advice, unmet.text(found)) if text]
    let_go = found.let_go()  # the advice of the search tells them
    lost = [mode for mode in found.unpaired() if mode not in let_go]
    if lost:
        modes = ", ".join(f"{c} {n}" for c, n in lost[:6])
        said.append(f"measured modes without a mate of the asked MAC at the end: {modes}")
    far = found.left_prior()
    if far:
        said.append(
            f"{', '.join(grouped(far, field_of))} moved further than two prior deviations: is the prior right, or do "
            "they make up for something the model lacks?"
        )
    groups = [" and ".join(grouped(c.names, field_of)) for c in told.collinear if not set(c.names) <= set(field_of)]
    if groups:
        said.append(f"the data tell only combinations of {'; '.join(groups)}: join them, or measure more")
    # with a strength of the prior that was chosen, the data may tell what they hardly would with the one stated
    by_data = found.determined()
    unseen = [n for n in told.insensitive if n not in field_of and n not in by_data]
    if unseen:
        said.append(f"the data hardly see {', '.join(unseen)}, which stay at their prior")
    for r in recordings:
        b, a = r["before"]["freq_error"], r["after"]["freq_error"]
        if r["role"] == "validate" and np.isfinite([a, b]).all() and a > b + WORSE * max(b, 1e-6) and a > 1e-3:
            said.insert(
                0,
                f"the held-out recording {r['recording']!r} is met worse than before ({100 * b:.2f} % to {100 * a:.2f} "
                "% of its frequencies): do not use the update without finding out why",
            )
    return said
