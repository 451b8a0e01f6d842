"""A rotor's bearings updated on a run-up whose unbalance nobody measured, and on operating shapes of an unknown force.

python python/examples/rotor_run_up.py

A steel shaft of 0.8 m with a disc turns in two bearings, springs and dashpots; sensors sit at three stations. The
deck's modulus, bearing stiffness and bearing damping are off by 6, 20 and 40 %. The run-up, 60 s from 10 to 70 rev/s,
is stepped in time with 1 % of noise; operating shapes are those of a force of random amplitude and phase at one
bearing, with 2 % of noise on every line. Printed is what is found with the unbalance free, with one that is taken for
known and is 30 % off at one bearing, with an order track in the place of the steady shapes, and with the operating
shapes.
"""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import scipy.linalg
from numpy.typing import NDArray
from scipy.sparse import csc_array

from femend import Channel, Dof, TimeData
from femend.data import ODS, OrderTrack, Speed
from femend.estimate.updating import (
    Configuration,
    Frfs,
    OdsDifferences,
    OrderDifferences,
    Problem,
    UpdateResult,
    deck_system,
    unknowns_of,
    update,
)
from femend.model import Model, Parameter, read_model
from femend.signal import run_up_shapes, vold_kalman

Array = NDArray[np.float64]

BEARINGS, AXIS = (2, 8), 0
# at both bearings, which are the places of forces too, and beside the disc
SENSORS = tuple(Dof(n, c) for n in (2, 5, 8) for c in (2, 3))
PARAMETERS = (
    Parameter("E", "E", "material", (1,), 0.1),
    Parameter("k_bearing", "k1", "property_id", (21,), 0.3),
    Parameter("c_bearing", "c1", "property_id", (31,), 0.5),
)
TRUTH = np.array([1.06, 0.8, 1.4])
# kg m, and its direction at the tacho's pulse
UNBALANCE = {2: 2e-5 * np.exp(0.7j), 8: 5e-5 * np.exp(-1.9j)}
RATE, SECONDS, SPEEDS, NOISE = 512.0, 60.0, (10.0, 70.0), 0.01
# steps in time within a sample
FINE = 8
# deviation of what deconvolution leaves, a share of the largest value on a line
FLOOR = 0.02


def shaft(folder: Path) -> Model:
    """The deck, read."""
    lines = ["SOL 103", "CEND", "SPC = 1", "BEGIN BULK", "MAT1,1,2.1+11,,0.3,7850."]
    lines += [f"GRID,{n},,{0.1 * (n - 1)},0.,0." for n in range(1, 10)]
    lines += ["PBAR,1,1,3.14-4,7.85-9,7.85-9,1.57-8"]
    lines += [f"CBAR,{n},1,{n},{n + 1},0.,1.,0." for n in range(1, 9)]
    lines += ["CONM2,40,6,,4.0", "PELAS,21,2.+5", "PDAMP,31,60.0"]
    places = [(n, c) for n in BEARINGS for c in (2, 3)]
    lines += [f"CELAS1,{100 + i},21,{n},{c}" for i, (n, c) in enumerate(places)]
    lines += [f"CDAMP1,{200 + i},31,{n},{c}" for i, (n, c) in enumerate(places)]
    lines += ["SPC1,1,14,1,2,3,4,5,6", "SPC1,1,14,7,8,9", "ENDDATA"]
    path = folder / "shaft.bdf"
    path.write_text("\n".join(lines) + "\n")
    return read_model(path, parameters=PARAMETERS)


