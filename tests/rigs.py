"""Motor rigs to diagnose: a block on four springs on a plate, tapped while clamped, run up in operation.

The truth has a plate of twice as many elements, springs of bars with their own mass where they bend, parameters off the
deck's, Rayleigh damping and dashpots in the layer. Its modes up to 300 Hz are stepped by whole transforms; a rotor's
gyroscopic moments and springs that change with the speed are stepped in time, with the speed of every instant.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from femend import FRF, Channel, Dof, TimeData, functions_of, write_uff
from femend.model.model import Model, read_model

Array = NDArray[np.float64]

RATE, NX, NY = 256.0, 5, 4
# steps in time within a sample, where the structure changes with the speed
FINE = 8
SENSORS = tuple(range(501, 509))
BEARINGS, TOP, FEET = (511, 512), (501, 502, 503, 504), (521, 522, 523, 524)


@dataclass(frozen=True)
class Rig:
    """What is true: factors on the deck's values, springs that bend or not, the layer (N/m^3, Ns/m^3) or none."""

    mass: float = 20.0
    lx: float = 0.5
    ly: float = 0.4
    k: tuple[float, float, float] = (12000.0, 12000.0, 30000.0)
    factors: tuple[float, float, float] = (1.08, 1.08, 0.9)
    mass_factor: float = 0.99
    bends: bool = True
    layer: tuple[float, float, float] | None = (7e5, 7e5, 2e6)
    dashpots: tuple[float, float, float] = (900.0, 900.0, 2400.0)
    unbalance: tuple[float, float] = (3e-3, 1.2e-3)
    phase: tuple[float, float] = (0.3, 2.1)
    sense: int = 1
    seconds: float = 50.0
    top_speed: float = 26.0
    onset: float | None = None
    power: float = 2.0
    ip: float = 0.0
    stiffening: tuple[float, float, float] = (0.0, 0.0, 0.0)

    @property
    def turns(self) -> bool:
        """Does anything act with the speed: polar inertia `ip` (kg m^2) of a rotor about X in the bearings, or
        `stiffening`, the share by which the springs' k1, k2, k3 have risen at the top speed, with its square?"""
        return self.ip != 0.0 or any(self.stiffening)


def deck(rig: Rig, *, truth: bool = False, clamped: bool = True) -> str:
    """The nominal deck, or the true one: nodes have the same ids in both."""
    fine = 2 if truth else 1
    lines = ["SOL 103", "CEND", "SPC = 1", "BEGIN BULK", "PARAM,COUPMASS,1"]
    ids: dict[tuple[int, int], int] = {}
    for j in range(NY * fine + 1):
        for i in range(NX * fine + 1):
            on = i % fine == 0 and j % fine == 0
            ids[i, j] = 1 + i // fine + (NX + 1) * (j // fine) if on else 2000 + 100 * j + i
            x, y = rig.lx * (i / (NX * fine) - 0.5), rig.ly * (j / (NY * fine) - 0.5)
            lines.append(f"GRID,{ids[i, j]},,{x:.6f},{y:.6f},0.")
    lines += ["MAT1,1,2.1+11,,0.3,7850.", "PSHELL,1,1,0.02,1,,1"]
    for j in range(NY * fine):
        for i in range(NX * fine):
            corners = ",".join(str(ids[p]) for p in ((i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)))
            lines.append(f"CQUAD4,{1 + i + 100 * j},1,{corners}")
    feet = [(1, 1), (NX - 1, 1), (NX - 1, NY - 1), (1, NY - 1)]
    at = [(rig.lx * (i / NX - 0.5), rig.ly * (j / NY - 0.5)) for i, j in feet]
    lines.append("GRID,500,,0.,0.,0.16")
    for n, (x, y) in enumerate(at):
        for base, z in ((501, 0.12), (505, 0.18), (521, 0.02)):
            lines.append(f"GRID,{base + n},,{x:.6f},{y:.6f},{z}")
        foot = ids[fine * feet[n][0], fine * feet[n][1]]
        lines.append(f"RBE2,{9201 + n},{foot},123456,{521 + n}")
    lines += ["GRID,511,,-0.06,0.,0.24", "GRID,512,,0.06,0.,0.24"]
    m = rig.mass * (rig.mass_factor if truth else 1.0)
    inertia = [rig.mass * v for v in (0.0061, 0.0105, 0.0094)]
    lines += [f"CONM2,9001,500,,{m:.6f}", f"+,{inertia[0]:.6f},,{inertia[1]:.6f},,,{inertia[2]:.6f}"]
    lines += ["RBE2,9101,500,123456,501,502,503,504,505", "+,506,507,508,511,512"]
    lines += _springs(rig, at, truth)
    nodes = [n for n in ids.values()]
    if not truth or clamped:
        lines += [f"SPC1,1,123456,{n}" for n in nodes]
    elif rig.layer is not None:
        lines += _layer(rig, ids, fine)
        lines.append(f"SPC1,1,6,{nodes[0]}")
    else:
        lines += [f"SPC1,1,123456,{n}" for n in nodes]
    return "\n".join([*lines, "ENDDATA", ""])


