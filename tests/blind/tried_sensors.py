#!/usr/bin/env python3
"""How often sensors that are off are found by a diagnosis:  tried_sensors.py CASES... [--most N]

Every case with measured forces and time records is taken as it is (what is found then is false), with a third of its
sensors a few samples late, with all of them cut off at a third of the first resonance, and with one that shows 0.3 of
its rms of noise, or of 50 Hz, beside its motion. Prints how many of each are found rightly and wrongly.
"""

from __future__ import annotations

import argparse
import pathlib
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from femend.diagnose.locating.locate import locate
from femend.diagnose.locating.sensed import sensed_places
from femend.diagnose.recordings.late_sensors import SensorTimes
from femend.diagnose.recordings.low_cut import LowCut
from femend.diagnose.recordings.put_right import put_right
from femend.diagnose.recordings.recorded_off import RecordedOff
from femend.diagnose.settings import Settings
from femend.diagnose.updating.update import update_model
from femend.estimate import FitRecord, fit_records, pair_test, used_band
from femend.model import find_places, read_model, reduce_model
from femend.study import load_study

# samples that sensors are late, share of the first resonance that they are cut off at, and what one shows beside motion
LATE, CUT, BESIDE = (1.0, 4.0), 1 / 3, 0.3
# how near times (in samples) and a cut-off (relative) have to be found
NEAR, CLOSE = 0.3, 0.25
HUM = 50.0
# frequency (Hz) below which nothing resounds
RIGID = 0.1


def spoiled(
    rng: np.random.Generator, records: Sequence[FitRecord], first: float
) -> dict[str, tuple[RecordedOff | int | None, list[FitRecord]]]:
    """What is wrong and the records with it, by what it is; `first` is the first resonance (Hz) of the deck."""
    rows = sorted({int(row) for r in records for row in r.out_rows})
    dt = min(r.dt for r in records)
    chosen = rng.choice(rows, max(len(rows) // 3, 1), replace=False)
    late = SensorTimes(tuple(int(row) for row in chosen), tuple(dt * rng.uniform(*LATE, len(chosen))))
    cut = LowCut(CUT * first)
    one = int(rng.choice(rows))
    made: dict[str, tuple[RecordedOff | int | None, list[FitRecord]]] = {"as it is": (None, list(records))}
    for name, off in (("a third late", late), ("all cut off", cut)):
        made[name] = (off, [replace(r, y=off.heard(r, r.y)) for r in records])
    for name in ("one noisy", "one with hum"):
        made[name] = (one, [_beside(rng, r, one, name == "one with hum") for r in records])
    return made


def _beside(rng: np.random.Generator, record: FitRecord, row: int, hum: bool) -> FitRecord:
    t = record.dt * np.arange(record.n)
    shown = np.sqrt(2) * np.sin(2 * np.pi * (HUM * t + rng.random())) if hum else rng.standard_normal(record.n)
    y = record.y.copy()
    for i in np.flatnonzero(record.out_rows == row):
        y[i] += BESIDE * record.y[i].std() * shown
    return replace(record, y=y)


def right(meant: RecordedOff | int | None, off: RecordedOff | None, records: Sequence[FitRecord]) -> tuple[bool, bool]:
    """Whether what was found, in `records` that were fitted in the end, is what was meant, and whether something else
    was; sensors that were left out from the beginning do not count."""
    loud = {row for r in records for row, _, _ in r.loud}
    rows, dt = {int(row) for r in records for row in r.out_rows}, min(r.dt for r in records)
    if meant is None:
        return off is None and not loud, off is not None or bool(loud)
    if isinstance(meant, int):
        return loud == {meant} and off is None, off is not None or bool(loud - {meant})
    if isinstance(meant, LowCut):
        good = isinstance(off, LowCut) and abs(off.frequency / meant.frequency - 1) < CLOSE
        return good, not good and off is not None
    assert isinstance(meant, SensorTimes)
    if not isinstance(off, SensorTimes):
        return False, off is not None
    a, b = (dict(zip(one.rows, one.seconds, strict=True)) for one in (meant, off))
    good = all(abs(a.get(row, 0.0) - b.get(row, 0.0)) < NEAR * dt for row in rows)
    return good, not good


def main() -> None:
    """Count and print."""
    ap = argparse.ArgumentParser(description=__doc__)
    ap.add_argument("cases", type=pathlib.Path, nargs="+")
    ap.add_argument("--most", type=int, default=1000, help="cases that are tried")
    a = ap.parse_args()
    rng, counts = np.random.default_rng(1), dict[str, list[int]]()
    paths = sorted(p for folder in a.cases for p in folder.glob("**/public/study.toml"))
    for path in paths[: a.most]:
        study = load_study(path)
        model = read_model(study.model_file, units=study.units, parameters=study.parameters)
        test = study.read_recordings()
        records = fit_records([r for r in test if r.role == "fit"], model, pair_test(test, model))
        zeta, settings = study.damping_ratio, Settings()
        freq = reduce_model(model, used_band(records)[1], [int(row) for r in records for row in r.out_rows]).freq
        first = float(freq[freq > RIGID][0])
        for what, (meant, seen) in spoiled(rng, records, first).items():
            start = update_model(model, seen, zeta)
            places = sensed_places(start.problem, start.reduced, find_places(start.reduced.model))
            located = locate(start.problem, start.reduced, places, start.null)
            off, after, _ = put_right(start, located, places, zeta, settings)
            good, wrong = right(meant, off, after.problem.records)
            print(
                f"{path.parent.parent.name} {what}: {'right' if good else 'wrong' if wrong else 'nothing'}", flush=True
            )
            own = counts.setdefault(what, [0, 0, 0])
            for i, value in enumerate((True, good, wrong)):
                own[i] += value
    for what, (n, good, wrong) in counts.items():
        print(f"{what}: right {good} of {n}, wrong {wrong}")


if __name__ == "__main__":
    main()
