"""What an update leaves unmet, each kind of response by itself, and how much wider parameters' deviations are for it.

Hundreds of shape values that are met hide a few frequencies that are not, though these tell the parameters. So every
kind of a configuration is judged over the degrees of freedom that it has left: its squares less what the parameters
took of them. Where it is off, its deviations are taken to be larger by as much, and the parameters' follow (the
sandwich of Huber 1967 with one variance for each kind).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from femend.bench.updating.counted import Counted
from femend.estimate.updating import UpdateResult
from femend.numerals import plain

__all__ = ["Left", "Unmet", "what_is_left"]

FloatArray = NDArray[np.float64]

# a kind is off whose values are left so many deviations off, over its degrees of freedom, ...
LEFT = 2.0
# ... and that by chance would be in less than one of a thousand tests
CHANCE = 1e-3
# a single value that is left so many deviations off is told by itself
ONE_LEFT = 5.0
# a factor on deviations that is told
WIDER = 1.05
# values named
NAMED = 3
# degrees of freedom below which nothing is left to judge by
FEWEST = 0.1
ONE_A_MODE = ("frequencies", "damping")


@dataclass(frozen=True, slots=True)
class Left:
    """One kind of `response` in a `configuration`: how many `values`, their `rms` in deviations, and whether they are
    `off`; `inflation` is the factor on their variance that makes what is left likely, `worst` the modes of the
    recording that are left most with the deviations they are off by."""

    configuration: str
    response: str
    values: int
    rms: float
    off: bool
    inflation: float
    worst: tuple[tuple[int, float], ...] = ()

    @property
    def text(self) -> str:
        """How far it is left off, in words."""
        named = [f"mode {k} by {plain(abs(x), 2)}" for k, x in self.worst]
        most = f", {', '.join(named)}" if named else ""
        return (
            f"{self.response} of {self.configuration} are left {plain(self.rms, 2)} times their deviations off (rms of "
            f"{self.values}{most})"
        )


@dataclass(frozen=True, eq=False)
class Unmet:
    """All `kinds` of response, and the factors `widened` by parameter on deviations that what is left asks for."""

    kinds: tuple[Left, ...]
    widened: dict[str, float]

    @property
    def off(self) -> tuple[Left, ...]:
        """The kinds that are left off."""
        return tuple(k for k in self.kinds if k.off)

    def as_list(self) -> list[dict[str, Any]]:
        """What updating.json holds of it."""
        return [
            {"configuration": k.configuration, "response": k.response, "values": k.values, "rms": k.rms, "off": k.off}
            for k in self.kinds
        ]

    def wide(self, found: UpdateResult) -> dict[str, float]:
        """The factors on deviations of parameters that the data tell, where these would have to be wider."""
        if not self.off:
            return {}
        told = found.determined()
        return {n: w for n, w in self.widened.items() if n in told and np.isfinite(w) and w >= WIDER}

    def believable(self, found: UpdateResult) -> bool:
        """Whether the parameters' deviations hold, within the factor at which a kind of response is off."""
        return max(self.wide(found).values(), default=1.0) < LEFT

    def text(self, found: UpdateResult) -> str:
        """What is off, what that means for the parameters, and what to do; "" where nothing is."""
        if not self.off:
            return ""
        said = "; ".join(k.text for k in self.off)
        wide = self.wide(found)
        narrow = ""
        if wide:
            sd = found.sd
            most = sorted(wide, key=lambda n: -wide[n])[:NAMED]
            values = ", ".join(f"{n} ± {plain(sd[n] * wide[n], 2)}" for n in most)
            narrow = (
                f": the parameters' deviations are too narrow, about {plain(max(wide.values()), 2)} times as wide "
                f"they would allow for it ({values})"
            )
        return (
            f"{said}{narrow}; the deviations given are too tight ([updating] freq_sd, shape_sd ...), modes are paired "
            "wrongly, or the model is off where it has no parameter: mesh, joints, supports (`femend diagnose` looks "
            "for it)"
        )


def what_is_left(found: UpdateResult, counted: Sequence[Counted]) -> Unmet:
    """Judges every kind of response of `found` by itself; `counted` has the modes' numbers in their recordings."""
    numbers = {c.name: c.numbers for c in counted}
    J, covariance, at = found.after.jacobian, found.covariance, 0
    assert J is not None
    known = np.isfinite(np.diag(covariance))
    inner = np.where(np.outer(known, known), covariance, 0.0)
    kinds: list[Left] = []
    middle = found.problem.unknowns.precision.copy()
    for c, state, mates in zip(found.problem.configurations, found.after.states, found.after.mates, strict=True):
        for response in c.responses:
            part = response.compare(state, mates, False)
            r, rows = part.residual, J[at : at + part.residual.size]
            at += r.size
            leverage = float(np.einsum("ij,jk,ik->", rows, inner, rows))
            modes: tuple[int, ...] = ()
            if response.name in ONE_A_MODE and mates is not None:
                own = numbers.get(c.name, ())
                modes = tuple(own[t] if t < len(own) else int(t) + 1 for t in mates.test)
            one = _judged(c.name, response.name, r, r.size - part.taken - leverage, modes)
            kinds.append(one)
            middle += max(one.inflation, 1.0) * rows.T @ rows if one.off else rows.T @ rows
    wide = np.diag(inner @ middle @ inner)
    own_sd = np.diag(inner)
    factors = np.sqrt(np.divide(wide, own_sd, out=np.ones_like(wide), where=own_sd > 0))
    return Unmet(tuple(kinds), dict(zip(found.problem.unknowns.names, factors.tolist(), strict=True)))


def _judged(configuration: str, response: str, r: FloatArray, free: float, modes: tuple[int, ...]) -> Left:
    from scipy.stats import chi2

    squares = float(r @ r)
    rms = float(np.sqrt(squares / max(r.size, 1)))
    inflation = squares / free if free > FEWEST else 1.0
    off = inflation > LEFT**2 and float(chi2.sf(squares, free)) < CHANCE
    far: list[tuple[int, float]] = []
    if modes:
        off = off or bool((np.abs(r) > ONE_LEFT).any())
        order = np.argsort(-np.abs(r))[:NAMED]
        far = [(modes[i], float(r[i])) for i in order if abs(r[i]) > LEFT]
    return Left(configuration, response, r.size, rms, bool(off), inflation, tuple(far))
