"""What may be left out of the user's model: place and shape are drawn, the strength is one number set afterwards."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from femend.model import Model
from femend.model.places.places import Place
from femend.selftest import laws
from femend.selftest.laws import Law
from femend.selftest.truth import Drawn

__all__ = ["Effect", "Here", "Unsuitable", "available", "draw_effect"]

FloatArray = NDArray[np.float64]
Draw = Callable[[np.random.Generator, "Here"], "Effect"]


class Unsuitable(Exception):
    """The drawn place cannot show this effect; draw again."""


@dataclass(frozen=True, eq=False)
class Spot:
    """A place with its direction on the g-set (n_g,), and there at the loudest recording: RMS displacement and
    velocity, static stiffness, and the share of every mode in the velocity."""

    place: Place
    g: FloatArray
    d: float
    v: float
    k: float
    share: FloatArray


@dataclass(frozen=True, eq=False)
class Here:
    """What draws may look at: model and drawn structure, places by kind, mass, band (rad/s), frequencies (rad/s) of the
    truth, and the motion at a place."""

    model: Model
    drawn: Drawn
    places: dict[str, list[Place]]
    mass: float
    band: tuple[float, float]
    omega: FloatArray
    forces: tuple[tuple[int, int], ...]  # (row, sign) of the recorded forces
    look: Callable[[Place], Spot]


@dataclass(frozen=True, eq=False)
class Effect:
    """A drawn effect; with strength x: `law(x)` along `g`, `change(x)` of K and M, an `extra` input along g of x N, or
    the first recorded force acting along `g` instead (`moved`)."""

    name: str
    nodes: tuple[int, ...]
    direction: str
    to: str
    span: tuple[float, float]
    values: Callable[[float], dict[str, Any]]
    g: FloatArray | None = None
    law: Callable[[float], Law] | None = None
    change: Callable[[float], tuple[Any, Any]] | None = None
    frequency: float | None = None
    extra: bool = False
    moved: bool = False
    fixed: bool = False
    rough: bool = False
    note: dict[str, Any] = field(default_factory=dict)


def _log(rng: np.random.Generator, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def _spot(rng: np.random.Generator, here: Here, kind: str = "ground") -> Spot:
    """A place of a kind that moves at least a twentieth as much as the one that moves most of five others."""
    pool = here.places[kind]
    spot = here.look(pool[int(rng.integers(len(pool)))])
    ground = here.places["ground"]
    best = max(here.look(ground[int(i)]).d for i in rng.integers(len(ground), size=5))
    if spot.d < 0.05 * best or spot.d == 0.0:
        raise Unsuitable("hardly moves")
    return spot


def _corner(rng: np.random.Generator, here: Here, s: Spot) -> float:
    """The frequency (rad/s) of a mode that moves the place, drawn by its share."""
    return float(here.omega[rng.choice(len(s.share), p=s.share / s.share.sum())])


def _attached(
    s: Spot, name: str, span: tuple[float, float], law: Callable[[float], Law], *, rough: bool = False
) -> Effect:
    """An effect that is a law at a place; its parameters are the law's own fields."""
    p = s.place
    return Effect(
        name, p.nodes, p.direction, p.to, span, lambda x: dict(vars(law(x))), g=s.g, law=law, rough=rough
    )  # fmt: skip


def _paired(rng: np.random.Generator, here: Here) -> str:
    return "pair" if here.places.get("pair") and rng.random() < 0.25 else "ground"


def support_stiffness(rng: np.random.Generator, here: Here) -> Effect:
    """A spring to ground."""
    s = _spot(rng, here)
    return _attached(s, "support_stiffness", (3e-3, 30.0), lambda x: laws.Spring(x * s.k))


def viscous_damper(rng: np.random.Generator, here: Here) -> Effect:
    """A dashpot to ground or between two joints."""
    s = _spot(rng, here, _paired(rng, here))
    return _attached(s, "viscous_damper", (1e-3, 10.0), lambda x: laws.Dashpot(x * s.k * s.d / s.v))


def quadratic_damping(rng: np.random.Generator, here: Here) -> Effect:
    """A force as v |v|."""
    s = _spot(rng, here, _paired(rng, here))
    return _attached(s, "quadratic_damping", (1e-3, 10.0), lambda x: laws.Quadratic(x * s.k * s.d / s.v**2))


def tuned_absorber(rng: np.random.Generator, here: Here) -> Effect:
    """A sprung mass tuned near a mode that moves the place."""
    s = _spot(rng, here)
    w, z = _corner(rng, here, s) * rng.uniform(0.9, 1.1), rng.uniform(0.01, 0.05)

    def law(x: float) -> Law:
        m = x * here.mass
        return laws.Absorber(m, m * w * w, 2 * z * w * m)

    return _attached(s, "tuned_absorber", (1e-3, 0.15), law)


