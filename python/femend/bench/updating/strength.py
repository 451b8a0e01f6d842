"""How strongly an update holds to the priors, where the study lets the data choose it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from femend.estimate.updating import Problem, Regularised, tikhonov
from femend.numerals import plain
from femend.study.file.bench_settings import RULES, UpdatingSettings

__all__ = ["Strength", "choose_strength", "strength_lines"]

FloatArray = NDArray[np.float64]

# priors this many times wider or narrower than stated are told: they were not meant so
FAR = 10.0
# the searches of the curve end with this share of a prior deviation; that with the strength taken is gone on with
CURVE = 1e-4


@dataclass(frozen=True, eq=False)
class Strength:
    """The `problem` as the study states it, its searches over strengths of the prior (`curve`), and the problem with
    the prior that was `chosen`, in which all goes on."""

    problem: Problem
    curve: Regularised
    chosen: Problem

    @property
    def p(self) -> FloatArray:
        """Where the search with the chosen strength ended (n_unknowns,)."""
        return self.curve.result.p

    @property
    def wider(self) -> float:
        """By what factor the deviations of the prior are wider than the study states them."""
        return float(1.0 / np.sqrt(self.curve.strength))

    @property
    def at_end(self) -> bool:
        """Is it the least or the largest strength that was tried, of several?"""
        tried = self.curve.strengths
        return len(tried) > 1 and self.curve.strength in (tried[0], tried[-1])

    @property
    def has_corner(self) -> bool:
        """Has the L-curve a corner, where that is the rule?"""
        several = len(self.curve.strengths) > 1
        return self.curve.rule != "l-curve" or not several or bool((self.curve.criterion < 0).any())

    def as_dict(self) -> dict[str, Any]:
        """What updating.json holds of it."""
        c, unknowns = self.curve, self.problem.unknowns
        values = np.array([unknowns.values(p) for p in c.p])
        return {
            "rule": c.rule,
            "strength": c.strength,
            "prior_sd_times": self.wider,
            "at_end": self.at_end,
            "has_corner": self.has_corner,
            "values": c.result.after.n_values,
            "strengths": c.strengths.tolist(),
            "squares": c.squares.tolist(),
            "penalties": c.penalties.tolist(),
            "criterion": c.criterion.tolist(),
            "parameters": {n: values[:, i].tolist() for i, n in enumerate(unknowns.names)},
        }

    def advice(self) -> list[str]:
        """What a strength at the end of those tried, or far from the priors as stated, asks for."""
        said, s = [], self.curve.strength
        if not self.has_corner:
            said.append(
                f"the L-curve has no corner among {len(self.curve.strengths)} strengths, and the one nearest to the "
                f'priors as stated was taken, {plain(s, 3)}: take "gcv", or leave regularisation out'
            )
        elif self.at_end:
            end = "least" if s == self.curve.strengths[-1] else "largest"
            said.append(
                f"the strength of the priors that {RULES[self.curve.rule]} takes, {plain(s, 3)}, is the {end} that was "
                "tried: the data do not choose one; try more ([updating] strengths), or state the priors and leave "
                "regularisation out"
            )
        elif max(self.wider, 1.0 / self.wider) > FAR:
            how, times = ("wider", self.wider) if self.wider > 1 else ("narrower", 1.0 / self.wider)
            said.append(
                f"{RULES[self.curve.rule]} takes the priors {plain(times, 3)} times {how} than stated: are prior_sd, "
                "and the deviations of the test, what they should be?"
            )
        return said


def choose_strength(
    problem: Problem, settings: UpdatingSettings, told: Callable[[], None] | None = None
) -> Strength | None:
    """The strength of the prior of `problem` by the rule of `settings`; None where there is none. `told` is called when
    a strength is done. Raises what `tikhonov` raises."""
    if settings.regularisation is None:
        return None
    curve = tikhonov(
        problem,
        settings.strengths,
        rule=settings.regularisation,
        iterations=settings.iterations,
        tolerance=CURVE,
        told=told,
    )
    chosen = replace(problem, unknowns=problem.unknowns.strengthened(curve.strength))
    return Strength(problem, curve, chosen)


def strength_lines(told: dict[str, Any] | None) -> list[str]:
    """What the terminal says of it."""
    if told is None:
        return []
    k, n = told["strengths"].index(told["strength"]), len(told["strengths"])
    left = f"{plain(told['squares'][k])} of {told['values']} values"
    by = f"by {RULES[told['rule']]} among {n} strengths" if n > 1 else "as the study gives it"
    by = by if told["has_corner"] else f"since the L-curve has no corner among {n} strengths"
    return [
        f"priors    {plain(told['strength'], 3)} times as strong as stated (deviations times "
        f"{plain(told['prior_sd_times'], 3)}), {by}; squares there {left}"
    ]
