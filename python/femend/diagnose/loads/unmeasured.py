"""A force nobody recorded: what a free force at a place does does not follow from the motion there.

A law's force grows with the motion and, over a record from rest, takes energy out; a force from outside is as strong in
a weak recording as in a strong one, and feeds the motion.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from femend.diagnose.evidence import fall
from femend.diagnose.fitting.candidates import Candidate
from femend.diagnose.loads.harmonic import fit_harmonic
from femend.diagnose.loads.loads import LoadFinding
from femend.diagnose.loads.outside_as_noise import as_noise, forces_beside
from femend.diagnose.loads.own_lines import on_own_lines
from femend.diagnose.locating.joint import open_joint
from femend.diagnose.locating.locate import Located
from femend.diagnose.locating.recovered import Recovered, recover
from femend.diagnose.locating.split import Split
from femend.diagnose.naming.judge import Given
from femend.diagnose.naming.ranked import score
from femend.diagnose.updating.levels import levels_differ
from femend.estimate import Fit, Problem
from femend.model import Place
from femend.numerals import listed

__all__ = ["find_harmonic", "find_unmeasured", "plainly_unmeasured", "where_it_acts"]

FloatArray = NDArray[np.float64]

# exponent of force over level below which the force does not follow the motion
INDEPENDENT = 0.35
# share of the power fed to the joint that the force may take out again and still count as one from outside
DISSIPATED = 0.15
# share of a force's power within a few lines from which it is a harmonic one; correlation from which it repeats
HARMONIC, REPEATS = 0.6, 0.7
NEAR_LINES = 3
# the same share from which it is nothing but a tone
PURE = 0.9
# correlation below which the measured forces of two recordings differ, and above which unrecorded ones are the same
DIFFERENT, SAME = 0.5, 0.9
# amplitudes of a harmonic force in the recordings differ by at most this factor; a law's grow with the level
ALIKE = 1.5
# a repeating harmonic force is continued to so many times the longest record
LONGER = 8
# share of what is beyond the noise that a harmonic force takes away where more than noise is left
NEARLY_ALL = 0.9
# places that fit as well at which a harmonic force is tried
PLACES = 3


def find_unmeasured(given: Given, located: Sequence[Located]) -> LoadFinding | None:
    """A force or base motion that was not recorded, where the best place with one force shows one; None otherwise."""
    split, shown = given.split, _shown(given, located)
    if not shown or _of_frfs(given):
        return None
    (best, recovered), problem = shown[0], split.whole
    base = best.place.kind == "base"
    if problem.load is not None and not base:
        return None  # two forces nobody recorded: which of them is the other's law is not told
    if problem.load is None:
        sine = _best_sine(given, _on_the_structure(given, located) if base else shown, given.updated)
        if sine is not None:
            return sine
    own = [] if base else on_own_lines(recovered)
    if not own and not _from_outside(problem, recovered):
        return None
    force, repeats = _waveform(recovered)
    # a force from outside shows best where the recorded one is weakest, of recordings in which it acts
    plainest = min(own or range(len(problem.records)), key=lambda i: problem.records[i].level)
    values = _values(problem, force if repeats else recovered.f[plainest][0], best.place)
    direction = best.place.direction
    row = None if base else int(best.place.g_rows[0][0])
    # only a force that repeats goes into predictions
    fit = best.fit if repeats and not base else as_noise(given, best.fit)
    candidate = _candidate(split, best)
    return LoadFinding(
        "base_motion" if base else "unmeasured_force",
        best.place.nodes,
        direction,
        values,
        candidate,
        fit,
        problem,
        score(candidate, given.settings, given.n_values()),
        None if row is None or not repeats else (row, force),
        {} if row is None or repeats else _acting(forces_beside(problem, best, fit.p), problem, own),
    )


def _acting(
    forces: dict[str, tuple[int, FloatArray]], problem: Problem, own: Sequence[int]
) -> dict[str, tuple[int, FloatArray]]:
    """The forces in the records of numbers `own`, where these are told: what is read off the others is their noise."""
    names = [problem.records[i].name for i in own]
    return {name: force for name, force in forces.items() if not names or name in names}


def where_it_acts(load: LoadFinding) -> str:
    """In which recordings a force that nobody recorded acts, where it does not in all of them."""
    names = [r.name for r in load.problem.records]
    without = [name for name in names if name not in load.forces]
    if not load.forces or not without:
        return ""
    acting = listed([name for name in names if name in load.forces], 3)
    return (
        f"the force that nobody recorded acts in {acting}, and does not show in {listed(without, 3)}: see what ran or "
        "moved on the structure then, and record its force or leave it out"
    )


def find_harmonic(
    given: Given, located: Sequence[Located], without: Candidate, null_score: float
) -> LoadFinding | None:
    """A harmonic force that wins on unseen data against the model `without` it (score `null_score`) as a law has to,
    for what stands too little above the noise to be taken for missing whatever it is; None otherwise."""
    shown = _shown(given, located) if levels_differ(given.split.whole.records) else []
    if not shown or shown[0][0].place.kind == "base":
        return None
    found = _best_sine(given, shown, without.p)
    if found is None:
        return None
    less = fall(without.chosen, found.candidate.chosen)
    won = given.settings.wins(null_score - found.score, less, without.prior - found.candidate.prior)
    return found if won else None


def _shown(given: Given, located: Sequence[Located]) -> list[tuple[Located, Recovered]]:
    """The best places where a force from outside explains the recordings, and what it did there; none with one sensor,
    where a free force explains anything."""
    best, records = _outside(located, given.settings.margin), given.split.whole.records
    if not best or min(r.y.shape[0] for r in records) < 2 or best[0].fit.score > given.settings.adequate:
        return []
    recovered = [(one, _recovered(given, one)) for one in best]
    return [(one, r) for one, r in recovered if r is not None]


def _on_the_structure(given: Given, located: Sequence[Located]) -> list[tuple[Located, Recovered]]:
    """The best places on the structure, whatever a motion of the ground explains: that is free on every line, and a
    harmonic force has three unknowns for all of them."""
    return _shown(given, [one for one in located if one.place.kind == "ground"])


def plainly_unmeasured(given: Given, located: Sequence[Located]) -> bool:
    """Whether recordings with different forces of different levels show one and the same force at the best place, the
    same tone of whatever phase, or a force on a few lines on which the place hardly moves.

    No law does that, so that none needs to be tried.
    """
    best, problem = next(iter(_outside(located, given.settings.margin)), None), given.split.whole
    if best is None or problem.load is not None or min(r.y.shape[0] for r in problem.records) < 2:
        return False
    if best.fit.score <= given.settings.consistent and best.place.kind == "ground" and not _of_frfs(given):
        recovered = _recovered(given, best)
        if recovered is not None and on_own_lines(recovered):
            return True
    if _of_frfs(given) or not levels_differ(problem.records):
        return False
    n = min(r.n for r in problem.records)
    u = np.array([r.u[:, :n].ravel() for r in problem.records])
    if np.abs(np.corrcoef(u)[~np.eye(len(u), dtype=bool)]).max() > DIFFERENT:
        return False
    recovered = _recovered(given, best)
    if recovered is None:
        return False
    if best.fit.score <= given.settings.consistent and best.place.kind == "ground" and _one_tone(recovered):
        return _from_outside(problem, recovered)
    if not _common(recovered):
        return False
    _, alike, ratio = _mean_force(recovered)
    return bool(min(alike) > SAME and max(ratio) < ALIKE and min(ratio) > 1 / ALIKE)


def _one_tone(recovered: Recovered) -> bool:
    """Whether nearly all of what a place did stands about the same line in all recordings, as strong in each: what a
    motion makes goes with its level, and has the frequencies of the recorded force or of the modes."""
    tops, sizes = [], []
    for record, freq, F in zip(recovered.records, recovered.freq, recovered.F, strict=True):
        power = np.abs(F[:, 0]) ** 2
        near = power[_about_top(power)].sum()
        if near < PURE * power.sum():
            return False
        tops.append(float(freq[np.argmax(power)]))
        sizes.append(float(np.sqrt(near)) / record.n)
    apart = max(abs(f[1] - f[0]) for f in recovered.freq)
    return bool(max(tops) - min(tops) <= 2 * apart and max(sizes) < ALIKE * min(sizes))


def _about_top(power: FloatArray) -> slice:
    """The strongest of the lines of a power (K,), and the few on either side of it."""
    top = int(np.argmax(power))
    return slice(max(0, top - NEAR_LINES), top + NEAR_LINES + 1)


def _recovered(given: Given, best: Located) -> Recovered | None:
    """What the place did, on all lines: thinned, each record would keep others, and they could not be compared. Done
    once for both questions that are asked of it."""

    whole = given.split.whole

    def make() -> tuple[Located, Recovered | None]:
        joint = open_joint(best.place, given.reduced, whole.band[1], given.g_rows)
        return best, recover(whole.thinned(None), joint, best.fit.p, sharp=True)

    # the place is kept with its answer, so that no other object can take its identity
    kept: tuple[Located, Recovered | None] = whole.kept(("recovered", id(best)), make)
    return kept[1]


def _outside(located: Sequence[Located], margin: float) -> list[Located]:
    """The best places where a force from outside can act, if no place inside the structure fits better by `margin`."""
    single = [f for f in located if f.place.n_w == 1]
    fit = [f for f in single if f.cost - min(s.cost for s in single) < margin]
    return [f for f in fit if f.place.kind in ("ground", "base")][:PLACES]


def _best_sine(given: Given, shown: Sequence[tuple[Located, Recovered]], updated: FloatArray) -> LoadFinding | None:
    """The harmonic force that explains clearly most, of those at places where a free force explains as much, else the
    first: a free force may be anything, and so makes up for being at the wrong place, which a harmonic one cannot."""
    if _of_frfs(given):
        return None
    found = [_sine(given, one, recovered, (one.fit.p, updated)) for one, recovered in shown if one.place.kind != "base"]
    known = [sine for sine in found if sine is not None]
    least = min((sine.score for sine in known), default=np.inf)
    return next((sine for sine in known if sine.score <= least + given.settings.margin), None)


def _sine(given: Given, best: Located, recovered: Recovered, starts: Sequence[FloatArray]) -> LoadFinding | None:
    """A harmonic force of much the same amplitude in all recordings that explains unseen data adequately."""
    split, reduced, row = given.split, given.reduced, int(best.place.g_rows[0][0])
    shown = [
        (freq, w[:, 0] * np.abs(F[:, 0]) ** 2)
        for freq, w, F in zip(recovered.freq, recovered.weight, recovered.F, strict=True)
    ]
    whole = fit_harmonic(split.whole, reduced, row, shown, starts)
    if whole is None:
        return None
    size = whole.size
    if size.max() > ALIKE * size.min():
        return None
    choosing = whole.on(split.choosing, reduced)
    (seen,) = choosing.fit([whole.fit.hypothesis], [(whole.fit.p, whole.fit.x)], iterations=0)
    if seen is None:
        return None
    if seen.score > given.settings.adequate:
        (without,) = split.choosing.fit([whole.fit.hypothesis], [(starts[-1], whole.fit.x)], iterations=0)
        if not _nearly_all(without, seen):
            return None
    prior = split.whole.prior_cost(reduced, whole.fit.p)
    candidate = Candidate(None, "", None, {}, whole.fit.p, whole.fit.x, 3, prior, whole.fit.score, seen.score)
    mean = whole.amplitudes.mean(axis=0)
    longest = max(split.whole.records, key=lambda r: r.n)
    wave = whole.waveform(mean, LONGER * longest.n, longest.dt)
    return LoadFinding(
        "unmeasured_force",
        best.place.nodes,
        best.place.direction,
        {"frequency": (whole.freq, "Hz"), "amplitude": (float(size.mean()), "force")},
        candidate,
        whole.fit,
        split.whole,
        score(candidate, given.settings, given.n_values()),
        (row, wave) if np.linalg.norm(mean[:2]) > REPEATS * size.mean() else None,
        {
            r.name: (row, whole.waveform(a, r.n, r.dt))
            for r, a in zip(split.whole.records, whole.amplitudes, strict=True)
        },
    )


def _nearly_all(without: Fit | None, seen: Fit) -> bool:
    """Whether a harmonic force takes away nearly all that is beyond the noise: one far above it shows whatever else is
    a little wrong with the model."""
    return without is not None and (without.score - seen.score) > NEARLY_ALL * (without.score - 1.0)


def _of_frfs(given: Given) -> bool:
    """Whether some record is an FRF: what a force does that was not recorded averages out of it, or is of no time."""
    return any(r.frf is not None for r in given.split.whole.records)


def _from_outside(problem: Problem, recovered: Recovered) -> bool:
    """Whether the recordings, of different level, show the same force, or one that feeds the motion and does not grow
    with it."""
    if not levels_differ(problem.records):
        return False
    if _common(recovered):
        _, alike, ratio = _mean_force(recovered)
        if min(alike) > REPEATS and max(ratio) < ALIKE * 2 and min(ratio) > 1 / (ALIKE * 2):
            return True
    size = np.array([np.sqrt(np.mean(f**2)) for f in recovered.f])
    level = np.array([r.level for r in problem.records])
    if size.min() <= 0 or np.polyfit(np.log(level), np.log(size), 1)[0] > INDEPENDENT:
        return False
    # friction, too, is as strong at every level, but takes out what the motion has; at a level too high to see that,
    # another shows it
    taken = [
        float((f * v).sum() / max(np.linalg.norm(f) * np.linalg.norm(v), 1e-300))
        for f, v in zip(recovered.f, recovered.v, strict=True)
    ]
    return max(taken) < DISSIPATED


def _common(recovered: Recovered) -> bool:
    """Whether there are several records in time of the same length and step, so that their lines are the same. FRFs are
    of one hit or another, which no force that nobody recorded is common to."""
    first, *others = recovered.records
    in_time = all(r.frf is None for r in recovered.records)
    return bool(others) and in_time and all(r.n == first.n and r.dt == first.dt for r in others)


def _mean_force(recovered: Recovered) -> tuple[FloatArray, list[float], list[float]]:
    """Force (n,) pushing the structure that the records have in common, each line weighted by how well it is seen; the
    correlation of every record with it, and its size relative to it."""
    n = recovered.records[0].n
    F = np.zeros((len(recovered.F), n // 2 + 1), dtype=complex)
    W = np.zeros(F.shape)
    for i, (force, weight, index) in enumerate(zip(recovered.F, recovered.weight, recovered.index, strict=True)):
        F[i, index], W[i, index] = -force[:, 0], weight[:, 0]
    # a line of one record alone agrees with nothing
    shared = (W > 0).all(axis=0)
    F, W = F * shared, W * shared
    total = np.maximum(W.sum(axis=0), 1e-300)
    mean = (W * F).sum(axis=0) / total
    # lines on which the records contradict each other tell nothing
    n_records = len(F)
    agreed = np.abs(mean) ** 2 * total / np.maximum((W * np.abs(F) ** 2).sum(axis=0), 1e-300)
    mean = mean * np.clip((n_records * agreed - 1) / (n_records - 1), 0, 1)
    alike, ratio = [], []
    for f, w in zip(F, W, strict=True):
        own, common = (w * np.abs(f) ** 2).sum(), (w * np.abs(mean) ** 2).sum()
        alike.append(float(np.abs((w * f.conj() * mean).sum()) / np.sqrt(own * common)))
        ratio.append(float(np.sqrt(own / common)))
    return np.fft.irfft(mean, n), alike, ratio


def _waveform(recovered: Recovered) -> tuple[FloatArray, bool]:
    """Mean force (n,) over the records, as it pushes the structure, and whether they agree on it."""
    if not _common(recovered):
        return -recovered.f[0][0], False
    mean, alike, _ = _mean_force(recovered)
    return mean, bool(min(alike) > REPEATS)


def _twice_differentiated(f: FloatArray, problem: Problem) -> FloatArray:
    """Second time derivative of a history, within the band."""
    record = problem.records[0]
    freq = np.fft.rfftfreq(len(f), record.dt)
    F = np.where(freq <= problem.band[1], np.fft.rfft(f) * (2j * np.pi * freq) ** 2, 0.0)
    return np.asarray(np.fft.irfft(F, len(f)))


def _values(problem: Problem, f: FloatArray, place: Place) -> dict[str, tuple[float | None, str]]:
    """Parameters of the contract with their units: frequency (Hz) of a harmonic force and amplitude, or level."""
    rms = float(np.sqrt(np.mean(f**2)))
    if place.kind == "base":
        # the free force is the base's own acceleration where the pattern holds masses, its displacement where it holds
        # stiffnesses
        level = rms if place.to == "inertia" else float(np.sqrt(np.mean(_twice_differentiated(f, problem) ** 2)))
        return {"level": (level, "acceleration")}
    power = np.abs(np.fft.rfft(f)) ** 2
    about = _about_top(power)
    near = power[about]
    if near.sum() < HARMONIC * power.sum():
        return {"frequency": (None, "Hz"), "amplitude": (rms, "force")}
    centre = float((near * np.arange(about.start, about.start + len(near))).sum() / near.sum())
    return {
        "frequency": (centre / (len(f) * problem.records[0].dt), "Hz"),
        "amplitude": (rms * np.sqrt(2), "force"),
    }


def _candidate(split: Split, best: Located) -> Candidate:
    (seen,) = split.choosing.fit([best.fit.hypothesis], [(best.fit.p, best.fit.x)], iterations=0)
    chosen = np.inf if seen is None else seen.score
    prior = split.whole.prior_cost(best.fit.hypothesis.reduced, best.fit.p)
    return Candidate(None, "", None, {}, best.fit.p, best.fit.x, 2, prior, best.fit.score, chosen)
