"""What is told where a force at one place explains the recordings, and no law can be followed over them.

The force at the right place leaves the model near its priors, and what was read of it tells more of the law than a fit
to the beginning of the records does. So the law that follows it is the likeliest then, and the model's parameters are
those beside the force: without it they make up for what is missing, and a law that is not the right one bends them.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from femend.diagnose.deciding.outcome import Diagnosis
from femend.diagnose.fitting.candidates import SPRINGS
from femend.diagnose.fitting.known_force import rows_of
from femend.diagnose.locating.joint import open_joint
from femend.diagnose.locating.locate import Located
from femend.diagnose.naming.followed import AsRead, Followed, There, followed_there, held_near, held_to_all
from femend.diagnose.naming.judge import Given
from femend.diagnose.settings import Settings
from femend.numerals import plain
from femend.units import unit_system

__all__ = ["as_read", "read_at", "settles"]

# share of the force that a law leaves up to which it follows it, and the same as a share of what a spring and dashpot
# leave; laws that leave up to so many times what the best one does follow it as well
FOLLOWS, BEYOND_SPRINGS, AS_WELL = 0.5, 0.8, 1.2
# laws that leave up to so many times what the best one does are fitted while they are held near what was read, so many
# at most
RIVALS, MOST = 2.0, 3


def read_at(given: Given, place: Located) -> AsRead | None:
    """What is read at a place whose force explains the recordings with the model near its priors, and the law that
    follows it as no other does; None where no one force does so."""
    split, settings, where = given.split, given.settings, place.place
    if split.whole.load is not None or any(r.frf is not None for r in split.whole.records):
        return None
    if where.n_w != 1 or where.scaled or where.kind not in SPRINGS or place.fit.score > settings.adequate:
        return None
    fit = place.fit
    if settings.bends(split.whole.prior_cost(fit.hypothesis.reduced, fit.p)):
        return None
    joint = open_joint(where, given.reduced, split.whole.band[1], rows_of((where,), given.g_rows))
    there = There(split, joint, fit.p)
    laws, springs = followed_there(there)
    if not laws or laws[0].left > min(FOLLOWS, BEYOND_SPRINGS * springs):
        return AsRead(where, fit, None)
    first = laws[0]
    as_well = tuple(one.name for one in laws[1:] if one.left <= AS_WELL * first.left)
    rivals = [one for one in laws if one.left <= RIVALS * first.left][:MOST]
    held = held_near(there, rivals)
    if held:
        law, near = held[0]
        return AsRead(where, fit, law, held_to_all(split, joint, law, near), springs)
    return AsRead(where, fit, first, None, springs, as_well)


def settles(read: AsRead | None, without: float, settings: Settings) -> bool:
    """Whether what was read leaves nothing to look for elsewhere: a law, held near what it was read to do, takes away
    the share that a law has to of what the model leaves `without` it of the recording that chooses."""
    if read is None or read.held is None or not 0 < read.held.chosen < without:
        return False
    most = np.log(without / min(max(read.fit.score, 1.0), without))
    return bool(np.log(without / read.held.chosen) >= settings.explained * most > 0)


def as_read(found: Diagnosis, read: AsRead | None = None) -> Diagnosis:
    """The diagnosis with the model as it is beside the free force at its place, where that explains the recordings with
    the model near its priors and no law that is told does; and with the law that follows the force as the likeliest, if
    one follows it as no other does. `read` is what was read at a place before."""
    place = found.place
    if found.verdict != "located-not-named" or place is None or _explained(found):
        return found
    if found.rival is not None or found.further is not None or found.interrupted or found.load is not None:
        return found
    if read is None or read.place is not place.place:
        read = read_at(found.given, place)
    if read is None:
        return found
    if found.best is not None and (read.law is None or found.best.name in (read.law.name, *read.as_well)):
        return found
    if read.law is None:
        return replace(found, read=read)
    texts = [_text(found, read, read.law), found.advice if found.best is None else ""]
    return replace(found, best=None, read=read, advice="; ".join(filter(None, texts)))


def _explained(found: Diagnosis) -> bool:
    """Whether the law that is told explains whole recordings."""
    best = found.best
    return best is not None and best.sigma == 0 and best.fitted <= found.settings.adequate


def _text(found: Diagnosis, read: AsRead, law: Followed) -> str:
    """What is said of the law that follows the force, fitted or as it was read."""
    held = read.held
    values, k = (law.start.values, law.start.k) if held is None else (held.values, held.k)
    system = unit_system(found.reduced.model.units)
    turning = found.place is not None and found.place.place.direction.startswith("R")
    entry = law.start.physics
    words = ", ".join(
        [
            f"{q.name} {plain(values[q.name], 2)} {q.unit(system, rotational=turning)}".removesuffix(" 1")
            for q in entry.parameters
            if q.domain != "choice"
        ]
    )
    unit = f"{system.force_text}*{system.length_text}/rad" if turning else f"{system.force_text}/{system.length_text}"
    less = f", where the deck is {plain(-k, 2)} {unit} too stiff" if k < 0 else ""
    others = f" ({', '.join([w.replace('_', ' ') for w in read.as_well])} as well)" if read.as_well else ""
    fitted = (
        f". Held near the motion that was read it leaves {plain(held.chosen, 2)} times what noise explains of it"
        if held is not None
        else ""
    )
    return (
        f"a force there explains the recordings, and {law.name.replace('_', ' ')} ({words}{less}) follows it to "
        f"{plain(100 * law.left, 2)} % of a recording that it was not fitted to{others}; a spring and dashpot leave "
        f"{plain(100 * read.springs, 2)} %{fitted}. It is told as the likeliest, with the parameters that the "
        "force leaves: motion with it could not be followed over whole recordings, which plays and impacts may make "
        "depend on their past without limit. Record short bursts from rest, strong enough to reach it, to settle it"
    )
