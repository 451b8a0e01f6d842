"""The user's deck as a finite-element model with parameters."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from femend import _core
from femend.dof import Dof
from femend.errors import GeometryError, ModelError, PairingError
from femend.io.deck import read_deck
from femend.model.cards.card_mass import mass_of_card
from femend.model.cards.near_ids import near_ids
from femend.model.geometry.morph import Morph
from femend.model.geometry.moved import amplitudes_of, moved_nodes
from femend.model.geometry.node_fields import NodeFields, node_fields
from femend.model.parameter import Parameter, check_parameters
from femend.model.sensor_point import SensorPoint
from femend.model.target_words import in_words
from femend.units import unit_system

if TYPE_CHECKING:
    from scipy.sparse import csc_array, csr_array

    from femend.model.known_mesh import MeshError, Unresolved

__all__ = ["Model", "read_model"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Model:
    """A deck read into the core, with the parameters that may be updated.

    `deck` is the `_core.Deck`, `fe` the `_core.FeModel` (constraints eliminated: u_g = T u_a), `units` the deck's
    unit system. Degrees of freedom of the g-set stand node after node, six each, in the node's displacement frame.
    `spc` and `added_mass` are as of `read_model`. `morphs` move nodes; everything here is with them at amplitude 0.
    Where the model stands for a coarser one, `refines` is that one, whose nodes come first here, `mesh_error` what the
    difference is, and `parts` the elements that each of its elements became, where those are several. `unresolved` is
    what its mesh does not follow of the band it is used in; `simulated` says that recordings follow the errors of this
    very mesh, as no structure does. `points` are places of sensors between nodes.
    """

    deck: _core.Deck
    fe: _core.FeModel
    parameters: tuple[Parameter, ...]
    units: str
    spc: int | None = None
    added_mass: tuple[tuple[int, float], ...] = ()
    morphs: tuple[Morph, ...] = ()
    refines: Model | None = None
    mesh_error: MeshError | None = None
    unresolved: Unresolved | None = None
    simulated: bool = False
    parts: Mapping[int, tuple[int, ...]] = field(default_factory=dict)
    points: tuple[SensorPoint, ...] = ()

    @property
    def as_drawn(self) -> Model:
        """The model with the mesh of the user's deck."""
        return self if self.refines is None else self.refines

    def drawn(self, nodes: Iterable[int]) -> tuple[int, ...]:
        """Those of `nodes` that the user's deck has."""
        n = len(self.as_drawn.node_ids)
        return tuple(node for node in nodes if self.index(node) < n)

    def drawn_elements(self, elements: Iterable[int]) -> tuple[int, ...]:
        """Those of the user's deck that `elements` of this model are or are parts of, in their order."""
        whole = {part: eid for eid, parts in self.parts.items() for part in parts}
        return tuple(dict.fromkeys(whole.get(eid, eid) for eid in elements))

    @cached_property
    def node_ids(self) -> NDArray[np.int64]:
        """Ids of all nodes (n,), in the order of the g-set, scalar points included; not to be written to."""
        return _kept(self.fe.node_ids)

    @cached_property
    def is_scalar(self) -> NDArray[np.bool_]:
        """Which of `node_ids` are scalar points (n,): one DOF each, in no direction and at no place."""
        return _kept(np.asarray(np.isin(self.node_ids, self.fe.scalar_points)))

    @cached_property
    def xyz(self) -> FloatArray:
        """Coordinates (n, 3) in the basic system; scalar points have none and stand in the middle of the others. Not to
        be written to: the core makes them anew each time it is asked, and large models are asked node by node."""
        return _kept(self.fe.xyz)

    @cached_property
    def frames(self) -> FloatArray:
        """Displacement frames (n, 3, 3) of all nodes, row i of each its local axis i in basic coordinates; not to be
        written to."""
        return _kept(self.fe.frames)

    @cached_property
    def xyz_of(self) -> dict[int, FloatArray]:
        """Coordinates (3,) of every node by its id, as `xyz`."""
        return dict(zip(self.node_ids.tolist(), self.xyz, strict=True))

    @cached_property
    def mesh_key(self) -> str:
        """A key that models have in common whose nodes have the same ids, coordinates and units, so that sensors are
        paired alike with them."""
        digest = sha256(self.units.encode())
        digest.update(np.ascontiguousarray(self.node_ids).tobytes())
        digest.update(np.ascontiguousarray(self.xyz).tobytes())
        return digest.hexdigest()

    def index(self, node: int) -> int:
        """Position of a node in the g-set; raises PairingError where the model has no such node."""
        at = self._positions.get(int(node))
        if at is None:
            raise PairingError(
                f"the model has no node {node} ({near_ids(node, self.node_ids)}); give a node of the deck"
            )
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

    def seen(self, dofs: Sequence[Dof]) -> csr_array:
        """What sensors at `dofs` show of the g-set, (n_dofs, n_g), each with its sign: nodes, and `points` by their
        numbers; raises PairingError as `row`, and for a rotation of a point."""
        from scipy.sparse import csr_array

        points = {p.id: p for p in self.points}
        at: list[int] = []
        rows: list[int] = []
        values: list[float] = []
        for i, dof in enumerate(dofs):
            point = points.get(dof.node)
            if point is not None and dof.is_rotation:
                raise PairingError(f"{dof}: rotations between nodes are not known; take those of node {point.node}")
            own = [self.row(dof)] if point is None else point.rows.tolist()
            at += [i] * len(own)
            rows += own
            values += [float(dof.sign)] if point is None else (dof.sign * point.weights[dof.component - 1]).tolist()
        return csr_array((values, (at, rows)), shape=(len(dofs), self.fe.n_g))

    @cached_property
    def total_mass(self) -> float:
        """Mass of all elements at the deck's values, in its units."""
        return float(self.fe.total_mass())

    @cached_property
    def unsupported(self) -> Model:
        """The same deck without any SPC set, with the same parameters; morphs are left out."""
        return model_of(self.deck, units=self.units, parameters=self.parameters, spc=0, added_mass=self.added_mass)

    @cached_property
    def fields(self) -> NodeFields:
        """The morphs together, on all nodes that any of them moves."""
        return node_fields(self.deck, self.morphs)

    def with_morphs(self, morphs: Sequence[Morph]) -> Model:
        """The same model with the geometry parameters `morphs` in place of those it has.

        Raises ModelError for a node that is not in the deck, a name that stands twice, nodes that no element depends
        on, and a DOF that is resisted only when nodes move; GeometryError where the bounds of a morph let an element
        turn inside out; DeckError for a node that a coordinate system (CORD1) stands on.
        """
        taken = {p.name for p in self.parameters}
        for morph in morphs:
            if morph.name in taken:
                raise ModelError(f"a parameter and a morph are called {morph.name!r}; give them different names")
        moving = None
        if morphs:
            fields = node_fields(self.deck, morphs)
            moving = (fields.nodes.tolist(), fields.probe)
        fe = _core.FeModel(self.deck, self.spc, _specs(self.parameters), _on_cards(self.deck, self.added_mass), moving)
        model = Model(self.deck, fe, self.parameters, self.units, self.spc, self.added_mass, tuple(morphs))
        for i, morph in enumerate(morphs):
            alone = np.where(np.arange(len(morphs)) == i, model.fields.far, 0.0)
            if not any(np.any(part) for part in moved_nodes(model, alone).change()):
                raise ModelError(
                    f"morph {morph.name!r}: moving its {morph.nodes.size} nodes changes nothing in K, M or C; correct "
                    "the ids"
                )
            for end in morph.bounds or ():
                try:
                    moved_nodes(model, amplitudes_of(model, {morph.name: end}))
                except GeometryError as error:
                    raise GeometryError(
                        f"morph {morph.name!r}: at its bound {end:g} {error}",
                        element=error.element,
                        limits=error.limits,
                    ) from None
        return model

    def moved(self, amplitudes: Mapping[str, float]) -> FloatArray:
        """Coordinates (n, 3) as `xyz` with the morphs at `amplitudes` by name (0 where not given); raises ModelError
        for a name that is no morph."""
        out = self.xyz.copy()
        values = amplitudes_of(self, amplitudes)
        if self.morphs:
            out[[self.index(n) for n in self.fields.nodes.tolist()]] = self.fields.positions(values)
        return out

    def g_rows(self) -> NDArray[np.int64]:
        """Rows of the g-set (n_a,) of the independent DOFs; a scalar point has its only one first."""
        at = np.array([self.index(int(n)) for n in self.fe.dof_nodes], dtype=np.int64)
        return np.asarray(6 * at + np.maximum(np.asarray(self.fe.dof_components, dtype=np.int64) - 1, 0))

    def transformation(self) -> csc_array:
        """T (n_g, n_a) of u_g = T u_a."""
        from scipy.sparse import csc_array

        indptr, indices, data = self.fe.T
        return csc_array((data, indices, indptr), shape=(self.fe.n_g, self.fe.n_a))

    def matrices(self, factors: Mapping[str, float] | None = None) -> tuple[csc_array, csc_array]:
        """K and M (n_a, n_a) at `factors` of the parameters by name (1 where not given), and amplitudes of the morphs
        (0 where not given).

        Raises ModelError for a name that is neither, and GeometryError where an element has no shape there.
        """
        from scipy.sparse import csc_array

        given = dict(factors or {})
        amplitudes = amplitudes_of(self, {m.name: given.pop(m.name) for m in self.morphs if m.name in given})
        own = self.factors(given)
        indptr, indices, K, M, _, _ = self.fe.assemble(own)
        if np.any(amplitudes):
            change = moved_nodes(self, amplitudes).change(own)
            K, M = K + change[0], M + change[1]
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
    morphs: Sequence[Morph] = (),
) -> Model:
    """Reads a Nastran bulk-data deck into a model.

    `spc` selects a constraint set other than the deck's own, `added_mass` adds (node, mass) pairs in the unit of mass
    of `units`, which PARAM,WTMASS leaves as they are, `morphs` are geometry that may be updated. Raises DeckError for a
    deck that cannot be read and ModelError for a model that cannot be used, a parameter without target, and
    `parameters` as of `check_parameters`; UnitError for `units` that are none; for morphs as `Model.with_morphs`.
    """
    unit_system(units)
    check_parameters(parameters)
    deck = read_deck(path)
    return model_of(deck, units=units, parameters=parameters, spc=spc, added_mass=added_mass, morphs=morphs)


