"""What the virtual test would record, with any number of effects in the truth, and what an effect may look at."""

from __future__ import annotations

from functools import cache

import numpy as np

from . import fe
from .acquire import AFTER, FINER, sampled
from .effects import Effect, Place, Scene, Unsuitable
from .excite import Force
from .integrate import Law, Modal, simulate
from .laws import SPRING, pack
from .setting import Test
from .truth import Built, Change, build, modal

Parts = tuple[tuple[Effect, float], ...]  # the effects in the truth with their strengths


def shapes(built: Built, places: list[tuple[int, int]]) -> np.ndarray:
    """Unit vectors (n, places)."""
    return np.column_stack([built.system.vector((n, c, 1.0)) for n, c in places])


def sensed(built: Built, test: Test) -> np.ndarray:
    """What the sensors see (n, sensors): their own axis, and a little of the others."""
    seen = shapes(built, test.sensors)
    for (place, c), share in test.across.items():
        seen[:, test.sensors.index(place)] += share * built.system.vector((place[0], c, 1.0))
    return seen


def direction(built: Built, nodes: list[int], comp: int) -> np.ndarray:
    """Law coordinate: one node against ground, or the second node against the first."""
    if len(nodes) == 1:
        return built.system.vector((nodes[0], comp, 1.0))
    return built.system.vector((nodes[0], comp, -1.0), (nodes[1], comp, 1.0))


def changed(parts: Parts) -> Change | None:
    """All structural changes as one; None without any. Raises Unsuitable for two hinges or patches."""
    changes = [e.change(x) for e, x in parts if e.change]
    out = Change()
    for c in changes:
        if out.hinge is not None and c.hinge is not None:
            raise Unsuitable("two hinges")
        if out.patch is not None and c.patch is not None:
            raise Unsuitable("two patches")
        out.hinge, out.patch = out.hinge or c.hinge, out.patch or c.patch
        for i, f in c.weaker.items():
            out.weaker[i] = out.weaker.get(i, 1.0) * f
        for n, m in c.mass.items():
            out.mass[n] = out.mass.get(n, 0.0) + m
        out.support.update(c.support)
    return out if changes else None


def modal_of(test: Test, parts: Parts) -> Modal:
    """Modal truth with the structural changes, law shapes and extra inputs of the effects."""
    change = changed(parts)
    built = test.plain if change is None else build(test.s, test.real, change)
    loads, ground = [test.drive], None
    columns = [np.zeros((built.system.K.shape[0], 0))]
    for effect, _ in parts:
        if effect.law:
            columns.append(direction(built, effect.nodes, {"X": 1, "Y": 2, "Z": 3}[effect.direction])[:, None])
        if effect.inputs == "misplaced":
            loads[0] = effect.extra["true"]
        elif effect.inputs == "force":
            loads.append((effect.nodes[0], effect.extra["comp"]))
        elif effect.inputs == "base":
            ground = (effect.extra["comp"], [c for _, c in test.sensors])
    return modal(
        built,
        test.damping,
        3.0 * test.rate,
        shapes(built, loads),
        sensed(built, test),
        np.hstack(columns),
        ground,
    )


def record(
    test: Test, parts: Parts, name: str, m: Modal | None = None, coarser: int = 1, filtered: bool = True
) -> tuple[np.ndarray, np.ndarray]:
    """Clean accelerations (sensors, samples) as the recorder gives them, and the laws' traces for one recording."""
    n = int(test.rate * test.seconds(name))
    acc, trace = moved(test, parts, test.forces[name], n, m or modal_of(test, parts), coarser)
    return sampled(acc, n, filtered), trace[..., : FINER * n : FINER]


def record_force(
    test: Test, parts: Parts, force: Force, n: int, m: Modal, filtered: bool = True
) -> tuple[np.ndarray, np.ndarray]:
    """Clean force (n,) and accelerations (sensors, n) as the recorder gives them of `n` samples under any force."""
    acc, _ = moved(test, parts, force, n, m)
    u = force.at(FINER * test.rate, FINER * (n + AFTER))
    return sampled(u, n, filtered), sampled(acc, n, filtered)


def moved(test: Test, parts: Parts, force: Force, n: int, m: Modal, coarser: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """Accelerations and the laws' traces at the finer rate."""
    inputs = [force, *(e.force(x) for e, x in parts if e.force)]
    local = [e.law(x) for e, x in parts if e.law]
    over = max([8, *(e.over for e, _ in parts)])
    return simulate(m, local, inputs, FINER * test.rate, FINER * (n + AFTER), over // coarser // FINER)


def scene(test: Test, rng: np.random.Generator) -> Scene:
    """What an effect may look at: motion without the effect at high level, place by place."""
    s, built = test.s, test.plain
    places = [(n, c) for n in s.free for c in (1, 2, 3) if str(c) not in s.held]
    index = {p: i for i, p in enumerate(places)}
    cols = shapes(built, places)
    w, phi = fe.modes(built.system, 3.0 * test.rate)
    lu = fe.spla.splu(built.system.K)
    laws = [Law(SPRING, pack(0.0)) for _ in places]
    probe = modal(built, test.damping, 3.0 * test.rate, shapes(built, [test.drive]), cols[:, :1], cols)
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
