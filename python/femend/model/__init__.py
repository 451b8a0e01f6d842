"""A deck with its parameters and terms; a change gives a new model."""

from femend.model.geometry.morph import Morph
from femend.model.geometry.moved import amplitude_limits
from femend.model.known_mesh import MeshError
from femend.model.mesh.form_errors import FormErrors, form_errors
from femend.model.mesh.mesh_error import affordable_refinement, mesh_error
from femend.model.model import Model, model_of, read_model
from femend.model.pairing import Pair, Pairing, pair_sensors
from femend.model.parameter import Parameter
from femend.model.places.gap_places import gap_places
from femend.model.places.places import Place, find_places
from femend.model.reduced.reduction import ReducedModel, Term, reduce_model
from femend.model.surfaces.morph_shapes import grown, joint_moved, nodes_moved, offset_along_normal

__all__ = [
    "FormErrors",
    "MeshError",
    "Model",
    "Morph",
    "Pair",
    "Pairing",
    "Parameter",
    "Place",
    "ReducedModel",
    "Term",
    "affordable_refinement",
    "amplitude_limits",
    "find_places",
    "form_errors",
    "gap_places",
    "grown",
    "joint_moved",
    "mesh_error",
    "model_of",
    "nodes_moved",
    "offset_along_normal",
    "pair_sensors",
    "read_model",
    "reduce_model",
]
