"""Judging the diagnoses of a self-test: found, named, missed and falsely claimed, with Wilson intervals."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["BINS", "COLUMNS", "Outcome", "Share", "grouped", "judge", "wilson"]

FloatArray = NDArray[np.float64]

NEAR = 0.10  # of the model's diagonal: a place as near as this is the right one
BINS = (0.0, 1.0, 3.0, 10.0, math.inf)
SILENT = ("consistent", "parameters-only")
COLUMNS = ("located", "named", "wrong", "missed")


@dataclass(frozen=True)
class Outcome:
    """What was true of a case and what was said.

    `located`: the place is right; `named`: the name and the place; `wrong`: another name was given, or the right one
    elsewhere; `missed`: nothing was said to be missing; `false`: something was, in a control. `visibility` is the
    effect's size at the sensors in units of their noise, `beyond` what an update of the model leaves of it.
    """

    case: int
    effect: str
    control: str
    visibility: float
    beyond: float
    verdict: str
    said: str
    located: bool = False
    named: bool = False
    wrong: bool = False
    missed: bool = False
    false: bool = False
    seconds: float = 0.0


@dataclass(frozen=True)
class Share:
    """`k` of `n` with the Wilson 95 % interval."""

    k: int
    n: int

    @property
    def interval(self) -> tuple[float, float]:
        """Lower and upper bound."""
        return wilson(self.k, self.n)

    @property
    def text(self) -> str:
        """Count and interval in per cent.

        >>> Share(9, 10).text
        '9/10 (60-98 %)'
        """
        low, high = self.interval
        return f"{self.k}/{self.n} ({100 * low:.0f}-{100 * high:.0f} %)"


def wilson(k: int, n: int, z: float = 1.96) -> tuple[float, float]:
    """Wilson interval of a share (Wilson 1927), 95 % for z = 1.96; (0, 1) where there is nothing.

    >>> [round(x, 3) for x in wilson(0, 42)]
    [0.0, 0.084]
    """
    if n == 0:
        return 0.0, 1.0
    p, q = k / n, z * z / n
    half = z * math.sqrt(p * (1 - p) / n + q / (4 * n)) / (1 + q)
    middle = (p + q / 2) / (1 + q)
    return max(middle - half, 0.0), min(middle + half, 1.0)


def judge(
    case: int, truth: dict[str, Any], result: dict[str, Any], xyz: dict[int, FloatArray], seconds: float
) -> Outcome:
    """The outcome of a case: `truth` as of truth.json, `result` as of result.json, `xyz` the nodes of the model."""
    verdict, findings = str(result["verdict"]), list(result.get("findings", []))
    named = verdict == "missing-physics" and bool(findings)
    said = str(findings[0]["physics"]) if named else ""
    effect = str(truth["effect"])
    silent = verdict in (*SILENT, "undetermined")
    control = effect == "none"
    located = not control and bool(findings) and _located(findings[0]["location"], truth["nodes"], xyz)
    right = named and said == effect and located
    return Outcome(
        case,
        effect,
        str(truth["control"]),
        float(truth["visibility"]),
        float(truth["visibility_beyond_update"]),
        verdict,
        said,
        located=located,
        named=right,
        wrong=not control and named and not right,
        missed=silent,
        false=control and not silent,
        seconds=seconds,
    )


def _located(location: dict[str, Any], nodes: Sequence[int], xyz: dict[int, FloatArray]) -> bool:
    """Whether the place, or one of the first two others it calls possible, is near every true node."""
    points = np.array(list(xyz.values()))
    reach = (NEAR + 1e-9) * float(np.linalg.norm(np.ptp(points, axis=0)))
    for told in [location.get("nodes", []), *location.get("also_possible", [])[:2]]:
        got = [xyz[n] for n in told if n in xyz]
        few = 0 < len(got) <= max(2, 2 * len(nodes))
        if few and all(min(float(np.linalg.norm(xyz[n] - g)) for g in got) <= reach for n in nodes):
            return True
    return False


def grouped(outcomes: Sequence[Outcome], key: Callable[[Outcome], str]) -> dict[str, dict[str, Share]]:
    """Shares of the cases with an effect by group, in the order of the groups' names, and of all of them."""
    shown = [o for o in outcomes if o.effect != "none"]
    groups: dict[str, list[Outcome]] = {}
    for o in sorted(shown, key=key):
        groups.setdefault(key(o), []).append(o)
    if shown:
        groups["all"] = shown
    return {
        name: {column: Share(sum(bool(getattr(o, column)) for o in rows), len(rows)) for column in COLUMNS}
        for name, rows in groups.items()
    }


def false_claims(outcomes: Sequence[Outcome]) -> dict[str, Share]:
    """Shares of the controls in which something was said to be missing, by kind of control and of all of them."""
    rows = [o for o in outcomes if o.effect == "none"]
    kinds = sorted({o.control for o in rows})
    out = {kind: [o for o in rows if o.control == kind] for kind in kinds}
    if rows:
        out["all"] = rows
    return {kind: Share(sum(o.false for o in q), len(q)) for kind, q in out.items()}


def bin_of(outcome: Outcome) -> str:
    """The bin of what an update leaves of an outcome's visibility, in words."""
    for low, high in pairwise(BINS):
        if low <= outcome.beyond < high:
            return f"{low:4g} x noise and more" if math.isinf(high) else f"{low:4g} to {high:g} x noise"
    return ""
