"""Two measured shear frames: storey stiffnesses from few modes, and the whole posterior beside Laplace's.

The data (a 4-storey laboratory frame and the 18-storey frame of E-Defense at a third of full size; Georgia Tech's
structural-model-updating toolbox, GPL-3.0) are not part of this project. The script looks for `data/shear_frames` in
the folder FEMEND_SHARED, else in `../shared` beside the project:

python python/examples/shear_frames.py

Nominal masses and stiffnesses and the ranges of the stiffnesses are the authors': 0 to 2 times for the small frame, 0.7
to 1.3 times for the large one; a prior's deviation is half of the range to one side. Frequencies are taken as known to
0.5 %, shapes to 5 % of their largest component; nobody states either. The large frame is updated with frequencies to
0.2 % as well, and it is shown that no factors within 30 % meet its three frequencies, whatever the weights.
"""

from __future__ import annotations

import os
import time
from pathlib import Path

import numpy as np
import scipy.io
from numpy.typing import NDArray

from femend.estimate.updating import (
    AffineMatrices,
    Configuration,
    Frequencies,
    ModeTest,
    Posterior,
    Problem,
    ShapeDifferences,
    Unknowns,
    UpdateResult,
    affine_matrices,
    factor,
    modal_system,
    sample,
    update,
)

FREQUENCY_SD, SHAPE_SD = 0.005, 0.05
CLOSER_SD = 0.002
DRAWS = 300
# a range in which the third mode of the large frame can be met as well
WIDE = (1 / 3, 3.0)
# lb and lbf/in
SMALL_MASS, SMALL_STIFFNESS = 12.060 / 386.088, 10.0
# kN and kN/m
LARGE_WEIGHT = np.array([208.0] * 11 + [206.0] * 6 + [202.0])
LARGE_STIFFNESS = 100.0 * np.array(
    [1155, 1092, 1073, 1028, 1028, 990, 963, 938, 876, 840, 824, 788, 712, 660, 619, 562, 491, 363]
)


def data_folder() -> Path:
    """The folder of the data; raises FileNotFoundError where they are not on this machine."""
    root = Path(os.environ.get("FEMEND_SHARED") or Path(__file__).resolve().parents[3] / "shared")
    folder = root / "data" / "shear_frames"
    if not folder.is_dir():
        raise FileNotFoundError(f"{folder} is not there; FEMEND_SHARED names the folder above data/shear_frames")
    return folder


def chain(stiffness: NDArray[np.float64], mass: NDArray[np.float64]) -> AffineMatrices:
    """A shear frame: storey i with `stiffness` (n,) between floors of `mass` (n,), each with a factor k1, k2, ..."""
    n = len(stiffness)
    parts = {}
    for i, k in enumerate(stiffness):
        b = np.zeros(n)
        b[i] = 1.0
        if i:
            b[i - 1] = -1.0
        parts[f"k{i + 1}"] = k * np.outer(b, b)
    return affine_matrices(parts, np.diag(mass))


def problem(
    name: str,
    matrices: AffineMatrices,
    rows: list[int],
    modes: tuple[NDArray[np.float64], NDArray[np.float64]],
    bounds: tuple[float, float],
    freq_sd: float = FREQUENCY_SD,
) -> Problem:
    """A frame with factors within `bounds`, and modes (Hz, shapes) at `rows`; those of a chain keep their order.
    Frequencies are known to the share `freq_sd`.

    A factor's prior is two deviations wide to either side, of the logarithm where the bounds are each other's
    inverse."""
    freq, phi = modes[0], modes[1] / np.abs(modes[1]).max(axis=0)
    low, high = bounds
    ratio = np.isclose(low * high, 1.0)
    sd = np.log(high) / 2 if ratio else (high - low) / 4
    unknowns = Unknowns.of([factor(n, sd, bounds, logarithmic=bool(ratio)) for n in matrices.names])
    responses = (Frequencies(freq, freq_sd * freq), ShapeDifferences(phi, SHAPE_SD))
    system = modal_system(matrices, rows, len(freq))
    return Problem(unknowns, (Configuration(name, system, responses, ModeTest(freq, phi, "order")),))


def four_storeys(folder: Path) -> Problem:
    """The laboratory frame: four modes at four floors."""
    data = scipy.io.loadmat(folder / "FourStoryStructure.mat")
    matrices = chain(np.full(4, SMALL_STIFFNESS), np.full(4, SMALL_MASS))
    return problem("4 storeys", matrices, [0, 1, 2, 3], (data["test_frequency"].ravel(), data["test_mode"]), (0.0, 2.0))


