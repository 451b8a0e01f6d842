"""What `femend modes --rpm` says: natural frequencies of a deck whose rotors turn, followed over the speed."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click
import numpy as np

from femend.numerals import listed, plain
from femend.report.text_table import table

if TYPE_CHECKING:
    from femend.data.campbell import Campbell
    from femend.model.model import Model
    from femend.model.terms.rotors import Rotors

__all__ = ["speeds_of", "turning_table"]

# a whirl beyond this is told as forward or backward
CLEAR = 0.1


def speeds_of(text: str) -> list[float]:
    """Speeds in 1/min, rising, that `text` lists with commas or spaces, with rest before a single one; raises
    UsageError."""
    try:
        found = sorted({float(word) for word in text.replace(",", " ").split()})
    except ValueError:
        raise click.UsageError(f"--rpm {text!r} is no list of speeds in 1/min; write --rpm 0,1500,3000") from None
    if not found or found[0] < 0 or not np.isfinite(found).all() or found[-1] == 0:
        raise click.UsageError(f"--rpm {text!r}: speeds in 1/min are 0 or more, and one of them is above 0")
    return found if len(found) > 1 else [0.0, *found]


def turning_table(model: Model, rotors: Rotors, rpm: list[float], n_modes: int | None, f_max: float | None) -> str:
    """The table of frequencies at the speeds `rpm` in 1/min of the reference rotor, critical speeds, limits of
    stability, and what is not complete, of a `model` with `rotors`; raises UsageError where nothing of it turns, and
    what `campbell` raises."""
    from femend.analysis.campbell import campbell

    parts = rotors.parts()
    if not parts:
        raise click.UsageError(
            "nothing of the deck turns; a rotor is declared by ROTORG (its grids) and RSPINR (sense and speed)"
            + "".join(f"; {w}" for w in rotors.warnings)
        )
    found = campbell(
        model, 2 * np.pi / 60.0 * np.array(rpm), n_modes=n_modes or (None if f_max else 10), f_max=f_max, parts=parts
    )
    return "\n".join([*_rotors(rotors), "", _frequencies(found), *_critical(found), *_limits(found), *found.notes])


def _rotors(rotors: Rotors) -> list[str]:
    told = []
    for r in rotors.rotors:
        axis = ", ".join(plain(x + 0.0, 3) for x in r.axis)
        speed = "" if r.ratio == 1.0 else f", at {plain(r.ratio)} times the speed"
        told.append(f"rotor {r.number}: {len(r.elements)} elements turn about ({axis}){speed}")
    return told


def _frequencies(found: Campbell) -> str:
    """Hz of every branch at the speeds asked for, with the sense in which it whirls at the highest."""
    asked = np.flatnonzero(found.asked)
    rows = []
    for i in range(found.poles.shape[1]):
        hz = found.freq[asked, i]
        cells = ["-" if np.isnan(f) else f"{f:.4f}" if f < 1e5 else f"{f:.6g}" for f in hz]
        damping = found.zeta[asked[-1], i]
        rows.append(
            [
                str(i + 1),
                *cells,
                _whirl(found.whirl[asked[-1], i]),
                "-" if np.isnan(damping) else plain(100 * damping, 3),
            ]
        )
    header = ["mode", *(f"{plain(s)} 1/min" for s in found.rpm[asked]), "whirl", "damping %"]
    return table(header, rows, "r" * (len(asked) + 1) + "lr")


def _whirl(whirl: float) -> str:
    if not abs(whirl) > CLEAR:
        return "-"
    return "forward" if whirl > 0 else "backward"


def _critical(found: Campbell) -> list[str]:
    told = [f"{plain(c.rpm)} 1/min ({plain(c.freq)} Hz, {_whirl(c.whirl)})" for c in found.critical]
    top = plain(float(found.rpm[-1]))
    return ["", f"critical speeds of order 1 up to {top} 1/min: {listed(told, 12) if told else 'none'}"]


def _limits(found: Campbell) -> list[str]:
    return [
        f"unstable {'above' if limit.unstable_above else 'below'} {plain(limit.speed * 30 / np.pi)} 1/min: mode "
        f"{limit.branch + 1} at {plain(limit.freq)} Hz grows"
        for limit in found.limits
    ]
