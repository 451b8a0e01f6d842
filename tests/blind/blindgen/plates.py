"""Plates on four corner supports: flat shells in the deck, conforming bicubic elements of half the size as truth."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from .deck import num
from .fe import GAUSS_W, GAUSS_X
from .structures import Structure

NU = 0.33


@dataclass
class Plate(Structure):
    """Rectangular plate in X-Y, two halves as groups; `cells` deck elements along X and Y, sides and thickness in m."""

    cells: tuple[int, int] = (16, 12)
    sides: tuple[float, float] = (0.5, 0.35)
    thickness: float = 0.004

    def rigidity(self, factor: float = 1.0) -> float:
        """Bending stiffness per width D (N m)."""
        return factor * self.E * self.thickness**3 / (12 * (1 - NU**2))

    @property
    def total(self) -> float:
        """Mass of the deck's model (kg)."""
        return 2700.0 * self.thickness * self.sides[0] * self.sides[1] + sum(self.lumps.values())

    @property
    def carried(self) -> float:
        """Frequency (Hz) whose bending half-wave spans seven deck elements: what the public mesh represents."""
        h = max(self.sides[0] / self.cells[0], self.sides[1] / self.cells[1])
        return float(np.sqrt(self.rigidity() / (2700.0 * self.thickness)) * (np.pi / (7 * h)) ** 2 / (2 * np.pi))

    def node(self, i: int, j: int) -> int:
        """Deck node of grid point (i, j)."""
        return 1 + i + j * (self.cells[0] + 1)

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
        for j in range(ny):
            for i in range(nx):
                corners = self.node(i, j), self.node(i + 1, j), self.node(i + 1, j + 1), self.node(i, j + 1)
                out.append(f"CQUAD4,{1 + i + j * nx},{1 if i < nx // 2 else 2}," + ",".join(map(str, corners)))
        out += [f"CONM2,{90000 + k},{n},,{num(m)}" for k, (n, m) in enumerate(self.lumps.items(), 1)]
        out.append("SPC1,1,3," + ",".join(map(str, self.clamped)))
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


def assemble(s: Plate, real, get) -> tuple[sp.coo_matrix, sp.coo_matrix]:
    """K and M on the fine mesh; `get(place, component)` numbers equations: 3, 5, 4, 7 are w, w_x, w_y, w_xy."""
    n = min(real.n_sub, 2)
    nx, ny = s.cells[0] * n, s.cells[1] * n
    hx, hy = s.sides[0] / nx, s.sides[1] / ny
    kinds = {
        p: cell_matrices(hx, hy, s.rigidity(real.factor[p]), 2700.0 * real.density[p] * s.thickness) for p in s.groups
    }

    def place(i: int, j: int) -> object:
        return s.node(i // n, j // n) if i % n == 0 and j % n == 0 else ("fine", i, j)

    rows, cols, kv, mv = [], [], [], []
    for j in range(ny):
        for i in range(nx):
            ends = [(i + a, ca) for a in (0, 1) for ca in (0, 1)]
            dofs = np.array(
                [
                    get(place(p, j + b), {(0, 0): 3, (1, 0): 5, (0, 1): 4, (1, 1): 7}[ca, cb])
                    for p, ca in ends
                    for b in (0, 1)
                    for cb in (0, 1)
                ]
            )
            k, m = kinds[1 if i < nx // 2 else 2]
            on = np.flatnonzero(dofs >= 0)
            I, J = np.meshgrid(dofs[on], dofs[on], indexing="ij")
            rows.append(I.ravel())
            cols.append(J.ravel())
            kv.append(k[np.ix_(on, on)].ravel())
            mv.append(m[np.ix_(on, on)].ravel())
    r, c = np.concatenate(rows), np.concatenate(cols)
    size = int(r.max()) + 1
    return sp.coo_matrix((np.concatenate(kv), (r, c)), (size, size)), sp.coo_matrix(
        (np.concatenate(mv), (r, c)), (size, size)
    )
