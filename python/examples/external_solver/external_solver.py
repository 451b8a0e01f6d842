"""The same updating problem with femend's core and with CalculiX in the loop.

python python/examples/external_solver/external_solver.py

A cantilever of three segments (`beam.py`) is "measured" on a model with other moduli and density: bending modes at 12
sensors with noise. Both solvers start from the nominal values and have to find the same ones. CalculiX (`ccx`, Debian
package calculix-ccx) is called as a program; its derivatives are differences of runs made in parallel.
"""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path

import numpy as np

import femend.dof
from femend.estimate.updating import (
    Command,
    Configuration,
    ExternalSystem,
    Frequencies,
    ModeTest,
    Problem,
    ShapeDifferences,
    System,
    Unknowns,
    UpdateResult,
    deck_system,
    factor,
    update,
)
from femend.io.calculix import read_calculix_modes
from femend.model import Parameter, read_model

sys.path.insert(0, str(Path(__file__).parent))
import beam

N_MODES, N_TEST = 8, 5
NAMES = ("E1", "E2", "E3", "rho")
# what the "structure" is, as factors on the nominal values, and how well it is measured
TRUTH = np.array([0.88, 1.07, 0.95, 1.03])
FREQUENCY_SD, SHAPE_SD = 0.001, 0.01


def sensors() -> list[femend.dof.Dof]:
    """Both transverse directions of every sensor node."""
    return [femend.dof.Dof(n, c) for n in beam.sensors() for c in (2, 3)]


def core(folder: Path) -> System:
    """The beam in femend."""
    (folder / "beam.bdf").write_text(beam.nastran(), encoding="ascii")
    parameters = [Parameter(f"E{s}", "E", "material", (s,)) for s in (1, 2, 3)]
    parameters.append(Parameter("rho", "rho", "material", (1, 2, 3)))
    return deck_system(read_model(folder / "beam.bdf", parameters=parameters), sensors(), N_MODES)


def calculix(folder: Path, program: str = "ccx", workers: int = 2) -> ExternalSystem:
    """The beam in CalculiX."""

    def read(run: Path) -> dict[str, np.ndarray]:
        freq, phi = read_calculix_modes(run / "beam.dat", sensors())
        return {"freq": freq, "phi": phi}

    command = Command(
        (program, "-i", "beam"),
        {"beam.inp": beam.calculix(N_MODES)},
        read,
        time_limit=120.0,
        environment={"OMP_NUM_THREADS": "1"},
    )
    values = {f"E{s}": beam.E for s in (1, 2, 3)} | {"rho": beam.RHO}
    return ExternalSystem(command, values, folder / "runs", workers=workers)


def problem(system: System, freq: np.ndarray, phi: np.ndarray, name: str) -> Problem:
    """Moduli within 15 %, the density within 3 % (it is weighed)."""
    unknowns = Unknowns.of([*(factor(n, 0.15, (0.5, 1.5)) for n in NAMES[:3]), factor("rho", 0.03)])
    responses = (Frequencies(freq, FREQUENCY_SD * freq), ShapeDifferences(phi, SHAPE_SD))
    return Problem(unknowns, (Configuration(name, system, responses, ModeTest(freq, phi)),))


def measured(system: System, seed: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies (5,) and shapes (24, 5) of the structure with noise, scaled to 1."""
    rng = np.random.default_rng(seed)
    state = system.solve(TRUTH)
    phi = state.value("phi")[:, :N_TEST]
    freq = state.value("freq")[:N_TEST] * (1 + FREQUENCY_SD * rng.standard_normal(N_TEST))
    return freq, beam.noisy(phi / np.abs(phi).max(axis=0), SHAPE_SD, rng)


def both(folder: Path, program: str = "ccx") -> tuple[UpdateResult, UpdateResult, int, tuple[float, float]]:
    """The two runs, the number of CalculiX runs, and the seconds each took."""
    inside, outside = core(folder), calculix(folder, program)
    freq, phi = measured(inside)
    begin = time.perf_counter()
    one = update(problem(inside, freq, phi, "femend"))
    middle = time.perf_counter()
    two = update(problem(outside, freq, phi, "CalculiX"), tolerance=1e-3, history=folder / "history.json", resume=True)
    return one, two, outside.n_runs, (middle - begin, time.perf_counter() - middle)


def main() -> None:
    """Prints the parameters of both."""
    with tempfile.TemporaryDirectory() as name:
        one, two, n_runs, seconds = both(Path(name))
    print(f"femend ({seconds[0]:.1f} s)\n{one}\n\nCalculiX ({n_runs} runs, {seconds[1]:.1f} s)\n{two}\n")
    print(f"{'factor':8} {'truth':>8} {'femend':>8} {'CalculiX':>9} {'apart %':>8} {'sd %':>6}")
    for n, t in zip(NAMES, TRUTH, strict=True):
        a, b = one.values[n], two.values[n]
        print(f"{n:8} {t:8.4f} {a:8.4f} {b:9.4f} {100 * (b / a - 1):8.3f} {100 * one.sd[n]:6.2f}")


if __name__ == "__main__":
    main()
