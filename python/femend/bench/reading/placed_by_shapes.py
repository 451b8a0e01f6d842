"""Of turns and shifts that bring a test's geometry onto the model as well as each other, the one that shapes suit."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from femend.bench.reading.compared import OFF
from femend.bench.reading.measured import MeasuredModes
from femend.bench.reading.models import Models, modes_up_to
from femend.correlate import Alignment, compare_modes
from femend.data import ModeSet
from femend.dof import Dof
from femend.errors import FemendError
from femend.numerals import plain

__all__ = ["CLEAR", "SUITED", "by_shapes", "shapes_suit"]

# mean MAC by which one placing, or set of axes, has to suit better than the next
CLEAR = 0.05
# mean MAC below which none is suited: what pairs there are look alike by chance
SUITED = 0.5
# a body has 48 turns of axes onto axes; where more fit, points slide along a mesh
MOST = 48


def by_shapes(found: Alignment, suits: Callable[[Alignment], float | None]) -> Alignment:
    """The one of `found` and its `others` that shapes suit clearly better than any other, told in its last note; as it
    was found where none does, or where more fit than a body has turns. `suits` gives a mean MAC, or None where nothing
    is told."""
    if not 0 < len(found.others) <= MOST:
        return found
    tried = [(score, one) for one in (found, *found.others) if (score := suits(one)) is not None]
    if len(tried) < 2:
        return found
    tried.sort(key=lambda t: -t[0])
    (best, taken), (second, next_one) = tried[:2]
    if best < SUITED or best - second < CLEAR:
        return found
    n = found.alike
    named = next_one.notes[0] if next_one.notes else "none"
    said = (
        f"{n} other {'turn or shift fits' if n == 1 else 'turns or shifts fit'} as well; the one that shapes suit was "
        f"taken, with a mean MAC of {plain(best, 2)} in place of {plain(second, 2)} with the next ({named})"
    )
    # what was found first ends with the note on the others, which this one replaces
    notes = found.notes[:-1] if taken is found else taken.notes
    others = tuple(one for one in (found, *found.others) if one is not taken)
    return replace(taken, alike=n, notes=(*notes, said), decided=True, others=others)


def shapes_suit(models: Models, mac_min: float) -> Callable[[Sequence[Any], Mapping[Dof, Dof]], float | None]:
    """A function of recordings and the model's DOFs for their sensors that gives the mean MAC of the pairs near in
    frequency, over all measured modes to fit; None where nothing can be compared. Modes of the `models` are solved
    once."""
    solved: dict[tuple[str, float, int], ModeSet] = {}

    def modes_for(m: MeasuredModes, test: ModeSet) -> ModeSet:
        key = (m.configuration, float(test.freq[-1]), test.n_modes)
        if key not in solved:
            solved[key] = modes_up_to(models.of(m.configuration), key[1], key[2])
        return solved[key]

    def suits(measured: Sequence[Any], places: Mapping[Dof, Dof]) -> float | None:
        mac, count = 0.0, 0
        for m in measured:
            if not isinstance(m, MeasuredModes) or m.role != "fit":
                continue
            test = m.modes.to_mode_set()
            try:
                modes = modes_for(m, test)
                pairs = compare_modes(test, modes, places=dict(places), mac_min=mac_min).pairing.pairs
            except FemendError:
                return None  # what cannot be compared prefers nothing
            near = [p.mac for p in pairs if 1 / OFF < modes.freq[p.b] / test.freq[p.a] < OFF]
            mac, count = mac + float(np.sum(near)), count + test.n_modes
        return mac / count if count else None

    return suits
