"""What beside modes a model is asked for: FRFs, static displacements."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from femend.errors import UpdatingError

__all__ = ["DAMPING", "Frfs", "Statics", "Whirls", "damping_matrix"]

FloatArray = NDArray[np.float64]

# parameters of the damping: C = alpha M + beta K, and a loss factor eta of K
DAMPING = ("alpha", "beta", "eta")
POWERS = {"receptance": 0, "mobility": 1, "accelerance": 2}


@dataclass(frozen=True, eq=False)
class Frfs:
    """FRFs at `freq` (n_freq,) in Hz from sensors `inputs` to sensors `outputs`, both by row.

    `kind` is receptance, mobility or accelerance. `speed` (n_freq,) or one number is the shaft's in rad/s, positive by
    the right hand about the axes of the parts that turn, for a system that turns (`rotor_system`); others are at rest
    whatever it is. Lines of several speeds follow each other. Raises UpdatingError for another kind, and speeds that do
    not fit the lines or are no numbers.
    """

    freq: FloatArray
    outputs: tuple[int, ...]
    inputs: tuple[int, ...]
    kind: str = "accelerance"
    speed: FloatArray | None = None

    def __post_init__(self) -> None:
        if self.kind not in POWERS:
            raise UpdatingError(f"FRFs of kind {self.kind!r}; there are {', '.join(POWERS)}")
        if self.speed is None:
            return
        speed, n = np.asarray(self.speed, dtype=np.float64), np.size(self.freq)
        if speed.shape not in ((), (n,)) or not np.isfinite(speed).all():
            raise UpdatingError(
                f"FRFs on {n} lines at speeds of shape {speed.shape}, or speeds that are no numbers; give one in "
                "rad/s, or one a line"
            )
        object.__setattr__(self, "speed", np.array(np.broadcast_to(speed, (n,))))

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


@dataclass(frozen=True, eq=False)
class Whirls:
    """The lowest `n_modes` complex modes by |pole| at each of the shaft's `speeds` (n_speeds,) in rad/s, rising.

    Raises UpdatingError for speeds that do not rise or lie below 0, and no mode.
    """

    speeds: FloatArray
    n_modes: int

    def __post_init__(self) -> None:
        speeds = np.atleast_1d(np.asarray(self.speeds, dtype=np.float64))
        object.__setattr__(self, "speeds", speeds)
        if speeds.ndim != 1 or not speeds.size or not np.isfinite(speeds).all() or not (np.diff(speeds) > 0).all():
            raise UpdatingError(
                f"modes at speeds of shape {speeds.shape} that do not rise or are no numbers; give each once, in rad/s"
            )
        if speeds[0] < 0:
            raise UpdatingError(
                f"modes at a speed of {speeds[0]:g} rad/s; forward is the sense in which the parts turn, so take "
                "speeds from 0 on and turn the axis of the parts around"
            )
        if self.n_modes < 1:
            raise UpdatingError(f"{self.n_modes} modes at every speed; ask for one or more")


def damping_matrix(K: Any, M: Any, values: FloatArray) -> tuple[Any, Any]:
    """C = alpha `M` + beta `K` and H = eta `K` for `values` (3,), in whatever form K and M have."""
    alpha, beta, eta = (float(v) for v in values)
    return alpha * M + beta * K, eta * K
