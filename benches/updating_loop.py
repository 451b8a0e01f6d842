"""Cost of a step of updating a large model, in modal solutions: `python benches/updating_loop.py SCRATCH [MODEL]`.

SCRATCH/data holds MODEL_M.npz (scipy) and MODEL_el.npz of a harness: nodes, connectivity, element matrices. Twenty
groups of elements have a stiffness factor each; frequencies of a model whose factors differ by up to 10 % are met.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp
from rivals_common import along, elements, stiffness

from femend import _core
from femend.estimate.updating import (
    Configuration,
    Frequencies,
    ModeTest,
    Problem,
    Unknowns,
    affine_matrices,
    factor,
    modal_system,
    update,
)

GROUPS, MODES, SENSORS, REPEATS = 20, 20, 40, 3


def group_matrices(data: Path, model: str) -> tuple[dict[str, sp.csr_matrix], sp.csr_matrix]:
    """Stiffness of every group of elements and the mass matrix, without the clamped DOFs."""
    z = elements(data, model)
    group = along(z) * GROUPS // len(z["conn"])
    parts = {f"k{g + 1}": stiffness(z, (group == g).astype(float)) for g in range(GROUPS)}
    return parts, sp.load_npz(data / f"{model}_M.npz").tocsr()


def seconds(run: Any) -> tuple[float, Any]:
    """CPU seconds of a call and what it gives."""
    start = time.process_time()
    out = run()
    return time.process_time() - start, out


def main(scratch: Path, model: str) -> None:
    parts, M = group_matrices(scratch / "data", model)
    matrices = affine_matrices(parts, M)
    n = len(matrices.indptr) - 1
    rng = np.random.default_rng(3)
    sensors = np.sort(rng.choice(n, SENSORS, replace=False))
    truth = 1 + rng.uniform(-0.1, 0.1, GROUPS)
    at_truth = modal_system(matrices, sensors, MODES, shapes=False).solve(truth)
    freq, phi = at_truth.value("freq"), at_truth.value("phi")

    def cold(symbolic: Any) -> list[float]:
        K, own = matrices.at(np.ones(GROUPS))
        pattern = (matrices.indptr, matrices.indices)
        return [
            seconds(lambda: _core.modes(*pattern, K, own, n_modes=MODES, symbolic=symbolic))[0] for _ in range(REPEATS)
        ]

    with_ordering = np.median(cold(None))
    at_hand = np.median(cold(_core.Symbolic(matrices.indptr, matrices.indices)))
    system: Any = modal_system(matrices, sensors, MODES, shapes=False)
    solved: list[float] = []
    solve = system.solve
    _ = system._symbolic  # the ordering is made once for all steps

    def timed(factors: np.ndarray) -> Any:
        spent, state = seconds(lambda: solve(factors))
        solved.append(spent)
        return state

    system.solve = timed
    responses = (Frequencies(freq, 0.001 * freq),)
    unknowns = Unknowns.of([factor(name, 0.1, (0.5, 2.0)) for name in matrices.names])
    problem = Problem(unknowns, (Configuration("solid", system, responses, ModeTest(freq, phi)),))
    spent, found = seconds(lambda: update(problem, iterations=12))
    steps = len(found.history) - 1
    error = max(abs(row.freq_after / row.freq - 1) for row in found.modes())
    print(f"{model}: {n} DOFs, {GROUPS} factors, {MODES} modes, {found.status} after {steps} steps")
    print(f"one modal solution: {with_ordering:.2f} CPU s, {at_hand:.2f} with the ordering at hand")
    print(f"solutions of the loop: first {solved[0]:.2f}, then median {np.median(solved[1:]):.2f} ({len(solved) - 1})")
    a_step = (spent - solved[0]) / steps
    print(f"a step: {a_step:.2f} CPU s, {a_step / with_ordering:.2f} or {a_step / at_hand:.2f} modal solutions")
    print(f"frequencies met to {100 * error:.2g} %")


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2] if len(sys.argv) > 2 else "tet100")
