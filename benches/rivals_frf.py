"""FRFs and their derivatives beside rivals: `python benches/rivals_frf.py HARNESS SCRATCH [modal] [sens] [direct]`.

`modal`: synthesis, cases outputs x inputs x modes x lines; `sens`: derivatives by 20 groups, 100 x 3 x 1000 lines, 50
modes; `direct`: 400 lines of tet30 with a lossy zone, against PARDISO on every line (12 lines measured and scaled).
"""

from __future__ import annotations

import json
import resource
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp
from rivals_common import along, elements, own, rival, stiffness, table

from femend import _core

CASES = ("30x3x40x800", "100x5x60x4000", "300x20x100x4000")
GEMM = ("numpy-onegemm-real-avx512-reuse", "numpy-onegemm-real-avx512", "numpy-onegemm-real")


def timed(f: Callable[[], Any], n: int = 5) -> tuple[dict[str, float], Any]:
    """Median CPU and wall seconds of n calls."""
    cpu, wall, value = [], [], None
    for _ in range(n):
        w, p = time.time(), time.process_time()
        value = f()
        cpu.append(time.process_time() - p)
        wall.append(time.time() - w)
    return {"cpu": float(np.median(cpu)), "wall": float(np.median(wall))}, value


def modal(contender: str, case: str) -> dict[str, Any]:
    """The harness's data; our axes are (line, output, input)."""
    n_out, n_in, r, lines = map(int, case.split("x"))
    g = np.random.default_rng(0)
    phi_out, phi_in = g.standard_normal((n_out, r)), g.standard_normal((n_in, r))
    omega, zeta = np.sort(g.uniform(1, 100, r)), np.full(r, 0.01)
    w = np.linspace(0.5, 120, lines)
    if contender == "femend-scores":
        measured = _core.frf_modal(omega * 1.01, zeta, phi_out, phi_in, 1j * w)
        out, _ = timed(lambda: _core.frf_modal_scores(omega, zeta, phi_out, phi_in, 1j * w, measured))
        return {**out, "err": 0.0}
    store = np.empty((lines, n_out, n_in), complex) if contender == "femend-reuse" else None
    out, H = timed(lambda: _core.frf_modal(omega, zeta, phi_out, phi_in, 1j * w, out=store))
    f = 7
    exact = (phi_out / (omega**2 - w[f] ** 2 + 2j * zeta * omega * w[f])) @ phi_in.T
    return {**out, "err": float(abs(H[f] - exact).max() / abs(exact).max())}


def sens() -> dict[str, Any]:
    """dH of 20 groups; ours also move the damping, which the rival keeps."""
    g = np.random.default_rng(1)
    r, n_out, n_in, lines, groups = 50, 100, 3, 1000, 20
    phi_out, phi_in = g.standard_normal((n_out, r)), g.standard_normal((n_in, r))
    A = g.standard_normal((groups, r, r))
    A += A.transpose(0, 2, 1)
    omega, w = np.linspace(1, 100, r) * 1e2, np.linspace(1, 120, lines) * 100
    zeta = np.full(r, 0.01)
    B = 0.1 * A
    out, D = timed(lambda: _core.frf_modal_sensitivities(omega, zeta, phi_out, phi_in, A, B, 1j * w))
    d = 1 / (omega**2 - w[5] ** 2 + 2j * zeta * omega * w[5])
    # the rival's formula holds where damping stays: slopes of 2 zeta omega by the same perturbation
    lam, u = omega**2, zeta * omega
    gap = lam[:, None] - lam + np.eye(r)
    off = 1 - np.eye(r)
    kappa = off * (u[:, None] - u) / gap + np.diag(zeta / (2 * omega))
    eta = off * (u * lam[:, None] - u[:, None] * lam) / gap + np.diag(zeta * omega / 2)
    C = 2 * kappa * A[3] + 2 * eta * B[3]
    exact = -(phi_out * d) @ ((A[3] + 1j * w[5] * C - w[5] ** 2 * B[3]) @ (d[:, None] * phi_in.T))
    return {**out, "err": float(abs(D[3, 5] - exact).max() / abs(exact).max())}


