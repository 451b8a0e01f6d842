"""Decks and models."""

from collections.abc import Sequence
from os import PathLike
from typing import TypeAlias, final

import numpy as np
from numpy.typing import NDArray

_System: TypeAlias = tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]

@final
class Deck:
    """A Nastran bulk-data deck: cards, case control, and where everything stands."""

    @staticmethod
    def read(path: str | PathLike[str]) -> Deck: ...
    @property
    def path(self) -> str: ...
    @property
    def files(self) -> list[str]: ...
    @property
    def node_ids(self) -> NDArray[np.int64]:
        """Of the GRIDs (n,), ascending."""

    @property
    def scalar_points(self) -> NDArray[np.int64]:
        """Ids of SPOINT and of what CELAS3, 4, CDAMP3, 4 and CMASS3, 4 name, ascending."""

    @property
    def xyz(self) -> NDArray[np.float64]:
        """Of the GRIDs (n, 3), basic coordinates."""

    def card_counts(self) -> dict[str, int]: ...
    def ignored(self) -> dict[str, int]: ...
    def case_control(self) -> dict[str, str]: ...
    def later_subcases(self) -> list[tuple[str, str]]: ...
    def params(self) -> dict[str, str]: ...
    def grid_coordinates(self, ids: Sequence[int], xyz: NDArray[np.float64]) -> NDArray[np.float64]:
        """(n, 3) of basic points `xyz` (n, 3) as fields 4 to 6 of the GRIDs `ids` have them, angles in degrees."""

    def elements(self) -> list[tuple[int, str, int | None, tuple[int, ...]]]: ...
    def find(self, card: str, id: int) -> tuple[str, int]: ...
    def field_text(self, card: str, id: int, field: int) -> str: ...
    def cards(self, name: str) -> list[list[str]]:
        """Texts of the fields behind the name of every card `name`, continuation marks left out."""

    def third_axis(self, card: str, number: int, field: int) -> list[float]: ...
    def next_id(self, kind: str) -> int: ...
    def patched(self, changes: Sequence[tuple[str, int, int, float]], additions: Sequence[str]) -> dict[str, bytes]: ...

@final
class MovedNodes:
    """Elements of a model with some of its nodes elsewhere: `FeModel.moved`."""

    @property
    def rows(self) -> NDArray[np.int64]:
        """g-set rows whose row of T is another one there."""

    def change(self, factors: NDArray[np.float64] | None = None) -> _System:
        """What the new positions add to (K, M, C, H) at the factors, on the pattern of `FeModel.assemble`."""

    def minus(self, other: MovedNodes, factors: NDArray[np.float64] | None = None) -> _System:
        """(K, M, C, H) at these positions less those at the positions of `other`, a position of the same model."""

    def derivative(self, i: int, factors: NDArray[np.float64] | None = None) -> _System:
        """What the new positions add to `FeModel.derivative` with respect to factor i."""

