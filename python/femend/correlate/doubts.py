"""What is wrong with channels, told by the size and the sign of measured FRFs against those of a model.

A unit that was mistaken, or a sensor the other way round, stays for all lines, where a model that is off shifts
resonances: medians over the lines tell the one from the other.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from femend.correlate.exchanged import Exchange
from femend.correlate.misplaced import Misplaced
from femend.correlate.misread import Misread
from femend.correlate.mistaken_quantity import mistaken_quantity, quantity_hint
from femend.correlate.mistaken_units import mistaken_as
from femend.correlate.time_axis import KNOWN_RATES
from femend.dof import Dof
from femend.numerals import plain

__all__ = [
    "Doubt",
    "exchange_doubts",
    "level_hint",
    "level_doubts",
    "misplaced_doubts",
    "misread_doubts",
    "sign_doubts",
    "suggested",
    "time_doubts",
    "twice_doubts",
]

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

# lines that a median is taken of at least
FEWEST = 12
# all responses larger or smaller than the model's by this factor; one of them by this factor against the others
ALL, ONE = 3.0, 5.0
# mean cosine of the phase between test and model: below its negative a sensor is upside down, above it others are not
REVERSED = 0.7
# a sensor that moves less than this share of the one that moves most tells no sign: a node of a shape may be there
MOVES = 0.1
# two sensors at one place may differ by this share: by what they were calibrated to, glue, and noise
TWICE = 0.3
# beyond this factor it is the model that does not move: in a direction that is held, or not coupled with the force's
NOWHERE = 1e6
# a model's response below this share of its largest one to the same force is none but for rounding
ROUNDING = 1e-9
# how near a factor has to come to that of units mistaken for each other
_NEAR = 1.35


@dataclass(frozen=True, slots=True)
class Doubt:
    """What looks mistaken: its `kind` ("level", "sensor level", "sensor sign", "force sign", "time axis", "twice",
    "held", "unrelated", "silent", "elsewhere" or "exchanged"), the `channel` by name ("" for all), and the sentence.

    `factor` is what is shown times what should be (-1 upside down), None where no factor is the mistake; `order` are
    the names of exchanged sensors, each of which shows what the next one should, the last what the first one should.
    """

    kind: str
    channel: str
    text: str
    factor: float | None = None
    order: tuple[str, ...] = ()


def level_doubts(
    H: ComplexArray,
    model: ComplexArray,
    outputs: Sequence[str],
    clear: NDArray[np.bool_] | None = None,
    freq: FloatArray | None = None,
) -> list[Doubt]:
    """Doubts about responses per force H (n_freq, n_out, n_in) that are larger or smaller than the `model`'s, as no
    resonance elsewhere makes them: all of them, or single ones of the `outputs` (names).

    `clear` (n_freq, n_out, n_in) marks the values that stand clear of noise; None for all. With the lines `freq`
    (n_freq,) in Hz quantities that are mistaken for each other are told as such. Nothing is told of fewer
    than 12 lines, nor by lines on which the model does not respond but for rounding: planes that do not couple. A
    sensor that only has those is told where it moves as others do.
    """
    ratio = np.where(_valid(H, model, clear), np.abs(H) / np.where(model == 0, 1, np.abs(model)), np.nan)
    enough = np.isfinite(ratio).sum(axis=(0, 2)) >= FEWEST
    told = _uncoupled(H, model, outputs, clear)
    if not enough.any():
        return told
    power = 0 if freq is None else mistaken_quantity(ratio.reshape(len(ratio), -1), freq)
    if power:
        text = f"the responses per force are those of the model as it stands {quantity_hint(power)}"
        return [*told, Doubt("level", "", text)]
    of_sensor = np.full(len(outputs), np.nan)
    of_sensor[enough] = np.exp([np.nanmedian(np.log(ratio[:, i])) for i in np.flatnonzero(enough)])
    if enough.sum() == 2:
        return [*told, *_of_two(of_sensor, outputs)]
    whole = float(np.nanmedian(of_sensor))
    if not 1 / ALL < whole < ALL:
        told.append(_level(whole, int(enough.sum())))
    for i in map(int, np.flatnonzero(enough) if enough.sum() > 2 else ()):
        own = float(of_sensor[i] / whole)
        alone = 0 if freq is None else mistaken_quantity(ratio[:, i], freq)
        if alone:
            text = f"{outputs[i]} shows what the model as it stands does there {quantity_hint(alone)}"
            told.append(Doubt("sensor level", outputs[i], text))
        elif not 1 / ONE < own < ONE:
            text = f"{outputs[i]} shows {plain(own, 3)} times what the other sensors do, each against the model"
            text += f": {level_hint(own)}"
            told.append(Doubt("sensor level", outputs[i], text, suggested(own)))
    return told


def _uncoupled(
    H: ComplexArray, model: ComplexArray, outputs: Sequence[str], clear: NDArray[np.bool_] | None
) -> list[Doubt]:
    """Doubts about sensors that move, clear of noise, where the model responds to no force."""
    measured = H if clear is None else np.where(clear, H, 0)
    size = np.sqrt(np.mean(np.abs(measured) ** 2, axis=(0, 2)))
    told = []
    still = ~_responds(model).any(axis=(0, 2)) & (size >= MOVES * size.max()) & (size > 0)
    for i in map(int, np.flatnonzero(still)):
        text = (
            f"{outputs[i]} shows {plain(100 * size[i] / size.max(), 2)} % of what the sensor that moves most does, "
            "where the model does not respond to the force: check node and direction of force and sensor, and what "
            "the deck holds"
        )
        told.append(Doubt("held", outputs[i], text))
    return told


def _responds(model: ComplexArray) -> NDArray[np.bool_]:
    """Which values of the model's response (n_freq, n_out, n_in) are more than rounding of those to the same force."""
    size = np.abs(model)
    return np.asarray((size > ROUNDING * size.max(axis=(0, 1), initial=0.0)) & (size > 0))


