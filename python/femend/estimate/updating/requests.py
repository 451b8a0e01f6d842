"""What beside modes a model is asked for: FRFs, static displacements."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from femend.errors import UpdatingError

__all__ = ["DAMPING", "Frfs", "Statics", "damping_matrix"]

FloatArray = NDArray[np.float64]

# parameters of the damping: C = alpha M + beta K, and a loss factor eta of K
DAMPING = ("alpha", "beta", "eta")
POWERS = {"receptance": 0, "mobility": 1, "accelerance": 2}


@dataclass(frozen=True, eq=False)
class Frfs:
    """FRFs at `freq` (n_freq,) in Hz from sensors `inputs` to sensors `outputs`, both by row.

    `kind` is receptance, mobility or accelerance. Raises UpdatingError for another one.
    """

    freq: FloatArray
    outputs: tuple[int, ...]
    inputs: tuple[int, ...]
    kind: str = "accelerance"

    def __post_init__(self) -> None:
        if self.kind not in POWERS:
            raise UpdatingError(f"FRFs of kind {self.kind!r}; there are {', '.join(POWERS)}")

    @property
    def s(self) -> NDArray[np.complex128]:
        """i omega (n_freq,) in rad/s."""
        return np.asarray(2j * np.pi * np.asarray(self.freq))

    @property
    def scale(self) -> NDArray[np.complex128]:
        """What makes the kind out of the receptance, (n_freq,)."""
        return np.asarray(self.s ** POWERS[self.kind])


@dataclass(frozen=True, eq=False)
class Statics:
    """Static displacements at sensors `outputs` (by row) under `loads` (n, n_cases) on the model's own DOFs."""

    loads: FloatArray
    outputs: tuple[int, ...]


def damping_matrix(K: Any, M: Any, values: FloatArray) -> tuple[Any, Any]:
    """C = alpha `M` + beta `K` and H = eta `K` for `values` (3,), in whatever form K and M have."""
    alpha, beta, eta = (float(v) for v in values)
    return alpha * M + beta * K, eta * K