def eighteen_storeys(
    folder: Path, n_modes: int = 2, bounds: tuple[float, float] = (0.7, 1.3), freq_sd: float = FREQUENCY_SD
) -> Problem:
    """The large frame: its first `n_modes` of three measured ones at six floors (the authors take two), frequencies to
    the share `freq_sd`."""
    data = scipy.io.loadmat(folder / "ExpModalInfo_18DOF.mat")
    rows = [int(i) - 1 for i in data["measDOFs"].ravel()]
    modes = data["freqExp"].ravel()[:n_modes], np.real(data["psiExp_m"])[:, :n_modes]
    matrices = chain(LARGE_STIFFNESS, LARGE_WEIGHT / 9.8)
    return problem(f"18 storeys, {n_modes} modes", matrices, rows, modes, bounds, freq_sd)


def least_error(frame: Problem, starts: int = 4) -> float:
    """The least share by which the frequencies of a `frame` can be off together inside its limits, shapes left aside:
    the largest of all errors is minimised from `starts` points (sequential quadratic programming)."""
    from scipy.optimize import minimize

    (c,) = frame.configurations
    assert c.test is not None
    measured = c.test.freq
    bounds = [u.bounds for u in frame.unknowns.items]
    low, high = np.array(bounds, dtype=np.float64).T

    def off(z: NDArray[np.float64], sign: float) -> NDArray[np.float64]:
        freq = c.system.solve(z[:-1]).value("freq")[: measured.size]
        return np.asarray(z[-1] - sign * (freq / measured - 1))

    def slope(z: NDArray[np.float64], sign: float) -> NDArray[np.float64]:
        d = c.system.solve(z[:-1]).slope("freq")[:, : measured.size].T
        return np.column_stack([-sign * d / measured[:, None], np.ones(measured.size)])

    both = [{"type": "ineq", "fun": off, "jac": slope, "args": (sign,)} for sign in (1.0, -1.0)]
    found = []
    for seed in range(starts):
        x = np.random.default_rng(seed).uniform(low, high)
        begin = np.append(x, np.abs(off(np.append(x, 0.0), 1.0)).max())
        last = np.append(np.zeros(x.size), 1.0)
        end = minimize(
            lambda z: z[-1], begin, jac=lambda _, g=last: g, bounds=[*bounds, (0.0, None)], constraints=both,
            method="SLSQP", options={"maxiter": 300},
        )  # fmt: skip
        found.append(float(np.abs(off(np.append(end.x[:-1], 0.0), 1.0)).max()))
    return min(found)


def compare(result: UpdateResult, posterior: Posterior) -> str:
    """Laplace beside the draws, parameter by parameter."""
    lines = [f"{'factor':8} {'MAP':>7} {'sd':>7} {'mean':>7} {'sd drawn':>8}  95 % drawn"]
    quantiles = posterior.quantiles()
    drawn_mean, drawn_sd = posterior.values.mean(axis=0), posterior.values.std(axis=0)
    for i, (name, value) in enumerate(result.values.items()):
        low, _, high = quantiles[name]
        lines.append(
            f"{name:8} {value:7.3f} {result.sd[name]:7.3f} {drawn_mean[i]:7.3f} {drawn_sd[i]:8.3f}  "
            f"{low:.3f} to {high:.3f}"
        )
    lines.append(
        f"ln evidence: Laplace {result.log_evidence:.2f}, drawn {posterior.log_evidence:.2f} ± "
        f"{posterior.log_evidence_se:.2f}; {posterior.n_solved} models"
        + (f"; {posterior.advice}" * bool(posterior.advice))
    )
    return "\n".join(lines)


def main() -> None:
    """Prints both frames."""
    folder = data_folder()
    runs = (
        (four_storeys(folder), True),
        (eighteen_storeys(folder), False),
        (eighteen_storeys(folder, freq_sd=CLOSER_SD), False),
        (eighteen_storeys(folder, 3), False),
        (eighteen_storeys(folder, 3, WIDE), True),
    )
    for own, drawn in runs:
        result = update(own)
        print(f"{result}\nleft the prior: {', '.join(result.left_prior()) or 'none'}")
        if drawn:
            begin = time.perf_counter()
            posterior = sample(own, DRAWS)
            print(f"{compare(result, posterior)}; {time.perf_counter() - begin:.1f} s")
        print()
    least = least_error(eighteen_storeys(folder, 3))
    print(f"18 storeys within 30 %: three frequencies are off by {100 * least:.2f} % at least")


if __name__ == "__main__":
    main()
