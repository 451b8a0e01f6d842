"""The pictures of the field, one file each: functions that draw on matplotlib Axes.

matplotlib is imported when something is drawn, not before. `figure` and `paper_style` give the sizes of a publication.
"""

from __future__ import annotations

from femend.report.plots.campbell import draw_campbell
from femend.report.plots.dac_matrix import draw_dac
from femend.report.plots.field_view import draw_field
from femend.report.plots.force_spectra import OmegaLaw, draw_force_spectra, fit_omega_law
from femend.report.plots.frf_overlay import draw_frf
from femend.report.plots.mac_matrix import draw_mac
from femend.report.plots.mismatch_view import draw_mismatch
from femend.report.plots.posterior_view import draw_posterior
from femend.report.plots.residual_view import draw_residual
from femend.report.plots.scatter_view import draw_scatter
from femend.report.plots.sensitivity_image import draw_sensitivity
from femend.report.plots.shape_view import draw_shape, motion_of_model, motion_of_nodes
from femend.report.plots.signature import draw_signature
from femend.report.plots.stabilisation import STATUSES, draw_stabilisation
from femend.report.plots.strength_view import draw_l_curve, draw_traces
from femend.report.plots.style import figure, paper_style
from femend.report.plots.waterfall import draw_waterfall
from femend.report.plots.whirl_map import draw_whirl

__all__ = [
    "STATUSES",
    "OmegaLaw",
    "draw_campbell",
    "draw_dac",
    "draw_field",
    "draw_force_spectra",
    "draw_frf",
    "draw_l_curve",
    "draw_mac",
    "draw_mismatch",
    "draw_posterior",
    "draw_residual",
    "draw_scatter",
    "draw_sensitivity",
    "draw_shape",
    "draw_signature",
    "draw_stabilisation",
    "draw_traces",
    "draw_waterfall",
    "draw_whirl",
    "figure",
    "fit_omega_law",
    "motion_of_model",
    "motion_of_nodes",
    "paper_style",
]
