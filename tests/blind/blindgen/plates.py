"""Plates on four corner supports, one or two above each other: flat shells in the deck, conforming bicubic elements of
half the size as truth.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import product

import numpy as np
import scipy.sparse as sp

from .deck import num
from .fe import GAUSS_W, GAUSS_X
from .structures import Structure

NU = 0.33
# what node and element numbers of the second plate are above those of the first
LAYER = 1000


@dataclass
class Plate(Structure):
    """Rectangular plate in X-Y, two halves as groups, or two `layers`, a group each, joined by springs in Z at `ties`
    (node of the first, stiffness); `cells` deck elements along X and Y, sides and thickness in m."""

    cells: tuple[int, int] = (16, 12)
    sides: tuple[float, float] = (0.5, 0.35)
    thickness: float = 0.004
    layers: int = 1
    ties: dict[int, float] = field(default_factory=dict)

    def rigidity(self, factor: float = 1.0) -> float:
        """Bending stiffness per width D (N m)."""
        return factor * self.E * self.thickness**3 / (12 * (1 - NU**2))

    @property
    def total(self) -> float:
        """Mass of the deck's model (kg)."""
        return self.layers * 2700.0 * self.thickness * self.sides[0] * self.sides[1] + sum(self.lumps.values())

    @property
    def carried(self) -> float:
        """Frequency (Hz) whose bending half-wave spans seven deck elements: what the public mesh represents."""
        h = max(self.sides[0] / self.cells[0], self.sides[1] / self.cells[1])
        return float(np.sqrt(self.rigidity() / (2700.0 * self.thickness)) * (np.pi / (7 * h)) ** 2 / (2 * np.pi))

    def node(self, i: int, j: int, layer: int = 0) -> int:
        """Deck node of grid point (i, j)."""
        return 1 + i + j * (self.cells[0] + 1) + LAYER * layer

    def group(self, i: int, layer: int = 0) -> int:
        """Group of the deck elements at i along X."""
        if self.layers > 1:
            return 1 + layer
        return 1 if i < self.cells[0] // 2 else 2

    def bulk(self) -> str:
        """The deck: shells of two properties, lumps, corner supports, membrane and drilling held."""
        out = ["$ nominal model, SI units (m, kg, s, N)", "SOL 103", "CEND", "SPC = 1", "METHOD = 1", "BEGIN BULK"]
        out += ["EIGRL,1,,,20", "PARAM,COUPMASS,1"]
        out += [f"GRID,{n},,{num(p[0])},{num(p[1])},{num(p[2])}" for n, p in sorted(self.xyz.items())]
        for pid, name in self.groups.items():
            out += [
                f"$ group {name}",
                f"MAT1,{pid},{num(self.E)},,{NU},2700.",
                f"PSHELL,{pid},{pid},{num(self.thickness)},{pid},,{pid}",
            ]
        nx, ny = self.cells
        for layer, j, i in product(range(self.layers), range(ny), range(nx)):
            corners = [self.node(i + a, j + b, layer) for a, b in ((0, 0), (1, 0), (1, 1), (0, 1))]
            eid = 1 + i + j * nx + LAYER * layer
            out.append(f"CQUAD4,{eid},{self.group(i, layer)}," + ",".join(map(str, corners)))
        out += [f"CONM2,{90000 + k},{n},,{num(m)}" for k, (n, m) in enumerate(self.lumps.items(), 1)]
        out += [f"CELAS2,{95000 + n},{num(k)},{n},3,{n + LAYER},3" for n, k in self.ties.items()]
        corners = self.clamped
        out += [f"SPC1,1,3,{','.join(map(str, corners[k : k + 4]))}" for k in range(0, len(corners), 4)]
        nodes = sorted(self.xyz)
        out += [f"SPC1,1,126,{','.join(map(str, nodes[k : k + 6]))}" for k in range(0, len(nodes), 6)]
        return "\n".join([*out, "ENDDATA", ""])


def plate(rng: np.random.Generator) -> Plate:
    """A 3-5 mm plate of about 0.5 x 0.35 m with two lumps; 25 of its points take part as joints."""
    cells, sides = (16, 12), (rng.uniform(0.42, 0.56), rng.uniform(0.30, 0.40))
    s = Plate(
        "plate",
        [],
        {},
        [],
        {1: "left_half", 2: "right_half"},
        {},
        {},
        [],
        "126",
        [3],
        9,
        pinned="3",
        cells=cells,
        sides=sides,
    )
    s.thickness = rng.uniform(0.003, 0.005)
    for j in range(cells[1] + 1):
        for i in range(cells[0] + 1):
            s.xyz[s.node(i, j)] = np.array([i * sides[0] / cells[0], j * sides[1] / cells[1], 0.0])
    s.clamped = [s.node(i, j) for j in (0, cells[1]) for i in (0, cells[0])]
    inner = [s.node(i, j) for j in range(0, cells[1] + 1, 3) for i in range(0, cells[0] + 1, 4)]
    s.joints = inner
    for n in rng.choice(s.free, 2, replace=False):
        s.lumps[int(n)] = rng.uniform(0.03, 0.12)
    s.levels = dict.fromkeys(inner, 0)
    return s