def _level(whole: float, n: int) -> Doubt:
    """The doubt about all responses per force, `whole` times those of the model at `n` sensors."""
    text = (
        f"the responses per force are {plain(whole, 3)} times those of the model as it stands (median over all lines "
        f"of {n} sensor{'s' * (n > 1)}): {level_hint(whole)}"
    )
    return Doubt("level", "", text, suggested(whole))


def _of_two(ratio: FloatArray, outputs: Sequence[str]) -> list[Doubt]:
    """Doubts about the levels of the two of `outputs` whose `ratio` (n_out,) to the model's is known: of all, where
    both are off alike, of one, where the model has the other's level."""
    a, b = (int(i) for i in np.flatnonzero(np.isfinite(ratio)))
    whole = float(np.sqrt(ratio[a] * ratio[b]))
    if not 1 / ALL < whole < ALL and 1 / ALL < ratio[a] / ratio[b] < ALL:
        return [_level(whole, 2)]
    told = []
    for i, other in ((a, b), (b, a)):
        own, its = float(ratio[i]), float(ratio[other])
        if not 1 / ONE < own < ONE and 1 / ALL < its < ALL:
            text = (
                f"{outputs[i]} shows {plain(own, 3)} times what the model as it stands does, {outputs[other]} "
                f"{plain(its, 3)} times: {level_hint(own)}"
            )
            told.append(Doubt("sensor level", outputs[i], text, suggested(own)))
    return told


