"""Sensors whose channels were exchanged, or turned, told by shapes: a model that is off shifts resonances, but between
the sensors its modes move much as the structure does.

On every line the responses h of all sensors are held against the covariance that modes of the model, at frequencies
known to a tenth and with phases not known, give them: C = sum_m phi_m phi_m^T |g_m|^2 + a floor. The level of h is not
known, so that its log-likelihood is -n ln(h^H C^-1 h) (an angular central Gaussian distribution: Tyler, Biometrika 74
(1987) 579, eq. 1, for complex values). What an exchange of two sensors does to its mean over the lines says whether
they are exchanged.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from femend.correlate.mistaken_units import INCH, MILLI, G

__all__ = [
    "CLEAR",
    "Exchange",
    "ForceLines",
    "Shapes",
    "at_level",
    "clear_lines",
    "exchanged",
    "gain",
    "held_against",
    "inverse_covariances",
    "lines_of",
    "put_right",
    "rescaled",
    "turned",
]

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

# relative deviation of the model's frequencies
SHIFT = 0.1
# deviations at which it is tried, in these
SHIFTS = np.linspace(-2.5, 2.5, 21)
# power at every sensor, of the mean one's, that modes do not explain
FLOOR = 0.03
# gain in mean log-likelihood from which sensors are exchanged: of 89 generated cases (tests/blind/mistaken_channels.py)
# as they are none comes above 0.1, and of 178 with two random sensors exchanged all but those that move alike above it
TELLING = 1.5
# what a mistaken direction or unit (g and m/s^2, m and mm, in and mm) multiplies a sensor by
MISTAKEN = (-1.0, *(f for unit in (G, MILLI, INCH) for f in (unit, 1 / unit)))
# exchanges from which a circle of three is sought, any of its three pairs being one to begin with
FIRST = 8
# lines that count at least, and at most
FEWEST, MOST = 12, 400
# values that stand this far out of their noise count
CLEAR = 3.0


@dataclass(frozen=True, eq=False)
class Shapes:
    """Modes of a model: `freq` (n_modes) in Hz, damping ratios `zeta`, shapes at the sensors `out` (n_out, n_modes) and
    at the forces `into` (n_in, n_modes)."""

    freq: FloatArray
    zeta: FloatArray
    out: FloatArray
    into: FloatArray

    def powers(self, freq: FloatArray) -> FloatArray:
        """Mean |g_m|^2 (n_freq, n_modes) of the modes' accelerances at `freq` (n_freq) in Hz, over model frequencies
        that are off."""
        weight = np.exp(-0.5 * SHIFTS**2)
        f2, total = freq[:, None] ** 2, np.zeros((freq.size, self.freq.size))
        for shift, w in zip(SHIFTS, weight / weight.sum(), strict=True):
            own = self.freq * np.exp(SHIFT * shift)
            total += w * f2**2 / ((own**2 - f2) ** 2 + 4 * self.zeta**2 * own**2 * f2)
        return total


@dataclass(frozen=True, slots=True)
class Exchange:
    """Two sensors, by number, that look exchanged, or more in a circle: each shows what the next one should, the last
    what the first one should. `left` is the share of what contradicts the shapes of the model that is left with their
    recordings put right (geometric mean over lines)."""

    sensors: tuple[int, ...]
    left: float


def put_right(n: int, found: Sequence[Exchange]) -> list[int]:
    """Order in which the recordings of `n` sensors are those of the sensors, exchanges put right.

    >>> put_right(4, [Exchange((0, 2, 3), 0.1)])
    [3, 1, 0, 2]
    """
    order = list(range(n))
    for one in found:
        for shows, of in zip(one.sensors, (*one.sensors[1:], one.sensors[0]), strict=True):
            order[of] = shows
    return order


def exchanged(H: ComplexArray, noise: FloatArray, freq: FloatArray, model: Shapes) -> list[Exchange]:
    """Sensors that look exchanged, two or more, in measured accelerances H (n_freq, n_out, n_in) with deviations
    `noise` of their values, on lines `freq` (Hz). Sensors that move alike are not told apart, and nothing is told of
    fewer than three sensors or 12 lines.
    """
    n_out = H.shape[1]
    parts = _parts(H, noise, freq, model)
    order, gains, swaps = list(range(n_out)), [0.0] * n_out, 0
    while parts and swaps <= n_out // 2:
        steps, total = _steps(parts)
        mistaken = np.mean([rescaled(*p, MISTAKEN) for p in parts], axis=0)
        # a sensor upside down or in other units may fit better elsewhere, too, but best where it is, set right
        if total < TELLING or mistaken.max() > total:
            break
        for a, b in steps:
            order[a], order[b] = order[b], order[a]
            gains[a] += total / len(steps)
            parts = [(_changed(h, (a, b)), inverse) for h, inverse in parts]
        swaps += len(steps)
    return [Exchange(circle, float(np.exp(-sum(gains[i] for i in circle) / n_out))) for circle in _circles(order)]


def _steps(parts: Sequence[tuple[ComplexArray, FloatArray]]) -> tuple[list[tuple[int, int]], float]:
    """The exchange of two sensors that gains most mean log-likelihood, or two of one sensor after the other where a
    circle of three gains clearly more, and that gain."""
    table = np.triu(np.mean([_exchanged(*p) for p in parts], axis=0), 1)
    best, steps = float(table.max()), [_pair(table)]
    if best <= 0:
        return steps, best
    alone = best
    for flat in np.argsort(table, axis=None)[::-1][:FIRST]:
        a, b = (int(k) for k in np.unravel_index(flat, table.shape))
        if table[a, b] <= 0:
            break
        after = np.mean([_exchanged(_changed(h, (a, b)), inverse) for h, inverse in parts], axis=0)
        either = np.zeros(table.shape, dtype=bool)
        either[[a, b]] = either[:, [a, b]] = True
        after = np.triu(np.where(either, after, 0.0), 1)
        if table[a, b] + after.max() > max(best, alone + TELLING):
            best, steps = float(table[a, b] + after.max()), [(a, b), _pair(after)]
    return steps, best


def _pair(table: FloatArray) -> tuple[int, int]:
    i, j = np.unravel_index(np.argmax(table), table.shape)
    return int(i), int(j)


def _circles(order: Sequence[int]) -> list[tuple[int, ...]]:
    """Sensors each of which shows what the next one should, of recordings in the `order` in which they are right."""
    belongs = {shows: of for of, shows in enumerate(order)}
    found: list[tuple[int, ...]] = []
    seen: set[int] = set()
    for start in range(len(order)):
        circle = [start]
        while (following := belongs[circle[-1]]) != start:
            circle.append(following)
        if start not in seen and len(circle) > 1:
            found.append(tuple(circle))
        seen.update(circle)
    return found


def turned(H: ComplexArray, noise: FloatArray, freq: FloatArray, model: Shapes) -> list[tuple[int, float]]:
    """Sensors that look upside down in measured accelerances H (n_freq, n_out, n_in) with deviations `noise` of their
    values, on lines `freq` (Hz): number, and the share of what contradicts the shapes of the model that is left with
    its sign changed. Every third sensor at most, nothing of fewer than three or of fewer than 12 lines."""
    n_out = H.shape[1]
    parts = _parts(H, noise, freq, model)
    found: list[tuple[int, float]] = []
    while parts and len(found) < max(1, n_out // 3):
        gains = np.mean([rescaled(*p, [-1.0])[0] for p in parts], axis=0)
        gains[[i for i, _ in found]] = 0.0
        i = int(np.argmax(gains))
        if gains[i] < TELLING:
            break
        found.append((i, float(np.exp(-gains[i] / n_out))))
        sign = np.where(np.arange(n_out) == i, -1.0, 1.0)
        parts = [(h * sign, inverse) for h, inverse in parts]
    return found


def _parts(
    H: ComplexArray, noise: FloatArray, freq: FloatArray, model: Shapes
) -> list[tuple[ComplexArray, FloatArray]]:
    """What `_lines_against` gives of every force; nothing of fewer than three sensors."""
    if H.shape[1] < 3 or H.shape[0] < FEWEST:
        return []
    every = (_lines_against(H[:, :, j], noise[:, :, j], freq, model, j) for j in range(H.shape[2]))
    return [part for part in every if part is not None]


def _lines_against(
    h: ComplexArray, noise: FloatArray, freq: FloatArray, model: Shapes, j: int
) -> tuple[ComplexArray, FloatArray] | None:
    """Responses (n_lines, n_out) to force `j` on lines where a third of the sensors stand out of the noise, and the
    inverse covariances (n_lines, n_out, n_out) that the model gives them; None for too few lines."""
    found = lines_of(h, noise, freq, model, j)
    return None if found is None else (found.h, inverse_covariances(found.h, found.noise, model.out, found.power))


@dataclass(frozen=True, eq=False)
class ForceLines:
    """Responses h (n_lines, n_out) to one force, their `noise`, and mean squares `power` (n_lines, n_modes) of the
    modes there."""

    h: ComplexArray
    noise: FloatArray
    power: FloatArray


def lines_of(
    h: ComplexArray, noise: FloatArray, freq: FloatArray, model: Shapes, j: int, most: int = MOST
) -> ForceLines | None:
    """What responses h (n_freq, n_out) to force `j` show on those lines of `freq` (n_freq,) in Hz where a third of the
    sensors stand out of the `noise` (n_freq, n_out), at most `most` of them; None for too few."""
    lines = clear_lines(h, noise)
    if lines.size < FEWEST:
        return None
    lines = lines[:: max(1, -(-lines.size // most))]
    return ForceLines(h[lines], noise[lines], model.powers(freq[lines]) * model.into[j] ** 2)


def clear_lines(h: ComplexArray, noise: FloatArray) -> NDArray[np.int64]:
    """Lines of responses h (n_freq, n_out), at most 400, where a third of the sensors stand out of their `noise`."""
    lines = np.flatnonzero(((np.abs(h) > CLEAR * noise).mean(axis=1) > 1 / 3) & (h != 0).any(axis=1))
    return lines[:: max(1, -(-lines.size // MOST))]


def inverse_covariances(h: ComplexArray, noise: FloatArray, out: FloatArray, power: FloatArray) -> FloatArray:
    """Inverse covariances (n_lines, n_out, n_out) of responses with the level of h (n_lines, n_out): modes with shapes
    `out` (n_out, n_modes) and mean squares `power` (n_lines, n_modes), and what modes do not explain, `noise`
    (n_lines, n_out) among it."""
    power, floor = at_level(h, noise, out, power)
    C = np.einsum("om,fm,pm->fop", out, power, out)
    return np.linalg.inv(C + floor[:, None, None] * np.eye(h.shape[1]))


def at_level(h: ComplexArray, noise: FloatArray, out: FloatArray, power: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Mean squares `power` (n_lines, n_modes) of modes with shapes `out` (n_out, n_modes) brought to the level of
    responses h (n_lines, n_out), and the power (n_lines,) at every sensor that modes do not explain, `noise` among
    it."""
    level = np.mean(np.abs(h) ** 2, axis=1)
    own = np.einsum("om,fm,om->fo", out, power, out).mean(axis=1)
    # of noise the mean is taken: who is noisy is part of what may have been exchanged
    floor = FLOOR * level + np.mean(noise**2, axis=1)
    return power * (level / np.maximum(own, np.finfo(float).tiny))[:, None], floor


