"""What is told where a force at one place explains the recordings, and no law can be followed over them.

The force at the right place leaves the model near its priors, and what was read of it tells more of the law than a fit
to the beginning of the records does. So the law that follows it is the likeliest then, and the model's parameters are
those beside the force: without it they make up for what is missing, and a law that is not the right one bends them.
"""

from __future__ import annotations

from dataclasses import replace

from femend.diagnose.deciding.outcome import Diagnosis
from femend.diagnose.fitting.candidates import SPRINGS, Candidate
from femend.diagnose.fitting.known_force import rows_of
from femend.diagnose.locating.joint import open_joint
from femend.diagnose.naming.followed import AsRead, Followed, followed_there, held_near, held_to_all
from femend.numerals import plain
from femend.units import unit_system

__all__ = ["as_read"]

# share of the force that a law leaves up to which it follows it, and the same as a share of what a spring and dashpot
# leave; laws that leave up to so many times what the best one does follow it as well
FOLLOWS, BEYOND_SPRINGS, AS_WELL = 0.5, 0.8, 1.2
# laws that leave up to so many times what the best one does are fitted while they are held near what was read, so many
# at most
RIVALS, MOST = 2.0, 3


def as_read(found: Diagnosis) -> Diagnosis:
    """The diagnosis with the model as it is beside the free force at its place, where that explains the recordings with
    the model near its priors and no law that is told does; and with the law that follows the force as the likeliest, if
    one follows it as no other does."""
    place, settings = found.place, found.settings
    if found.verdict != "located-not-named" or place is None or found.problem.load is not None:
        return found
    if found.rival is not None or found.further is not None or found.interrupted or found.load is not None:
        return found
    plain_records = all(r.frf is None for r in found.problem.records)
    if not plain_records or place.place.n_w != 1 or place.place.scaled or place.place.kind not in SPRINGS:
        return found
    fit = place.fit
    prior = found.problem.prior_cost(fit.hypothesis.reduced, fit.p)
    if fit.score > settings.adequate or settings.bends(prior) or _explained(found):
        return found
    joint = open_joint(place.place, found.reduced, found.problem.band[1], rows_of((place.place,), found.g_rows))
    laws, springs = followed_there(found.split, joint, fit.p)
    first = laws[0] if laws else None
    follows = first is not None and first.left <= min(FOLLOWS, BEYOND_SPRINGS * springs)
    told = first if follows else None
    as_well = [] if told is None else [one.name for one in laws[1:] if one.left <= AS_WELL * told.left]
    if found.best is not None and (told is None or found.best.name in (told.name, *as_well)):
        return found
    if told is None:
        return replace(found, read=AsRead(fit, None))
    near = [one for one in laws if one.left <= RIVALS * told.left][:MOST]
    held: Candidate | None = None
    for law, candidate in held_near(found.split, joint, fit.p, near)[:1]:
        told, held, as_well = law, held_to_all(found.split, joint, law, candidate), []
    text = _text(found, told, held, as_well, springs)
    texts = [text, found.advice if found.best is None else ""]
    return replace(found, best=None, read=AsRead(fit, told, held), advice="; ".join(filter(None, texts)))


def _explained(found: Diagnosis) -> bool:
    """Whether the law that is told explains whole recordings."""
    best = found.best
    return best is not None and best.sigma == 0 and best.fitted <= found.settings.adequate


def _text(found: Diagnosis, law: Followed, held: Candidate | None, as_well: list[str], springs: float) -> str:
    """What is said of the law that follows the force, fitted or as it was read."""
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
    others = f" ({', '.join([w.replace('_', ' ') for w in as_well])} as well)" if as_well else ""
    fitted = (
        f". Held near the motion that was read it leaves {plain(held.chosen, 2)} times what noise explains of it"
        if held is not None
        else ""
    )
    return (
        f"a force there explains the recordings, and {law.name.replace('_', ' ')} ({words}{less}) follows it to "
        f"{plain(100 * law.left, 2)} % of a recording that it was not fitted to{others}; a spring and dashpot leave "
        f"{plain(100 * springs, 2)} %{fitted}. It is told as the likeliest, with the parameters that the force leaves: "
        "motion with it could not be followed over whole recordings, which plays and impacts may make depend on their "
        "past without limit. Record short bursts from rest, strong enough to reach it, to settle it"
    )
