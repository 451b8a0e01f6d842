"""A force nobody recorded: what a free force at a place does does not follow from the motion there.

A law's force grows with the motion and, over a record from rest, takes energy out; a force from outside is as strong in
a weak recording as in a strong one, and feeds the motion.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from femend.diagnose.candidates import Candidate
from femend.diagnose.joint import Recovered, open_joint, recover
from femend.diagnose.loads import LoadFinding
from femend.diagnose.locate import Located
from femend.diagnose.name import Split, effective_values, score
from femend.diagnose.settings import Settings
from femend.estimate import Problem
from femend.model import ReducedModel

__all__ = ["find_unmeasured"]

FloatArray = NDArray[np.float64]

# exponent of force over level below which the force does not follow the motion, and the levels' ratio needed to tell
INDEPENDENT, LEVELS = 0.35, 2.0
# share of the power fed to the joint that the force may take out again and still count as one from outside
DISSIPATED = 0.15
# share of a force's power within a few lines from which it is a harmonic one; correlation from which it repeats
HARMONIC, REPEATS = 0.6, 0.7
NEAR_LINES = 3


def find_unmeasured(
    split: Split, reduced: ReducedModel, located: Sequence[Located], g_rows: list[int], settings: Settings
) -> LoadFinding | None:
    """A force or base motion that was not recorded, where the best place with one force shows one; None otherwise."""
    single = [f for f in located if f.place.n_w == 1]
    if not single:
        return None
    problem = split.whole
    best = single[0]
    if best.fit.score > settings.adequate or best.place.kind not in ("ground", "base"):
        return None
    joint = open_joint(best.place, reduced, problem.band[1], g_rows)
    recovered = recover(problem, joint, best.fit.p)
    if recovered is None or not _from_outside(problem, recovered):
        return None
    base = best.place.kind == "base"
    force, repeats = _waveform(recovered)
    values = _values(problem, recovered, base)
    direction = best.place.direction
    candidate = _candidate(split, best)
    n_values = effective_values(split.choosing, reduced)
    return LoadFinding(
        "base_motion" if base else "unmeasured_force",
        best.place.nodes,
        direction,
        values,
        candidate,
        best.fit,
        problem,
        score(candidate, split.choosing, settings, n_values),
        None if base or not repeats else (int(best.place.g_rows[0][0]), force),
    )


def _from_outside(problem: Problem, recovered: Recovered) -> bool:
    level = np.array([r.u.std() for r in problem.records])
    size = np.array([np.sqrt(np.mean(f**2)) for f in recovered.f])
    if level.max() > LEVELS * level.min() and size.min() > 0:
        slope = np.polyfit(np.log(level), np.log(size), 1)[0]
        if slope > INDEPENDENT:
            return False
    weakest = int(np.argmin(level))
    f, v = recovered.f[weakest], recovered.v[weakest]
    taken = float((f * v).sum() / (np.linalg.norm(f) * np.linalg.norm(v)))
    return taken < DISSIPATED


def _waveform(recovered: Recovered) -> tuple[FloatArray, bool]:
    """Mean force (n,) over the records, as it pushes the structure, and whether they agree on it."""
    n = min(f.shape[1] for f in recovered.f)
    forces = np.array([-f[0, :n] for f in recovered.f])
    mean = forces.mean(axis=0)
    alike = [float(f @ mean / (np.linalg.norm(f) * np.linalg.norm(mean))) for f in forces]
    return mean, bool(len(forces) > 1 and min(alike) > REPEATS)


def _values(problem: Problem, recovered: Recovered, base: bool) -> dict[str, tuple[float | None, str]]:
    """Parameters of the contract with their units: frequency (Hz) of a harmonic force and amplitude, or level."""
    f = recovered.f[int(np.argmin([r.u.std() for r in problem.records]))][0]
    rms = float(np.sqrt(np.mean(f**2)))
    if base:
        # the coordinate is the base's own acceleration: the pattern holds the masses
        return {"level": (rms, "acceleration")}
    power = np.abs(np.fft.rfft(f)) ** 2
    top = int(np.argmax(power))
    near = power[max(0, top - NEAR_LINES) : top + NEAR_LINES + 1]
    if near.sum() < HARMONIC * power.sum():
        return {"frequency": (None, "Hz"), "amplitude": (rms, "force")}
    centre = float(
        (near * np.arange(max(0, top - NEAR_LINES), max(0, top - NEAR_LINES) + len(near))).sum() / near.sum()
    )
    return {
        "frequency": (centre / (len(f) * problem.records[0].dt), "Hz"),
        "amplitude": (rms * np.sqrt(2), "force"),
    }


def _candidate(split: Split, best: Located) -> Candidate:
    (seen,) = split.choosing.fit([best.fit.hypothesis], [(best.fit.p, best.fit.x)], iterations=0)
    chosen = np.inf if seen is None else seen.score
    prior = split.whole.prior_cost(best.fit.hypothesis.reduced, best.fit.p)
    return Candidate(None, "", None, {}, best.fit.p, best.fit.x, 2, prior, best.fit.score, chosen)
