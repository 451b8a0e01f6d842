"""What an updating run found, and how far to trust it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from femend.correlate import mac
from femend.estimate.updating.history import Iteration
from femend.estimate.updating.lost_modes import CONTRADICTED, Flags, out_of
from femend.estimate.updating.problem import Evaluation, Problem
from femend.estimate.updating.unknown import LEAST_FACTOR, limits
from femend.model.terms.unknowns import covariance_of
from femend.numerals import plain

__all__ = ["ModeRow", "ParameterRow", "Status", "UpdateResult"]

FloatArray = NDArray[np.float64]
Status = Literal["converged", "at bound", "stalled", "limit", "stopped"]

# beyond so many prior deviations a parameter has left its prior
LEFT = 2.0
ADVICE = {
    "converged": "",
    "at bound": "parameters stand at their limits: are these right, or does the model lack something there?",
    "stalled": "no step lowers the cost: modes that change places, or derivatives too coarse; try other starts",
    "limit": "the search was still going down: allow more iterations",
    "stopped": "stopped on request: go on with resume=True",
}


class ParameterRow(NamedTuple):
    """One parameter: value before and after, deviation, prior deviations moved, share of its prior variance that the
    data took away (NaN without prior), whether it stands at a limit."""

    name: str
    before: float
    value: float
    sd: float
    z: float
    learned: float
    at_bound: bool


class ModeRow(NamedTuple):
    """One measured mode, by the number its test gives it: frequency in Hz measured, before and after; MAC before and
    after; model mode (from 1) after.

    NaN and 0 where it has no mate, or where no shape was measured."""

    configuration: str
    mode: int
    freq: float
    freq_before: float
    freq_after: float
    mac_before: float
    mac_after: float
    mate: int


@dataclass(frozen=True, eq=False, repr=False)
class UpdateResult:
    """`status` of the run, evaluations `before` and `after`, unknowns `at_bound` (n,), and its `history`."""

    problem: Problem
    before: Evaluation
    after: Evaluation
    status: Status
    at_bound: NDArray[np.bool_]
    history: tuple[Iteration, ...]

    @property
    def advice(self) -> str:
        """What the status asks for, "" if nothing; where the model failed on the last step, how, and which modes were
        let go."""
        failed = [n for n in self.history[-1].notes if n.startswith("no ")] if self.status == "stalled" else []
        gone = self._gone()
        held = (
            [
                f"{', '.join(gone)} ran to 0 and {'are' if len(gone) > 1 else 'is'} held at {LEAST_FACTOR:g}: does it "
                "make up for something else that is too stiff or too heavy, or is there nothing of it? give bounds, or "
                "leave it out"
            ]
            if gone
            else []
        )
        return "; ".join(text for text in [ADVICE[self.status], *held, self._without(), *failed[-1:]] if text)

    def _without(self) -> str:
        """That modes were let go during the search, and what they may be."""
        times = self.history[-1].let_go
        against = [(c, i) for c, i in self._out() if times[c][i] == CONTRADICTED]
        lost = [mode for mode in self._out() if mode not in against]
        said = []
        if lost:
            one = len(lost) == 1
            said.append(
                f"measured mode{'' if one else 's'} {self._named(lost)} lost {'its mate' if one else 'their mates'} on "
                f"the way and {'does' if one else 'do'} not count in what was found: a mode the model lacks, a second "
                "pole of one resonance, or parameters that have to come nearer first?"
            )
        if against:
            one = len(against) == 1
            it = "it" if one else "they"
            said.append(
                f"measured mode{'' if one else 's'} {self._named(against)} {'is' if one else 'are'} like no mode of "
                f"the model for sure, and what explains all others contradicts {'it' if one else 'them'}: {it} "
                f"{'does' if one else 'do'} not count in what was found, which {it} would have led elsewhere; look for "
                "something the model lacks, a second pole of one resonance, or more sensors that tell modes apart"
            )
        return "; ".join(said)

    def _named(self, modes: Sequence[tuple[int, int]]) -> str:
        """Test `modes`, (configuration, mode) from 0, with their frequencies, and the model's modes they resemble."""
        who: dict[str, list[str]] = {}
        for c, i in modes:
            test, state = self.problem.configurations[c].test, self.after.states[c]
            assert test is not None
            told = f"{test.numbers[i]} at {plain(test.freq[i])} Hz"
            if test.phi is not None:
                there = np.isfinite(test.phi).all(axis=1)
                like = np.nan_to_num(mac(test.phi[there][:, [i]], state.value("phi")[there])[0])
                best = np.argsort(-like)[:2]
                each = [f"{plain(like[j], 2)} with that at {plain(state.value('freq')[j])} Hz" for j in best]
                told += f" (MAC {', '.join(each)})"
            who.setdefault(self.problem.configurations[c].name, []).append(told)
        return "; ".join(f"{name} {', '.join(told)}" for name, told in who.items())

    def _out(self) -> list[tuple[int, int]]:
        return out_of(self.after, self.history[-1].let_go)

    def _gone(self) -> list[str]:
        """Factors that stand at the least that a factor may be."""
        items = zip(self.problem.unknowns.items, self.at_bound, self.p, strict=True)
        return [u.name for u, at, p in items if at and u.bounds == (LEAST_FACTOR, np.inf) and u.value(p) < 1]

    @property
    def p(self) -> FloatArray:
        """The unknowns' p (n,)."""
        return self.after.p

    @property
    def values(self) -> dict[str, float]:
        """Values by name."""
        return dict(zip(self.problem.unknowns.names, self.problem.unknowns.values(self.p).tolist(), strict=True))

    @cached_property
    def precision(self) -> FloatArray:
        """Gauss-Newton precision (n, n) of p with the prior's."""
        J = self.after.jacobian
        assert J is not None
        return np.asarray(J.T @ J + self.problem.unknowns.precision)

    @cached_property
    def covariance(self) -> FloatArray:
        """Laplace covariance (n, n) of p; infinite variance where neither data nor prior say anything.

        Unknowns at a limit are treated as free: their deviation is that of the unbounded problem."""
        return covariance_of(self.precision)

    @property
    def sd(self) -> dict[str, float]:
        """Standard deviations of the values by name, to first order."""
        sd = self.problem.unknowns.value_sd(self.p, self.covariance)
        return dict(zip(self.problem.unknowns.names, sd.tolist(), strict=True))

    @property
    def log_evidence(self) -> float:
        """Laplace's ln Z but for a constant of the data; NaN without proper priors, or at a limit."""
        prior = self.problem.unknowns.precision
        sign, before = np.linalg.slogdet(prior)
        if sign <= 0 or self.at_bound.any():
            return float("nan")
        return float(-0.5 * self.after.cost - 0.5 * (np.linalg.slogdet(self.precision)[1] - before))

    def parameters(self) -> list[ParameterRow]:
        """One row a parameter."""
        u = self.problem.unknowns
        before, after = u.values(self.before.p), u.values(self.p)
        variance, sd = np.diag(self.covariance), u.value_sd(self.p, self.covariance)
        prior = np.array([x.sd for x in u.items])
        z = (self.p - u.mean) / prior
        lower, upper = limits(u)
        width = (upper - lower) / np.sqrt(12.0)
        # a field's parts are known beforehand by their neighbours too
        known = np.where(np.isfinite(u.prior_sd), u.prior_sd, width)
        learned = np.full(len(u), np.nan)
        bounded = np.isfinite(known)
        learned[bounded] = 1.0 - np.minimum(variance[bounded] / known[bounded] ** 2, 1.0)
        return [
            ParameterRow(n, float(b), float(a), float(s), float(k), float(x), bool(at))
            for n, b, a, s, k, x, at in zip(u.names, before, after, sd, z, learned, self.at_bound, strict=True)
        ]

    def modes(self) -> list[ModeRow]:
        """One row a measured mode, of all configurations."""
        rows = []
        for i, c in enumerate(self.problem.configurations):
            if c.test is None:
                continue
            ends = [c.test.mates(e.states[i]) for e in (self.before, self.after)]
            f, m = np.full((2, c.test.freq.size), np.nan), np.full((2, c.test.freq.size), np.nan)
            for k, (pairs, e) in enumerate(zip(ends, (self.before, self.after), strict=True)):
                t = pairs.test
                f[k, t] = e.states[i].value("freq")[pairs.mate[t]]
                if c.test.phi is not None:
                    phi = e.states[i].value("phi")[:, pairs.mate[t]]
                    there = np.isfinite(c.test.phi).all(axis=1)
                    m[k, t] = np.diag(mac(c.test.phi[there][:, t], phi[there]))
            for j in range(c.test.freq.size):
                g, x = f[:, j].tolist(), m[:, j].tolist()
                mate = int(ends[1].mate[j]) + 1
                rows.append(ModeRow(c.name, c.test.numbers[j], float(c.test.freq[j]), g[0], g[1], x[0], x[1], mate))
        return rows

    def changed_most(self, n: int = 3) -> list[str]:
        """The `n` parameters whose values changed most, relative to where they were."""
        rows = sorted(self.parameters(), key=lambda r: -abs(r.value / r.before - 1.0) if r.before else -abs(r.value))
        return [r.name for r in rows[:n]]

    def left_prior(self, beyond: float = LEFT) -> list[str]:
        """Parameters further from the prior mean than `beyond` prior deviations."""
        return [r.name for r in self.parameters() if abs(r.z) > beyond]

    def determined(self) -> list[str]:
        """Parameters of which the data took away more than half the prior variance; the others stay at the prior."""
        return [r.name for r in self.parameters() if not r.learned <= 0.5 and np.isfinite(r.sd)]

    def unpaired(self) -> list[tuple[str, int]]:
        """(configuration, number of the mode in its test) of measured modes without a mate at the end."""
        return [
            (c.name, c.test.numbers[i])
            for c, mates in zip(self.problem.configurations, self.after.mates, strict=True)
            if c.test is not None and mates is not None
            for i in np.flatnonzero((mates.mate < 0) | (mates.mac < self.problem.mac_min))
        ]

    def let_go(self) -> list[tuple[str, int]]:
        """(configuration, number of the mode in its test) of modes that lost their mate on the way and do not count."""
        found = [(self.problem.configurations[c], i) for c, i in self._out()]
        return [(c.name, c.test.numbers[i]) for c, i in found if c.test is not None]

    def counting(self) -> Flags:
        """Which test modes (n_test,) of each configuration were not let go, None where it has no modes."""
        out = self._out()
        return tuple(
            None if c.test is None else np.array([(k, i) not in out for i in range(c.test.freq.size)], dtype=np.bool_)
            for k, c in enumerate(self.problem.configurations)
        )

    def __repr__(self) -> str:
        lines = [
            f"{self.status} after {len(self.history) - 1} steps, cost {plain(self.before.cost)} -> "
            f"{plain(self.after.cost)}" + (f" ({self.advice})" if self.advice else ""),
            f"{'parameter':20} {'before':>9} {'after':>9} {'sd':>9} {'prior sds':>9}  told by",
        ]
        told = set(self.determined())
        for r in self.parameters():
            z = "" if not np.isfinite(r.z) or r.z == 0 else f"{r.z:9.2f}"
            by = ("data" if r.name in told else "prior") + (", at its limit" if r.at_bound else "")
            lines.append(f"{r.name:20} {r.before:9.4g} {r.value:9.4g} {r.sd:9.2g} {z:>9}  {by}")
        modes = self.modes()
        if modes:
            lines.append(
                f"{'mode':20} {'measured':>9} {'before':>9} {'after':>9} {'error %':>9} {'MAC':>6} {'after':>6}"
            )
        for m in modes:
            label, error = f"{m.configuration} {m.mode}", 100 * (m.freq_after / m.freq - 1)
            lines.append(
                f"{label:20} {m.freq:9.4g} {m.freq_before:9.4g} {m.freq_after:9.4g} {error:9.2f} "
                f"{m.mac_before:6.3f} {m.mac_after:6.3f}"
            )
        return "\n".join(lines)