def direct(model: str, data: Path) -> dict[str, Any]:
    """The harness's lossy zone and lines, by reduced direct solution."""
    z = elements(data, model)
    K, M = (sp.load_npz(data / f"{model}_{x}.npz").tocsc() for x in "KM")
    Z = stiffness(z, (along(z) < len(z["conn"]) // 10).astype(float)).tocsc()
    union = sp.csc_matrix(abs(K) + abs(M) + abs(Z))
    union.sort_indices()
    place = sp.csc_matrix((np.arange(1.0, union.nnz + 1), union.indices, union.indptr), shape=union.shape)
    on = np.zeros((3, union.nnz))
    for row, a in zip(on, (K, M, Z), strict=True):
        a.eliminate_zeros()
        a.sort_indices()
        at = sp.csc_matrix((np.ones(a.nnz), a.indices, a.indptr), shape=a.shape).multiply(place).tocsc()
        at.sort_indices()
        row[at.data.astype(np.int64) - 1] = a.data
    g = np.random.default_rng(5)
    io = g.choice(K.shape[0], 20, replace=False)
    b_out = np.zeros((K.shape[0], 20))
    b_out[io, range(20)] = 1
    w30 = np.load(data / f"{model}_modes60.npz")["w"][29]
    ws = np.linspace(0.05, 1.0, 400) * np.sqrt(w30)
    coefficients = np.array([np.full(400, 1 + 0.01j), -(ws**2) + 0j, np.full(400, 0.4j)])
    arguments = (union.indptr, union.indices, on, coefficients, b_out, np.ascontiguousarray(b_out[:, :3]), 1j * ws)
    wall, cpu = time.time(), time.process_time()
    H, info = _core.frf_reduced(*arguments)
    out: dict[str, Any] = {"wall": time.time() - wall, "cpu": time.process_time() - cpu}
    exact = np.load(data / f"{model}_dfrf.npy")
    sub = np.arange(15, 400, 33)[: len(exact)]
    size = abs(exact).max(axis=(1, 2), keepdims=True)
    return {**out, "max_err": float((abs(H[sub] - exact) / size).max()), "solved": len(info["solved"]), **info}


def main(harness: Path, scratch: Path, what: list[str]) -> None:
    if not what or "modal" in what:
        for case in CASES:
            ours = ("femend-reuse", "femend", "femend-scores")
            rows: dict[str, list[dict[str, Any]]] = {name: [] for name in (*GEMM, *ours)}
            for _ in range(3):
                for name in GEMM:
                    rows[name].append(rival(harness, scratch, "w_frf", name, case))
                for name in ours:
                    rows[name].append(own(__file__, "modal", name, case))
            table(f"modal FRF {case}", rows, GEMM, "err", {"femend-reuse": ">= 1.0 (300x20x100x4000)"})
    if not what or "sens" in what:
        rows = {name: [] for name in ("frf-sens-onegemm", "femend")}
        for _ in range(3):
            rows["frf-sens-onegemm"].append(rival(harness, scratch, "w_sens", "frf-sens-onegemm", "hex10"))
            rows["femend"].append(own(__file__, "sens"))
        table("FRF sensitivities, 20 groups", rows, ("frf-sens-onegemm",), "err", {"femend": ">= 2"})
    if not what or "direct" in what:
        line = rival(harness, scratch, "w_dfrf", "direct-pardiso", "tet30")
        line["cpu"] = line.get("total400_cpu")
        rows = {"direct-pardiso, 400 lines": [line]}
        rows["femend"] = [own(__file__, "direct", "tet30", scratch / "data")]
        table("direct FRF, tet30, lossy zone, 400 lines", rows, tuple(rows)[:1], "max_err", {"femend": ">= 25 at 1e-6"})


if __name__ == "__main__":
    if sys.argv[1] == "--worker":
        kernel, *rest = sys.argv[2:]
        run: dict[str, Callable[..., dict[str, Any]]] = {"modal": modal, "sens": sens}
        cell = direct(rest[0], Path(rest[1])) if kernel == "direct" else run[kernel](*rest)
        cell["peakMB"] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        print("JSON " + json.dumps(cell))
    else:
        main(Path(sys.argv[1]), Path(sys.argv[2]), sys.argv[3:])
