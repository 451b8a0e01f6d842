"""The user's deck as a finite-element model with parameters."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from femend import _core
from femend.dof import Dof
from femend.errors import ModelError, PairingError

if TYPE_CHECKING:
    from scipy.sparse import csc_array

__all__ = ["Model", "Parameter", "read_model"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Parameter:
    """A factor on values of the deck: `property` of the `target` ("material", "property_id", "elements", "mass") `ids`.

    `prior_sd` is the relative 1-sigma of what the deck says, `bounds` the relative limits or None.
    """

    name: str
    property: str
    target: str
    ids: tuple[int, ...]
    prior_sd: float = 0.10
    bounds: tuple[float, float] | None = None


@dataclass(frozen=True, eq=False)
class Model:
    """A deck read into the core, with the parameters that may be updated.

    `deck` is the `_core.Deck`, `fe` the `_core.FeModel` (constraints eliminated: u_g = T u_a), `units` the deck's
    unit system. Degrees of freedom of the g-set stand node after node, six each, in the node's displacement frame.
    """

    deck: _core.Deck
    fe: _core.FeModel
    parameters: tuple[Parameter, ...]
    units: str

    @property
    def node_ids(self) -> NDArray[np.int64]:
        """Ids of all nodes (n,), in the order of the g-set, scalar points included."""
        return self.fe.node_ids

    @property
    def is_scalar(self) -> NDArray[np.bool_]:
        """Which of `node_ids` are scalar points (n,): one DOF each, in no direction and at no place."""
        return np.asarray(np.isin(self.node_ids, self.fe.scalar_points))

    @property
    def xyz(self) -> FloatArray:
        """Coordinates (n, 3) in the basic system; scalar points have none and stand in the middle of the others."""
        return self.fe.xyz

    def index(self, node: int) -> int:
        """Position of a node in the g-set; raises PairingError where the model has no such node."""
        at = self._positions.get(int(node))
        if at is None:
            raise PairingError(f"the model has no node {node}; give a node of the deck")
        return at

    @cached_property
    def _positions(self) -> dict[int, int]:
        """Position of every node; built once, since large models are asked for them node by node."""
        return {node: i for i, node in enumerate(self.node_ids.tolist())}

    def row(self, dof: Dof) -> int:
        """Row of a DOF in the g-set, its sign left aside; raises PairingError as `index`, and for a scalar point."""
        if self.is_scalar[self.index(dof.node)]:
            raise PairingError(
                f"{dof}: {dof.node} is a scalar point, which has no direction in space; give a GRID of the deck"
            )
        return 6 * self.index(dof.node) + dof.component - 1

    def transformation(self) -> csc_array:
        """T (n_g, n_a) of u_g = T u_a."""
        from scipy.sparse import csc_array

        indptr, indices, data = self.fe.T
        return csc_array((data, indices, indptr), shape=(self.fe.n_g, self.fe.n_a))

    def matrices(self, factors: Mapping[str, float] | None = None) -> tuple[csc_array, csc_array]:
        """K and M (n_a, n_a) at parameter factors by name (1 where not given)."""
        from scipy.sparse import csc_array

        indptr, indices, K, M, _, _ = self.fe.assemble(self.factors(factors))
        shape = (self.fe.n_a, self.fe.n_a)
        return csc_array((K, indices, indptr), shape=shape), csc_array((M, indices, indptr), shape=shape)

    def factors(self, factors: Mapping[str, float] | None = None) -> FloatArray:
        """Factors (n_par,) in the order of the parameters; raises ModelError for a name that is none."""
        given = dict(factors or {})
        values = np.array([given.pop(p.name, 1.0) for p in self.parameters], dtype=np.float64)
        if given:
            names = ", ".join(p.name for p in self.parameters)
            raise ModelError(f"no parameter is called {next(iter(given))!r}; the parameters are {names}")
        return values


def read_model(
    path: str | Path,
    *,
    units: str = "SI",
    parameters: Sequence[Parameter] = (),
    spc: int | None = None,
    added_mass: Sequence[tuple[int, float]] = (),
) -> Model:
    """Reads a Nastran bulk-data deck into a model.

    `spc` selects a constraint set other than the deck's own, `added_mass` adds (node, mass) pairs. Raises DeckError for
    a deck that cannot be read and ModelError for a model that cannot be used or a parameter without target.
    """
    deck = _core.Deck.read(str(path))
    return model_of(deck, units=units, parameters=parameters, spc=spc, added_mass=added_mass)


def model_of(
    deck: _core.Deck,
    *,
    units: str = "SI",
    parameters: Sequence[Parameter] = (),
    spc: int | None = None,
    added_mass: Sequence[tuple[int, float]] = (),
) -> Model:
    """A deck that was already read as a model; arguments and errors as of `read_model`."""
    wanted = [(p.name, p.property, p.target, list(p.ids)) for p in parameters]
    fe = _core.FeModel(deck, spc, wanted, list(added_mass))
    return Model(deck, fe, tuple(parameters), units)
