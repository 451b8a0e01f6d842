"""How linear solids are cut along the middles of their edges into such of half the size, as the cards number nodes."""

from __future__ import annotations

from itertools import product

__all__ = ["PARTS"]

Nodes = tuple[int, ...]
# a new node lies in the middle of some of the element's corners
Part = tuple[str, tuple[Nodes, ...]]


def _middle(corners: str) -> Nodes:
    return tuple(int(c) for c in corners)


def _part(card: str, nodes: str) -> Part:
    return card, tuple(_middle(n) for n in nodes.split())


def _of_brick() -> tuple[Part, ...]:
    """Eight bricks, the one at each corner."""
    at = ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1))
    halves = ((0,), (0, 1), (1,))

    def node(place: tuple[int, ...]) -> Nodes:
        """Corners among which the point `place` halves along each edge is the middle."""
        return tuple(sorted(at.index(corner) for corner in product(*(halves[p] for p in place))))

    def brick(first: tuple[int, ...]) -> Part:
        return "CHEXA", tuple(node(tuple(f + c for f, c in zip(first, corner, strict=True))) for corner in at)

    return tuple(brick(first) for first in at)


def _of_wedge() -> tuple[Part, ...]:
    """Eight wedges in two layers: three at the edges along the wedge, one in the middle."""
    triangles = ((0,), (0, 1), (0, 2)), ((0, 1), (1,), (1, 2)), ((0, 2), (1, 2), (2,)), ((0, 1), (1, 2), (0, 2))

    def node(corners: Nodes, level: int) -> Nodes:
        """A point of the triangle below, half way up, or above."""
        above = tuple(c + 3 for c in corners)
        return (corners, corners + above, above)[level]

    def wedge(triangle: tuple[Nodes, ...], level: int) -> Part:
        return "CPENTA", tuple(node(c, level + up) for up in (0, 1) for c in triangle)

    return tuple(wedge(triangle, level) for level in (0, 1) for triangle in triangles)


# a tetrahedron is cut into the four at its corners and the four around a diagonal of what is left (Bey, Computing 55,
# 1995); a pyramid into one at each corner, one upside down in the middle, and four tetrahedra between them
PARTS: dict[str, tuple[Part, ...]] = {
    "CHEXA": _of_brick(),
    "CPENTA": _of_wedge(),
    "CTETRA": (
        _part("CTETRA", "0 01 02 03"),
        _part("CTETRA", "01 1 12 13"),
        _part("CTETRA", "02 12 2 23"),
        _part("CTETRA", "03 13 23 3"),
        _part("CTETRA", "01 02 03 13"),
        _part("CTETRA", "01 12 02 13"),
        _part("CTETRA", "02 23 03 13"),
        _part("CTETRA", "02 12 23 13"),
    ),
    "CPYRAM": (
        _part("CPYRAM", "0 01 0123 03 04"),
        _part("CPYRAM", "01 1 12 0123 14"),
        _part("CPYRAM", "0123 12 2 23 24"),
        _part("CPYRAM", "03 0123 23 3 34"),
        _part("CPYRAM", "04 14 24 34 4"),
        _part("CPYRAM", "04 34 24 14 0123"),
        _part("CTETRA", "01 0123 04 14"),
        _part("CTETRA", "12 0123 14 24"),
        _part("CTETRA", "23 0123 24 34"),
        _part("CTETRA", "03 0123 34 04"),
    ),
}
