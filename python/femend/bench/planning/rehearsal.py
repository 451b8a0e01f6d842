"""The planned test rehearsed on the model: FRFs with noise, identified and updated on as real ones would be."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from femend.bench.planning.places import Targets
from femend.dof import Dof
from femend.errors import FemendError
from femend.estimate.updating import Unknowns, deck_system, limits, unknowns_of
from femend.model import Model
from femend.pretest import VirtualTest, virtual_test
from femend.study.file.study import Study

__all__ = ["rehearse"]

# a model of more DOFs is not rehearsed on, since a dozen solutions would take minutes
LARGEST = 20_000
# lines per half-power band of the lowest target, and the most that are taken
LINES_A_BAND, MOST_LINES = 5.0, 20_000
# the lines reach so far beyond the targets
BELOW, BEYOND = 0.7, 1.1


def rehearse(
    study: Study, model: Model, targets: Targets, sensors: Sequence[Dof], exciters: Sequence[Dof]
) -> tuple[VirtualTest | None, str]:
    """The virtual test of a plan, and why there is none where there is none.

    The structure is the model at factors and amplitudes drawn from the priors (within one and a half deviations and the
    bounds) with the seed of [pretest]; exciters measure their own acceleration.
    """
    if not (model.parameters or model.morphs):
        return None, "there is no [[parameter]] that could be found again"
    if model.fe.n_a > LARGEST:
        return None, f"the model has {model.fe.n_a} DOFs; it is rehearsed up to {LARGEST}"
    s = study.pretest
    unknowns = unknowns_of(model)
    seen = tuple(dict.fromkeys([*sensors, *exciters]))
    rows = {d.unsigned: i for i, d in enumerate(seen)}
    seen = tuple(d for i, d in enumerate(seen) if rows[d.unsigned] == i)
    at = {d.unsigned: i for i, d in enumerate(seen)}
    low, high = BELOW * float(targets.freq.min()), BEYOND * float(targets.freq.max())
    step = 2 * study.damping_ratio * float(targets.freq.min()) / LINES_A_BAND
    n = int(min((high - low) / step + 1, MOST_LINES))
    try:
        found = virtual_test(
            deck_system(model, seen, targets.modes.n_modes),
            unknowns,
            _truth(unknowns, s.seed),
            seen,
            [at[d.unsigned] for d in exciters],
            np.linspace(low, high, max(n, 64)),
            zeta=study.damping_ratio,
            noise=s.noise,
            shape_sd=s.shape_sd,
            seed=s.seed,
        )
    except FemendError as error:
        return None, str(error)
    return found, found.note


def _truth(unknowns: Unknowns, seed: int) -> NDArray[np.float64]:
    """Values (n,) that the structure could have."""
    rng = np.random.default_rng(seed)
    sd = np.array([u.sd for u in unknowns.items])
    p = unknowns.mean + sd * rng.uniform(-1.5, 1.5, len(unknowns))
    lower, upper = limits(unknowns)
    return unknowns.values(np.clip(p, lower, upper))
