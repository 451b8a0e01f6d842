"""Lowest modes beside rivals: `python benches/rivals_modes.py HARNESS SCRATCH [--installed] [MODEL:K ...]`.

The models of a harness: SCRATCH/data holds MODEL_K.npz, MODEL_M.npz (scipy) and MODEL_el.npz. Ours start from K and M
on one pattern and include the ordering; `femend-again` are the modes after every one of 20 element groups has changed
by up to 5 %, from those before, on the ordering at hand. With `--installed` scipy's `eigsh` with its own SuperLU runs
too, which takes minutes and gigabytes.
"""

from __future__ import annotations

import json
import resource
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp
from rivals_common import along, elements, median, own, rival, stiffness, table

from femend import _core

CASES = ("shell100:20", "hex100:20", "tet100:100")
RIVALS = ("eigsh+cholmod-metis", "eigsh+mkl-pardiso")
INSTALLED = "eigsh-default(superlu-colamd)"
OURS = ("femend", "femend-unchecked", "femend-cold-again", "femend-again", "femend-again-unchecked")
GOALS = {"femend": ">= 1.5 (20 modes), 3.5 (100)", "femend-again": ">= 3 x femend-cold-again"}


def on_one_pattern(*matrices: sp.csr_matrix) -> tuple[np.ndarray, ...]:
    """indptr, indices and the values of each symmetric matrix on the union of their patterns."""
    patterns = [sp.csc_matrix((np.ones(a.nnz), a.indices, a.indptr), shape=a.shape) for a in matrices]
    union = sum(patterns[1:], patterns[0]).tocsc()
    union.sort_indices()
    place = sp.csc_matrix((np.arange(1.0, union.nnz + 1), union.indices, union.indptr), shape=union.shape)

    def values(a: sp.csr_matrix, ones: sp.csc_matrix) -> np.ndarray:
        at = ones.multiply(place).tocsc()
        at.sort_indices()
        out = np.zeros(union.nnz)
        b = sp.csc_matrix((a.data, a.indices, a.indptr), shape=a.shape)
        b.sort_indices()
        out[at.data.astype(np.int64) - 1] = b.data
        return out

    own = [values(a, ones) for a, ones in zip(matrices, patterns, strict=True)]
    return union.indptr.astype(np.int32), union.indices.astype(np.int32), *own


def changed(data: Path, model: str) -> sp.csr_matrix:
    """K with the stiffness of 20 element groups changed by up to 5 %."""
    z = elements(data, model)
    factor = 1 + np.random.default_rng(3).uniform(-0.05, 0.05, 20)
    return stiffness(z, factor[along(z) * 20 // len(z["conn"])])


def worker(contender: str, model: str, data: Path, k: int) -> dict[str, Any]:
    """Runs one of ours and measures it with the harness's own residual."""
    K, M = (sp.load_npz(data / f"{model}_{x}.npz").tocsr() for x in "KM")
    # the pattern of the model: values that come to nothing in one K and not in the other are part of it
    given = (K, M, changed(data, model)) if "again" in contender else (K, M)
    for a in given:
        a.sort_indices()
    indptr, indices, kv, mv, *again = on_one_pattern(*given)
    check = not contender.endswith("unchecked")
    options: dict[str, Any] = {"n_modes": k, "check": check}
    if "again" in contender:
        if "cold" not in contender:
            symbolic = _core.Symbolic(indptr, indices)
            # the guard modes that an updating loop keeps
            start = _core.modes(indptr, indices, kv, mv, n_modes=k + max(4, k // 10), check=False, symbolic=symbolic)[1]
            options |= {"symbolic": symbolic, "start": start}
        K, (kv,) = given[2], again
    base = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    wall, cpu = time.time(), time.process_time()
    freq, phi, _, info = _core.modes(indptr, indices, kv, mv, **options)
    out = {"wall": time.time() - wall, "cpu": time.process_time() - cpu, "baseMB": base}
    lam = (2 * np.pi * freq) ** 2
    R = K @ phi
    size = np.linalg.norm(R, axis=0)
    R -= (M @ phi) * lam
    out["res_rel"] = float((np.linalg.norm(R, axis=0) / size).max())
    out["peakMB"] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    keep = {key: info[key] for key in ("vectors", "solves", "factorisations", "counted")}
    return {**out, **keep, "contender": contender, "model": model}


def main(harness: Path, scratch: Path, cases: list[str], repeats: int, installed: bool) -> None:
    rivals = (*RIVALS, *([INSTALLED] if installed else []))
    for case in cases:
        model, k = case.split(":")
        rows: dict[str, list[dict[str, Any]]] = {name: [] for name in (*rivals, *OURS)}
        for _ in range(repeats):
            for name in rivals:
                rows[name].append(rival(harness, scratch, "w_eig", name, model, (k, 1e-9)))
            for name in OURS:
                rows[name].append(own(__file__, name, model, scratch / "data", k))
        table(f"{k} modes of {model}", rows, RIVALS, "res_rel", GOALS)
        for name in OURS[:2] if installed else ():
            slow, ours = median(rows[INSTALLED], "cpu"), median(rows[name], "cpu")
            if slow and ours:
                print(f"\neigsh as installed / {name}: {slow / ours:.1f} (goal >= 10)", flush=True)


if __name__ == "__main__":
    if sys.argv[1] == "--worker":
        _, _, contender, model, data, k = sys.argv
        print("JSON " + json.dumps(worker(contender, model, Path(data), int(k))))
    else:
        chosen = [argument for argument in sys.argv[3:] if argument != "--installed"]
        main(Path(sys.argv[1]), Path(sys.argv[2]), chosen or list(CASES), 1, "--installed" in sys.argv)
