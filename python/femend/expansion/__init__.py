"""A model reduced to measured DOFs, and measured shapes expanded to all DOFs."""

from femend.expansion.craig_bampton import craig_bampton
from femend.expansion.dynamic_residual import DynamicResidual, DynamicStiffness, energy_norm
from femend.expansion.expand import LeftOut, expand_dynamic, leave_one_out
from femend.expansion.reductions import Reduction, dynamic, guyan, hybrid, irs, serep
from femend.expansion.residual import ResidualExpansion, expand_residual, residual_forms

__all__ = [
    "DynamicResidual",
    "DynamicStiffness",
    "LeftOut",
    "Reduction",
    "ResidualExpansion",
    "craig_bampton",
    "dynamic",
    "energy_norm",
    "expand_dynamic",
    "expand_residual",
    "guyan",
    "hybrid",
    "irs",
    "leave_one_out",
    "residual_forms",
    "serep",
]
