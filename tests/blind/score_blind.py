#!/usr/bin/env python3
"""Score diagnoses of generated cases:  score_blind.py RESULTS CASES [RESULTS CASES ...] [--json OUT]

RESULTS/<case>/ is what `femend diagnose CASES/<case>/public/study.toml --out RESULTS/<case>` wrote. Place, name and
family follow the rules of the shared development cases; on top: shares with Wilson 95 % intervals per effect, structure
and visibility, false positives per kind of control, laws outside the catalogue, two effects at once, unmeasured
shakers, confusion, calibration of the probabilities and coverage of the intervals. Cases without a result count as
missed and are listed.
"""

from __future__ import annotations

import argparse
import collections
import json
import math
import pathlib
from collections.abc import Iterable
from typing import Any

import numpy as np
from scoring import FAMILY, near, nrmse, score

__all__ = ["calibration", "near", "nrmse", "report", "score", "wilson"]

Rows = list[dict[str, Any]]
BINS = ((0.0, 0.75), (0.75, 1.5), (1.5, 4.0), (4.0, 12.0), (12.0, math.inf))
COLUMNS = {
    "name right": "named", "wrong name": "wrong", "silent": "silent", "located": "located", "place first": "first",
    "family": "family",
}  # fmt: skip


def wilson(k: int, n: int, z: float = 1.96) -> tuple[float, float]:
    """Wilson 95 % interval of a share."""
    if n == 0:
        return 0.0, 1.0
    p, q = k / n, z * z / n
    half = z * math.sqrt(p * (1 - p) / n + q / (4 * n)) / (1 + q)
    mid = (p + q / 2) / (1 + q)
    return max(mid - half, 0.0), min(mid + half, 1.0)


def text(k: int, n: int) -> str:
    """k/n, per cent and Wilson interval."""
    lo, hi = wilson(k, n)
    return f"{k:3d}/{n:<3d} {100 * k / max(n, 1):4.0f} % ({100 * lo:.0f}-{100 * hi:.0f})"


def share(rows: Rows, key: str) -> str:
    """Share of rows where a column is true."""
    return text(sum(bool(r.get(key)) for r in rows), len(rows))


def median(values: Iterable[float]) -> float:
    """Median of the finite values."""
    v = [x for x in values if math.isfinite(x)]
    return float(np.median(v)) if v else math.nan


def table(title: str, groups: dict[str, Rows], columns: dict[str, str] = COLUMNS) -> None:
    """Print shares and held-out errors for groups of cases."""
    if not any(groups.values()):
        return
    print(f"\n{title:24s}" + "".join(f"{c:>22s}" for c in columns) + f"{'before':>9s}{'after':>9s}")
    for name, rows in groups.items():
        print(
            f"{name:24s}"
            + "".join(f"{share(rows, k):>22s}" for k in columns.values())
            + f"{median(r['before'] for r in rows):9.3f}{median(r['after'] for r in rows):9.3f}"
        )


def by(rows: Rows, key: str) -> dict[str, Rows]:
    """Rows grouped by a column."""
    out: dict[str, Rows] = collections.defaultdict(list)
    for r in rows:
        out[str(r[key])].append(r)
    return dict(sorted(out.items()))


def by_visibility(rows: Rows) -> dict[str, Rows]:
    """Rows grouped by their visibility beyond update."""
    return {f"{lo:g}-{hi:g} x noise": q for lo, hi in BINS if (q := [r for r in rows if lo <= r["beyond"] < hi])}


def confusion(rows: Rows) -> None:
    """Print rows truth, columns verdict or name said."""
    said = sorted({r["said"] for r in rows}, key=lambda s: (s not in FAMILY, s))
    count = collections.Counter((r["truth"], r["said"]) for r in rows)
    print("\ntruth \\ said            " + " ".join(f"{s[:11]:>11s}" for s in said))
    for truth in sorted({r["truth"] for r in rows}):
        print(f"{truth:24s}" + " ".join(f"{count[truth, s] or '':>11}" for s in said))


