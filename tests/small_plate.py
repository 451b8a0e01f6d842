"""A plate on supports that may give way."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from femend import Channel, Dof, TimeData, functions_of, write_uff
from femend.model import Model, Parameter, Place, find_places, read_model
from small_study import NOISE, RATE, SECONDS, STUDY, ZETA, dense_modes, force

Array = NDArray[np.float64]
SHAKER, SENSORS = 46, (17, 31, 46, 59, 64, 74, 87, 92)
LEVELS = {"low": ("fit", 2.0), "high": ("fit", 5.0), "held": ("validate", 4.0)}
NX, NY, SIDE = 12, 8, 0.025
CORNERS = (1, 13, 105, 117)


def mesh(side: float = SIDE, turn: float = 0.0) -> list[str]:
    """Cards of the nodes and shells of a plate whose elements are squares of a `side`, turned about Z."""
    c, s = np.cos(turn), np.sin(turn)
    lines = []
    for j in range(NY + 1):
        for i in range(NX + 1):
            x, y = side * i, side * j
            lines.append(f"GRID,{1 + i + (NX + 1) * j},,{c * x - s * y:.5f},{s * x + c * y:.5f},0.")
    for j in range(NY):
        for i in range(NX):
            n = 1 + i + (NX + 1) * j
            lines.append(f"CQUAD4,{1 + i + NX * j},1,{n},{n + 1},{n + NX + 2},{n + NX + 1}")
    return lines


def plate(
    folder: Path,
    held: tuple[int, ...],
    more: str = "",
    parameters: tuple[Parameter, ...] = (),
    thickness: float = 0.003,
) -> Model:
    """A plate on its corners; in-plane motion held everywhere, as for a plate that bends."""
    lines = ["SOL 103", "CEND", "SPC = 1", "BEGIN BULK", "PARAM,COUPMASS,1", "MAT1,1,7.+10,,0.33,2700."]
    lines += [f"PSHELL,1,1,{thickness},1,,1"]
    lines += mesh()
    lines += [f"SPC1,1,126,1,THRU,{(NX + 1) * (NY + 1)}", *(f"SPC1,1,3,{n}" for n in held)]
    lines += [*([more] if more else []), "ENDDATA", ""]
    path = folder / "plate.bdf"
    path.write_text("\n".join(lines))
    return read_model(path, parameters=parameters)


def supports(model: Model) -> list[Place]:
    return [p for p in find_places(model) if p.kind == "support"]


def respond(model: Model, u: Array) -> Array:
    """Accelerations (n_out, n) in Z at the sensors under a force (n,) at the shaker, from rest."""
    omega, phi = dense_modes(model)
    keep = omega < 2 * np.pi * 5 * RATE
    omega, phi = omega[keep], phi[:, keep]
    rows = [6 * model.index(node) + 2 for node in SENSORS]
    n = 4 * len(u)
    s = 2j * np.pi * np.fft.rfftfreq(n, 1 / RATE)
    modal = s**2 / (s**2 + 2 * ZETA * omega[:, None] * s + omega[:, None] ** 2)
    H = phi[rows] @ (phi[6 * model.index(SHAKER) + 2][:, None] * modal)
    return np.asarray(np.fft.irfft(H * np.fft.rfft(u, n), n)[:, : len(u)])


def write_study(folder: Path, real: Model, ratio: float = 0.01, thickness: float = 0.003) -> Path:
    """Deck of the plate on its corners, of that damping ratio and one modulus, recordings of the `real` one and
    study.toml; the path of the last."""
    plate(folder, CORNERS, thickness=thickness)
    study = STUDY.replace("model.bdf", "plate.bdf").replace("ratio = 0.01", f"ratio = {ratio}")
    study += '[[parameter]]\nname = "E"\nproperty = "E"\nmaterial = 1\n'
    dofs = [Dof(node, 3) for node in SENSORS]
    channels = (Channel(Dof(SHAKER, 3), "force", "N"), *(Channel(dof, "acceleration", "m/s^2") for dof in dofs))
    for i, (name, (role, level)) in enumerate(LEVELS.items()):
        u = force(level, 10 + i, int(RATE * SECONDS))
        y = respond(real, u)
        y = y + np.random.default_rng(50 + i).standard_normal(y.shape) * NOISE * y.std(axis=1, keepdims=True)
        write_uff(folder / f"{name}.uff", functions_of(TimeData(name, 1 / RATE, np.vstack([u, y]), channels)))
        study += f'[[recording]]\nname = "{name}"\nfile = "{name}.uff"\nrole = "{role}"\n'
    path = folder / "study.toml"
    path.write_text(study)
    return path
