"""Operating deflection shapes: from spectra with a reference, from order tracks; deconvolved; where they peak."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.signal import find_peaks

from femend.data import FRF, ODS, OrderTrack, TimeData
from femend.errors import SignalError
from femend.numerals import plain
from femend.signal.blocks import block_length, cut_blocks
from femend.signal.check import notes_of
from femend.signal.windows import Window, make_window

__all__ = ["modal_peaks", "ods_frf", "ods_of_order", "one_sided", "peak_frequencies"]

FloatArray = NDArray[np.float64]


def ods_frf(
    data: TimeData,
    reference: str | int,
    *,
    resolution: float | None = None,
    overlap: float = 0.5,
    window: str | Window = "hann",
    hold: str = "mean",
) -> ODS:
    """ODS-FRF of `data`: magnitude of every response, phase against the channel `reference` (name or row).

    The shape on a line is sqrt(2 Gyy df) with the phase of Gyr (Schwarz and Richardson, IMAC 1999, "Introduction to
    operating deflection shapes"), df being the window's noise bandwidth: the peak amplitude of a line that the window
    holds. Forces need not be measured; the shapes at all frequencies belong together as those of an FRF do. `hold`
    "mean" averages the blocks (`resolution`, `overlap`, `window` as in `cut_blocks`), "peak" takes on every line the
    block in which the reference is largest, as for run-ups. Raises SignalError for another `hold`, a reference that is
    still, a dead channel, and what `cut_blocks` raises.
    """
    row = data.index(reference) if isinstance(reference, str) else int(reference)
    if hold not in ("mean", "peak"):
        raise SignalError(f"hold {hold!r} is neither 'mean' nor 'peak'", recording=data.name)
    if np.ptp(data.values[row]) == 0:
        name = data.channels[row].text
        raise SignalError(f"recording {data.name!r}: the reference {name} is still", recording=data.name, channel=name)
    rows = [i for i, c in enumerate(data.channels) if c.quantity not in ("tacho", "voltage", "force")]
    faults = notes_of(data, rows)
    blocks = cut_blocks(data, resolution=resolution, overlap=overlap, window=window)
    shape = window if isinstance(window, Window) else make_window(window, block_length(data, resolution))
    tiny = np.finfo(float).tiny
    Gyr = blocks.cross(rows, [row])[:, :, 0].T
    Gyy, Grr = blocks.auto(rows).T, blocks.auto([row]).T
    coherence = np.clip(np.abs(Gyr) ** 2 / np.maximum(Gyy * Grr, tiny), 0, 1)
    shapes: NDArray[np.complex128]
    if hold == "mean":
        width = data.rate * shape.power / shape.values.sum() ** 2
        shapes = np.asarray(np.sqrt(2 * Gyy * width) * np.exp(1j * np.angle(Gyr)), dtype=np.complex128)
    else:
        best = np.argmax(np.abs(blocks.X[:, row]), axis=0)
        X = blocks.X[best, :, np.arange(blocks.freq.size)].T * (2 / shape.values.sum())
        shapes = X[rows] * np.exp(-1j * np.angle(X[row]))
    channels = tuple(data.channels[i] for i in rows)
    return ODS(
        data.name, blocks.freq, shapes, channels, "ods-frf", data.channels[row], coherence=coherence, notes=faults
    )


def ods_of_order(track: OrderTrack, order: float, step: float | None = None, *, shaft: int = 0) -> ODS:
    """Shapes of one `order` of a `track` over its frequency, phase against the tacho, on lines `step` Hz apart.

    What was tracked within half a step of a line is averaged with its phase; lines without any are left out; the
    standard deviation of a mean, from what it averages, is `sigma`. None takes a step that holds some eight times of
    the track. `shaft` is that of the order. A quick run-up shows the structure's transients in it (`run_up_shapes`
    does not). Raises SignalError for an order that is usable nowhere, and KeyError for one that was not tracked.
    """
    k = track.index(order, shaft)
    assert track.usable is not None
    keep = track.usable[k]
    if not keep.any():
        raise SignalError(f"order {plain(order)} of {track.name!r} is usable at no time", recording=track.name)
    freq, values, speed = track.freq[k, keep], track.values[k][:, keep], track.speed[keep]
    width = max(float(np.ptp(freq)) * 8 / max(freq.size, 8), 1e-9) if step is None else float(step)
    if not width > 0:
        raise SignalError(f"a step of {step} Hz between lines is none; it must be positive", recording=track.name)
    line = np.rint(freq / width).astype(np.int64)
    _, where, count = np.unique(line, return_inverse=True, return_counts=True)
    mean = np.array([np.bincount(where, v.real) + 1j * np.bincount(where, v.imag) for v in values]) / count
    spread = np.array([np.bincount(where, np.abs(v - m[where]) ** 2) for v, m in zip(values, mean, strict=True)])
    sigma = np.sqrt(spread / np.maximum(count - 1, 1) / count)
    at = np.bincount(where, freq) / count
    return ODS(
        track.name,
        at,
        np.asarray(mean, dtype=np.complex128),
        track.channels,
        "order",
        None,
        float(track.orders[k]),
        np.bincount(where, speed) / count,
        sigma=sigma,
        notes=track.notes,
    )


def one_sided(shapes: ODS, *, end: float = 0.01) -> ODS:
    """ODS-FRF `shapes` in one-sided, FRF-like form: their inverse transform's positive times, transformed back.

    A cross spectrum of responses to broadband forces holds every pole and its mirror image; the positive half of its
    inverse transform holds the poles alone, as an impulse response does, so that what fits FRFs can fit it
    (deconvolution window, Schwarz and Richardson, IMAC 2007, "Using a de-convolution window for operating modal
    analysis"). The half is windowed by an exponential that falls to `end` at its last time and whose decay is told in
    the notes. Shapes become those over the square root of the reference's magnitude; use the phases and relative
    sizes. Lines must be evenly spaced. Raises SignalError for uneven lines or an `end` outside (0, 1].
    """
    step = float(np.median(np.diff(shapes.freq))) if shapes.n_freq > 1 else 0.0
    at = np.rint(shapes.freq / step).astype(np.int64) if step > 0 else np.zeros(1, np.int64)
    if step <= 0 or np.abs(shapes.freq / step - at).max() > 1e-3 or np.diff(at).max() != 1:
        raise SignalError(f"operating shapes {shapes.name!r}: the lines are not evenly spaced from 0 Hz on")
    if not 0 < end <= 1:
        raise SignalError(f"an exponential window cannot end at {end}; give a share between 0 and 1")
    n = 2 * int(at[-1])
    full = np.zeros((len(shapes.channels), n // 2 + 1), complex)
    full[:, at] = shapes.shapes
    response = np.fft.irfft(full, n, axis=1)
    half = n // 2
    decay = -np.log(end) * step * 2
    window = np.exp(-decay * np.arange(half) / (n * step))
    window[0] *= 0.5
    response[:, :half] *= window
    response[:, half:] = 0
    note = f"exponential window: {decay:.6g} 1/s were added to zeta omega of every mode"
    return ODS(
        shapes.name,
        shapes.freq,
        np.fft.rfft(response, axis=1)[:, at],
        shapes.channels,
        "one-sided",
        shapes.reference,
        notes=(*shapes.notes, note),
    )


def modal_peaks(given: FRF | ODS) -> FloatArray:
    """Modal peaks function (n_freq,) of all outputs and inputs, largest value 1: where the structure resonates.

    For an FRF the sum of squares of the part that peaks at resonance: imaginary for receptance and accelerance, real
    for mobility. For operating shapes, whose phase is that of a reference, the sum of squared magnitudes. Responses are
    weighted by their own largest value, so that none decides alone (Allemang and Brown, Harris' Shock and Vibration
    Handbook, ch. 21).
    """
    if isinstance(given, FRF):
        H = given.H.reshape(given.n_freq, -1).T
        part = np.real(H) if given.kind == "mobility" else np.imag(H)
    else:
        part = np.abs(given.shapes)
    largest = np.abs(part).max(axis=1, keepdims=True)
    total = ((part / np.where(largest > 0, largest, 1.0)) ** 2).sum(axis=0)
    return np.asarray(total / max(float(total.max()), np.finfo(float).tiny))


def peak_frequencies(
    freq: FloatArray, peaks: FloatArray, *, prominence: float = 0.5, least: float = 0.01, n: int | None = None
) -> FloatArray:
    """Frequencies (Hz, increasing) at which `peaks` (n_freq,) over `freq` (n_freq,) Hz has a maximum.

    `prominence` is what a maximum must stand out by, as a share of itself, and `least` its share of the largest one
    (the skirts of a mode have small maxima too); with `n` the most prominent ones alone. The place between lines is
    that of the parabola through the logarithms.
    """
    y = np.log(np.maximum(peaks, 1e-12 * float(np.max(peaks))))
    at, known = find_peaks(y, height=y.max() + np.log(least), prominence=-np.log1p(-min(prominence, 0.999)))
    if n is not None and at.size > n:
        at = np.sort(at[np.argsort(known["prominences"])[::-1][:n]])
    left, middle, right = y[at - 1], y[at], y[at + 1]
    shift = 0.5 * (left - right) / np.minimum(left - 2 * middle + right, -1e-300)
    low, high = freq[at] - freq[at - 1], freq[at + 1] - freq[at]
    return np.asarray(freq[at] + np.clip(shift, -0.5, 0.5) * np.where(shift < 0, low, high))
