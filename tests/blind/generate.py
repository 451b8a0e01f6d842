#!/usr/bin/env python3
"""Write a set of concealed-effect cases:  generate.py OUT --cases 60 --seed 1 [--jobs 2]

OUT/b0001/public is what the program gets, OUT/b0001/sealed the answer. Seeds 1-99 are for calibration, seeds from
100 on for the test.
"""

from __future__ import annotations

import argparse
import collections
import multiprocessing
import os
import pathlib
import time

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

from blindgen import case, plan  # noqa: E402


def one(task: tuple[pathlib.Path, int, int, str, str]) -> tuple[str, dict, float]:
    """Write one case (worker)."""
    out, seed, index, family, label = task
    start = time.perf_counter()
    name = f"b{index + 1:04d}"
    return name, case.write_case(out / name, seed, index, family, label), time.perf_counter() - start


def main() -> None:
    """Command line."""
    ap = argparse.ArgumentParser(description=__doc__)
    ap.add_argument("out", type=pathlib.Path)
    ap.add_argument("--cases", type=int, default=60)
    ap.add_argument("--start", type=int, default=1, help="first case number, to continue a set")
    ap.add_argument("--seed", type=int, default=1)
    ap.add_argument("--jobs", type=int, default=1)
    ap.add_argument("--effect", help="only this label, for example clearance or none:model_form")
    ap.add_argument("--family", choices=list(case.FAMILIES), help="only this family")
    a = ap.parse_args()
    families = list(case.FRAMES)
    tasks = []
    for i in range(a.start - 1, a.cases):
        family = a.family or plan.family(a.seed, i, families)
        tasks.append((a.out, a.seed, i, family, a.effect or plan.suited(plan.label(a.seed, i), family)))
    a.out.mkdir(parents=True, exist_ok=True)
    count: collections.Counter[str] = collections.Counter()
    with multiprocessing.Pool(a.jobs) as pool:
        for name, truth, seconds in pool.imap_unordered(one, tasks):
            count[truth["effect"]] += 1
            seen = f"visibility {truth['visibility']:6.1f}, beyond update {truth['visibility_beyond_update']:6.1f}"
            print(
                f"{name} {truth['effect']:20s} {truth['family']:12s} {truth['excitation']:10s} {seen} {seconds:5.1f} s",
                flush=True,
            )
    print(dict(count))


if __name__ == "__main__":
    main()
