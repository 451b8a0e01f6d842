"""Where the linear model is wrong by the energy of its residual, and which parameters could remove it."""

from femend.diagnose.residual.residual_energy import residual_energy
from femend.diagnose.residual.residual_parameters import rank_parameters

__all__ = ["rank_parameters", "residual_energy"]
