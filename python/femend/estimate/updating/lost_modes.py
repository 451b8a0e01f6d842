"""Measured modes that lose their mate during a search, and those that find one.

A mode without a mate is compared with what is left over in the model, and pulls the parameters there. While a search
goes down, it goes on counting all the same: a mode that passes another one, or turns into one and back, would be lost
for good, and no cost is to fall since a mode was. Where the search ends and a mode still has no mate, it is let go, and
the search goes on from the last point at which it had one: of what was tried (from the end; as soon as a mode is lost;
refusing steps that lose one) that leads nearest to the truth. Where what is left is explained then, and the mode has a
mate again, it counts once more; of a model that lacks something a mode that comes back leads away. Let go twice, it
stays out.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from femend.estimate.updating.history import Iteration
from femend.estimate.updating.problem import Configuration, Evaluation
from femend.numerals import plain

__all__ = ["CONTRADICTED", "EXPLAINED", "Flags", "Times", "back_again", "last_paired", "lost", "modes_of", "out_of"]

# squares a value up to which data are explained: residuals of two deviations
EXPLAINED = 4.0
# in place of how often a mode was let go: all others contradict it, and it does not come back
CONTRADICTED = 3
# for each configuration one value a test mode, None where the configuration has no modes
Flags = tuple[NDArray[np.bool_] | None, ...]
Times = tuple[NDArray[np.int64] | None, ...]


def lost(here: Evaluation, mac_min: float) -> Flags:
    """Test modes that count `here` and have no mate of `mac_min`."""
    return tuple(None if m is None else (m.mate >= 0) & ~(m.mac >= mac_min) for m in here.mates)


def back_again(here: Evaluation, active: Flags, let_go: Times, mac_min: float) -> Flags:
    """Test modes that were let go once, are not `active` and have a mate `here`, where all else is explained."""
    explained = here.squares <= EXPLAINED * here.n_values
    return tuple(
        None if m is None or a is None or n is None else ~a & (n == 1) & (m.mac >= mac_min) & explained
        for m, a, n in zip(here.mates, active, let_go, strict=True)
    )


def last_paired(iterations: Sequence[Iteration], modes: Flags, mac_min: float) -> int | None:
    """The last of the `iterations` at which all of the test `modes` counted and had mates; None where there is none."""
    for k in range(len(iterations) - 1, -1, -1):
        then = iterations[k]
        if len(then.mac) != len(modes):
            continue  # kept by an earlier version, which did not say
        if all(
            own is None or all(then.mates[c][i] >= 0 and then.mac[c][i] >= mac_min for i in np.flatnonzero(own))
            for c, own in enumerate(modes)
        ):
            return k
    return None


def modes_of(
    configurations: Sequence[Configuration], modes: Flags, here: Evaluation, with_mac: bool = False
) -> list[str]:
    """The test `modes` by the numbers they are told by, configuration by configuration: "tip: test mode 3"; `with_mac`
    their agreement with what is left for them `here`."""
    said = []
    for c, own, mates in zip(configurations, modes, here.mates, strict=True):
        if c.test is None or own is None or mates is None or not own.any():
            continue
        at = np.flatnonzero(own).tolist()
        each = [f"{c.test.numbers[i]}{f' (MAC {plain(mates.mac[i], 3)})' * with_mac}" for i in at]
        said.append(f"{c.name}: test mode{'s' * (len(at) > 1)} {', '.join(each)}")
    return said


def out_of(here: Evaluation, let_go: Sequence[Sequence[int]]) -> list[tuple[int, int]]:
    """(configuration, test mode) from 0 of modes that were let go and do not count `here`."""
    return [
        (c, int(i))
        for c, (times, mates) in enumerate(zip(let_go, here.mates, strict=False))
        if mates is not None
        for i in np.flatnonzero((np.asarray(times, dtype=np.int64) > 0) & (mates.mate < 0))
    ]
