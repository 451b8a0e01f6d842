"""Writes `model.bdf`: a two-storey concrete frame in 12 groups, after the kind of the published test frame.

python python/examples/building_frame/make_model.py

One bay of 5.5 m wide and two of 7 m long, storeys of 3.6 m; every group is a material of its own, so that its stiffness
is a parameter: columns by storey and side (1 to 4), beams along by storey and bay (5 to 8), beams across by storey (9,
10), slabs by storey (11, 12).
"""

from __future__ import annotations

from pathlib import Path

X, Y, Z = (0.0, 7.0, 14.0), (0.0, 5.5), (0.0, 3.6, 7.2)
E, NU, RHO = 26.0e9, 0.2, 2400.0
# elements a bay, across and a storey
N_X, N_Y, N_Z = 4, 4, 3
COLUMN, BEAM, THICKNESS = (0.45, 0.45), (0.40, 0.55), 0.15
GROUPS = 12
N_MODES = 3


def bar(width: float, height: float) -> str:
    """A, I1, I2, J of a rectangle; I1 bends it along its height."""
    a, b = max(width, height), min(width, height)
    J = a * b**3 * (1 / 3 - 0.21 * b / a * (1 - b**4 / (12 * a**4)))
    return f"{width * height:.5E},{width * height**3 / 12:.5E},{height * width**3 / 12:.5E},{J:.5E}"


class Mesh:
    """Nodes by place, and elements."""

    def __init__(self) -> None:
        self.nodes: dict[tuple[float, float, float], int] = {}
        self.elements: list[str] = []

    def node(self, x: float, y: float, z: float) -> int:
        """The node at a place, made where there is none."""
        return self.nodes.setdefault((round(x, 6), round(y, 6), round(z, 6)), len(self.nodes) + 1)

    def line(self, a: tuple[float, float, float], b: tuple[float, float, float], n: int, group: int, up: str) -> None:
        """A member of n bars with `up` as its orientation."""
        for k in range(n):
            ends = [self.node(*(p + (q - p) * t / n for p, q in zip(a, b, strict=True))) for t in (k, k + 1)]
            self.elements.append(f"CBAR,{len(self.elements) + 1},{group},{ends[0]},{ends[1]},{up}")

    def slab(self, z: float, group: int) -> None:
        """The floor at height z, on the beams' nodes."""
        for bay in range(2):
            for i in range(N_X):
                for j in range(N_Y):
                    dx, dy = (X[1] - X[0]) / N_X, Y[1] / N_Y
                    x, y = X[bay] + i * dx, j * dy
                    at = [self.node(x + a * dx, y + b * dy, z) for a, b in ((0, 0), (1, 0), (1, 1), (0, 1))]
                    self.elements.append(f"CQUAD4,{len(self.elements) + 1},{group},{','.join(map(str, at))}")


def mesh() -> Mesh:
    """Nodes and elements of the frame."""
    m = Mesh()
    for storey in (1, 2):
        for x in X:
            for side, y in enumerate(Y):
                m.line((x, y, Z[storey - 1]), (x, y, Z[storey]), N_Z, 2 * storey - 1 + side, "1.,0.,0.")
        for y in Y:
            for bay in (0, 1):
                m.line((X[bay], y, Z[storey]), (X[bay + 1], y, Z[storey]), N_X, 3 + 2 * storey + bay, "0.,0.,1.")
        for x in X:
            m.line((x, Y[0], Z[storey]), (x, Y[1], Z[storey]), N_Y, 8 + storey, "0.,0.,1.")
        m.slab(Z[storey], 10 + storey)
    return m


def sensors() -> list[tuple[int, int]]:
    """43 measured DOFs as (node, component): both horizontal directions at the heads of all columns and at half height
    of those of the first storey's front, vertical ones along the front beams and the slabs' middles."""
    m = mesh()
    found = [(m.node(x, y, z), c) for z in Z[1:] for x in X for y in Y for c in (1, 2)]  # 24
    third = (Z[1] - Z[0]) / N_Z
    found += [(m.node(x, Y[0], third), c) for x in X for c in (1, 2)]  # 30
    beams = [(X[bay] + k * (X[1] - X[0]) / N_X, Y[0], z) for z in Z[1:] for bay in (0, 1) for k in (1, 2, 3)]
    found += [(m.node(*place), 3) for place in beams]  # 42
    return [*found, (m.node(X[1] / 2, Y[1] / 2, Z[2]), 3)]


def deck() -> str:
    """The deck as text."""
    m = mesh()
    lines = [
        "$ two-storey concrete frame in 12 groups, SI units; written by make_model.py",
        "SOL 103",
        "CEND",
        "SPC = 1",
    ]
    lines += ["BEGIN BULK", "PARAM,COUPMASS,1"]
    for g in range(1, GROUPS + 1):
        lines.append(f"MAT1,{g},{E:.5E},,{NU},{RHO:.1f}")
        if g > 10:
            lines.append(f"PSHELL,{g},{g},{THICKNESS},{g}")
        else:
            lines.append(f"PBAR,{g},{g},{bar(*(COLUMN if g <= 4 else BEAM))}")
    lines += [f"GRID,{n},,{x},{y},{z}" for (x, y, z), n in m.nodes.items()]
    lines += m.elements
    lines += [f"SPC1,1,123456,{n}" for (_, _, z), n in m.nodes.items() if z == 0.0]
    return "\n".join([*lines, "ENDDATA", ""])


if __name__ == "__main__":
    Path(__file__).with_name("model.bdf").write_text(deck(), encoding="ascii")
