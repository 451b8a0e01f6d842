"""Numbers and lists in sentences, as an engineer writes them."""

from __future__ import annotations

from collections.abc import Iterable

__all__ = ["listed", "plain"]

# from here on the zeros have to be counted, and an exponent reads better
_COUNTLESS = 1e7


def plain(value: float, digits: int = 4, *, signed: bool = False) -> str:
    """`value` with `digits` significant digits, without zeros behind its point and, below ten millions, without an
    exponent; with its sign, `signed`, also where that is a plus.

    It is what a sentence takes, where `.4g` writes 1.2e+04; `femend.report.numbers` has what tables and the page take,
    with zeros kept and signs set in type.

    >>> plain(12345.6), plain(999.6, 3), plain(0.25), plain(2e11), plain(130.4, 2, signed=True)
    ('12350', '1000', '0.25', '2e+11', '+130')
    """
    rounded, sign = float(f"{value:.{digits}g}"), "+" if signed else ""
    return f"{rounded:{sign}.0f}" if 10**digits <= abs(rounded) < _COUNTLESS else f"{value:{sign}.{digits}g}"


def listed(items: Iterable[object], most: int, between: str = ", ") -> str:
    """The first `most` of `items` with what stands `between` them, and how many there are more.

    >>> listed([4, 7, 9, 12], 2), listed("ab", 2), listed(["one", "two", "three"], 1, "; ")
    ('4, 7 and 2 more', 'a, b', 'one; and 2 more')
    """
    every = [str(item) for item in items]
    said, more = between.join(every[:most]), len(every) - most
    if more <= 0:
        return said
    return f"{said}{' ' if between == ', ' else between}and {more} more"
