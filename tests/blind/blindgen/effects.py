"""The catalogue of concealed effects: for each a draw of place and shape, and the meaning of one strength number.

Strength is dimensionless (relative to the local static stiffness and the motion the place would have without the
effect); it is
set afterwards by `calibrate` so that the effect is as visible at the sensors as was drawn.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from . import excite, laws
from .excite import Force
from .integrate import Law
from .plates import LAYER, Plate
from .solids import Solid
from .structures import Structure
from .truth import Change


class Unsuitable(Exception):
    """The drawn place cannot show this effect; draw again."""


@dataclass
class Place:
    """Where a law acts: nodes, component, and at high level without the effect: RMS displacement and speed; static
    stiffness.
    """

    nodes: list[int]
    comp: int
    d: float
    v: float
    k: float


@dataclass
class Scene:
    """What the draws need to know of the case."""

    s: Structure
    rng: np.random.Generator
    band: tuple[float, float]
    f: np.ndarray  # Hz, modes of the truth
    total: float  # kg
    drive: tuple[int, int]
    look: Callable[[list[int], int], Place]
    participation: Callable[[Place], np.ndarray]  # share of each mode in the place's speed at high level


@dataclass
class Effect:
    """A drawn effect. `law(x)`, `change(x)` and `force(x)` give the truth at strength x; `values(x)` the parameters
    for the record.
    """

    name: str
    nodes: list[int]
    direction: str
    to: str
    span: tuple[float, float]
    values: Callable[[float], dict[str, Any]]
    law: Callable[[float], Law] | None = None
    change: Callable[[float], Change] | None = None
    force: Callable[[float], Force] | None = None
    inputs: str = ""  # "base" | "force" | "misplaced"
    over: int = 8
    fixed: bool = False
    extra: dict[str, Any] = field(default_factory=dict)


AXIS = {1: "X", 2: "Y", 3: "Z", 4: "RX", 5: "RY", 6: "RZ"}


def somewhere(sc: Scene, pair: float = 0.0) -> Place:
    """A joint (or, with probability `pair`, two joints of different storeys) that moves in the direction drawn."""
    s, rng = sc.s, sc.rng
    if isinstance(s, Plate) and s.layers > 1:
        return across(sc, s)
    comps = [1, 1, 1, 3] if s.family == "plane frame" else s.axes
    levels = {s.levels[n] for n in s.free}
    if rng.random() < pair and len(levels) > 1 and s.family != "cantilever":
        a = int(rng.choice(s.free))
        nodes = [a, int(rng.choice([n for n in s.free if s.levels[n] != s.levels[a]]))]
        comp = int(rng.choice(s.axes))
    else:
        nodes, comp = [int(rng.choice(s.free))], int(rng.choice(comps))
    best = max(sc.look([n], c).d for n in s.free for c in s.axes)
    place = sc.look(sorted(nodes), comp)
    if place.d < 0.05 * best:
        raise Unsuitable("hardly moves")
    return place


def across(sc: Scene, s: Plate) -> Place:
    """Two points of two plates that face each other, moving apart."""
    a = int(sc.rng.choice([n for n in s.free if s.levels[n] == 0 and n not in s.ties]))
    place = sc.look([a, a + LAYER], 3)
    if place.d < 0.05 * max(sc.look([n], 3).d for n in s.free):
        raise Unsuitable("hardly moves")
    return place


def local(
    name: str,
    p: Place,
    span: tuple[float, float],
    code: int,
    par: Callable[[float], list[float]],
    values: Callable[[float], dict[str, Any]],
    over: int = 8,
) -> Effect:
    """An effect that is a local law at a place."""
    return Effect(
        name,
        p.nodes,
        AXIS[p.comp],
        "ground" if len(p.nodes) == 1 else "node",
        span,
        values,
        law=lambda x: Law(code, laws.pack(*par(x))),
        over=over,
    )


def log_uniform(rng: np.random.Generator, lo: float, hi: float) -> float:
    """Log-uniform draw."""
    return float(np.exp(rng.uniform(np.log(lo), np.log(hi))))


def support_stiffness(sc: Scene) -> Effect:
    """Spring to ground."""
    p = somewhere(sc)
    return local("support_stiffness", p, (3e-3, 30.0), laws.SPRING, lambda x: [x * p.k], lambda x: {"k": x * p.k})


def viscous_damper(sc: Scene) -> Effect:
    """Dashpot to ground or between storeys."""
    p = somewhere(sc, 0.4)
    c = p.k * p.d / p.v
    return local("viscous_damper", p, (1e-3, 10.0), laws.DASHPOT, lambda x: [x * c], lambda x: {"c": x * c})


def corner(sc: Scene, p: Place) -> float:
    """A circular frequency where the place moves: one of its modes by share, spread by a factor 1.6."""
    share = sc.participation(p)
    return float(2 * np.pi * sc.f[sc.rng.choice(len(share), p=share)] * log_uniform(sc.rng, 1 / 1.6, 1.6))


def viscoelastic(sc: Scene) -> Effect:
    """Zener element to ground: k0 beside a spring k1 in series with a dashpot."""
    p, r = somewhere(sc), sc.rng.uniform(0.0, 0.7)
    tau = 1.0 / corner(sc, p)
    return local(
        "viscoelastic",
        p,
        (5e-3, 20.0),
        laws.MAXWELL,
        lambda x: [x * r * p.k, 1, x * p.k, tau],
        lambda x: {"k0": x * r * p.k, "k1": x * p.k, "tau": tau},
    )


def structural_damping(sc: Scene) -> Effect:
    """Spring with a nearly constant loss factor, made of eight Maxwell branches spread over the band."""
    p, eta = somewhere(sc), sc.rng.uniform(0.15, 0.45)
    w = 2 * np.pi * np.geomspace(sc.band[0] / 3, sc.band[1] * 3, 8)
    mid, ratio = 2 * np.pi * np.sqrt(sc.band[0] * sc.band[1]), np.log(w[1] / w[0])
    kb = 2 * ratio * eta / np.pi
    stored = float(np.sum(kb * mid**2 / (mid**2 + w**2)))

    def par(x: float) -> list[float]:
        return [x * p.k * (1 - stored), 8, *np.column_stack([np.full(8, x * p.k * kb), 1 / w]).ravel()]

    return local("structural_damping", p, (5e-3, 20.0), laws.MAXWELL, par, lambda x: {"k": x * p.k, "eta": eta})


def tuned_absorber(sc: Scene) -> Effect:
    """Sprung mass tuned near a mode that moves the place."""
    p, share = somewhere(sc), None
    share = sc.participation(p)
    w = 2 * np.pi * sc.f[sc.rng.choice(len(share), p=share)] * sc.rng.uniform(0.9, 1.1)
    z = sc.rng.uniform(0.01, 0.05)
    return local(
        "tuned_absorber",
        p,
        (1e-3, 0.12),
        laws.ABSORBER,
        lambda x: [x * sc.total, x * sc.total * w**2, 2 * z * w * x * sc.total],
        lambda x: {"m": x * sc.total, "k": x * sc.total * w**2, "c": 2 * z * w * x * sc.total},
    )


def quadratic_damping(sc: Scene) -> Effect:
    """Force as v |v|, to ground or between storeys."""
    p = somewhere(sc, 0.25)
    c = p.k * p.d / p.v**2
    return local(
        "quadratic_damping", p, (1e-3, 10.0), laws.QUADRATIC, lambda x: [x * c, 1e-3 * p.v], lambda x: {"c": x * c}
    )


def cubic_stiffness(sc: Scene) -> Effect:
    """Cubic spring to ground; one in six softens (kept where the total stays stable)."""
    p, soft = somewhere(sc), sc.rng.random() < 1 / 6
    sign, span = (-1.0, (1e-3, 0.08)) if soft else (1.0, (1e-3, 20.0))
    return local(
        "cubic_stiffness",
        p,
        span,
        laws.CUBIC,
        lambda x: [sign * x * p.k / p.d**2],
        lambda x: {"k3": sign * x * p.k / p.d**2},
    )


def clearance(sc: Scene) -> Effect:
    """Stop behind a gap, on one side or both; strength is how far the gap is closed."""
    p, k = somewhere(sc), log_uniform(sc.rng, 0.5, 8.0)
    sides, positive, chi = int(sc.rng.integers(1, 3)), bool(sc.rng.random() < 0.5), sc.rng.uniform(0.05, 0.2)

    def gaps(x: float) -> tuple[float, float]:
        g = p.d / x
        return (g, g) if sides == 2 else ((g, 1e9) if positive else (1e9, g))

    return local(
        "clearance",
        p,
        (0.35, 12.0),
        laws.CONTACT,
        lambda x: [k * p.k, *gaps(x), chi / p.v],
        lambda x: {
            "k": k * p.k,
            "gap": p.d / x,
            "sides": sides,
            "side": "both" if sides == 2 else "+" if positive else "-",
        },
        over=16,
    )


def bilinear_stiffness(sc: Scene) -> Effect:
    """Spring to ground that differs in tension and compression."""
    p, r = somewhere(sc), log_uniform(sc.rng, 2.5, 10.0)
    a, b = (1.0, 1 / r) if sc.rng.random() < 0.5 else (1 / r, 1.0)
    return local(
        "bilinear_stiffness",
        p,
        (5e-3, 15.0),
        laws.BILINEAR,
        lambda x: [a * x * p.k, b * x * p.k, 1e-3 * p.d],
        lambda x: {"k_plus": a * x * p.k, "k_minus": b * x * p.k},
        over=16,
    )


def coulomb_friction(sc: Scene) -> Effect:
    """Jenkins element (elastic until slip) or, one in three, a slider regularised in speed."""
    p = somewhere(sc, 0.2)
    if sc.rng.random() < 1 / 3:
        return local(
            "coulomb_friction",
            p,
            (5e-3, 0.6),
            laws.SLIDER,
            lambda x: [x * p.k * p.d, 0.03 * p.v],
            lambda x: {"f": x * p.k * p.d, "kt": None},
            over=16,
        )
    kt = p.k * log_uniform(sc.rng, 0.3, 5.0)
    return local(
        "coulomb_friction",
        p,
        (0.02, 0.6),
        laws.JENKINS,
        lambda x: [kt, x * kt * p.d],
        lambda x: {"f": x * kt * p.d, "kt": kt},
        over=16,
    )


def bouc_wen(sc: Scene) -> Effect:
    """Smooth hysteresis that yields within the motion."""
    p, rng = somewhere(sc), sc.rng
    alpha, n, share = rng.uniform(0.05, 0.4), float(rng.choice([1.0, 1.5, 2.0])), rng.uniform(0.4, 0.7)
    total = 1.0 / (rng.uniform(0.3, 0.9) * p.d) ** n
    beta, gamma = share * total, (1 - share) * total
    return local(
        "bouc_wen",
        p,
        (0.02, 8.0),
        laws.BOUC_WEN,
        lambda x: [x * p.k, alpha, beta, gamma, n],
        lambda x: {"k": x * p.k, "alpha": alpha, "n": n, "beta": beta, "gamma": gamma},
        over=16,
    )


def added_mass(sc: Scene) -> Effect:
    """A lump that is not in the model."""
    node = int(sc.rng.choice(sc.s.free))
    return Effect(
        "added_mass",
        [node],
        "",
        "",
        (2e-3, 0.4),
        lambda x: {"m": x * sc.total},
        change=lambda x: Change(mass={node: x * sc.total}),
    )


def joint_stiffness(sc: Scene) -> Effect:
    """Either a flexible connection of one member end, or one member weaker by 30-60 %."""
    s, rng = sc.s, sc.rng
    if not s.members:
        raise Unsuitable("no members")
    mi = int(rng.integers(len(s.members)))
    m = s.members[mi]
    if rng.random() < 0.5:
        factor = rng.uniform(0.4, 0.7)
        return Effect(
            "joint_stiffness",
            [m.i, m.j],
            "",
            "member",
            (1.0, 1.0),
            lambda x: {"factor": factor},
            change=lambda x: Change(weaker={mi: factor}),
            fixed=True,
            extra={"kind": "member"},
        )
    meeting = [node for other in s.members if other is not m for node in (other.i, other.j)]
    ends = [e for e, n in enumerate((m.i, m.j)) if n in meeting and n not in s.clamped]
    # of a member that meets no other one (a cantilever's) the clamped end; a free one holds nothing
    ends = ends or [e for e, n in enumerate((m.i, m.j)) if n in s.clamped]
    end = int(rng.choice(ends))
    q, length = s.sections[m.pid], float(np.linalg.norm(s.xyz[m.j] - s.xyz[m.i]))
    reach = s.span if s.family == "cantilever" else length
    k = 4 * s.E * np.sqrt(q.I1 * q.I2) / reach
    return Effect(
        "joint_stiffness",
        [(m.i, m.j)[end]],
        "",
        "member",
        (0.03, 30.0),
        lambda x: {"k": k / x, "member": [m.i, m.j]},
        change=lambda x: Change(hinge=(mi, end, k / x)),
        extra={"kind": "connection"},
    )


def compliant_support(sc: Scene) -> Effect:
    """One clamp gives way in rotation, in translation along an axis, or both."""
    s, rng = sc.s, sc.rng
    if isinstance(s, Solid):
        raise Unsuitable("a clamped face is no single clamp")
    node = int(rng.choice(s.clamped))
    if isinstance(s, Plate):
        k = 30.0 * s.rigidity() / s.sides[1] ** 2
        change = lambda x: Change(support={(node, 3): k / x})  # noqa: E731
        return Effect("compliant_support", [node], "", "ground", (0.02, 50.0), lambda x: {"k3": k / x}, change=change)
    m = next(m for m in s.members if node in (m.i, m.j))
    q, length = s.sections[m.pid], float(np.linalg.norm(s.xyz[m.j] - s.xyz[m.i]))
    reach = s.span if s.family == "cantilever" else length
    EI = s.E * np.sqrt(q.I1 * q.I2)
    comps = {
        "plane frame": {5: 4 * EI / reach, 1: 12 * EI / length**3},
        "cantilever": {5: 4 * EI / reach, 3: 12 * EI / reach**3},
        "space frame": {4: 4 * EI / reach, 5: 4 * EI / reach, 1: 12 * EI / length**3, 2: 12 * EI / length**3},
    }[s.family]
    kind = rng.choice(["rotation", "translation", "both"], p=[0.5, 0.2, 0.3])
    soft = {c: k for c, k in comps.items() if kind == "both" or (c > 3) == (kind == "rotation")}
    if s.family == "space frame" and kind != "both":
        soft = dict([list(soft.items())[int(rng.integers(len(soft)))]])
    return Effect(
        "compliant_support",
        [node],
        "",
        "ground",
        (0.02, 50.0),
        lambda x: {f"k{c}": k / x for c, k in soft.items()},
        change=lambda x: Change(support={(node, c): k / x for c, k in soft.items()}),
    )


def base_motion(sc: Scene) -> Effect:
    """The ground shakes along one axis, broadband, the same in every recording."""
    comp, rng = int(sc.rng.choice(sc.s.axes)), sc.rng
    f = excite.noise(rng, sc.band, 2.5 * sc.band[1], 6.0)
    unit = excite.scaled(f, 1.0, 2.5 * sc.band[1], 6.0)
    return Effect(
        "base_motion",
        list(sc.s.clamped),
        AXIS[comp],
        "",
        (1e-3, 50.0),
        lambda x: {"level": x},
        force=lambda x: Force(unit.period, unit.spectrum, None, unit.amplitude * x),
        inputs="base",
        extra={"comp": comp},
    )


def unmeasured_force(sc: Scene) -> Effect:
    """A sine or broadband force nobody recorded, at a joint."""
    p, rng = somewhere(sc), sc.rng
    if rng.random() < 0.5:
        freq = float(np.exp(rng.uniform(*np.log(sc.band))))
        unit = excite.sine(freq, rng.uniform(0, 2 * np.pi), 6.0)
        note = {"frequency": round(freq * 48.0) / 48.0}
        unit = Force(unit.period, unit.spectrum, None, 0.5 * np.sqrt(2.0))
    else:
        unit, note = (
            excite.scaled(excite.noise(rng, sc.band, 2.5 * sc.band[1], 6.0), 1.0, 2.5 * sc.band[1], 6.0),
            {"frequency": None},
        )
    return Effect(
        "unmeasured_force",
        p.nodes,
        AXIS[p.comp],
        "",
        (0.02, 30.0),
        lambda x: {**note, "amplitude": x},
        force=lambda x: Force(unit.period, unit.spectrum, None, unit.amplitude * x),
        inputs="force",
        extra={"comp": p.comp},
    )


def load_misplaced(sc: Scene) -> Effect:
    """The force channel names another joint or direction than the shaker's true one."""
    s, rng = sc.s, sc.rng
    node, comp = sc.drive
    true = [(n, c) for n in s.free for c in s.axes if (n, c) != sc.drive and (n == node or c == comp)]
    n, c = true[int(rng.integers(len(true)))]
    return Effect(
        "load_misplaced",
        [n],
        AXIS[c],
        "",
        (1.0, 1.0),
        lambda x: {"node": n, "direction": AXIS[c]},
        inputs="misplaced",
        fixed=True,
        extra={"true": (n, c)},
    )
