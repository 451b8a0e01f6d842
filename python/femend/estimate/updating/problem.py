"""The problem: unknowns with priors, and configurations of the structure with what was measured in each."""

from __future__ import annotations

import dataclasses
import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from femend.correlate import best_mates, mac
from femend.errors import ArgumentError, UpdatingError
from femend.estimate.updating.close_modes import reach
from femend.estimate.updating.responses import Compared, Mates, Response
from femend.estimate.updating.state import State, System
from femend.estimate.updating.unknown import limits
from femend.model.terms.unknowns import Unknowns

__all__ = ["Configuration", "Evaluation", "Link", "ModeTest", "Problem"]

FloatArray = NDArray[np.float64]

# a pair below this MAC is no pair, as in `correlate.pair_modes`
MAC_MIN = 0.5


@dataclass(frozen=True, eq=False)
class ModeTest:
    """Measured modes for pairing: `freq` (n_test,) Hz and real `phi` (n_sensors, n_test); NaN marks a sensor that was
    not there. `by` "shape" pairs by MAC (`correlate.pair_modes`), "order" the lowest with the lowest and so on, which
    is what is left without shapes, and leads further from afar, where no shape looks like its own. `numbers` (n_test,)
    are those by which the modes are told, 1 to n_test where none are given.
    """

    freq: FloatArray
    phi: FloatArray | None = None
    by: Literal["shape", "order"] = "shape"
    numbers: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "freq", np.asarray(self.freq, dtype=np.float64))
        if self.phi is not None:
            object.__setattr__(self, "phi", np.asarray(self.phi))
            if self.phi.ndim != 2 or self.phi.shape[1] != self.freq.size:
                raise UpdatingError(f"{self.freq.size} test frequencies and shapes {self.phi.shape}; one column each")
        object.__setattr__(self, "numbers", tuple(self.numbers) or tuple(range(1, self.freq.size + 1)))
        if len(self.numbers) != self.freq.size:
            raise UpdatingError(f"{len(self.numbers)} numbers for {self.freq.size} test frequencies; one each")

    def mates(self, state: State) -> Mates:
        """The best one-to-one pairing with the modes of `state`, then of those left over, however poor: `mac` says how
        good each pair is.

        Raises UpdatingError where the model gives fewer modes than were measured.
        """
        freq = state.value("freq")
        n = self.freq.size
        if freq.size < n:
            raise UpdatingError(f"{n} modes were measured and the model gives {freq.size}; ask it for more")
        if self.phi is None or self.by == "order":
            return Mates(np.argsort(np.argsort(self.freq)), np.ones(n), self.freq)
        there = np.isfinite(self.phi).all(axis=1)
        phi = state.value("phi")
        if phi.shape[0] != self.phi.shape[0]:
            raise UpdatingError(f"shapes were measured at {self.phi.shape[0]} sensors, the model gives {phi.shape[0]}")
        # pairs first: to find a mate for a mode that has none, however poor, is no reason to part others
        mate, agreement = best_mates(self.phi[there], phi[there], self.freq, np.maximum(freq, 1e-9), mac_min=MAC_MIN)
        return Mates(mate, agreement, self.freq)


@dataclass(frozen=True, slots=True)
class Link:
    """A system's parameter as `scale` x product of unknowns to powers: `powers` are (name of the unknown, power)."""

    powers: tuple[tuple[str, float], ...]
    scale: float = 1.0


@dataclass(frozen=True, eq=False)
class Configuration:
    """One state of the structure: its `system`, what was measured there, and which unknowns are which parameters.

    A parameter takes the unknown of its own name; `links` give another one (its own in this configuration, or shared
    under another name) or a `Link`. Parameters without unknown stay at the system's default, 1 if it has none. Raises
    UpdatingError for responses of another number of modes than the `test`, ArgumentError for what is no tuple of them.
    """

    name: str
    system: System
    responses: tuple[Response, ...]
    test: ModeTest | None = None
    links: Mapping[str, str | Link] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not isinstance(self.responses, (tuple, list)):
            takes = f"{self.name}: a Configuration takes its responses as a tuple, as (Frequencies(freq, sd),)"
            raise ArgumentError.given(takes, self.responses)
        if self.test is None:
            return
        for response in self.responses:
            modes = getattr(response, "n_modes", self.test.freq.size)
            if modes != self.test.freq.size:
                raise UpdatingError(
                    f"{self.name}: {response.name} are of {modes} modes, the test has {self.test.freq.size}: give "
                    "every response the modes of the test, in its order, or the test those of the responses"
                )

    def powers(self, unknowns: Unknowns) -> list[tuple[float, list[tuple[int, float]]]]:
        """(scale, [(unknown, power)]) for every parameter; raises UpdatingError for a link to no unknown or
        parameter."""
        out = []
        for wanted in self.links:
            if wanted not in self.system.names:
                raise UpdatingError(f"{self.name}: no parameter {wanted!r}; there are {', '.join(self.system.names)}")
        defaults = getattr(self.system, "defaults", {})
        damping = {"alpha": 0.0, "beta": 0.0, "eta": 0.0}
        for name in self.system.names:
            link = self.links.get(name, name)
            link = Link(((link, 1.0),)) if isinstance(link, str) else link
            known = [n in unknowns.names for n, _ in link.powers]
            if all(known):
                out.append((link.scale, [(unknowns.index(n), power) for n, power in link.powers]))
            elif name in self.links:
                missing = next(n for n, _ in link.powers if n not in unknowns.names)
                raise UpdatingError(f"{self.name}: {name!r} is linked to {missing!r}, which is no unknown")
            else:
                out.append((float(defaults.get(name, damping.get(name, 1.0))), []))
        return out


