"""Thresholds of the staged diagnosis, one set for every study."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["StagedSettings"]


@dataclass(frozen=True, slots=True)
class StagedSettings:
    """Every threshold with its meaning.

    What no model explains (relative 1-sigma) is added to the noise of the data: `model_freq` of frequencies,
    `model_zeta` of damping ratios, `model_shape` of shapes (largest component 1), `model_frf` of FRFs, `model_run` of
    the envelope of a run. `weight_frf`, `weight_run`, `weight_modes`: what a value counts, since neighbouring lines,
    samples and sensors carry the same model error.

    From stage to stage the structure is mounted anew and seen otherwise: `drift` of parameters, `drift_idealised` of
    what decks simplify and of terms, `drift_damping` of damping is added to what the stage before settled; `loose` is
    the drift of parameters in the rival that blames them alone.

    A term is taken when the evidence, divided by what the best model leaves above its noise, rises by `gain` and the
    squares fall by the share `drop`, in a run also by the share `share` of what is left above the noise. Identified
    modes that parameters explain to `enough` squares per value lack nothing: one that is paired otherwise moves a tenth
    of all squares. `form` is the relative deviation that a finding's values carry for the form of the model, beside
    their estimated one. At most `most_places` nodes of sensors are tried as places of masses and springs; of
    `most_screened` others the `most_fitted` masses, and as many springs, that promise most to first order.
    """

    model_freq: float = 0.002
    model_zeta: float = 0.05
    model_shape: float = 0.02
    model_frf: float = 0.01
    model_run: float = 0.03
    weight_frf: float = 0.25
    weight_run: float = 0.1
    weight_modes: float = 0.25
    drift: float = 0.01
    drift_idealised: float = 0.05
    drift_damping: float = 0.2
    loose: float = 0.3
    gain: float = 12.0
    drop: float = 0.05
    share: float = 0.4
    enough: float = 1.3
    form: float = 0.01
    adequate: float = 6.0
    most_places: int = 40
    most_screened: int = 150
    most_fitted: int = 6
    rounds: int = 3
