"""A place of a model where something may be missing, by the directions that forces there take."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from femend.model.places.held_motion import HeldMotion
from femend.model.reduced.wider import Basis

__all__ = ["AXES", "Place"]

FloatArray = NDArray[np.float64]

AXES = ("X", "Y", "Z", "RX", "RY", "RZ")


@dataclass(frozen=True, eq=False)
class Place:
    """A place with its direction vectors.

    Attributes:
        kind: "ground", "pair", "end", "clamp", "support" and "region" (of shells and solids), "member", "connection"
            (bushes and springs of the deck), "bushes" (motion in each of several that are alike), "bed" (a line or area
            on an elastic bedding) or "base".
        nodes: ids of the nodes that name the place.
        direction: "X" ... "RZ", "R" for all rotations, "" where none applies.
        to: what it connects to: "ground", a node id as text, or a member as text.
        g_rows, g_values: force pattern of every direction vector on the g-set, one pair of arrays each.
        release: stiffness S (n_w, n_w) of a cut, None for an attached place.
        lets_go: of a cut, the motion (n,) of the element's rows that each direction vector lets go.
        parameter: parameter that scales the member's or region's stiffness, None where there is none.
        elements: elements of a member, region or connection, or the one whose end is cut.
        label: the place in words.
        unlikely: whether nothing of the model suggests that something is attached there.
        support: of a support of shells or solids, the stiffness S of what is around it at the deck's values; it gives
            way by a spring k where the model loses S²/(k + S) along the direction vector. 0 elsewhere.
        motions: of a support of shells or solids, all motions in which it may give way.
        springs: of a clamp or support that stands on springs of its own in several directions, (motion, stiffness in
            deck units around which it is sought) of each; the place then has no direction vectors.
        spring: stiffness in deck units around which a spring along its direction vectors is sought that is part of the
            model; 0 elsewhere.
        mass: the same of a mass that moves along them.
        independent: whether g_rows are rows of the independent DOFs instead of the g-set.
        bed: of a bedding, of every node its id, and the rows of the g-set and values, in square roots of deck units of
            stiffness, of the spring to ground around which it is sought.
    """

    kind: str
    nodes: tuple[int, ...]
    direction: str
    to: str
    g_rows: tuple[NDArray[np.int64], ...] = ()
    g_values: tuple[FloatArray, ...] = ()
    release: FloatArray | None = None
    parameter: int | None = None
    elements: tuple[int, ...] = ()
    label: str = ""
    independent: bool = False
    unlikely: bool = False
    support: float = 0.0
    motions: tuple[HeldMotion, ...] = ()
    springs: tuple[tuple[HeldMotion, float], ...] = ()
    spring: float = 0.0
    mass: float = 0.0
    bed: tuple[tuple[int, NDArray[np.int64], FloatArray], ...] = ()
    lets_go: tuple[FloatArray, ...] = ()

    @property
    def scaled(self) -> bool:
        """Whether a factor on a stiffness is what may be off: on that of the elements of a member, a region of shells
        or solids, a bush or spring, or on that of a bedding, of which the deck has none (so that k + bed is scaled)."""
        return self.kind in ("member", "region", "connection", "bed")

    @property
    def part_law(self) -> str:
        """What the factor that may be off is called."""
        return "support_stiffness" if self.bed else "joint_stiffness"

    @property
    def bed_nodes(self) -> tuple[int, ...]:
        """The nodes that a bedding holds, in their order."""
        return tuple(node for node, _, _ in self.bed)

    @property
    def bed_stiffness(self) -> float:
        """Stiffness in all (deck units) around which a bedding is sought."""
        return float(sum(x @ x for _, _, x in self.bed))

    @property
    def n_own(self) -> int:
        """Number of unknowns that it adds to the model itself: a factor on what is there, a spring's or a soft clamp's
        stiffnesses, a mass."""
        return 1 if self.scaled or self.inside else len(self.springs)

    @property
    def inside(self) -> bool:
        """Whether it is a spring or a mass that is part of the model, for whose forces that needs a basis."""
        return bool(self.spring or self.mass)

    @property
    def part(self) -> bool:
        """Whether it is a part of the model itself, with unknowns of its own and no forces."""
        return self.n_own > 0

    def values(self, x: FloatArray) -> dict[str, float]:
        """The factor of what is there, the stiffness k of a bedding or a spring, the mass m, or k1 to k6 by the
        component they act in, at the logarithms `x` (n_own,) of its unknowns."""
        if self.bed:
            return {"k": float(self.bed_stiffness * np.expm1(x[0]))}
        if self.scaled:
            return {"factor": float(np.exp(x[0]))}
        if self.spring:
            return {"k": float(self.spring * np.exp(x[0]))}
        if self.mass:
            return {"m": float(self.mass * np.exp(x[0]))}
        return {f"k{of.component + 1}": float(k * np.exp(v)) for (of, k), v in zip(self.springs, x, strict=True)}

    def logarithms(self, values: Mapping[str, float]) -> FloatArray:
        """Unknowns (n_own,) at `values` as given by `values`."""
        if self.bed:
            return np.log1p([values["k"] / self.bed_stiffness])
        if self.scaled:
            return np.log([values["factor"]])
        if self.spring:
            return np.log([values["k"] / self.spring])
        if self.mass:
            return np.log([values["m"] / self.mass])
        return np.log([values[f"k{of.component + 1}"] / k for of, k in self.springs])

    def slopes(self, x: FloatArray) -> FloatArray:
        """By what the logarithms of `values` change with the unknowns `x` (n_own,), (n_own,): 1 but for a bedding."""
        return np.asarray(1 / -np.expm1(-x)) if self.bed else np.ones(len(x))

    @property
    def n_w(self) -> int:
        """Number of direction vectors."""
        return len(self.g_rows)

    def w(self, V: Basis, V_a: Basis) -> FloatArray:
        """Direction vectors (n_w, r) in a basis V (n_g, r), V_a (n_a, r): unit force patterns (a cut: B, unscaled)."""
        if not self.g_rows:
            return np.zeros((0, V.shape[1]))
        basis = V_a if self.independent else V
        return np.array([x @ basis[g] for g, x in zip(self.g_rows, self.g_values)])

    @property
    def text(self) -> str:
        """The place in words."""
        return self.label

    @property
    def where(self) -> str:
        """The place in words, as it goes on after a law's name."""
        return self.text if self.text.startswith("between") else f"at {self.text}"
