"""Random structures: plane frames, cantilevers and space frames in the deck's own terms (joints, members, sections,
lumps).
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from .fe import Material, Section

X, Y, Z = np.eye(3)


@dataclass
class Member:
    """A straight member between two joints: property, orientation vector and the chain of deck nodes from joint to
    joint.
    """

    i: int
    j: int
    pid: int
    v: np.ndarray
    chain: list[int]


@dataclass
class Structure:
    """What the public deck says: nodes, members, groups (pid -> name, section), lumps, clamps, and what a test
    may use.
    """

    family: str
    joints: list[int]
    xyz: dict[int, np.ndarray]
    members: list[Member]
    groups: dict[int, str]
    sections: dict[int, Section]
    lumps: dict[int, float]
    clamped: list[int]
    held: str  # components held at every node that is not clamped
    axes: list[int]  # translations in which sensors and the shaker work
    n_sensors: int
    E: float = 7e10
    levels: dict[int, int] = field(default_factory=dict)  # joint -> storey
    pinned: str = "123456"  # components held at the clamped nodes

    @property
    def free(self) -> list[int]:
        """Joints that can move."""
        return [n for n in self.joints if n not in self.clamped]

    @property
    def span(self) -> float:
        """Diagonal of the box around the nodes (m)."""
        p = np.array(list(self.xyz.values()))
        return float(np.linalg.norm(p.max(0) - p.min(0)))

    @property
    def total(self) -> float:
        """Mass of the deck's model (kg)."""
        bars = ((m, float(np.linalg.norm(self.xyz[m.j] - self.xyz[m.i]))) for m in self.members)
        return sum(self.lumps.values()) + sum(2700.0 * self.sections[m.pid].A * length for m, length in bars)

    def material(self, pid: int, factor: float = 1.0, density: float = 1.0) -> Material:
        """Nominal material of a group, scaled."""
        return Material(self.E * factor, 0.33, 2700.0 * density)


def rectangle(b: float, h: float, flip: bool = False) -> Section:
    """Rectangular section, h in the plane of the orientation vector (I1 = b h^3 / 12) unless flipped."""
    lo, hi = sorted((b, h))
    J = hi * lo**3 * (1 / 3 - 0.21 * lo / hi * (1 - lo**4 / (12 * hi**4)))
    i1, i2 = b * h**3 / 12, h * b**3 / 12
    return Section(b * h, i2 if flip else i1, i1 if flip else i2, J)


def connect(s: Structure, pairs: list[tuple[int, int, int, np.ndarray]], per_member: int) -> None:
    """Make the members with their intermediate deck nodes, numbered from 1001."""
    new = 1001
    for i, j, pid, v in pairs:
        chain = [i]
        for k in range(1, per_member):
            s.xyz[new] = s.xyz[i] + (s.xyz[j] - s.xyz[i]) * k / per_member
            chain.append(new)
            new += 1
        s.members.append(Member(i, j, pid, v, [*chain, j]))


def plane_frame(rng: np.random.Generator) -> Structure:
    """1-3 storeys, 1-2 bays in the X-Z plane; four deck elements per member."""
    storeys, bays = [(1, 2), (2, 1), (2, 1), (2, 2), (3, 1), (3, 1)][rng.integers(6)]
    width, height = rng.uniform(0.38, 0.62), rng.uniform(0.30, 0.45)
    per = bays + 1
    xyz = {1 + k * per + b: np.array([b * width, 0.0, k * height]) for k in range(storeys + 1) for b in range(per)}
    col = (
        rectangle(0.04, rng.uniform(0.0066, 0.0078))
        if rng.random() < 0.65
        else rectangle(0.025, rng.uniform(0.010, 0.014), flip=True)
    )
    beam = rectangle(0.04, rng.uniform(0.0115, 0.0165))
    s = Structure(
        "plane frame",
        list(xyz),
        xyz,
        [],
        {1: "columns", 2: "beams"},
        {1: col, 2: beam},
        {n: rng.uniform(0.3, 0.8) for n in xyz if n > per},
        list(range(1, per + 1)),
        "246",
        [1],
        4,
    )
    pairs = []
    for k in range(storeys):
        pairs += [(1 + k * per + b, 1 + (k + 1) * per + b, 1, Y) for b in range(per)]
        pairs += [(1 + (k + 1) * per + b, 2 + (k + 1) * per + b, 2, Z) for b in range(bays)]
    connect(s, pairs, 4)
    s.levels = {n: (n - 1) // per for n in s.joints}
    return s


def cantilever(rng: np.random.Generator) -> Structure:
    """Six segments along X, two groups, one lump; three deck elements per segment."""
    step = rng.uniform(0.10, 0.14)
    xyz = {k + 1: np.array([k * step, 0.0, 0.0]) for k in range(7)}
    sections = {1: rectangle(0.03, rng.uniform(0.0095, 0.013)), 2: rectangle(0.03, rng.uniform(0.0080, 0.0112))}
    s = Structure(
        "cantilever",
        list(xyz),
        xyz,
        [],
        {1: "root_half", 2: "tip_half"},
        sections,
        {int(rng.integers(3, 8)): rng.uniform(0.08, 0.12)},
        [1],
        "246",
        [3],
        4,
    )
    connect(s, [(k, k + 1, 1 if k <= 3 else 2, Z) for k in range(1, 7)], 3)
    s.levels = {n: n - 1 for n in s.joints}
    return s


def space_frame(rng: np.random.Generator) -> Structure:
    """One bay each way, 1-2 storeys; three deck elements per member."""
    storeys = int(rng.choice([1, 2, 2]))
    a, b, height = rng.uniform(0.44, 0.60), rng.uniform(0.30, 0.40), rng.uniform(0.30, 0.40)
    plan = [(0.0, 0.0), (a, 0.0), (a, b), (0.0, b)]
    xyz = {1 + 4 * k + c: np.array([*plan[c], k * height]) for k in range(storeys + 1) for c in range(4)}
    bx = rectangle(0.02, 0.015) if rng.random() < 0.6 else rectangle(0.02, rng.uniform(0.012, 0.016))
    sections = {1: rectangle(0.012, rng.uniform(0.0098, 0.0118)), 2: bx, 3: Section(bx.A, bx.I1, bx.I2, bx.J)}
    s = Structure(
        "space frame",
        list(xyz),
        xyz,
        [],
        {1: "columns", 2: "beams_x", 3: "beams_y"},
        sections,
        {n: rng.uniform(0.3, 0.8) for n in xyz if n > 4},
        [1, 2, 3, 4],
        "",
        [1, 2],
        11 if storeys == 2 else 6,
    )
    pairs = []
    for k in range(storeys):
        lo, hi = 1 + 4 * k, 5 + 4 * k
        pairs += [(lo + c, hi + c, 1, Y) for c in range(4)]
        pairs += [(hi + c, hi + (c + 1) % 4, 2 if c % 2 == 0 else 3, Z) for c in range(4)]
    connect(s, pairs, 3)
    s.levels = {n: (n - 1) // 4 for n in s.joints}
    return s


FAMILIES = {"plane frame": plane_frame, "cantilever": cantilever, "space frame": space_frame}
