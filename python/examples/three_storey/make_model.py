"""Writes model.bdf, the frame from its stated dimensions; run it again after changing one of them."""

from __future__ import annotations

from pathlib import Path

# m, kg, N: floors and their middles' heights, clear length, width and thickness of the four legs of a storey
MASS, HEIGHTS = 5.201, (0.2018, 0.3801, 0.5584)
LENGTH, WIDTH, THICKNESS, LEGS, E = 0.1533, 0.025, 0.003, 4, 70e9
# half the floors' thickness: what the storey height leaves beside the legs
HALF = (HEIGHTS[1] - HEIGHTS[0] - LENGTH) / 2


def bar(storey: int) -> list[str]:
    """Property of the four legs of a storey taken together; plane 1 holds X, the weak direction."""
    area, weak, strong = WIDTH * THICKNESS, WIDTH * THICKNESS**3 / 12, THICKNESS * WIDTH**3 / 12
    torsion = WIDTH * THICKNESS**3 / 3
    return [f"PBAR,{storey},1," + ",".join(f"{LEGS * v:.6e}" for v in (area, weak, strong, torsion))]


def deck() -> str:
    """The deck: floors move in X as rigid bodies, legs are clamped in them."""
    lines = [
        "$ three-storey frame of aluminium from its stated dimensions, SI units (m, kg, s, N)",
        "$ floors: nodes 10, 20, 30 (middle), +1 lower face, +2 upper face; a bar stands for the four legs of a storey",
        "SOL 103", "CEND", "SPC = 1", "METHOD = 1", "BEGIN BULK", "EIGRL,1,,,3",
        f"MAT1,1,{E:.1e},,0.33,0.",
        f"GRID,1,,0.,0.,{HEIGHTS[0] - HALF - LENGTH:.5f}",
        "SPC1,1,123456,1", "SPC1,1,23456,10,20,30",
    ]  # fmt: skip
    foot = 1
    for storey, height in enumerate(HEIGHTS, start=1):
        floor = 10 * storey
        for node, z in ((floor, height), (floor + 1, height - HALF), (floor + 2, height + HALF)):
            lines.append(f"GRID,{node},,0.,0.,{z:.5f}")
        lines += bar(storey)
        lines.append(f"CBAR,{storey},{storey},{foot},{floor + 1},1.,0.,0.")
        lines.append(f"CONM2,{100 + storey},{floor},,{MASS}")
        lines.append(f"RBE2,{200 + storey},{floor},123456,{floor + 1},{floor + 2}")
        foot = floor + 2
    return "\n".join([*lines, "ENDDATA", ""])


if __name__ == "__main__":
    Path(__file__).with_name("model.bdf").write_text(deck(), encoding="ascii")
