"""What a model says at one set of factors, with the derivatives made when they are asked for."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from femend.errors import UpdatingError

__all__ = ["State", "System", "check_factors"]

FloatArray = NDArray[np.float64]


class State:
    """Results of one analysis by name, `values`, and their derivatives, `slopes`, with a leading axis of parameters.

    Names that the responses know: "freq" (n_modes,) Hz, "phi" (n_sensors, n_modes), "frf" (n_freq, n_out, n_in),
    "static" (n_out, n_cases), "mass" (1,), "centre" (3,), "pole" (n_speeds, n_modes) rad/s. `make_slopes`
    is called when a derivative is first asked for, with the number of modes of which derivatives are needed (`need`),
    None for all.

    >>> State({"freq": np.ones(2)}, lambda n: {"freq": np.zeros((3, 2))}).slopes["freq"].shape
    (3, 2)
    """

    def __init__(
        self,
        values: Mapping[str, NDArray[Any]],
        make_slopes: Callable[[int | None], Mapping[str, NDArray[Any]]],
    ) -> None:
        self.values = dict(values)
        self._make_slopes = make_slopes
        self._needed: int | None = None
        self._slopes: dict[str, NDArray[Any]] | None = None

    def need(self, n_modes: int | None) -> None:
        """Derivatives of modes beyond the first `n_modes` are not needed (None: all are): they may be left out."""
        enough = self._needed is None or (n_modes is not None and n_modes <= self._needed)
        if self._slopes is not None and not enough:
            self._slopes = None
        if self._slopes is None:
            self._needed = n_modes

    @property
    def slopes(self) -> dict[str, NDArray[Any]]:
        """Derivatives by name, (n_parameters, ...) each."""
        if self._slopes is None:
            self._slopes = dict(self._make_slopes(self._needed))
        return self._slopes

    def value(self, name: str) -> NDArray[Any]:
        """One result by `name`; raises UpdatingError where the model was not asked for it."""
        if name not in self.values:
            raise UpdatingError(
                f"a response needs {name!r} of the model, which gives {', '.join(self.values)}; ask the system for it"
            )
        return self.values[name]

    def slope(self, name: str) -> NDArray[Any]:
        """Derivative of one result by `name`; raises UpdatingError where there is none."""
        if name not in self.slopes:
            raise UpdatingError(f"the model gives no derivative of {name!r}; it cannot be fitted by gradients")
        return self.slopes[name]


class System(Protocol):
    """A model that can be solved at factors: matrices, a deck, or a solver of the user's own."""

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters, in the order of the factors."""

    def solve(self, factors: FloatArray) -> State:
        """The results at `factors` (n_parameters,); raises FemendError where there are none."""


def check_factors(names: Sequence[str], factors: FloatArray) -> None:
    """Raises UpdatingError where `factors` are not one for each parameter of these `names`."""
    if np.shape(factors) != (len(names),):
        raise UpdatingError(
            f"factors of shape {np.shape(factors)} were given for the {len(names)} parameters {', '.join(names)}; give "
            "one for each, in this order"
        )
