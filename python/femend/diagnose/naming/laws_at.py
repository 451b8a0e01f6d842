"""Every law of the catalogue at one place, fitted on the records that are for fitting."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from femend.diagnose.fitting.candidates import KINDS, ONLY_GROUND, Candidate, Start, laws_for, starts
from femend.diagnose.fitting.collapse import collapsed
from femend.diagnose.fitting.linear import companions_alone, fit_linear, fit_mass, simple_alone
from femend.diagnose.fitting.nonlinear import fit_nonlinear
from femend.diagnose.fitting.pace import Pace
from femend.diagnose.fitting.soft_clamp import soft_clamps
from femend.diagnose.locating.joint import Joint, open_joint
from femend.diagnose.locating.locate import Located, grounded
from femend.diagnose.locating.own_basis import in_own_basis
from femend.diagnose.locating.recovered import Recovered, recover
from femend.diagnose.locating.split import Split
from femend.diagnose.naming.judge import Given, Tried, beaten, free_reference, null_candidate
from femend.diagnose.naming.ranked import score
from femend.estimate import Fit
from femend.model.places.places import mass_place

__all__ = ["Opened", "each_once", "linear_at", "masses_from_afar", "member_at", "nonlinear_at", "on_springs"]

FloatArray = NDArray[np.float64]

# starts of a nonlinear law that are followed
NONLINEAR_STARTS = 3
# starts within this factor of the best regression are followed, at most so many at a place by one equivalent element in
# all records, and by one in each
START_REACH, MOST_STARTS = 1.6, (9, 5)
# factor by which an absorber may be tuned beyond the band
BEYOND = 1.2
# look-alikes of a place at which linear laws are tried too, of the nearest so many
ALIKE_TRIED, MOST_ALIKE = 3, 12


@dataclass(frozen=True, eq=False)
class Opened:
    """A place opened for laws, with what it did."""

    found: Located
    joint: Joint
    recovered: Recovered


def each_once(located: Sequence[Located]) -> Iterator[tuple[Located, bool, bool]]:
    """Places, each with its kin: whether it is kin, and whether of the laws those that ground alone carries are tried
    alone. Kin that is among the places by itself, or was kin of one before, is not tried again."""
    # places tried, and whether with all laws
    done = {found.place: True for found in located}
    for found in located:
        for one in _with_kin(found):
            is_kin = one is not found
            # a brace to a support does what the ground does, but carries no mass
            masses_alone = is_kin and found.place.kind != "ground"
            if is_kin and one.place in done and (done[one.place] or masses_alone):
                continue
            done[one.place] = not masses_alone
            yield one, is_kin, masses_alone


def _with_kin(found: Located) -> list[Located]:
    """A place, and the look-alikes of it at which laws are tried too: those to the ground, first where the model has a
    joint. Each has the others, and the place itself, among its look-alikes."""
    if found.place.n_w != 1:
        return [found]
    ground = [p for p in found.alike[:MOST_ALIKE] if p.kind == "ground"]
    kin = sorted(ground, key=lambda p: p.unlikely)[:ALIKE_TRIED]
    others = [(found.place, *(p for p in found.alike if p is not place)) for place in kin]
    return [found, *(replace(found, place=place, alike=alike) for place, alike in zip(kin, others, strict=True))]


def linear_at(
    given: Given, found: Located, masses_alone: bool, before: Sequence[Tried] = ()
) -> tuple[list[Tried], Opened | None]:
    """All linear laws at a place, or those of a mass alone, and the place opened; a member has its stiffness factor
    alone, a bedding its stiffness. None but a mass, which resists in all directions, where a law of those tried
    `before` beats all."""
    split, reduced, g_rows, updated = given.split, given.reduced, given.g_rows, given.updated
    if found.place.scaled:
        return member_at(given, found), None
    joint = open_joint(found.place, reduced, split.whole.band[1], g_rows)
    recovered = recover(split.reading, joint, found.fit.p)
    if recovered is None:
        # a cut member may be as soft there as the model's unknowns go: what the update found is more modest
        recovered = recover(split.reading, joint, updated)
    if recovered is None:
        return [], None
    if joint.place.release is not None:
        joint, recovered = _held(split, joint, recovered)
    tried = [] if beaten(given, before, recovered) else _linear(given, found, joint, recovered, masses_alone)
    if found.place.kind == "ground":
        tried += _mass(given, found)
    return tried, Opened(found, joint, recovered)


def member_at(given: Given, found: Located) -> list[Tried]:
    """The stiffness factor of a member, or stiffness of a bedding; none where it says what no member does."""
    found = in_own_basis(given.split.whole, given.reduced, given.g_rows, found)
    member = null_candidate(given.split, found.fit, found.place.part_law)
    # a member may be weaker than it is drawn; one that would have to be stiffer stands in for something else. What a
    # bush is worth, nobody knows; a bedding is there or not
    told = found.place.kind == "connection" or (
        member.values["k"] > 0.0 if found.place.bed else member.values["factor"] < 1.0
    )
    return [Tried(member, found, None)] if told else []


def _mass(given: Given, found: Located, *, afar: bool = False) -> list[Tried]:
    """A mass at the node of a place to the ground; none where it cannot be fitted."""
    split, reduced = given.split, given.reduced
    whole = open_joint(mass_place(reduced.model, found.place.nodes[0]), reduced, split.whole.band[1], given.g_rows)
    mass = fit_mass(split.fitting, split.choosing, whole, found.fit.p, given.updated, afar=afar)
    return [] if mass is None else [Tried(mass, found, None)]


def masses_from_afar(given: Given, located: Sequence[Located], opened: Sequence[Opened]) -> list[Tried]:
    """Masses at the first nodes of the places `located` to the ground, sought from afar, where no force in one
    direction at the places `opened` explains the recordings: what a mass does in the other directions has bent the
    model at every place then, that of the mass among them."""
    split, settings = given.split, given.settings
    for at in opened:
        fit = at.recovered.fit
        near = split.fitting.prior_cost(fit.hypothesis.reduced, fit.p) <= settings.gain_cost
        if near and free_reference(split, at.recovered) <= settings.adequate:
            return []
    return [t for one in grounded(located) for t in _mass(given, one, afar=True)]


def _linear(given: Given, found: Located, joint: Joint, recovered: Recovered, masses_alone: bool) -> list[Tried]:
    """All linear laws at a joint, or those that ground alone carries."""
    split = given.split
    laws = [
        (name, entry)
        for name, entry in laws_for(joint.place.kind)
        if entry.kind == "linear" and (name in ONLY_GROUND or not masses_alone)
    ]
    fitted = fit_linear(split.fitting, split.choosing, joint, recovered, laws, given.updated)
    seen = [c for c in fitted if not _tuned_elsewhere(given, c, recovered)]
    seen = _better([*seen, *simple_alone(split.fitting, split.choosing, seen, recovered)])
    return [Tried(c, found, recovered) for c in seen]


def _held(split: Split, joint: Joint, recovered: Recovered) -> tuple[Joint, Recovered]:
    """A cut held by the spring that does most like what it did, with what it did there; as it is where a spring and
    dashpot explain no less so: which of the two structures the damping ratios are of is for the recordings to tell."""
    k = float(np.exp(recovered.equivalent.x[0]))
    closed = joint.held_by(np.full(len(joint.w), k))
    again = recover(split.reading, closed, recovered.fit.p)
    if again is None or again.equivalent.cost >= recovered.equivalent.cost:
        return joint, recovered
    return closed, again


def _better(candidates: Sequence[Candidate]) -> list[Candidate]:
    """Of fits of one law at a place the better one."""
    best: dict[tuple[str, str], Candidate] = {}
    for c in candidates:
        assert c.physics is not None
        key = c.name, c.physics.law or c.physics.name
        if key not in best or c.fitted < best[key].fitted:
            best[key] = c
    return list(best.values())


def _tuned_elsewhere(given: Given, candidate: Candidate, recovered: Recovered) -> bool:
    """Whether an absorber, which is told by its resonance, has it where nothing was recorded: within the band it does
    what a mass, a spring or a dashpot does, and these are tried by themselves."""
    if candidate.name != "tuned_absorber":
        return False
    low, high = given.split.whole.band
    tuned = float(np.sqrt(candidate.values["k"] / candidate.values["m"])) / (2 * np.pi)
    inside = low / BEYOND < tuned < high * BEYOND
    return not inside and collapsed(candidate, recovered, given.settings).name == candidate.name


def on_springs(given: Given, located: Sequence[Located], tried: Sequence[Tried]) -> list[Tried]:
    """Clamps among the places on springs of their own in one direction and in several, but for those that even with
    springs in all directions, were they free of charge, come clearly behind the best law `tried` elsewhere."""
    split, settings, n_values = given.split, given.settings, given.n_values()
    best = min((score(t.candidate, settings, n_values) for t in tried), default=np.inf)

    def soft(fit: Fit) -> Candidate:
        return null_candidate(split, fit, "compliant_support")

    def beaten(fit: Fit) -> bool:
        free_of_charge = replace(soft(fit), n_law=0)
        return score(free_of_charge, settings, n_values) > best + settings.gain_cost

    found = soft_clamps(split, given.reduced, located, given.updated, settings.margin, beaten)
    return [Tried(replace(soft(one.located.fit), reference=one.reference), one.located, None) for one in found]


def nonlinear_at(split: Split, at: Opened, pace: Pace) -> list[Tried]:
    """All nonlinear laws at a place that may explain what it did, and what stands beside the best of them, alone; those
    that keep up with the `pace` of others."""
    laws = _nonlinear(split, at, pace)
    return [Tried(c, at.found, at.recovered) for c in (*laws, *_companions_alone(split, at, laws))]


def _different_first(begun: Sequence[tuple[str, Start]]) -> list[tuple[str, Start]]:
    """Starts in order, the best of each law and number of sides before the second best of any: what follows a force as
    well as another may do so by being its near copy."""
    seen: dict[tuple[str, float], int] = {}
    turns = []
    for _, start in begun:
        key = start.physics.name, start.values.get("sides", 0.0)
        turns.append(seen.get(key, 0))
        seen[key] = turns[-1] + 1
    return [begun[i] for i in sorted(range(len(begun)), key=lambda i: turns[i])]


def _companions_alone(split: Split, at: Opened, laws: Sequence[Candidate]) -> list[Candidate]:
    """What stands beside the best of nonlinear `laws` at a place, without it; none at a cut, of which it is part."""
    whole = [c for c in laws if c.sigma == 0 and np.isfinite(c.chosen)]
    if not whole or at.joint.place.kind not in KINDS:
        return []
    return companions_alone(split.fitting, split.choosing, min(whole, key=lambda c: c.chosen))


def _nonlinear(split: Split, at: Opened, pace: Pace) -> list[Candidate]:
    # they show in time records alone, and are simulated under the force
    if split.whole.load is not None or any(r.frf is not None for r in split.whole.records):
        return []
    worth: list[tuple[str, Start]] = []
    # by one element in all records and by one in each: which of them comes nearer is not known beforehand
    read = partial(recover, split.reading, at.joint, at.recovered.fit.p, densely=True)
    first = read() or at.recovered
    readings: list[Recovered | None] = [first]
    if len(split.reading.records) > 1:
        readings.append(read(by_record=True))
    for recovered, most in zip(readings, MOST_STARTS, strict=False):
        if recovered is None:
            continue
        begun = [
            (name, start)
            for name, entry in laws_for(at.joint.place.kind)
            if entry.kind == "nonlinear"
            for start in starts(entry, at.joint, recovered, NONLINEAR_STARTS)
        ]
        untold = [b for b in begun if np.isnan(b[1].left) and recovered is first]
        told = sorted((b for b in begun if not np.isnan(b[1].left)), key=lambda item: item[1].left)
        within = [b for b in told if b[1].left < START_REACH * told[0][1].left]
        worth += [*untold, *_different_first(within)[:most]]
    return fit_nonlinear(split.fitting, split.choosing, at.joint, first, worth, pace)
