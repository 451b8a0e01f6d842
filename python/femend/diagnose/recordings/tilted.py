"""Whether the recorded force acts along the axis it is said to: a stinger or a blow that is a few degrees off.

A force that is off by an angle also drives the two other axes of its node, with the same share of it at every line and
in all recordings. What it drives there the model hardly moves by itself, so that little is enough to look like
something missing; no free force at one place does what two shares do, and no law does.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from femend.diagnose.locating.locate import LINES, Located, cost_of, locate
from femend.diagnose.recordings.pointing import shares_along
from femend.diagnose.recordings.recorded_off import RecordedOff
from femend.diagnose.settings import Settings
from femend.diagnose.updating.update import UpdatedModel, update_model
from femend.estimate import FitRecord
from femend.model import Place
from femend.numerals import plain
from femend.threads import at_once

__all__ = ["ForceTilt", "force_tilt"]

FloatArray = NDArray[np.float64]

# share of its cost that the updated model has left at most with a force that is turned
LEFT = 0.25
# step of a search in shares of the force, its rounds, the farthest it moves at once and what is near enough, in steps
STEP, ROUNDS, FAR, CLOSE = 0.02, 10, 10.0, 0.05
# share of the cost that the search leaves at most, and the rounds after which it is given up where it leaves more, or
# where a round leaves more than the one before
WORTH, EARLY = 0.5, 3
# how many times the cost of a place that explains what no force at the recorded one's node does a search may leave: the
# model that it bent is updated after it
BENT = 50.0
# cost that a move has to take away
TELLS = 1.0
# the largest share of a force that is a little off, and of one that still acts along its axis
MOST, MOST_OF_OWN = 0.5, 3.0
# decays (in units of `Problem.scale`) of the beginnings in which a force far off its axis is looked for
DECAYS = (100.0, 30.0, 8.0)
AXES = "XYZ"


@dataclass(frozen=True)
class ForceTilt(RecordedOff):
    """The force recorded at row `row` of the g-set also acts at the `others`, each a row and the share there of what
    acts at `row`; what was recorded is all of it."""

    row: int
    others: tuple[tuple[int, float], ...]

    def driving(self, record: FitRecord) -> FitRecord:
        """The record with its force along the axis it acts along; as it is where it holds no such force."""
        if record.frf is not None or not record.driven or record.in_rows.tolist() != [self.row]:
            return record
        rows, shares = [row for row, _ in self.others], np.array([1.0, *(share for _, share in self.others)])
        # a load cell shows the force along its own axis, wherever that points
        u = np.ascontiguousarray((shares / np.linalg.norm(shares))[:, None] * record.u * record.in_signs[0])
        return replace(record, u=u, in_rows=np.array([self.row, *rows]), in_signs=np.ones(len(shares)))

    @property
    def angle(self) -> float:
        """The angle in degrees between the axis of the force and the one it is said to act along."""
        return float(np.degrees(np.arctan(np.linalg.norm([share for _, share in self.others]))))

    def text(self, names: Sequence[str], node_ids: Sequence[int], dt: float) -> str:
        """What is said of it, as of `RecordedOff`."""
        shares = " and ".join(f"{plain(100 * share, 2)} % along {AXES[row % 6]}" for row, share in self.others if share)
        listed, node = ", ".join(repr(n) for n in names), int(node_ids[self.row // 6])
        return (
            f"the force at node {node} acts {plain(self.angle, 2)}° off {AXES[self.row % 6]}, with {shares} "
            f"(recordings {listed}): it was turned by that, also for the predictions. See that the stinger or the "
            "hammer is aligned, and that the node's displacement system is the one meant"
        )


def force_tilt(
    start: UpdatedModel, located: Sequence[Located], places: Sequence[Place], zeta: float, settings: Settings
) -> tuple[ForceTilt, UpdatedModel, list[Located]] | None:
    """The direction of the one recorded force with which the updated model does far better, and better than with a
    force at one of the places `located`, unless one at its own node does as well there; with that model, and where
    something is missing in it, of all `places`. None elsewhere. `zeta` is the starting damping ratio."""
    records = start.problem.records
    rows = {tuple(r.in_rows.tolist()) for r in records if r.driven}
    one_force = len(rows) == 1 and all(r.frf is None and r.driven and len(r.in_rows) == 1 for r in records)
    if not located or not one_force or start.null.score <= settings.far:
        return None
    ((own,),) = rows
    if own % 6 > 2:
        return None
    moving = np.linalg.norm(np.asarray(start.reduced.V), axis=1) > 0
    others = [row for row in range(own - own % 6, own - own % 6 + 3) if row != own and moving[row]]
    here, elsewhere = (
        min((f.cost for f in located if _at_the_force(f.place, own) == at), default=np.inf) for at in (True, False)
    )
    # places that move the sensors alike do as well with a free force, the shaker's among them
    enough = elsewhere if elsewhere + settings.reach < here else np.inf
    tilt = _refined(start, start, ForceTilt(own, tuple((row, 0.0) for row in others)), WORTH, BENT * enough)
    begun = _pointed(start, own, others) if tilt is None else [tilt]
    if not begun:
        return None
    tilt, again = min(((t, _updated(start, t, zeta)) for t in begun), key=lambda t: _cost(t[1]))
    closer = _refined(start, again, tilt, 1.0, BENT * enough)
    if closer is not None:
        # the model was bent by what the force did
        tilt, again = closer, _updated(start, closer, zeta)
    tilt, again = _as_few(start, tilt, again, zeta, settings)
    if _cost(again) > min(LEFT * _cost(start), enough):
        return None
    return tilt, again, locate(again.problem, again.reduced, places, again.null)


def _updated(start: UpdatedModel, tilt: ForceTilt, zeta: float) -> UpdatedModel:
    """The model updated anew on the records of `start`, with their force turned."""
    return update_model(start.reduced.model, [tilt.on(r) for r in start.problem.records], zeta)


def _cost(updated: UpdatedModel) -> float:
    """What an updated model leaves, as the cost of a place is."""
    return cost_of(updated.problem, updated.null, 0.0)


def _pointed(start: UpdatedModel, own: int, others: Sequence[int]) -> list[ForceTilt]:
    """Forces recorded along row `own` of the g-set that act far off it, at the `others` too, as beginnings of the
    recordings show by themselves; none where they hardly show any, or one that hardly acts along its axis."""
    problem, reduced, found = start.problem, start.reduced, list[ForceTilt]()
    unknowns = problem.prior(reduced)[0], start.null.p
    sense = float(next(r.in_signs[0] for r in problem.records if r.driven))
    for decay in DECAYS if others else ():
        shares, left = shares_along(problem, reduced, unknowns, [own, *others], decay)
        if left > WORTH or shares[0] * sense <= 0:
            continue
        of_own = shares[1:] / shares[0]
        if MOST <= np.abs(of_own).max() <= MOST_OF_OWN:
            found.append(ForceTilt(own, tuple(zip(others, of_own.tolist(), strict=True))))
    return found


def _as_few(
    start: UpdatedModel, tilt: ForceTilt, again: UpdatedModel, zeta: float, settings: Settings
) -> tuple[ForceTilt, UpdatedModel]:
    """The turned force without the shares that explain clearly nothing, and the model updated with it: along an axis
    that hardly moves in the band a share is whatever the search came past, and the model is bent by it."""
    for i in np.argsort([abs(share) for _, share in tilt.others]):
        fewer = replace(tilt, others=tuple((row, 0.0 if j == i else a) for j, (row, a) in enumerate(tilt.others)))
        if not tilt.others[i][1] or not any(share for _, share in fewer.others):
            continue
        updated = _updated(start, fewer, zeta)
        if _cost(updated) <= _cost(again) + settings.gain_cost:
            tilt, again = fewer, updated
    return tilt, again


def _move(low: float, here: float, high: float) -> tuple[float, float]:
    """The move in steps to the vertex of the parabola through costs a step below, here and a step above, one towards
    the lower side where it has none, and the fall it foretells; none of both where the data do not tell it."""
    slope, bend = 0.5 * (high - low), low - 2 * here + high
    if not np.isfinite(bend):
        return 0.0, 0.0
    move = float(np.clip(-slope / bend, -FAR, FAR)) if bend > 0 else -float(np.sign(slope))
    fall = -slope * move - (0.5 * bend * move**2 if bend > 0 else 0.0)
    return (move, fall) if fall > TELLS else (0.0, 0.0)


def _at_the_force(place: Place, row: int) -> bool:
    """Whether a place is the ground at the node of the recorded force, along any axis."""
    return place.kind == "ground" and all(int(g) // 6 == row // 6 for g in place.g_rows[0])


def _refined(
    start: UpdatedModel, updated: UpdatedModel, tilt: ForceTilt, worth: float, most: float
) -> ForceTilt | None:
    """The shares at which an `updated` model costs least on few lines of the records of `start`, from those of `tilt`
    on, in turns along the axis that foretells most by the parabola through fits a step off; None where that leaves more
    than `worth` of the cost it began with, or than `most`, and where the shares are none, or of a force a little off
    come to more than that."""
    few, null = start.problem.sparing(LINES), updated.null
    others = [row for row, _ in tilt.others]

    def with_shares(shares: FloatArray) -> ForceTilt:
        return replace(tilt, others=tuple(zip(others, shares.tolist(), strict=True)))

    def cost(shares: FloatArray) -> float:
        turned = with_shares(shares)
        problem = few.on([turned.on(r) for r in few.records])
        (found,) = problem.fit([null.hypothesis], [(null.p, np.zeros(0))], iterations=8)
        return np.inf if found is None else found.cost

    if not others:
        return None
    at, own_step = np.array([share for _, share in tilt.others]), STEP * np.eye(len(others))
    # a force a little off its axis stays one
    largest = MOST if np.abs(at).max() < MOST else MOST_OF_OWN
    here = first = cost(at)
    for n in range(ROUNDS):
        if n >= EARLY and here > worth * first:
            return None
        beside = at_once(cost, [at + sign * step for step in own_step for sign in (-1, 1)])
        tried = [_move(beside[2 * i], here, beside[2 * i + 1]) for i in range(len(others))]
        # what moves least of the sensors tells its share once the other is right
        best = max(range(len(tried)), key=lambda i: tried[i][1])
        move, gain = tried[best]
        there = at + move * own_step[best]
        left = cost(there) if move else here
        if n >= EARLY and left > here:
            break  # the cost is no bowl there, as that of a force a little off is
        at, here = there, left
        if gain == 0 or abs(move) < CLOSE:
            break
    if here > min(worth * first, most) or not at.any() or np.abs(at).max() >= largest:
        return None
    return with_shares(at)
