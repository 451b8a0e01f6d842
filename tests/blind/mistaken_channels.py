#!/usr/bin/env python3
"""How often mistakes with channels are told:  mistaken_channels.py CASES... [--exchanges 2]

Of every case the recordings to be fitted are doubted as they are (what is told then is false), with two random sensors
exchanged, with one in other units or upside down, and, those with a force, with one that is said to be at a random node
of the model, of its own direction; recordings without their force (`ambient_cases.py`,
`generate.py --unmeasured`) by their time records. Prints how many of each are told, and the mistakes that are not.
"""

from __future__ import annotations

import argparse
import pathlib
from dataclasses import replace

import numpy as np

from femend import Dof
from femend.data import Test, TimeData
from femend.diagnose.staged.prepare import FrfData, frf_data
from femend.estimate import pair_test
from femend.model import read_model
from femend.study import load_study
from femend.study.doubts import plausible

# 1/g, mm for m, upside down
FACTORS = (1 / 9.80665, 1000.0, -1.0)


class Case:
    """A study whose doubts are told of FRFs that are changed on the way."""

    def __init__(self, path: pathlib.Path) -> None:
        study = load_study(path)
        self.model, self.test = read_model(study.model_file, units=study.units), study.read_recordings()
        self.zeta, self.pairing = study.damping_ratio, pair_test(self.test, self.model)
        fit = next(r for r in self.test if r.role == "fit")
        self.measured = fit.excitation == "measured"
        found = frf_data(fit).outputs if self.measured else [c.dof for c in fit.response.channels]
        self.sensors = [str(d) for d in found]

    def doubts(self, order: list[int], factors: np.ndarray) -> list[str]:
        """What is told with the rows of all FRFs in another `order` and multiplied by `factors` (n_out)."""
        if not self.measured:
            test = Test(tuple(replace(r, data=read_otherwise(r.time, order, factors)) for r in self.test))
            return plausible.doubts_found(self.model, test, self.pairing, self.zeta).texts

        def changed(recording: object) -> FrfData:
            data = frf_data(recording)  # type: ignore[arg-type]
            of = factors[None, :, None]
            return replace(data, H=(data.H * of)[:, order], noise=(data.noise * np.abs(of))[:, order])

        real, plausible.frf_data = plausible.frf_data, changed  # type: ignore[assignment]
        try:
            return plausible.doubts_found(self.model, self.test, self.pairing, self.zeta).texts
        finally:
            plausible.frf_data = real

    def misplaced(self, k: int, rng: np.random.Generator) -> tuple[str, list[str]]:
        """A random place of sensor `k`, and what is told with it there."""
        own = self.pairing[Dof.parse(self.sensors[k])]
        nodes = [int(n) for n in self.model.node_ids if int(n) != own.dof.node]
        dof = Dof(int(rng.choice(nodes)), own.dof.component, own.dof.sign)
        pairs = [replace(p, dof=dof) if p is own else p for p in self.pairing]
        paired = replace(self.pairing, pairs=tuple(pairs))
        return str(dof), plausible.doubts_found(self.model, self.test, paired, self.zeta).texts


def read_otherwise(data: TimeData, order: list[int], factors: np.ndarray) -> TimeData:
    """Responses with their values in another `order` and multiplied by `factors`; forces as they are."""
    rows = [i for i, c in enumerate(data.channels) if c.quantity != "force"]
    values = np.array(data.values)
    values[rows] = (factors[:, None] * data.values[rows])[order]
    return replace(data, values=values)


def main() -> None:
    """Count and print."""
    ap = argparse.ArgumentParser(description=__doc__)
    ap.add_argument("cases", type=pathlib.Path, nargs="+")
    ap.add_argument("--exchanges", type=int, default=2, help="random exchanges a case")
    a = ap.parse_args()
    kinds = ("nothing", "exchanged", "units or sign", "elsewhere")
    rng, told = np.random.default_rng(1), {kind: [0, 0] for kind in kinds}
    confused = others = 0
    for path in sorted(p for folder in a.cases for p in folder.glob("**/public/study.toml")):
        case, name = Case(path), path.parents[1].name
        n = len(case.sensors)
        same, ones = list(range(n)), np.ones(n)
        told["nothing"][0] += bool(case.doubts(same, ones))
        told["nothing"][1] += 1
        for _ in range(a.exchanges):
            i, j = sorted(int(k) for k in rng.choice(n, 2, replace=False))
            order = list(same)
            order[i], order[j] = j, i
            hit = any(
                "exchanged" in t and case.sensors[i] in t and case.sensors[j] in t for t in case.doubts(order, ones)
            )
            told["exchanged"][0] += hit
            told["exchanged"][1] += 1
            if not hit:
                print(f"{name}: {case.sensors[i]} and {case.sensors[j]} exchanged are not told")
        for factor in FACTORS:
            k = int(rng.integers(n))
            texts = case.doubts(same, np.where(np.arange(n) == k, factor, 1.0))
            told["units or sign"][0] += any(case.sensors[k] in t and "exchanged" not in t for t in texts)
            told["units or sign"][1] += 1
            confused += any("exchanged" in t for t in texts)
        for _ in range(a.exchanges if case.measured else 0):
            k = int(rng.integers(n))
            place, texts = case.misplaced(k, rng)
            moved = [t for t in texts if "does not move as the model does there" in t]
            hit = any(f"the sensor {case.sensors[k]} " in t for t in moved)
            told["elsewhere"][0] += hit
            told["elsewhere"][1] += 1
            others += len(moved) - hit
            if not hit:
                print(f"{name}: {case.sensors[k]} said to be at {place} is not told")
    for what, (n_told, of) in told.items():
        print(f"{what}: told {n_told} of {of}")
    print(f"units or sign told as exchanged: {confused}; other sensors told as standing elsewhere: {others}")


if __name__ == "__main__":
    main()
