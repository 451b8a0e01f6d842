"""A clamped beam on a shaker: slow sweeps at three levels say how it stiffens, and predict where it falls at others.

The recordings (stepped sines up and down at base accelerations of 0.04 to 0.14 g; student project, 2024) are not part
of this project. The script looks for `data/clamped_beam_sweeps` in the folder FEMEND_SHARED, else in `../shared` beside
the project:

python python/examples/clamped_beam_sweeps.py

The diagnosis fits time records or FRFs; a stepped sine of a nonlinear structure is neither. So it goes in two steps.

What stiffens: the one mode is fitted to amplitude and frequency of the sweep up, each law of the catalogue standing for
its describing function: omega^2 = omega0^2 + kappa(A) - gamma a / A on the upper branch. Laws are fitted to 0.04 and
0.06 g and chosen on 0.08 g.

What holds the motion where it falls: amplitude and phase along the sweep and the fall itself are fitted by the branches
of periodic motions (`femend.analysis.nonlinear_frf`) with several dampings beside the cubic stiffness, again fitted to
0.04 and 0.06 g and chosen by the fall at 0.08 g; then all three are fitted. The beam's mode rises by 0.8 Hz from one
sweep to the next: what the flanks below resonance of the six sweeps say of it is carried on to the times of the others.

What comes out: the cubic stiffness with structural damping and dry friction follows the sweeps at 0.10 to 0.14 g up to
where they fall (frequency to 1 %, phase to 3 degrees). What does not: the falls to 1 %. These sweeps fall long before
the turning point: half a hertz before, the phase is 76, 55 and 46 degrees behind the force, not 86 to 88 as at 0.04 to
0.08 g. One viscous damping comes nearer to the higher falls, by too much damping in the place of whatever makes them
fall: it misses the fitted ones. What does is not known; half the frequency of another mode (368.5 Hz in the impact
test) lies in between, at 184 Hz.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from femend.analysis.nonlinear_frf import NonlinearBranch, branches_of_modes
from femend.physics import FitCoordinates, Physics, catalogue, shapes
from femend.physics.harmonic import describing_function

FloatArray = NDArray[np.float64]

FIT, CHOOSING, REPORTED = ("0.04", "0.06"), ("0.08",), ("0.10", "0.12", "0.14")
G = 9.81
# frequencies (rad/s) between which laws are started, and amplitudes at which a law's describing function is tabled
BAND, TABLE = (2 * np.pi * 120.0, 2 * np.pi * 230.0), 40
# Hz: flank below resonance that says where the mode is, where fits of the branch begin, how far branches are followed
FLANK, ABOVE, WIDE = (126.0, 136.0), 138.0, (120.0, 320.0)
# recorded points of a sweep that are fitted, spread over amplitude
POINTS = 40
# what a model may be off: share of frequency, phase (rad), share of the amplitude at the fall
OFF_FREQ, OFF_PHASE, OFF_FALL = 0.002, 0.06, 0.02
# dry friction is all but rigid: it slips from this displacement (m), a fortieth of those at the falls
SLIP = 1e-5
# dampings that stand beside the cubic stiffness
DAMPINGS = (
    ("viscous_damper",),
    ("structural_damping",),
    ("viscous_damper", "coulomb_friction"),
    ("structural_damping", "coulomb_friction"),
    ("viscous_damper", "quadratic_damping"),
    ("viscous_damper", "cubic_damping"),
    ("structural_damping", "coulomb_friction", "quadratic_stiffness"),
)


@dataclass(frozen=True, eq=False)
class Sweep:
    """A sweep up to its fall: frequency (Hz), displacement amplitude (m) and phase (rad) at base acceleration `a`
    (m/s^2); `minute` of the day at its start. `flanks` are the frequencies (Hz) and amplitudes (m) below resonance of
    the sweeps up and down, each with its minute."""

    freq: FloatArray
    A: FloatArray
    a: float
    phase: FloatArray
    minute: float
    flanks: tuple[tuple[float, FloatArray, FloatArray], ...]

    @property
    def kept(self) -> NDArray[np.intp]:
        """Points to fit from the foot of the resonance to the fall, evenly over amplitude."""
        first = int(np.searchsorted(self.freq, ABOVE))
        levels = np.linspace(self.A[first], self.A[-1], POINTS)
        return np.unique(np.searchsorted(np.maximum.accumulate(self.A), levels).clip(first, len(self.A) - 1))

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
    title, *lines = (folder / f"sweep_{level}g.txt").read_text(encoding="latin-1").splitlines()[1:]
    rows = [line.replace(",", ".").split("\t") for line in lines if line.strip()]
    freq, speed, phase, down = np.array([[float(x) for x in row[:4]] for row in rows]).T
    starts = [datetime.strptime(part.split("]")[0], "%d-%m-%y %H:%M") for part in title.split("[")[1:]]
    up, back = (60.0 * t.hour + t.minute for t in starts)
    on = (freq > FLANK[0]) & (freq < FLANK[1])
    # the sweep down comes there at its end, four minutes after its start
    flanks = tuple((t, freq[on], v[on] / (2 * np.pi * freq[on])) for t, v in ((up, speed), (back + 4.0, down)))
    end = int(np.argmax(speed)) + 1
    A = speed[:end] / (2 * np.pi * freq[:end])
    return Sweep(freq[:end], A, float(level) * G, np.unwrap(np.deg2rad(phase[:end])), up, flanks)


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


@dataclass(frozen=True, eq=False)
class Damped:
    """One mode with cubic stiffness and a choice of damping, all by its modal mass, in the units of the recording.

    `f0` Hz of the mode in the first sweep, `gamma` participation, phase of the recording to the base `phase` (rad) and
    how it changes `delay` (rad per 50 Hz), `values` of every law; `drift` (Hz) of the mode since then, by minute.
    """

    laws: tuple[str, ...]
    values: tuple[Mapping[str, float], ...]
    f0: float
    gamma: float
    phase: float
    delay: float
    drift: Callable[[float], float]

    def branch(self, sweep: Sweep) -> NonlinearBranch:
        """Steady motions at the level of a sweep, the mode at the time of it."""
        f0 = self.f0 + self.drift(sweep.minute)
        ((found,),) = branches_of_modes(
            [2 * np.pi * f0], [0.0], [[1.0]], np.zeros((0, 1)), [1.0],
            [list(zip(self.laws, self.values, strict=True))], [self.gamma], [sweep.a], WIDE,
            harmonics=3, samples=64, max_step=0.05, max_jumps=1,
        )  # fmt: skip
        return found

    def fall(self, branch: NonlinearBranch) -> tuple[float, float]:
        """Frequency (Hz) and amplitude at which the sweep up falls: the turning point, else the largest motion."""
        jump = branch.jump("up")
        if jump is not None:
            return jump.freq, jump.amplitude
        top = int(np.argmax(branch.amplitude))
        return float(branch.freq[top]), float(branch.amplitude[top])

    def jump(self, sweep: Sweep) -> float:
        """Frequency (Hz) at which it says that a sweep falls."""
        return self.fall(self.branch(sweep))[0]

    def along(self, sweep: Sweep) -> tuple[FloatArray, FloatArray, tuple[float, float]]:
        """Relative error of frequency and error of phase (rad) at the recorded amplitudes up to the fall; frequency and
        amplitude of its own fall. Amplitudes beyond the branch are compared with its end."""
        branch = self.branch(sweep)
        end = int(np.argmax(branch.amplitude[branch.parts()[0]])) + 1
        amplitude = branch.amplitude[:end]
        psi = -np.unwrap(np.angle(branch.d[:end, 1]))
        A, f, phase = (x[sweep.kept] for x in (sweep.A, sweep.freq, sweep.phase))
        told = np.interp(A, amplitude, psi) + self.phase + self.delay * (f - 150.0) / 50.0
        return np.interp(A, amplitude, branch.freq[:end]) / f - 1, told - phase, self.fall(branch)

    def residual(self, sweep: Sweep) -> FloatArray:
        """What is left of frequency and phase, and of the fall, over what is allowed of each."""
        freq, phase, (fell, at) = self.along(sweep)
        each = len(freq) ** -0.5
        end = [(fell / sweep.jump - 1) / OFF_FREQ, np.log(at / sweep.A[-1]) / OFF_FALL]
        # while it falls the recorded phase runs ahead of that of a steady motion
        return np.concatenate([freq / OFF_FREQ * each, phase[:-3] / OFF_PHASE * each, end])

    def quadrature(self, sweep: Sweep) -> float:
        """Recorded phase (degrees) behind the force half a hertz before the fall, where the motion is still steady;
        near 90 where damping alone ends it."""
        before = int(np.searchsorted(sweep.freq, sweep.jump - 0.5))
        own = self.phase + self.delay * (sweep.freq[before] - 150.0) / 50.0
        return float(np.rad2deg(sweep.phase[before] - own))


def warming(sweeps: Sequence[Sweep]) -> Callable[[float], float]:
    """How far (Hz) the mode has moved at a minute of the day since the first of `sweeps`.

    Below resonance the amplitude is gamma a / (omega0^2 - omega^2) whatever the damping; the frequencies of the mode
    that follow from the flanks rise towards a limit as a body does that takes a temperature.
    """
    flanks = [(t, f, A / sweep.a) for sweep in sweeps for t, f, A in sweep.flanks]
    t = np.array([t for t, *_ in flanks]) - sweeps[0].minute

    def off(x: FloatArray) -> FloatArray:
        return np.concatenate([
            4 * np.pi**2 * (f0**2 - f**2) * ratio / x[0] - 1 for f0, (_, f, ratio) in zip(x[1:], flanks, strict=True)
        ])  # fmt: skip

    f0 = least_squares(off, [2.0, *np.full(len(flanks), 140.0)]).x[1:]
    limit = least_squares(lambda x: x[0] - x[1] * np.exp(-t / np.exp(x[2])) - f0, [f0[-1] + 1, 2.0, np.log(30.0)])
    _, rise, log_tau = limit.x
    return lambda minute: float(rise * (1 - np.exp(-(minute - sweeps[0].minute) / np.exp(log_tau))))


def damping_values(law: str, size: float) -> dict[str, float]:
    """Parameters of a law that holds the motion, or of the quadratic stiffness, by its one size."""
    if law == "structural_damping":
        # its spring belongs to the mode: all but nothing of it, with the loss that is wanted
        return {"k": 1.0, "eta": size}
    if law == "coulomb_friction":
        return {"f": size, "kt": size / SLIP}
    return {"quadratic_stiffness": {"k2": size}}.get(law, {"c": size})


# sizes by modal mass from which fits start
SIZES = {"viscous_damper": 1.0, "structural_damping": 1000.0, "coulomb_friction": 0.1, "quadratic_damping": 0.5,
         "cubic_damping": 0.5, "quadratic_stiffness": 1e7}  # fmt: skip


def fit_damped(damping: tuple[str, ...], sweeps: Sequence[Sweep], drift: Callable[[float], float]) -> Damped:
    """The mode with cubic stiffness and a damping, by least squares on the branches of `sweeps`."""

    def made(x: FloatArray) -> Damped:
        x = x - 1.0
        f0, phase, delay = 139.0 + x[0], np.deg2rad(60.0) + 0.1 * x[1], 0.1 * x[2]
        sizes = np.exp(np.clip(x[5:], -8.0, 8.0))
        values = [damping_values(law, size * SIZES[law]) for law, size in zip(damping, sizes, strict=True)]
        cubic = {"k3": 7.2e11 * float(np.exp(x[4]))}
        return Damped(("cubic_stiffness", *damping), (cubic, *values), f0, 1.5 * np.exp(x[3]), phase, delay, drift)

    def residual(x: FloatArray) -> FloatArray:
        return np.concatenate([made(x).residual(sweep) for sweep in sweeps])

    # steps of a hundredth, since the points of a branch are joined by straight lines; they are shares of x, so that it
    # starts from one
    found = least_squares(residual, np.ones(5 + len(damping)), diff_step=0.01, x_scale=0.3, max_nfev=15)
    return made(found.x)


def compared(sweeps: Mapping[str, Sweep]) -> list[tuple[float, Damped]]:
    """(error of the fall at the choosing level, model fitted to the others) in rising order of the error's size."""
    known = [sweeps[level] for level in (*FIT, *CHOOSING)]
    drift = warming(known)
    out = []
    for damping in DAMPINGS:
        model = fit_damped(damping, [sweeps[level] for level in FIT], drift)
        out.append((model.jump(sweeps[CHOOSING[0]]) / sweeps[CHOOSING[0]].jump - 1, model))
    return sorted(out, key=lambda item: abs(item[0]))


