"""What acts with the speed of rotation, as parameters of a system: bearings that change with it, moments of discs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from femend.dof import Dof
from femend.errors import UpdatingError
from femend.estimate.updating.order_responses import across
from femend.model import Model
from femend.model.terms.linear_terms import SpeedPower, g_matrix

__all__ = ["Course", "SpeedCurve", "SpeedTerm", "bearing_term", "disc_term"]

FloatArray = NDArray[np.float64]

# the same at all speeds
ALWAYS = SpeedPower(0, 1.0)


class Course(Protocol):
    """A weight over the speed of rotation."""

    def at(self, speed: FloatArray) -> FloatArray:
        """Weights (n_freq,) at `speed` (n_freq,) in rad/s, signed."""


@dataclass(frozen=True, eq=False)
class SpeedCurve:
    """A weight over the speed, whatever its sense: the natural cubic spline through `values` (n,) at the rising
    `speeds` (n,) in rad/s (de Boor, A Practical Guide to Splines, 2001, chapter IV).

    Raises UpdatingError for fewer than two values, speeds that do not rise or lie below 0, and a speed that is asked
    for beyond them.

    >>> SpeedCurve([0.0, 100.0, 200.0], [1.0, 1.5, 2.0]).at(np.array([50.0, -150.0])).tolist()
    [1.25, 1.75]
    """

    speeds: FloatArray
    values: FloatArray

    def __post_init__(self) -> None:
        for name in ("speeds", "values"):
            object.__setattr__(self, name, np.asarray(getattr(self, name), dtype=np.float64))
        rising = self.speeds.ndim == 1 and self.speeds.size > 1 and bool((np.diff(self.speeds) > 0).all())
        if not rising or self.values.shape != self.speeds.shape or self.speeds[0] < 0:
            raise UpdatingError(
                f"a curve over speed has values {self.values.shape} at speeds {self.speeds.tolist()} rad/s; give two "
                "or more rising speeds from 0 on, and a value for each"
            )
        if not (np.isfinite(self.speeds).all() and np.isfinite(self.values).all()):
            raise UpdatingError("a curve over speed holds what is no number; leave the speed out, or mend its value")

    @classmethod
    def knots(cls, speeds: ArrayLike) -> tuple[SpeedCurve, ...]:
        """The curves that are 1 at one of the `speeds` (n,) in rad/s and 0 at the others: with a factor for each, any
        spline through these speeds. Raises UpdatingError as the class does.

        >>> sum(3.0 * one.at(np.array([40.0])) for one in SpeedCurve.knots([0.0, 50.0, 90.0])).round(9).tolist()
        [3.0]
        """
        at = np.asarray(speeds, dtype=np.float64)
        return tuple(cls(at, unit) for unit in np.eye(at.size))

    def at(self, speed: FloatArray) -> FloatArray:
        """Weights (n_freq,) at `speed` (n_freq,) in rad/s; raises UpdatingError beyond the speeds of the curve."""
        asked = np.abs(np.asarray(speed, dtype=np.float64))
        low, high = self.speeds[[0, -1]]
        off = asked[(asked < low - 1e-9 * high) | (asked > high * (1 + 1e-9))]
        if off.size:
            raise UpdatingError(
                f"a curve over speed reaches from {low:.6g} to {high:.6g} rad/s and is asked for {off[0]:.6g} rad/s; "
                "give its value there, or leave the line out"
            )
        return np.asarray(self._spline(asked))

    @cached_property
    def _spline(self) -> Any:
        from scipy.interpolate import CubicSpline

        return CubicSpline(self.speeds, self.values, bc_type="natural")


@dataclass(frozen=True, eq=False)
class SpeedTerm:
    """The parameter `name` times the weight of `course` at the shaft's speed times `matrix` (n, n), added to the
    stiffness or, as `kind` says, to the viscous damping of a system of n rows.

    The matrix need not be symmetric: cross-coupled bearings and gyroscopic moments are not. The parameter is 1 where it
    is no unknown; terms of one name share it. `course` is a power of the speed (`SpeedPower` in
    `femend.model.terms.linear_terms`) or a `SpeedCurve`; without one the term is the same at all speeds.
    Raises UpdatingError for another kind, and a matrix that is not square or holds what is no number.
    """

    name: str
    kind: Literal["stiffness", "damping"]
    matrix: Any
    course: Course = ALWAYS

    def __post_init__(self) -> None:
        from scipy.sparse import csc_array, issparse

        if self.kind not in ("stiffness", "damping"):
            raise UpdatingError(f"{self.name!r} is of kind {self.kind!r}; there are stiffness and damping")
        given: Any = self.matrix if issparse(self.matrix) else np.asarray(self.matrix, dtype=np.float64)
        matrix = csc_array(given).astype(np.float64)
        if matrix.ndim != 2 or matrix.shape[0] != matrix.shape[1] or not np.isfinite(matrix.data).all():
            raise UpdatingError(
                f"the matrix of {self.name!r} has shape {np.shape(given)} or holds what is no number; it is (n, n) on "
                "the rows of the system"
            )
        object.__setattr__(self, "matrix", matrix)

    def weights(self, speed: FloatArray) -> FloatArray:
        """Weights (n_freq,) at `speed` (n_freq,) in rad/s; raises UpdatingError where one is no number."""
        with np.errstate(divide="ignore", invalid="ignore"):
            found = np.asarray(self.course.at(speed), dtype=np.float64)
        bad = np.flatnonzero(~np.isfinite(found))
        if bad.size:
            raise UpdatingError(
                f"{self.name!r} weighs {found[bad[0]]:g} at {speed[bad[0]]:g} rad/s; leave the line out, or give "
                "another course"
            )
        return found


def bearing_term(
    model: Model,
    name: str,
    nodes: Sequence[int | tuple[int, int]],
    axis: int,
    matrix: ArrayLike,
    *,
    course: Course = ALWAYS,
    kind: Literal["stiffness", "damping"] = "stiffness",
) -> SpeedTerm:
    """A bearing's part, the same at all `nodes`: forces `matrix` (2, 2) times the motion across the shaft, N/m or
    N s/m.

    Each of the `nodes` of the `model` stands to ground, a pair (shaft, housing) between both. Rows and columns are the
    directions e_u, e_v across the shaft along `axis` (0, 1, 2 for X, Y, Z), right-handed with it in this order: Y, Z
    for a shaft along X. `name` is the parameter, and `course` the part's weight over the speed; `kind` says what the
    part belongs to. Stiffness that grows with the speed is k (1 + a W^2): the deck's spring, and a term for a. Raises
    UpdatingError for an axis, matrix or pair that is none and nodes that are held, and PairingError for one that the
    model does not have.

    >>> bearing_term(model, "growth", [2, 8], 0, 1e5 * np.eye(2), course=SpeedPower(2, 300.0))  # doctest: +SKIP
    """
    block = np.asarray(matrix, dtype=np.float64)
    if block.shape != (2, 2):
        raise UpdatingError(f"the matrix of {name!r} has shape {block.shape}; it is (2, 2), across the shaft")
    if not nodes:
        raise UpdatingError(f"{name!r} stands at no node; name those of the bearings")
    total: Any = 0
    for node in nodes:
        ends = tuple(node) if isinstance(node, tuple) else (node,)
        if len(ends) > 2:
            raise UpdatingError(f"{name!r} stands between nodes {list(ends)}; give one, or a pair (shaft, housing)")
        places, _ = across(ends, axis, 1)
        # motion of the shaft less that of the housing
        relative = np.hstack([np.eye(2), -np.eye(2)]) if len(ends) == 2 else np.eye(2)
        total = total + _on_rows(model, name, places, relative.T @ block @ relative)
    return SpeedTerm(name, kind, total, course)


def disc_term(model: Model, name: str, node: int, axis: int, Ip: float) -> SpeedTerm:
    """Gyroscopic moments of a rigid disc at `node` of the `model` on a shaft along `axis` (0, 1, 2 for X, Y, Z), `name`
    times the polar inertia `Ip` (kg m^2 in SI): W Ip theta_v' about e_u and -W Ip theta_u' about e_v.

    It is the moments alone: mass and inertia across the shaft are those of the deck. Genta, Dynamics of Rotating
    Systems, 2005, eq. 2.24. Raises UpdatingError for an axis that is none and a node that cannot tilt, and PairingError
    for one that the model does not have.

    >>> disc_term(model, "Ip", 6, 0, 0.08)  # doctest: +SKIP
    """
    tilts = tuple(Dof(d.node, d.component + 3) for d in across([node], axis, 1)[0])
    block = np.array([[0.0, Ip], [-Ip, 0.0]])
    return SpeedTerm(name, "damping", _on_rows(model, name, tilts, block), SpeedPower(1, 1.0, signed=True))


def _on_rows(model: Model, name: str, places: Sequence[Dof], block: FloatArray) -> Any:
    """`block` between `places` on the rows of the system, (n_a, n_a)."""
    T = model.transformation()
    found = T.T @ g_matrix(model, [model.row(d) for d in places], block) @ T
    if not abs(found).max() > 0:
        where = ", ".join(str(d) for d in places)
        raise UpdatingError(
            f"{name!r} moves nothing: {where} are held by the deck, or its matrix is 0; give nodes that are free"
        )
    return found
