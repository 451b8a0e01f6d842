"""Eight sensors on a frame with three E moduli: those that are proposed against random sets of eight.

The frame is the deck of a generated case that is not part of this project: the script looks for
`cases/c04/public/model.bdf` in the folder FEMEND_SHARED, else in `../shared` beside the project:

python python/examples/pretest_frame.py [PICTURE.png]

Frequencies are taken as known to 0.2 %, shapes to 5 %, of the first eight modes. Printed is the share of the moduli's
prior variance that each plan leaves, and what a virtual test of the proposed plan finds; the picture shows the
distribution of 2000 random sets.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import femend as fe
from femend.estimate.updating import deck_system, factors_of
from femend.model import Model, Parameter, read_model
from femend.pretest import (
    PlannedTest,
    VirtualTest,
    effective_independence,
    exciters,
    parameter_sensors,
    planned_test,
    qr_placement,
    virtual_test,
)

NAMES = ("E_columns", "E_beams_x", "E_beams_y")
SENSORS, EXCITERS, MODES, SETS = 8, 2, 8, 2000
FREQUENCY_SD, SHAPE_SD = 0.002, 0.05
# the structure of the virtual test, its noise and the end of its band in Hz
TRUTH, NOISE, F_MAX = (1.1, 0.93, 1.05), 0.02, 70.0


def model_file() -> Path:
    """The deck; raises FileNotFoundError where it is not on this machine."""
    root = Path(os.environ.get("FEMEND_SHARED") or Path(__file__).resolve().parents[3] / "shared")
    path = root / "cases" / "c04" / "public" / "model.bdf"
    if not path.is_file():
        raise FileNotFoundError(f"{path} is not there; FEMEND_SHARED names the folder above cases/c04")
    return path


def frame(path: Path) -> tuple[Model, list[fe.Dof]]:
    """The model with its moduli as parameters, and the places of sensors: every free node along X, Y and Z."""
    parameters = [Parameter(n, "E", "material", (i,)) for i, n in enumerate(NAMES, 1)]
    model = read_model(path, parameters=parameters)
    free = [int(n) for n in model.node_ids if model.xyz[model.index(int(n)), 2] > 0]
    return model, [fe.Dof(n, c) for n in free for c in (1, 2, 3)]


def plan_of(model: Model, places: list[fe.Dof]) -> PlannedTest:
    """The test that is planned, seen at all places."""
    return planned_test(
        deck_system(model, places, MODES + 2), factors_of(model.parameters), modes=range(MODES),
        freq_sd=FREQUENCY_SD, shape_sd=SHAPE_SD,
    )  # fmt: skip


def random_sets(plan: PlannedTest, n_sets: int = SETS, seed: int = 0) -> NDArray[np.float64]:
    """Shares of variance (n_sets,) that random sets of sensors leave."""
    rng = np.random.default_rng(seed)
    return np.array([plan.variance_left(rng.choice(plan.n_places, SENSORS, replace=False)) for _ in range(n_sets)])


def proposals(model: Model, places: list[fe.Dof], plan: PlannedTest) -> dict[str, NDArray[np.int64]]:
    """Rows of the sensors that each method chooses, by its name."""
    phi = deck_system(model, places, MODES + 2).solve(np.ones(len(NAMES))).value("phi")[:, :MODES]
    return {
        "parameter variance": parameter_sensors(plan, SENSORS).rows,
        "effective independence": effective_independence(phi, SENSORS).rows,
        "QR": qr_placement(phi, SENSORS).rows,
    }


def rehearsal(model: Model, places: list[fe.Dof], rows: NDArray[np.int64]) -> VirtualTest:
    """The proposed plan as a virtual test, excited where all modes of the band are driven best: at two places, since
    one shows a pair of close modes as one."""
    sensors = [places[int(r)] for r in rows]
    state = deck_system(model, sensors, 16).solve(np.ones(len(NAMES)))
    inside = state.value("freq") <= F_MAX
    drive = exciters(state.value("phi")[:, inside], 2 * np.pi * state.value("freq")[inside], EXCITERS).rows
    freq = np.arange(8.0, F_MAX, 0.05)
    return virtual_test(
        deck_system(model, sensors, 16), factors_of(model.parameters), TRUTH, sensors, drive, freq,
        zeta=0.01, noise=NOISE, shape_sd=SHAPE_SD,
    )  # fmt: skip


def picture(path: Path, left: NDArray[np.float64], found: dict[str, float]) -> None:
    """The distribution of the random sets, with the proposals as lines."""
    from femend.report import plots

    with plots.paper_style():
        made = plots.figure("column", 60)
        ax = made.axes[0]
        ax.hist(100 * left, bins=60, color="#8ab7de")
        for (name, value), dash in zip(found.items(), ("-", "--", ":"), strict=True):
            ax.axvline(100 * value, color="#c8600a", linestyle=dash, label=name)
        ax.set_xlabel("share of prior variance left, %")
        ax.set_ylabel(f"random sets of {SENSORS}")
        ax.legend(loc="lower center", bbox_to_anchor=(0.45, 1.0), ncols=3)
        made.savefig(path)


def main(out: str | None = None) -> None:
    """Prints what the plans leave, and draws it where a path is given."""
    model, places = frame(model_file())
    plan = plan_of(model, places)
    rows = proposals(model, places, plan)
    found = {name: plan.variance_left(r) for name, r in rows.items()}
    left = random_sets(plan)
    print(f"{plan.n_places} places, {SENSORS} sensors, {MODES} modes; share of the prior variance that is left:")
    for name, value in found.items():
        print(f"{name:24} {100 * value:.3f} %")
    for name, value in (("best", left.min()), ("median", np.median(left)), ("99 %", np.quantile(left, 0.99))):
        print(f"{len(left)} random sets, {name:6} {100 * value:.3f} %")
    print(rehearsal(model, places, rows["parameter variance"]))
    if out is not None:
        picture(Path(out), left, found)


if __name__ == "__main__":
    main(*sys.argv[1:2])
