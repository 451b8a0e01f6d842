"""What is said beside a verdict: how far a law reaches, and at which frequency its values hold."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf, pi

from femend.diagnose.fitting.candidates import Candidate
from femend.diagnose.locating.equivalent import middle
from femend.estimate import Problem
from femend.numerals import plain
from femend.physics.causal import CAUSAL, structural

__all__ = [
    "BENT",
    "FAR_FROM_NOISE",
    "LATER",
    "PART_OF_ALL",
    "PART_OF_A_FORCE",
    "PART_OF_TWO",
    "beside_laws",
    "only_beginning",
    "seconds_seen",
]

# growth of a stiffness over the band that does not have to be told
HARDLY = 1.05
# advice beside a law that falls short of a free force at its place, or of all that the recordings show
PART_OF_A_FORCE = (
    "the best law explains part of what a free force at the same place does; record two more levels, or the motion of "
    "the place itself"
)
# advice beside a law that explains what it does with a model far outside its priors
BENT = (
    "beside the best law the model's parameters, frequencies or damping still have to leave what the study says of "
    "them by far: something else is missing as well, or instead. Check the parameters in the table, widen prior_sd "
    "where they may be right, or record more sensors"
)
PART_OF_TWO = "the laws found explain part of what free forces at their places do"
LATER = (
    "No law could be followed beyond the beginning of the recordings, which shows too little of it: record the "
    "structure at a weaker level too, or in short bursts from rest"
)
FAR_FROM_NOISE = (
    "two laws explain most of what the recordings show, but leave far more than noise: one of them may stand in for "
    "something else; record lower levels too, at which a motion depends less on its past and one law may do"
)
PART_OF_ALL = (
    "the best law explains most of what the recordings show, but not all: check the mesh and the idealisation, or "
    "whether more than one thing is missing"
)


def beside_laws(laws: Sequence[Candidate], problem: Problem, sigma: float, *, parts: bool = False) -> str:
    """What has to be said of laws that explain the recordings in a window exp(-sigma t), whose motion `parts` later on
    as far as they leave; nothing of most."""
    shortest = min((r.n * r.dt for r in problem.records if r.frf is None), default=inf)
    beginning = only_beginning(sigma, any(law.nonlinear for law in laws), shortest, parts=parts)
    return "; ".join(filter(None, [beginning, *(_at_frequency(law, problem) for law in laws)]))


def only_beginning(sigma: float, nonlinear: bool = True, shortest: float = inf, *, parts: bool = False) -> str:
    """What has to be said of a law that was compared in a window exp(-sigma t), of the `shortest` record's length (s)
    one half at the most; nothing of one on whole records. Motion with a linear one can be followed to the end, so that
    what it leaves later on has another reason; with a nonlinear one models that explain the beginning as well may be
    known to part (`parts`)."""
    if sigma == 0:
        return ""
    first = seconds_seen(sigma, shortest)
    reach = f"the law explains about the first {first} s of the recordings to the noise, and less of the rest: "
    if not nonlinear:
        return reach + (
            "something beside the law is missing that was not found. How far predictions are off, the errors of "
            "held-out recordings tell: add sensors where the mismatch map is high, or a recording at another level"
        )
    why = (
        "models that explain that beginning as well part from each other later on, so that the rest does not speak "
        "against it"
        if parts
        else "no simulation stays with motion that depends on its past so much (impacts do that), or something beside "
        "the law is missing"
    )
    told = (
        "How far predictions are off, the errors of held-out recordings tell: record short bursts from rest to check it"
    )
    return f"{reach}{why}. {told}"


def seconds_seen(sigma: float, shortest: float = inf) -> str:
    """How many seconds of a recording count in a window exp(-sigma t), half of the `shortest` one's (s) at the most."""
    return plain(min(3 / sigma, shortest / 2), 2)


def _at_frequency(law: Candidate, problem: Problem) -> str:
    """At which frequency the stiffness of a constant loss holds, since it grows; nothing of other laws, or where it
    hardly does."""
    if law.physics is None or law.physics.law not in CAUSAL:
        return ""
    low, high = problem.band
    k_low, k_high = (structural(law.values, 2 * pi * f)["k"] for f in (low, high))
    if k_high < HARDLY * k_low:
        return ""
    at = middle(problem) / (2 * pi)
    return (
        f"stiffness and loss factor of the structural damping are those at {plain(at, 3)} Hz: where the loss is "
        f"constant the stiffness grows with frequency, here {plain(k_high / k_low, 2)} times from {plain(low, 3)} to "
        f"{plain(high, 3)} Hz"
    )
