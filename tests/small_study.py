"""A study small enough to be diagnosed in seconds: a cantilever in the X-Z plane, shaken at its tip.

The truth is the same deck with another modulus and, where wanted, a spring to ground; it is simulated with all of its
modes by the exact step of linear systems. Recordings are band-limited random forces and the accelerations with noise.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from femend import Channel, Dof, TimeData, _core, functions_of, write_uff
from femend.diagnose.deciding.outcome import Diagnosis
from femend.diagnose.fitting.candidates import Candidate
from femend.diagnose.fitting.terms import Term
from femend.diagnose.locating.joint import open_joint
from femend.diagnose.locating.locate import Located
from femend.diagnose.locating.split import split_records
from femend.diagnose.naming.judge import Given, to_beat
from femend.diagnose.naming.ranked import Ranked
from femend.diagnose.settings import Settings
from femend.diagnose.several.pairs import Searched
from femend.diagnose.several.together import Scored, fitted_together
from femend.diagnose.updating.update import UpdatedModel, update_model
from femend.estimate import fit_records, pair_test
from femend.model import Model, Parameter, read_model
from femend.model.places.places import find_places
from femend.physics import physics
from femend.study import load_study
from femend.study.result.study_run import StudyRun
from femend.study.run import diagnose

Array = NDArray[np.float64]

RATE, SECONDS, UPSAMPLING = 512.0, 2.0, 32
BAND = (8.0, 150.0)
ZETA, NOISE = 0.012, 0.01
SENSORS, SHAKER = (4, 7, 10, 13), 13
LEVELS = {"low": ("fit", 2.0), "high": ("fit", 5.0), "held": ("validate", 4.0), "asked": ("predict", 4.0)}
PARAMETERS = (Parameter("E_root", "E", "material", (1,)), Parameter("E_tip", "E", "material", (2,)))

STUDY = """format = "femend-study/1"
title = "cantilever"
[model]
file = "model.bdf"
units = "SI"
[damping]
ratio = 0.01
"""


def deck(E: tuple[float, float] = (7e10, 7e10), more: tuple[str, ...] = (), held: str = "123456") -> str:
    """A cantilever of 12 bars, 0.72 m, two halves of different height, a lump at node 9; motion in X, Z and RY.

    `held` are the components that its clamp at node 1 holds, `more` further cards.
    """
    lines = ["SOL 103", "CEND", "SPC = 1", "BEGIN BULK", "PARAM,COUPMASS,1"]
    lines += [f"MAT1,{i + 1},{E[i]:.8e},,0.33,2700." for i in range(2)]
    lines += ["PBAR,1,1,3.3-4,3.3275-9,2.475-8,1.0-8", "PBAR,2,2,2.85-4,2.1434-9,2.1375-8,8.-9"]
    lines += [f"GRID,{n},,{0.06 * (n - 1):.3f},0.,0." for n in range(1, 14)]
    lines += [f"CBAR,{n},{1 if n <= 6 else 2},{n},{n + 1},0.,0.,1." for n in range(1, 13)]
    lines += ["CONM2,100,9,,0.1", f"SPC1,1,{held},1", "SPC1,1,246,2,THRU,13", *more, "ENDDATA", ""]
    return "\n".join(lines)


def cantilever(folder: Path) -> tuple[Model, NDArray[np.int64]]:
    """The cantilever as a model with the study's parameters, and the rows (n_out,) of its sensors in the g-set."""
    path = folder / "model.bdf"
    path.write_text(deck())
    model = read_model(path, parameters=PARAMETERS)
    return model, np.array([6 * model.index(node) + 2 for node in SENSORS])


@dataclass
class Truth:
    """What the deck does not know."""

    E: tuple[float, float] = (7e10, 7e10)
    more: tuple[str, ...] = ()
    held: str = "123456"
    laws: list[tuple[int, str, dict[str, float]]] = field(default_factory=list)
    sine: tuple[int, float, float] | None = None
    """Node, frequency (Hz) and amplitude (N) of a force in Z that no recording holds, begun a period after each."""


def dense_modes(model: Model) -> tuple[Array, Array]:
    """omega (n_a,) and modes on the g-set (n_g, n_a) of a small supported model."""
    K, M = (a.toarray() for a in model.matrices())
    mu, x = scipy.linalg.eigh(M, K)
    omega = 1 / np.sqrt(np.maximum(mu[::-1], 1e-30))
    x = x[:, ::-1]
    return omega, np.asarray(model.transformation() @ (x / np.sqrt(np.einsum("ij,ij->j", x, M @ x))))


def force(level: float, seed: int, n: int) -> Array:
    """Random force (n,) limited to the band, from rest and back to it."""
    freq = np.fft.rfftfreq(n, 1 / RATE)
    line = np.random.default_rng(seed).standard_normal((2, freq.size))
    spectrum = np.where((freq > BAND[0]) & (freq < BAND[1]), line[0] + 1j * line[1], 0)
    u = np.fft.irfft(spectrum, n) * np.minimum(1, np.minimum(np.arange(n), np.arange(n)[::-1]) / 20)
    return level * u / u.std()