def twin_plates(rng: np.random.Generator) -> Plate:
    """Two plates, one a little above the other, each on its own corners and with a lump; two springs join them."""
    s = plate(rng)
    s.family, s.layers, s.groups = "twin plates", 2, {1: "lower", 2: "upper"}
    gap = rng.uniform(0.015, 0.04)
    lower = dict(s.xyz)
    s.xyz.update({n + LAYER: p + np.array([0.0, 0.0, gap]) for n, p in lower.items()})
    s.clamped += [n + LAYER for n in s.clamped]
    last = max(s.lumps)
    s.lumps[last + LAYER] = s.lumps.pop(last)
    usual = 40.0 * s.rigidity() / s.sides[1] ** 2
    s.ties = {int(n): usual * rng.uniform(0.5, 2.0) for n in rng.choice(s.free, 2, replace=False)}
    s.levels |= {n + LAYER: 1 for n in s.joints}
    s.joints = [*s.joints, *(n + LAYER for n in s.joints)]
    s.n_sensors = 14
    return s


def hermite(h: float) -> dict[tuple[int, int], np.ndarray]:
    """Integrals over one cell of products of the a-th and b-th derivatives of the cubic Hermite functions (4x4)."""
    out = {(a, b): np.zeros((4, 4)) for a in range(3) for b in range(3)}
    for s, w in zip(GAUSS_X, GAUSS_W, strict=True):
        N = [
            np.array([1 - 3 * s**2 + 2 * s**3, h * (s - 2 * s**2 + s**3), 3 * s**2 - 2 * s**3, h * (s**3 - s**2)]),
            np.array([6 * s**2 - 6 * s, h * (1 - 4 * s + 3 * s**2), 6 * s - 6 * s**2, h * (3 * s**2 - 2 * s)]) / h,
            np.array([12 * s - 6, h * (6 * s - 4), 6 - 12 * s, h * (6 * s - 2)]) / h**2,
        ]
        for a, b in out:
            out[a, b] += w * h * np.outer(N[a], N[b])
    return out


def cell_matrices(hx: float, hy: float, D: float, mass: float) -> tuple[np.ndarray, np.ndarray]:
    """16x16 stiffness and mass of the bicubic plate cell (Bogner, Fox, Schmit, 1965); D in N m, mass in kg/m^2.

    Order: (x end, y end) as kron of the Hermite functions in x (w, w_x at both ends) and in y.
    """
    X, Y = hermite(hx), hermite(hy)
    k = np.kron(X[2, 2], Y[0, 0]) + np.kron(X[0, 0], Y[2, 2]) + 2 * (1 - NU) * np.kron(X[1, 1], Y[1, 1])
    k += NU * (np.kron(X[0, 2], Y[2, 0]) + np.kron(X[2, 0], Y[0, 2]))
    return D * k, mass * np.kron(X[0, 0], Y[0, 0])


def assemble(s: Plate, real, get, patch=None) -> tuple[sp.coo_matrix, sp.coo_matrix]:
    """K and M on the fine mesh; `get(place, component)` numbers equations: 3, 5, 4, 7 are w, w_x, w_y, w_xy. `patch` is
    a rectangle of deck cells (first and end along X, the same along Y) with the factor on their stiffness."""
    n = min(real.n_sub, 2)
    nx, ny = s.cells[0] * n, s.cells[1] * n
    hx, hy = s.sides[0] / nx, s.sides[1] / ny
    kinds = {
        p: cell_matrices(hx, hy, s.rigidity(real.factor[p]), 2700.0 * real.density[p] * s.thickness) for p in s.groups
    }

    def place(i: int, j: int, layer: int) -> object:
        fine = ("fine", i, j) if layer == 0 else ("fine", i, j, layer)
        return s.node(i // n, j // n, layer) if i % n == 0 and j % n == 0 else fine

    def weak(i: int, j: int) -> float:
        if patch is None:
            return 1.0
        i0, i1, j0, j1, factor = patch
        return factor if i0 <= i // n < i1 and j0 <= j // n < j1 else 1.0

    rows, cols, kv, mv = [], [], [], []
    for layer, j, i in product(range(s.layers), range(ny), range(nx)):
        ends = [(i + a, ca) for a in (0, 1) for ca in (0, 1)]
        dofs = np.array(
            [
                get(place(p, j + b, layer), {(0, 0): 3, (1, 0): 5, (0, 1): 4, (1, 1): 7}[ca, cb])
                for p, ca in ends
                for b in (0, 1)
                for cb in (0, 1)
            ]
        )
        k, m = kinds[s.group(i // n, layer)]
        on = np.flatnonzero(dofs >= 0)
        I, J = np.meshgrid(dofs[on], dofs[on], indexing="ij")
        rows.append(I.ravel())
        cols.append(J.ravel())
        kv.append(weak(i, j) * k[np.ix_(on, on)].ravel())
        mv.append(m[np.ix_(on, on)].ravel())
    r, c = np.concatenate(rows), np.concatenate(cols)
    size = int(r.max()) + 1
    return sp.coo_matrix((np.concatenate(kv), (r, c)), (size, size)), sp.coo_matrix(
        (np.concatenate(mv), (r, c)), (size, size)
    )
