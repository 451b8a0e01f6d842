"""Small studies for correlation, updating and pretest: the cantilever of `small_study`, tested with FRFs or modes.

The truth is the same deck with other moduli; its FRFs are those of all its modes up to 2 kHz with noise.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import small_study
from femend import Channel, Dof, functions_of, read_model, write_uff
from femend.analysis.frf import modal_frf
from femend.analysis.model_modes import model_modes
from femend.data import FRF, IdentifiedModes
from femend.io import UniversalFile
from femend.io.uff import modes_55
from femend.io.uff.geometry import Nodes

Array = NDArray[np.float64]
SENSORS = (3, 5, 7, 9, 11, 13)
TRUE_E = (7.7e10, 6.6e10)
ZETA = 0.01
TABLES = """
[correlation]
band = [5.0, 400.0]
"""


@dataclass(frozen=True)
class Recorded:
    """One recording: its `name`, `role`, shaker node, and the mass added at a node (its configuration)."""

    name: str
    role: str = "fit"
    shaker: int = 13
    mass: tuple[int, float] | None = None


RECORDINGS = (Recorded("tip"), Recorded("middle", "validate", 9), Recorded("asked", "predict"))


def measured_frf(
    folder: Path,
    tested: Recorded,
    noise: float = 0.01,
    E: tuple[float, float] = TRUE_E,
    sensors: tuple[int, ...] = SENSORS,
    even: bool = False,
) -> FRF:
    """Accelerances of the truth at the `sensors` in Z to a force at the shaker, with noise: a share of every FRF, or
    `even`, a share of all."""
    path = folder / "truth.bdf"
    path.write_text(small_study.deck(E))
    truth = read_model(path)
    if tested.mass is not None:
        from femend.model import read_model as read

        truth = read(path, added_mass=[tested.mass])
    path.unlink()
    modes = model_modes(truth, f_max=2000.0, zeta=ZETA)
    outputs = [Channel(Dof(n, 3), "acceleration", "m/s^2") for n in sensors]
    clean = modal_frf(modes, np.arange(1.0, 420.0, 0.25), outputs, [Channel(Dof(tested.shaker, 3), "force", "N")])
    rng = np.random.default_rng(len(tested.name))
    size = noise * np.sqrt(np.mean(np.abs(clean.H) ** 2, axis=None if even else 0, keepdims=True)) / np.sqrt(2)
    H = clean.H + size * (rng.standard_normal(clean.H.shape) + 1j * rng.standard_normal(clean.H.shape))
    return FRF(tested.name, clean.freq, H, clean.outputs, clean.inputs, clean.kind, clean.unit)


def study_text(recordings: tuple[Recorded, ...], tables: str = TABLES) -> str:
    """study.toml of recordings, with a configuration "loaded" where one has a mass."""
    text = small_study.study_text({})
    masses = [t.mass for t in recordings if t.mass is not None]
    if masses:
        node, m = masses[0]
        text += f'[[configuration]]\nname = "loaded"\nadded_mass = [{{ node = {node}, m = {m} }}]\n'
    for t in recordings:
        text += f'[[recording]]\nname = "{t.name}"\nfile = "{t.name}.uff"\nrole = "{t.role}"\n'
        text += 'configuration = "loaded"\n' if t.mass is not None else ""
    return text + tables


def write_study(folder: Path, recordings: tuple[Recorded, ...] = RECORDINGS, tables: str = TABLES) -> Path:
    """Deck, FRFs and study.toml in `folder`; the path of the last."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "model.bdf").write_text(small_study.deck())
    for tested in recordings:
        write_uff(folder / f"{tested.name}.uff", functions_of(measured_frf(folder, tested)))
    path = folder / "study.toml"
    path.write_text(study_text(recordings, tables))
    return path


def write_modes(
    path: Path,
    freq: Array,
    phi: Array,
    dofs: tuple[Dof, ...],
    zeta: float = ZETA,
    places: dict[int, tuple[float, float, float]] | None = None,
) -> None:
    """Modes as data sets 55, with the coordinates of their nodes where they are given."""
    omega = 2 * np.pi * np.asarray(freq)
    poles = -zeta * omega + 1j * omega * np.sqrt(1 - zeta**2)
    modes = IdentifiedModes(dofs, poles, np.asarray(phi, dtype=np.complex128))
    nodes: tuple[Nodes, ...] = ()
    if places:
        ids = np.array(list(places))
        nodes = (Nodes(ids, np.array(list(places.values()), dtype=float), np.zeros((len(ids), 2), dtype=np.int64)),)
    write_uff(path, UniversalFile(str(path), nodes=nodes, modes=tuple(modes_55(modes))))
