"""What a law that explains whole recordings left on its way there: laws of other places far behind it are given up."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

__all__ = ["OUTDONE", "OUTDONE_SOON", "Pace"]

# a law that leaves so many times what one leaves that explains the recordings does not get as far as that any more
OUTDONE = 4.0
# the same while the law alone has been fitted, in a few steps
OUTDONE_SOON = OUTDONE**2


@dataclass(frozen=True, eq=False)
class Pace:
    """Least costs in windows exp(-sigma t), with everything free but in the first, of laws that came to explain whole
    recordings."""

    _costs: dict[float, float] = field(default_factory=dict)

    def keep(self, path: Iterable[tuple[float, float]]) -> None:
        """Takes in the windows' decays (1/s) and the costs in them of a law that explains whole recordings."""
        for sigma, cost in path:
            self._costs[sigma] = min(cost, self._costs.get(sigma, cost))

    def is_set(self, sigma: float) -> bool:
        """Whether a law that explains whole recordings came through the window exp(-sigma t)."""
        return sigma in self._costs

    def outdone(self, sigma: float, cost: float, factor: float = OUTDONE) -> bool:
        """Whether a law of this `cost` in the window exp(-sigma t) is behind one that explains whole recordings by more
        than a `factor`."""
        return sigma in self._costs and cost > factor * self._costs[sigma]
