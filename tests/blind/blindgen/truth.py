"""From a structure to its truth: finer mesh, other parameters, local changes of the structure; modal form for the
integrator.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from . import fe, plates, solids
from .integrate import Modal
from .plates import Plate
from .solids import Solid
from .structures import Structure


@dataclass
class Real:
    """How reality differs from the deck without any concealed effect."""

    factor: dict[int, float]  # E of each group
    member: np.ndarray  # E of each member on top
    density: dict[int, float]
    lump: dict[int, float]
    form: str = "timoshenko"
    n_sub: int = 4
    gyration: float = 0.0  # radius of gyration of the lumps (m)


@dataclass
class Change:
    """A concealed change of the structure itself. Empty = none."""

    weaker: dict[int, float] = field(default_factory=dict)  # member -> factor on E
    hinge: tuple[int, int, float] | None = None  # member, end (0 or 1), rotational stiffness
    mass: dict[int, float] = field(default_factory=dict)  # node -> kg
    support: dict[tuple[int, int], float] = field(default_factory=dict)  # clamped (node, component) -> stiffness
    patch: tuple[int, int, int, int, float] | None = None  # deck cells of a plate along X and Y, factor on stiffness


def nominal(s: Structure) -> Real:
    """The deck as it stands (used to see which modes its mesh can carry)."""
    one = dict.fromkeys(s.groups, 1.0)
    return Real(one, np.ones(len(s.members)), one, dict.fromkeys(s.lumps, 1.0), n_sub=1)


@dataclass
class Built:
    """Assembled truth with the names of its equations, in order, and the direction vectors of a rigid ground motion."""

    system: fe.System
    names: list[tuple[object, int]]


class Numbering:
    """Hands out equation numbers for (place, component); held ones are -1."""

    def __init__(self, s: Structure, change: Change) -> None:
        self.s, self.change = s, change
        self.table: dict[tuple[object, int], int] = {}
        self.names: list[tuple[object, int]] = []

    def get(self, place: object, comp: int) -> int:
        """Equation of a component at a place (deck node number, or any hashable for truth-only nodes)."""
        key = (place, comp)
        if key not in self.table:
            clamped = place in self.s.clamped and str(comp) in self.s.pinned and key not in self.change.support
            if clamped or (str(comp) in self.s.held):
                self.table[key] = -1
            else:
                self.table[key] = len(self.names)
                self.names.append(key)
        return self.table[key]


def fine_beams(s: Structure, real: Real, change: Change, num: Numbering) -> list[fe.Beam]:
    """All truth elements: every bar of the deck cut into `n_sub`."""
    beams: list[fe.Beam] = []
    for mi, m in enumerate(s.members):
        mat = s.material(m.pid, real.factor[m.pid] * real.member[mi] * change.weaker.get(mi, 1.0), real.density[m.pid])
        places: list[object] = [m.chain[0]]
        for k, node in enumerate(m.chain[1:]):
            places += [("fine", mi, k, q) for q in range(1, real.n_sub)] + [node]
        axes = fe.rotation(s.xyz[m.j] - s.xyz[m.i], m.v)
        length = float(np.linalg.norm(s.xyz[m.j] - s.xyz[m.i])) / (len(places) - 1)
        for e in range(len(places) - 1):
            dofs = []
            for end, place in enumerate(places[e : e + 2]):
                hinged = (
                    change.hinge is not None
                    and change.hinge[0] == mi
                    and (e + end) == change.hinge[1] * (len(places) - 1)
                )
                dofs += [num.get(place, c) for c in (1, 2, 3)] + [
                    num.get(("hinge", place) if hinged else place, c) for c in (4, 5, 6)
                ]
            beams.append(fe.Beam(np.array(dofs), length, axes, mat, s.sections[m.pid]))
    return beams


def build(s: Structure, real: Real, change: Change | None = None) -> Built:
    """Assemble the truth. Every deck element becomes `n_sub` elements; the deck's nodes keep their numbers."""
    change = change or Change()
    num = Numbering(s, change)
    if isinstance(s, Plate):
        parts = plates.assemble(s, real, num.get, change.patch)
    elif isinstance(s, Solid):
        parts = solids.assemble(s, real, num.get)
    else:
        beams = fine_beams(s, real, change, num)
        parts = fe.assemble_beams(beams, len(num.names), real.form)
    K, M = (x.tolil() for x in parts)
    add_points(s, real, change, num, K, M)
    dof = {(n, c): num.get(n, c) for n in s.xyz for c in range(1, 7)}
    return Built(fe.System(K.tocsc(), M.tocsc(), dof), num.names)


