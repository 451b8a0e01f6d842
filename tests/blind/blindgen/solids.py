"""Clamped bars of bricks: linear hexahedra in the deck, 20-node serendipity bricks on a finer mesh as truth."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from itertools import product

import numpy as np
import scipy.sparse as sp

from .deck import num
from .structures import Structure

NU = 0.33


@dataclass
class Solid(Structure):
    """Rectangular bar along X, clamped at x = 0, two halves as groups; `cells` deck elements each way, sides in m."""

    cells: tuple[int, int, int] = (16, 2, 1)
    sides: tuple[float, float, float] = (0.7, 0.03, 0.014)

    @property
    def total(self) -> float:
        """Mass of the deck's model (kg)."""
        return 2700.0 * float(np.prod(self.sides)) + sum(self.lumps.values())

    @property
    def carried(self) -> float:
        """Frequency (Hz) whose bending half-wave spans six deck elements: what the public mesh represents."""
        h, depth = self.sides[0] / self.cells[0], min(self.sides[1:])
        return float(np.sqrt(self.E * depth**2 / 12 / 2700.0) * (np.pi / (6 * h)) ** 2 / (2 * np.pi))

    def node(self, i: int, j: int, k: int) -> int:
        """Deck node of grid point (i, j, k)."""
        nx, ny, _ = self.cells
        return 1 + i + (nx + 1) * (j + (ny + 1) * k)

    def bulk(self) -> str:
        """The deck: bricks of two properties, lumps, one end held."""
        out = ["$ nominal model, SI units (m, kg, s, N)", "SOL 103", "CEND", "SPC = 1", "METHOD = 1", "BEGIN BULK"]
        out += ["EIGRL,1,,,20", "PARAM,COUPMASS,1"]
        out += [f"GRID,{n},,{num(p[0])},{num(p[1])},{num(p[2])}" for n, p in sorted(self.xyz.items())]
        for pid, name in self.groups.items():
            out += [f"$ group {name}", f"MAT1,{pid},{num(self.E)},,{NU},2700.", f"PSOLID,{pid},{pid}"]
        nx, ny, nz = self.cells
        for eid, (k, j, i) in enumerate(product(range(nz), range(ny), range(nx)), 1):
            base = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)]
            n = [self.node(a, b, k + up) for up in (0, 1) for a, b in base]
            out.append(f"CHEXA,{eid},{1 if i < nx // 2 else 2}," + ",".join(map(str, n[:6])))
            out.append(f"+,{n[6]},{n[7]}")
        out += [f"CONM2,{90000 + k},{n},,{num(m)}" for k, (n, m) in enumerate(self.lumps.items(), 1)]
        ends = sorted(self.clamped)
        out += [f"SPC1,1,123,{','.join(map(str, ends[k : k + 6]))}" for k in range(0, len(ends), 6)]
        nodes = sorted(self.xyz)
        out += [f"SPC1,1,456,{','.join(map(str, nodes[k : k + 6]))}" for k in range(0, len(nodes), 6)]
        return "\n".join([*out, "ENDDATA", ""])


def solid(rng: np.random.Generator) -> Solid:
    """A bar of 0.55-0.8 m; two edge nodes at every fourth section take part as joints, two of them carry lumps."""
    sides = (rng.uniform(0.55, 0.80), rng.uniform(0.026, 0.040), rng.uniform(0.012, 0.018))
    s = Solid("solid", [], {}, [], {1: "root_half", 2: "tip_half"}, {}, {}, [], "456", [2, 3], 6, pinned="123")
    s.sides = sides
    for i, j, k in product(*(range(c + 1) for c in s.cells)):
        s.xyz[s.node(i, j, k)] = np.array([i, j, k]) * np.array(sides) / np.array(s.cells)
    s.clamped = [s.node(0, j, k) for j in range(s.cells[1] + 1) for k in range(s.cells[2] + 1)]
    s.joints = [s.node(i, j, s.cells[2]) for i in range(4, s.cells[0] + 1, 4) for j in (0, s.cells[1])]
    for n in rng.choice(s.joints, 2, replace=False):
        s.lumps[int(n)] = rng.uniform(0.03, 0.12)
    s.levels = dict.fromkeys(s.joints, 0)
    return s


