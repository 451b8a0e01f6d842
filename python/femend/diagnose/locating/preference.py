"""Which of places that explain as much is the likeliest."""

from __future__ import annotations

from femend.model import Place

__all__ = ["LIKELIER", "preference", "with_one_force"]

# cost by which pairs of places are put in the order of their preference
LIKELIER = 2.0


def preference(place: Place) -> int:
    """Rank of a place among those that fit alike: a brace to a support before the ground, which it includes; joints
    before what nothing of the model suggests."""
    if place.unlikely:
        return 5
    order = {"pair": 0 if not place.direction else 2, "ground": 1}
    order |= dict.fromkeys(("member", "region", "connection", "end", "clamp", "support"), 3)
    return order.get(place.kind, 4)


def with_one_force(place: Place) -> bool:
    """Whether a place of the structure itself has one force: no part of the model, no motion of its base."""
    return place.n_w == 1 and not place.part and place.kind != "base"
