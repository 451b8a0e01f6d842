"""A model with its nodes elsewhere, and how far they can go."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from femend import _core
from femend.errors import GeometryError, ModelError
from femend.model.geometry.morph import Morph
from femend.model.geometry.node_fields import NodeFields
from femend.numerals import plain

__all__ = ["amplitude_limits", "amplitudes_of", "moved_nodes"]

FloatArray = NDArray[np.float64]

# halvings of the way to a position without shape: the limit is told to 0.1 % of it
HALVINGS = 10


class Morphed(Protocol):
    """A model as far as its nodes move: its matrices, its morphs, and these together on all nodes that move."""

    @property
    def fe(self) -> _core.FeModel:
        """The model's matrices."""

    @property
    def morphs(self) -> tuple[Morph, ...]:
        """What moves its nodes."""

    @property
    def fields(self) -> NodeFields:
        """The morphs together."""


def amplitudes_of(model: Morphed, amplitudes: Mapping[str, float] | None = None) -> FloatArray:
    """Amplitudes (n_morphs,) in the order of the morphs of `model` from `amplitudes` by name (0 where not given).

    Raises ModelError for a name that is no morph and a number that is not finite.
    """
    given = dict(amplitudes or {})
    values = np.array([float(given.pop(m.name, 0.0)) for m in model.morphs])
    if given:
        there = ", ".join(m.name for m in model.morphs) or "none"
        raise ModelError(f"no morph is called {next(iter(given))!r}; the morphs are {there}")
    bad = np.flatnonzero(~np.isfinite(values))
    if bad.size:
        raise ModelError(f"the amplitude of morph {model.morphs[bad[0]].name!r} is {values[bad[0]]}; give a number")
    return values


def moved_nodes(model: Morphed, amplitudes: FloatArray) -> _core.MovedNodes:
    """What the morphs of `model` at `amplitudes` (n_morphs,) change in its matrices.

    Raises GeometryError naming the element that has no shape there and the amplitudes up to which all have one, and
    ModelError for a model without morphs.
    """
    if not model.morphs:
        raise ModelError("the model has no morphs; give them with with_morphs")
    fields = model.fields

    def at(share: float) -> _core.MovedNodes:
        return model.fe.moved(fields.nodes.tolist(), fields.positions(share * amplitudes))

    try:
        return at(1.0)
    except GeometryError as error:
        share, last = _last_good(at, error)
    limits = {m.name: share * float(a) for m, a in zip(model.morphs, amplitudes, strict=True) if a}
    told = ", ".join(f"{n!r} = {plain(a)}" for n, a in limits.items())
    asked = ", ".join(f"{m.name!r} = {plain(a)}" for m, a in zip(model.morphs, amplitudes, strict=True) if a)
    raise GeometryError(
        f"{last} (at {asked}; on this way all elements have a shape up to {told}: keep bounds inside, or let the field "
        "fade over more elements)",
        element=last.element,
        limits=limits,
    ) from None


def _last_good(at: Callable[[float], object], error: GeometryError) -> tuple[float, GeometryError]:
    """Share of the way up to which `at` finds shapes, and the error just behind it."""
    low, high = 0.0, 1.0
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        try:
            at(middle)
            low = middle
        except GeometryError as nearer:
            high, error = middle, nearer
    return low, error


def amplitude_limits(model: Morphed, name: str, reach: float) -> tuple[float, float]:
    """Amplitudes, from -`reach` to `reach` at most, between which all elements of `model` keep their shape when the
    morph `name` moves alone: to 0.1 % of `reach`.

    Raises ModelError for a name that is no morph and a `reach` that is not above 0.
    """
    if not reach > 0:
        raise ModelError(f"the search for limits reaches to {reach:g}; give an amplitude above 0")
    ends = []
    for way in (-reach, reach):
        try:
            moved_nodes(model, amplitudes_of(model, {name: way}))
            ends.append(way)
        except GeometryError as error:
            ends.append(error.limits[name])
    return ends[0], ends[1]