def calibration(rows: Rows) -> float:
    """Expected calibration error of the printed probability of the name, ten bins (nan when nothing was named)."""
    kept = [r for r in rows if math.isfinite(r["probability"]) and r["kind"] != "two"]
    p = np.array([r["probability"] for r in kept])
    ok = np.array([float(r["named"] and r["kind"] != "control") for r in kept])
    if not len(p):
        return math.nan
    b = np.minimum((p * 10).astype(int), 9)
    return float(sum(abs(p[b == k].mean() - ok[b == k].mean()) * (b == k).mean() for k in np.unique(b)))


def effects(title: str, rows: Rows) -> None:
    """Tables of cases with one effect of the catalogue."""
    if not rows:
        return
    table(title, by(rows, "truth") | {"ALL": rows})
    table("structure", by(rows, "family_of"))
    table("visible beyond update", by_visibility(rows))
    confusion(rows)


def controls(title: str, rows: Rows) -> None:
    """False positives per kind of control and structure."""
    if not rows:
        return
    print(f"\n{title}: false positives (something was said to be missing)")
    for kind, q in (by(rows, "control") | by(rows, "family_of") | {"ALL": rows}).items():
        print(f"{kind:24s}{share(q, 'false')}   undetermined {sum(r['verdict'] == 'undetermined' for r in q)}")


def report(rows: Rows) -> None:
    """All tables."""
    for r in rows:
        print(
            f"{r['case']:8s}{r['truth']:20s}{r['control']:12s}{r['verdict']:20s}{r['said']:20s}"
            f"{r['located']!s:>6}{r['named']!s:>6}{r['family']!s:>6}{r['before']:9.3f}{r['after']:9.3f}"
            f"  beyond update {r['beyond']:.1f}"
        )
    plain, hidden = [r for r in rows if not r["unmeasured"]], [r for r in rows if r["unmeasured"]]
    effects("effect", [r for r in plain if r["kind"] == "one"])
    controls("controls", [r for r in plain if r["kind"] == "control"])
    out = [r for r in plain if r["kind"] == "outside"]
    told = {"said so or family": "class_right", "wrong family": "wrong", "silent": "silent", "located": "located"}
    table("outside the catalogue", (by(out, "truth") | {"ALL": out}) if out else {}, told)
    two = [r for r in plain if r["kind"] == "two"]
    both = {"both located": "located", "both named": "named", "one located": "first", "one named": "one_named"}
    table("two effects", (by_visibility(two) | {"ALL": two}) if two else {}, {**both, "wrong name": "wrong"})
    unknown = [r for r in hidden if r["kind"] != "control"]
    found = {"detected": "detected", "located": "located", "name right": "named", "wrong name": "wrong"}
    table("shaker not measured", (by(unknown, "truth") | {"ALL": unknown}) if unknown else {}, found)
    controls("shaker not measured", [r for r in hidden if r["kind"] == "control"])
    missing = [r["case"] for r in rows if r["verdict"] == "no result"]
    print(f"\ncalibration error of the probabilities {calibration(plain):.3f}")
    for what, key in (("laws", "covered_law"), ("the model", "covered_model")):
        inside = [q for r in plain for q in r[key]]
        print(f"90 % intervals of the parameters of {what} that hold the truth: {text(sum(inside), len(inside))}")
    print(f"cases without a result: {', '.join(missing) or 'none'}")


def main() -> None:
    """Command line."""
    ap = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    ap.add_argument("folders", type=pathlib.Path, nargs="+", metavar="RESULTS CASES", help="one pair or several")
    ap.add_argument("--json", type=pathlib.Path, help="also write the rows here")
    ap.add_argument("--present", action="store_true", help="only the cases that have a result.json")
    a = ap.parse_args()
    if len(a.folders) % 2:
        ap.error("folders come in pairs: results, cases")
    rows = []
    for results, sets in zip(a.folders[::2], a.folders[1::2], strict=True):
        for c in sorted(c for c in sets.iterdir() if (c / "sealed" / "truth.json").exists()):
            if not a.present or (results / c.name / "result.json").exists():
                rows.append(score(results / c.name, c))
    report(rows)
    if a.json:
        a.json.write_text(json.dumps(rows, indent=1))


if __name__ == "__main__":
    main()
