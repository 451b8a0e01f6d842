"""The updating problem of a study: what its recordings measured, weighed, against its deck in each configuration."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from femend.analysis.model_modes import model_modes
from femend.bench.measured import MeasuredModes
from femend.data import FRF, ModeSet
from femend.dof import Dof
from femend.errors import StudyError, UpdatingError
from femend.estimate.updating import (
    Configuration,
    DampingRatios,
    Frequencies,
    FrfDifferences,
    Frfs,
    MacDifferences,
    ModeTest,
    Problem,
    Response,
    ShapeDifferences,
    Unknown,
    deck_system,
    scatter_of,
    unknowns_of,
)
from femend.study.study import Study

if TYPE_CHECKING:
    from femend.bench.correlate import Prepared

__all__ = ["Counted", "counted_modes", "study_problem"]

FloatArray = NDArray[np.float64]

# the model gives modes up to this multiple of the highest measured one, and so many more
ABOVE, MORE = 1.5, 2
# 1-sigma of the logarithm of damping that the study states as a starting value
DAMPING_SD = 1.0


@dataclass(frozen=True, eq=False)
class Counted:
    """The modes that count in one configuration of the problem: `freq`, `zeta` (n_modes,), `phi` (n_dof, n_modes) with
    largest component 1, and their deviations, floors included. `numbers` are those of the recording, from 1; `sources`
    the recordings; `frf` FRFs on the lines that count, None where none do."""

    name: str
    configuration: str
    dofs: tuple[Dof, ...]
    numbers: tuple[int, ...]
    freq: FloatArray
    freq_sd: FloatArray
    zeta: FloatArray
    zeta_sd: FloatArray
    phi: FloatArray
    phi_sd: FloatArray
    sources: tuple[str, ...]
    frf: FRF | None = None


def counted_modes(prepared: Prepared) -> tuple[Counted, ...]:
    """What the recordings with role fit measured, one entry each, or one for several that repeat one test.

    Raises StudyError for a mode number that a recording does not have, and UpdatingError where repetitions are asked
    for and there are none.
    """
    study = prepared.study
    fit = [m for m in prepared.measured if m.role == "fit"]
    if not study.updating.repeated:
        return tuple(_counted(m, study) for m in fit)
    groups: dict[tuple[str, frozenset[Dof]], list[MeasuredModes]] = {}
    for m in fit:
        groups.setdefault((m.configuration, frozenset(d.unsigned for d in m.modes.dofs)), []).append(m)
    if all(len(g) == 1 for g in groups.values()):
        raise UpdatingError(
            f"[updating] repeated = true, but none of the {len(fit)} recordings to fit repeats another one's sensors "
            "in its configuration; leave it out, or give the repetitions the same sensors"
        )
    return tuple(_counted(g[0], study) if len(g) == 1 else _repeated(g, study) for g in groups.values())


def _counted(m: MeasuredModes, study: Study) -> Counted:
    s = study.updating
    test = m.modes.to_mode_set()
    size = np.abs(test.phi).max(axis=0)
    phi = test.phi / size
    at = _selected(m.name, test, study)
    shape_sd = np.full(phi.shape, s.shape_sd)
    if m.shape_sd is not None:
        shape_sd = np.hypot(shape_sd, np.nan_to_num(m.shape_sd / np.abs(m.modes.shapes).max(axis=0)))
    freq_sd = np.hypot(_known(m.modes.freq_sd, test.freq), s.freq_sd * test.freq)
    zeta_sd = np.hypot(_known(m.modes.zeta_sd, test.freq), s.damping_sd * np.maximum(test.zeta, 1e-4))
    return Counted(
        m.name, m.configuration, m.modes.dofs, tuple(int(i) + 1 for i in at), test.freq[at], freq_sd[at],
        test.zeta[at], zeta_sd[at], phi[:, at], shape_sd[:, at], (m.name,), _frf(m, study),
    )  # fmt: skip


def _repeated(group: Sequence[MeasuredModes], study: Study) -> Counted:
    """Several tests of one configuration: their mean, with the deviation of the mean."""
    s = study.updating
    found = scatter_of([m.modes.to_mode_set() for m in group], mac_min=study.correlation.mac_min).of_mean()
    name = " + ".join(m.name for m in group)
    at = _selected(name, ModeSet(found.freq, found.zeta, found.phi, found.dofs, "max"), study)
    freq_sd = np.hypot(np.nan_to_num(found.freq_sd), s.freq_sd * found.freq)
    zeta_sd = np.hypot(np.nan_to_num(found.zeta_sd), s.damping_sd * np.maximum(found.zeta, 1e-4))
    shape_sd = np.hypot(np.nan_to_num(found.phi_sd), s.shape_sd)
    return Counted(
        name, group[0].configuration, found.dofs, tuple(int(i) + 1 for i in at), found.freq[at], freq_sd[at],
        found.zeta[at], zeta_sd[at], found.phi[:, at], shape_sd[:, at], tuple(m.name for m in group),
        _frf(group[0], study),
    )  # fmt: skip


def _selected(name: str, test: ModeSet, study: Study) -> NDArray[np.int64]:
    wanted = study.updating.modes
    if wanted is None:
        return np.arange(test.n_modes)
    lacking = [n for n in wanted if n > test.n_modes]
    if lacking:
        raise StudyError(
            f"{study.file}: updating.modes: mode {lacking[0]} is wanted and recording {name!r} shows {test.n_modes} "
            f"(up to {test.freq[-1]:.4g} Hz); `femend correlate` numbers them",
            key="updating.modes",
        )
    return np.array(wanted, dtype=np.int64) - 1


def _frf(m: MeasuredModes, study: Study) -> FRF | None:
    """The lines of the measured FRFs that count, even over the band."""
    if "frfs" not in study.updating.responses or m.frf is None:
        return None
    at = np.unique(np.linspace(0, m.frf.n_freq - 1, study.updating.frf_lines).round().astype(np.int64))
    f = m.frf
    return FRF(f.name, f.freq[at], f.H[at], f.outputs, f.inputs, f.kind, f.unit)


def _known(sd: FloatArray | None, freq: FloatArray) -> FloatArray:
    """Deviations with 0 where they are not known."""
    return np.zeros(freq.size) if sd is None else np.nan_to_num(sd)


def study_problem(prepared: Prepared, counted: Sequence[Counted]) -> Problem:
    """The problem of `femend.estimate.updating` over what is `counted`: the study's parameters with their priors, and
    damping where damping or FRFs are compared.

    Raises StudyError for a study without parameters, and UpdatingError where FRFs are to be compared and no recording
    to fit has any.
    """
    study = prepared.study
    if not study.parameters:
        raise StudyError(
            f"{study.file}: there is no [[parameter]]; an update needs at least one that may change", key="parameter"
        )
    responses = study.updating.responses
    if "frfs" in responses and all(c.frf is None for c in counted):
        raise UpdatingError(
            "[updating] responses has 'frfs', and no recording to fit holds FRFs; leave it out or add a recording"
        )
    unknowns = unknowns_of(prepared.models.of(counted[0].configuration))
    if "damping" in responses or "frfs" in responses:
        unknowns = unknowns.extended(_damping(study, counted))
    configurations = tuple(_configuration(prepared, c) for c in counted)
    return Problem(unknowns, configurations, study.correlation.mac_min)


def _damping(study: Study, counted: Sequence[Counted]) -> list[Unknown]:
    """Unknowns of the damping about the study's ratio; the proportional ones have half of it each at the middle of the
    measured frequencies."""
    zeta = study.damping_ratio
    if study.updating.damping_model == "loss factor":
        return [Unknown("eta", 2 * zeta, sd=DAMPING_SD)]
    freq = np.concatenate([c.freq for c in counted])
    omega = 2 * np.pi * float(np.exp(np.log(freq).mean()))
    return [
        Unknown("alpha", zeta * omega, sd=DAMPING_SD, unit="1/s"),
        Unknown("beta", zeta / omega, sd=DAMPING_SD, unit="s"),
    ]


def _configuration(prepared: Prepared, c: Counted) -> Configuration:
    study, model = prepared.study, prepared.models.of(c.configuration)
    responses = study.updating.responses
    places = prepared.placed.places
    extra = () if c.frf is None else (*c.frf.output_dofs, *c.frf.input_dofs)
    sensors = tuple(dict.fromkeys([*c.dofs, *(d for d in extra if d is not None)]))
    phi = np.full((len(sensors), c.freq.size), np.nan)
    phi[: len(c.dofs)] = c.phi
    phi_sd = np.ones(phi.shape)
    phi_sd[: len(c.dofs)] = c.phi_sd
    frfs = None
    if c.frf is not None:
        rows = [[sensors.index(d) for d in side if d is not None] for side in (c.frf.output_dofs, c.frf.input_dofs)]
        frfs = Frfs(c.frf.freq, tuple(rows[0]), tuple(rows[1]), c.frf.kind)
    n_modes = model_modes(model, f_max=ABOVE * float(c.freq.max())).n_modes + MORE
    system = deck_system(
        model,
        [places[d] for d in sensors],
        min(max(n_modes, c.freq.size + MORE), model.fe.n_a),
        shapes="shapes" in responses or "mac" in responses,
        frfs=frfs,
        damping="damping" in responses,
    )
    return Configuration(c.name, system, tuple(_responses(c, study, phi, phi_sd)), ModeTest(c.freq, phi))


def _responses(c: Counted, study: Study, phi: FloatArray, phi_sd: FloatArray) -> list[Response]:
    found: list[Response] = []
    for name in study.updating.responses:
        if name == "frequencies":
            found.append(Frequencies(c.freq, c.freq_sd))
        elif name == "shapes":
            found.append(ShapeDifferences(phi, phi_sd))
        elif name == "mac":
            found.append(MacDifferences(phi, np.full(c.freq.size, study.updating.shape_sd)))
        elif name == "damping":
            found.append(DampingRatios(c.zeta, c.zeta_sd))
        elif c.frf is not None:
            found.append(FrfDifferences(c.frf.H, np.full(c.frf.H.shape, study.updating.frf_sd), "logarithm"))
    return found
