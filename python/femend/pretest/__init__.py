"""Planning a test on the model: target modes, sensors, exciters, and what the test would tell."""

from femend.pretest.dashpots import JointTest, Plan, dashpot_test
from femend.pretest.distinguish import Distinction, candidate_matrices, distinguish
from femend.pretest.elimination import iterative_guyan, mac_elimination
from femend.pretest.exciters import (
    ExciterChoice,
    driving_point_residues,
    exciters,
    mode_indicator,
    suspension_points,
)
from femend.pretest.information import ParameterForecast, PlannedTest, planned_test
from femend.pretest.mass_loading import MassLoading, mass_loading
from femend.pretest.parameter_sensors import parameter_sensors
from femend.pretest.placement import Placement, effective_independence, qr_placement
from femend.pretest.supports import GivingSupport, support_modes, with_state
from femend.pretest.targets import TargetModes, TargetRow, energy_fractions, target_modes
from femend.pretest.virtual_test import VirtualTest, virtual_frf, virtual_test

__all__ = [
    "Distinction",
    "ExciterChoice",
    "GivingSupport",
    "JointTest",
    "MassLoading",
    "ParameterForecast",
    "Placement",
    "Plan",
    "PlannedTest",
    "TargetModes",
    "TargetRow",
    "VirtualTest",
    "candidate_matrices",
    "dashpot_test",
    "distinguish",
    "driving_point_residues",
    "effective_independence",
    "energy_fractions",
    "exciters",
    "iterative_guyan",
    "mac_elimination",
    "mass_loading",
    "mode_indicator",
    "parameter_sensors",
    "planned_test",
    "qr_placement",
    "support_modes",
    "suspension_points",
    "target_modes",
    "virtual_frf",
    "virtual_test",
    "with_state",
]
