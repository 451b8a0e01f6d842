"""An electronic Duffing oscillator: a linear model of one mass, and the recordings say that its spring is cubic.

The recordings (Wigren and Schoukens, Three free data sets for development and benchmarking in nonlinear system
identification, ECC 2013) are not part of this project. The script looks for `data/silverbox/SNLS80mV.mat` in the folder
FEMEND_SHARED, else in `../shared` beside the project:

python python/examples/silverbox.py

The file holds an "arrow" of growing amplitude and ten realisations of a multisine. Laws are fitted to one realisation
and chosen on a second one; reported are a third one and the arrow, which goes beyond the amplitudes of all others.
"""

from __future__ import annotations

import os
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.io import loadmat

import femend as fe
from femend import Channel, Recording, Test, TimeData
from femend.diagnose import NamedAt, name_at
from femend.diagnose.fitting.output_fit import OutputFit, TimeRecord, fit_output
from femend.diagnose.fitting.output_laws import modes_of, with_further_law
from femend.dof import Dof
from femend.model import find_places
from femend.physics import catalogue, physics

FloatArray = NDArray[np.float64]

DT = 2**14 / 1e7
# 68 Hz and a static gain of one V/V, in units in which a volt of input is a newton and a volt of output a metre
DECK = """SOL 103
CEND
METHOD = 1
SPC = 1
BEGIN BULK
EIGRL,1,,,1
GRID,1,,0.,0.,0.
SPC1,1,23456,1
CONM2,1,1,,5.478-6
PELAS,1,1.
CELAS1,2,1,1,1
ENDDATA
"""
ARROW = (0, 40500)
# where realisations begin, at rest; samples of each, and those until the start from rest is forgotten
REALISATIONS, LENGTH, SKIP = (40540, 49230, 84000), 8690, 200
REST = slice(0, 600)


@dataclass(frozen=True, eq=False)
class Outcome:
    """The naming, the fits in displacement without a law, with it and with a further one, and the records."""

    named: NamedAt
    linear: OutputFit
    one: OutputFit
    two: OutputFit | None
    fitting: list[TimeRecord]
    choosing: list[TimeRecord]
    held_out: TimeRecord
    arrow: TimeRecord

    @property
    def final(self) -> OutputFit:
        """The fit with all laws."""
        return self.two or self.one

    def errors(self, fit: OutputFit) -> tuple[float, float]:
        """RMS error in mV on the realisation held out and on the whole arrow."""
        on = (self.held_out, SKIP), (self.arrow, 0)
        first, second = (1e3 * float(fit.rms_error(record, skip)[0]) for record, skip in on)
        return first, second


def data_file() -> Path:
    """The recording; raises FileNotFoundError where it is not on this machine."""
    root = Path(os.environ.get("FEMEND_SHARED") or Path(__file__).resolve().parents[3] / "shared")
    file = root / "data" / "silverbox" / "SNLS80mV.mat"
    if not file.is_file():
        raise FileNotFoundError(f"{file} is not there; FEMEND_SHARED names the folder above data/silverbox")
    return file


def read(file: Path) -> tuple[FloatArray, FloatArray]:
    """Input and output in V; the input's zero is set so that at rest it holds the output where it rests (gain one)."""
    content = loadmat(file)
    u, y = (np.asarray(content[name], dtype=float).ravel() for name in ("V1", "V2"))
    return u - u[REST].mean() + y[REST].mean(), y


def record(u: FloatArray, y: FloatArray, start: int, length: int) -> TimeRecord:
    """A stretch of the recording."""
    part = slice(start, start + length)
    return TimeRecord(u[None, part], y[None, part], DT)


def named(records: list[TimeRecord]) -> NamedAt:
    """Which law of the catalogue is missing between the mass and the ground, by the code every diagnosis uses.

    It compares accelerations; on those differentiated from displacements the highest lines are not met to the noise.
    """
    at = Dof(1, 1)
    channels = (Channel(at, "force", "N"), Channel(at, "displacement", "m"))
    test = Test(
        tuple(
            Recording(f"multisine {i + 1}", TimeData(f"multisine {i + 1}", DT, np.vstack([r.u, r.y]), channels))
            for i, r in enumerate(records)
        )
    )
    with tempfile.TemporaryDirectory() as folder:
        deck = Path(folder) / "model.bdf"
        deck.write_text(DECK, encoding="ascii")
        model = fe.read_model(deck, parameters=["k:1", "m:1"])
    start = fe.update(model, test, fe.pair(test, model), damping=0.05)
    (place,) = (p for p in find_places(model) if p.kind == "ground")
    return name_at(start.found, place)


def run(file: Path) -> Outcome:
    """Names the law, fits in displacement, and looks for a further law."""
    u, y = read(file)
    records = [record(u, y, start, LENGTH) for start in REALISATIONS]
    ranking = named(records[:2])
    best = ranking.best.candidate
    assert best.physics is not None
    fitting, choosing = records[:1], records[1:2]
    modes = modes_of(ranking.problem, best)
    linear = fit_output(modes, [[]], fitting, zero=True, skip=SKIP)
    one = fit_output(modes, [[(best.physics, best.values)]], fitting, zero=True, skip=SKIP)
    two = with_further_law(one, catalogue(kind="nonlinear"), fitting, choosing, skip=SKIP)
    return Outcome(ranking, linear, one, two, fitting, choosing, records[2], record(u, y, ARROW[0], ARROW[1]))


def main() -> None:
    """Prints the ranking of the catalogue, the errors and the parameters."""
    found = run(data_file())
    print("law                    unseen misfit   score above best")
    for r in found.named.ranked:
        print(f"{r.name:<22} {r.candidate.chosen:13.2f} {r.score - found.named.best.score:18.1f}")
    print(f"without a law          {found.named.null_misfit:13.2f}")
    print(f"accepted: {found.named.accepted}; to the noise: {found.named.adequate}")
    print("\nRMS error, mV                     parameters   held-out multisine   arrow")
    # what any smooth force over displacement and velocity could still explain
    free = with_further_law(found.one, [physics("free_form")], found.fitting, found.choosing, skip=SKIP)
    for fit in (found.linear, found.one, found.two, free):
        if fit is not None:
            laws = " + ".join(p.name for p, _ in fit.laws[0]) or "linear"
            held_out, arrow = found.errors(fit)
            print(f"{laws:<42} {fit.n_parameters:3d} {held_out:20.3f} {arrow:7.3f}")
    final = found.final
    f, zeta = final.modes.omega[0] / (2 * np.pi), final.modes.zeta[0]
    mass, zero = final.modes.w[0, 0] ** -2, final.zero[0]
    print(f"\n{f:.3f} Hz, damping {100 * zeta:.2f} %, mass {mass:.4g}, force zero {zero:.3g} V")
    for law, values in final.laws[0]:
        print(law.name, ", ".join(f"{name} = {value:.4g}" for name, value in values.items()))


if __name__ == "__main__":
    main()