def structural_damping(rng: np.random.Generator, here: Here) -> Effect:
    """A spring with a nearly constant loss factor."""
    s, eta = _spot(rng, here), rng.uniform(0.15, 0.45)
    low, high = here.band[0] / 3, here.band[1] * 3
    effect = _attached(s, "structural_damping", (5e-3, 20.0), lambda x: laws.Maxwell.loss(x * s.k, eta, low, high))
    return _told(effect, lambda x: {"k": x * s.k, "eta": eta})


def viscoelastic(rng: np.random.Generator, here: Here) -> Effect:
    """A Zener element to ground."""
    s, r = _spot(rng, here), rng.uniform(0.0, 0.7)
    tau = 1 / (_corner(rng, here, s) * _log(rng, 1 / 1.6, 1.6))
    effect = _attached(s, "viscoelastic", (5e-3, 20.0), lambda x: laws.Maxwell(r * x * s.k, ((x * s.k, tau),)))
    return _told(effect, lambda x: {"k0": r * x * s.k, "k1": x * s.k, "tau": tau})


def _told(effect: Effect, values: Callable[[float], dict[str, Any]]) -> Effect:
    return replace(effect, values=values)


def cubic_stiffness(rng: np.random.Generator, here: Here) -> Effect:
    """A hardening cubic spring to ground."""
    s = _spot(rng, here)
    return _attached(s, "cubic_stiffness", (1e-3, 20.0), lambda x: laws.Cubic(x * s.k / s.d**2))


def clearance(rng: np.random.Generator, here: Here) -> Effect:
    """A stop behind a gap, on one side or both; the strength says how far the gap is closed."""
    s = _spot(rng, here)
    k, sides, up = s.k * _log(rng, 0.5, 8.0), int(rng.integers(1, 3)), rng.random() < 0.5

    def law(x: float) -> Law:
        gap = s.d / x
        return laws.Contact(k, gap if sides == 2 or up else np.inf, gap if sides == 2 or not up else np.inf)

    effect = _attached(s, "clearance", (0.35, 12.0), law, rough=True)
    return _told(effect, lambda x: {"k": k, "gap": s.d / x, "sides": sides})


def bilinear_stiffness(rng: np.random.Generator, here: Here) -> Effect:
    """A spring that differs in tension and compression."""
    s, r = _spot(rng, here), _log(rng, 2.5, 10.0)
    a, b = (1.0, 1 / r) if rng.random() < 0.5 else (1 / r, 1.0)
    return _attached(
        s, "bilinear_stiffness", (5e-3, 15.0), lambda x: laws.Bilinear(a * x * s.k, b * x * s.k), rough=True
    )


def coulomb_friction(rng: np.random.Generator, here: Here) -> Effect:
    """A Jenkins element."""
    s = _spot(rng, here, _paired(rng, here))
    kt = s.k * _log(rng, 0.3, 5.0)
    return _attached(s, "coulomb_friction", (0.02, 0.6), lambda x: laws.Friction(x * kt * s.d, kt), rough=True)


def bouc_wen(rng: np.random.Generator, here: Here) -> Effect:
    """Smooth hysteresis that yields within the motion."""
    s = _spot(rng, here)
    alpha, n, share = rng.uniform(0.05, 0.4), float(rng.choice([1.0, 1.5, 2.0])), rng.uniform(0.4, 0.7)
    total = 1 / (rng.uniform(0.3, 0.9) * s.d) ** n
    return _attached(
        s, "bouc_wen", (0.02, 8.0), lambda x: laws.BoucWen(x * s.k, alpha, share * total, (1 - share) * total, n),
        rough=True,
    )  # fmt: skip


def added_mass(rng: np.random.Generator, here: Here) -> Effect:
    """A mass at a node."""
    node = _spot(rng, here).place.nodes[0]
    model = here.model
    T = model.transformation()
    diagonal = np.zeros(int(model.fe.n_g))
    diagonal[6 * model.index(node) + np.arange(3)] = 1.0
    unit = T.T @ sp.diags_array(diagonal) @ T
    return Effect(
        "added_mass", (node,), "", "", (2e-3, 0.4), lambda x: {"m": x * here.mass},
        change=lambda x: (None, x * here.mass * unit),
    )  # fmt: skip


def element_stiffness(here: Here, eid: int) -> tuple[NDArray[np.int64], FloatArray]:
    """Rows on the g-set and stiffness of an element as it was drawn."""
    rows, K, _ = here.model.fe.element_matrices(eid, here.model.factors(here.drawn.factors))
    return rows, K * here.drawn.scatter.get(eid, 1.0)


