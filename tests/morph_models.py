"""Decks whose geometry the tests change."""

from __future__ import annotations

from pathlib import Path

import numpy as np

HEAD = "SOL 103\nCEND\nSPC = 1\nBEGIN BULK\nPARAM,COUPMASS,1\n"
STEEL = "MAT1,1,2.1E11,,.3,7850.\n"


def frame_deck(folder: Path, *, apex: float = 0.0) -> Path:
    """A pitched portal frame of four members in two files; the joint at its apex (node 21) stands `apex` too high.

    GRIDs are in small, large and free field, one in a cylindrical system about the apex' axis.
    """
    rise = 0.6 + apex
    main = (
        "$ portal frame, kept by hand\n"
        + HEAD
        + "INCLUDE 'parts/nodes.bdf'\n"
        + STEEL
        + "PBAR,1,1,1.2E-3,4.E-7,9.E-7,8.E-7\n"
        + "CORD2C,5,,1.5,0.,0.,1.5,1.,0.\n+,1.5,0.,1.\n"
        + "".join(
            f"CBAR,{i},1,{a},{b},.3,1.,.1\n"
            for i, (a, b) in enumerate(
                [(1, 2), (2, 3), (3, 4), (4, 11), (11, 12), (12, 13), (13, 21), (21, 31), (31, 32), (32, 33), (33, 41),
                 (41, 42), (42, 43), (43, 44)],
                start=1,
            )
        )
        + "CONM2,90,21,,25.\nSPC1,1,123456,1,44\nENDDATA\n"
    )  # fmt: skip
    lines = ["$ nodes of the frame   <- from the drawing"]
    for k, node in enumerate((1, 2, 3)):
        lines.append(f"GRID    {node:<8d}        {0.0:<8.3f}{0.0:<8.3f}{0.5 * k:<8.3f}")
    lines.append(f"GRID    4               {0.0:<8.3f}{0.0:<8.3f}{1.5:<8.3f}        $ left knee")
    for k, node in enumerate((11, 12, 13), start=1):
        x, z = 1.5 * k / 4, 1.5 + rise * k / 4
        lines += [f"GRID*   {node:<16d}                {x:<16.10f}{0.0:<16.10f}", f"*       {z:<16.10f}"]
    lines.append(f"GRID,21,,1.5,0.,{1.5 + rise:.6f},,,     $ apex")
    for k, node in enumerate((31, 32, 33), start=1):
        x, z = 1.5 + 1.5 * k / 4, 1.5 + rise * (4 - k) / 4
        r, turn = float(np.hypot(x - 1.5, z)), float(np.degrees(np.arctan2(x - 1.5, z)))
        lines.append(f"GRID,{node},5,{r:.9f},{turn:.9f},0." if node == 32 else f"GRID,{node},,{x:.9f},0.,{z:.9f}")
    for k, node in enumerate((41, 42, 43, 44)):
        lines.append(f"GRID    {node:<8d}        {3.0:<8.3f}{0.0:<8.3f}{1.5 - 0.5 * k:<8.3f}")
    lines.append("GRID,50,,9.,9.,9.")
    (folder / "parts").mkdir(parents=True, exist_ok=True)
    (folder / "parts" / "nodes.bdf").write_text("\n".join(lines) + "\n", newline="")
    path = folder / "frame.bdf"
    path.write_text(main, newline="")
    return path


