"""Updating a model on measured modes, FRFs and static values: parameters, responses, estimators."""

from femend.estimate.updating.command import Command
from femend.estimate.updating.deck_back import UpdatedDeck, updated_deck
from femend.estimate.updating.dense import DenseSystem
from femend.estimate.updating.design import design
from femend.estimate.updating.external import ExternalSystem
from femend.estimate.updating.frf_responses import CrossOrthogonality, FracDifferences, FrfDifferences
from femend.estimate.updating.history import Iteration, read_history
from femend.estimate.updating.matrices import AffineMatrices, DeckMatrices, affine_matrices
from femend.estimate.updating.mean_shapes import mean_shapes
from femend.estimate.updating.modal import ModalSystem, deck_system, modal_system
from femend.estimate.updating.modal_damping import DampingRatios
from femend.estimate.updating.morphed import MorphedMatrices
from femend.estimate.updating.multistart import Minimum, MultiStart, StartsInterrupted, multi_start
from femend.estimate.updating.ods_responses import OdsDifferences
from femend.estimate.updating.order_responses import OrderDifferences
from femend.estimate.updating.population import Population, update_population
from femend.estimate.updating.problem import Configuration, Evaluation, Link, ModeTest, Problem
from femend.estimate.updating.reduce import Reduction, basis_of_modes, reduced_problem, reduced_system
from femend.estimate.updating.requests import Frfs, Statics, Whirls
from femend.estimate.updating.responses import Frequencies, MacDifferences, Response, ShapeDifferences, Values
from femend.estimate.updating.result import ModeRow, ParameterRow, UpdateResult
from femend.estimate.updating.rotor_system import RotorSystem, rotor_system
from femend.estimate.updating.sampling import Posterior, sample
from femend.estimate.updating.scatter import Scatter, scatter_of
from femend.estimate.updating.sensitivity import Collinear, Sensitivity, collinear_groups, sensitivities
from femend.estimate.updating.speed_terms import SpeedCurve, SpeedTerm, bearing_term, disc_term
from femend.estimate.updating.state import State, System
from femend.estimate.updating.surface import ResponseSurface, Sobol, response_surface, sobol
from femend.estimate.updating.tikhonov import Regularised, tikhonov
from femend.estimate.updating.unknown import amplitude, factor, factors_of, limits, smooth, spans, unknowns_of
from femend.estimate.updating.update import update
from femend.estimate.updating.whirl_responses import WhirlFrequencies
from femend.model.terms.linear_terms import SpeedPower
from femend.model.terms.unknowns import Unknown, Unknowns

__all__ = [
    "AffineMatrices",
    "Configuration",
    "CrossOrthogonality",
    "DampingRatios",
    "DeckMatrices",
    "DenseSystem",
    "Evaluation",
    "FracDifferences",
    "Frequencies",
    "FrfDifferences",
    "Frfs",
    "Iteration",
    "Link",
    "MacDifferences",
    "ModalSystem",
    "ModeRow",
    "ModeTest",
    "MorphedMatrices",
    "OdsDifferences",
    "OrderDifferences",
    "ParameterRow",
    "Problem",
    "ShapeDifferences",
    "State",
    "Statics",
    "System",
    "Unknown",
    "Unknowns",
    "UpdateResult",
    "Values",
    "affine_matrices",
    "amplitude",
    "basis_of_modes",
    "deck_system",
    "factor",
    "factors_of",
    "limits",
    "mean_shapes",
    "modal_system",
    "read_history",
    "smooth",
    "spans",
    "unknowns_of",
    "update",
    "Command",
    "UpdatedDeck",
    "updated_deck",
    "design",
    "ExternalSystem",
    "Minimum",
    "MultiStart",
    "multi_start",
    "Population",
    "update_population",
    "Reduction",
    "reduced_problem",
    "reduced_system",
    "Posterior",
    "sample",
    "scatter_of",
    "Collinear",
    "Sensitivity",
    "StartsInterrupted",
    "collinear_groups",
    "sensitivities",
    "Response",
    "Scatter",
    "ResponseSurface",
    "Sobol",
    "response_surface",
    "sobol",
    "Regularised",
    "tikhonov",
    "RotorSystem",
    "rotor_system",
    "SpeedCurve",
    "SpeedPower",
    "SpeedTerm",
    "bearing_term",
    "disc_term",
    "WhirlFrequencies",
    "Whirls",
]
