"""Recordings with their force against the deck as it stands: whether all of their resonances are off by one factor, as
a modulus, a thickness or a time axis puts them, or as a digit of a single parameter of the study does."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from femend.analysis.frf import shapes_at
from femend.analysis.model_modes import model_modes
from femend.correlate.doubts import ROUNDING, Doubt, time_doubts
from femend.correlate.exchanged import Shapes
from femend.correlate.resonances import TELLING, Lines, Off, clear_lines_of, common_factor, explained
from femend.correlate.time_axis import known_rate
from femend.data import ModeSet, Recording
from femend.diagnose.staged.prepare import FrfData
from femend.errors import FemendError
from femend.model import Model, Pairing, Parameter
from femend.numerals import plain

__all__ = ["Against", "frequency_doubts"]

FloatArray = NDArray[np.float64]

# factors of a time axis from which it is thought of first: a modulus is hardly 40 times off, but in other units
OF_TIME = 6.0
# factors that a mistaken digit puts on a parameter, and what it may be a factor on
DIGITS = (0.01, 0.1, 10.0, 100.0)
OF_DIGITS = ("E", "A", "I1", "I2", "J", "t", "rho", "mass", *(f"k{i}" for i in range(1, 7)))
# gain in mean log-likelihood from which a digit is mistaken: of the cases of `resonances.TELLING` as they are one comes
# to 0.9, the others to 0.2, a modulus of 7e9 for 7e10 in one of two halves of a cantilever to 3.4, in a plate to 19
MISTAKEN = 2.5
# gain in mean log-likelihood of a sensor that the model explains as it is from which no digit is sought; parameters and
# DOFs up to which they are tried, each by modes of its own
WELL, MOST, MOST_DOFS = 1.5, 12, 20_000


@dataclass(frozen=True, eq=False)
class Against:
    """A recording with its force, its FRFs, and what is doubted of single sensors in them."""

    recording: Recording
    data: FrfData
    told: Sequence[Doubt] = ()

    @property
    def righted(self) -> FrfData:
        """The FRFs with the mistakes of single sensors taken out."""
        names = [str(d) for d in self.data.outputs]
        H, noise = self.data.H.copy(), self.data.noise.copy()
        for doubt in self.told:
            if doubt.order and set(doubt.order) <= set(names):
                shows = [names.index(name) for name in doubt.order]
                for values in (H, noise):
                    values[:, [*shows[1:], shows[0]]] = values[:, shows]
            elif doubt.factor is not None and doubt.channel in names:
                i = names.index(doubt.channel)
                H[:, i], noise[:, i] = H[:, i] / doubt.factor, noise[:, i] / abs(doubt.factor)
        return replace(self.data, H=H, noise=noise)


def frequency_doubts(
    model: Model, zeta: float, modes: ModeSet, pairing: Pairing, used: Sequence[Against], *, digits: bool = False
) -> list[tuple[Doubt, tuple[str, ...]]]:
    """Doubts about the frequencies of recordings `used` against the `modes` of the `model`, whose damping ratio is
    `zeta`, each with the names of the recordings that raise it. Nothing is told that a sensor doubted by itself
    explains as well. Mistaken `digits` are sought though the model explains the recordings well as it is."""
    told: list[tuple[Doubt, tuple[str, ...]]] = []
    rest: list[Against] = []
    found: list[Lines] = []
    for one in used:
        own = _lines([one.data], modes, pairing)
        axis = _time_axis(one.recording, _beyond(common_factor(own), _by_sensors([one], own, modes, pairing)))
        told += [(doubt, (one.recording.name,)) for doubt in axis]
        if own and not axis:
            rest.append(one)
            found += own
    if not found:
        return told
    least = _by_sensors(rest, found, modes, pairing)
    off = _beyond(common_factor(found), least)
    doubt = _digit(_Tried(model, zeta, modes, pairing, [one.data for one in rest]), found, off, least, digits)
    if doubt is None and off is not None:
        doubt = _frequencies(off)
    return told if doubt is None else [*told, (doubt, tuple(one.recording.name for one in rest))]


def _by_sensors(used: Sequence[Against], found: Sequence[Lines], modes: ModeSet, pairing: Pairing) -> float:
    """Gain in mean log-likelihood of the lines `found` with the mistakes of single sensors taken out."""
    if not found or not any(one.told for one in used):
        return 0.0
    righted = _lines([one.righted for one in used], modes, pairing)
    return float((explained(righted) - explained(found)).max()) if righted else 0.0


def _beyond(off: Off | None, least: float) -> Off | None:
    """A factor that gains clearly more than the `least`."""
    return off if off is not None and off.gain.min() > least + (TELLING if least else 0.0) else None


def _lines(datas: Sequence[FrfData], modes: ModeSet, pairing: Pairing) -> list[Lines]:
    """What FRFs tell of frequencies against `modes`, at sensors that these move."""
    found = []
    for data in datas:
        out, into = (shapes_at(modes, [pairing[d].dof for d in dofs]) for dofs in (data.outputs, data.inputs))
        moves = np.abs(out).max(axis=1) > ROUNDING * np.abs(out).max(initial=0.0)
        shapes = Shapes(modes.freq, modes.zeta, out[moves], into)
        found += clear_lines_of(data.H[:, moves], data.noise[:, moves], data.freq, shapes)
    return found


def _time_axis(recording: Recording, off: Off | None) -> list[Doubt]:
    """The doubt about the time axis of a recording whose frequencies are off as those of one that was mistaken are."""
    rate = None if off is None or not recording.is_time else known_rate(off.factor)
    if rate is None or max(rate, 1 / rate) < OF_TIME:
        return []
    return time_doubts(rate, recording.time.dt)


def _frequencies(off: Off) -> Doubt:
    """The doubt about resonances that are all elsewhere, from the factor that makes them the model's."""
    times = 1 / off.factor
    size = max(times, off.factor)
    high = "high" if times > 1 else "low"
    text = (
        f"its resonances are about {plain(size, 2)} times as {high} as the model's: with that taken out {off.modes} of "
        "them have the shapes of the model's modes, and as it is they have not. A modulus is off by about "
        f"{plain(size**2, 2)}, or a thickness or the time step of the recording by about {plain(size, 2)}: check the "
        "materials (E, RHO), the thicknesses and [model] units, and the rate of the recording"
    )
    return Doubt("frequencies", "", text)


