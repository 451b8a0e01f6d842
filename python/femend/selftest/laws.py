"""Local forces of the concealed truth, written from their definitions and apart from those the diagnosis fits.

Every law gives the force on the structure along its coordinate, from displacement d, velocity v and internal states z,
with its tangents; `rates` are the time derivatives of the states. A law with a `limit` of its state is integrated by a
return map instead (elastic until it slips).
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass

__all__ = ["Absorber", "Bilinear", "BoucWen", "Contact", "Cubic", "Dashpot", "Friction", "Law", "Maxwell", "Quadratic",
           "Spring"]  # fmt: skip

Force = tuple[float, float, float]
States = tuple[float, ...]


@dataclass(frozen=True)
class Law(ABC):
    """A force law; `n_states` internal states start at zero."""

    @property
    def n_states(self) -> int:
        """Number of internal states."""
        return 0

    @abstractmethod
    def force(self, d: float, v: float, z: States) -> Force:
        """Force on the structure and its derivatives by d and v at fixed states `z`."""

    def rates(self, d: float, v: float, z: States) -> States:
        """Time derivatives of the states at `d`, `v`, `z`."""
        return ()

    def state_tangent(self) -> float:
        """Derivative of the force by v through the rates: df/dz dz'/dv, 0 where there is none."""
        return 0.0


@dataclass(frozen=True)
class Spring(Law):
    """f = -k d.

    >>> Spring(100.0).force(0.02, 0.0, ())
    (-2.0, -100.0, 0.0)
    """

    k: float

    def force(self, d: float, v: float, z: States) -> Force:
        """See `Law.force`."""
        return -self.k * d, -self.k, 0.0


@dataclass(frozen=True)
class Dashpot(Law):
    """f = -c v."""

    c: float

    def force(self, d: float, v: float, z: States) -> Force:
        """See `Law.force`."""
        return -self.c * v, 0.0, -self.c


@dataclass(frozen=True)
class Quadratic(Law):
    """f = -c v |v|."""

    c: float

    def force(self, d: float, v: float, z: States) -> Force:
        """See `Law.force`."""
        return -self.c * v * abs(v), 0.0, -2.0 * self.c * abs(v)


@dataclass(frozen=True)
class Cubic(Law):
    """f = -k3 d^3."""

    k3: float

    def force(self, d: float, v: float, z: States) -> Force:
        """See `Law.force`."""
        return -self.k3 * d**3, -3.0 * self.k3 * d * d, 0.0


@dataclass(frozen=True)
class Contact(Law):
    """Spring k behind gaps above and below (inf where there is no stop)."""

    k: float
    above: float
    below: float

    def force(self, d: float, v: float, z: States) -> Force:
        """See `Law.force`."""
        if d > self.above:
            return -self.k * (d - self.above), -self.k, 0.0
        if d < -self.below:
            return -self.k * (d + self.below), -self.k, 0.0
        return 0.0, 0.0, 0.0


@dataclass(frozen=True)
class Bilinear(Law):
    """f = -k_plus d for d > 0, -k_minus d else."""

    k_plus: float
    k_minus: float

    def force(self, d: float, v: float, z: States) -> Force:
        """See `Law.force`."""
        k = self.k_plus if d > 0 else self.k_minus
        return -k * d, -k, 0.0


@dataclass(frozen=True)
class Friction(Law):
    """Jenkins element: spring kt whose force slips at the limit f. The state is that force."""

    f: float
    kt: float

    @property
    def n_states(self) -> int:
        """See `Law.n_states`."""
        return 1

    def slipped(self, z: float, move: float) -> float:
        """The spring's force after the coordinate moved by `move` from where it was `z`."""
        return min(max(z + self.kt * move, -self.f), self.f)

    def force(self, d: float, v: float, z: States) -> Force:
        """See `Law.force`; the tangent holds after the return map."""
        return -z[0], (-self.kt if abs(z[0]) < self.f else 0.0), 0.0


@dataclass(frozen=True)
class BoucWen(Law):
    """f = -alpha k d - (1 - alpha) k z with z' = v - beta |v| |z|^(n-1) z - gamma v |z|^n (Wen 1976, eq. 2-3)."""

    k: float
    alpha: float
    beta: float
    gamma: float
    n: float

    @property
    def n_states(self) -> int:
        """See `Law.n_states`."""
        return 1

    def force(self, d: float, v: float, z: States) -> Force:
        """See `Law.force`."""
        return -self.alpha * self.k * d - (1 - self.alpha) * self.k * z[0], -self.alpha * self.k, 0.0

    def rates(self, d: float, v: float, z: States) -> States:
        """See `Law.rates`."""
        a = abs(z[0])
        return (v - self.beta * abs(v) * a ** (self.n - 1) * z[0] - self.gamma * v * a**self.n,)

    def state_tangent(self) -> float:
        """See `Law.state_tangent`."""
        return -(1 - self.alpha) * self.k


@dataclass(frozen=True)
class Maxwell(Law):
    """Spring k0 beside branches (k_i, tau_i) of a spring and a dashpot in series; states are the branches' forces."""

    k0: float
    branches: tuple[tuple[float, float], ...]

    @property
    def n_states(self) -> int:
        """See `Law.n_states`."""
        return len(self.branches)

    @staticmethod
    def loss(k: float, eta: float, low: float, high: float, n: int = 8) -> Maxwell:
        """A spring `k` with a nearly constant loss factor `eta` between `low` and `high` (rad/s), by `n` branches.

        Equal branches spread evenly over the logarithm of frequency lose alike over it; `k` and `eta` hold in the
        middle, at sqrt(low high).
        """
        rates = [low * (high / low) ** (i / (n - 1)) for i in range(n)]
        w = math.sqrt(low * high)
        branch = eta * k / sum(w * r / (w * w + r * r) for r in rates)
        stored = branch * sum(w * w / (w * w + r * r) for r in rates)
        return Maxwell(k - stored, tuple((branch, 1 / r) for r in rates))

    def force(self, d: float, v: float, z: States) -> Force:
        """See `Law.force`."""
        return -self.k0 * d - sum(z), -self.k0, 0.0

    def rates(self, d: float, v: float, z: States) -> States:
        """See `Law.rates`."""
        return tuple(k * v - f / tau for (k, tau), f in zip(self.branches, z))

    def state_tangent(self) -> float:
        """See `Law.state_tangent`."""
        return -sum(k for k, _ in self.branches)


@dataclass(frozen=True)
class Absorber(Law):
    """A mass m on a spring k and a dashpot c; states are the mass's displacement and velocity."""

    m: float
    k: float
    c: float

    @property
    def n_states(self) -> int:
        """See `Law.n_states`."""
        return 2

    def force(self, d: float, v: float, z: States) -> Force:
        """See `Law.force`."""
        return self.k * (z[0] - d) + self.c * (z[1] - v), -self.k, -self.c

    def rates(self, d: float, v: float, z: States) -> States:
        """See `Law.rates`."""
        return z[1], (self.k * (d - z[0]) + self.c * (v - z[1])) / self.m
