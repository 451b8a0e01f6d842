"""A steel footbridge updated on its measured modes: 17 stiffness factors from 5 modes, two of which change places.

The data (Georgia Tech campus bridge, Dong and Wang's structural-model-updating toolbox, GPL-3.0) are not part of this
project. The script looks for `data/pedestrian_bridge` in the folder FEMEND_SHARED, else in `../shared` beside the
project:

python python/examples/footbridge.py

Priors are the ranges its authors state: steel within 10 %, concrete -20 to +40 %, support springs 0 to 11 times. Two
runs: the authors' objective (eigenvalues and shapes by their standard deviations, shapes divided by the number of
sensors), from many starts in a reduced model; and the same shapes with frequencies to be met to 0.1 %. Both are scored
by the former.
"""

from __future__ import annotations

import os
import time
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import scipy.io

from femend.estimate.updating import (
    Configuration,
    Frequencies,
    ModeTest,
    Problem,
    Reduction,
    ShapeDifferences,
    Unknowns,
    UpdateResult,
    affine_matrices,
    factor,
    modal_system,
    multi_start,
    reduced_problem,
    sensitivities,
    update,
)

NAMES = ("Frame", "Truss", *(f"Conc{i}" for i in range(1, 12)), "y1", "z1", "y2", "z2")
RANGES = ((0.9, 1.1),) * 2 + ((0.8, 1.4),) * 11 + ((0.0, 11.0),) * 4
# Hz, of the authors' optimum
PUBLISHED = (4.063, 4.557, 6.819, 8.652, 11.43)
N_MODES = 7


def data_folder() -> Path:
    """The folder of the data; raises FileNotFoundError where they are not on this machine."""
    root = Path(os.environ.get("FEMEND_SHARED") or Path(__file__).resolve().parents[3] / "shared")
    folder = root / "data" / "pedestrian_bridge"
    if not folder.is_dir():
        raise FileNotFoundError(f"{folder} is not there; FEMEND_SHARED names the folder above data/pedestrian_bridge")
    return folder


def authors_problem(folder: Path) -> Problem:
    """The authors' objective: both shapes 1 at the sensor to which the test shape was scaled."""
    model = scipy.io.loadmat(folder / "SteelPedestrianBridgeExp.mat")
    test = scipy.io.loadmat(folder / "ExpModeInfo_FEM.mat")
    parts = {n: model[f"K_{n}"].astype(np.float64) for n in NAMES}
    system = modal_system(
        affine_matrices(parts, model["M0"].astype(np.float64)), model["measDOFs"].ravel().astype(int) - 1, N_MODES
    )
    omega = np.sqrt(test["lambdaExp"].ravel())
    freq, sd = omega / (2 * np.pi), test["std_lambdaExp"].ravel() / (2 * omega) / (2 * np.pi)
    phi, scatter = test["psiExp_m"], test["std_psiExp"]
    # a sensor to which every test was scaled has no scatter but rounding
    reference = tuple(int(i) for i in scatter.argmin(axis=0))
    responses = (
        Frequencies(freq, sd, "eigenvalue"),
        ShapeDifferences(phi, len(phi) * scatter, reference),
    )
    unknowns = Unknowns.of([factor(n, np.inf, r) for n, r in zip(NAMES, RANGES, strict=True)])
    return Problem(unknowns, (Configuration("bridge", system, responses, ModeTest(freq, phi)),))


def tight_problem(problem: Problem, share: float = 0.001) -> Problem:
    """The same with frequencies to be met to `share`, and priors: the ranges are two deviations to either side, for the
    springs of the logarithm (1/11 to 11)."""
    (c,) = problem.configurations
    f = c.responses[0]
    assert isinstance(f, Frequencies)
    unknowns = Unknowns.of(
        [
            factor(n, np.log(b) / 2, (1 / b, b), logarithmic=True) if a == 0.0 else factor(n, (b - a) / 4, (a, b))
            for n, (a, b) in zip(NAMES, RANGES, strict=True)
        ]
    )
    return replace(
        problem,
        unknowns=unknowns,
        configurations=(replace(c, responses=(Frequencies(f.freq, share * f.freq), *c.responses[1:])),),
    )


@dataclass(frozen=True)
class Runs:
    """The two runs, the authors' problem by which both are scored, and the seconds each took."""

    problem: Problem
    authors: UpdateResult
    tight: UpdateResult
    seconds: tuple[float, float]

    def score(self, result: UpdateResult) -> float:
        """The authors' objective at the factors of a `result`."""
        return self.problem.evaluate(list(result.values.values())).squares


def run(folder: Path, n_starts: int = 20) -> Runs:
    """Both runs."""
    problem = authors_problem(folder)
    begin = time.perf_counter()
    small: Reduction = reduced_problem(problem)
    many = multi_start(problem, n_starts, small=small.problem, n_polished=2, tolerance=1e-5)
    middle = time.perf_counter()
    own = tight_problem(problem)
    start = [np.log(max(v, 1 / 11)) if u.positive else v for v, u in zip(many.best.p, own.unknowns.items, strict=True)]
    tight = update(own, start)
    return Runs(problem, many.best, tight, (middle - begin, time.perf_counter() - middle))


def main() -> None:
    """Prints what the data tell of each factor, and both runs with their scores."""
    problem = authors_problem(data_folder())
    print(sensitivities(problem), "\n")
    runs = run(data_folder())
    for title, result, seconds in (
        ("authors' objective", runs.authors, runs.seconds[0]),
        ("frequencies to 0.1 %", runs.tight, runs.seconds[1]),
    ):
        told = set(result.determined())
        print(f"{title}: {seconds:.1f} s, authors' objective {runs.score(result):.4f}\n{result}")
        print("changed most: " + ", ".join(result.changed_most()))
        print("left the prior: " + (", ".join(result.left_prior()) or "none"))
        print("stay at the prior: " + (", ".join(n for n in NAMES if n not in told) or "none") + "\n")
    print("published, Hz: " + " ".join(f"{f:.3f}" for f in PUBLISHED))


if __name__ == "__main__":
    main()
