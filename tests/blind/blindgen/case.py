"""One case from label and seed: draw, calibrate the visibility, simulate the five recordings, write public and
sealed folders.
"""

from __future__ import annotations

import dataclasses
import json
import pathlib
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from . import deck, excite, fe, uff58
from .effects import CATALOGUE, Effect, Place, Scene, Unsuitable
from .excite import Force
from .integrate import Law, Modal, simulate
from .laws import SPRING, pack
from .plates import Plate, plate
from .structures import FAMILIES as FRAMES
from .structures import Structure
from .truth import Built, Change, Damping, Real, build, modal, nominal

LEVELS = {"low": 1.5, "mid": 4.5, "high": 10.0, "sweep": 5.0, "random": 7.0}
SECONDS = {"low": 6.0, "mid": 6.0, "high": 6.0, "sweep": 6.0, "random": 4.0}
NOISE, FORCE_NOISE = 0.01, 0.004
VISIBLE = (3.0, 60.0)  # times the noise
BEYOND = 1.5  # times the noise: what the moduli and dampings must leave unexplained ...
CARELESS = 0.15  # ... except in this share of the cases, where place and strength are drawn without regard to it


@dataclass
class Test:
    """The virtual test: structure, truth without effect, its damping, shaker, sensors, rate, band and forces."""

    s: Structure
    real: Real
    plain: Built
    damping: Damping
    drive: tuple[int, int]
    sensors: list[tuple[int, int]]
    rate: float
    band: tuple[float, float]
    forces: dict[str, Force]
    excitation: str
    f_modes: np.ndarray


def draw_real(rng: np.random.Generator, s: Structure, kind: str) -> Real:
    """How the truth departs from the deck. kind: "exact", "parameters", "model_form" or "" (with an effect)."""
    form = str(rng.choice(["timoshenko", "timoshenko", "lumped", "bernoulli"]))
    wide, scatter, lump = {"exact": (0.0, 0.0, 0.0), "model_form": (0.0, 0.02, 0.02)}.get(kind, (0.10, 0.007, 0.015))

    def near(sd: float) -> float:
        return float(np.clip(1 + sd * rng.standard_normal(), 1 - 2.2 * sd, 1 + 2.2 * sd))

    return Real(
        {p: near(wide) for p in s.groups},
        np.array([near(scatter) for _ in s.members]),
        {p: near(0.4 * lump) for p in s.groups},
        {n: near(lump) for n in s.lumps},
        form,
        int(rng.integers(3, 6)),
        0.0 if kind == "exact" else rng.uniform(0.0, 0.02),
    )


FAMILIES = {**FRAMES, "plate": plate}
USUAL_TOP = {
    "plate": (150.0, 300.0),
    "plane frame": (200.0, 300.0),
    "cantilever": (340.0, 425.0),
    "space frame": (120.0, 190.0),
}


def carried_modes(s: Structure) -> tuple[np.ndarray, float]:
    """Frequencies (Hz) of the deck on a fine mesh, and up to where the deck's own mesh follows within 0.4 %."""
    plain = nominal(s)
    coarse, _ = fe.modes(build(s, plain).system, 1500.0)
    if isinstance(s, Plate):
        return coarse / (2 * np.pi), min(s.carried, 425.0)
    plain.n_sub = 4
    fine, _ = fe.modes(build(s, plain).system, 1500.0)
    f, n = fine / (2 * np.pi), min(len(fine), len(coarse))
    bad = np.flatnonzero(np.abs(coarse[:n] / fine[:n] - 1) > 0.004)
    return f, float(min(f[bad[0]] * 0.95 if len(bad) else f[n - 1], 425.0))


def choose_band(rng: np.random.Generator, s: Structure) -> tuple[float, tuple[float, float]]:
    """Sampling rate and band: usual for the family or by a count of modes (4-10), as far as the deck's own mesh
    carries it.

    Raises Unsuitable when fewer than three modes remain.
    """
    f, top = carried_modes(s)
    if rng.random() < 0.6:
        hi = min(float(rng.uniform(*USUAL_TOP[s.family])), top)
    else:
        inside = int(np.sum(f < top))
        count = int(rng.integers(min(4, inside), min(10, inside) + 1))
        hi = min(1.12 * f[count - 1], top)
    if np.sum(f < 0.97 * hi) < 3:
        raise Unsuitable("too few modes")
    return (1024.0 if hi > 190.0 else 512.0), (float(rng.uniform(0.5, 0.8) * f[0]), float(hi))