def respond(folder: Path, truth: Truth, u: Array) -> Array:
    """Accelerations (n_out, n) of the truth in Z at the sensors."""
    path = folder / "truth.bdf"
    path.write_text(deck(truth.E, truth.more, truth.held))
    model = read_model(path)
    path.unlink()
    omega, phi = dense_modes(model)
    keep = omega < 2 * np.pi * 2000
    rows = [6 * model.index(node) + 2 for node in SENSORS]
    w = np.array([phi[6 * model.index(node) + 2, keep] for node, _, _ in truth.laws]).reshape(-1, int(keep.sum()))
    zeta = np.full(int(keep.sum()), ZETA)
    laws = [[(name, values)] for _, name, values in truth.laws]
    n = len(u)
    # beyond the end, too, where a recorder's filter looks
    fine = np.fft.irfft(np.fft.rfft(u, 2 * n), 2 * n * UPSAMPLING)[: (n + 16) * UPSAMPLING] * UPSAMPLING
    inputs, forces = [SHAKER], [fine]
    if truth.sine is not None:
        node, freq, amplitude = truth.sine
        t = np.arange(len(fine)) / RATE / UPSAMPLING
        inputs.append(node)
        forces.append(amplitude * np.sin(2 * np.pi * freq * t) * (t > 1 / freq))
    into = phi[[6 * model.index(node) + 2 for node in inputs]][:, keep]
    y = _core.simulate(
        omega[keep], zeta, into, phi[rows][:, keep], w, laws, np.array(forces), 1 / RATE / UPSAMPLING,
        decimate=UPSAMPLING,
    )[0]  # fmt: skip
    return np.asarray(y)[:, :n]


def recording(name: str, u: Array, y: Array | None, rate: float = RATE) -> TimeData:
    """Force at the shaker and, where there are any, accelerations at the sensors."""
    channels = [Channel(Dof(SHAKER, 3), "force", "N")]
    values = [u]
    if y is not None:
        channels += [Channel(Dof(node, 3), "acceleration", "m/s^2") for node in SENSORS]
        values += list(y)
    return TimeData(name, 1 / rate, np.array(values), tuple(channels))


def study_text(recordings: dict[str, str], parameters: tuple[Parameter, ...] = PARAMETERS) -> str:
    """study.toml of recordings by name and role."""
    text = STUDY
    for p in parameters:
        text += f'[[parameter]]\nname = "{p.name}"\nproperty = "{p.property}"\nmaterial = {p.ids[0]}\n'
    for name, role in recordings.items():
        text += f'[[recording]]\nname = "{name}"\nfile = "{name}.uff"\nrole = "{role}"\n'
    return text


def write_unrecorded(folder: Path, tables: str, parameters: tuple[Parameter, ...] = PARAMETERS) -> Path:
    """Deck and study.toml, with further `tables`, of the cantilever without any recording; the path of the last."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "model.bdf").write_text(deck())
    path = folder / "study.toml"
    path.write_text(study_text({}, parameters) + tables)
    return path


def write_study(folder: Path, truth: Truth) -> Path:
    """Deck, recordings and study.toml of a truth; the path of the last."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "model.bdf").write_text(deck())
    n = int(RATE * SECONDS)
    for i, (name, (role, level)) in enumerate(LEVELS.items()):
        u = force(level, 10 + i, n)
        y = respond(folder, truth, u)
        noise = np.random.default_rng(50 + i).standard_normal(y.shape) * NOISE * y.std(axis=1, keepdims=True)
        data = recording(name, u, None if role == "predict" else y + noise)
        write_uff(folder / f"{name}.uff", functions_of(data))
    path = folder / "study.toml"
    path.write_text(study_text({name: role for name, (role, _) in LEVELS.items()}))
    return path


def diagnosed(folder: Path, truth: Truth) -> StudyRun:
    """The run of a study in `folder` with the recordings of a truth."""
    found = diagnose(write_study(folder, truth))
    assert isinstance(found, StudyRun)
    return found


def searched(d: Diagnosis, ranked: Sequence[Ranked] | None = None) -> Searched:
    """What the search for more effects begins with: the laws of a diagnosis, or others."""
    return Searched(
        d.problem, d.reduced, d.g_rows, d.split, find_places(d.reduced.model), d.located,
        d.ranked if ranked is None else ranked, d.settings, d.n_values, d.null_score, 0.0,
    )  # fmt: skip


def searched_without_laws(start: UpdatedModel) -> Searched:
    """What the search for more effects begins with where no law was named."""
    split = split_records(start.problem, start.null, [])
    alone = to_beat(Given(split, start.reduced, start.g_rows, start.null.p, Settings()), start.null)
    places = find_places(start.reduced.model)
    return Searched(start.problem, start.reduced, start.g_rows, split, places, [], [], Settings(), alone.n_values,
                    alone.score, 0.0)  # fmt: skip


def laws_together(first: Searched, start: UpdatedModel, *laws: tuple[str, int, float]) -> Scored:
    """Laws of one parameter to the ground in Z (name, node, size), fitted together."""
    terms = []
    for law, node, size in laws:
        place = next(p for p in first.places if p.kind == "ground" and p.nodes == (node,) and p.direction == "Z")
        joint = open_joint(place, first.reduced, first.problem.band[1], first.g_rows)
        values, x = {physics(law).parameter_names[0]: size}, np.log([size])
        candidate = Candidate(physics(law), law, joint, values, start.null.p, x, 1, 0.0, 1.0, 1.0)
        terms.append(Term(candidate, Located(place, start.null, 0.0)))
    found = fitted_together(first, terms, start.null.p)
    assert found is not None
    return found


def updated(folder: Path, truth: Truth) -> UpdatedModel:
    """The deck in `folder`, updated on the fit recordings of a truth."""
    return updated_on(write_study(folder, truth))


def updated_on(path: Path) -> UpdatedModel:
    """The deck updated on the fit recordings of the study at `path`."""
    study = load_study(path)
    model = read_model(study.model_file, parameters=list(PARAMETERS))
    test = study.read_recordings()
    used = [r for r in test if r.role == "fit"]
    return update_model(model, fit_records(used, model, pair_test(test, model)), 0.01)
