"""A rotor in two bearings for the tests of operating responses: as a deck with dashpots, and as four masses."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from femend.data import Channel, Speed, TimeData
from femend.dof import Dof
from femend.estimate.updating import AffineMatrices, affine_matrices
from femend.model import Model, Parameter, read_model

Array = NDArray[np.float64]
BEARINGS = (2, 8)
# motion across the shaft (X) at both bearings and between them; the bearings' are needed as places of forces
SENSORS = tuple(Dof(n, c) for n in (2, 5, 7, 8) for c in (2, 3))
PARAMETERS = (
    Parameter("E", "E", "material", (1,), 0.2),
    Parameter("k", "k1", "property_id", (21,), 0.3),
    Parameter("c", "c1", "property_id", (31,), 0.5),
)
TRUE_FACTORS = np.array([1.06, 0.8, 1.4])


def shaft(folder: Path) -> Model:
    """A steel shaft of 0.8 m with a disc of 4 kg off its middle, on springs and dashpots at nodes 2 and 8."""
    lines = ["SOL 103", "CEND", "SPC = 1", "BEGIN BULK", "MAT1,1,2.1+11,,0.3,7850."]
    lines += [f"GRID,{n},,{0.1 * (n - 1)},0.,0." for n in range(1, 10)]
    lines += ["PBAR,1,1,3.14-4,7.85-9,7.85-9,1.57-8"]
    lines += [f"CBAR,{n},1,{n},{n + 1},0.,1.,0." for n in range(1, 9)]
    lines += ["CONM2,40,6,,4.0", "PELAS,21,4.+5", "PDAMP,31,60.0"]
    element = 100
    for n in BEARINGS:
        for c in (2, 3):
            lines += [f"CELAS1,{element},21,{n},{c}", f"CDAMP1,{element + 1},31,{n},{c}"]
            element += 2
    lines += [f"SPC1,1,14,{','.join(map(str, range(1, 8)))}", "SPC1,1,14,8,9", "ENDDATA"]
    path = folder / "shaft.bdf"
    path.write_text("\n".join(lines) + "\n")
    return read_model(path, parameters=PARAMETERS)


def receptances(model: Model, factors: Array, freq: Array, outputs: list[Dof], inputs: list[Dof]) -> NDArray:
    """Receptances (n_freq, n_out, n_in) by full solutions on every line, with the deck's dashpots."""
    from scipy.sparse import csc_array

    indptr, indices, *values = model.fe.assemble(factors)
    n = model.fe.n_a
    K, M, C, H = (csc_array((v, indices, indptr), shape=(n, n)).toarray() for v in values)
    T = model.transformation().tocsr()
    out, into = (T[[model.row(d) for d in dofs]].toarray() for dofs in (outputs, inputs))
    s = 2j * np.pi * freq
    return np.array([out @ np.linalg.solve(K + 1j * H + x * C + x**2 * M, into.T) for x in s])


def channels(sensors: tuple[Dof, ...], quantity: str = "acceleration") -> tuple[Channel, ...]:
    return tuple(Channel(d, quantity, {"acceleration": "m/s^2", "velocity": "m/s"}.get(quantity, "m")) for d in sensors)


# a rigid rotor of 10 kg: y and z at bearings 1 and 2, stiffer in z
RIGID = (Dof(1, 2), Dof(1, 3), Dof(2, 2), Dof(2, 3))
MASS = np.kron(np.array([[3.0, 1.2], [1.2, 4.6]]), np.eye(2))
K_Y, K_Z = 4.0e4, 7.0e4


def rigid_rotor() -> AffineMatrices:
    """Factors ky and kz on the bearings' stiffness in either direction."""
    return affine_matrices({"ky": K_Y * np.diag([1.0, 0, 1.1, 0]), "kz": K_Z * np.diag([0, 1.0, 0, 1.1])}, MASS)


def run_up(
    ky: float, kz: float, beta: float, unbalance: Array, *, sense: int = 1, seconds: float = 60.0, noise: float = 0.0
) -> tuple[TimeData, Speed]:
    """Accelerations (4, n) of the rigid rotor from 5 to 32 rev/s, stepped in time, and its speed."""
    import scipy.linalg

    dt, n = 1 / 256, int(256 * seconds)
    fine = 4  # steps within a sample
    h, t = dt / fine, dt / fine * np.arange(n * fine)
    rate = 27.0 / seconds
    omega, theta = 2 * np.pi * (5.0 + rate * t), 2 * np.pi * (5.0 * t + rate * t**2 / 2)
    course = omega[:, None] ** 2 * unbalance * np.exp(1j * theta[:, None])
    force = np.stack([course.real, sense * course.imag], axis=2).reshape(len(t), 4)
    K = np.diag([ky * K_Y, kz * K_Z, 1.1 * ky * K_Y, 1.1 * kz * K_Z])
    Mi = np.linalg.inv(MASS)
    A = np.block([[np.zeros((4, 4)), np.eye(4)], [-Mi @ K, -beta * Mi @ K]])
    B = np.vstack([np.zeros((4, 4)), Mi])
    # forces straight between steps: the exact step of the extended system
    big = scipy.linalg.expm(np.block([[A * h, B * h, 0 * B], [np.zeros((4, 12)), np.eye(4)], [np.zeros((4, 16))]]))
    E, G1, G2 = big[:8, :8], big[:8, 8:12], big[:8, 12:]
    x, found = np.zeros(8), np.empty((len(t), 8))
    drive = force[:-1] @ (G1 - G2).T + force[1:] @ G2.T
    found[0] = x
    for i, push in enumerate(drive):
        x = E @ x + push
        found[i + 1] = x
    a = (found @ A[4:].T + force @ Mi.T)[::fine].T
    a = a + noise * np.random.default_rng(5).standard_normal(a.shape)
    return TimeData("run", dt, a, channels(RIGID)), Speed(t[::fine], 5.0 + rate * t[::fine], theta[::fine], "known")