def damped(sweeps: Mapping[str, Sweep], chosen: Damped) -> Damped:
    """The chosen model fitted to all levels that are known."""
    return fit_damped(chosen.laws[1:], [sweeps[level] for level in (*FIT, *CHOOSING)], chosen.drift)


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
    """Prints both rankings and the predicted falls."""
    ranked, final, linear, sweeps = run(data_folder())
    print("law                    RMS error of frequency: fitted, at 0.08 g")
    for error, beam in ranked:
        name = "linear" if beam.physics is None else beam.physics.name
        print(f"{name:<22} {100 * beam.left:21.2f} % {100 * error:7.2f} %")
    print("\nbeside cubic_stiffness                                     error of the fall at 0.08 g")
    tried = compared(sweeps)
    for error, model in tried:
        print(f"{' + '.join(model.laws[1:]):<62} {100 * error:+6.2f} %")
    best = damped(sweeps, tried[0][1])
    print(f"\n{best.f0:.2f} Hz at first, by modal mass:")
    for law, values in zip(best.laws, best.values, strict=True):
        print(f"  {law} {', '.join(f'{name} {value:.4g}' for name, value in values.items())}")
    print("\nup to the fall: RMS error of frequency, of phase; recorded phase half a hertz before it")
    for level, sweep in sweeps.items():
        freq, phase, _ = best.along(sweep)
        off = 100 * float(np.sqrt(np.mean(freq**2))), float(np.rad2deg(np.sqrt(np.mean(phase[:-3] ** 2))))
        print(f"{level} g {off[0]:5.2f} % {off[1]:4.1f} deg {best.quadrature(sweep):4.0f} deg")
    print("\nfall of the sweep up, Hz: recorded, predicted; with one viscous damping; linear")
    for level, sweep in sweeps.items():
        straight = np.nan if linear is None else linear.f0
        told = [
            f"{f:7.1f} ({100 * (f / sweep.jump - 1):+5.1f} %)"
            for f in (best.jump(sweep), final.jump(sweep.a), straight)
        ]
        print(f"{level} g {sweep.jump:7.1f} {' '.join(told)}{'' if level in REPORTED else '   fitted'}")


if __name__ == "__main__":
    main()
