"""A clamped beam on a shaker: slow sweeps at three levels say how it stiffens, and predict where it falls at others.

The recordings (stepped sines up and down at base accelerations of 0.04 to 0.14 g; student project, 2024) are not part
of this project. The script looks for `data/clamped_beam_sweeps` in the folder FEMEND_SHARED, else in `../shared` beside
the project:

python python/examples/clamped_beam_sweeps.py

The diagnosis fits time records or FRFs; a stepped sine of a nonlinear structure is neither. Here the one mode is fitted
to amplitude and frequency of the sweep up, each law of the catalogue standing for its describing function:
omega^2 = omega0^2 + kappa(A) - gamma a / A on the upper branch, which ends where damping eats the force:
gamma a = c omega A. Laws are fitted to 0.04 and 0.06 g and chosen on 0.08 g; then all three are fitted.

What does not come out: falls to 1 %. The damping at the falls of the three fitted sweeps differs by 40 %; the falls at
0.12 and 0.14 g come before the phase has reached resonance, and at 0.10 g it runs through it within 1 Hz at 189 Hz,
where the phase of the higher sweeps has a kink: something else takes part there that one mode does not have.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from femend.physics import FitCoordinates, Physics, catalogue, shapes
from femend.physics.harmonic import describing_function

FloatArray = NDArray[np.float64]

FIT, CHOOSING, REPORTED = ("0.04", "0.06"), ("0.08",), ("0.10", "0.12", "0.14")
G = 9.81
# frequencies (rad/s) between which laws are started, and amplitudes at which a law's describing function is tabled
BAND, TABLE = (2 * np.pi * 120.0, 2 * np.pi * 230.0), 40


@dataclass(frozen=True, eq=False)
class Sweep:
    """A sweep up to its fall: frequency (Hz) and displacement amplitude (m) at base acceleration `a` (m/s^2)."""

    freq: FloatArray
    A: FloatArray
    a: float

    @property
    def jump(self) -> float:
        """Frequency (Hz) at which the motion falls."""
        return float(self.freq[-1])


@dataclass(frozen=True, eq=False)
class Beam:
    """One mode with a law, all by its modal mass: `f0` Hz, participation `gamma`, `damping` (1/s) at the fall of each
    sweep fitted; `left` is the RMS relative error of frequency on them."""

    physics: Physics | None
    values: Mapping[str, float]
    f0: float
    gamma: float
    damping: tuple[float, ...]
    left: float

    def kappa(self, A: FloatArray) -> NDArray[np.complex128]:
        """Describing function of the law over the modal mass (n,) at amplitudes A (n,)."""
        if self.physics is None:
            return np.zeros(len(A), dtype=complex)
        return tabled(self.physics, self.values, A)

    def error(self, sweep: Sweep) -> float:
        """RMS relative error of the frequencies at which the recorded amplitudes occur."""
        square = (2 * np.pi * self.f0) ** 2 + self.kappa(sweep.A).real - self.gamma * sweep.a / sweep.A
        freq = np.sqrt(np.maximum(square, 0.0)) / (2 * np.pi)
        return float(np.sqrt(np.mean((freq / sweep.freq - 1) ** 2)))

    def eaten(self, sweep: Sweep) -> float:
        """Damping (1/s) beside the law's own that holds the force of a sweep where it falls."""
        end = sweep.A[-1:]
        omega = 2 * np.pi * sweep.jump
        own = float(self.kappa(np.append(end, 1.01 * end)).imag[0])
        return max(self.gamma * sweep.a / float(end[0]) - own, 0.0) / omega

    def jump(self, a: float, damping: float | None = None) -> float:
        """Frequency (Hz) at which a sweep up at base acceleration `a` falls: the end of the upper branch."""
        c = float(np.mean(self.damping)) if damping is None else damping
        A = np.geomspace(1e-5, 1e-2, 2000)
        kappa = self.kappa(A)
        omega = np.sqrt(np.maximum((2 * np.pi * self.f0) ** 2 + kappa.real, 1.0))
        return float(np.interp(self.gamma * a, (c * omega + kappa.imag) * A, omega) / (2 * np.pi))


def tabled(physics: Physics, values: Mapping[str, float], A: FloatArray) -> NDArray[np.complex128]:
    """Describing function at many amplitudes by interpolation in a table."""
    at = np.geomspace(A.min(), A.max(), TABLE)
    table = describing_function(physics, values, at, (BAND[0] * BAND[1]) ** 0.5)
    return np.interp(A, at, table.real) + 1j * np.interp(A, at, table.imag)


def data_folder() -> Path:
    """The folder of the recordings; raises FileNotFoundError where they are not on this machine."""
    root = Path(os.environ.get("FEMEND_SHARED") or Path(__file__).resolve().parents[3] / "shared")
    folder = root / "data" / "clamped_beam_sweeps"
    if not folder.is_dir():
        raise FileNotFoundError(f"{folder} is not there; FEMEND_SHARED names the folder above data/clamped_beam_sweeps")
    return folder


def read(folder: Path, level: str) -> Sweep:
    """The sweep up at a level (g) to where it falls: decimal commas, frequency, velocity and phase up, then down."""
    lines = (folder / f"sweep_{level}g.txt").read_text(encoding="latin-1").splitlines()[2:]
    rows = [line.replace(",", ".").split("\t") for line in lines if line.strip()]
    freq, speed = np.array([[float(row[0]), float(row[1])] for row in rows]).T
    end = int(np.argmax(speed)) + 1
    return Sweep(freq[:end], speed[:end] / (2 * np.pi * freq[:end]), float(level) * G)


