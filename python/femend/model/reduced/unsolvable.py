"""Why a model has no modes, in terms of its deck: the core knows rows of matrices alone."""

from __future__ import annotations

import re

from femend.dof import Dof
from femend.errors import ModelError, SingularModelError
from femend.model.cards.negative import negative_values
from femend.model.model import Model
from femend.numerals import listed, plain
from femend.units import unit_system

__all__ = ["no_solution", "told_of"]

# as many DOFs, and values, are named
SHOWN, VALUES = 12, 4
_NEGATIVE = re.compile(r"has (\d+) negative eigenvalue")
# the core names a dozen rows and tells how many more there are
_MASS, _ROW, _MORE = re.compile(r"the mass is below nothing"), re.compile(r"DOF (\d+)"), re.compile(r"and (\d+) more")


def told_of(error: ValueError, model: Model) -> ValueError:
    """The `error` of the core where it solved the `model`, with the names and values of the deck; the same one where
    these say no more."""
    if isinstance(error, SingularModelError):
        return _singular(error, model)
    if _MASS.search(str(error)):
        return _negative_mass(error, model)
    negative = _NEGATIVE.search(str(error))
    if negative is None:
        return error
    n = int(negative[1])
    otherwise = "look for springs with a negative stiffness, properties with a sign lost, and multipliers in a DMIG"
    return ModelError(
        f"the stiffness of the model is negative in {n} way{'s' * (n > 1)}, in which it would run away instead of "
        f"vibrating: {_values(model, otherwise)}"
    )


def no_solution(model: Model) -> ModelError:
    """What is told where the mass of `model` is not positive: no modes follow from it."""
    return ModelError(
        f"the model has no modes, since its mass is not above 0 in every way it can move (its total is "
        f"{plain(model.total_mass)} {unit_system(model.units).text('mass')}): "
        + _values(model, "give the materials a density (RHO of MAT1), and look for negative masses (CONM2, CMASS2)")
    )


def _negative_mass(error: ValueError, model: Model) -> ModelError:
    """The core's `error` with the model's names for its rows, and the values that may be the reason."""
    names = [_name(model, int(row)) for row in _ROW.findall(str(error))]
    names += [f"{more} more" for more in _MORE.findall(str(error))]
    otherwise = "look for negative masses (CONM1, CONM2, CMASS2, DMIG)"
    return ModelError(
        f"the mass of the model is below nothing in a way it can move ({listed(names, SHOWN + 1)}), and no modes "
        f"follow from it: {_values(model, otherwise)}"
    )


def _name(model: Model, row: int) -> str:
    return str(Dof(int(model.fe.dof_nodes[row]), int(model.fe.dof_components[row])))


def _singular(error: SingularModelError, model: Model) -> SingularModelError:
    """The core's `error` with the model's names for its rows."""
    moving = tuple(_name(model, int(row)) for row in error.dofs)
    return SingularModelError(
        f"the model is singular: {len(moving)} DOF(s) move without stiffness and without mass: "
        f"{listed(moving, SHOWN)}; constrain them, or give them stiffness or mass",
        dofs=moving,
    )


def _values(model: Model, otherwise: str) -> str:
    """The values of the deck that are below nothing, else what to look for `otherwise`."""
    return listed(negative_values(model.deck), VALUES, "; ") or otherwise
