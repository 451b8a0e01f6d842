"""The updating problem of a study: what its recordings measured, weighed, against its deck in each configuration."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from femend.analysis.model_modes import model_modes
from femend.bench.reading.fields import smoothed
from femend.bench.reading.links import linked_unknowns, links_in
from femend.bench.updating.counted import Counted
from femend.bench.updating.counted_runs import CountedRun, run_configuration
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
    System,
    Unknown,
    Unknowns,
    deck_system,
    unknowns_of,
)
from femend.study.file.study import Study

if TYPE_CHECKING:
    from femend.bench.reading.prepared import Prepared

__all__ = ["study_problem"]

FloatArray = NDArray[np.float64]

# the model gives modes up to this multiple of the highest measured one, and so many more
ABOVE, MORE = 1.5, 2
# 1-sigma of the logarithm of damping that the study states as a starting value
DAMPING_SD = 1.0


def study_problem(prepared: Prepared, counted: Sequence[Counted], runs: Sequence[CountedRun] = ()) -> Problem:
    """The problem of `femend.estimate.updating` over what is `counted` and the orders of `runs`, whose configurations
    come last: the study's parameters, fields and morphs with their priors and links, and damping where damping, FRFs
    or orders are compared.

    Raises StudyError for a study without either, and UpdatingError where FRFs are to be compared and no recording
    to fit has any.
    """
    study = prepared.study
    if prepared.solver is None and not (study.parameters or study.updating.morph or study.updating.field):
        raise StudyError(
            f"{study.file}: there is no [[parameter]]; an update needs at least one that may change, or an "
            "[[updating.morph]] or [[updating.field]]",
            key="parameter",
        )
    responses = study.updating.responses
    if "frfs" in responses and all(c.frf is None for c in counted):
        raise UpdatingError(
            "[updating] responses has 'frfs', and no recording to fit holds FRFs; leave it out or add a recording"
        )
    unknowns = _unknowns(prepared, [*(c.configuration for c in counted), *(r.measured.configuration for r in runs)])
    if "damping" in responses or "frfs" in responses or runs:
        unknowns = unknowns.extended(_damping(study, counted, runs))
    seen = _seen(prepared, counted)
    configurations = tuple(_configuration(study, c, s) for c, s in zip(counted, seen, strict=True))
    turned = tuple(
        replace(run_configuration(prepared, r), links=links_in(study, r.measured.configuration)) for r in runs
    )
    return Problem(unknowns, (*configurations, *turned), study.correlation.mac_min)


def _unknowns(prepared: Prepared, tested: Sequence[str]) -> Unknowns:
    """What may change in the deck of configurations that were `tested`, or in the input of a solver."""
    if prepared.solver is not None:
        return prepared.solver.unknowns
    study, model = prepared.study, prepared.models.of(tested[0])
    return smoothed(linked_unknowns(study, unknowns_of(model), tested), model, study.updating.field)


def _damping(study: Study, counted: Sequence[Counted], runs: Sequence[CountedRun]) -> list[Unknown]:
    """Unknowns of the damping about the study's ratio; the proportional ones have half of it each at the middle of the
    measured frequencies."""
    zeta = study.damping_ratio
    if study.updating.damping_model == "loss factor":
        return [Unknown("eta", 2 * zeta, sd=DAMPING_SD)]
    measured = [c.freq if c.freq.size or c.frf is None else c.frf.freq for c in counted]
    freq = np.concatenate([*measured, *(r.shapes.freq for r in runs)])
    omega = 2 * np.pi * float(np.exp(np.log(freq).mean()))
    return [
        Unknown("alpha", zeta * omega, sd=DAMPING_SD, unit="1/s"),
        Unknown("beta", zeta / omega, sd=DAMPING_SD, unit="s"),
    ]


@dataclass(frozen=True, eq=False)
class _Seen:
    """A `system` and the `sensors` that its rows are."""

    system: System
    sensors: tuple[Dof, ...]


def _seen(prepared: Prepared, counted: Sequence[Counted]) -> list[_Seen]:
    """The system of each of the `counted`: one for all recordings of a configuration, which is solved once for all of
    them, but those with FRFs, whose lines are their own."""
    if prepared.solver is not None:
        return [_Seen(prepared.solver.system, prepared.solver.sensors) for _ in counted]
    found: dict[str, _Seen] = {}
    out = []
    for c in counted:
        if c.frf is not None:
            out.append(_system(prepared, [c]))
            continue
        if c.configuration not in found:
            group = [o for o in counted if o.configuration == c.configuration and o.frf is None]
            found[c.configuration] = _system(prepared, group)
        out.append(found[c.configuration])
    return out


def _system(prepared: Prepared, group: Sequence[Counted]) -> _Seen:
    """The model of the configuration that the `group` has in common, at all its sensors."""
    model, responses = prepared.models.of(group[0].configuration), prepared.study.updating.responses
    places, frf = prepared.placed.places, group[0].frf
    extra = () if frf is None else (*frf.output_dofs, *frf.input_dofs)
    sensors = tuple(dict.fromkeys([*(d for c in group for d in c.dofs), *(d for d in extra if d is not None)]))
    frfs = None
    if frf is not None:
        rows = [[sensors.index(d) for d in side if d is not None] for side in (frf.output_dofs, frf.input_dofs)]
        frfs = Frfs(frf.freq, tuple(rows[0]), tuple(rows[1]), frf.kind)
    # FRFs alone need no modes of the model
    top = max(float(c.freq.max(initial=0.0)) for c in group)
    n_modes = model_modes(model, f_max=ABOVE * top).n_modes + MORE if top else 0
    least = max(c.freq.size for c in group) + MORE
    system = deck_system(
        model,
        [places[d] for d in sensors],
        min(max(n_modes, least), model.fe.n_a) if top else 0,
        shapes="shapes" in responses or "mac" in responses,
        frfs=frfs,
        damping="damping" in responses,
    )
    return _Seen(system, sensors)


def _configuration(study: Study, c: Counted, seen: _Seen) -> Configuration:
    """What was `counted`, on the rows of its system; sensors of other recordings were not there."""
    rows = [seen.sensors.index(d) for d in c.dofs]
    phi = np.full((len(seen.sensors), c.freq.size), np.nan)
    phi[rows] = c.phi
    phi_sd = np.ones(phi.shape)
    phi_sd[rows] = c.phi_sd
    test = ModeTest(c.freq, phi, numbers=c.numbers) if c.freq.size else None
    links = links_in(study, c.configuration)
    return Configuration(c.name, seen.system, tuple(_responses(c, study, phi, phi_sd)), test, links)


def _mac_sd(c: Counted, shape_sd: float) -> FloatArray:
    """Deviations (n_modes,) of (1 - sqrt(MAC)) / sqrt(MAC): what is stated of shapes, and in squares what the noise of
    the test takes of it, half the share of noise in the squares of a shape."""
    noise = np.maximum(c.phi_sd**2 - shape_sd**2, 0.0).sum(axis=0)
    return np.asarray(np.hypot(shape_sd, 0.5 * noise / np.maximum((c.phi**2).sum(axis=0), 1e-300)))


def _responses(c: Counted, study: Study, phi: FloatArray, phi_sd: FloatArray) -> list[Response]:
    found: list[Response] = []
    for name in study.updating.responses:
        if name == "frequencies":
            found.append(Frequencies(c.freq, c.freq_sd))
        elif name == "shapes":
            found.append(ShapeDifferences(phi, phi_sd))
        elif name == "mac":
            found.append(MacDifferences(phi, _mac_sd(c, study.updating.shape_sd)))
        elif name == "damping":
            found.append(DampingRatios(c.zeta, c.zeta_sd))
        elif c.frf is not None and c.frf_sd is not None:
            found.append(FrfDifferences(c.frf.H, c.frf_sd, "logarithm", noise=c.frf_noise, floor=c.frf_floor))
    return found