def sign_doubts(
    H: ComplexArray,
    model: ComplexArray,
    outputs: Sequence[str],
    inputs: Sequence[str],
    clear: NDArray[np.bool_] | None = None,
) -> list[Doubt]:
    """Doubts about sensors, and forces, whose FRFs H (n_freq, n_out, n_in) have the sign opposite to the `model`'s
    on nearly all lines while the others have the same; `outputs`, `inputs` are their names, `model` and `clear`
    (n_freq, n_out, n_in) as of `level_doubts`."""
    valid = _valid(H, model, clear)
    count = valid.sum(axis=0)
    cosine = np.where(valid, np.cos(np.angle(H) - np.angle(model)), 0.0).sum(axis=0) / np.maximum(count, 1)
    cosine[count < FEWEST] = np.nan
    size = np.sqrt(np.mean(np.abs(H) ** 2, axis=(0, 2)))
    told: list[Doubt] = []
    sensors = _opposite(cosine)
    for i in sensors:
        if size[i] >= MOVES * size.max():
            one = _reversed("sensor", outputs[i], float(np.nanmedian(cosine[i])))
            # of two sensors the other one may be, and the force
            also = "" if len(outputs) > 2 else f"; else {outputs[1 - i]} is, and the force with it"
            told.append(replace(one, text=one.text + also))
    cosine[sensors] *= -1
    forces = [j for j in range(len(inputs)) if _negative(cosine[:, j])]
    if len(inputs) == 1 or len(forces) < len(inputs):
        told += [_reversed("force", inputs[j], float(np.nanmedian(cosine[:, j]))) for j in forces]
    return told


def twice_doubts(H: ComplexArray, outputs: Sequence[Dof]) -> list[Doubt]:
    """Doubts about sensors that are said to be at one place in one direction, `outputs`, and whose FRFs H
    (n_freq, n_out, n_in) are not alike: two sensors there show the same but for noise."""
    told = []
    for i, k in itertools.combinations(range(len(outputs)), 2):
        if outputs[i].unsigned != outputs[k].unsigned:
            continue
        a, b = H[:, i] * outputs[i].sign, H[:, k] * outputs[k].sign
        apart = float(np.linalg.norm(a - b) / max(np.linalg.norm(a), np.linalg.norm(b), np.finfo(float).tiny))
        if apart > TWICE:
            text = (
                f"two sensors are said to measure {outputs[i].unsigned} and differ by {100 * apart:.0f} %: correct the "
                "node or the direction of one of them"
            )
            told.append(Doubt("twice", str(outputs[i].unsigned), text))
    return told


def exchange_doubts(found: Sequence[Exchange], outputs: Sequence[str]) -> list[Doubt]:
    """Doubts about sensors of `outputs` (names) that look exchanged, two or more."""
    told = []
    for one in found:
        names = tuple(outputs[i] for i in one.sensors)
        who = f"the sensors {', '.join(names[:-1])} and {names[-1]} look exchanged"
        changed = "changed for each other"
        if len(names) > 2:
            following = zip(names, (*names[1:], names[0]), strict=True)
            who += f" in a circle ({', '.join(f'{a} shows what {b} should' for a, b in following)})"
            changed = "put in their places"
        text = (
            f"{who}: with their recordings {changed}, what contradicts the shapes of the model's modes falls to "
            f"{plain(100 * one.left, 2)} % of what it is: look at their cables and at the table of channels"
        )
        told.append(Doubt("exchanged", names[0], text, order=names))
    return told


def misplaced_doubts(found: Sequence[Misplaced], outputs: Sequence[str], places: Sequence[str]) -> list[Doubt]:
    """Doubts about sensors of `outputs` (names) that look as if they stood at others of the `places` (names)."""
    return [
        Doubt(
            "elsewhere",
            outputs[one.sensor],
            f"the sensor {outputs[one.sensor]} does not move as the model does there, but as it does at about "
            f"{places[one.place]}: with it there, what contradicts the shapes of the model's modes falls to "
            f"{plain(100 * one.left, 2)} % of what it is: look at where it was mounted, and at its node and direction",
        )
        for one in found
    ]