def model_of(
    deck: _core.Deck,
    *,
    units: str = "SI",
    parameters: Sequence[Parameter] = (),
    spc: int | None = None,
    added_mass: Sequence[tuple[int, float]] = (),
    morphs: Sequence[Morph] = (),
) -> Model:
    """A deck that was already read as a model; arguments and errors as of `read_model`."""
    try:
        fe = _core.FeModel(deck, spc, _specs(parameters), _on_cards(deck, added_mass))
    except ModelError as error:
        raise in_words(error, deck, parameters) from None
    model = Model(deck, fe, tuple(parameters), units, spc, tuple(added_mass))
    return model.with_morphs(morphs) if morphs else model


def _on_cards(deck: _core.Deck, added_mass: Sequence[tuple[int, float]]) -> list[tuple[int, float]]:
    """Masses (node, mass) as the core takes them, which multiplies all by PARAM,WTMASS."""
    unit = mass_of_card(deck) if added_mass else 1.0
    return [(node, mass / unit) for node, mass in added_mass]


def _kept(values: NDArray[Any]) -> NDArray[Any]:
    """Values that are asked for again and again, so that nobody may change them."""
    values.flags.writeable = False
    return values


def _specs(parameters: Sequence[Parameter]) -> list[tuple[str, str, str, list[int]]]:
    return [(p.name, p.property, p.target, list(p.ids)) for p in parameters]
