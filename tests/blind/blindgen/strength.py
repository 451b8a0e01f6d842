"""How strong an effect is made: place, shape and strength drawn until it can be seen as well as was drawn."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from .catalogue import CATALOGUE
from .effects import Effect, Unsuitable
from .integrate import Modal
from .outside import outside
from .respond import Parts, modal_of, record, scene
from .setting import Test
from .update import Update

VISIBLE = (3.0, 60.0)  # times the noise ...
LOUDEST = 0.7  # ... but no more than this NRMSE
BEYOND = 1.5  # times the noise: what an update must leave unexplained ...
CARELESS = 0.15  # ... except in this share of the cases, where place and strength are drawn without regard to it


@dataclass
class Drawn:
    """An effect with its strength, its visibility and what of it the update cannot absorb (NRMSE at high level), by
    itself and, where there are two, as it shows beside the other."""

    effect: Effect
    x: float
    seen: float
    beyond: float
    beside: float | None = None


def visibility(test: Test, effect: Effect, x: float, base: np.ndarray, m: Modal | None) -> float:
    """NRMSE between the high recording with and without the effect."""
    try:
        y, _ = record(test, ((effect, x),), "high", m, coarser=2)
    except ArithmeticError:
        return float("inf")
    return float(np.linalg.norm(y - base) / np.linalg.norm(base))


def calibrate(test: Test, effect: Effect, target: float, base: np.ndarray) -> tuple[float, float]:
    """Strength whose visibility is the target (first crossing on a log grid, then bisection), and that visibility."""
    if effect.fixed:
        return 1.0, visibility(test, effect, 1.0, base, None)
    same = None if effect.change else modal_of(test, ((effect, 1.0),))  # a law leaves the modes alone
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


def bounded(test: Test, parts: Parts, base: np.ndarray) -> bool:
    """Whether the predicted recordings stay within twenty times the plain high level (a softening spring may run
    away).
    """
    m = modal_of(test, parts)
    try:
        return all(
            np.abs(record(test, parts, name, m)[0]).max() < 20 * np.abs(base).max() for name in ("sweep", "random")
        )
    except ArithmeticError:
        return False


def draw_effects(rng: np.random.Generator, test: Test, label: str, least: float = BEYOND) -> list[Drawn]:
    """The effects of a label: "clearance", "outside:wedge" or "two:added_mass+clearance", of each of which an update
    leaves at least `least` times the noise. Raises Unsuitable."""
    sc = scene(test, rng)
    base, _ = record(test, (), "high")
    update = Update(test, base)
    careless = rng.random() < CARELESS and least <= BEYOND
    names = label.removeprefix("two:").split("+") if label.startswith("two:") else [label]
    drawn: list[Drawn] = []
    for name in names:
        make = outside(name.removeprefix("outside:")) if name.startswith("outside:") else CATALOGUE[name]
        for _ in range(8):
            try:
                one = draw_one(rng, test, lambda make=make: make(sc), base, update, 0.0 if careless else least)
            except Unsuitable:
                continue
            if all(apart(test, one.effect, other.effect) for other in drawn):
                drawn.append(one)
                break
        else:
            raise Unsuitable(name)
    if len(drawn) > 1:
        if not bounded(test, tuple((d.effect, d.x) for d in drawn), base):
            raise Unsuitable(label)
        drawn = [replace(d, beside=beside(test, d, drawn, update)) for d in drawn]
        if least > BEYOND and min(d.beside or 0.0 for d in drawn) < least * test.noise:
            raise Unsuitable(label)
    return drawn


def beside(test: Test, one: Drawn, drawn: list[Drawn], update: Update) -> float:
    """NRMSE that an effect makes where the others are there too and the update cannot absorb."""
    both, _ = record(test, tuple((d.effect, d.x) for d in drawn), "high")
    others, _ = record(test, tuple((d.effect, d.x) for d in drawn if d is not one), "high")
    return update.left(both - others)


def apart(test: Test, a: Effect, b: Effect) -> bool:
    """Whether no node of one lies within 15 % of the structure's diagonal of the other's."""
    gaps = [np.linalg.norm(test.s.xyz[i] - test.s.xyz[j]) for i in a.nodes for j in b.nodes]
    return min(gaps) > 0.15 * test.s.span


def draw_one(rng: np.random.Generator, test: Test, make, base: np.ndarray, update: Update, least: float) -> Drawn:
    """One effect: a place that cannot show it is drawn again, a strength of which the update would leave less than
    `least` times the noise is raised (not where that is 0)."""
    top = min(test.noise * VISIBLE[1], LOUDEST)
    target = float(np.exp(rng.uniform(np.log(test.noise * VISIBLE[0]), np.log(top))))
    for _ in range(12):
        try:
            effect = make()
        except Unsuitable:
            continue
        for _ in range(1 if not least or effect.fixed else 4):
            x, v = calibrate(test, effect, target, base)
            if not ((effect.fixed and v > 2.5 * test.noise) or 0.6 * target < v < 1.7 * target):
                break
            y, _ = record(test, ((effect, x),), "high")
            beyond = update.left(y - base)
            if beyond > least * test.noise or not least:
                if bounded(test, ((effect, x),), base):
                    return Drawn(effect, x, v, beyond)
                break
            raised = target * float(np.clip(1.5 * least * test.noise / beyond, 1.3, 3.0))
            if raised > 1.3 * top:
                break
            target = min(raised, top)
    raise Unsuitable("cannot be seen")
