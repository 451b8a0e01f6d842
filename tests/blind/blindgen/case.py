"""One case from label and seed: draw, simulate the five recordings, write public and sealed folders."""

from __future__ import annotations

import json
import pathlib
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from . import deck, frfs, uff58
from .acquire import AFTER, FINER, sampled
from .effects import Unsuitable
from .excite import Force
from .integrate import Modal
from .plates import Plate
from .respond import Parts, modal_of, record, record_force
from .setting import ALONE, EXCITATIONS, FAMILIES, FRAMES, Test, draw_across, draw_gains, draw_test
from .solids import Solid
from .strength import BEYOND, Drawn, draw_effects

__all__ = ["ALONE", "EXCITATIONS", "FAMILIES", "FRAMES", "Options", "make", "write_case"]

FORCE_NOISE = 0.004


@dataclass(frozen=True)
class Options:
    """What a whole set has in common: range of the sensors' noise, whether the shaker's force stays unrecorded, what an
    update has to leave of every effect (times the noise), the kind of force ("": multisine or random, drawn), whether
    the recorder filters before it samples, what sensors pick up of motion across them, how far the calibration of
    sensors and force is off (standard deviations), how many times as far as the band the forces reach, how many times
    as long as usual recordings that are fitted are, and whether FRFs are what an update may use."""

    noise: tuple[float, float] = (0.01, 0.05)
    unmeasured: bool = False
    beyond: float = BEYOND
    excitation: str = ""
    filtered: bool = True
    across: float = 0.0
    gain: float = 0.0
    reach: float = 1.0
    long: float = 1.0
    frf: bool = False


def make(
    rng: np.random.Generator,
    family: str,
    label: str,
    noise: float,
    beyond: float = BEYOND,
    excitation: str = "",
    reach: float = 1.0,
    long: float = 1.0,
) -> tuple[Test, list[Drawn]]:
    """Test and effects for a label such as "clearance", "none:exact", "outside:wedge" or "two:added_mass+clearance"."""
    kind = label.split(":")[1] if label.startswith("none") else ""
    for _ in range(40):
        try:
            test = draw_test(rng, family, kind, noise, excitation, reach, long)
            return test, [] if label.startswith("none") else draw_effects(rng, test, label, beyond)
        except Unsuitable:
            continue
    raise RuntimeError(f"no structure of family {family} could show {label}")


def noisy(rng: np.random.Generator, y: np.ndarray, level: float) -> np.ndarray:
    """Add white noise of `level` times each channel's RMS."""
    return y + level * np.sqrt(np.mean(y**2, axis=-1, keepdims=True)) * rng.standard_normal(y.shape)


def write_case(
    folder: pathlib.Path, seed: int, index: int, family: str, label: str, options: Options = Options()
) -> dict[str, Any]:
    """Make and write one case; returns its truth."""
    rng = np.random.default_rng([seed, index])
    noise = float(np.exp(rng.uniform(*np.log(options.noise))))
    test, drawn = make(rng, family, label, noise, options.beyond, options.excitation, options.reach, options.long)
    # drawn apart, so that the case is otherwise the same without it
    test.across = draw_across(np.random.default_rng([seed, index, 79]), test, options.across)
    test.gains = draw_gains(np.random.default_rng([seed, index, 80]), test, options.gain)
    parts = tuple((d.effect, d.x) for d in drawn)
    public, sealed = folder / "public", folder / "sealed"
    public.mkdir(parents=True, exist_ok=True)
    sealed.mkdir(exist_ok=True)
    (public / "model.bdf").write_text(test.s.bulk() if isinstance(test.s, Plate | Solid) else deck.bulk(test.s))
    m = modal_of(test, parts)
    fitted = deck.FITTED
    if options.frf:
        fitted = write_frfs(public, np.random.default_rng([seed, index, 81]), test, parts, noise, options.filtered)
    (public / "study.toml").write_text(deck.study(folder.name, test.s.groups, options.unmeasured, fitted))
    for name, force in test.forces.items():
        if options.frf and name in deck.FITTED:
            continue
        acc, _ = record(test, parts, name, m, filtered=options.filtered)
        n = acc.shape[1]
        u = sampled(force.at(FINER * test.rate, FINER * (n + AFTER)), n, options.filtered)
        u, acc = noisy(rng, u, FORCE_NOISE), noisy(rng, acc, noise)
        if test.gains is not None:
            u, acc = u * test.gains[0], acc * test.gains[1:, None]
        channels = [uff58.Channel(*test.drive, uff58.FORCE, u)]
        channels += [uff58.Channel(n, c, uff58.ACCELERATION, y) for (n, c), y in zip(test.sensors, acc, strict=True)]
        hidden = name in ("sweep", "random")
        shown = channels[:1] if hidden else channels[1:] if options.unmeasured else channels
        uff58.write(public / f"{name}.uff", shown, name, test.rate)
        if hidden:
            uff58.write(sealed / f"{name}.uff", channels, name, test.rate)
    truth = describe(test, drawn, label) | {"unmeasured": options.unmeasured, "seed": seed, "index": index}
    (sealed / "truth.json").write_text(json.dumps(truth, indent=1))
    return truth


