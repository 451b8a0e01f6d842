"""The ids nearest to one that does not exist, as a message names them."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

__all__ = ["near_ids"]

# ids that a message names at most
MOST = 4


def near_ids(wanted: int, ids: ArrayLike) -> str:
    """The `ids` (n,) nearest to `wanted`, which is none of them: those that one digit less, more, other or exchanged
    with its neighbour makes of it (a slip of the keyboard), then the next below and above. "there are none" for no ids.

    >>> near_ids(9107, [101, 103, 105, 107, 403])
    'nearest ids 107, 403'
    >>> near_ids(104, [101, 103, 105, 107])
    'nearest ids 103, 105, 101, 107'
    """
    known = np.unique(np.asarray(ids, dtype=np.int64))
    if not known.size:
        return "there are none"
    at = int(np.searchsorted(known, wanted))
    beside = sorted(map(int, known[max(0, at - 1) : at + 1]), key=lambda n: abs(n - wanted))
    slips = sorted(_slips(wanted) & set(known.tolist()), key=lambda n: (abs(n - wanted), n))
    named = list(dict.fromkeys([*slips, *beside]))[:MOST]
    return f"nearest id{'s' * (len(named) > 1)} {', '.join(map(str, named))}"


def _slips(wanted: int) -> set[int]:
    text, digits = str(wanted), "0123456789"
    n = len(text)
    found = {text[:i] + text[i + 1 :] for i in range(n)}
    found |= {text[:i] + d + text[i + 1 :] for i in range(n) for d in digits}
    found |= {text[:i] + d + text[i:] for i in range(n + 1) for d in digits}
    found |= {text[:i] + text[i + 1] + text[i] + text[i + 2 :] for i in range(n - 1)}
    return {int(t) for t in found if t.isdigit()} - {wanted}
