"""A deck with its parameters and terms; a change gives a new model."""

from femend.model.form_errors import FormErrors, form_errors
from femend.model.model import Model, Parameter, model_of, read_model
from femend.model.pairing import Pair, Pairing, pair_sensors
from femend.model.places import Place, find_places
from femend.model.reduction import ReducedModel, Term, reduce_model

__all__ = [
    "FormErrors",
    "Model",
    "Pair",
    "Pairing",
    "Parameter",
    "Place",
    "ReducedModel",
    "Term",
    "find_places",
    "form_errors",
    "model_of",
    "pair_sensors",
    "read_model",
    "reduce_model",
]