class Branches:
    """Upper branches stacked for least squares on the relative frequency; every sweep counts alike."""

    def __init__(self, sweeps: Sequence[Sweep]) -> None:
        self.sweeps = sweeps
        self.A = np.concatenate([s.A for s in sweeps])
        self.square = (2 * np.pi * np.concatenate([s.freq for s in sweeps])) ** 2
        self.weight = np.concatenate([np.full(len(s.A), len(s.A) ** -0.5) for s in sweeps]) / (2 * self.square)
        self.columns = [np.ones(len(self.A)), -np.concatenate([s.a / s.A for s in sweeps])]

    def solved(self, columns: Sequence[FloatArray], kappa: FloatArray) -> tuple[FloatArray, FloatArray]:
        """omega0^2, gamma and factors of further `columns`, and the weighted residual, beside a known `kappa`."""
        M = np.stack([*self.columns, *columns], axis=1) * self.weight[:, None]
        b = (self.square - kappa) * self.weight
        x = np.linalg.lstsq(M, b, rcond=None)[0]
        return x, M @ x - b

    def start(self, physics: Physics) -> dict[str, float] | None:
        """Values of the shape that follows the branches best; None where no shape has a say."""
        best: tuple[float, dict[str, float]] | None = None
        for shape in shapes(physics, amplitude=float(self.A.max()), band=BAND):
            parts = [tabled(physics, term, self.A).real for term in shape.terms]
            if any(np.ptp(p) <= 1e-6 * np.abs(p).max() for p in parts):
                continue  # the same at all amplitudes, so part of omega0
            x, e = self.solved(parts, np.zeros(len(self.A)))
            if best is None or e @ e < best[0]:
                factors = x[2:] if physics.signed else np.abs(x[2:])
                best = float(e @ e), shape.values(factors.tolist())
        return None if best is None else best[1]


def fit(physics: Physics | None, sweeps: Sequence[Sweep]) -> Beam | None:
    """The mode with a law; None where the law has no say or the mode comes out as none."""
    data = Branches(sweeps)
    values: dict[str, float] = {}
    kappa = np.zeros(len(data.A))
    if physics is not None:
        begun = data.start(physics)
        if begun is None:
            return None
        coordinates = FitCoordinates(physics, begun)

        def residual(x: FloatArray) -> FloatArray:
            return data.solved((), tabled(physics, coordinates.parameters(x), data.A).real)[1]

        x0 = coordinates.start()
        values = coordinates.parameters(least_squares(residual, x0, bounds=(x0 - 3, x0 + 3), max_nfev=40).x)
        kappa = tabled(physics, values, data.A).real
    square, gamma = data.solved((), kappa)[0]
    if square <= 0 or gamma <= 0:
        return None
    beam = Beam(physics, values, float(square**0.5 / (2 * np.pi)), float(gamma), (), 0.0)
    left = float(np.sqrt(np.mean([beam.error(s) ** 2 for s in sweeps])))
    return replace(beam, damping=tuple(beam.eaten(s) for s in sweeps), left=left)


def run(folder: Path) -> tuple[list[tuple[float, Beam]], Beam, Beam | None, dict[str, Sweep]]:
    """(error on the choosing level, law) in rising order; the best one and no law fitted to all three; the sweeps."""
    sweeps = {level: read(folder, level) for level in (*FIT, *CHOOSING, *REPORTED)}
    ranked = []
    for entry in (None, *catalogue(kind="nonlinear", extended=True)):
        if entry is None or entry.law not in ("iwan", "free_form"):
            beam = fit(entry, [sweeps[level] for level in FIT])
            if beam is not None:
                ranked.append((float(np.mean([beam.error(sweeps[level]) for level in CHOOSING])), beam))
    ranked.sort(key=lambda item: item[0])
    known = [sweeps[level] for level in (*FIT, *CHOOSING)]
    final = fit(ranked[0][1].physics, known)
    assert final is not None
    return ranked, final, fit(None, known), sweeps


def main() -> None:
    """Prints the ranking and the predicted falls, with their range over the damping of the fitted sweeps."""
    ranked, final, linear, sweeps = run(data_folder())
    print("law                    RMS error of frequency: fitted, at 0.08 g")
    for error, beam in ranked:
        name = "linear" if beam.physics is None else beam.physics.name
        print(f"{name:<22} {100 * beam.left:21.2f} % {100 * error:7.2f} %")
    damping = ", ".join(f"{100 * c / (4 * np.pi * final.f0):.3f}" for c in final.damping)
    print(f"\n{final.f0:.2f} Hz, {dict(final.values)} by modal mass, damping {damping} % at the fitted falls")
    print("\nfall of the sweep up, Hz: recorded, predicted (error; range), linear (error)")
    for level, sweep in sweeps.items():
        role = "" if level in REPORTED else "   fitted"
        told, straight = final.jump(sweep.a), np.nan if linear is None else linear.f0
        low, high = (final.jump(sweep.a, c) for c in (max(final.damping), min(final.damping)))
        print(
            f"{level} g {sweep.jump:7.1f} {told:7.1f} ({100 * (told / sweep.jump - 1):+.1f} %; {low:.1f} to {high:.1f})"
            f" {straight:7.1f} ({100 * (straight / sweep.jump - 1):+.1f} %){role}"
        )


if __name__ == "__main__":
    main()
