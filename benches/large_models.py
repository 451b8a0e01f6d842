"""Decks of about 100 000 DOFs with one concealed effect, and recordings of them by another route than the diagnosis.

The recordings are those of the deck with the effect as a card in it and other values of its parameters: modes of
scipy's ARPACK, a damping ratio that grows with frequency, modal superposition from rest at sixteen times the recorded
rate with the static response of the modes left out, and noise.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.signal import cont2discrete, lfilter
from scipy.sparse.linalg import LinearOperator, eigsh

from femend import _core
from femend.data import Channel, TimeData
from femend.dof import Dof
from femend.io.uff import functions_of, write_uff
from femend.model import Model, Parameter, read_model

FloatArray = NDArray[np.float64]

# samples of a recording, and how much finer the simulation is
SAMPLES, FINER = 4096, 16
# recorded rate over the highest frequency excited, and the modes simulated over it
RATE, MODES_ABOVE = 3.0, 3.0


@dataclass(frozen=True)
class Variant:
    """A deck's cards, the card concealed, true factors of its parameters, what has to be found, sensors and forces."""

    name: str
    cards: list[str]
    concealed: str
    physics: str
    node: int
    parameters: tuple[Parameter, ...]
    factors: dict[str, float]
    sensors: list[Dof]
    forces: list[Dof]


def panel(n_x: int, n_y: int, sensors: int, seed: int) -> Variant:
    """A steel panel of 2.4 x 1.6 m, stiffened both ways, clamped along one edge; a mass is concealed on its skin."""
    node = lambda i, j: 1 + i * (n_y + 1) + j  # noqa: E731
    x, y = np.linspace(0, 2.4, n_x + 1), np.linspace(0, 1.6, n_y + 1)
    cards = [
        "MAT1,1,2.1+11,,0.3,7850.",
        "MAT1,2,2.1+11,,0.3,7850.",
        "PSHELL,1,1,0.003,1,,1",
        "PBAR,2,2,6.0-4,4.5-8,1.0-7,8.0-8",
    ]
    cards += [f"GRID,{node(i, j)},,{x[i]:.6f},{y[j]:.6f},0." for i in range(n_x + 1) for j in range(n_y + 1)]
    cards += [f"SPC1,1,123456,{node(0, j)}" for j in range(n_y + 1)]
    eid = 0
    for i in range(n_x):
        for j in range(n_y):
            eid += 1
            cards.append(f"CQUAD4,{eid},1,{node(i, j)},{node(i + 1, j)},{node(i + 1, j + 1)},{node(i, j + 1)}")
    along = [(node(i, j), node(i + 1, j)) for j in _spread(n_y, 5) for i in range(n_x)]
    across = [(node(i, j), node(i, j + 1)) for i in _spread(n_x, 7) for j in range(n_y)]
    for a, b in [*along, *across]:
        eid += 1
        cards.append(f"CBAR,{eid},2,{a},{b},0.,0.,1.")
    rng = np.random.default_rng(seed)
    at = rng.choice([node(i, j) for i in range(2, n_x + 1) for j in range(n_y + 1)], sensors + 3, replace=False)
    hidden = node(round(0.71 * n_x), round(0.37 * n_y))
    return Variant(
        "panel", cards, f"CONM2,{eid + 1},{hidden},,1.2", "added_mass", hidden,
        (Parameter("E_skin", "E", "material", (1,), 0.1), Parameter("E_stiffeners", "E", "material", (2,), 0.1)),
        {"E_skin": 1.04, "E_stiffeners": 0.95},
        [Dof(int(n), 3) for n in at[:sensors]], [Dof(int(at[-1]), 3)],
    )  # fmt: skip