def misread_doubts(found: Sequence[Misread], outputs: Sequence[str]) -> list[Doubt]:
    """Doubts about sensors of `outputs` (names) that look upside down or in other units where no force was measured."""
    told = []
    for one in found:
        name, left = outputs[one.sensor], f"{plain(100 * one.left, 2)} %"
        falls = f"what contradicts the shapes of the model's modes falls to {left} of what it is"
        size = abs(one.factor)
        if one.factor < 0:
            also = ""
            if not 1 / ONE < size < ONE:
                also = f", and it shows {plain(size, 2)} times what the others do: {level_hint(size)}"
            text = (
                f"the sensor {name} looks reversed: with its sign changed, {falls}{also}: look at how it was mounted, "
                "and turn its direction"
            )
            told.append(Doubt("sensor sign", name, text, -1.0 if 1 / ONE < size < ONE else -(suggested(size) or 1.0)))
        else:
            text = (
                f"{name} shows about {plain(size, 2)} times what the other sensors do, each against the shapes of the "
                f"model: with that taken out, {falls}: {level_hint(size)}"
            )
            told.append(Doubt("sensor level", name, text, suggested(size)))
    return told


def suggested(factor: float) -> float | None:
    """The factor of units that were mistaken for each other which comes near to `factor`, else that itself; None beyond
    what any unit does.

    >>> suggested(9.5), suggested(0.001), suggested(7.0)
    (9.80665, 0.001, 7.0)
    """
    if max(factor, 1 / factor) > NOWHERE:
        return None
    known = mistaken_as(factor, _NEAR)
    if known is None:
        return factor
    return known[0] if factor > 1 else 1 / known[0]


def time_doubts(factor: float | None, dt: float) -> list[Doubt]:
    """The doubt about a time axis with step `dt` (s), all of whose frequencies take a `factor` to be the model's; None
    for no doubt."""
    if factor is None:
        return []
    size = max(factor, 1 / factor)
    of = next((f"{of} mistaken for each other give {plain(known)}; " for known, of in KNOWN_RATES if known == size), "")
    text = (
        f"its responses have the shapes of the model at about {plain(factor, 3)} times their frequencies, all of them: "
        f"the time step of {plain(dt)} s looks {plain(factor, 3)} times what it should be: {of}check the time axis and "
        f"the rate of the recording, and if they are right the moduli and densities of the deck, which are off by "
        f"{plain(factor**2, 2)}"
    )
    return [Doubt("time axis", "", text, factor)]


def _valid(H: ComplexArray, model: ComplexArray, clear: NDArray[np.bool_] | None) -> NDArray[np.bool_]:
    moving = (H != 0) & _responds(model)
    return moving if clear is None else moving & clear


def _opposite(cosine: FloatArray) -> list[int]:
    """Rows that are opposite while all others together, or the other one, are not."""
    middle = np.array([np.nanmedian(row) if np.isfinite(row).any() else np.nan for row in cosine])
    found = [int(i) for i in np.flatnonzero(middle < -REVERSED)]
    others = np.delete(middle, found)
    agree = (
        others.size >= min(len(found) + 1, len(cosine) - 1)
        and np.isfinite(others).any()
        and float(np.nanmedian(others)) > REVERSED
    )
    return found if agree else []


def _negative(column: FloatArray) -> bool:
    return bool(np.isfinite(column).any() and np.nanmedian(column) < -REVERSED)


def _reversed(what: str, name: str, cosine: float) -> Doubt:
    text = (
        f"the {what} {name} looks reversed: the FRFs there have the sign opposite to the model's on nearly all lines "
        f"(mean cosine of the phase between them {cosine:.2f}): look at how it was mounted, and turn its direction"
    )
    return Doubt(f"{what} sign", name, text, -1.0)


def level_hint(factor: float) -> str:
    """What may have been mistaken for a factor between test and model."""
    if max(factor, 1 / factor) > NOWHERE:
        return (
            "no unit does that, but a model that hardly moves there: check node and direction of force and sensors, "
            "and what the deck holds"
        )
    where = "the unit, quantity and scale of the channels, [model] units, masses of the deck"
    found = mistaken_as(factor, _NEAR)
    if found is None:
        return f"check {where}"
    known, of = found
    return f"{of} mistaken for each other give {plain(known if factor > 1 else 1 / known, 3)}; check {where}"