def _opened(here: Here, place: Place, k: float) -> Any:
    """Change of K (n_a, n_a) when a rigid connection becomes springs of `k` times the element's stiffness there.

    With the drawn element's stiffness S along the cut, S0 as the deck has it, and its pattern B, eliminating the
    opening leaves K - B (S + k diag S0)^-1 B'.
    """
    model = here.model
    T = model.transformation()
    (eid,) = place.elements
    rows, deck, _ = model.fe.element_matrices(eid, np.ones(len(model.parameters)))
    _, K = element_stiffness(here, eid)
    at = {int(row): i for i, row in enumerate(rows)}
    pattern = np.zeros((len(rows), place.n_w))
    for i, (g_rows, values) in enumerate(zip(place.g_rows, place.g_values, strict=True)):
        pattern[[at[int(row)] for row in g_rows], i] = values
    # the motions of the cut, but for rigid ones, which no element feels
    motion = np.linalg.pinv(deck, rcond=1e-12, hermitian=True) @ pattern
    B = K @ motion
    S = motion.T @ B
    g = np.zeros((int(model.fe.n_g), place.n_w))
    g[rows] = B
    A = sp.csc_array(T.T @ g)
    return -(A @ sp.csc_array(np.linalg.inv(S + k * np.diag(np.diag(np.asarray(place.release))))) @ A.T)


def _cut(rng: np.random.Generator, here: Here, kind: str, name: str) -> Effect:
    pool = here.places[kind]
    place = pool[int(rng.integers(len(pool)))]
    S = np.asarray(place.release)
    return Effect(
        name, place.nodes, place.direction, place.to, (0.03, 100.0),
        lambda x: {f"k{i + 1}": float(S[i, i]) / x for i in range(len(S))},
        change=lambda x: (_opened(here, place, 1 / x), None),
    )  # fmt: skip


def joint_stiffness(rng: np.random.Generator, here: Here) -> Effect:
    """A flexible connection of a member's end, or a member weaker by 30-60 %."""
    if here.places.get("member") and (not here.places.get("end") or rng.random() < 0.5):
        place = here.places["member"][int(rng.integers(len(here.places["member"])))]
        factor = float(rng.uniform(0.4, 0.7))
        return Effect(
            "joint_stiffness", place.nodes, "", "member", (1.0, 1.0), lambda x: {"factor": factor},
            change=lambda x: ((factor - 1) * _stiffness(here, place.elements), None), fixed=True,
        )  # fmt: skip
    return _cut(rng, here, "end", "joint_stiffness")


def _stiffness(here: Here, elements: tuple[int, ...]) -> Any:
    """Stiffness (n_a, n_a) of some elements as they were drawn."""
    T, n = here.model.transformation(), int(here.model.fe.n_g)
    total = sp.csc_array((n, n))
    for eid in elements:
        rows, K = element_stiffness(here, eid)
        index = np.repeat(rows, len(rows)), np.tile(rows, len(rows))
        total = total + sp.csc_array(sp.coo_array((K.ravel(), index), shape=(n, n)))
    return T.T @ total @ T


def compliant_support(rng: np.random.Generator, here: Here) -> Effect:
    """A clamp that gives way."""
    return _cut(rng, here, "clamp", "compliant_support")


def load_misplaced(rng: np.random.Generator, here: Here) -> Effect:
    """The first recorded force acts at another place or in another direction."""
    row = here.forces[0][0]
    node, comp = int(here.model.node_ids[row // 6]), "XYZ"[row % 6] if row % 6 < 3 else ""
    pool = [p for p in here.places["ground"] if (p.nodes[0] == node) != (p.direction == comp)]
    if not pool:
        raise Unsuitable("nowhere else")
    s = here.look(pool[int(rng.integers(len(pool)))])
    p = s.place
    values = {"node": p.nodes[0], "direction": p.direction}
    return Effect("load_misplaced", p.nodes, p.direction, "", (1.0, 1.0), lambda x: dict(values), g=s.g, moved=True,
                  fixed=True)  # fmt: skip


def unmeasured_force(rng: np.random.Generator, here: Here) -> Effect:
    """A sine or broadband force nobody recorded."""
    s = _spot(rng, here)
    f = _log(rng, here.band[0], here.band[1]) / (2 * np.pi) if rng.random() < 0.5 else None
    p = s.place
    size = s.k * s.d
    return Effect("unmeasured_force", p.nodes, p.direction, "", (1e-4, 30.0),
                  lambda x: {"frequency": f, "amplitude": x * size}, g=s.g * size, frequency=f, extra=True)  # fmt: skip


EFFECTS: dict[str, Draw] = {
    f.__name__: f
    for f in (
        support_stiffness, added_mass, viscous_damper, tuned_absorber, structural_damping, viscoelastic,
        quadratic_damping, cubic_stiffness, clearance, bilinear_stiffness, coulomb_friction, bouc_wen, joint_stiffness,
        compliant_support, load_misplaced, unmeasured_force,
    )
}  # fmt: skip
_NEEDS = {"joint_stiffness": ("end", "member"), "compliant_support": ("clamp",)}


def available(places: dict[str, list[Place]]) -> list[str]:
    """The effects that the model's places allow."""
    return [name for name in EFFECTS if name not in _NEEDS or any(places.get(kind) for kind in _NEEDS[name])]


def draw_effect(rng: np.random.Generator, here: Here, name: str) -> Effect:
    """A place and a shape for the effect `name`; raises Unsuitable where the place cannot show it."""
    return EFFECTS[name](rng, here)