@dataclass(frozen=True)
class Machine:
    """The true structure in full matrices (n, n), and its rows at the sensors (n_sensors, n)."""

    K: Array
    C: Array
    M: Array
    rows: Array

    @classmethod
    def of(cls, model: Model) -> Machine:
        """That of a deck with the true factors."""
        indptr, indices, *values = model.fe.assemble(TRUTH)
        shape = (model.fe.n_a, model.fe.n_a)
        K, M, C, _ = (csc_array((v, indices, indptr), shape=shape).toarray() for v in values)
        return cls(K, C, M, model.transformation().tocsr()[[model.row(d) for d in SENSORS]].toarray())

    def run_up(self) -> tuple[TimeData, Speed]:
        """Accelerations of a run-up, stepped in time with forces that are straight between steps."""
        n, (low, high) = int(RATE * SECONDS), SPEEDS
        t = np.arange(n * FINE) / (RATE * FINE)
        pace = (high - low) / SECONDS
        omega, angle = 2 * np.pi * (low + pace * t), 2 * np.pi * (low * t + pace * t**2 / 2)
        force = np.zeros((t.size, len(self.K)))
        for node, u in UNBALANCE.items():
            turning = omega**2 * u * np.exp(1j * angle)
            for part, c in ((turning.real, 2), (turning.imag, 3)):
                force += np.outer(part, self.rows[SENSORS.index(Dof(node, c))])
        # the lowest modes hold what sensors move by up to the highest speed
        # (rotations have no mass, so that K is the one that is positive definite)
        n_a = len(self.K)
        mu, phi = scipy.linalg.eigh(self.M, self.K, subset_by_index=(n_a - 12, n_a - 1))
        lam, phi = 1 / mu, phi / np.sqrt(mu)
        k, c, drive = np.diag(lam), phi.T @ self.C @ phi, force @ phi
        m, zero = len(lam), np.zeros((len(lam), len(lam)))
        A = np.block([[zero, np.eye(m)], [-k, -c]])
        B = np.vstack([zero, np.eye(m)])
        h = t[1]
        step = scipy.linalg.expm(
            np.block([[A * h, B * h, 0 * B], [np.zeros((m, 3 * m)), np.eye(m)], [np.zeros((m, 4 * m))]])
        )
        E, first, second = step[: 2 * m, : 2 * m], step[: 2 * m, 2 * m : 3 * m], step[: 2 * m, 3 * m :]
        pushes = drive[:-1] @ (first - second).T + drive[1:] @ second.T
        x = np.zeros((t.size, 2 * m))
        for i, push in enumerate(pushes):
            x[i + 1] = E @ x[i] + push
        a = ((x @ A[m:].T + drive) @ (self.rows @ phi).T)[::FINE].T
        a = a + NOISE * a.std(axis=1, keepdims=True) * np.random.default_rng(1).standard_normal(a.shape)
        channels = tuple(Channel(d, "acceleration", "m/s^2") for d in SENSORS)
        at = slice(None, None, FINE)
        return TimeData("run-up", 1 / RATE, a, channels), Speed(t[at], omega[at] / (2 * np.pi), angle[at], "known")

    def operating_shapes(self) -> ODS:
        """Shapes on 25 lines under a force at bearing 8 in Z, whose amplitude and phase change from line to line."""
        rng = np.random.default_rng(2)
        freq = np.linspace(12.0, 72.0, 25)
        into = self.rows[SENSORS.index(Dof(8, 3))]
        s = 2j * np.pi * freq
        y = np.array([x**2 * self.rows @ np.linalg.solve(self.K + x * self.C + x**2 * self.M, into) for x in s])
        seen = [i for i, d in enumerate(SENSORS) if d.component == 3]
        y = y[:, seen] * (rng.standard_normal((25, 1)) + 1j * rng.standard_normal((25, 1)))
        sigma = 0.02 * np.abs(y).max(axis=1, keepdims=True) * np.ones(y.shape)
        y = y + sigma / np.sqrt(2) * (rng.standard_normal(y.shape) + 1j * rng.standard_normal(y.shape))
        channels = tuple(Channel(SENSORS[i], "acceleration", "m/s^2") for i in seen)
        return ODS("beside the machine", freq, y.T, channels, "ods-frf", channels[0], sigma=sigma.T)


def on_order(model: Model, run: ODS | OrderTrack, **told: object) -> tuple[UpdateResult, OrderDifferences]:
    """The deck updated on order 1 of a run."""
    response, frfs = OrderDifferences.of(run, SENSORS, BEARINGS, AXIS, sense=1, floor=FLOOR, **told)  # type: ignore[arg-type]
    return _updated(model, response, frfs), response


def on_shapes(model: Model, ods: ODS) -> UpdateResult:
    """The deck updated on operating shapes of one force of unknown amplitudes."""
    return _updated(model, *OdsDifferences.of(ods, SENSORS, [Dof(8, 3)]))


def _updated(model: Model, response: OdsDifferences | OrderDifferences, frfs: Frfs) -> UpdateResult:
    system = deck_system(model, SENSORS, 0, frfs=frfs)
    return update(Problem(unknowns_of(model), (Configuration("running", system, (response,)),)))


def line(title: str, result: UpdateResult) -> str:
    """Factors with their deviations, and what is left."""
    found = "  ".join(f"{n} {v:.4f} ± {result.sd[n]:.4f}" for n, v in result.values.items())
    left = np.sqrt(result.after.squares / result.after.n_values)
    return f"{title:28} {found}  left {left:.2f} deviations (rms)"


def main() -> None:
    """Prints what every kind of data says."""
    with tempfile.TemporaryDirectory() as folder:
        model = shaft(Path(folder))
    machine = Machine.of(model)
    print(f"{'truth':28} " + "  ".join(f"{p.name} {f:.4f}" for p, f in zip(PARAMETERS, TRUTH, strict=True)))
    data, speed = machine.run_up()
    steady = run_up_shapes(data, speed)
    steady = steady.lines(np.arange(0, steady.n_freq, 8))
    sd = NOISE * float(np.median(np.abs(steady.shapes)))
    free, response = on_order(model, steady, sd=sd)
    print(line("run-up, unbalance free", free))
    u, deviation = response.found(free.after.states[0])
    for node, found, off in zip(BEARINGS, u, deviation, strict=True):
        true = UNBALANCE[node]
        print(
            f"    unbalance at {node}: {1e6 * abs(found):.2f} ± {1e6 * off:.2f} g mm at "
            f"{np.degrees(np.angle(found)):.1f}°, true {1e6 * abs(true):.2f} at {np.degrees(np.angle(true)):.1f}°"
        )
    wrong = {2: UNBALANCE[2], 8: 1.3 * UNBALANCE[8]}
    print(line("wrong unbalance held", on_order(model, steady, sd=sd, unbalance=wrong)[0]))
    track = vold_kalman(data, speed, [1.0])
    print(line("order track as it is", on_order(model, track, step=0.5)[0]))
    print(line("operating shapes", on_shapes(model, machine.operating_shapes())))


if __name__ == "__main__":
    main()
