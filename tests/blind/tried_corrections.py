#!/usr/bin/env python3
"""How often mistakes with recordings are confirmed before a diagnosis:  tried_corrections.py CASES...

Every case with measured forces and time records is taken as it is (what is corrected or left out then is false), with
one random sensor in g, in mm or upside down, with two exchanged and three in a circle, with the force in lbf, and with
all sensors in mm/s^2 or in g. Prints how many of each are doubted, corrected rightly and corrected wrongly.
"""

from __future__ import annotations

import argparse
import pathlib

import numpy as np
from mistaken_channels import read_otherwise

from femend.data import Test
from femend.estimate import pair_test
from femend.model import read_model
from femend.study import load_study
from femend.study.doubts.corrections import Corrections, corrections_of
from femend.study.doubts.plausible import doubts_found

# one of the sensors, or all of them: 1/g, mm for m, upside down
G, MILLI = 1 / 9.80665, 1000.0
LBF = 1 / 4.44822


def mistakes(rng: np.random.Generator, n: int) -> dict[str, tuple[np.ndarray, np.ndarray, float, set[int]]]:
    """Order and factors of `n` sensors, factor of the force and the sensors concerned (none: all), by what it is."""
    same, ones = np.arange(n), np.ones(n)
    made = {"as it is": (same, ones, 1.0, set[int]())}
    for name, factor in (("sensor in g", G), ("sensor in mm", MILLI), ("sensor reversed", -1.0)):
        k = int(rng.integers(n))
        made[name] = (same, np.where(same == k, factor, 1.0), 1.0, {k})
    for name, count in (("two exchanged", 2), ("three in a circle", 3)):
        chosen, order = rng.choice(n, min(count, n), replace=False), same.copy()
        order[chosen] = order[np.roll(chosen, 1)]
        made[name] = (order, ones, 1.0, {int(i) for i in chosen})
    made["force in lbf"] = (same, ones, LBF, set())
    made["all in mm/s^2"], made["all in g"] = (same, MILLI * ones, 1.0, set()), (same, G * ones, 1.0, set())
    return made


def otherwise(test: Test, order: np.ndarray, factors: np.ndarray, force: float) -> Test:
    """A test with its sensors in another order and multiplied by `factors`, its forces by `force`."""
    done = []
    for recording in test:
        data = recording.time
        if recording.role != "predict":
            data = read_otherwise(data, [int(i) for i in order], factors)
        size = np.array([force if c.quantity == "force" else 1.0 for c in data.channels])
        done.append(type(recording)(recording.name, data.with_values(data.values * size[:, None]), recording.role))
    return Test(tuple(done))


def corrected(right: Corrections, what: str, names: list[str], concerned: set[int]) -> tuple[bool, bool]:
    """Whether what was corrected is right, and whether it is wrong; part of it is neither."""
    wanted = {names[i] for i in concerned}
    single = {name for one in (*right.single, *right.whole) for name in one.sensors}
    whole = [one for one in right.whole if not one.sensors]
    if what == "as it is":
        return not (single or whole), bool(single or whole)
    if concerned:
        return single == wanted and not whole, bool(whole or single - wanted)
    return bool(whole) and not single, bool(single)


def main() -> None:
    """Count and print."""
    ap = argparse.ArgumentParser(description=__doc__)
    ap.add_argument("cases", type=pathlib.Path, nargs="+")
    a = ap.parse_args()
    rng, counts = np.random.default_rng(1), dict[str, list[int]]()
    for path in sorted(p for folder in a.cases for p in folder.glob("**/public/study.toml")):
        study = load_study(path)
        model = read_model(study.model_file, units=study.units, parameters=study.parameters)
        test = study.read_recordings()
        pairing, zeta = pair_test(test, model), study.damping_ratio
        names = [str(c.dof) for c in next(r for r in test if r.role == "fit").sensors]
        for what, (order, factors, force, concerned) in mistakes(rng, len(names)).items():
            seen = otherwise(test, order, factors, force)
            found = doubts_found(model, seen, pairing, zeta).of_recordings
            told = corrected(corrections_of(model, pairing, zeta, seen, found), what, names, concerned)
            own = counts.setdefault(what, [0, 0, 0, 0])
            for i, value in enumerate((True, bool(found), *told)):
                own[i] += value
    for what, (n, doubted, right, wrong) in counts.items():
        print(f"{what}: doubted {doubted} of {n}, right {right}, wrong {wrong}")


if __name__ == "__main__":
    main()
