"""Fields of cards whose layout depends on what stands on them: stations of beams, groups of bushes, plies, corners."""

from __future__ import annotations

from femend import _core
from femend.errors import DeckError

__all__ = ["beam_fields", "bush_fields", "corner_fields", "is_tapered", "ply_fields"]

# first field of the values of end A of a PBEAM, and where they stand behind that, as at every station
_END_A = 4
_STATION = {"A": 0, "I1": 1, "I2": 2, "J": 4}
_STATIONS = ("YES", "YESA", "NO")
# fields of a tapered section that its stations are looked for in
_TAPERED = 200
# flags of the groups of a PBUSH, each in field 3 of a line before its values
_GROUPS = {"k": "K", "c": "B"}
# K, B, GE, M and RCV
_BUSH_LINES = 5
# fields that plies are looked for in
_PLIES = 5000


def bush_fields(deck: _core.Deck, id_: int, quantity: str) -> list[int]:
    """Fields of a PBUSH for `quantity` (k1 to k6, c1 to c6, eta), whatever the order of its groups; none where the card
    has no such group."""
    if quantity == "eta":
        flag, values = "GE", range(1, 7)
    elif quantity[0] in _GROUPS and quantity[1:] in "123456":
        flag, values = _GROUPS[quantity[0]], range(int(quantity[1:]), int(quantity[1:]) + 1)
    else:
        return []
    at = [k for k in range(3, 10 * 2 * _BUSH_LINES, 10) if _word(deck, "PBUSH", id_, k) == flag]
    # of a group that stands there twice the last one counts
    return [at[-1] + k for k in values] if at else []


def beam_fields(deck: _core.Deck, id_: int, quantity: str) -> list[int]:
    """Fields of a PBEAM for A, I1, I2 or J at end A and every station; those blank are as at end A, or between."""
    if quantity not in _STATION:
        return []
    starts = [_END_A]
    # stress points of end A stand in the second line unless a station follows at once
    row = 1 if _word(deck, "PBEAM", id_, 12) in _STATIONS else 2
    while (word := _word(deck, "PBEAM", id_, 10 * row + 2)) in _STATIONS:
        starts.append(10 * row + 4)
        row += 2 if word == "YES" else 1
    return [start + _STATION[quantity] for start in starts]


def is_tapered(deck: _core.Deck, pid: int) -> bool:
    """Whether a section may change along its beam: its PBEAM or PBEAML then says at which stations stresses are asked
    for; so may one on any other card."""
    for card in ("PBEAM", "PBEAML"):
        try:
            return any(_word(deck, card, pid, k) in _STATIONS for k in range(12, _TAPERED))
        except DeckError:
            continue
    return True


def ply_fields(deck: _core.Deck, card: str, id_: int) -> list[int]:
    """Fields of the thicknesses of a PCOMP or PCOMPG; a ply whose own is blank has that of the one before."""
    texts = {k: _word(deck, card, id_, k) for k in range(12, _PLIES) if 2 <= k % 10 <= 9}
    last = max((k for k, text in texts.items() if text), default=0)
    return [k for k in texts if k <= last and k % 10 in ((3, 7) if card == "PCOMP" else (4,))]


def corner_fields(deck: _core.Deck, card: str, id_: int) -> list[int] | None:
    """Fields of the thicknesses at the corners of a CQUAD4 or CTRIA3; None where they are shares of the property's
    (TFLAG = 1)."""
    if _word(deck, card, id_, 13) == "1":
        return None
    return list(range(14, 18 if card == "CQUAD4" else 17))


def _word(deck: _core.Deck, card: str, id_: int, field: int) -> str:
    return deck.field_text(card, id_, field).strip().upper()
