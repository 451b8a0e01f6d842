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

Task = tuple[pathlib.Path, int, int, str, str, case.Options]


def one(task: Task) -> tuple[str, dict, float]:
    """Write one case (worker)."""
    out, seed, index, family, label, options = task
    start = time.perf_counter()
    name = f"b{index + 1:04d}"
    truth = case.write_case(out / name, seed, index, family, label, options)
    return name, truth, time.perf_counter() - start


def noise_range(text: str) -> tuple[float, float]:
    """Two shares "lo,hi"."""
    lo, hi = (float(x) for x in text.split(","))
    if not 0 < lo <= hi < 0.5:
        raise argparse.ArgumentTypeError(f"{text} is not lo,hi with 0 < lo <= hi < 0.5")
    return lo, hi


def arguments() -> argparse.Namespace:
    """Command line."""
    ap = argparse.ArgumentParser(description=__doc__)
    ap.add_argument("out", type=pathlib.Path)
    ap.add_argument("--cases", type=int, default=72, help="last case number")
    ap.add_argument("--start", type=int, default=1, help="first case number, to continue a set")
    ap.add_argument("--seed", type=int, default=1)
    ap.add_argument("--jobs", type=int, default=1)
    ap.add_argument("--noise", type=noise_range, default=(0.01, 0.05), help="range of the sensors' noise, lo,hi")
    ap.add_argument("--controls", type=float, default=1 / 3, help="share of cases with nothing missing")
    ap.add_argument("--controls-only", action="store_true", help="the same as --controls 1")
    kind = ap.add_mutually_exclusive_group()
    kind.add_argument("--outside", action="store_true", help="effects follow laws that the catalogue does not have")
    kind.add_argument("--two", action="store_true", help="two effects of the catalogue at different places")
    ap.add_argument("--unmeasured", action="store_true", help="the shaker's force is in no recording that is fitted")
    kind.add_argument("--frf", action="store_true", help="averaged FRFs of two places of the shaker, linear effects")
    ap.add_argument("--unfiltered", action="store_true", help="samples are picked without a filter against aliasing")
    ap.add_argument(
        "--across", type=float, default=0.0, help="what sensors pick up of motion across them (standard deviation)"
    )
    ap.add_argument("--long", type=float, default=1.0, help="how many times as long fitted recordings are as usual")
    ap.add_argument(
        "--reach", type=float, default=1.0, help="how many times as far as the deck's mesh follows the forces reach"
    )
    ap.add_argument("--gain", type=float, default=0.0, help="errors of calibration of every channel (relative)")
    ap.add_argument(
        "--beyond",
        type=float,
        default=case.BEYOND,
        help="what an update has to leave of every effect, times the noise; more than the default: in every case, and "
        "of each of two beside the other",
    )
    ap.add_argument("--effect", help="only this label: clearance, none:model_form, outside:wedge, two:a+b ...")
    ap.add_argument("--excitation", choices=case.EXCITATIONS, default="", help="the force of the fit recordings")
    ap.add_argument("--family", choices=[*case.FAMILIES, *case.ALONE], help="only this family")
    return ap.parse_args()


def main() -> None:
    """Make the set."""
    a = arguments()
    kind = "outside" if a.outside else "two" if a.two else "linear" if a.frf else "one"
    share = 1.0 if a.controls_only else a.controls
    tasks: list[Task] = []
    for i in range(a.start - 1, a.cases):
        family = a.family or plan.family(a.seed, i, list(case.FAMILIES))
        label = plan.suited(a.effect or plan.label(a.seed, i, share, kind), family, a.unmeasured)
        options = case.Options(
            a.noise, a.unmeasured, a.beyond, a.excitation, not a.unfiltered, a.across, a.gain, a.reach, a.long, a.frf
        )
        tasks.append((a.out, a.seed, i, family, label, options))
    a.out.mkdir(parents=True, exist_ok=True)
    count: collections.Counter[str] = collections.Counter()
    with multiprocessing.Pool(a.jobs) as pool:
        for name, truth, seconds in pool.imap_unordered(one, tasks):
            count[truth["effect"]] += 1
            seen = f"visibility {truth['visibility']:6.1f}, beyond update {truth['visibility_beyond_update']:6.1f}"
            what = truth.get("law") or "+".join(e["effect"] for e in truth.get("effects", [])) or truth["effect"]
            print(
                f"{name} {what:20s} {truth['family']:12s} {truth['excitation']:10s} noise {truth['noise']:.3f} {seen} "
                f"{seconds:5.1f} s",
                flush=True,
            )
    print(dict(count))


if __name__ == "__main__":
    main()