def write_frfs(
    public: pathlib.Path, rng: np.random.Generator, test: Test, parts: Parts, noise: float, filtered: bool
) -> tuple[str, ...]:
    """Write the FRFs of each place of the shaker; the recordings' names."""
    kind = str(rng.choice(["multisine", "noise"]))
    names = []
    for i, drive in enumerate(frfs.drives(rng, test), 1):
        there = replace(test, drive=drive)
        m = modal_of(there, parts)

        def recorded(force: Force, n: int, there: Test = there, m: Modal = m) -> tuple[np.ndarray, np.ndarray]:
            u, y = record_force(there, parts, force, n, m, filtered)
            return noisy(rng, u, FORCE_NOISE), noisy(rng, y, noise)

        names.append(f"frf{i}")
        uff58.write(public / f"frf{i}.uff", frfs.measured(rng, there, kind, recorded), f"frf{i}", test.rate)
    return tuple(names)


def told(d: Drawn, noise: float) -> dict[str, Any]:
    """What truth.json says of one effect."""
    e = d.effect
    out = {
        "effect": e.name,
        "nodes": e.nodes,
        "direction": e.direction,
        "to": e.to,
        "parameters": e.values(d.x),
        "kind": e.extra.get("kind", ""),
        "visibility": d.seen / noise,
        "visibility_beyond_update": d.beyond / noise,
    }
    if d.beside is not None:
        out["visibility_beside_the_other"] = d.beside / noise
    return out | {k: e.extra[k] for k in ("law", "class", "families") if k in e.extra}


def describe(test: Test, drawn: list[Drawn], label: str) -> dict[str, Any]:
    """truth.json without the seed."""
    out: dict[str, Any]
    if not drawn:
        out = {"effect": "none", "nodes": [], "control": label.split(":")[1]}
        out |= {"visibility": 0.0, "visibility_beyond_update": 0.0}
    elif len(drawn) == 1:
        out = told(drawn[0], test.noise)
    else:
        each = [told(d, test.noise) for d in drawn]
        out = {"effect": "two", "effects": each, "nodes": [n for e in each for n in e["nodes"]]}
        for key in ("visibility", "visibility_beyond_update", "visibility_beside_the_other"):
            out[key] = min(e[key] for e in each)  # both have to be found
    return out | {
        "node_xyz": {str(n): [float(q) for q in p] for n, p in test.s.xyz.items()},
        "noise": test.noise,
        "family": test.s.family,
        "excitation": test.excitation,
        "band": test.band,
        "rate": test.rate,
        "modes": [round(float(f), 3) for f in test.f_modes[:14]],
        "zeta": [round(float(z), 5) for z in test.damping.zeta[:14]],
        "E_factor": {test.s.groups[p]: f for p, f in test.real.factor.items()},
        "mesh": [test.real.form, test.real.n_sub],
    }