def draw_forces(rng: np.random.Generator, band: tuple[float, float], rate: float) -> tuple[str, dict[str, Force]]:
    """Five forces; fit recordings are all multisines or all random, with fresh phases in each."""
    kind = str(rng.choice(["multisine", "random"]))
    lines = excite.odd_lines(rng, band)
    out = {}
    for name in ("low", "mid", "high"):
        out[name] = excite.multisine(rng, lines) if kind == "multisine" else excite.noise(rng, band, rate, 6.0)
    f0 = band[0] * rng.uniform(1.1, 1.4)
    out["sweep"] = Force(sweep=(f0, max(band[1] * rng.uniform(0.45, 0.7), 3 * f0), 6.0))
    out["random"] = excite.noise(rng, (0.9 * band[0], band[1]), rate, 4.0)
    return kind, {k: excite.scaled(f, LEVELS[k], rate, SECONDS[k]) for k, f in out.items()}


def draw_test(rng: np.random.Generator, family: str, kind: str) -> Test:
    """Everything but the effect."""
    s = FAMILIES[family](rng)
    real = draw_real(rng, s, kind)
    plain = build(s, real)
    rate, band = choose_band(rng, s)
    w, phi = fe.modes(plain.system, 3000.0, 400)
    zeta = rng.uniform(0.006, 0.016, len(w)) * np.clip(w / (2 * np.pi * 1.5 * band[1]), 1.0, 2.0)
    places = [(n, c) for n in s.free for c in s.axes]
    drive = places[int(rng.integers(len(places)))]
    some = [places[i] for i in rng.choice(len(places), min(s.n_sensors, len(places)), replace=False)]
    kind_of, forces = draw_forces(rng, band, rate)
    names = {name: i for i, name in enumerate(plain.names)}
    return Test(
        s,
        real,
        plain,
        Damping(names, phi, zeta),
        drive,
        sorted({*some, drive}),
        rate,
        band,
        forces,
        kind_of,
        w / (2 * np.pi),
    )


def shapes(test: Test, built: Built, places: list[tuple[int, int]]) -> np.ndarray:
    """Unit vectors (n, places)."""
    return np.column_stack([built.system.vector((n, c, 1.0)) for n, c in places])


def modal_of(test: Test, effect: Effect | None, x: float) -> Modal:
    """Modal truth with the effect's structural change, law shape and extra inputs at strength x."""
    change = effect.change(x) if effect is not None and effect.change else Change()
    built = build(test.s, test.real, change) if effect is not None and effect.change else test.plain
    loads, ground = [test.drive], None
    law = np.zeros((built.system.K.shape[0], 0))
    if effect is not None and effect.law:
        comp = {"X": 1, "Y": 2, "Z": 3}[effect.direction]
        law = direction(built, effect.nodes, comp)[:, None]
    if effect is not None and effect.inputs == "misplaced":
        loads = [effect.extra["true"]]
    elif effect is not None and effect.inputs == "force":
        loads.append((effect.nodes[0], effect.extra["comp"]))
    elif effect is not None and effect.inputs == "base":
        ground = (effect.extra["comp"], [c for _, c in test.sensors])
    return modal(
        built, test.damping, 3.0 * test.rate, shapes(test, built, loads), shapes(test, built, test.sensors), law, ground
    )


def direction(built: Built, nodes: list[int], comp: int) -> np.ndarray:
    """Law coordinate: one node against ground, or the second node against the first."""
    if len(nodes) == 1:
        return built.system.vector((nodes[0], comp, 1.0))
    return built.system.vector((nodes[0], comp, -1.0), (nodes[1], comp, 1.0))


