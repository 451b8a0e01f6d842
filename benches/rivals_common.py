"""Cells of a comparison with rivals: one process each, one thread, interleaved; medians of CPU seconds in a table."""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp

Cell = dict[str, Any]
"""kernel, model, contender, cpu, wall (seconds), peakMB, error; `note` where a cell failed."""


def rival(harness: Path, scratch: Path, worker: str, contender: str, model: str, extra: Sequence[object] = ()) -> Cell:
    """One contender of the harness, by its own runner."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "cell.jsonl"
        env = {**os.environ, "BENCH_SCRATCH": str(scratch), "BENCH_OUT": str(out)}
        tail = ["--", *map(str, extra)] if extra else []
        command = [
            str(scratch / "venv/bin/python"),
            str(harness / "run.py"),
            worker,
            contender,
            model,
            "-t",
            "1",
            *tail,
        ]
        subprocess.run(command, env=env, capture_output=True, check=False)
        lines = out.read_text().splitlines() if out.exists() else []
    return json.loads(lines[-1]) if lines else {"contender": contender, "model": model, "error": "did not run"}


def own(script: str, *arguments: object) -> Cell:
    """One of our cells: the script itself with --worker."""
    threads = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "RAYON_NUM_THREADS"), "1")
    command = [sys.executable, script, "--worker", *map(str, arguments)]
    done = subprocess.run(command, env={**os.environ, **threads}, capture_output=True, text=True, check=False)
    lines = [line for line in done.stdout.splitlines() if line.startswith("JSON ")]
    return json.loads(lines[-1][5:]) if lines else {"error": done.stderr[-300:]}


def median(cells: list[Cell], key: str) -> float | None:
    values = [c[key] for c in cells if isinstance(c.get(key), int | float)]
    return statistics.median(values) if values else None


def table(title: str, rows: dict[str, list[Cell]], rivals: Sequence[str], error: str, goals: dict[str, str]) -> None:
    """Prints one Markdown table; ratios are to the fastest of `rivals`."""
    best = min((t for name in rivals if (t := median(rows[name], "cpu")) is not None), default=None)
    print(f"\n### {title}\n\n| contender | CPU s | wall s | peak MB | residual or error | best rival / it | goal |")
    print("|---|---|---|---|---|---|---|")
    for name, cells in rows.items():
        cpu = median(cells, "cpu")
        if cpu is None:
            print(f"| {name} | did not run: {str(cells[-1].get('error'))[-120:]!r} | | | | | |")
            continue
        ratio = f"{best / cpu:.2f}" if best else "-"
        shown = [f"{v:.3g}" if (v := median(cells, key)) is not None else "-" for key in ("wall", "peakMB", error)]
        print(f"| {name} | {cpu:.4g} | {' | '.join(shown)} | {ratio} | {goals.get(name, '')} |", flush=True)


def elements(data: Path, model: str) -> dict[str, np.ndarray]:
    """A model of the harness: nodes X, connectivity conn, element matrices Ke, DOFs a node nd, fixed nodes."""
    return dict(np.load(data / f"{model}_el.npz"))


def along(z: dict[str, np.ndarray]) -> np.ndarray:
    """Place (n_elements,) of every element in their order along X."""
    return np.argsort(np.argsort(z["X"][z["conn"]].mean(1)[:, 0]))


def stiffness(z: dict[str, np.ndarray], factor: np.ndarray) -> sp.csr_matrix:
    """K of the elements times their `factor` (n_elements,), those at 0 left out, without the clamped DOFs."""
    used, nd = np.flatnonzero(factor), int(z["nd"])
    dofs = (z["conn"][used][:, :, None] * nd + np.arange(nd)).reshape(len(used), -1)
    i, j = np.repeat(dofs, dofs.shape[1], axis=1).ravel(), np.tile(dofs, (1, dofs.shape[1])).ravel()
    n = len(z["X"]) * nd
    K = sp.coo_matrix(((z["Ke"][used] * factor[used][:, None, None]).ravel(), (i, j)), shape=(n, n)).tocsr()
    free = np.flatnonzero(~np.repeat(z["fixed"], nd))
    K = K[free][:, free]
    return ((K + K.T) * 0.5).tocsr()