def held_against(h: ComplexArray, inverse: FloatArray) -> tuple[ComplexArray, FloatArray]:
    """C^-1 h (n_lines, n_out) and h^H C^-1 h (n_lines,) with the `inverse` C^-1 (n_lines, n_out, n_out)."""
    v = np.einsum("fop,fp->fo", inverse, h)
    return v, np.einsum("fo,fo->f", h.conj(), v).real


def _exchanged(h: ComplexArray, inverse: FloatArray) -> FloatArray:
    """Gain (n_out, n_out) in mean log-likelihood with the responses of two sensors changed for each other."""
    v, own = held_against(h, inverse)
    diagonal = np.diagonal(inverse, axis1=1, axis2=2)
    # h + d (e_a - e_b) with d = h_b - h_a
    d = h[:, None, :] - h[:, :, None]
    across = 2 * np.real(d.conj() * (v[:, :, None] - v[:, None, :]))
    square = np.abs(d) ** 2 * (diagonal[:, :, None] + diagonal[:, None, :] - 2 * inverse)
    return gain(own[:, None, None], across + square, h.shape[1])


def rescaled(h: ComplexArray, inverse: FloatArray, factors: Sequence[float] | FloatArray) -> FloatArray:
    """Gain (n_factors, n_out) in mean log-likelihood of squares with a sensor of h (n_lines, n_out) times one of the
    `factors` (n_factors,), the other way round or in other units; `inverse` covariances (n_lines, n_out, n_out)."""
    v, own = held_against(h, inverse)
    cross, square = np.real(h.conj() * v), np.abs(h) ** 2 * np.diagonal(inverse, axis1=1, axis2=2)
    return np.array([gain(own[:, None], 2 * (f - 1) * cross + (f - 1) ** 2 * square, h.shape[1]) for f in factors])


def gain(own: FloatArray, more: FloatArray, n_out: int) -> FloatArray:
    """Gain in mean log-likelihood where squares h^H C^-1 h of `own` (n_lines, ...) change by `more`."""
    return np.asarray(-n_out * np.mean(np.log(np.maximum(1 + more / own, 1e-12)), axis=0))


def _changed(h: ComplexArray, pair: tuple[int, int]) -> ComplexArray:
    out = h.copy()
    out[:, pair] = h[:, pair[::-1]]
    return out