CORNERS = np.array(list(product((-1, 1), repeat=3)), float)
MIDDLES = np.array([p for p in product((-1, 0, 1), repeat=3) if sum(q == 0 for q in p) == 1], float)
POINTS = np.vstack([CORNERS, MIDDLES])


def shape(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Serendipity functions of the 20 nodes at x in (-1, 1)^3 and their gradient (20, 3)."""
    f, g = np.zeros(20), np.zeros((20, 3))
    for a, p in enumerate(POINTS):
        # one factor per direction: 1 + x p, or 1 - x^2 where the node is in the middle; corners carry (x.p - 2) / 8
        one = np.where(p == 0, 1 - x**2, 1 + x * p)
        d = np.where(p == 0, -2 * x, p)
        scale = 0.125 * (x @ p - 2) if a < 8 else 0.25
        f[a] = scale * one.prod()
        for c in range(3):
            g[a, c] = scale * d[c] * np.delete(one, c).prod() + (0.125 * p[c] * one.prod() if a < 8 else 0.0)
    return f, g


@cache
def brick(hx: float, hy: float, hz: float, E: float, rho: float) -> tuple[np.ndarray, np.ndarray]:
    """60x60 stiffness and mass of a rectangular brick, 3x3x3 Gauss points (Zienkiewicz and Taylor, vol. 1, ch. 8)."""
    lam, mu = E * NU / ((1 + NU) * (1 - 2 * NU)), E / (2 * (1 + NU))
    D = np.diag([2 * mu] * 3 + [mu] * 3)
    D[:3, :3] += lam
    K, M = np.zeros((60, 60)), np.zeros((60, 60))
    half = 0.5 * np.array([hx, hy, hz])
    pts, wts = np.polynomial.legendre.leggauss(3)
    for q in product(range(3), repeat=3):
        N, g = shape(pts[list(q)])
        g = g / half
        w = wts[list(q)].prod() * half.prod()
        B = np.zeros((6, 60))
        for c in range(3):
            B[c, c::3] = g[:, c]
        for row, (a, b) in enumerate(((0, 1), (1, 2), (2, 0)), 3):
            B[row, a::3], B[row, b::3] = g[:, b], g[:, a]
        K += w * B.T @ D @ B
        M += w * rho * np.kron(np.outer(N, N), np.eye(3))
    return K, M


# bricks of the truth to one of the deck's along X, Y and Z: a mesh that mid-edge nodes in the deck's do not give
FINER = np.array([2, 1, 2])


def assemble(s: Solid, real, get) -> tuple[sp.coo_matrix, sp.coo_matrix]:
    """K and M: every deck element becomes `FINER` bricks; `get(place, component)` numbers equations."""
    cells = np.array(s.cells) * FINER
    h = np.array(s.sides) / cells
    rows, cols, kv, mv = [], [], [], []

    def place(p: np.ndarray) -> object:  # p counts half cells
        if (p % (2 * FINER) == 0).all():
            return s.node(*(p // (2 * FINER)))
        return ("fine", *p)

    for i, j, k in product(*(range(c) for c in cells)):
        pid = 1 if i < cells[0] // 2 else 2
        at = 2 * np.array([i, j, k]) + POINTS.astype(int) + 1
        # the whole end face is clamped, as in the deck: also the nodes that only the truth has
        dofs = np.array([get(place(p), c) if p[0] > 0 else -1 for p in at for c in (1, 2, 3)])
        K, M = brick(*h, s.E * real.factor[pid], 2700.0 * real.density[pid])
        on = np.flatnonzero(dofs >= 0)
        I, J = np.meshgrid(dofs[on], dofs[on], indexing="ij")
        rows.append(I.ravel())
        cols.append(J.ravel())
        kv.append(K[np.ix_(on, on)].ravel())
        mv.append(M[np.ix_(on, on)].ravel())
    r, c = np.concatenate(rows), np.concatenate(cols)
    size = int(r.max()) + 1
    return sp.coo_matrix((np.concatenate(kv), (r, c)), (size, size)), sp.coo_matrix(
        (np.concatenate(mv), (r, c)), (size, size)
    )
