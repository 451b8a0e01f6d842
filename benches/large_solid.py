"""`femend modes` on a clamped block of bricks as a process of its own: what it says, CPU seconds and peak memory.

    python benches/large_solid.py --cells 67 67 69      # 957 168 DOFs, which need more memory than most machines have
    python benches/large_solid.py --cells 30 30 30      # 86 490 DOFs

A model whose modes do not fit is refused before anything is factorised; how long it takes to say so is measured.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path


def cards(cells: tuple[int, int, int]) -> Iterator[str]:
    """A deck of cubes of 0.1 m of steel, its lowest face held."""
    nx, ny, nz = (n + 1 for n in cells)

    def node(x: int, y: int, z: int) -> int:
        return 1 + x + nx * (y + ny * z)

    yield from ("SOL 103", "CEND", "SPC = 1", "BEGIN BULK", "MAT1,1,2.1+11,,0.3,7850.", "PSOLID,1,1")
    for z in range(nz):
        for y in range(ny):
            yield from (f"GRID,{node(x, y, z)},,{0.1 * x:.1f},{0.1 * y:.1f},{0.1 * z:.1f}" for x in range(nx))
    eid = 0
    for z in range(nz - 1):
        for y in range(ny - 1):
            for x in range(nx - 1):
                eid += 1
                low, high = (
                    [node(x, y, at), node(x + 1, y, at), node(x + 1, y + 1, at), node(x, y + 1, at)]
                    for at in (z, z + 1)
                )
                yield f"CHEXA,{eid},1," + ",".join(map(str, low + high[:2])) + ",+"
                yield f"+,{high[2]},{high[3]}"
    yield f"SPC1,1,123,1,THRU,{nx * ny}"
    yield "ENDDATA"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cells", type=int, nargs=3, default=(67, 67, 69))
    parser.add_argument("--modes", type=int, default=20)
    chosen = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="femend-bench-") as folder:
        deck = Path(folder) / "block.bdf"
        deck.write_text("\n".join([*cards(tuple(chosen.cells)), ""]))
        start = time.perf_counter()
        process = subprocess.Popen([sys.executable, "-m", "femend", "modes", str(deck), "--n", str(chosen.modes)])
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        wall = time.perf_counter() - start
    cpu = usage.ru_utime + usage.ru_stime
    print(f"exit code {process.returncode}, {wall:.0f} s, {cpu:.0f} CPU s, peak {usage.ru_maxrss / 2**20:.2f} GiB")


if __name__ == "__main__":
    main()
