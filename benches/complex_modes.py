"""20 complex modes of large models beside scipy: `python benches/complex_modes.py HARNESS_DATA [MODEL:K ...]`.

HARNESS_DATA holds MODEL_K.npz, MODEL_M.npz and MODEL_el.npz of the harness of rivals. To K and M come ten dashpots,
stiffness-proportional damping of half the elements (2 % at the first mode), and Coriolis and centrifugal terms at 0.3
of the first frequency. The rival is `scipy.sparse.linalg.eigs` on the state space, shift-invert about 0 by `splu`,
with its default ordering and with the symmetric one. One process a cell, one thread, CPU seconds; ours include
ordering, the count by inertia and left vectors to 1e-4, which the rival does not compute.
"""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as sla
from rivals_common import along, elements, own, stiffness, table
from rivals_modes import on_one_pattern

from femend import _core

CASES = ("shell30:20", "hex30:20")
OURS = ("femend", "femend-left")
RIVALS = ("eigs+splu", "eigs+splu-symmetric")


def problem(data: Path, model: str) -> tuple[list[sp.csr_matrix], float]:
    """K, M, C, G, S and the speed in rad/s."""
    K, M = (sp.load_npz(data / f"{model}_{x}.npz").tocsr() for x in "KM")
    n, z = K.shape[0], elements(data, model)
    nd = int(z["nd"])
    w1 = 2 * np.pi * _core.modes(*on_one_pattern(K, M), n_modes=1, check=False)[0][0]
    C = (0.04 / w1) * stiffness(z, (along(z) > len(z["conn"]) / 2).astype(float))
    c = np.zeros(n)
    c[np.random.default_rng(1).choice(n, 10, replace=False)] = 5e-3 * np.median(K.diagonal()) / w1
    turn = np.zeros((nd, nd))
    turn[0, 1], turn[1, 0] = -1.0, 1.0
    moving = sp.kron(sp.eye(n // nd), sp.diags([1.0] * 3 + [0.0] * (nd - 3)))
    across = sp.kron(sp.eye(n // nd), sp.diags([1.0, 1.0] + [0.0] * (nd - 2)))
    mass, spin = moving @ M @ moving, sp.kron(sp.eye(n // nd), sp.csr_matrix(turn))
    G, S = mass @ spin, across @ mass @ across
    matrices = [K, M, C + sp.diags(c), G - G.T, -0.5 * (S + S.T)]
    given = [sp.csr_matrix(a) for a in matrices]
    for a in given:
        a.sort_indices()
    return given, 0.3 * w1


def worker(contender: str, model: str, data: Path, k: int) -> dict[str, Any]:
    """Runs one and measures it, residuals beside the sum of the three terms."""
    (K, M, C, G, S), speed = problem(data, model)
    indptr, indices, kv, mv, cv, gv, sv = on_one_pattern(K, M, C, sp.csr_matrix(G.T), S)  # takes rows for columns
    B, K_turning = sp.csc_array(C + speed * G), sp.csc_array(K + speed**2 * S)
    wall, cpu = time.time(), time.process_time()
    if contender.startswith("femend"):
        left = 1e-4 if contender.endswith("left") else 1.0
        terms = [("C", 0, cv), ("C", 1, gv), ("K", 2, sv)]
        solver = _core.ComplexProblem(indptr, indices, kv, mv, terms, k, speed=speed, left_tolerance=left)
        found = solver.modes(speed)
        at = [i for i, kind in enumerate(found["kinds"]) if kind == "oscillatory"]
        poles, psi = found["poles"][at], found["right"][:, at]
    else:
        poles, psi = arnoldi(contender, sp.csc_array(M), B, K_turning, k)
    out: dict[str, Any] = {"wall": time.time() - wall, "cpu": time.process_time() - cpu}
    terms_of = [(M @ psi) * poles**2, (B @ psi) * poles, K_turning @ psi]
    size = sum(np.linalg.norm(t, axis=0) for t in terms_of)
    out["res_rel"] = float(np.max(np.linalg.norm(sum(terms_of), axis=0) / size))
    return {**out, "n_found": len(poles), "contender": contender, "model": model}


def arnoldi(contender: str, M: Any, B: Any, K: Any, k: int) -> tuple[np.ndarray, np.ndarray]:
    n = M.shape[0]
    options: dict[str, Any] = {}
    if contender.endswith("symmetric"):
        options = {"permc_spec": "MMD_AT_PLUS_A", "diag_pivot_thresh": 0.0, "options": {"SymmetricMode": True}}
    lu = sla.splu(K, **options)
    step = sla.LinearOperator(
        (2 * n, 2 * n), matvec=lambda x: np.r_[-lu.solve(B @ x[:n] + M @ x[n:]), x[:n]], dtype=float
    )
    # a few more, since conjugates count and the last may be cut
    values, vectors = sla.eigs(step, k=2 * k + 2, which="LM", tol=1e-10)
    poles = 1.0 / values
    order = np.argsort(np.abs(poles))
    keep = [i for i in order if poles[i].imag > 0][:k]
    return poles[keep], vectors[:n, keep]


def main(data: Path, cases: list[str], repeats: int) -> None:
    for case in cases:
        model, k = case.split(":")
        names = (*RIVALS, *OURS)
        rows: dict[str, list[dict[str, Any]]] = {name: [] for name in names}
        for _ in range(repeats):
            for name in names:
                rows[name].append(own(__file__, name, model, data, k))
        table(f"{k} complex modes of {model}", rows, RIVALS, "res_rel", {})


if __name__ == "__main__":
    if sys.argv[1] == "--worker":
        _, _, contender, model, data, k = sys.argv
        print("JSON " + json.dumps(worker(contender, model, Path(data), int(k))))
    else:
        main(Path(sys.argv[1]), sys.argv[2:] or list(CASES), 1)
