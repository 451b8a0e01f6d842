"""What a law that explains whole recordings left on its way there: laws of other places far behind it are given up."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

__all__ = ["OUTDONE", "Pace"]

# a law that leaves so many times what one leaves that explains the recordings does not get as far as that any more
OUTDONE = 4.0


@dataclass(frozen=True, eq=False)
class Pace:
    """Least costs, with everything free, in windows exp(-sigma t) of laws that came to explain whole recordings."""

    _costs: dict[float, float] = field(default_factory=dict)

    def keep(self, path: Iterable[tuple[float, float]]) -> None:
        """Takes in the windows' decays (1/s) and the costs in them of a law that explains whole recordings."""
        for sigma, cost in path:
            self._costs[sigma] = min(cost, self._costs.get(sigma, cost))

    def outdone(self, sigma: float, cost: float) -> bool:
        """Whether a law of this `cost` in the window exp(-sigma t) is far behind one that explains whole recordings."""
        return sigma in self._costs and cost > OUTDONE * self._costs[sigma]
