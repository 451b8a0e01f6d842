"""What a Nastran deck says of its rotors: grids, sense and relative speed, by the cards of MSC and of Siemens."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from femend import _core
from femend.model.cards.real_field import real
from femend.numerals import listed, plain

__all__ = ["RotorCards", "rotor_cards"]

# speeds of two rotors count as in proportion up to this share of the highest
PROPORTIONAL = 1e-3
_SPEED_UNITS = {"RPM": 1.0 / 60.0, "FREQ": 1.0}
# ROTORD holds a rotor in every line from its third one on
_ROW, _FIRST_ROW = 8, 2


@dataclass(frozen=True, slots=True)
class RotorCards:
    """The rotor `number`: its `grids`, the `ends` (from, to) or the vector `along` by which its positive sense is told,
    and its speed in those of the reference rotor, `ratio`."""

    number: int
    grids: tuple[int, ...]
    ends: tuple[int, int] | None = None
    along: tuple[float, float, float] | None = None
    ratio: float = 1.0


def rotor_cards(deck: _core.Deck) -> tuple[list[RotorCards], list[str]]:
    """The rotors of the `deck`, that of reference first, and a sentence for everything about them that is not clear.

    MSC Nastran Quick Reference Guide: ROTORG, RSPINR, RSPINT, RGYRO, DDVAL. Siemens NX Nastran: ROTORG with ROTORD, of
    which case control (RMETHOD) selects one.
    """
    grids: dict[int, list[int]] = {}
    told: list[str] = []
    for card in deck.cards("ROTORG"):
        number = int(card[0])
        try:
            grids.setdefault(number, []).extend(_expanded(card[1:]))
        except ValueError:
            told.append(f"ROTORG {number}: {' '.join(card[1:4])!r} … is no list of grids, and is left out")
    if deck.cards("ROTORD"):
        return _siemens(deck, grids, told), told
    return _msc(deck, grids, told), told


def _msc(deck: _core.Deck, grids: dict[int, list[int]], told: list[str]) -> list[RotorCards]:
    spins = {int(c[0]): c for name in ("RSPINT", "RSPINR") for c in deck.cards(name)}
    reference = _reference(deck, grids, told)
    speeds: dict[int, list[float]] = {}
    for number, card in spins.items():
        try:
            speeds[number] = _speeds(deck, card)
        except (ValueError, IndexError, KeyError):
            told.append(
                f"rotor {number}: its speed ({' '.join(card[3:5])}) is not read; it counts as that of the others"
            )
    found = []
    for number in sorted(grids, key=lambda n: n != reference):
        spin = spins.get(number)
        ends = None
        if spin is not None and len(spin) > 2 and spin[1] and spin[2]:
            ends = int(spin[1]), int(spin[2])
        ratio = _ratio(number, reference, speeds, told)
        found.append(RotorCards(number, tuple(grids[number]), ends, None, ratio))
    return found


def _siemens(deck: _core.Deck, grids: dict[int, list[int]], told: list[str]) -> list[RotorCards]:
    cards = deck.cards("ROTORD")
    chosen = deck.case_control().get("RMETHOD", cards[0][0])
    at = next((i for i, c in enumerate(cards) if c[0] == chosen), None)
    if at is None:
        told.append(f"case control selects RMETHOD = {chosen}, and the deck has no such ROTORD; nothing turns")
        return []
    if len(cards) > 1 and "RMETHOD" not in deck.case_control():
        told.append(f"of {len(cards)} ROTORD the first counts, as case control selects none (RMETHOD)")
    found = []
    fields = cards[at]
    for row in range(_FIRST_ROW, -(-len(fields) // _ROW) + 1):
        own = [*fields, *[""] * _ROW][_ROW * row : _ROW * (row + 1)]
        if not own[0]:
            continue
        number, group = int(own[0]), int(own[1] or own[0])
        if group not in grids:
            told.append(f"rotor {number}: ROTORD names ROTORG {group}, which is not there; the rotor is taken at rest")
            continue
        axis = deck.third_axis("ROTORD", at, 10 * row + 5)
        ratio = real(own[2]) if own[2] else 1.0
        found.append(RotorCards(number, tuple(grids[group]), None, (axis[0], axis[1], axis[2]), ratio))
    # speeds are given in those of a rotor of ratio 1
    found.sort(key=lambda r: r.ratio != 1.0)
    return found


def _expanded(fields: Sequence[str]) -> Iterable[int]:
    """Ids as they are listed, or "a THRU b BY c"."""
    words = [f.upper() for f in fields if f]
    if "THRU" not in words:
        return [int(w) for w in words]
    first, last = int(words[0]), int(words[2])
    return range(first, last + 1, int(words[4]) if len(words) > 4 else 1)


def _reference(deck: _core.Deck, grids: dict[int, list[int]], told: list[str]) -> int:
    cards = {c[0]: c for c in deck.cards("RGYRO")}
    chosen = deck.case_control().get("RGYRO")
    card = cards.get(chosen) if chosen is not None else next(iter(cards.values()), None)
    if card is not None and len(card) > 2 and card[2] and int(card[2]) in grids:
        return int(card[2])
    first = min(grids, default=0)
    if len(grids) > 1:
        told.append(
            f"the deck does not say which of the rotors {listed(sorted(grids), 6)} is that of reference (RGYRO): "
            f"speeds are those of rotor {first}"
        )
    return first


def _speeds(deck: _core.Deck, card: Sequence[str]) -> list[float]:
    """Speeds of a rotor in rev per unit of time; raises ValueError, IndexError or KeyError where there are none."""
    unit, text = _SPEED_UNITS[card[3].upper()], card[4]
    if not text.isdigit():
        return [unit * real(text)]
    values: list[float] = []
    for table in deck.cards("DDVAL"):
        if table[0] != text:
            continue
        words = [w.upper() for w in table[1:] if w]
        if "THRU" in words:
            first, last, step = real(words[0]), real(words[2]), real(words[4])
            values += np.arange(first, last + 0.5 * step, step).tolist()
        else:
            values += [real(w) for w in words]
    if not values:
        raise ValueError(text)
    return [unit * v for v in values]


def _ratio(number: int, reference: int, speeds: dict[int, list[float]], told: list[str]) -> float:
    """Speed of a rotor in those of the reference: least squares through 0 over the speeds of both tables."""
    if number == reference or number not in speeds or reference not in speeds:
        if number != reference:
            told.append(f"rotor {number}: its speed is not told against that of rotor {reference}; both turn alike")
        return 1.0
    a, b = np.array(speeds[reference]), np.array(speeds[number])
    n = min(a.size, b.size)
    if a.size != b.size or not np.any(a):
        told.append(
            f"rotor {number}: {b.size} speeds of it stand beside {a.size} of rotor {reference}; the last ones of both "
            "are taken as those of one instant"
        )
        a, b = a[-1:], b[-1:]
        n = 1
    if not np.any(a[:n]):
        return 1.0
    ratio = float(a[:n] @ b[:n] / (a[:n] @ a[:n]))
    off = float(np.abs(b[:n] - ratio * a[:n]).max() / np.abs(b[:n]).max()) if np.any(b[:n]) else 0.0
    if off > PROPORTIONAL:
        told.append(
            f"rotor {number}: its speeds are not in proportion to those of rotor {reference} (off by "
            f"{plain(100 * off, 2)} % of the highest); it is taken to turn {plain(ratio)} times as fast at all speeds"
        )
    return ratio
