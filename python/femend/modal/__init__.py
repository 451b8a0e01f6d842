"""Modal tests: FRFs to poles, shapes and modal masses, each with how well it is known."""

from __future__ import annotations

from femend.modal.checks import SensorCheck, driving_point_checks, reciprocity_checks, rigid_body_check, swap_check
from femend.modal.choose import DroppedMode
from femend.modal.identify import identify_modes
from femend.modal.indicators import cmif, mif, mpc, mpd
from femend.modal.lsfd import ModalFit, fit_residues, synthesise
from femend.modal.plscf import PoleTable, plscf_poles
from femend.modal.refine import RefinedModes, refine_modes
from femend.modal.result import ModalTest
from femend.modal.scaling import DrivingPoint, driving_points, scale_by_driving_points
from femend.modal.stabilisation import PoleCluster, Stabilisation, stabilise
from femend.modal.visibility import UnseenMode, unseen_modes

__all__ = [
    "DrivingPoint",
    "DroppedMode",
    "ModalFit",
    "ModalTest",
    "PoleCluster",
    "PoleTable",
    "RefinedModes",
    "SensorCheck",
    "Stabilisation",
    "UnseenMode",
    "cmif",
    "driving_point_checks",
    "driving_points",
    "fit_residues",
    "identify_modes",
    "mif",
    "mpc",
    "mpd",
    "plscf_poles",
    "reciprocity_checks",
    "refine_modes",
    "rigid_body_check",
    "scale_by_driving_points",
    "stabilise",
    "swap_check",
    "synthesise",
    "unseen_modes",
]
