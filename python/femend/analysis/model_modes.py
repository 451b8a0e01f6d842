"""Modes of a model at its nodes, ready to be compared with measured ones."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike

from femend.analysis.modes import solve_modes
from femend.data.mode_set import ModeSet
from femend.dof import Dof
from femend.errors import ArgumentError, SingularModelError
from femend.model import Model
from femend.model.reduced.finite_modes import finite_modes
from femend.model.reduced.unsolvable import told_of

__all__ = ["model_modes"]


def model_modes(
    model: Model,
    *,
    n_modes: int | None = None,
    f_max: float | None = None,
    zeta: ArrayLike = 0.0,
    factors: Mapping[str, float] | None = None,
) -> ModeSet:
    """The lowest `n_modes` of `model` (10 by default; all where fewer DOFs have a mass), or all up to `f_max` in Hz, at
    every DOF of its nodes.

    Rows are all GRIDs times X, Y, Z, RX, RY, RZ in the directions of the node's own system, held and tied ones with
    what they do (0 where held); then X, Y, Z of the model's `points` between nodes. Shapes are mass-normalised; `zeta`
    is the damping fraction given to them, `factors` are factors on parameters, and amplitudes of morphs, by name.
    Raises ValueError for fewer modes than one, what `solve_modes` and `Model.matrices` raise, and ArgumentError for
    what is no model.

    >>> model_modes(read_model("model.bdf"), f_max=30.0)  # doctest: +SKIP
    ModeSet(6 modes at 270 DOFs: 6.964, 7.593, 12.99, 15.25, 19.62, 20.53 Hz; mass scaling)
    """
    if not isinstance(model, Model):
        raise ArgumentError.given("`model_modes` takes a model, as `femend.read_model(file)` makes it", model)
    if n_modes is not None and n_modes < 1:
        raise ValueError(f"n_modes = {n_modes}; ask for at least one mode")
    K, M = model.matrices(factors)
    fe = model.fe
    names = [Dof(int(n), int(c)) for n, c in zip(fe.dof_nodes, fe.dof_components, strict=True)]
    if n_modes is None and f_max is None:
        n_modes = 10
    if n_modes is not None:
        n_modes = min(n_modes, len(names))
    pattern = K.indptr, K.indices, K.data, M.data, names
    try:
        found = solve_modes(*pattern, n_modes=n_modes, f_max=f_max, zeta=zeta).modes
    except SingularModelError:
        raise
    except ValueError as error:
        n_modes = finite_modes(error, n_modes)
        if n_modes is None:
            raise told_of(error, model) from error
        found = solve_modes(*pattern, n_modes=n_modes, f_max=f_max, zeta=zeta).modes
    grid = ~model.is_scalar
    dofs = tuple(Dof(int(n), c) for n in model.node_ids[grid] for c in range(1, 7))
    every = np.asarray(model.transformation() @ found.phi)
    phi = every[np.repeat(grid, 6)]
    if model.points:
        between = tuple(Dof(p.id, c) for p in model.points for c in range(1, 4))
        phi, dofs = np.vstack([phi, model.seen(between) @ every]), (*dofs, *between)
    return ModeSet(found.freq, found.zeta, phi, dofs, found.scaling)
