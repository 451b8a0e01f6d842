#!/usr/bin/env python3
"""Score diagnoses of generated cases:  score_blind.py RESULTS CASES [--json OUT]

RESULTS/<case>/ is what `femend diagnose CASES/<case>/public/study.toml --out RESULTS/<case>` wrote. Place, name and
family follow the
rules of the shared development cases; on top: tables per effect and per visibility, false positives per kind of
control,
Wilson intervals, confusion table, calibration of the probabilities. Cases without a result count as missed and are
listed.
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
from blindgen import uff58

FAMILY = {
    "support_stiffness": "stiffness",
    "compliant_support": "stiffness",
    "joint_stiffness": "stiffness",
    "spring_bending": "stiffness",
    "added_mass": "inertia",
    "tuned_absorber": "inertia",
    "viscous_damper": "damping",
    "structural_damping": "damping",
    "viscoelastic": "damping",
    "quadratic_damping": "damping",
    "cubic_stiffness": "nonlinear elastic",
    "clearance": "nonlinear elastic",
    "bilinear_stiffness": "nonlinear elastic",
    "coulomb_friction": "hysteretic",
    "bouc_wen": "hysteretic",
    "gyroscopic": "speed",
    "speed_stiffness": "speed",
    "unmeasured_force": "load",
    "base_motion": "load",
    "load_misplaced": "load",
    "unbalance_law": "load",
}
SILENT = ("consistent", "parameters-only")
BINS = ((0.0, 1.5), (1.5, 4.0), (4.0, 12.0), (12.0, math.inf))


def wilson(k: int, n: int, z: float = 1.96) -> tuple[float, float]:
    """Wilson 95 % interval of a share."""
    if n == 0:
        return 0.0, 1.0
    p, q = k / n, z * z / n
    half = z * math.sqrt(p * (1 - p) / n + q / (4 * n)) / (1 + q)
    mid = (p + q / 2) / (1 + q)
    return max(mid - half, 0.0), min(mid + half, 1.0)


def near(nodes: list[int], truth: dict[str, Any]) -> bool:
    """Every true node has a reported node within 10 % of the model's diagonal; naming many nodes is no answer."""
    if len(nodes) > max(2, 2 * len(truth["nodes"])):
        return False
    xyz = {int(k): np.array(v) for k, v in truth["node_xyz"].items()}
    box = np.array(list(xyz.values()))
    reach = 0.10 * np.linalg.norm(box.max(0) - box.min(0))
    got = [xyz[n] for n in nodes if n in xyz]
    return bool(got) and all(min(np.linalg.norm(xyz[n] - g) for g in got) <= reach for n in truth["nodes"])


def nrmse(predicted: pathlib.Path, recorded: pathlib.Path) -> float:
    """NRMSE over every recorded response; a missing channel counts as zero, a non-finite one as failed."""
    have = {(c.node, c.direction): c.data for c in uff58.read(predicted) if c.kind == uff58.ACCELERATION}
    num = den = 0.0
    for c in uff58.read(recorded):
        if c.kind != uff58.ACCELERATION:
            continue
        p = have.get((c.node, c.direction), np.zeros(0))
        n = min(len(p), len(c.data))
        num += float(((p[:n] - c.data[:n]) ** 2).sum() + (c.data[n:] ** 2).sum())
        den += float((c.data**2).sum())
    return math.sqrt(num / den) if math.isfinite(num) else math.inf


def held_out(result: pathlib.Path, case: pathlib.Path, stage: str) -> float:
    """Mean NRMSE of a stage over the sealed recordings."""
    folder = result / "predictions" / stage
    e = [nrmse(folder / p.name, p) for p in sorted((case / "sealed").glob("*.uff")) if (folder / p.name).exists()]
    return float(np.mean(e)) if e else math.inf


def score(result: pathlib.Path, case: pathlib.Path) -> dict[str, Any]:
    """One row: what was true, what was said, and whether it was right."""
    truth = json.loads((case / "sealed" / "truth.json").read_text())
    row: dict[str, Any] = {
        "case": case.name,
        "truth": truth["effect"],
        "control": truth.get("control", ""),
        "family_of": truth["family"],
        "beyond": truth["visibility_beyond_update"],
        "verdict": "no result",
        "said": "no result",
        "located": False,
        "first": False,
        "named": False,
        "family": False,
        "probability": math.nan,
        "before": math.inf,
        "after": math.inf,
    }
    path = result / "result.json"
    if not path.exists():
        return row
    res = json.loads(path.read_text())
    row["verdict"] = row["said"] = res["verdict"]
    findings = res.get("findings", [])
    if truth["effect"] == "none":
        row["located"] = row["first"] = row["named"] = row["family"] = res["verdict"] in SILENT
    elif findings:
        top = findings[0]
        places = [top["location"].get("nodes", []), *top["location"].get("also_possible", [])[:2]]
        row["first"], row["located"] = near(places[0], truth), any(near(p, truth) for p in places)
        row["named"] = top["physics"] == truth["effect"]
        row["family"] = FAMILY.get(top["physics"]) == FAMILY[truth["effect"]]
    if findings and res["verdict"] == "missing-physics":
        row["said"], row["probability"] = findings[0]["physics"], float(findings[0].get("probability", math.nan))
    row["before"], row["after"] = held_out(result, case, "parameters"), held_out(result, case, "final")
    return row


