"""The beam of the example in two languages: a Nastran deck for femend's core and a CalculiX deck as a template.

A cantilever of three segments in quadratic tetrahedra, the same nodes and elements in both: their stiffness is exact by
the rule both programs use, so that what differs in the end differs by the way there. What is unknown are the
modulus of each segment and the density.
"""

from __future__ import annotations

from itertools import permutations, product

import numpy as np
from numpy.typing import NDArray

LENGTH, WIDTH, HEIGHT = 0.6, 0.05, 0.03
N_X, N_Y, N_Z = 12, 2, 1
E, NU, RHO = 70.0e9, 0.33, 2700.0
SEGMENTS = 3
# a cell is cut into six tetrahedra, one for each order of the axes on the way from corner to corner (Kuhn)
WAYS = tuple(permutations(range(3)))
# edges whose middles are nodes 5 to 10, in Nastran and CalculiX alike
EDGES = ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))

Place = tuple[int, int, int]


def corners(cell: Place, way: tuple[int, ...]) -> list[Place]:
    """The four corners of a tetrahedron, in half steps, counted so that its volume is positive."""
    at = [2 * c for c in cell]
    found = [tuple(at)]
    for axis in way:
        at[axis] += 2
        found.append(tuple(at))
    a, b, c, d = (np.array(x) for x in found)
    if np.linalg.det(np.array([b - a, c - a, d - a])) < 0:
        found[1], found[2] = found[2], found[1]
    return [(int(x), int(y), int(z)) for x, y, z in found]


def mesh() -> tuple[dict[Place, int], list[tuple[int, ...]], list[int]]:
    """Node number by half-step indices, the 10 nodes of every element, and its segment from 1."""
    ids: dict[Place, int] = {}
    elements, segments = [], []
    for cell in product(range(N_X), range(N_Y), range(N_Z)):
        for way in WAYS:
            p = corners(cell, way)
            middles = [tuple((a + b) // 2 for a, b in zip(p[m], p[n], strict=True)) for m, n in EDGES]
            elements.append(tuple(ids.setdefault((x, y, z), len(ids) + 1) for x, y, z in (*p, *middles)))
            segments.append(1 + cell[0] * SEGMENTS // N_X)
    return ids, elements, segments


def xyz(place: Place) -> tuple[float, float, float]:
    """Coordinates in m of a node by its half-step indices."""
    i, j, k = place
    return LENGTH * i / (2 * N_X), WIDTH * j / (2 * N_Y), HEIGHT * k / (2 * N_Z)


def sensors() -> list[int]:
    """Nodes of the sensors: one edge of the beam, at every element end but the clamped one."""
    ids = mesh()[0]
    return [ids[2 * i, 0, 2 * N_Z] for i in range(1, N_X + 1)]


def held() -> list[int]:
    """Nodes of the clamped end."""
    return sorted(n for (i, _, _), n in mesh()[0].items() if i == 0)


def nastran() -> str:
    """The deck for femend."""
    ids, elements, segments = mesh()
    lines = ["SOL 103", "CEND", "SPC = 1", "BEGIN BULK", "PARAM,COUPMASS,1"]
    for place, n in ids.items():
        lines.append(f"GRID,{n},," + ",".join(f"{x:.6f}" for x in xyz(place)))
    for s in range(1, SEGMENTS + 1):
        lines += [f"MAT1,{s},{E:.4E},,{NU},{RHO:.1f}", f"PSOLID,{s},{s}"]
    for number, (nodes, s) in enumerate(zip(elements, segments, strict=True), 1):
        lines.append(f"CTETRA,{number},{s}," + ",".join(str(n) for n in nodes[:6]) + ",+")
        lines.append("+," + ",".join(str(n) for n in nodes[6:]))
    lines += [f"SPC1,1,123456,{n}" for n in held()]
    return "\n".join([*lines, "ENDDATA", ""])


def calculix(n_modes: int) -> str:
    """The deck for CalculiX as a template with the fields E1, E2, E3 and rho."""
    ids, elements, segments = mesh()
    lines = ["*NODE, NSET=ALL"]
    lines += [f"{n}, " + ", ".join(f"{x:.6f}" for x in xyz(place)) for place, n in ids.items()]
    for s in range(1, SEGMENTS + 1):
        lines.append(f"*ELEMENT, TYPE=C3D10, ELSET=SEG{s}")
        for number, (nodes, own) in enumerate(zip(elements, segments, strict=True), 1):
            if own == s:
                lines.append(f"{number}, " + ", ".join(str(n) for n in nodes))
    lines.append("*NSET, NSET=SENSORS")
    lines += [f"{n}," for n in sensors()]
    lines.append("*NSET, NSET=HELD")
    lines += [f"{n}," for n in held()]
    for s in range(1, SEGMENTS + 1):
        lines += [f"*MATERIAL, NAME=M{s}", "*ELASTIC", f"{{{{E{s}}}}}, {NU}", "*DENSITY", "{{rho}}"]
        lines.append(f"*SOLID SECTION, ELSET=SEG{s}, MATERIAL=M{s}")
    lines += [
        "*BOUNDARY",
        "HELD, 1, 3",
        "*STEP",
        "*FREQUENCY",
        f"{n_modes}",
        "*NODE PRINT, NSET=SENSORS",
        "U",
        "*END STEP",
    ]
    return "\n".join([*lines, ""])


def noisy(x: NDArray[np.float64], share: float, rng: np.random.Generator) -> NDArray[np.float64]:
    """Values with noise of `share` of the largest of each column."""
    return np.asarray(x + share * np.abs(x).max(axis=0) * rng.standard_normal(x.shape))