def record(
    test: Test, effect: Effect | None, x: float, name: str, m: Modal | None = None, coarser: int = 1
) -> tuple[np.ndarray, np.ndarray]:
    """Clean accelerations (sensors, samples) and the law's trace for one recording."""
    m = m or modal_of(test, effect, x)
    inputs = [test.forces[name]]
    if effect is not None and effect.force:
        inputs.append(effect.force(x))
    local = [effect.law(x)] if effect is not None and effect.law else []
    n = int(test.rate * SECONDS[name])
    return simulate(m, local, inputs, test.rate, n, (effect.over if effect is not None else 8) // coarser)


def scene(test: Test, rng: np.random.Generator) -> Scene:
    """What an effect may look at: motion without the effect at high level, place by place."""
    s, built = test.s, test.plain
    places = [(n, c) for n in s.free for c in (1, 2, 3) if str(c) not in s.held]
    index = {p: i for i, p in enumerate(places)}
    cols = shapes(test, built, places)
    w, phi = fe.modes(built.system, 3.0 * test.rate)
    lu = fe.spla.splu(built.system.K)
    laws = [Law(SPRING, pack(0.0)) for _ in places]
    probe = modal(built, test.damping, 3.0 * test.rate, shapes(test, built, [test.drive]), cols[:, :1], cols)
    _, trace = simulate(probe, laws, [test.forces["high"]], test.rate, int(6 * test.rate), 4)

    @cache
    def look_at(nodes: tuple[int, ...], comp: int) -> Place:
        b = direction(built, list(nodes), comp)
        sel = [index[n, comp] for n in nodes]
        d = trace[sel[0], 0] if len(sel) == 1 else trace[sel[1], 0] - trace[sel[0], 0]
        v = trace[sel[0], 1] if len(sel) == 1 else trace[sel[1], 1] - trace[sel[0], 1]
        return Place(list(nodes), comp, float(d.std()), float(v.std()), float(1 / (b @ lu.solve(b))))

    def participation(p: Place) -> np.ndarray:
        b = direction(built, p.nodes, p.comp)
        gain = np.abs((phi.T @ b) * (phi.T @ cols[:, index[test.drive]])) / np.sqrt(w)
        return np.where(inband := (w < 2 * np.pi * test.band[1]), gain, 0.0)[inband] / gain[inband].sum()

    return Scene(
        s,
        rng,
        test.band,
        w / (2 * np.pi),
        s.total,
        test.drive,
        lambda nodes, comp: look_at(tuple(nodes), comp),
        participation,
    )


def visibility(test: Test, effect: Effect, x: float, base: np.ndarray, m: Modal | None) -> float:
    """NRMSE between the high recording with and without the effect."""
    try:
        y, _ = record(test, effect, x, "high", m, coarser=2)
    except ArithmeticError:
        return float("inf")
    return float(np.linalg.norm(y - base) / np.linalg.norm(base))


def absorbing(test: Test, base: np.ndarray) -> np.ndarray:
    """Orthonormal directions (samples x k) in which small changes of the moduli and modal dampings move the high
    recording.
    """
    columns = []
    for p in test.s.groups:
        real = dataclasses.replace(test.real, factor={**test.real.factor, p: test.real.factor[p] * 1.002})
        other = dataclasses.replace(test, real=real, plain=build(test.s, real))
        columns.append((record(other, None, 0.0, "high")[0] - base).ravel())
    m = modal_of(test, None, 0.0)
    for r in np.flatnonzero(m.omega < 2 * np.pi * 1.2 * test.band[1]):
        zeta = m.zeta.copy()
        zeta[r] *= 1.02
        columns.append((record(test, None, 0.0, "high", dataclasses.replace(m, zeta=zeta))[0] - base).ravel())
    J = np.column_stack(columns)
    J /= np.linalg.norm(J, axis=0) + 1e-300
    u, sv, _ = np.linalg.svd(J, full_matrices=False)
    return u[:, sv > 1e-8 * sv[0]]


def beyond_update(test: Test, effect: Effect, x: float, base: np.ndarray, basis: np.ndarray) -> float:
    """Visibility that no small change of the moduli and modal dampings absorbs: NRMSE outside `basis`."""
    e = (record(test, effect, x, "high")[0] - base).ravel()
    return float(np.linalg.norm(e - basis @ (basis.T @ e)) / np.linalg.norm(base))


def calibrate(test: Test, effect: Effect, target: float, base: np.ndarray) -> tuple[float, float]:
    """Strength whose visibility is the target (first crossing on a log grid, then bisection). Raises Unsuitable."""
    if effect.fixed:
        return 1.0, visibility(test, effect, 1.0, base, None)
    same = None if effect.change else modal_of(test, effect, 1.0)  # a law leaves the modes alone
    grid = np.geomspace(*effect.span, 9)
    last = None
    for x in grid:
        v = visibility(test, effect, x, base, same)
        if v >= target:
            break
        last = (x, v)
    else:
        assert last is not None
        return last
    lo, hi, best = (last[0] if last else grid[0] / 30), x, (x, v)
    for _ in range(7):
        mid = float(np.sqrt(lo * hi))
        v = visibility(test, effect, mid, base, same)
        if abs(np.log(v / target)) < abs(np.log(best[1] / target)):
            best = (mid, v)
        if abs(np.log(v / target)) < 0.08:
            break
        lo, hi = (lo, mid) if v > target else (mid, hi)
    return best


def bounded(test: Test, effect: Effect, x: float, base: np.ndarray) -> bool:
    """Whether the predicted recordings stay within twenty times the plain high level (a softening spring may run
    away).
    """
    m = modal_of(test, effect, x)
    try:
        return all(
            np.abs(record(test, effect, x, name, m)[0]).max() < 20 * np.abs(base).max() for name in ("sweep", "random")
        )
    except ArithmeticError:
        return False


@dataclass
class Drawn:
    """An effect with its strength, its visibility and what of it the update cannot absorb (NRMSE at high level)."""

    effect: Effect
    x: float
    seen: float
    beyond: float


def draw_effect(rng: np.random.Generator, test: Test, name: str) -> Drawn:
    """Place, shape and strength; a place that cannot show the effect is drawn again, a strength the update would
    hide is raised.
    """
    sc = scene(test, rng)
    base, _ = record(test, None, 0.0, "high")
    basis = absorbing(test, base)
    target = NOISE * float(np.exp(rng.uniform(*np.log(VISIBLE))))
    careless = rng.random() < CARELESS
    for _ in range(15):
        try:
            effect = CATALOGUE[name](sc)
        except Unsuitable:
            continue
        for _ in range(1 if careless or effect.fixed else 4):
            x, v = calibrate(test, effect, target, base)
            if not ((effect.fixed and v > 2.5 * NOISE) or 0.6 * target < v < 1.7 * target):
                break
            beyond = beyond_update(test, effect, x, base, basis)
            if careless or beyond > BEYOND * NOISE:
                if bounded(test, effect, x, base):
                    return Drawn(effect, x, v, beyond)
                break
            target = min(target * float(np.clip(1.5 * BEYOND * NOISE / beyond, 1.3, 3.0)), NOISE * VISIBLE[1])
    raise Unsuitable(name)


def make(rng: np.random.Generator, family: str, label: str) -> tuple[Test, Drawn | None]:
    """Test and effect for a label such as "clearance" or "none:exact"."""
    kind = label.split(":")[1] if label.startswith("none") else ""
    for _ in range(40):
        try:
            test = draw_test(rng, family, kind)
            if label.startswith("none"):
                return test, None
            return test, draw_effect(rng, test, label)
        except Unsuitable:
            continue
    raise RuntimeError(f"no structure of family {family} could show {label}")


def noisy(rng: np.random.Generator, y: np.ndarray, level: float) -> np.ndarray:
    """Add white noise of `level` times each channel's RMS."""
    return y + level * np.sqrt(np.mean(y**2, axis=-1, keepdims=True)) * rng.standard_normal(y.shape)


def write_case(folder: pathlib.Path, seed: int, index: int, family: str, label: str) -> dict[str, Any]:
    """Make and write one case; returns its truth."""
    rng = np.random.default_rng([seed, index])
    test, drawn = make(rng, family, label)
    effect, x = (drawn.effect, drawn.x) if drawn else (None, 0.0)
    public, sealed = folder / "public", folder / "sealed"
    public.mkdir(parents=True, exist_ok=True)
    sealed.mkdir(exist_ok=True)
    (public / "model.bdf").write_text(test.s.bulk() if isinstance(test.s, Plate) else deck.bulk(test.s))
    (public / "study.toml").write_text(deck.study(folder.name, test.s.groups))
    m = modal_of(test, effect, x)
    for name, force in test.forces.items():
        acc, _ = record(test, effect, x, name, m)
        u = noisy(rng, force.at(test.rate, acc.shape[1]), FORCE_NOISE)
        channels = [uff58.Channel(*test.drive, uff58.FORCE, u)]
        channels += [
            uff58.Channel(n, c, uff58.ACCELERATION, y)
            for (n, c), y in zip(test.sensors, noisy(rng, acc, NOISE), strict=True)
        ]
        hidden = name in ("sweep", "random")
        uff58.write(public / f"{name}.uff", channels[:1] if hidden else channels, name, test.rate)
        if hidden:
            uff58.write(sealed / f"{name}.uff", channels, name, test.rate)
    truth = describe(test, drawn, label) | {"seed": seed, "index": index}
    (sealed / "truth.json").write_text(json.dumps(truth, indent=1))
    return truth


def describe(test: Test, drawn: Drawn | None, label: str) -> dict[str, Any]:
    """truth.json without the seed."""
    effect = drawn.effect if drawn else None
    out: dict[str, Any] = {
        "effect": effect.name if effect else "none",
        "nodes": effect.nodes if effect else [],
        "node_xyz": {str(n): [float(q) for q in p] for n, p in test.s.xyz.items()},
    }
    if effect and drawn:
        out |= {
            "direction": effect.direction,
            "to": effect.to,
            "parameters": effect.values(drawn.x),
            "kind": effect.extra.get("kind", ""),
        }
    else:
        out["control"] = label.split(":")[1]
    return out | {
        "visibility": drawn.seen / NOISE if drawn else 0.0,
        "visibility_beyond_update": drawn.beyond / NOISE if drawn else 0.0,
        "family": test.s.family,
        "excitation": test.excitation,
        "band": test.band,
        "rate": test.rate,
        "modes": [round(float(f), 3) for f in test.f_modes[:14]],
        "zeta": [round(float(z), 5) for z in test.damping.zeta[:14]],
        "E_factor": {test.s.groups[p]: f for p, f in test.real.factor.items()},
        "mesh": [test.real.form, test.real.n_sub],
    }