def add_points(s: Structure, real: Real, change: Change, num: Numbering, K, M) -> None:
    """Lumps, added masses, the spring of a hinge and elastic supports, straight into the matrices."""
    for node, m in list(s.lumps.items()) + list(change.mass.items()):
        value = m * (real.lump.get(node, 1.0) if node not in change.mass else 1.0)
        for c in range(1, 7):
            i = num.get(node, c)
            if i >= 0:
                M[i, i] += value if c <= 3 else value * real.gyration**2
    if change.hinge is not None:
        m = s.members[change.hinge[0]]
        node = (m.i, m.j)[change.hinge[1]]
        for c in (4, 5, 6):
            a, b = num.get(("hinge", node), c), num.get(node, c)
            if a < 0:
                continue
            K[a, a] += change.hinge[2]
            if b >= 0:
                K[b, b] += change.hinge[2]
                K[a, b] -= change.hinge[2]
                K[b, a] -= change.hinge[2]
    for node, k in s.ties.items() if isinstance(s, Plate) else ():
        lower, upper = num.get(node, 3), num.get(node + plates.LAYER, 3)
        K[lower, lower] += k
        K[upper, upper] += k
        K[lower, upper] -= k
        K[upper, lower] -= k
    for (node, c), k in change.support.items():
        i = num.get(node, c)
        if i >= 0:
            K[i, i] += k


@dataclass
class Damping:
    """Modal damping of the unchanged truth: shapes by name and ratios, so that a changed structure inherits them."""

    names: dict[tuple[object, int], int]
    phi: np.ndarray
    zeta: np.ndarray
    beyond: float = 0.03

    def of(self, built: Built, phi: np.ndarray) -> np.ndarray:
        """Ratios for the modes of a changed structure: weights are the squared mass projections on the old shapes."""
        old = np.zeros((len(built.names), self.phi.shape[1]))
        for i, name in enumerate(built.names):
            if name in self.names:
                old[i] = self.phi[self.names[name]]
        w = (old.T @ (built.system.M @ phi)) ** 2
        share = np.minimum(w.sum(0), 1.0)
        mean = (w * self.zeta[:, None]).sum(0) / np.maximum(w.sum(0), 1e-12)
        return share * mean + (1 - share) * self.beyond


# multiple of the highest frequency of the modes up to which a residual vector is a mode of its own
STIFF = 2.0


def quasi_static(w: np.ndarray, phi: np.ndarray, highest: float) -> tuple[np.ndarray, np.ndarray]:
    """Modes above `highest` (rad/s) as ones of that frequency with the same flexibility phi phi^T / w^2.

    Two loads beside each other leave a residual vector of a hundred times the sampling rate, which the integrator would
    make ring: it does not damp what is that stiff.
    """
    scale = np.minimum(1.0, highest / np.maximum(w, 1e-300))
    return np.minimum(w, highest), phi * scale


def modal(
    built: Built,
    damping: Damping,
    f_max: float,
    load: np.ndarray,
    sensor: np.ndarray,
    law: np.ndarray,
    ground: tuple[int, list[int]] | None = None,
) -> Modal:
    """Modal form with static residuals for loads and laws. load, sensor, law: (n, .). ground = (component, sensor
    components)
    appends a base acceleration as the last input."""
    sys = built.system
    cols = np.column_stack([load, law]) if law.size else load
    rigid = None
    if ground is not None:
        rigid = np.array([1.0 if name[1] == ground[0] else 0.0 for name in built.names])
        cols = np.column_stack([cols, sys.M @ rigid])
    w0, phi0 = fe.modes(sys, f_max)
    w, phi = quasi_static(*fe.ritz(sys, w0, phi0, cols), STIFF * 2 * np.pi * f_max)
    shapes = load.T @ phi
    carried = np.zeros((sensor.shape[1], load.shape[1]))
    if ground is not None:
        shapes = np.vstack([shapes, -(sys.M @ rigid) @ phi])
        carried = np.column_stack([carried, np.array([1.0 if c == ground[0] else 0.0 for c in ground[1]])])
    return Modal(
        w, damping.of(built, phi), shapes, sensor.T @ phi, law.T @ phi if law.size else np.zeros((0, len(w))), carried
    )