@dataclass(frozen=True, eq=False)
class _Tried:
    """A model whose parameters are tried on FRFs `datas`, as many of its modes as are `known` of the deck's."""

    model: Model
    zeta: float
    known: ModeSet
    pairing: Pairing
    datas: Sequence[FrfData]

    def explained(self, factors: dict[str, float]) -> FloatArray:
        """`explained` of the model with `factors` on parameters."""
        try:
            modes = model_modes(self.model, n_modes=self.known.n_modes, zeta=self.zeta, factors=factors)
        except (FemendError, ValueError):
            return np.full(2, -np.inf)
        found = _lines(self.datas, modes, self.pairing)
        return explained(found) if found else np.full(2, -np.inf)


def _digit(tried: _Tried, found: Sequence[Lines], off: Off | None, least: float, anyway: bool) -> Doubt | None:
    """The doubt about the one parameter that explains the lines `found` clearly better with a digit more or less, by
    more than the `least`; None where no parameter does, where one factor `off` does as well, where it would take long
    and, unless sought `anyway`, where the model explains them as it is."""
    before = explained(found)
    parameters = [p for p in tried.model.parameters if p.property in OF_DIGITS]
    well = before[0] > WELL * np.mean([line.h.shape[1] for line in found])
    if (well and off is None and not anyway) or len(parameters) > MOST or tried.model.fe.n_a > MOST_DOFS:
        return None
    best, gain = None, max(least + MISTAKEN, 0.0 if off is None else float(off.gain.min()))
    for parameter in parameters:
        for factor in DIGITS:
            more = float((tried.explained({parameter.name: factor}) - before).min())
            if more > gain:
                best, gain = (parameter, factor), more
    return None if best is None else _mistaken(*best)


def _mistaken(parameter: Parameter, factor: float) -> Doubt:
    """The doubt about a parameter that should be `factor` times what the deck says."""
    what = f"{parameter.property} of {parameter.target.removesuffix('_id')} {', '.join(map(str, parameter.ids[:3]))}"
    text = (
        f"it shows the shapes and resonances of the model with {parameter.name} ({what}) about {plain(factor)} times "
        "what the deck says, and not those of the model as it stands: a digit of that value, or its unit, may be "
        "mistaken: check it in the deck; no update goes that far"
    )
    return Doubt("parameter", parameter.name, text)