def tower(bays: int, storeys: int, parts: int, sensors: int, seed: int) -> Variant:
    """A steel tower of `bays` x `bays` bays, members of `parts` elements; a spring to ground is concealed at a joint.

    `sensors` stand at joints, two forces are recorded.
    """
    cards = [
        "MAT1,1,2.1+11,,0.3,7850.",
        "MAT1,2,2.1+11,,0.3,7850.",
        "PBAR,1,1,0.02,3.0-4,2.0-4,3.0-4",
        "PBAR,2,2,0.01,1.5-4,5.0-5,1.0-4",
    ]
    joint = {
        (i, j, k): 1 + n
        for n, (k, i, j) in enumerate(np.ndindex(storeys + 1, bays + 1, bays + 1))
    }  # fmt: skip
    where = {n: np.array([6.0 * i, 5.0 * j, 3.5 * k]) for (i, j, k), n in joint.items()}
    members = [
        (n, joint[to], 1 if step == (0, 0, 1) else 2)
        for (i, j, k), n in joint.items()
        for step in ((0, 0, 1), (1, 0, 0), (0, 1, 0))
        if (to := (i + step[0], j + step[1], k + step[2])) in joint and (k > 0 or step[2])
    ]
    bars: list[str] = []
    for a, b, pid in members:
        chain = [a]
        for part in range(1, parts):
            new = len(where) + 1
            where[new] = where[a] + (where[b] - where[a]) * part / parts
            chain.append(new)
        chain.append(b)
        v = "1.,0.,0." if pid == 1 else "0.,0.,1."
        bars += [f"CBAR,{len(bars) + 1 + n},{pid},{p},{q},{v}" for n, (p, q) in enumerate(pairwise(chain))]
    cards += [f"GRID,{n},,{x[0]:.5f},{x[1]:.5f},{x[2]:.5f}" for n, x in where.items()]
    cards += [f"SPC1,1,123456,{n}" for (_, _, k), n in joint.items() if k == 0]
    cards += bars
    # floors: a lump at every joint above the ground
    cards += [f"CONM2,{len(bars) + n},{n},,2000." for (_, _, k), n in joint.items() if k > 0]
    rng = np.random.default_rng(seed)
    above = [n for (_, _, k), n in joint.items() if k > 0]
    at = rng.choice(above, sensors, replace=False)
    hidden = joint[(round(0.7 * bays), round(0.3 * bays), round(0.6 * storeys))]
    top = [joint[(0, bays, storeys)], joint[(bays, bays // 2, storeys // 2)]]
    return Variant(
        "tower", cards, f"CELAS2,{len(bars) + len(where)},4.0+7,{hidden},1", "support_stiffness", hidden,
        (Parameter("E_columns", "E", "material", (1,), 0.1), Parameter("E_beams", "E", "material", (2,), 0.1)),
        {"E_columns": 1.04, "E_beams": 0.95},
        [Dof(int(n), 1 + i % 2) for i, n in enumerate(at)], [Dof(top[0], 1), Dof(top[1], 2)],
    )  # fmt: skip


def _spread(n: int, count: int) -> list[int]:
    """Mesh lines 0 ... n of `count` stiffeners, evenly spread."""
    return [round(n * (i + 1) / (count + 1)) for i in range(count)]


def write_study(variant: Variant, folder: Path, n_band: int, noise: float, seed: int) -> Path:
    """Writes deck, recordings and study.toml to `folder`; `n_band` modes lie in the band excited. Returns the study."""
    folder.mkdir(parents=True, exist_ok=True)
    _deck(folder / "model.bdf", variant.cards)
    _deck(folder / "true.bdf", [*variant.cards, variant.concealed])
    true = read_model(folder / "true.bdf", units="SI", parameters=variant.parameters)
    system = _Modes.of(true, variant, n_band)
    rng = np.random.default_rng(seed)
    for name, level in (("low", 1.0), ("high", 4.0), ("random", 2.0)):
        write_uff(folder / f"{name}.uff", functions_of(system.recording(name, level, noise, rng), single=True))
    lines = ['format = "femend-study/1"', f'title = "{variant.name}"', 'model = { file = "model.bdf", units = "SI" }']
    lines += ["damping = { ratio = 0.01 }", "parameter = ["]
    lines += [
        f'  {{ name = "{p.name}", property = "{p.property}", material = {p.ids[0]}, prior_sd = {p.prior_sd} }},'
        for p in variant.parameters
    ]
    lines += ["]", "recording = ["]
    for name, role in (("low", "fit"), ("high", "fit"), ("random", "validate")):
        lines.append(f'  {{ name = "{name}", file = "{name}.uff", role = "{role}", excitation = "measured" }},')
    study = folder / "study.toml"
    study.write_text("\n".join([*lines, "]", ""]), encoding="utf-8")
    return study


def _deck(path: Path, cards: list[str]) -> None:
    text = ["SOL 103", "CEND", "SPC = 1", "BEGIN BULK", *cards, "ENDDATA", ""]
    path.write_text("\n".join(text), encoding="utf-8")


@dataclass(frozen=True)
class _Modes:
    """Modes at sensors (n_out, n_modes) and forces (n_in, n_modes), what the other modes answer with statically
    (n_out, n_in), and the highest frequency excited, Hz."""

    variant: Variant
    omega: FloatArray
    zeta: FloatArray
    out: FloatArray
    into: FloatArray
    residual: FloatArray
    top: float

    @classmethod
    def of(cls, true: Model, variant: Variant, n_band: int) -> _Modes:
        K, M = true.matrices(variant.factors)
        T = true.transformation().tocsr()
        forces = T[[true.row(d) for d in variant.forces]]
        sensors = T[[true.row(d) for d in variant.sensors]]
        solver = _factor(K)
        inverse = LinearOperator(K.shape, matvec=lambda b: solver.solve(b.reshape(-1, 1)).ravel(), dtype=np.float64)
        n = 2 * n_band
        while True:
            n = min(2 * n, K.shape[0] - 2)
            square, phi = eigsh(K, n, M, sigma=0.0, OPinv=inverse)
            omega = np.sqrt(square)
            top = 1.02 * omega[n_band - 1]
            if omega[-1] > MODES_ABOVE * top or n >= 8 * n_band:
                break
        out, into = np.asarray(sensors @ phi), np.asarray(forces @ phi)
        static = sensors @ solver.solve(np.ascontiguousarray(forces.T.toarray()))
        residual = np.asarray(static) - (out / square) @ into.T
        zeta = 0.006 + 0.006 * np.minimum(omega / top, 1.0)
        return cls(variant, omega, zeta, out, into, residual, top / (2 * np.pi))

    def recording(self, name: str, level: float, noise: float, rng: np.random.Generator) -> TimeData:
        """Accelerations from rest under random forces in the band, noise as a share of every channel's RMS."""
        n, dt = SAMPLES * FINER, 1 / (RATE * self.top * FINER)
        freq = np.fft.rfftfreq(n, dt)
        spectrum = rng.standard_normal((len(self.into), len(freq))) + 1j * rng.standard_normal(
            (len(self.into), len(freq))
        )
        spectrum[:, (freq > self.top) | (freq < 0.5 * self.omega[0] / (2 * np.pi))] = 0.0
        start = np.minimum(np.arange(n) / (0.02 * n), 1.0)
        force = np.fft.irfft(spectrum, n) * np.sin(0.5 * np.pi * start) ** 2
        force *= 100.0 * level / force.std()
        modal = self.into.T @ force
        y = self.residual @ np.gradient(np.gradient(force, dt, axis=1), dt, axis=1)[:, ::FINER]
        for m, (w, z) in enumerate(zip(self.omega, self.zeta, strict=True)):
            b, a, _ = cont2discrete(([1.0, 0.0, 0.0], [1.0, 2 * z * w, w * w]), dt, "foh")
            y += np.outer(self.out[:, m], lfilter(b.ravel(), a, modal[m])[::FINER])
        y += noise * np.sqrt((y**2).mean(axis=1, keepdims=True)) * rng.standard_normal(y.shape)
        channels = [Channel(d, "force", "N") for d in self.variant.forces]
        channels += [Channel(d, "acceleration", "m/s^2") for d in self.variant.sensors]
        return TimeData(name, dt * FINER, np.vstack([force[:, ::FINER], y]), tuple(channels))


def _factor(K: Any) -> Any:
    """A factor of K with `solve`; scipy's own ordering makes the one of a tower outgrow the memory."""
    K = K.tocsc()
    K.sort_indices()
    return _core.Factor(K.indptr.astype(np.int64), K.indices.astype(np.int64), K.data)
