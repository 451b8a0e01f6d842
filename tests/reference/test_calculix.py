"""Three mixed decks against CalculiX: curved 20-node bricks with wedges, tetrahedra, masses, springs, rods, equations.

Same theory on both sides for C3D20, MASS, SPRING and EQUATION: frequencies agree to 1e-6. CalculiX integrates the
mass of C3D4, C3D10 and C3D15 (and the stiffness of C3D15) with fewer points than their shape functions need, which
moves the frequencies of coarse meshes of these alone by 1 to 10, 0.01 to 0.9 and 0.1 to 0.4 %; as a part of a mesh of
bricks they stay within 0.1 %. Left out: C3D8I has other incompatible modes (Simo and Armero's); shells, beams and
trusses become solids there, which is another theory than CQUAD4's, CTRIA3's, CBAR's and CROD's.
"""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from femend.analysis.model_modes import model_modes
from femend.model import read_model

E, NU, RHO = 2.1e11, 0.3, 7850.0
# corners of the parts of a brick, positive inside; their edges in Nastran's order of mid-side nodes
PARTS = {
    "CHEXA": ["01234567"],
    "CPENTA": ["013457", "123567"],
    "CTETRA": ["0134", "1345", "3457", "1235", "2357", "2567"],
}
EDGES = {
    "CHEXA": "01 12 23 30 04 15 26 37 45 56 67 74",
    "CPENTA": "01 12 20 03 14 25 34 45 53",
    "CTETRA": "01 12 20 03 13 23",
}
# CalculiX has the edges between the two faces last
THEIRS = {
    "CHEXA": ("C3D20", [*range(12), *range(16, 20), *range(12, 16)]),
    "CPENTA": ("C3D15", [*range(9), *range(12, 15), *range(9, 12)]),
    "CTETRA": ("C3D10", list(range(10))),
}


