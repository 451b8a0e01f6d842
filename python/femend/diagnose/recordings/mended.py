"""A model fitted to recordings without what they are off by, where that is read off the model itself.

What is read off a model that still follows what recordings are off by is too small: fitted again without as much, it
tells more. These rounds are made on few lines; the model is updated in the end.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from femend.diagnose.locating.locate import LINES, Located, cost_of, locate
from femend.diagnose.recordings.recorded_off import RecordedOff
from femend.diagnose.settings import Settings
from femend.diagnose.updating.update import UpdatedModel, update_model
from femend.estimate import Fit
from femend.model import Place

__all__ = ["can_be_off", "mended"]

FloatArray = NDArray[np.float64]
Off = TypeVar("Off", bound=RecordedOff)

# share of its cost that the updated model has left at most, and of its misfit on few lines, where rounds may end early
LEFT, PROMISING = 0.25, 0.5
# rounds, and steps of a fit
ROUNDS, STEPS = 30, 8


def can_be_off(start: UpdatedModel, settings: Settings) -> bool:
    """Whether an updated model leaves so much of recordings in time, with forces, that they may be off as a whole."""
    timed = all(r.driven and r.frf is None for r in start.problem.records)
    return timed and start.null.score > settings.far


def mended(
    start: UpdatedModel,
    located: Sequence[Located],
    places: Sequence[Place],
    zeta: float,
    first: FloatArray,
    read: Callable[[Fit], FloatArray],
    made: Callable[[FloatArray], Off | None],
    close: float,
) -> tuple[Off, UpdatedModel, list[Located]] | None:
    """What recordings are off by, `made` of numbers (n,) that begin as `first` and are `read` off the fitted model
    until they change by no more than `close`; with the model updated without it, and where something is missing in
    that, of all `places`. None where nothing is, and where the updated model does not do far better so, and better than
    with a force at one of the places `located`. `zeta` is the starting damping ratio."""
    numbers, promising = _settled(start, first, read, made, close)
    off = made(numbers)
    # two updates from afar are for what has come near on few lines
    if off is None or not promising:
        return None
    again = _updated(start, off, zeta)
    closer = made(read(again.null))
    if closer is not None and closer != off:
        off, again = closer, _updated(start, closer, zeta)
    best = min((one.cost for one in located), default=np.inf)
    if cost_of(again.problem, again.null, 0.0) > min(LEFT * cost_of(start.problem, start.null, 0.0), best):
        return None
    return off, again, locate(again.problem, again.reduced, places, again.null)


def _updated(start: UpdatedModel, off: RecordedOff, zeta: float) -> UpdatedModel:
    return update_model(start.reduced.model, [off.on(r) for r in start.problem.records], zeta)


def _settled(
    start: UpdatedModel,
    numbers: FloatArray,
    read: Callable[[Fit], FloatArray],
    made: Callable[[FloatArray], RecordedOff | None],
    close: float,
) -> tuple[FloatArray, bool]:
    """The numbers of `mended` after its rounds, and whether these leave far less of the few lines they are made on:
    each fit begins where the one before ended, and from the deck."""
    few, null, none = start.problem.sparing(LINES), start.null, np.zeros(0)
    p, drawn = null.p, start.problem.prior(start.reduced)[0]
    (as_it_is,) = few.fit([null.hypothesis], [(p, none)], iterations=STEPS)
    left = np.inf
    for _ in range(ROUNDS):
        off = made(numbers)
        problem = few if off is None else few.on([off.on(r) for r in few.records])
        fits = problem.fit([null.hypothesis] * 2, [(p, none), (drawn, none)], iterations=STEPS)
        best = min((f for f in fits if f is not None), key=lambda fit: fit.cost, default=None)
        if best is None:
            break
        p, before, left = best.p, numbers, best.score
        numbers = read(best)
        if np.abs(numbers - before).max() < close:
            break
    return numbers, as_it_is is None or left <= PROMISING * as_it_is.score
