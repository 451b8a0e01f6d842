"""What a self-test takes from the user's study: forces, sensors and noise of the recordings, model and priors."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from femend.data import Channel, Recording, Test
from femend.errors import StudyError
from femend.estimate import pair_test
from femend.estimate.bands import used_band
from femend.estimate.noise import noise_of
from femend.estimate.prepare import fit_records, period_of
from femend.model import Model, Pairing, affordable_refinement, read_model
from femend.model.reduced.dashpots import damped_dofs
from femend.numerals import listed
from femend.study import Study

__all__ = ["Plan", "Replay", "file_name", "read_plan", "study_text"]

FloatArray = NDArray[np.float64]
_ORDER = {"displacement": 0, "velocity": 1, "acceleration": 2}


@dataclass(frozen=True, eq=False)
class Replay:
    """A recording that is replayed: forces u (n_in, n) at step `dt` with their channels, the sensors with rows and
    signs on the g-set, the order of derivative and the noise (n_out,) of each."""

    name: str
    dt: float
    u: FloatArray
    forces: tuple[Channel, ...]
    sensors: tuple[Channel, ...]
    in_rows: NDArray[np.int64]
    in_signs: FloatArray
    out_rows: NDArray[np.int64]
    out_signs: FloatArray
    order: NDArray[np.int64]
    noise: FloatArray


@dataclass(frozen=True, eq=False)
class Plan:
    """A user's test to be repeated on concealed truths: study, model, recordings and band (Hz)."""

    study: Study
    model: Model
    replays: tuple[Replay, ...]
    band: tuple[float, float]

    @property
    def loudest(self) -> Replay:
        """The recording with the largest force."""
        return max(self.replays, key=lambda r: float(np.mean(r.u**2)))


def read_plan(study: Study) -> Plan:
    """The plan of a study.

    Raises StudyError where no fit recording is a time record with measured force, where they have several
    configurations, or where the deck has dashpots, and the errors of the readers.
    """
    used = _replayable(study, study.read_recordings())
    configuration = study.configuration(used[0].configuration)
    model = read_model(study.model_file, units=study.units, parameters=study.parameters, spc=configuration.spc)
    _without_dashpots(study, model)
    pairing = pair_test(Test(tuple(used)), model)
    band = used_band(fit_records(used, model, pairing))
    # a diagnosis refines a coarse mesh: a structure as coarse as the deck would be wrong to it
    model = affordable_refinement(model, band[1]) or model
    return Plan(study, model, tuple(_replay(r, model, pairing) for r in used), band)


def _without_dashpots(study: Study, model: Model) -> None:
    """Raises StudyError where the deck has dashpots: structures are drawn with damping ratios of modes alone, and would
    lack what a diagnosis takes to be there."""
    rows = damped_dofs(model)
    if rows.size:
        nodes = sorted({int(model.node_ids[row // 6]) for row in rows})
        raise StudyError(
            f"{study.file}: {study.model_file.name} has dashpots (at nodes {listed(nodes, 6)}), which the structures "
            "that a self-test draws do not have; take them out of a copy of the deck (CDAMP1 to 4, B of PBUSH) and run "
            "the self-test with that",
            key="model.file",
        )


def _replayable(study: Study, test: Test) -> list[Recording]:
    """The fit recordings whose forces can be replayed."""
    fit = [r for r in test if r.role == "fit"]
    used = [r for r in fit if r.is_time and r.excitation == "measured" and r.force is not None]
    if not used:
        found = ", ".join(f"{r.name!r} ({_kind(r)})" for r in fit)
        raise StudyError(
            f"{study.file}: a self-test replays the forces of the fit recordings, and none is a time record with "
            f'measured force: {found}; add a recording with its force channel, excitation = "measured" and '
            'role = "fit"',
            key="recording",
        )
    configurations = {r.configuration for r in used}
    if len(configurations) > 1:
        raise StudyError(
            f"{study.file}: the fit recordings have {len(configurations)} configurations "
            f"({', '.join(sorted(configurations))}); a self-test repeats one: leave the recordings of the others out",
            key="recording",
        )
    return used


def _kind(recording: Recording) -> str:
    if not recording.is_time:
        return "frequency response functions" if recording.inputs else "spectra"
    return f'excitation = "{recording.excitation}"'


def _replay(recording: Recording, model: Model, pairing: Pairing) -> Replay:
    force, response = recording.force, recording.response
    assert force is not None
    assert response is not None
    into, out = ([pairing[c.dof].dof for c in data.channels if c.dof is not None] for data in (force, response))
    u, y = np.array(force.values), np.array(response.values)
    return Replay(
        recording.name,
        force.dt,
        u,
        force.channels,
        response.channels,
        np.array([model.row(d) for d in into]),
        np.array([float(d.sign) for d in into]),
        np.array([model.row(d) for d in out]),
        np.array([float(d.sign) for d in out]),
        np.array([_ORDER[c.quantity] for c in response.channels]),
        noise_of(u, y, period_of(u)),
    )


def study_text(plan: Plan, title: str, folder: Path) -> str:
    """study.toml of a case: the user's model and parameters, and a universal file below `folder` per recording."""
    study = plan.study
    q = _quoted
    out = ['format = "femend-study/1"', f"title = {q(title)}", "", "[model]"]
    out += [f"file = {q(str(study.model_file))}", f"units = {q(study.units)}"]
    out += ["", "[damping]", f"ratio = {study.damping_ratio!r}"]
    for p in study.parameters:
        ids = list(p.ids) if p.target == "elements" else p.ids[0]
        out += ["", "[[parameter]]", f"name = {q(p.name)}", f"property = {q(p.property)}", f"{p.target} = {ids}"]
        out.append(f"prior_sd = {p.prior_sd!r}")
        if p.bounds is not None:
            out.append(f"bounds = [{float(p.bounds[0])!r}, {float(p.bounds[1])!r}]")
    used = next(r for r in study.recordings if r.name == plan.replays[0].name).configuration
    for c in study.configurations:
        if c.name == used:
            out += ["", "[[configuration]]", f"name = {q(c.name)}"]
            out += [f"spc = {c.spc}"] if c.spc is not None else []
    named = any(c.name == used for c in study.configurations)
    for r in plan.replays:
        out += ["", "[[recording]]", f"name = {q(r.name)}", f"file = {q(str(folder / file_name(plan, r)))}"]
        out += ['role = "fit"', 'excitation = "measured"'] + ([f"configuration = {q(used)}"] if named else [])
    return "\n".join([*out, ""])


def file_name(plan: Plan, replay: Replay) -> str:
    """File of a replayed recording inside its case."""
    return f"recording{1 + plan.replays.index(replay)}.uff"


def _quoted(text: str) -> str:
    """A TOML basic string."""
    escaped = text.replace("\\", "\\\\").replace('"', '\\"')
    return '"' + "".join(c if c >= " " else f"\\u{ord(c):04x}" for c in escaped) + '"'