class Twin:
    """One model as Nastran cards and as CalculiX input."""

    def __init__(self) -> None:
        self.cards = [f"MAT1,1,{E},,{NU},{RHO}", "PSOLID,1,1"]
        self.lines: list[str] = []
        self.ids: dict[tuple[int, int, int], int] = {}
        self.members: dict[str, list[str]] = {}
        self.eid = 0
        self.held: list[int] = []

    def node(self, at: tuple[int, int, int]) -> int:
        """Node at a point of the doubled grid, bent and twisted; those at x = 0 are held."""
        if at not in self.ids:
            number = self.ids[at] = len(self.ids) + 1
            r, s, t = (0.15 * c for c in at)
            x, y, z = r + 0.1 * s * t, s * (1 + 0.1 * r) - 0.05 * t, t + 0.1 * r * r + 0.06 * s
            self.cards.append(f"GRID,{number},,{x!r},{y!r},{z!r}")
            self.lines.append(f"{number}, {x!r}, {y!r}, {z!r}")
            if at[0] == 0:
                self.held.append(number)
        return self.ids[at]

    def brick(self, cell: tuple[int, int, int], card: str) -> None:
        square = [(0, 0), (2, 0), (2, 2), (0, 2)]
        corner = [(2 * cell[0] + a, 2 * cell[1] + b, 2 * cell[2] + c) for c in (0, 2) for a, b in square]
        for part in PARTS[card]:
            own = [corner[int(c)] for c in part]
            nodes = [self.node(c) for c in own]
            for edge in EDGES[card].split():
                p, q = (own[int(c)] for c in edge)
                nodes.append(self.node(((p[0] + q[0]) // 2, (p[1] + q[1]) // 2, (p[2] + q[2]) // 2)))
            theirs, order = THEIRS[card]
            self.eid += 1
            rows = [nodes[:6], *(nodes[at : at + 8] for at in range(6, len(nodes), 8))]
            self.cards.append(f"{card},{self.eid},1," + ",".join(map(str, rows[0])) + ("," if len(rows) > 1 else ""))
            self.cards += ["+," + ",".join(map(str, row)) for row in rows[1:]]
            text = [str(nodes[i]) for i in order]
            lines = [", ".join([str(self.eid), *text[:15]]) + ("," if len(text) > 15 else "")]
            if len(text) > 15:
                lines.append(", ".join(text[15:]))
            self.members.setdefault(theirs, []).extend(lines)

    def ours(self, folder: Path, n: int) -> np.ndarray:
        file = folder / "twin.bdf"
        held = [f"SPC1,1,123,{node}" for node in self.held]
        head = ["SOL 103", "CEND", "SPC = 1", "MPC = 1", "BEGIN BULK", "PARAM,COUPMASS,1"]
        fixed = [] if any(card.startswith("MPC") for card in self.cards) else ["MPC,1,1,4,1.,1,5,-1."]
        file.write_text("\n".join([*head, *self.cards, *held, *fixed, "ENDDATA", ""]))
        return model_modes(read_model(file), n_modes=n).freq

    def calculix(self, folder: Path, n: int, extra: list[str]) -> np.ndarray:
        program = shutil.which("ccx")
        if program is None:
            pytest.skip("CalculiX (ccx) is not installed")
        out = ["*NODE, NSET=ALL", *self.lines]
        for kind, members in self.members.items():
            out += [f"*ELEMENT, TYPE={kind}, ELSET={kind}", *members]
        out += ["*MATERIAL, NAME=M", "*ELASTIC", f"{E}, {NU}", "*DENSITY", f"{RHO}"]
        out += [f"*SOLID SECTION, ELSET={kind}, MATERIAL=M" for kind in self.members]
        out += [*extra, "*BOUNDARY", *(f"{node}, 1, 3" for node in self.held)]
        out += ["*STEP", "*FREQUENCY", f"{n}", "*NODE FILE", "U", "*END STEP", ""]
        (folder / "twin.inp").write_text("\n".join(out))
        run = subprocess.run(
            [program, "-i", "twin"], cwd=folder, capture_output=True, text=True, timeout=120, check=False
        )
        table = (folder / "twin.dat").read_text() if (folder / "twin.dat").exists() else run.stdout
        rows = [line.split() for line in table.splitlines()]
        found = [float(row[3]) for row in rows if len(row) == 5 and row[0].isdigit()]
        assert len(found) >= n, run.stdout[-2000:]
        return np.array(found[:n])


def compare(twin: Twin, folder: Path, extra: list[str], tolerance: float) -> None:
    theirs = twin.calculix(folder, 8, extra)
    np.testing.assert_allclose(twin.ours(folder, 8), theirs, rtol=tolerance)


def test_quadratic_bricks_wedges_and_tetrahedra_with_masses(tmp_path: Path) -> None:
    twin = Twin()
    # wedges and bricks share whole faces; tetrahedra stand on the wedges' triangles
    for x in range(3):
        twin.brick((x, 0, 0), "CHEXA")
        twin.brick((x, 1, 0), "CPENTA" if x == 1 else "CHEXA")
    twin.brick((1, 1, 1), "CTETRA")
    tip = twin.node((6, 4, 2))
    twin.cards.append(f"CONM2,900,{tip},,30.")
    compare(twin, tmp_path, ["*ELEMENT, TYPE=MASS, ELSET=TIP", f"900, {tip}", "*MASS, ELSET=TIP", "30."], 1e-3)


def test_bricks_with_a_rod_and_springs(tmp_path: Path) -> None:
    twin = Twin()
    for x in range(4):
        for y in range(2):
            twin.brick((x, y, 0), "CHEXA")
    a, b, c = twin.node((8, 0, 0)), twin.node((4, 4, 2)), twin.node((8, 4, 2))
    twin.cards += [
        "MAT1,2,2.1+11,,0.3",
        f"CONROD,900,{a},{b},2,2.-3",
        f"CELAS2,901,4.+8,{c},3",
        f"CELAS2,902,3.+8,{a},2,{c},2",
    ]
    # CalculiX's truss has bending modes of its own: the massless rod is an axial spring there
    xyz = [np.array([float(v) for v in twin.lines[n - 1].split(", ")[1:]]) for n in (a, b)]
    axial = 2.1e11 * 2e-3 / float(np.linalg.norm(xyz[1] - xyz[0]))
    extra = ["*ELEMENT, TYPE=SPRINGA, ELSET=ROD", f"900, {a}, {b}", "*SPRING, ELSET=ROD", "", f"{axial:.12e}"]
    extra += ["*ELEMENT, TYPE=SPRING1, ELSET=S1", f"901, {c}", "*SPRING, ELSET=S1", "3,", "4.e8"]
    extra += ["*ELEMENT, TYPE=SPRING2, ELSET=S2", f"902, {a}, {c}", "*SPRING, ELSET=S2", "2, 2", "3.e8"]
    compare(twin, tmp_path, extra, 1e-3)


def test_two_bodies_tied_by_equations(tmp_path: Path) -> None:
    twin = Twin()
    for x in range(2):
        twin.brick((x, 0, 0), "CHEXA")
        twin.brick((x, 3, 0), "CHEXA")
    pairs = [((4, 0, 0), (4, 6, 0)), ((4, 2, 0), (4, 8, 0)), ((4, 2, 2), (4, 8, 2))]
    extra = []
    for k, (p, q) in enumerate(pairs):
        a, b = twin.node(p), twin.node(q)
        for c in (1, 2, 3):
            w = 0.5 + 0.1 * (k + c)
            twin.cards.append(f"MPC,1,{a},{c},1.,{b},{c},{-w!r}")
            extra += ["*EQUATION", "2", f"{a}, {c}, 1., {b}, {c}, {-w!r}"]
    compare(twin, tmp_path, extra, 1e-6)
