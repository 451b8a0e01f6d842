"""Two laws at one place: effects at places that move the sensors alike add up to one force, which no single law is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from femend.diagnose.fitting.candidates import Candidate, Start, force_on_lines, laws_for, starts
from femend.diagnose.fitting.closed_loop import loop_of
from femend.diagnose.fitting.collapse import collapsed
from femend.diagnose.fitting.terms import Term
from femend.diagnose.locating.recovered import Recovered, in_time
from femend.diagnose.naming.ranked import Ranked
from femend.diagnose.several.pairs import Searched, plain
from femend.diagnose.several.together import EVEN, Scored, are_told, fitted_together

__all__ = ["in_parallel", "starting", "what_is_left"]

# linear laws of different names that are tried beside the best one, and the starts of each law that are looked at
LINEAR, STARTS = 2, 2
# other linear laws of the best one's family that take its place, and the pairs in which they do
KIN, LEADING = 2, 2


def in_parallel(first: Searched) -> Scored | None:
    """The best law and another one beside it at its place, where a free force there explains the recordings and no law
    does; None where no two laws do either.

    What the place did is known without any law; what is left of its force when the best law follows the recovered
    motion starts the other one.
    """
    best, adequate = first.ranked[0], first.settings.adequate
    joint, recovered = best.candidate.joint, best.recovered
    if joint is None or recovered is None or best.candidate.reference > adequate:
        return None
    law = collapsed(best.candidate, recovered, first.settings)
    one, p = Term(law, best.located), plain(first, best.candidate.p)
    others = _others(first, best, law)
    pairs = ([one, Term(other, best.located, bare=other.nonlinear)] for other in others)
    done = [f for terms in pairs if (f := fitted_together(first, terms, p)) is not None]
    for kin in _kin(first, best):
        pairs = ([Term(kin, best.located), *f[1].terms[1:]] for f in _leading(done))
        done += [f for terms in pairs if (f := fitted_together(first, terms, p)) is not None]
    found = _plainest(done)
    return found if found is not None and found[1].chosen <= adequate and are_told(first, found) else None


def _kin(first: Searched, best: Ranked) -> list[Candidate]:
    """Other linear laws of the best one's family at its place: which of them is right shows only beside the other
    effect."""
    law = best.candidate.physics
    if law is None or law.kind != "linear":
        return []
    kept: dict[str, Candidate] = {}
    for r in first.ranked:
        other = r.candidate.physics
        like = other is not None and other.kind == "linear" and other.family == law.family and other is not law
        if like and r.located.place is best.located.place and r.recovered is not None:
            kept.setdefault(r.name, collapsed(r.candidate, r.recovered, first.settings))
    return list(kept.values())[:KIN]


def _plainest(done: Sequence[Scored]) -> Scored | None:
    """The best of the pairs; with a law in which its second one may end instead of that one where this is no worse."""
    best = min(done, key=lambda f: f[0], default=None)
    richer = None if best is None else best[1].terms[-1].candidate.physics
    if best is None or richer is None:
        return best
    even = [f for f in done if f[1].terms[-1].candidate.name in richer.simpler and f[0] < best[0] + EVEN]
    return min(even, key=lambda f: f[0], default=best)


def _leading(done: Sequence[Scored]) -> list[Scored]:
    """The best of the pairs with different laws beside the first one."""
    kept: dict[str, Scored] = {}
    for found in sorted(done, key=lambda f: f[0]):
        kept.setdefault(found[1].terms[-1].candidate.name, found)
    return list(kept.values())[:LEADING]


def _others(first: Searched, best: Ranked, law: Candidate) -> list[Candidate]:
    """Laws that may do what the first one leaves of the recovered force: of linear ones those that follow it best,
    every nonlinear one, since a motion without its mean may not show what it does.

    None of the first one's family, and no linear one beside a linear one: two of a family at one place are one law that
    the catalogue does not have, and two linear ones a stiffness over frequency that others add up to as well.
    """
    recovered, joint = best.recovered, law.joint
    assert recovered is not None
    assert joint is not None
    rest = what_is_left(recovered, law)
    begun = [
        (name, start)
        for name, entry in laws_for(joint.place.kind)
        if law.physics is not None
        and entry.family != law.physics.family
        and (law.nonlinear or entry.kind == "nonlinear")
        for start in starts(entry, joint, rest, STARTS)
        if np.isfinite(start.left)
    ]
    kept: dict[tuple[str, tuple[float, ...]], tuple[str, Start]] = {}
    linear = 0
    for name, start in sorted(begun, key=lambda item: item[1].left):
        for one in _either_sign(start):
            kind = name, _sides(one)
            if kind not in kept and (one.physics.kind == "nonlinear" or linear < LINEAR):
                kept[kind] = name, one
                linear += one.physics.kind == "linear"
    return [starting(first, law, name, start, recovered) for name, start in kept.values()]


def _either_sign(start: Start) -> list[Start]:
    """A start, and with the other sign what a descent does not change the sign of: without the mean of the motion the
    sign may come out wrong."""
    signed = [q.name for q in start.physics.parameters if q.domain == "real"]
    turned = {name: -value if name in signed else value for name, value in start.values.items()}
    return [start, replace(start, values=turned)] if signed else [start]


def _sides(start: Start) -> tuple[float, ...]:
    """What tells starts of one law apart for good: signs that do not change, and the sides of a stop."""
    values, laws = start.values, start.physics.parameters
    return (*(float(np.sign(values[q.name])) for q in laws if q.domain == "real"), values.get("sides", 0.0))


def what_is_left(recovered: Recovered, law: Candidate) -> Recovered:
    """What a place did, with the force that is left when a law and its companion have followed its motion."""
    assert law.physics is not None
    s = recovered.s
    own = force_on_lines(law.physics, law.values, recovered)
    beside = [(law.k + law.c * line)[:, None] * D for line, D in zip(s, recovered.D, strict=True)]
    F = [f - o - c for f, o, c in zip(recovered.F, own, beside, strict=True)]
    f = [in_time(X, i, r.n) for X, i, r in zip(F, recovered.index, recovered.records, strict=True)]
    return replace(recovered, F=F, f=f)


def starting(first: Searched, law: Candidate, name: str, start: Start, recovered: Recovered) -> Candidate:
    """A law at the place of another, `law`, as it starts."""
    entry, joint = start.physics, law.joint
    assert joint is not None
    plainly = Candidate(entry, name, joint, start.values, law.p, law.x, 0, law.prior, law.fitted, law.chosen)
    if entry.kind == "linear":
        x = np.log([max(start.values[n], 1e-12) for n in entry.parameter_names])
        return replace(plainly, x=x, n_law=len(x))
    loop, x = loop_of(first.split.fitting, joint, start, recovered)
    scale = {"k_scale": loop.scale[0], "c_scale": loop.scale[1]}
    return replace(plainly, x=x, n_law=loop.n_x, k=start.k, c=start.c, coordinates=loop.coordinates, extra=scale)
