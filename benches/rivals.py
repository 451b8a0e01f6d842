"""Sparse factorisations of femend beside those of the rivals, on the same models, in one run.

    python benches/rivals.py HARNESS SCRATCH [--models hex100,tet100] [--kinds real,complex] [--repeats 3] [--threads 1]

HARNESS is the folder with the rivals' `run.py`, SCRATCH its working folder (environment, shims, the models in `data/`).
Needs numpy and scipy, and before it `cargo build --release -p femend-linalg --example rival`. Every contender runs in a
process of its own, one after the other, model by model, so that the load of a shared machine falls on all alike; with
one thread the CPU seconds are compared, with several those of the clock, which say something on a quiet machine alone.
Prints a table in Markdown; `ratio` is a rival's seconds over ours.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp

ROOT = Path(__file__).resolve().parent.parent
RIVALS = {
    "real": ["cholmod-metis", "cholmod-metis-stockblas", "mumps-pord", "mkl-pardiso"],
    "indefinite": ["mumps-pord-ldlt", "mkl-pardiso-ldlt"],
    "complex": ["mumps-pord-csym", "mkl-pardiso-csym"],
}
OURS = {"real": "cholesky", "indefinite": "indefinite", "complex": "complex"}
Record = dict[str, Any]


def export(scratch: Path, model: str, kind: str) -> Path:
    """The harness's matrix of this kind as the raw file that the example `rival` reads."""
    path = scratch / "bin" / f"{model}_{'c' if kind == 'complex' else 'r'}.bin"
    if path.exists():
        return path
    K = sp.load_npz(scratch / "data" / f"{model}_K.npz").tocsr()
    M = sp.load_npz(scratch / "data" / f"{model}_M.npz").tocsr()
    scale = K.diagonal().mean() / M.diagonal().mean()
    A = (K * (1 + 0.02j) - 2e-6 * scale * M) if kind == "complex" else K + 1e-9 * scale * M
    A = A.tocsr()
    A.sort_indices()
    path.parent.mkdir(exist_ok=True)
    with path.open("wb") as file:
        file.write(np.array([A.shape[0], A.nnz], dtype="<u8").tobytes())
        for array, form in ((A.indptr, "<u4"), (A.indices, "<u4")):
            file.write(array.astype(form).tobytes())
        file.write(A.data.tobytes())
    return path


def ours(binary: Path, scratch: Path, model: str, kind: str, threads: int, repeats: int) -> Record:
    """One process of femend's factorisation."""
    env = dict(os.environ, RAYON_NUM_THREADS=str(threads))
    command = [str(binary), str(export(scratch, model, kind)), OURS[kind], str(repeats)]
    done = subprocess.run(command, env=env, capture_output=True, text=True)
    return read(done.stdout, "femend", done.stderr)


def rival(harness: Path, scratch: Path, name: str, model: str, threads: int, repeats: int) -> Record:
    """One process of a rival through the harness."""
    with tempfile.NamedTemporaryFile(suffix=".jsonl") as out:
        env = dict(os.environ, BENCH_SCRATCH=str(scratch), BENCH_OUT=out.name)
        command = [sys.executable, "run.py", "w_factor", name, model, "-t", str(threads), "--timeout", "1800"]
        subprocess.run([*command, "--", "--reps", str(repeats)], cwd=harness, env=env, capture_output=True)
        lines = Path(out.name).read_text().splitlines()
    record: Record = json.loads(lines[-1]) if lines else {"error": "no record"}
    return {**record, "contender": name}


def read(text: str, name: str, error: str) -> Record:
    """The record on the line that begins with JSON."""
    found = [line for line in text.splitlines() if line.startswith("JSON ")]
    record: Record = json.loads(found[-1][5:]) if found else {"error": error[-200:]}
    return {**record, "contender": name}


def table(rows: list[Record], seconds: str) -> str:
    """Markdown; ratios are of the `seconds` ("factor_cpu" or "factor"), operations as each contender reports them."""
    head = ["model", "contender", "analyse s", "factor CPU s", "factor s", "solve 1 ms", "per rhs of 64 ms"]
    head += ["nnz(L) M", "GF", "residual", "peak MB", "ratio"]
    lines = [" | ".join(["", *head, ""]).strip(), "|" + "---|" * len(head)]
    for model, kind in dict.fromkeys((r["model"], r["kind"]) for r in rows):
        cells = [r for r in rows if (r["model"], r["kind"]) == (model, kind)]
        own = next((r[seconds] for r in cells if r["contender"] == "femend" and "error" not in r), None)
        for r in cells:
            if "error" in r:
                lines.append(f"| {model} {kind} | {r['contender']} | {r['error'].strip().splitlines()[-1]} |")
                continue
            ratio = "" if own is None or r["contender"] == "femend" else f"{r[seconds] / own:.2f}"
            values = [r["analyze_cpu"], r["factor_cpu"], r["factor"], 1e3 * r["solve1_cpu"]]
            values += [1e3 * r["solve64_cpu"] / 64, 1e-6 * r["lnz"], 1e-9 * r["flops"]]
            text = [f"{v:.3g}" for v in values] + [f"{r['residual']:.1e}", f"{r['peakMB']:.0f}", ratio]
            lines.append(f"| {model} {kind} | {r['contender']} | " + " | ".join(text) + " |")
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("harness", type=Path)
    parser.add_argument("scratch", type=Path)
    parser.add_argument("--models", default="hex100,tet100,shell100,frame100")
    parser.add_argument("--kinds", default="real,complex")
    parser.add_argument("--rivals", help="names instead of the usual ones, separated by commas")
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--rounds", type=int, default=1, help="interleaved runs; the one of least CPU time is kept")
    parser.add_argument("--threads", type=int, default=1)
    target = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
    parser.add_argument("--binary", type=Path, default=target / "release" / "examples" / "rival")
    a = parser.parse_args()
    seconds = "factor_cpu" if a.threads == 1 else "factor"
    best: dict[tuple[str, str, str], Record] = {}
    for model in a.models.split(","):
        for _ in range(a.rounds):
            for kind in a.kinds.split(","):
                cells = [ours(a.binary, a.scratch, model, kind, a.threads, a.repeats)]
                names = a.rivals.split(",") if a.rivals else RIVALS[kind]
                cells += [rival(a.harness, a.scratch, name, model, a.threads, a.repeats) for name in names]
                for cell in cells:
                    key = (model, kind, cell["contender"])
                    cell.update(model=model, kind=kind)
                    if key not in best or cell.get(seconds, 1e99) < best[key].get(seconds, 1e99):
                        best[key] = cell
    print(table(list(best.values()), seconds))


if __name__ == "__main__":
    main()