def rib_deck(folder: Path, *, height: float = 0.1, wide: bool = False) -> Path:
    """A clamped channel of shells: web (property 1) in the x-y plane and two flanges (2, 3) up to `height`; the tips of
    the flanges carry a lid (property 4) of which the plane is at `height`."""
    nx, lines = 8, []
    y = (0.0, 0.075, 0.15)
    node: dict[tuple[int, str], int] = {}
    places = {"a": (y[0], 0.0), "b": (y[1], 0.0), "c": (y[2], 0.0), "d": (y[0], 0.5), "e": (y[2], 0.5)}
    places |= {"f": (y[0], 1.0), "g": (y[1], 1.0), "h": (y[2], 1.0)}
    for i in range(nx + 1):
        for key, (across, share) in places.items():
            node[i, key] = len(node) + 1
            z = share * height
            x = 0.9 * i / nx
            if wide:
                lines.append(f"GRID,{node[i, key]},,{x!r},{across!r},{z!r}")
            else:
                lines.append(f"GRID    {node[i, key]:<8d}        {x:<8.5f}{across:<8.5f}{z:<8.5f}")
    eid = 0
    strips = (("a", "b", 1), ("b", "c", 1), ("a", "d", 2), ("d", "f", 2), ("c", "e", 3), ("e", "h", 3))
    for a, b, pid in (*strips, ("f", "g", 4), ("g", "h", 4)):
        for i in range(nx):
            eid += 1
            lines.append(f"CQUAD4,{eid},{pid},{node[i, a]},{node[i + 1, a]},{node[i + 1, b]},{node[i, b]}")
    lines += [f"PSHELL,{p},1,{t},1,,1" for p, t in ((1, 0.003), (2, 0.002), (3, 0.002), (4, 0.0015))]
    lines.append("SPC1,1,123456," + ",".join(str(node[0, k]) for k in "abcde") + ",\n+," + ",".join(
        str(node[0, k]) for k in "fgh"))  # fmt: skip
    path = folder / "rib.bdf"
    folder.mkdir(parents=True, exist_ok=True)
    path.write_text("$ channel with a lid\n" + HEAD + STEEL + "\n".join(lines) + "\nENDDATA\n", newline="")
    return path


def mixed_deck(folder: Path) -> Path:
    """Elements of all kinds at nodes that move: rigid elements, offsets, orientation nodes, masses by place, curved
    displacement systems, springs, solids."""
    text = (
        HEAD
        + STEEL
        + """PBAR,1,1,1.2E-3,4.E-7,9.E-7,8.E-7
PSHELL,2,1,.004,1,,1
PSOLID,3,1
PBUSH,4,K,1.E6,2.E6,3.E6,1.E3,2.E3,3.E3
PBUSH,5,K,1.E6,,,1.E3
MAT1,2,7.E10,,.33,2700.,,,.01
PROD,6,2,1.E-4,1.E-8
CORD2C,7,,0.,0.,0.,0.,0.,1.
+,1.,0.,0.
GRID,1,,0.,0.,0.
GRID,2,,1.,0.,0.
GRID,3,,1.,1.,0.
GRID,4,,0.,1.,0.
GRID,5,7,1.,30.,.5,7
GRID,6,,.2,.9,.8
GRID,7,,1.5,.5,.3
GRID,8,,1.6,.7,.35
GRID,10,,0.,0.,-1.
GRID,11,,1.,0.,-1.
GRID,12,,1.,1.,-1.
GRID,13,,0.,1.,-1.
CORD2S,8,,0.,.1,0.,0.,.1,1.
+,1.,0.,.2
GRID,20,8,2.1,20.,-315.
CQUAD4,1,2,1,2,3,4
CTRIA3,2,2,2,3,5
CHEXA,3,3,10,11,12,13,1,2
+,3,4
CBAR,4,1,3,6,20
+,,,.01,0.,.02,.03,0.,.01
CBAR,5,1,5,6,0.,1.,.2
CROD,6,6,2,6
CBUSH,7,4,3,7,0.,1.,.1
CBUSH,8,5,7,8
CONM2,9,6,-1,3.,.3,1.,.9
CONM2,10,8,,2.,.01,.02,.03
RBE2,11,7,123456,8
RBE3,12,,9,123456,1.,123,1,2
+,4
GRID,9,,.4,.4,.2
CONM2,13,9,,4.,,,,
+,.02,,.03,,,.04
SPC1,1,123456,10,11,12,13
SPC1,1,456,20
SPC1,1,123,20
ENDDATA
"""
    )
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "mixed.bdf"
    path.write_text(text, newline="")
    return path
