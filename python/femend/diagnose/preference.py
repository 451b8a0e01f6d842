"""Which of places that explain as much is the likeliest."""

from __future__ import annotations

from femend.model import Place

__all__ = ["preference"]


def preference(place: Place) -> int:
    """Rank of a place among those that fit alike: a brace to a support before the ground, which it includes; joints
    before what nothing of the model suggests."""
    if place.unlikely:
        return 5
    order = {"pair": 0 if not place.direction else 2, "ground": 1}
    order |= dict.fromkeys(("member", "region", "end", "clamp", "support"), 3)
    return order.get(place.kind, 4)