def _springs(rig: Rig, at: list[tuple[float, float]], truth: bool) -> list[str]:
    k = [v * f for v, f in zip(rig.k, rig.factors)] if truth else list(rig.k)
    if not (truth and rig.bends):
        values = ",".join(f"{v:.6g}" for v in k)
        bushes = [f"CBUSH,{9301 + n},11,{521 + n},{501 + n},,,,0" for n in range(4)]
        return [f"PBUSH,11,K,{values},0.,0.,0.", *bushes]
    # bars clamped at both ends: k = 12 E I / L^3 (shear stiff), E A / L; a third of a kilogram in all
    L, E = 0.1, 2e9
    I1, I2, A = k[0] * L**3 / (12 * E), k[1] * L**3 / (12 * E), k[2] * L / E
    rho = 0.3 / (A * L)
    lines = [f"MAT1,2,{E:.6g},,0.3,{rho:.6g}", f"PBAR,2,2,{A:.8e},{I1:.8e},{I2:.8e},{0.8 * (I1 + I2):.8e}"]
    for n, (x, y) in enumerate(at):
        chain = [521 + n, *(3000 + 10 * n + i for i in range(1, 4)), 501 + n]
        lines += [f"GRID,{3000 + 10 * n + i},,{x:.6f},{y:.6f},{0.02 + 0.025 * i:.6f}" for i in range(1, 4)]
        lines += [f"CBAR,{4000 + 10 * n + i},2,{chain[i]},{chain[i + 1]},1.,0.,0." for i in range(4)]
    return lines


def _layer(rig: Rig, ids: dict[tuple[int, int], int], fine: int) -> list[str]:
    assert rig.layer is not None
    lines, element = [], 5000
    cell = rig.lx * rig.ly / (NX * NY * fine**2)
    for (i, j), n in ids.items():
        share = cell * (0.5 if i in (0, NX * fine) else 1.0) * (0.5 if j in (0, NY * fine) else 1.0)
        for c in range(3):
            lines.append(f"CELAS2,{element},{rig.layer[c] * share:.8e},{n},{c + 1}")
            lines.append(f"CDAMP2,{element + 1},{rig.dashpots[c] * share:.8e},{n},{c + 1}")
            element += 2
    return lines


