"""One case judged: what was true, what was said, and whether it was right."""

from __future__ import annotations

import itertools
import json
import math
import pathlib
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
Z90 = 1.6448536  # half width of a 90 % interval in standard deviations


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


def places(finding: dict[str, Any]) -> list[list[int]]:
    """The place of a finding and the first two others it calls possible."""
    where = finding["location"]
    return [where.get("nodes", []), *where.get("also_possible", [])[:2]]


def family_of(finding: dict[str, Any]) -> str:
    """Family that a finding speaks of: that of its name, or the name where it is a family itself."""
    name = finding.get("physics", "")
    return FAMILY.get(name, name if name in FAMILY.values() else "")


def inside(told: dict[str, Any], value: float) -> bool | None:
    """Whether a 90 % interval (or value and sd of one) holds the true value; None where none was given."""
    if told.get("interval"):
        lo, hi = told["interval"]
        return bool(lo <= value <= hi)
    at, sd = told.get("value", told.get("factor")), told.get("sd")
    if not isinstance(at, int | float) or not sd:
        return None
    return bool(abs(at - value) <= Z90 * sd)


def covered(told: dict[str, dict[str, Any]], true: dict[str, Any]) -> list[bool]:
    """For every parameter with interval and true value: does the interval hold it?"""
    pairs = [(told[k], v) for k, v in true.items() if k in told and isinstance(v, int | float)]
    return [q for t, v in pairs if (q := inside(t, float(v))) is not None]


def empty(case: pathlib.Path, truth: dict[str, Any]) -> dict[str, Any]:
    """The row of a case without a result."""
    kind = {"outside": "outside", "two": "two", "none": "control"}.get(truth["effect"], "one")
    return {
        "case": case.name,
        "kind": kind,
        "unmeasured": truth.get("unmeasured", False),
        "truth": truth["effect"] if kind != "outside" else truth["law"],
        "control": truth.get("control", ""),
        "family_of": truth["family"],
        "noise": truth.get("noise", 0.01),
        "beyond": truth["visibility_beyond_update"],
        "verdict": "no result",
        "said": "no result",
        **dict.fromkeys(("located", "first", "named", "family", "wrong", "silent", "false", "class_right"), False),
        "detected": False,
        "probability": math.nan,
        "before": math.inf,
        "after": math.inf,
        "covered_law": [],
        "covered_model": [],
    }


def score(result: pathlib.Path, case: pathlib.Path) -> dict[str, Any]:
    """One row: what was true, what was said, and whether it was right."""
    truth = json.loads((case / "sealed" / "truth.json").read_text())
    row = empty(case, truth)
    path = result / "result.json"
    if not path.exists():
        return row
    res = json.loads(path.read_text())
    findings = res.get("findings", [])
    row["verdict"] = row["said"] = res["verdict"]
    row["silent"] = res["verdict"] in (*SILENT, "undetermined")
    row["detected"] = not row["silent"]
    if findings and res["verdict"] == "missing-physics":
        row["said"] = "+".join(sorted(f["physics"] for f in findings))
        told = findings[0].get("probability")
        row["probability"] = math.nan if told is None else float(told)
    {"control": judge_control, "one": judge_one, "outside": judge_outside, "two": judge_two}[row["kind"]](
        row, res["verdict"], findings, truth
    )
    if row["named"]:
        true = {f"E_{name}": f for name, f in truth.get("E_factor", {}).items()}
        row["covered_model"] = covered(res.get("parameters", {}), true)
    row["before"], row["after"] = held_out(result, case, "parameters"), held_out(result, case, "final")
    return row


def judge_control(row: dict[str, Any], verdict: str, _findings: list[dict[str, Any]], _truth: dict[str, Any]) -> None:
    """Nothing is missing: silence is right, "undetermined" is no false positive and not right either."""
    right = verdict in SILENT
    row.update(located=right, first=right, named=right, family=right, false=verdict not in (*SILENT, "undetermined"))


def judge_one(row: dict[str, Any], verdict: str, findings: list[dict[str, Any]], truth: dict[str, Any]) -> None:
    """One effect of the catalogue: the first finding counts."""
    if not findings:
        return
    top = findings[0]
    row["first"], row["located"] = near(places(top)[0], truth), any(near(p, truth) for p in places(top))
    row["named"] = top["physics"] == truth["effect"]
    row["family"] = family_of(top) == FAMILY[truth["effect"]]
    row["wrong"] = verdict == "missing-physics" and top["physics"] in FAMILY and not row["named"]
    if row["named"]:
        row["covered_law"] = covered(top.get("parameters", {}), truth["parameters"])


def judge_outside(row: dict[str, Any], verdict: str, findings: list[dict[str, Any]], truth: dict[str, Any]) -> None:
    """A law that no name fits: located but not named is right, and so is a name of the right family."""
    row["located"] = bool(findings) and any(near(p, truth) for p in places(findings[0]))
    row["first"] = bool(findings) and near(places(findings[0])[0], truth)
    row["family"] = bool(findings) and family_of(findings[0]) in truth["families"]
    row["class_right"] = verdict == "located-not-named" or (verdict == "missing-physics" and row["family"])
    row["wrong"] = verdict == "missing-physics" and not row["family"]


def judge_two(row: dict[str, Any], verdict: str, findings: list[dict[str, Any]], truth: dict[str, Any]) -> None:
    """Two effects: each true one has a finding of its own (the assignment that serves the answer best)."""
    best = (0, 0)
    n = len(truth["effects"])
    for chosen in itertools.permutations([*findings, *([None] * n)], n):
        pairs = list(zip(chosen, truth["effects"], strict=True))
        at = [f is not None and any(near(p, {**e, "node_xyz": truth["node_xyz"]}) for p in places(f)) for f, e in pairs]
        named = [ok and f is not None and f["physics"] == e["effect"] for ok, (f, e) in zip(at, pairs, strict=True)]
        best = max(best, (sum(at), sum(named)))
    names = {e["effect"] for e in truth["effects"]}
    row["located"], row["named"] = best[0] == n, best[1] == n
    row["first"], row["one_named"] = best[0] >= 1, best[1] >= 1
    row["family"] = {family_of(f) for f in findings} >= {FAMILY[name] for name in names}
    row["wrong"] = verdict == "missing-physics" and any(
        f["physics"] in FAMILY and f["physics"] not in names for f in findings
    )
