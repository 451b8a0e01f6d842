"""Recordings whose silence says nothing: too short for the lowest mode of their band, or hardly more than noise."""

from __future__ import annotations

from femend.estimate import FitRecord, Problem, noise_floor
from femend.model.free_body import RIGID
from femend.model.reduced.reduction import ReducedModel
from femend.numerals import plain

__all__ = ["PERIODS", "too_little"]

# a record of fewer periods of the lowest mode hardly shows it
PERIODS = 5.0
# periods that show it well: a decay of 1 % damping falls to a quarter in as many
ENOUGH = 20.0
# share of its rms that is left in the last tenth of a record of which the motion ended
DEAD = 0.2
# share of a recording from which noise hides most of what may be missing
NOISY = 0.5


def too_little(problem: Problem, reduced: ReducedModel) -> str:
    """Why the records of a `problem` cannot say that nothing is missing in the model `reduced`, and what would; empty
    where they can."""
    timed = [r for r in problem.records if r.frf is None]
    low, high = problem.band
    inside = reduced.freq[(reduced.freq > max(low, RIGID * reduced.freq[-1])) & (reduced.freq < high)]
    if len(timed) == len(problem.records) and inside.size:
        longest, lowest = max(timed, key=lambda r: r.n * r.dt), float(inside[0])
        duration = longest.n * longest.dt
        if duration * lowest < PERIODS and not any(map(_dies_away, timed)):
            return (
                f"the longest recording, {longest.name}, holds {plain(duration, 3)} s in {longest.n} samples, "
                f"{plain(duration * lowest, 2)} periods of the model's lowest mode in the band at {plain(lowest)} Hz: "
                f"what is not seen in them may be there all the same; record {plain(ENOUGH / lowest, 2)} s or more, or "
                "check the time axis"
            )
    floors = {r.name: noise_floor(r, problem.band) for r in problem.records}
    name = min(floors, key=lambda n: floors[n])
    if floors[name] < NOISY:
        return ""
    return (
        f"noise is {plain(100 * floors[name], 2)} % of {name}, the recording with least of it: what is missing hides "
        "in it; drive harder, record longer, or put the sensors where more moves"
    )


def _dies_away(record: FitRecord) -> bool:
    """Whether a record was cut where its motion ended: a blow on a strongly damped structure is over in few periods."""
    last = record.y[:, -max(1, record.n // 10) :]
    return float((last**2).mean()) < DEAD**2 * float((record.y**2).mean())
