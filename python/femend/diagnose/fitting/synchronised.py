"""A law fitted in a simulation that is held near the motion which was read at its place.

Where motion jumps, or depends on its past without limit, simulations with the right law and values leave the recordings
all the same, and the squares have minima everywhere. A weak spring and dashpot between the simulated motion and the one
that was read keep the two together (synchronisation; Pecora and Carroll 1990, Abarbanel 2013, ch. 2) and take little of
what the law does: held by a tenth of the stiffness that matters at the place, a play that was simulated 16 times the
noise off was within twice of it. They are let go in steps, as far as the law can be followed.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from femend.diagnose.fitting.candidates import Candidate, Start, standard_deviations
from femend.diagnose.fitting.closed_loop import COARSE, FINE, ClosedLoop, LawSpec, linear_spec, loop_of, squares
from femend.diagnose.fitting.descent import Descent
from femend.diagnose.fitting.known_force import Known
from femend.diagnose.fitting.nonlinear import candidate_of, loop_of_candidate
from femend.diagnose.locating.equivalent import stiffness_scale
from femend.diagnose.locating.joint import Joint
from femend.diagnose.locating.recovered import Recovered
from femend.estimate import Problem

__all__ = ["judge_synchronised", "synchronised"]

FloatArray = NDArray[np.float64]

# springs that hold the motion, in units of the stiffness that matters at the place, and steps with the law alone and
# with everything free under each; the last one is what laws are judged under
HELD, ALONE, JOINT = (0.3, 0.1, 0.03), 6, 4


@dataclass(frozen=True, eq=False)
class _HeldLoop(ClosedLoop):
    """The closed loop of a law beside a spring and dashpot (k, c) that hold its coordinates to a motion, whose pull is
    among the recorded forces."""

    hold: tuple[float, float]

    def laws(self, x: FloatArray) -> list[list[LawSpec]]:
        """Composite of every coordinate at fit coordinates `x`, as the core takes it."""
        return [[*own, linear_spec(*self.hold)] for own in super().laws(x)]


def synchronised(problem: Problem, joint: Joint, recovered: Recovered, name: str, start: Start) -> Candidate | None:
    """The law `name` fitted from its start to the records of a problem, held near the motion that was `recovered` of
    them; None where it cannot be simulated. The basis of the `joint` has to hold forces at its place (`rows_of`)."""
    base, x = loop_of(problem, joint, start, recovered)
    free = Descent.around(base, x, False)
    z = np.concatenate([recovered.fit.p, x])
    for share in HELD:
        loop = _held(base, problem, recovered, share)
        loop = loop if share == HELD[-1] else replace(loop, substeps=COARSE)
        for everything, steps in ((False, ALONE), (True, JOINT)):
            reached = free.on(loop, everything).run(z, steps)
            if reached is None:
                return None
            z = reached.z
    assert reached is not None
    if reached.H is None or not np.isfinite(reached.H).all():
        return None
    covariance = np.asarray(np.linalg.pinv(reached.H), dtype=np.float64)
    n_p = free.n_p
    made = candidate_of(base, start, name, reached, covariance[n_p:, n_p:])
    return replace(made, p_sd=standard_deviations(covariance, n_p), whole=covariance)


def judge_synchronised(problem: Problem, candidate: Candidate, recovered: Recovered) -> float:
    """Misfit that a synchronised candidate leaves of the records of another problem, held near what was `recovered` of
    those as it was in its fit; infinite where it cannot be simulated."""
    base = loop_of_candidate(problem, candidate)
    (e,), _ = _held(base, problem, recovered, HELD[-1]).residuals([(candidate.p, candidate.x)])
    return squares(e) / base.size()


def _held(base: ClosedLoop, problem: Problem, recovered: Recovered, share: float) -> _HeldLoop:
    """The loop `base` held to the motion that was recovered of the records of a problem, by a `share` of the stiffness
    that matters at the joint."""
    stiffness, omega = stiffness_scale(problem, base.joint)
    k = share * stiffness
    hold = k, k / omega
    pulls = {
        r.name: (hold[0] * d + hold[1] * v,)
        for r, d, v in zip(recovered.records, recovered.d, recovered.v, strict=True)
    }
    known = Known((base.joint.place,), pulls)
    pulled = problem.on([known.on(r) for r in problem.records])
    return _HeldLoop(pulled, base.joint, base.law, base.coordinates, base.scale, substeps=FINE, hold=hold)
