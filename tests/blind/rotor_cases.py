"""Concealed cases of rotors: motor rigs whose deck may lack gyroscopic moments, springs that change with the speed, a
layer under the plate, and bending of the springs.

    python tests/blind/rotor_cases.py make OUT --seed 41 --cases 12
    for c in OUT/r*; do femend diagnose $c/public/study.toml --out RESULTS/$(basename $c); done
    python tests/blind/rotor_cases.py score RESULTS OUT

Seeds 1-99 are for calibration, from 100 on for the test, as for `generate.py`. Unlike there the truth is assembled by
the package (twice as fine a plate, springs of bars, other damping); what turns is stepped in time by code of its own.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any

import numpy as np

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent)]
from score_blind import text  # noqa: E402
from scoring import inside  # noqa: E402

from rigs import Rig, write_rig  # noqa: E402

# what acts with the speed, in turns; nothing in two of six, as a third of all cases are controls for it
TURNING = ("gyroscopic", "none", "speed_stiffness", "gyroscopic", "speed_stiffness", "none")
# goal for the rest that is named: NRMSE of the run-down that was not shown
GOOD = 0.15


def drawn(rng: np.random.Generator, index: int) -> tuple[Rig, list[str]]:
    """A rig and the names of what its deck lacks."""
    turning = TURNING[index % len(TURNING)]
    bends, layered = bool(rng.random() < 0.4), bool(rng.random() < 0.4)
    mass = rng.uniform(15.0, 35.0)
    k = tuple(mass * v for v in (rng.uniform(450, 750), rng.uniform(450, 750), rng.uniform(1200, 1700)))
    stiffening = [0.0, 0.0, 0.0]
    if turning == "speed_stiffness":
        stiffening[int(rng.integers(3))] = float(rng.choice([-1.0, 1.0]) * rng.uniform(0.04, 0.2))
    # the block's inertia about the axes across the shaft is about a hundredth of its mass
    ip = float(mass * 0.01 * np.exp(rng.uniform(np.log(0.02), np.log(0.15)))) if turning == "gyroscopic" else 0.0
    layer = tuple(float(np.exp(rng.uniform(np.log(4e5), np.log(2e6)))) for _ in range(2))
    rig = Rig(
        mass=mass,
        lx=rng.uniform(0.45, 0.65),
        ly=rng.uniform(0.35, 0.5),
        k=(k[0], k[1], k[2]),
        factors=tuple(rng.uniform(0.88, 1.12, 3)),
        mass_factor=rng.uniform(0.98, 1.02),
        bends=bends,
        layer=(layer[0], layer[1], 2.5 * layer[1]) if layered else None,
        unbalance=(rng.uniform(1e-3, 4e-3), rng.uniform(1e-3, 4e-3)),
        phase=(rng.uniform(-3, 3), rng.uniform(-3, 3)),
        sense=int(rng.choice([-1, 1])),
        seconds=float(rng.uniform(50.0, 100.0)),
        onset=None if rng.random() < 0.7 else 2.0,
        ip=ip,
        stiffening=(stiffening[0], stiffening[1], stiffening[2]),
    )
    lacks = ["compliant_support"] * layered + ["spring_bending"] * bends + [turning] * (turning != "none")
    return rig, lacks


def make(out: Path, seed: int, cases: int, start: int) -> None:
    """Public studies and sealed truths."""
    for index in range(start, cases + 1):
        rng = np.random.default_rng([seed, index])
        rig, lacks = drawn(rng, index - 1)
        folder = out / f"r{index:04d}"
        write_rig(folder / "public", rig, noise=float(rng.uniform(0.01, 0.03)), seed=int(rng.integers(1 << 30)))
        sealed = folder / "sealed"
        sealed.mkdir(exist_ok=True)
        (folder / "public" / "rundown.true.npy").rename(sealed / "rundown.true.npy")
        truth: dict[str, Any] = {"lacks": lacks, "ip": rig.ip, "stiffening": rig.stiffening, "seed": seed}
        (sealed / "truth.json").write_text(json.dumps(truth, indent=1))
        print(folder.name)


def judged(result: Path, case: Path) -> dict[str, Any]:
    """What one result says beside the truth."""
    truth = json.loads((case / "sealed" / "truth.json").read_text())
    row: dict[str, Any] = {"case": case.name, "lacks": sorted(truth["lacks"]), "said": None, "held": []}
    path = result / "result.json"
    if not path.exists():
        return row
    told = json.loads(path.read_text())
    row["verdict"], row["said"] = told["verdict"], sorted(f["physics"] for f in told["findings"])
    row["probability"] = [(f["physics"], f["probability"]) for f in told["findings"]]
    for finding in told["findings"]:
        if finding["physics"] == "gyroscopic" and truth["ip"]:
            row["held"].append(inside(finding["parameters"]["Ip"], truth["ip"]))
    row["errors"] = [rundown(result / "predictions" / stage, case) for stage in ("parameters", "final")]
    return row


def rundown(folder: Path, case: Path) -> float:
    """NRMSE of the predicted run-down; the study's sensors stand in the same order in both."""
    from blindgen import uff58

    found = [c.data for c in uff58.read(folder / "rundown.uff") if c.kind == uff58.ACCELERATION]
    true = np.load(case / "sealed" / "rundown.true.npy")
    return float(np.linalg.norm(np.array(found)[:, : true.shape[1]] - true) / np.linalg.norm(true))


def score(results: Path, out: Path) -> None:
    """Rows and sums."""
    rows = [judged(results / c.name, c) for c in sorted(out.iterdir()) if (c / "sealed" / "truth.json").exists()]
    for row in rows:
        print(
            row["case"], "lacks", row["lacks"], "said", row["said"], row.get("verdict"), row.get("errors"), row["held"]
        )
    for name in ("gyroscopic", "speed_stiffness", "compliant_support", "spring_bending"):
        there = [r for r in rows if name in r["lacks"]]
        claimed = [r for r in rows if name not in r["lacks"] and name in (r["said"] or [])]
        print(f"{name:20s} named {text(sum(name in (r['said'] or []) for r in there), len(there))}, where it is not "
              f"{text(len(claimed), len(rows) - len(there))}")  # fmt: skip
    whole = [r for r in rows if r["said"] == r["lacks"]]
    good = [r for r in rows if r["said"] is not None and r["errors"][1] < GOOD]
    print(f"all of it right {text(len(whole), len(rows))}; run-down below {GOOD}: {text(len(good), len(rows))}")
    other = [f for r in rows for f in set(r["said"] or []) - set(r["lacks"])]
    print(f"claimed and not there: {other}")
    held = [h for r in rows for h in r["held"] if h is not None]
    print(f"90 % intervals of Ip that hold the truth: {text(sum(held), len(held))}")


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("what", choices=("make", "score"))
    parser.add_argument("folders", nargs="+", type=Path)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--cases", type=int, default=12)
    parser.add_argument("--start", type=int, default=1)
    said = parser.parse_args()
    if said.what == "make":
        make(said.folders[0], said.seed, said.cases, said.start)
    else:
        score(said.folders[0], said.folders[1])


if __name__ == "__main__":
    main()