def share(rows: list[dict[str, Any]], key: str) -> str:
    """k/n, per cent and Wilson interval."""
    k, n = sum(bool(r[key]) for r in rows), len(rows)
    lo, hi = wilson(k, n)
    return f"{k:3d}/{n:<3d} {100 * k / max(n, 1):4.0f} % ({100 * lo:.0f}-{100 * hi:.0f})"


def median(values: Iterable[float]) -> float:
    """Median of the finite values."""
    v = [x for x in values if math.isfinite(x)]
    return float(np.median(v)) if v else math.nan


def table(title: str, groups: dict[str, list[dict[str, Any]]]) -> None:
    """Print located, named, family, wrong name and held-out error for groups of cases."""
    print(f"\n{title:24s}{'located':>24s}{'named':>24s}{'family':>24s}{'wrong name':>24s}{'before':>9s}{'after':>9s}")
    for name, rows in groups.items():
        for r in rows:
            r["wrong"] = r["said"] in FAMILY and not r["named"]
        print(
            f"{name:24s}"
            + "".join(f"{share(rows, k):>24s}" for k in ("located", "named", "family", "wrong"))
            + f"{median(r['before'] for r in rows):9.3f}{median(r['after'] for r in rows):9.3f}"
        )


def by(rows: list[dict[str, Any]], key: str) -> dict[str, list[dict[str, Any]]]:
    """Rows grouped by a column."""
    out: dict[str, list[dict[str, Any]]] = collections.defaultdict(list)
    for r in rows:
        out[str(r[key])].append(r)
    return dict(sorted(out.items()))


def confusion(rows: list[dict[str, Any]]) -> None:
    """Print rows truth, columns verdict or name said."""
    said = sorted({r["said"] for r in rows}, key=lambda s: (s not in FAMILY, s))
    count = collections.Counter((r["truth"], r["said"]) for r in rows)
    print("\ntruth \\ said            " + " ".join(f"{s[:11]:>11s}" for s in said))
    for truth in sorted({r["truth"] for r in rows}):
        print(f"{truth:24s}" + " ".join(f"{count[truth, s] or '':>11}" for s in said))


def calibration(rows: list[dict[str, Any]]) -> float:
    """Expected calibration error of the printed probability of the name, ten bins (nan when nothing was named)."""
    p = np.array([r["probability"] for r in rows if math.isfinite(r["probability"])])
    ok = np.array([float(r["named"] and r["truth"] != "none") for r in rows if math.isfinite(r["probability"])])
    if not len(p):
        return math.nan
    b = np.minimum((p * 10).astype(int), 9)
    return float(sum(abs(p[b == k].mean() - ok[b == k].mean()) * (b == k).mean() for k in np.unique(b)))


def report(rows: list[dict[str, Any]]) -> None:
    """All tables."""
    for r in rows:
        print(
            f"{r['case']:8s}{r['truth']:20s}{r['control']:12s}{r['verdict']:20s}{r['said']:20s}{r['located']!s:>6}{r['named']!s:>6}{r['family']!s:>6}"
            f"{r['before']:9.3f}{r['after']:9.3f}  beyond update {r['beyond']:.1f}"
        )
    missing = [r["case"] for r in rows if r["verdict"] == "no result"]
    rows_e, rows_c = [r for r in rows if r["truth"] != "none"], [r for r in rows if r["truth"] == "none"]
    table("effect", by(rows_e, "truth") | {"ALL": rows_e})
    table("structure", by(rows_e, "family_of"))
    table(
        "visible beyond update",
        {f"{lo:g}-{hi:g} x noise": q for lo, hi in BINS if (q := [r for r in rows_e if lo <= r["beyond"] < hi])},
    )
    print("\nfalse positives (a control that was not called consistent or parameters-only)")
    for kind, q in (by(rows_c, "control") | {"ALL": rows_c}).items():
        for r in q:
            r["false"] = r["verdict"] not in (*SILENT, "no result")
        print(f"{kind:24s}{share(q, 'false')}")
    confusion(rows)
    print(
        f"\ncalibration error of the probabilities {calibration(rows):.3f}; "
        f"cases without a result: {', '.join(missing) or 'none'}"
    )


def main() -> None:
    """Command line."""
    ap = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    ap.add_argument("results", type=pathlib.Path)
    ap.add_argument("cases", type=pathlib.Path)
    ap.add_argument("--json", type=pathlib.Path, help="also write the rows here")
    ap.add_argument("--present", action="store_true", help="only the cases that have a result.json")
    a = ap.parse_args()
    cases = [c for c in sorted(a.cases.iterdir()) if (c / "sealed" / "truth.json").exists()]
    rows = [
        score(a.results / c.name, c) for c in cases if not a.present or (a.results / c.name / "result.json").exists()
    ]
    report(rows)
    if a.json:
        a.json.write_text(json.dumps(rows, indent=1))


if __name__ == "__main__":
    main()
