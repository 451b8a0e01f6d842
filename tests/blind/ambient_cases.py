#!/usr/bin/env python3
"""Ambient recordings of the structures that `generate.py` draws:  ambient_cases.py OUT --seed 61 --cases 24

White forces of drawn sizes act at all free nodes at once, or at a few (`--forces 2`); nothing but the responses is
recorded. The truth differs from the deck as in the controls (moduli, masses, mesh, damping) and lacks nothing, or has
one effect that changes the structure linearly (`--effect added_mass`, `joint_stiffness` ...). Seeds 1-99 are for
calibration.
"""

from __future__ import annotations

import argparse
import json
import os
import pathlib

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

import numpy as np  # noqa: E402
from blindgen import case, deck, fe, plan, uff58  # noqa: E402
from blindgen.plates import Plate  # noqa: E402
from blindgen.respond import changed, shapes  # noqa: E402
from blindgen.setting import Test  # noqa: E402
from blindgen.solids import Solid  # noqa: E402
from blindgen.truth import build  # noqa: E402

# modes that move with the ambient forces, as multiples of the sampling rate's half
TOP = 1.2


def responses(rng: np.random.Generator, test: Test, parts: tuple, seconds: float, n_forces: int) -> np.ndarray:
    """Accelerations (sensors, samples) under white forces at `n_forces` DOFs (0: all) of free nodes."""
    change = changed(parts)
    built = test.plain if change is None else build(test.s, test.real, change)
    w, phi = fe.modes(built.system, TOP * test.rate / 2)
    zeta = test.damping.of(built, phi)
    places = [(n, c) for n in test.s.free for c in test.s.axes]
    if n_forces:
        places = [places[i] for i in rng.choice(len(places), n_forces, replace=False)]
    into, out = (shapes(built, p).T @ phi for p in (places, test.sensors))
    n = int(seconds * test.rate)
    size = np.exp(0.5 * rng.standard_normal(len(places)))
    omega = 2 * np.pi * np.fft.rfftfreq(n, 1 / test.rate)
    white = np.zeros((len(w), omega.size), complex)
    for shape, s in zip(into, size, strict=True):
        white += shape[:, None] * np.fft.rfft(s * rng.standard_normal(n))
    gain = -(omega**2) / (w[:, None] ** 2 - omega**2 + 2j * zeta[:, None] * w[:, None] * omega)
    return np.fft.irfft(out @ (gain * white), n, axis=1)


def main() -> None:
    """Make the set."""
    ap = argparse.ArgumentParser(description=__doc__)
    ap.add_argument("out", type=pathlib.Path)
    ap.add_argument("--cases", type=int, default=24)
    ap.add_argument("--start", type=int, default=1)
    ap.add_argument("--seed", type=int, default=61)
    ap.add_argument("--seconds", type=float, default=120.0)
    ap.add_argument("--forces", type=int, default=0, help="so many DOFs are driven; without it all")
    ap.add_argument("--effect", help="label of the effect, as for generate.py; without it controls")
    ap.add_argument("--family", choices=list(case.FAMILIES))
    a = ap.parse_args()
    for index in range(a.start - 1, a.cases):
        rng = np.random.default_rng([a.seed, index])
        family = a.family or plan.family(a.seed, index, list(case.FAMILIES))
        label = plan.suited(a.effect or plan.label(a.seed, index, 1.0, "one"), family, True)
        noise = float(np.exp(rng.uniform(np.log(0.01), np.log(0.05))))
        test, drawn = case.make(rng, family, label, noise)
        folder = a.out / f"a{index + 1:04d}"
        public, sealed = folder / "public", folder / "sealed"
        public.mkdir(parents=True, exist_ok=True)
        sealed.mkdir(exist_ok=True)
        (public / "model.bdf").write_text(test.s.bulk() if isinstance(test.s, Plate | Solid) else deck.bulk(test.s))
        head = deck.study(folder.name, test.s.groups).split("\n[[recording]]")[0]
        own = '\n[[recording]]\nname = "ambient"\nfile = "ambient.uff"\nrole = "fit"\nexcitation = "ambient"\n'
        (public / "study.toml").write_text(head + own)
        y = responses(rng, test, tuple((d.effect, d.x) for d in drawn), a.seconds, a.forces)
        channels = [
            uff58.Channel(n, c, uff58.ACCELERATION, v)
            for (n, c), v in zip(test.sensors, case.noisy(rng, y, noise), strict=True)
        ]
        uff58.write(public / "ambient.uff", channels, "ambient", test.rate)
        truth = case.describe(test, drawn, label) | {"seed": a.seed, "index": index}
        (sealed / "truth.json").write_text(json.dumps(truth, indent=1))
        print(folder.name, label, family, f"noise {noise:.3f}", flush=True)


if __name__ == "__main__":
    main()
