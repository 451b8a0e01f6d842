"""Whether force and responses are on one time axis: a force recorded late or early by the same time in all recordings.

Two recorders that were started apart, or filters that differ between channels, shift the force against the responses.
No parameter makes up for it, and a free force where the shaker is takes it away: F = U (exp(-s t) - 1), U what was
recorded. No law does that. Of forces at several places (a roving hammer, two shakers), which no one free force can
stand for, shifts up to a few samples are tried.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from femend.diagnose.fitting.known_force import read_off
from femend.diagnose.locating.locate import Located, locate
from femend.diagnose.recordings.recorded_off import RecordedOff
from femend.diagnose.settings import AT_NOISE
from femend.diagnose.updating.update import UpdatedModel, update_model
from femend.estimate import FitRecord, Hypothesis, Problem
from femend.model import Place
from femend.numerals import listed, plain

__all__ = ["ForceShift", "force_shift"]

FloatArray = NDArray[np.float64]

# share of its cost that the updated model has left at most with a shift
LEFT = 0.25
# the least shift that is told, in samples, and the longest that is looked for, in periods of the band's low end
LEAST, LONGEST = 0.2, 2.0
# lines a record on which, and samples by which, forces at several places are tried late and early
FEW_LINES, TRIED = 150, (0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0, 5.0, 6.0, 7.0, 8.0)
# steps of a search, in samples, and its rounds; a shift found again is as good within so many samples
STEP, ROUNDS, CLOSE = 0.25, 3, 0.01


@dataclass(frozen=True)
class ForceShift(RecordedOff):
    """The forces at `rows` of the g-set act `seconds` later than they were recorded (earlier where negative)."""

    rows: tuple[int, ...]
    seconds: float

    def driving(self, record: FitRecord) -> FitRecord:
        """The record with its forces where they act; as it is where it holds others, or no time record. What a force
        was before the record began, or after its end, is not known and is none, but where it repeats itself."""
        if record.frf is not None or not record.driven or not set(self.rows).issuperset(record.in_rows.tolist()):
            return record
        omega = 2 * np.pi * np.fft.rfftfreq(record.n, record.dt)
        turned = np.fft.rfft(record.u, axis=1) * np.exp(-1j * omega * self.seconds)
        u, lost = np.asarray(np.fft.irfft(turned, record.n, axis=1)), self._unknown(record)
        if lost > 0:
            u[:, slice(0, lost) if self.seconds > 0 else slice(-lost, None)] = 0.0
        return replace(record, u=u)

    def on(self, record: FitRecord) -> FitRecord:
        """The record with its force where it acts, for fits: without the beginning or the end at which it is not known.
        What moved in the beginning counts as free decays."""
        moved, lost = self.driving(record), self._unknown(record)
        if moved is record or lost == 0 or lost > record.n // 2:  # with next to nothing known it is no time to move by
            return moved
        return moved.part(lost, moved.n) if self.seconds > 0 else moved.part(0, moved.n - lost)

    def _unknown(self, record: FitRecord) -> int:
        """Samples at which the moved force is not known."""
        return 0 if record.period > 0 else int(np.ceil(abs(self.seconds) / record.dt))

    def text(self, names: Sequence[str], node_ids: Sequence[int], dt: float) -> str:
        """What is said of it, as of `RecordedOff`."""
        samples, how = plain(abs(self.seconds) / dt, 2), "late" if self.seconds < 0 else "early"
        recordings = ", ".join(repr(n) for n in names)
        nodes = sorted({int(node_ids[row // 6]) for row in self.rows})
        forces = f"the force at node {nodes[0]} was" if len(self.rows) == 1 else _several(nodes)
        moved = "it was moved" if len(self.rows) == 1 else "they were moved"
        return (
            f"{forces} recorded {plain(1e3 * abs(self.seconds), 3)} ms ({samples} samples) too "
            f"{how} against the responses (recordings {recordings}): {moved} by that, also for the predictions. See "
            "that force and responses are on one time axis: one recorder, one trigger, and filters of one kind"
        )


def _several(nodes: Sequence[int]) -> str:
    return f"the forces at node{'s' if len(nodes) > 1 else ''} {listed(nodes, 6)} were"


def force_shift(
    start: UpdatedModel, located: Sequence[Located], places: Sequence[Place], zeta: float
) -> tuple[ForceShift, UpdatedModel, list[Located]] | None:
    """The shift of the one recorded force where a free force at its place does what a shift does, or of all forces
    where there are several, and the model updated with that does far better; with that model, and where something is
    missing in it, of all `places`. None elsewhere. `zeta` is the starting damping ratio."""
    records = start.problem.records
    if not located or any(r.frf is not None or not r.driven for r in records):
        return None
    dt, bare = min(r.dt for r in records), start.null.hypothesis
    begun = _begun(start, located[0])
    if begun is None:
        return None
    shift, cost = _refined(start.problem, bare, *begun)
    # forces at several places are tried from where the updated model is, which is bent for what they are late
    if abs(shift.seconds) < LEAST * dt or (len(shift.rows) == 1 and cost > LEFT * start.null.cost):
        return None
    found = _moved(start, shift, places, zeta)
    if found[0].null.cost > LEFT * start.null.cost:
        return None
    if found[1] and found[0].null.score > AT_NOISE:
        # what is missing beside the shift had its part in it
        best = found[1][0].fit
        closer, _ = _refined(start.problem, best.hypothesis, best.p, shift)
        if abs(closer.seconds - shift.seconds) > CLOSE * dt:
            shift, found = closer, _moved(start, closer, places, zeta)
    return (shift, *found)


def _begun(start: UpdatedModel, first: Located) -> tuple[FloatArray, ForceShift] | None:
    """Unknowns (n_p,) of the model and a shift to begin with: of one force what the free force at its place does, None
    where the place located `first` is another; of several what explains most of those that are tried, None where none
    does or the updated model leaves no more than noise."""
    problem, place = start.problem, first.place
    rows = tuple(sorted({int(row) for r in problem.records for row in r.in_rows}))
    if len(rows) == 1:
        own = place.kind == "ground" and place.n_w == 1 and place.g_rows[0].tolist() == list(rows)
        return (first.fit.p, ForceShift(rows, _shift_of(problem, first))) if own else None
    if start.null.score <= AT_NOISE:
        return None
    few, dt, p = problem.sparing(FEW_LINES), min(r.dt for r in problem.records), start.null.p
    shifts = [ForceShift(rows, sense * samples * dt) for samples in TRIED for sense in (1, -1)]
    costs = [_cost(few, start.null.hypothesis, p, shift) for shift in (ForceShift(rows, 0.0), *shifts)]
    best = int(np.argmin(costs))
    return None if best == 0 else (p, shifts[best - 1])


def _cost(problem: Problem, hypothesis: Hypothesis, p: FloatArray, shift: ForceShift) -> float:
    """What a hypothesis costs from unknowns `p` (n_p,) with the forces moved."""
    (found,) = problem.on([shift.on(r) for r in problem.records]).fit([hypothesis], [(p, np.zeros(0))], iterations=8)
    return np.inf if found is None else found.cost


def _moved(
    start: UpdatedModel, shift: ForceShift, places: Sequence[Place], zeta: float
) -> tuple[UpdatedModel, list[Located]]:
    """The model updated with the force moved, and its places."""
    again = update_model(start.reduced.model, [shift.on(r) for r in start.problem.records], zeta)
    return again, locate(again.problem, again.reduced, places, again.null)


def _shift_of(problem: Problem, at: Located) -> float:
    """The time (s) by which the force has to act later to do most like the free force beside it."""
    sign = float(at.place.g_values[0][0])
    ratio, weight, omega = [], [], []
    for one in read_off(problem, at.fit):
        U = one.line.U[:, 0] * float(one.line.record.in_signs[0])
        ratio.append(1 + sign * one.F[:, 0] / U)
        weight.append(one.weight[:, 0] * np.abs(U) ** 2)
        omega.append(one.line.s.imag)
    T, w, om = (np.concatenate(x) for x in (ratio, weight, omega))
    # on a resonance the force is seen best, and told least from the mode's free decay
    w = np.minimum(w, np.median(w))
    dt = min(r.dt for r in problem.records)
    reach = LONGEST / problem.band[0]
    times = np.arange(-reach, reach, 0.1 * dt)
    return float(times[np.argmax([np.real((w * T * np.exp(1j * om * t)).sum()) for t in times])])


def _refined(problem: Problem, hypothesis: Hypothesis, p: FloatArray, shift: ForceShift) -> tuple[ForceShift, float]:
    """The shift at which a hypothesis costs least from unknowns `p` (n_p,), and its cost: vertices of parabolas, from a
    first `shift` on."""
    step = STEP * min(r.dt for r in problem.records)

    def cost(seconds: float) -> float:
        return _cost(problem, hypothesis, p, replace(shift, seconds=seconds))

    at = shift.seconds
    here = cost(at)
    for _ in range(ROUNDS):
        low, high = cost(at - step), cost(at + step)
        if not np.isfinite([low, here, high]).any():
            break
        bend = low - 2 * here + high
        move = 0.5 * (low - high) / bend if np.isfinite(bend) and bend > 0 else 1.0 if high < low else -1.0
        at += float(np.clip(move, -2.0, 2.0)) * step
        here = cost(at)
        if abs(move) < 0.1:
            break
    return replace(shift, seconds=at), here
