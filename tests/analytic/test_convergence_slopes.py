"""Frequencies of refined meshes approach the continuum's with the order that theory gives them.

Shape functions complete to degree p in an energy with derivatives of order m leave eigenvalues, and so frequencies, an
error of order h^(2 (p + 1 - m)) (Strang and Fix, An Analysis of the Finite Element Method, 1973, chapter 6): 2 p for
solids, rods and shafts (m = 1), 4 for the cubic deflection of beams (m = 2).
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from femend import _core

sys.path.insert(0, str(Path(__file__).parents[1]))
import fe

E, NU, RHO = 2.1e11, 0.3, 7850.0
G = E / (2 * (1 + NU))
SIDES = np.array([1.0, 0.9, 0.6])

CORNERS = np.array(
    [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1], [0.5, 0.5, 0.5]]
)
"""Corners of a cell in the order of a CHEXA, and its centre."""

HEXA = [[0, 1, 2, 3, 4, 5, 6, 7]]
PENTA = [[0, 1, 2, 4, 5, 6], [0, 2, 3, 4, 6, 7]]
TETRA = [[0, 1, 2, 6], [0, 3, 7, 6], [0, 4, 5, 6], [0, 5, 1, 6], [0, 2, 3, 6], [0, 7, 4, 6]]
PYRAM = [[0, 1, 2, 3, 8], [4, 7, 6, 5, 8], [0, 4, 5, 1, 8], [3, 2, 6, 7, 8], [0, 3, 7, 4, 8], [1, 5, 6, 2, 8]]
RING = [(0, 1), (1, 2), (2, 3), (3, 0)]
EDGES = {
    "CHEXA": [*RING, (0, 4), (1, 5), (2, 6), (3, 7), (4, 5), (5, 6), (6, 7), (7, 4)],
    "CPENTA": [(0, 1), (1, 2), (2, 0), (0, 3), (1, 4), (2, 5), (3, 4), (4, 5), (5, 3)],
    "CTETRA": [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)],
    "CPYRAM": [*RING, (0, 4), (1, 4), (2, 4), (3, 4)],
}
CUTS = {"CHEXA": HEXA, "CPENTA": PENTA, "CTETRA": TETRA, "CPYRAM": PYRAM}


def box(card: str, quadratic: bool, n: int) -> list[str]:
    """Deck of a box of n x n x n cells, moved so that none is a parallelepiped, on rollers all around."""
    ids: dict[tuple[float, ...], int] = {}
    cards = ["PSOLID,1,1", f"MAT1,1,{E!r},,{NU},{RHO}"]

    def node(at: tuple[float, ...], x: np.ndarray) -> int:
        if at not in ids:
            ids[at] = len(ids) + 1
            cards.append(f"GRID,{ids[at]},," + ",".join(repr(float(v)) for v in x))
            held = "".join(str(c + 1) for c in range(3) if at[c] in (0, n))
            if held:
                cards.append(f"SPC1,1,{held},{ids[at]}")
        return ids[at]

    def moved(at: np.ndarray) -> np.ndarray:
        share = at / n
        return np.asarray(SIDES * (share + 0.04 * np.array([1, -1, 1]) * np.prod(np.sin(np.pi * share))))

    for cell in np.ndindex(n, n, n):
        corners = CORNERS + cell
        for cut in CUTS[card]:
            at = corners[cut]
            nodes = [node(tuple(p), moved(p)) for p in at]
            for a, b in EDGES[card] if quadratic else []:
                nodes.append(node(tuple(0.5 * (at[a] + at[b])), 0.5 * (moved(at[a]) + moved(at[b]))))
            cards.append(f"{card},{len(cards)},1," + ",".join(map(str, nodes[:6])))
            cards += ["+," + ",".join(map(str, nodes[i : i + 8])) for i in range(6, len(nodes), 8)]
    return cards


def lowest(model: _core.FeModel) -> float:
    """Lowest angular frequency."""
    indptr, indices, k, m, _, _ = model.assemble()
    return float(2 * np.pi * _core.modes(indptr, indices, k, m, n_modes=1)[0][0])


def slopes(error: Callable[[int], float], meshes: tuple[int, ...]) -> np.ndarray:
    """Orders between meshes and the next finer ones."""
    errors = np.array([error(n) for n in meshes])
    assert (errors[:-1] > errors[1:]).all(), f"a finer mesh is no better: {errors}"
    return np.asarray(np.log(errors[:-1] / errors[1:]) / np.log(np.array(meshes[1:]) / np.array(meshes[:-1])))


@pytest.mark.parametrize("quadratic", [False, True], ids=["linear", "quadratic"])
@pytest.mark.parametrize("card", list(CUTS))
def test_solids_approach_a_box_on_rollers_with_twice_their_degree(tmp_path: Path, card: str, quadratic: bool) -> None:
    """Rollers reflect plane waves: omega = c_s pi sqrt(1/Lx^2 + 1/Ly^2) is the lowest, of shear in the x-y plane."""
    exact = np.sqrt(G / RHO) * np.pi * np.hypot(1 / SIDES[0], 1 / SIDES[1])

    def error(n: int) -> float:
        return abs(lowest(fe.model(tmp_path, box(card, quadratic, n))) / exact - 1)

    order = slopes(error, (4, 6) if quadratic else (4, 8))
    # the next term of the series still moves the order by up to 0.3 here; one power of h less would move it by 1
    np.testing.assert_allclose(order, 4 if quadratic else 2, rtol=0, atol=0.4)


@pytest.mark.parametrize("coupled", [True, False], ids=["consistent", "lumped"])
@pytest.mark.parametrize(("component", "speed"), [(1, np.sqrt(E / RHO)), (4, np.sqrt(G * 3e-8 / (RHO * 7e-8)))])
def test_rods_and_shafts_approach_their_wave_with_order_two(
    tmp_path: Path, component: int, speed: float, coupled: bool
) -> None:
    """Held at one end: omega = c pi / 2 L; linear shapes, with the mass at the nodes too."""
    held = "".join(c for c in "123456" if c != str(component))

    def error(n: int) -> float:
        cards = [*fe.line(n, 1.3), f"SPC1,1,{held},1,THRU,{n + 1}", f"SPC1,1,{component},1"]
        return abs(lowest(fe.model(tmp_path, cards, coupled=coupled)) / (speed * np.pi / 2.6) - 1)

    # errors run as h^2 + h^4: 0.01 at these meshes
    np.testing.assert_allclose(slopes(error, (4, 8, 16)), 2, rtol=0, atol=0.02)


@pytest.mark.parametrize(
    ("k", "expected", "meshes"),
    # where the element is long the term of order four still exceeds that of shear
    [(0.0, 4, (2, 4, 8)), (0.05, 2, (16, 32, 64))],
    ids=["rigid in shear", "soft in shear"],
)
def test_beams_approach_theirs_with_order_four_and_two(
    tmp_path: Path, k: float, expected: int, meshes: tuple[int, ...]
) -> None:
    """Pinned at both ends, plane 1. Without shear the deflection is the cubic (p = 3, m = 2); a shear strain that is
    constant over an element is complete to degree 1 of the deflection only (p = 1, m = 1)."""
    length, area, inertia = 1.3, 6e-4, 5e-8
    q = np.pi / length
    m, j, bend = RHO * area, RHO * inertia, E * inertia * q**2
    # Rayleigh's beam, or the lower root of Timoshenko's frequency equation
    shear = k * G * area
    a, b, c = m * j, -(m * (bend + shear) + shear * q**2 * j), shear * bend * q**2
    exact = np.sqrt((-b - np.sqrt(b * b - 4 * a * c)) / (2 * a)) if k else np.sqrt(bend * q**2 / (m + j * q**2))

    def error(n: int) -> float:
        cards = fe.line(n, length, shear=f"{k},{k}" if k else "")
        cards += [f"SPC1,1,1345,1,THRU,{n + 1}", f"SPC1,1,2,1,{n + 1}"]
        return abs(lowest(fe.model(tmp_path, cards)) / exact - 1)

    np.testing.assert_allclose(slopes(error, meshes), expected, rtol=0, atol=0.1)
