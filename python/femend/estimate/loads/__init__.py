"""Loads as unknowns: forces by inverting FRFs, motion of the supports, pressures, and which of them explains better."""

from femend.estimate.loads.compare import LoadRival, LoadsCompared, compare_loads
from femend.estimate.loads.contributions import Contributions, contributions
from femend.estimate.loads.credible import credible_lines
from femend.estimate.loads.from_model import ModelSide, configured_responses, model_side
from femend.estimate.loads.history import LoadHistory, load_history
from femend.estimate.loads.identify import Loads, identify_loads
from femend.estimate.loads.regularise import Regularised, regularised_lines
from femend.estimate.loads.unit_responses import UnitResponses, from_frf

__all__ = [
    "Contributions",
    "LoadHistory",
    "LoadRival",
    "Loads",
    "LoadsCompared",
    "ModelSide",
    "Regularised",
    "UnitResponses",
    "compare_loads",
    "configured_responses",
    "contributions",
    "credible_lines",
    "from_frf",
    "identify_loads",
    "load_history",
    "model_side",
    "regularised_lines",
]
