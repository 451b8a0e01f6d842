"""The updating problem of a study: what its recordings measured, weighed, against its deck in each configuration."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from femend.analysis.model_modes import model_modes
from femend.bench.counted import Counted
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
    unknowns_of,
)
from femend.study.study import Study

if TYPE_CHECKING:
    from femend.bench.correlate import Prepared

__all__ = ["study_problem"]

FloatArray = NDArray[np.float64]

# the model gives modes up to this multiple of the highest measured one, and so many more
ABOVE, MORE = 1.5, 2
# 1-sigma of the logarithm of damping that the study states as a starting value
DAMPING_SD = 1.0


def study_problem(prepared: Prepared, counted: Sequence[Counted]) -> Problem:
    """The problem of `femend.estimate.updating` over what is `counted`: the study's parameters and morphs with their
    priors, and damping where damping or FRFs are compared.

    Raises StudyError for a study without either, and UpdatingError where FRFs are to be compared and no recording
    to fit has any.
    """
    study = prepared.study
    if not study.parameters and not study.updating.morph:
        raise StudyError(
            f"{study.file}: there is no [[parameter]]; an update needs at least one that may change, or an "
            "[[updating.morph]]",
            key="parameter",
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
    freq = np.concatenate([c.freq if c.freq.size or c.frf is None else c.frf.freq for c in counted])
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
    # FRFs alone need no modes of the model
    top = float(c.freq.max(initial=0.0))
    n_modes = model_modes(model, f_max=ABOVE * top).n_modes + MORE if top else 0
    system = deck_system(
        model,
        [places[d] for d in sensors],
        min(max(n_modes, c.freq.size + MORE), model.fe.n_a) if top else 0,
        shapes="shapes" in responses or "mac" in responses,
        frfs=frfs,
        damping="damping" in responses,
    )
    test = ModeTest(c.freq, phi) if top else None
    return Configuration(c.name, system, tuple(_responses(c, study, phi, phi_sd)), test)


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
        elif c.frf is not None and c.frf_sd is not None:
            found.append(FrfDifferences(c.frf.H, c.frf_sd, "logarithm"))
    return found
