"""Measured FRFs with the models' curves over them, for the report."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from femend.data.bands import within_band
from femend.report.content import FrfOverlay
from femend.study.result.predictions import STAGES, Prediction

if TYPE_CHECKING:
    from femend.study.result.study_run import StudyRun

__all__ = ["measured_frf_overlays"]

# pairs of output and input that are drawn, and lines a curve at most
PAIRS, DRAWN = 9, 1500


def measured_frf_overlays(run: StudyRun) -> tuple[FrfOverlay, ...]:
    """Every FRF of the fit recordings, then of the others, in the band of the diagnosis; the final model is drawn apart
    from the updated one where something was added to it."""
    order = sorted((p for p in run.predictions if p.frf is not None), key=lambda p: p.role != "fit")
    drawn = STAGES if run.diagnosis.best is not None or run.diagnosis.by_load else STAGES[:2]
    return tuple(overlay for p in order for overlay in _overlays(p, drawn))[:PAIRS]


def _overlays(prediction: Prediction, drawn: tuple[str, ...]) -> list[FrfOverlay]:
    frf = prediction.frf
    if frf is None:
        return []
    inside = np.flatnonzero(within_band(frf.freq, prediction.band))
    inside = inside[:: max(1, -(-len(inside) // DRAWN))]
    return [
        FrfOverlay(
            frf.freq[inside],
            frf.H[inside, i, j],
            label=f"{frf.kind} {out.dof} / {into.dof}",
            recording=prediction.name,
            unit=frf.unit,
            **{stage: prediction.stages[stage][inside, i, j] for stage in drawn},
        )
        for j, into in enumerate(frf.inputs)
        for i, out in enumerate(frf.outputs)
    ]
