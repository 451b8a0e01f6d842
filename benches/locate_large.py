"""Time `femend diagnose` on decks of about 100 000 DOFs with 100 sensors, step by step.

    python benches/locate_large.py SCRATCH                      # a stiffened panel and a tower of beams
    python benches/locate_large.py SCRATCH --variants panel
    python benches/locate_large.py SCRATCH --size small         # a few thousand DOFs, to try it out

Decks and recordings are made once (minutes; `large_models.py` says how) and used again. The diagnosis is a process of
its own; seconds and peak memory of its steps are those of its run.json. A diagnosis whose first finding has another
name or another place than what was concealed says so in the last line: a time without the right answer is no figure.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

from large_models import Variant, panel, tower, write_study

# modes in the band excited, noise as a share of every channel's RMS
IN_BAND, NOISE = 25, 0.01

VARIANTS: dict[tuple[str, str], Callable[[], Variant]] = {
    ("panel", "large"): lambda: panel(130, 126, 100, 1),
    ("panel", "small"): lambda: panel(30, 26, 30, 1),
    ("tower", "large"): lambda: tower(10, 20, 3, 100, 1),
    ("tower", "small"): lambda: tower(2, 4, 3, 20, 1),
}


def diagnose(study: Path, out: Path, limit_s: float) -> float:
    """Diagnoses `study` into `out` in a process of its own; wall-clock seconds."""
    command = [str(Path(sys.executable).with_name("femend")), "diagnose", str(study), "--out", str(out)]
    start = time.perf_counter()
    try:
        done = subprocess.run(command, stdout=subprocess.DEVNULL, check=False, timeout=limit_s)
    except subprocess.TimeoutExpired:
        sys.exit(f"femend diagnose {study} had no result after {limit_s:.0f} s")
    if done.returncode != 0:
        sys.exit(f"femend diagnose {study} ended with exit code {done.returncode}")
    return time.perf_counter() - start


def told(variant: Variant, out: Path) -> str:
    """What was found, and whether it is what was concealed, where it was."""
    result = json.loads((out / "result.json").read_text(encoding="utf-8"))
    findings = result["findings"]
    if not findings:
        return f"{result['verdict']}: nothing found, but {variant.physics} was concealed at node {variant.node}"
    first = findings[0]
    nodes = first["location"]["nodes"]
    right = first["physics"] == variant.physics and variant.node in nodes
    place = f"{first['physics']} at nodes {nodes}"
    return (
        f"{result['verdict']}: {place}, concealed {variant.physics} at {variant.node}: {'right' if right else 'WRONG'}"
    )


def main() -> None:
    """Make what is missing, diagnose, print the steps."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scratch", type=Path)
    parser.add_argument("--variants", default="panel,tower")
    parser.add_argument("--size", choices=("large", "small"), default="large")
    parser.add_argument("--limit", type=float, default=3600.0, help="seconds after which a diagnosis is ended")
    given = parser.parse_args()
    for name in given.variants.split(","):
        variant = VARIANTS[name, given.size]()
        folder = given.scratch / f"{name}_{given.size}"
        study = folder / "study.toml"
        if not study.exists():
            study = write_study(variant, folder, IN_BAND, NOISE, seed=7)
        wall = diagnose(study, folder / "out", given.limit)
        run = json.loads((folder / "out" / "run.json").read_text(encoding="utf-8"))
        print(f"{name}, {given.size}: {wall:.0f} s, {run['peak_memory_mb']:.0f} MB")
        for step in run["steps"]:
            row = f"{step['seconds']:9.1f} s {step['cpu_seconds']:9.1f} s CPU {step['peak_memory_mb']:7.0f} MB"
            print(f"  {step['name']:40s}{row}")
        print(f"  {told(variant, folder / 'out')}", flush=True)


if __name__ == "__main__":
    main()