@final
class FeModel:
    """Finite-element model of a deck with constraints eliminated: `u_g = T u_a`.

    Rows of the g-set are `6 * node_index + component - 1`, components in each node's displacement (CD) frame. Matrices
    are full symmetric compressed columns (both triangles, rows ascending) on one pattern; `factors` are one number
    per parameter, 1 = the deck's value, None = all one. Order everywhere: K, M, C, and structural damping H, where
    the stiffness is K + iH (GE of materials, springs and bushes, PARAM G, K42GG). Raises `ModelError` and `DeckError`.
    """

    def __new__(
        cls,
        deck: Deck,
        spc: int | None = None,
        parameters: Sequence[tuple[str, str, str, Sequence[int]]] | None = None,
        added_mass: Sequence[tuple[int, float]] | None = None,
        moving: tuple[Sequence[int], NDArray[np.float64]] | None = None,
    ) -> FeModel:
        """Model with SPC set `spc` (None: the one case control selects; 0: no set, all supports free).

        `parameters` are (name, property, target, ids): property one of E G nu rho eta A I1 I2 J t k1..k6 c1..c6 m,
        target one of material, property_id, elements, mass. `added_mass` are (node, mass) on top of the deck. `moving`
        are the ids of nodes that may move (`moved`) and a probe position (n, 3) of theirs: the pattern holds both.
        """

    def moved(self, ids: Sequence[int], xyz: NDArray[np.float64]) -> MovedNodes:
        """The model with nodes `ids` at `xyz` (n, 3), basic coordinates: what that changes.

        Raises GeometryError where an element has no shape there and ModelError for a model not made with `moving`.
        """

    @property
    def reached(self) -> NDArray[np.int64]:
        """Positions in `elements()` of the elements that moving nodes changes."""

    @property
    def n_a(self) -> int:
        """Number of independent DOFs."""

    @property
    def n_g(self) -> int:
        """Six per node."""

    @property
    def node_ids(self) -> NDArray[np.int64]:
        """(n_nodes,), in the order of the g-set, scalar points included."""

    @property
    def scalar_points(self) -> NDArray[np.int64]:
        """Ids of the nodes that are scalar points: their one DOF is carried as component 4, the others are held, and
        `xyz` has them in the middle of the other nodes."""

    @property
    def xyz(self) -> NDArray[np.float64]:
        """(n_nodes, 3), basic coordinates."""

    @property
    def frames(self) -> NDArray[np.float64]:
        """(n_nodes, 3, 3): row i is axis i of the node's displacement frame in basic coordinates."""

    @property
    def dof_nodes(self) -> NDArray[np.int64]:
        """(n_a,) node id of each a-set DOF."""

    @property
    def dof_components(self) -> NDArray[np.int64]:
        """(n_a,) component 1..6 of each a-set DOF."""

    @property
    def T(self) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64]]:
        """(indptr, indices, data) of the (n_g, n_a) matrix T, compressed columns."""

    @property
    def auto_constrained(self) -> list[str]:
        """DOFs held because nothing resists or loads them, as "node:component"."""

    @property
    def parameter_names(self) -> list[str]: ...
    @property
    def affine(self) -> bool:
        """Are K, M, C and H affine in all factors jointly? Then derivatives are constant."""

    def total_mass(self) -> float:
        """Mass of the whole structure, held nodes included, in mass units after WTMASS."""

    def elements(self) -> list[tuple[int, str, list[int]]]:
        """(id, card, node ids) of every element; masses added by a configuration have id 0."""

    def assemble(
        self, factors: NDArray[np.float64] | None = None
    ) -> tuple[
        NDArray[np.int32],
        NDArray[np.int32],
        NDArray[np.float64],
        NDArray[np.float64],
        NDArray[np.float64],
        NDArray[np.float64],
    ]:
        """(indptr, indices, K, M, C, H)."""

    def refill(self, matrix: str, factors: NDArray[np.float64] | None, out: NDArray[np.float64]) -> None:
        """Writes the values of one matrix ("K", "M", "C" or "H") at the factors into `out` (nnz,), on that pattern.

        Where the model is `affine` only the values that factors reach are read: little dearer than a copy. Raises
        ValueError for another matrix or an array that cannot be written, ModelError for another length.
        """

    def derivative(self, i: int, factors: NDArray[np.float64] | None = None) -> _System:
        """Exact derivatives of (K, M, C, H) with respect to factor i, on the pattern of `assemble`."""

    def project(self, factors: NDArray[np.float64] | None, v: NDArray[np.float64]) -> tuple[_System, _System]:
        """Reduced (K, M, C, H), each (r, r), on the basis v (n_a, r), and their derivatives, each (p, r, r)."""

    def element_matrices(
        self, eid: int, factors: NDArray[np.float64] | None = None
    ) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]:
        """(g-set rows, K, M) of one element, in displacement frames: its part of K is T[rows]' K T[rows]."""

    def element_frame(self, eid: int) -> tuple[NDArray[np.float64], float]:
        """Local axes (3, 3) of a beam in basic coordinates, one per row, and its length between offset ends."""

    def stress_stiffness(
        self, u: NDArray[np.float64], factors: NDArray[np.float64] | None = None
    ) -> NDArray[np.float64]:
        """Stress stiffness, on the pattern of `assemble`, of the preload that the displacements u (n_a,) make."""

    def gyroscopic(
        self,
        axis: Sequence[float],
        elements: Sequence[int] | None = None,
        rotating: bool = False,
        factors: NDArray[np.float64] | None = None,
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """(G, S) on the pattern of `assemble`: G antisymmetric per rad/s, S symmetric per (rad/s)^2.

        `axis` is the direction of spin (basic axes), `elements` the ids of the spinning part (None: all). In axes at
        rest (`rotating` false) S is zero and only beams along the axis and concentrated masses can spin.
        """

    def recover(self, v: NDArray[np.float64]) -> NDArray[np.float64]:
        """u_g = T v, (n_g, r), displacement frames, from v (n_a, r)."""
