"""K for a new parameter set beside re-assembly: `python benches/rivals_refill.py HARNESS SCRATCH [MODEL]`.

The harness's tetrahedra become a deck of CTETRA with 20 materials whose moduli are the parameters. `femend` writes K in
memory at hand, `femend-new` returns new K, M, C and H with their pattern.
"""

from __future__ import annotations

import json
import resource
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
from rivals_common import own, rival, table

from femend import _core

GROUPS = 20


def deck(z: Any) -> str:
    """CTETRA of ten nodes, corner and mid-side nodes in the order of the cards."""
    X, conn = z["X"], z["conn"].copy()
    a, b, c = (X[conn[:, i]] - X[conn[:, 0]] for i in (1, 2, 3))
    left = np.einsum("ij,ij->i", np.cross(a, b), c) < 0
    conn[left] = conn[left][:, [1, 0, 2, 3, 4, 6, 5, 8, 7, 9]]
    conn += 1
    lines = ["CEND", "SPC = 1", "BEGIN BULK"]
    lines += [f"GRID*,{i},,{x!r},{y!r}\n*,{w!r}" for i, (x, y, w) in enumerate(X.tolist(), 1)]
    group = np.arange(len(conn)) * GROUPS // len(conn) + 1
    # harness: edges 01 12 02 03 13 23, as the card has them
    for e, (g, c) in enumerate(zip(group.tolist(), conn.tolist(), strict=True), 1):
        lines.append(f"CTETRA,{e},{g},{','.join(map(str, c[:6]))}\n,{','.join(map(str, c[6:]))}")
    lines += [f"PSOLID,{g},{g}\nMAT1,{g},2.1+11,,0.3,7850." for g in range(1, GROUPS + 1)]
    lines += [f"SPC1,1,123,{i}" for i in (np.flatnonzero(z["fixed"]) + 1).tolist()]
    return "\n".join([*lines, "ENDDATA", ""])


def worker(contender: str, model: str, data: Path) -> dict[str, Any]:
    """Median of nine refills at changing factors; error against the sum of a fresh assembly."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "model.bdf"
        path.write_text(deck(np.load(data / f"{model}_el.npz")))
        start = time.process_time()
        parameters = [(f"E{g}", "E", "material", [g]) for g in range(1, GROUPS + 1)]
        fe = _core.FeModel(_core.Deck.read(str(path)), parameters=parameters)
        setup = time.process_time() - start
    assert fe.affine
    out = fe.assemble()[2].copy()
    g = np.random.default_rng(0)
    cpu, wall = [], []
    for _ in range(9):
        factors = g.uniform(0.9, 1.1, GROUPS)
        w, p = time.time(), time.process_time()
        if contender == "femend":
            fe.refill("K", factors, out)
        else:
            out = fe.assemble(factors)[2]
        cpu.append(time.process_time() - p)
        wall.append(time.time() - w)
    # every factor equal: K itself, scaled
    nominal = fe.assemble()[2]
    fe.refill("K", np.full(GROUPS, 1.25), out)
    error = float(abs(out - 1.25 * nominal).max() / abs(nominal).max())
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    return {"cpu": float(np.median(cpu)), "wall": float(np.median(wall)), "err": error, "peakMB": peak, "setup": setup}


def main(harness: Path, scratch: Path, model: str) -> None:
    rows: dict[str, list[dict[str, Any]]] = {
        "dolfinx re-assembly": [],
        "scipy, sparse product": [],
        "femend": [],
        "femend-new": [],
    }
    for _ in range(3):
        cell = rival(harness, scratch, "w_assembly", "dolfinx", model)
        rows["dolfinx re-assembly"].append({**cell, "cpu": cell.get("reassemble_K_cpu")})
        rows["scipy, sparse product"].append(rival(harness, scratch, "w_assembly", "scatter-fixed-pattern", model))
        for name in ("femend", "femend-new"):
            rows[name].append(own(__file__, name, model, scratch / "data"))
    table(f"K at new factors, {model}, 20 groups", rows, ("dolfinx re-assembly",), "err", {"femend": ">= 15"})


if __name__ == "__main__":
    if sys.argv[1] == "--worker":
        print("JSON " + json.dumps(worker(sys.argv[2], sys.argv[3], Path(sys.argv[4]))))
    else:
        main(Path(sys.argv[1]), Path(sys.argv[2]), sys.argv[3] if len(sys.argv) > 3 else "tet100")
