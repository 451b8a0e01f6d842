"""Measured operating shapes on the rows of a system: signs, one kind of motion, deviations from their scatter."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from femend.data import ODS
from femend.dof import Dof
from femend.errors import UpdatingError
from femend.estimate.updating.responses import deviation

__all__ = ["OnRows", "checked", "enough_values", "input_rows", "on_rows"]

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

# kinds of FRFs by the quantity of a sensor, each a factor i omega further
KINDS = {"displacement": "receptance", "velocity": "mobility", "acceleration": "accelerance"}
POWERS = {quantity: power for power, quantity in enumerate(KINDS)}


@dataclass(frozen=True, eq=False)
class OnRows:
    """Shapes `values` (n_freq, n_out) with deviations `sd` (real and imaginary part each) at the sensors `rows` of a
    system, in their directions, as a response of this `kind` of FRF."""

    values: ComplexArray
    sd: FloatArray
    rows: tuple[int, ...]
    kind: str


def on_rows(ods: ODS, sensors: Sequence[Dof], sd: ArrayLike | None, floor: float) -> OnRows:
    """The channels of `ods` at the `sensors` of a system.

    `sd` (n_freq, n_ch) or one number is of real and imaginary part each, in the channels' units; without it they are
    `sigma` of the shapes, which is of both together. `floor`, a share of the largest value of a line, is added in
    squares: what the model cannot do anyway. Raises UpdatingError for a channel that is no motion at one of the
    sensors, a place twice, shapes without `sigma` where no `sd` is given, and deviations that are not above 0.
    """
    who = f"operating shapes {ods.name!r}"
    if not floor >= 0:
        raise UpdatingError(f"{who}: floor {floor:g} is a share of the line's largest value; give 0 or more")
    places = {(d.node, d.component): (i, d.sign) for i, d in enumerate(sensors)}
    rows, signs, powers = [], [], []
    for channel in ods.channels:
        if channel.dof is None or channel.quantity not in POWERS:
            raise UpdatingError(
                f"{who}: {channel.text} is no {', '.join(KINDS)} at a node and direction; leave it out (`select`)"
            )
        at = places.get((channel.dof.node, channel.dof.component))
        if at is None:
            raise UpdatingError(
                f"{who}: {channel.text} is at none of the system's {len(sensors)} sensors; add "
                f"{channel.dof.unsigned} to them, or leave the channel out (`select`)"
            )
        if at[0] in rows:
            raise UpdatingError(f"{who}: two channels are at {channel.dof.unsigned}; leave one out (`select`)")
        rows.append(at[0])
        signs.append(float(channel.dof.sign * at[1]))
        powers.append(POWERS[channel.quantity])
    if not rows:
        raise UpdatingError(f"{who}: there is no channel: nothing was measured")
    top = max(powers)
    # one FRF is of one kind: what lies below the highest is differentiated
    scale = np.array(signs) * (2j * np.pi * ods.freq[:, None]) ** (top - np.array(powers))
    values = ods.shapes.T * scale
    own = _scatter(ods, who) if sd is None else deviation(sd, values.shape, who)
    largest = np.abs(values).max(axis=1, keepdims=True)
    return OnRows(values, np.hypot(own * np.abs(scale), floor * largest), tuple(rows), list(KINDS.values())[top])


def _scatter(ods: ODS, who: str) -> FloatArray:
    """Deviations (n_freq, n_ch) of real and imaginary part each."""
    if ods.sigma is None:
        raise UpdatingError(
            f"{who}: they hold no scatter (`sigma`) to weigh by; give `sd`, or take shapes that have it "
            "(`ods_of_order`, `mean_shapes` of repeated recordings)"
        )
    sigma = ods.sigma.T / np.sqrt(2.0)
    # a mean of a single value has no scatter of its own: that of the channel's others stands for it
    known = np.where(sigma > 0, sigma, np.nan)
    if np.isnan(known).all(axis=0).any():
        row = int(np.flatnonzero(np.isnan(known).all(axis=0))[0])
        raise UpdatingError(f"{who}: {ods.channels[row].text} has a scatter of 0 on all lines; give `sd`")
    return np.asarray(np.where(np.isnan(known), np.nanmedian(known, axis=0), known))


def input_rows(places: Sequence[Dof], sensors: Sequence[Dof], who: str) -> tuple[tuple[int, ...], FloatArray]:
    """Rows (n_in,) of the `sensors` of a system that the `places` of forces are, and signs (n_in,) that turn their
    directions into those of the sensors; raises UpdatingError for a place that is none of them."""
    if not places:
        raise UpdatingError(f"{who}: no place of a force is given; name the nodes and directions in which it acts")
    found = {(d.node, d.component): (i, d.sign) for i, d in enumerate(sensors)}
    for place in places:
        if (place.node, place.component) not in found:
            raise UpdatingError(
                f"{who}: a force acts at {place}, which is none of the system's {len(sensors)} sensors; add "
                f"{place.unsigned} to them: a system is asked for FRFs between its sensors, measured or not"
            )
    at = [found[place.node, place.component] for place in places]
    return tuple(i for i, _ in at), np.array([float(p.sign * s) for p, (_, s) in zip(places, at, strict=True)])


def checked(shapes: ArrayLike, sd: ArrayLike, freq: ArrayLike, who: str, line: str) -> tuple[ComplexArray, FloatArray]:
    """`shapes` and `sd` (n_freq, n_out) for lines at `freq` (n_freq,), called a `line` in Hz or rev/s.

    Raises UpdatingError for sizes that do not fit, lines that are not above 0, a deviation that is not, and a line on
    which nothing was measured (NaN marks a sensor that was not there).
    """
    values = np.asarray(shapes, dtype=np.complex128)
    at = np.asarray(freq, dtype=np.float64)
    if values.ndim != 2 or at.ndim != 1 or len(values) != at.size:
        raise UpdatingError(f"{who} have shape {values.shape} for {at.size} lines; they are (n_freq, n_out)")
    if not values.size:
        raise UpdatingError(f"{who} have shape {values.shape}: nothing was measured")
    if not (np.isfinite(at) & (at > 0)).all():
        k = int(np.flatnonzero(~(np.isfinite(at) & (at > 0)))[0])
        raise UpdatingError(
            f"{who}: line {k + 1} is at {at[k]:g} {line}; a shape at rest has no phase, leave lines out that are not "
            "above 0"
        )
    there = np.isfinite(values)
    if not there.any(axis=1).all():
        k = int(np.flatnonzero(~there.any(axis=1))[0])
        raise UpdatingError(f"{who}: no sensor has a value on line {k + 1} at {at[k]:.6g} {line}; leave the line out")
    given = np.asarray(sd, dtype=np.float64)
    if given.shape == values.shape:
        given = np.where(there, given, 1.0)  # of a value that was not there
    return values, deviation(given, values.shape, who)


def enough_values(n_values: int, n_free: int, who: str, where: str) -> None:
    """Raises UpdatingError where `n_free` complex amplitudes meet `n_values` complex values whatever the model is."""
    if n_values <= n_free:
        raise UpdatingError(
            f"{who}: {n_values} complex values{where} are met by {n_free} free amplitudes whatever the model is; take "
            f"{n_free + 1} values or more (sensors, lines), fewer places of forces, or forces that are known"
        )
