"""Small models and problems for the tests of updating."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from femend.estimate.updating import (
    AffineMatrices,
    Configuration,
    Frequencies,
    ModeTest,
    Problem,
    ShapeDifferences,
    State,
    Unknown,
    Unknowns,
    affine_matrices,
    factor,
    modal_system,
)

Array = NDArray[np.float64]
STIFFNESS = np.array([1.0, 1.3, 0.9, 1.2, 1.1, 0.8]) * 1e3
MASS = np.array([1.0, 0.8, 1.2, 0.9, 1.1, 0.7])
TRUTH = np.array([0.8, 1.2, 0.95, 1.1])


def chain(n_groups: int = 3) -> AffineMatrices:
    """Six masses in a row on springs in `n_groups` groups k1, k2, ..., and a factor m on the last mass."""
    parts = {f"k{g + 1}": np.zeros((6, 6)) for g in range(n_groups)}
    for i, k in enumerate(STIFFNESS):
        b = np.zeros(6)
        b[i] = 1.0
        if i:
            b[i - 1] = -1.0
        parts[f"k{i % n_groups + 1}"] += k * np.outer(b, b)
    last = np.diag([0.0] * 5 + [MASS[5]])
    return affine_matrices(parts, np.diag(MASS) - last, M_parts={"m": last})


def chain_problem(
    truth: Array = TRUTH, sd: float = 0.3, bounds: tuple[float, float] | None = (0.4, 2.0), noise: float = 0.0
) -> Problem:
    """Four modes of the chain at `truth`, seen at all masses; frequencies to 0.1 %, shapes to 1 %."""
    rng = np.random.default_rng(3)
    system = modal_system(chain(), list(range(6)), 6)
    state = system.solve(truth)
    freq, phi = state.value("freq")[:4], state.value("phi")[:, :4]
    phi = phi / np.abs(phi).max(axis=0)
    freq = freq * (1 + noise * 1e-3 * rng.standard_normal(4))
    phi = phi + noise * 1e-2 * rng.standard_normal(phi.shape)
    responses = (Frequencies(freq, 1e-3 * freq), ShapeDifferences(phi, 0.01))
    unknowns = Unknowns.of([factor(n, sd, bounds) for n in ("k1", "k2", "k3", "m")])
    return Problem(unknowns, (Configuration("chain", system, responses, ModeTest(freq, phi)),))


class LinearSystem:
    """Results y = A x: every estimator has a closed answer."""

    def __init__(self, A: Array) -> None:
        self.A = A
        self.names = tuple(f"x{i + 1}" for i in range(A.shape[1]))
        self.defaults: dict[str, float] = {}

    def solve(self, factors: Array) -> State:
        return State({"y": self.A @ factors}, lambda _: {"y": self.A.T.copy()})


class FunctionSystem:
    """Results y = f(x) with derivatives by differences."""

    def __init__(self, names: tuple[str, ...], function: Callable[[Array], Array]) -> None:
        self.names = names
        self.function = function
        self.defaults: dict[str, float] = {}

    def solve(self, factors: Array) -> State:
        def slopes(_: int | None) -> dict[str, Array]:
            h = 1e-6
            rows = [
                (self.function(factors + h * e) - self.function(factors - h * e)) / (2 * h)
                for e in np.eye(len(factors))
            ]
            return {"y": np.array(rows)}

        return State({"y": self.function(factors)}, slopes)


def free(name: str, sd: float, bounds: tuple[float, float] | None = None) -> Unknown:
    """An unknown about 0."""
    return Unknown(name, 1.0, False, 0.0, sd, bounds=bounds)