@dataclass(frozen=True, eq=False)
class Evaluation:
    """Residuals (m,) in deviations at p, the Jacobian (m, n) over p where asked for, and what each configuration
    said; `taken` of the residuals are met by amplitudes that were eliminated."""

    p: FloatArray
    residual: FloatArray
    jacobian: FloatArray | None
    prior: float
    states: tuple[State, ...]
    mates: tuple[Mates | None, ...]
    taken: int = 0

    @property
    def n_values(self) -> int:
        """Number of values that say something about the unknowns: the residuals but for those `taken`."""
        return self.residual.size - self.taken

    @property
    def squares(self) -> float:
        """Sum of squared residuals."""
        return float(self.residual @ self.residual)

    @property
    def cost(self) -> float:
        """Squares and prior together: twice the negative logarithm of the posterior."""
        return self.squares + self.prior


@dataclass(frozen=True, eq=False)
class Problem:
    """`unknowns` to be found from all `configurations` together; `left_out` are test modes that never count, as
    (configuration, mode) from 0.

    Raises UpdatingError for unknowns that no configuration has, and limits that exclude each other; ArgumentError for
    what are no configurations.
    """

    unknowns: Unknowns
    configurations: tuple[Configuration, ...]
    mac_min: float = MAC_MIN
    left_out: frozenset[tuple[int, int]] = frozenset()

    def __post_init__(self) -> None:
        given: Any = self.configurations
        alone = not isinstance(given, (tuple, list))
        wrong = [given] if alone else [one for one in given if not isinstance(one, Configuration)]
        if wrong:
            raise ArgumentError.given("`Problem` takes its configurations as a tuple of Configuration(...)", wrong[0])
        object.__setattr__(self, "configurations", tuple(given))
        if not self.configurations:
            raise UpdatingError("there is no configuration: nothing was measured")
        limits(self.unknowns)
        used = {i for powers in self._powers for _, own in powers for i, _ in own}
        idle = [u.name for i, u in enumerate(self.unknowns.items) if i not in used]
        if idle:
            raise UpdatingError(f"no configuration has a parameter {idle[0]!r}; name it as the system does, or link it")

    def by_order(self) -> Problem:
        """The same problem with modes paired in the order of frequency."""
        return dataclasses.replace(
            self,
            configurations=tuple(
                c if c.test is None else dataclasses.replace(c, test=dataclasses.replace(c.test, by="order"))
                for c in self.configurations
            ),
        )

    def without(self, configuration: int, mode: int) -> Problem:
        """The same problem with a test `mode` of `configuration`, both from 0, that does not count."""
        return dataclasses.replace(self, left_out=self.left_out | {(configuration, mode)})

    @cached_property
    def _powers(self) -> list[list[tuple[float, list[tuple[int, float]]]]]:
        return [c.powers(self.unknowns) for c in self.configurations]

    def factors(self, p: FloatArray, which: int) -> FloatArray:
        """The factors that configuration number `which` sees at `p` (n,)."""
        v = self.unknowns.values(p)
        return np.array([s * np.prod([v[i] ** e for i, e in own]) for s, own in self._powers[which]])

    def chain(self, p: FloatArray, which: int) -> FloatArray:
        """d factor / dp (n, n_parameters) of configuration number `which` at `p` (n,)."""
        v = self.unknowns.values(p)
        slope = np.array([v[i] if u.positive else u.scale for i, u in enumerate(self.unknowns.items)])
        out = np.zeros((len(v), len(self._powers[which])))
        for j, (s, own) in enumerate(self._powers[which]):
            for i, e in own:
                rest = np.prod([v[k] ** f for k, f in own if k != i])
                out[i, j] += s * e * v[i] ** (e - 1) * rest * slope[i]
        return out

    def prior_cost(self, p: FloatArray) -> float:
        """(p - mean)^T precision (p - mean)."""
        d = p - self.unknowns.mean
        return float(d @ self.unknowns.precision @ d)

    def states(self, p: FloatArray) -> tuple[State, ...]:
        """What every configuration's system says at `p` (n,); raises what they raise.

        A system that several configurations have at the same factors is solved once for them.
        """
        found: list[tuple[System, FloatArray, State]] = []
        for i, c in enumerate(self.configurations):
            factors = self.factors(p, i)
            known = (s for system, at, s in found if system is c.system and np.array_equal(at, factors))
            found.append((c.system, factors, next(known, None) or c.system.solve(factors)))
        return tuple(s for _, _, s in found)

    def active(self, states: Sequence[State]) -> tuple[NDArray[np.bool_] | None, ...]:
        """For each configuration the test modes (n_test,) with a mate of at least `mac_min` that are not `left_out`;
        None without modes."""
        out: list[NDArray[np.bool_] | None] = [
            None if c.test is None else c.test.mates(s).mac >= self.mac_min
            for c, s in zip(self.configurations, states, strict=True)
        ]
        for c, mode in self.left_out:
            flags = out[c]
            if flags is not None:
                flags[mode] = False
        return tuple(out)

    def evaluate(
        self,
        p: ArrayLike,
        *,
        slopes: bool = False,
        active: Sequence[NDArray[np.bool_] | None] | None = None,
        states: Sequence[State] | None = None,
    ) -> Evaluation:
        """Residuals at `p` (n,), modes paired anew; `active` fixes which test modes count (all paired ones by default).

        `states` are those of `states(p)` where they are known. Raises UpdatingError where nothing is left to compare,
        and what the systems raise.
        """
        p = np.asarray(p, dtype=np.float64)
        found = self.states(p) if states is None else tuple(states)
        active = self.active(found) if active is None else active
        parts, rows, mates = [], [], []
        for i, (c, state, count) in enumerate(zip(self.configurations, found, active, strict=True)):
            pairs = None
            if c.test is not None and count is not None:
                pairs = c.test.mates(state)
                pairs = dataclasses.replace(pairs, mate=np.where(count, pairs.mate, -1))
            mates.append(pairs)
            if slopes:
                state.need(0 if pairs is None else reach(pairs.mate, state.value("freq")))
            own = [r.compare(state, pairs, slopes) for r in c.responses]
            parts += own
            if slopes:
                chain = self.chain(p, i)
                rows += [_times(chain, o) for o in own]
        residual = np.concatenate([o.residual for o in parts]) if parts else np.zeros(0)
        if residual.size == 0:
            raise UpdatingError("no measured mode has a mate in the model: " + self.unpaired(found))
        self._numbers([o.residual for o in parts], "")
        jacobian = np.concatenate(rows) if slopes else None
        self._numbers(rows, "derivative of the ")
        taken = sum(o.taken for o in parts)
        return Evaluation(p, residual, jacobian, self.prior_cost(p), found, tuple(mates), taken)

    def _numbers(self, parts: Sequence[FloatArray], what: str) -> None:
        """Raises UpdatingError naming the response of the first of `parts` that holds anything but numbers."""
        names = [(c.name, r.name) for c in self.configurations for r in c.responses]
        for (configuration, response), part in zip(names, parts, strict=False):
            bad = np.argwhere(~np.isfinite(part))
            if bad.size:
                raise UpdatingError(
                    f"{configuration}: the {what}difference {int(bad[0, 0]) + 1} of {response} is not a number; what "
                    "was measured or what the model gives there is not one"
                )

    def unpaired(self, states: Sequence[State]) -> str:
        """The best MAC of every measured mode in words, for `states` of all configurations."""
        words = []
        for c, s in zip(self.configurations, states, strict=True):
            if c.test is not None and c.test.phi is not None:
                best = np.nan_to_num(mac(np.nan_to_num(c.test.phi), s.value("phi"))).max(axis=1)
                words.append(f"{c.name}: best MAC " + ", ".join(f"{x:.2f}" for x in best))
        return "; ".join(words) + f" (asked: {self.mac_min:g}); check sensors, directions and the number of model modes"

    @cached_property
    def fingerprint(self) -> str:
        """A digest of unknowns, priors and measured values, by which a kept history is known to be of this problem."""
        digest = hashlib.sha256(repr(self.unknowns.items).encode())
        digest.update(np.ascontiguousarray(self.unknowns.precision).tobytes())
        for c in self.configurations:
            digest.update(f"{c.name} {c.system.names} {sorted(c.links.items(), key=str)}".encode())
            for r in c.responses:
                for f in dataclasses.fields(r):  # type: ignore[arg-type]
                    digest.update(_bytes(getattr(r, f.name)))
        return digest.hexdigest()


def _times(chain: FloatArray, part: Compared) -> FloatArray:
    """(m, n) over the unknowns from (n_parameters, m) over the factors."""
    assert part.slopes is not None
    return np.asarray((chain @ part.slopes).T)


def _bytes(value: Any) -> bytes:
    return np.ascontiguousarray(value).tobytes() if isinstance(value, np.ndarray) else repr(value).encode()