class Truth:
    """Modes of the true structure in one configuration, with the whole damping between them."""

    def __init__(self, rig: Rig, folder: Path, *, clamped: bool) -> None:
        path = folder / "truth.bdf"
        path.write_text(deck(rig, truth=True, clamped=clamped))
        self.model: Model = read_model(path)
        path.unlink()
        K, M = (A.toarray() for A in self.model.matrices())
        M += 1e-9 * np.trace(M) / len(M) * np.eye(len(M))  # drilling rotations have none
        lam, phi = scipy.linalg.eigh(K, M, subset_by_value=(-1.0, (2 * np.pi * 300.0) ** 2))
        self.omega = np.sqrt(np.maximum(lam, 0.0))
        self.V = np.asarray(self.model.transformation() @ phi)
        dashpots = np.asarray(self.model.fe.project(np.zeros(0), np.ascontiguousarray(phi))[0][2])
        # 0.8 % at 7 and at 19 Hz
        a, b = 2 * np.pi * 7.0, 2 * np.pi * 19.0
        self.C = 2 * 0.008 / (a + b) * (a * b * np.eye(len(lam)) + np.diag(lam)) + dashpots

    def row(self, node: int, component: int) -> Array:
        return self.V[6 * self.model.index(node) + component - 1]

    def turning(self, rig: Rig) -> tuple[Array, Array]:
        """Between the modes: G (r, r) of the rotor (moments G q' per rad/s), and what the springs gain at top speed."""
        y, z = self.row(500, 5), self.row(500, 6)
        G = rig.ip * (np.outer(y, z) - np.outer(z, y))
        gain = np.zeros_like(G)
        for n, foot in enumerate(FEET):
            # a spring acts in the middle of its length: the block's end and the foot move there rigidly
            for i, share in enumerate(rig.stiffening):
                k = rig.k[i] * rig.factors[i] * share
                stretch = self.middle(TOP[n], -0.05)[i] - self.middle(foot, 0.05)[i]
                gain += k * np.outer(stretch, stretch)
        return G, gain

    def middle(self, node: int, dz: float) -> Array:
        """Motion (3, r) of a point `dz` above `node` that moves rigidly with it."""
        u, turn = (np.array([self.row(node, first + c) for c in range(3)]) for first in (1, 4))
        return u + dz * np.array([turn[1], -turn[0], np.zeros_like(turn[0])])

    def respond_turning(self, rig: Rig, forces: Array, omega: Array, patterns: Array, outputs: Array) -> Array:
        """Accelerations (n_out, n) at the record's rate to forces (m, n FINE) and speeds (n FINE,) rad/s, from rest.

        Newmark's method with beta = 1/12 (Fox and Goodwin): periods are right to the fourth power of the step.
        """
        G, gain = self.turning(rig)
        h, top = 1 / (RATE * FINE), 2 * np.pi * rig.top_speed
        base, load, eye = np.diag(self.omega**2), forces.T @ patterns, np.eye(len(self.omega))
        u, v, a = (np.zeros(len(eye)) for _ in range(3))
        kept = np.zeros((len(outputs), forces.shape[1] // FINE))
        for i in range(load.shape[0]):
            C = self.C + rig.sense * omega[i] * G
            K = base + (omega[i] / top) ** 2 * gain
            u_next, v_next = u + h * v + (5 / 12) * h**2 * a, v + 0.5 * h * a
            a = np.linalg.solve(eye + 0.5 * h * C + h**2 / 12 * K, load[i] - C @ v_next - K @ u_next)
            u, v = u_next + h**2 / 12 * a, v_next + 0.5 * h * a
            if i % FINE == 0:
                kept[:, i // FINE] = outputs @ a
        return kept

    def receptance(self, freq: Array) -> NDArray[np.complex128]:
        """(K, r, r) between the modes."""
        s = (2j * np.pi * freq)[:, None, None]
        return np.linalg.inv(np.diag(self.omega**2) + s * self.C + s**2 * np.eye(len(self.omega)))

    def respond(self, forces: Array, patterns: Array, outputs: Array, lead: int) -> Array:
        """Accelerations (n_out, n - lead) to forces (m, n) on patterns (m, r), from rest `lead` samples before."""
        n = forces.shape[1]
        padded = n + int(20 * RATE)
        F = np.fft.rfft(forces, padded, axis=1)
        freq = np.fft.rfftfreq(padded, 1 / RATE)
        q = np.zeros((len(freq), len(self.omega)), dtype=complex)
        for part in np.array_split(np.arange(len(freq)), max(1, len(freq) // 2000)):
            q[part] = np.einsum("kij,jk->ki", self.receptance(freq[part]), patterns.T @ F[:, part])
        Y = (outputs @ q.T) * (2j * np.pi * freq) ** 2
        return np.fft.irfft(Y, padded, axis=1)[:, lead:n]


def _channels(nodes: tuple[int, ...]) -> list[Dof]:
    return [Dof(n, c) for n in nodes for c in (1, 2, 3)]


def _tacho(angle: Array) -> Array:
    """A pulse of an eighth of a revolution, rising within a hundredth: 2.5 V at angle 0."""
    turn = np.mod(angle / (2 * np.pi) + 0.5, 1.0) - 0.5
    return 5 * np.clip(np.minimum(turn / 0.01 + 0.5, (0.125 - turn) / 0.01 + 0.5), 0.0, 1.0)


def write_rig(folder: Path, rig: Rig, *, noise: float = 0.01, seed: int = 1) -> Path:
    """Deck, four recordings and study.toml; the true run-down lies beside them as `rundown.true.npy`."""
    rng = np.random.default_rng(seed)
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "model.bdf").write_text(deck(rig))
    _hammer(folder, rig, rng, noise)
    truth = Truth(rig, folder, clamped=False)
    corners = (1, NX + 1, (NX + 1) * (NY + 1), (NX + 1) * NY + 1)
    sensors = _channels((*SENSORS, *(corners if rig.layer is not None else ())))
    outputs = np.array([truth.row(d.node, d.component) for d in sensors])
    _ambient(folder, truth, sensors, outputs, rng, noise)
    for name, speeds in (("runup", (2.5, rig.top_speed)), ("rundown", (rig.top_speed, 3.0))):
        _run(folder, rig, truth, name, speeds, sensors, outputs, rng, noise)
    path = folder / "study.toml"
    path.write_text(STUDY)
    return path


def write_hammer(folder: Path, rig: Rig, *, noise: float = 0.01, seed: int = 1) -> Path:
    """Deck, the clamped modal test and its study.toml."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "model.bdf").write_text(deck(rig))
    _hammer(folder, rig, np.random.default_rng(seed), noise)
    path = folder / "study.toml"
    path.write_text(STUDY[: STUDY.index('[[recording]]\nname = "ambient"')])
    return path


def _hammer(folder: Path, rig: Rig, rng: np.random.Generator, noise: float) -> None:
    truth = Truth(rig, folder, clamped=True)
    freq = np.arange(0.0, 40.0, 0.0625)
    into = _channels(SENSORS)
    rows = np.array([truth.row(d.node, d.component) for d in into])
    X = truth.receptance(freq)
    H = (2j * np.pi * freq)[:, None] ** 2 * np.einsum("r,krs,is->ki", truth.row(505, 3), X, rows)
    spread = noise * np.sqrt((np.abs(H) ** 2).mean(axis=0)) / np.sqrt(2)
    H = H + spread * (rng.standard_normal(H.shape) + 1j * rng.standard_normal(H.shape))
    at = (Channel(Dof(505, 3), "acceleration", "m/s^2"),)
    forces = tuple(Channel(d, "force", "N") for d in into)
    write_uff(
        folder / "hammer.uff", functions_of(FRF("hammer", freq, H[:, None, :], at, forces, "accelerance", "(m/s^2)/N"))
    )


def _ambient(
    folder: Path, truth: Truth, sensors: list[Dof], outputs: Array, rng: np.random.Generator, noise: float
) -> None:
    lead, n = int(10 * RATE), int(100 * RATE)
    shaken = [truth.row(n_, c) for n_ in (500, 505, 507, 512, 1, 30) for c in (1, 2, 3)]
    forces = rng.standard_normal((len(shaken), lead + n))
    y = truth.respond(forces, np.array(shaken), outputs, lead)
    _write(folder, "ambient", sensors, y + noise * y.std(axis=1, keepdims=True) * rng.standard_normal(y.shape), None)


def _run(
    folder: Path,
    rig: Rig,
    truth: Truth,
    name: str,
    speeds: tuple[float, float],
    sensors: list[Dof],
    outputs: Array,
    rng: np.random.Generator,
    noise: float,
) -> None:
    lead, n = int(10 * RATE), int(rig.seconds * RATE)
    fine = FINE if rig.turns else 1
    t = (np.arange((lead + n) * fine) / fine - lead) / RATE
    rate = (speeds[1] - speeds[0]) / rig.seconds
    inside = np.maximum(t, 0.0)
    angle = 2 * np.pi * (speeds[0] * t + 0.5 * rate * inside**2)
    omega = 2 * np.pi * (speeds[0] + rate * inside)
    grown = omega**2 * (omega / (2 * np.pi * rig.top_speed)) ** (rig.power - 2.0)
    forces, patterns = [], []
    for node, u, phase in zip(BEARINGS, rig.unbalance, rig.phase):
        forces += [u * grown * np.cos(angle + phase), rig.sense * u * grown * np.sin(angle + phase)]
        patterns += [truth.row(node, 2), truth.row(node, 3)]
    # running before the record begins, or at rest until the force sets in with it
    soft = np.minimum(1.0, (t - t[0]) / 2) if rig.onset is None else np.clip(t / rig.onset, 0.0, 1.0)
    if rig.turns:
        y = truth.respond_turning(rig, soft * np.array(forces), omega, np.array(patterns), outputs)[:, lead:]
    else:
        y = truth.respond(soft * np.array(forces), np.array(patterns), outputs, lead)
    angle = angle[::fine]
    if name == "rundown":
        np.save(folder / "rundown.true.npy", y)
        _write(folder, name, [], np.zeros((0, n)), _tacho(angle[lead:]))
    else:
        y = y + noise * y.std(axis=1, keepdims=True) * rng.standard_normal(y.shape)
        _write(folder, name, sensors, y, _tacho(angle[lead:]))


def _write(folder: Path, name: str, sensors: list[Dof], y: Array, tacho: Array | None) -> None:
    channels = [Channel(d, "acceleration", "m/s^2") for d in sensors]
    values = list(y)
    if tacho is not None:
        channels.insert(0, Channel(None, "tacho", "V", "tacho"))
        values.insert(0, tacho)
    write_uff(folder / f"{name}.uff", functions_of(TimeData(name, 1 / RATE, np.array(values), tuple(channels))))


_ROTATING = '[recording.rotating]\ntacho = "tacho"\nnodes = [511, 512]\naxis = "X"\n'
STUDY = (
    'format = "femend-study/1"\ntitle = "rig"\n[model]\nfile = "model.bdf"\nunits = "SI"\n[damping]\nratio = 0.01\n'
    + "".join(
        f'[[parameter]]\nname = "{name}"\nproperty = "{key}"\nproperty_id = 11\nprior_sd = 0.20\n'
        for name, key in (("spring_axial", "k3"), ("spring_x", "k1"), ("spring_y", "k2"))
    )
    + '[[parameter]]\nname = "block_mass"\nproperty = "m"\nmass = 9001\nprior_sd = 0.03\n'
    + '[[configuration]]\nname = "clamped"\nspc = 1\n[[configuration]]\nname = "operation"\nspc = 1\n'
    + '[[recording]]\nname = "hammer"\nfile = "hammer.uff"\nconfiguration = "clamped"\n'
    + '[[recording]]\nname = "ambient"\nfile = "ambient.uff"\nexcitation = "ambient"\nconfiguration = "operation"\n'
    + '[[recording]]\nname = "runup"\nfile = "runup.uff"\nexcitation = "rotating"\nconfiguration = "operation"\n'
    + _ROTATING
    + '[[recording]]\nname = "rundown"\nfile = "rundown.uff"\nrole = "predict"\nexcitation = "rotating"\n'
    + 'configuration = "operation"\n'
    + _ROTATING
)

__all__ = ["STUDY", "Rig", "Truth", "deck", "write_hammer", "write_rig"]
