"""A structure with parts that turn, seen at any number of speeds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from femend.dof import Dof
from femend.errors import UpdatingError
from femend.estimate.updating.gyroscopic import check_parts
from femend.estimate.updating.matrices import DeckMatrices, Matrices
from femend.estimate.updating.requests import DAMPING, Frfs, Whirls
from femend.estimate.updating.speed_terms import SpeedTerm
from femend.estimate.updating.state import State
from femend.estimate.updating.turning_frf import turning_frf, turning_frf_slopes
from femend.estimate.updating.turning_matrices import Change, TurningMatrices
from femend.estimate.updating.whirl_poles import PolesAt, pole_slopes, poles_at
from femend.model import Model
from femend.model.terms.spinning import SpinningPart

__all__ = ["RotorSystem", "rotor_system"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class RotorSystem:
    """M u'' + (C + c(W) + W G) u' + (K + k(W) + i H) u = f through `sensors` (n_sensors, n), W the shaft's speed.

    K and M are those of the `matrices`, with a deck's dashpots and loss factors and the parameters "alpha", "beta",
    "eta"; G is that of the `parts` of a deck, c(W) and k(W) are the `terms`, whose parameters come last. Gives "frf" on
    the lines of `frfs`, each at its own speed, and "pole" (n_speeds, n_modes) in rad/s and "whirl" of the modes of
    `whirls` at their speeds, "pole speed". Alpha, beta and eta are of the matrices at rest. Raises UpdatingError for
    parts without a deck, terms of another size or with the name of another parameter, FRFs without speeds, and a system
    that nothing turns in or that is asked for nothing.
    """

    matrices: Matrices
    sensors: Any
    parts: tuple[SpinningPart, ...] = ()
    terms: tuple[SpeedTerm, ...] = ()
    frfs: Frfs | None = None
    whirls: Whirls | None = None
    defaults: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "parts", tuple(self.parts))
        object.__setattr__(self, "terms", tuple(self.terms))
        if not self.parts and not self.terms:
            raise UpdatingError(
                "nothing turns: there is neither a spinning part nor a term over the speed; give one, or take "
                "`deck_system` or `modal_system`, which are at rest"
            )
        if self.parts and not isinstance(self.matrices, DeckMatrices):
            raise UpdatingError(
                "spinning parts are elements of a deck, and the matrices come without one; give their gyroscopic "
                "matrix as a `SpeedTerm` of the damping"
            )
        n = len(self.matrices.indptr) - 1
        for term in self.terms:
            if term.matrix.shape != (n, n):
                raise UpdatingError(f"the matrix of {term.name!r} is {term.matrix.shape}, the model has {n} rows")
            if term.name in self.matrices.names + DAMPING:
                raise UpdatingError(
                    f"a term over the speed and a parameter at rest are both called {term.name!r}; name one otherwise "
                    "(`links` of a configuration can give both one unknown)"
                )
        if self.frfs is None and self.whirls is None:
            raise UpdatingError("the system is asked for nothing; give the `Frfs` or `Whirls` of a response")
        if self.frfs is not None and self.frfs.speed is None:
            raise UpdatingError(
                f"FRFs on {np.size(self.frfs.freq)} lines without the shaft's speed, which a rotor's depend on; give "
                "`Frfs` a `speed` in rad/s, `OrderDifferences.of` a `sense` or `spin`, `OdsDifferences.of` a `speed`"
            )

    @cached_property
    def turning(self) -> TurningMatrices:
        """The matrices as functions of the factors."""
        return TurningMatrices(self.matrices, self.parts, self.terms)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters: those of the matrices, of their damping, and of the terms."""
        return self.turning.names

    def solve(self, factors: FloatArray) -> State:
        """Results at `factors` (n_parameters,); raises ModelError on a line at which nothing resists, and what
        `poles_at` raises."""
        at = np.asarray(factors, dtype=np.float64)
        turned = self.turning.at(at)
        values: dict[str, NDArray[Any]] = {}
        if self.frfs is not None:
            values["frf"] = turning_frf(turned, self.frfs, self.sensors)
        found: list[PolesAt] = []
        if self.whirls is not None:
            model = self.matrices.model if isinstance(self.matrices, DeckMatrices) else None
            n = self.whirls.n_modes
            found = [poles_at(turned, float(w), n, model, self.parts) for w in self.whirls.speeds]
            values["pole"], values["whirl"] = np.array([f.poles for f in found]), np.array([f.whirl for f in found])
            values["pole speed"] = self.whirls.speeds

        def slopes(_: int | None) -> dict[str, NDArray[Any]]:
            changes: list[Change] = self.turning.changes(at)
            out: dict[str, NDArray[Any]] = {}
            if self.frfs is not None:
                out["frf"] = turning_frf_slopes(turned, changes, self.frfs, self.sensors, at.size)
            if found:
                out["pole"] = np.stack([pole_slopes(turned, changes, f, at.size) for f in found], axis=1)
            return out

        return State(values, slopes)


def rotor_system(
    model: Model,
    sensors: Sequence[Dof],
    *,
    parts: Sequence[SpinningPart] = (),
    terms: Sequence[SpeedTerm] = (),
    frfs: Frfs | None = None,
    whirls: Whirls | None = None,
) -> RotorSystem:
    """A deck with parameters whose `parts` turn, seen at `sensors` in their signed directions on the lines of `frfs`,
    and its modes at the speeds of `whirls`.

    `terms` (`bearing_term`, `disc_term`) are what changes with the speed beside them. A modal test at rest is a
    `deck_system` of the same model in a configuration of its own. Raises UpdatingError as `RotorSystem` does, for
    parts that are not in the deck, have no polar inertia or are described in turning axes, and for morphs; PairingError
    for a sensor at a node that the deck does not have; ModelError for elements that cannot spin.

    >>> shaft = SpinningPart((1.0, 0.0, 0.0), (1, 2, 3, 40))
    >>> rotor_system(model, sensors, parts=[shaft], frfs=lines)  # doctest: +SKIP
    """
    from scipy.sparse import csr_array

    if model.morphs:
        raise UpdatingError(
            f"a rotor with {len(model.morphs)} morphs: gyroscopic matrices are those of the geometry as it stands; "
            "leave the morphs out, or update them at rest first"
        )
    check_parts(model, parts)
    T = csr_array(model.transformation())
    B = csr_array(model.seen(sensors) @ T)
    return RotorSystem(DeckMatrices(model), B, tuple(parts), tuple(terms), frfs, whirls)
