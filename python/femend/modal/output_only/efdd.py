"""Enhanced frequency-domain decomposition: modes from the singular values of the spectral matrices.

Sources: Brincker, Zhang and Andersen, Modal identification of output-only systems using frequency domain
decomposition, Smart Mater. Struct. 10 (2001) 441-445; Brincker, Ventura and Andersen, Damping estimation by frequency
domain decomposition, IMAC (2001) (MAC bell, free decay of the bell). Two things differ from the papers: the decay is
read off the one-sided (analytic) bell, so that its phase gives the frequency at all lags, and the lag window of the
spectral estimate, whose decay adds to the damping, is divided out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import signal

from femend.data.bands import within_band
from femend.modal.output_only.jackknife import N_GROUPS, pole_sd, shape_sd
from femend.modal.output_only.prepare import Signals
from femend.modal.output_only.spectra import PEAK_SIGMAS, segment_spectra
from femend.modal.output_only.ssi_modes import ModeEstimates
from femend.modal.output_only.stabilisation import mac, unit_shapes

__all__ = ["efdd_modes"]

N_AVERAGES = 30
BELL_MAC = 0.8  # Brincker et al. (2001)
# The part of the free decay that is fitted: from the first lags, which hold the neighbours, down to the noise.
DECAY_FROM, DECAY_TO = 0.95, 0.2


@dataclass(frozen=True, slots=True, eq=False)
class _Peak:
    """A mode's bell: `line` of the peak, `rows` of lines, and which singular vector belongs on each (`rank`)."""

    line: int
    rows: NDArray[np.int64]
    rank: NDArray[np.int64]
    shape: NDArray[np.complex128]


def efdd_modes(signals: Signals, max_zeta: float) -> ModeEstimates:
    """Modes of `signals` with damping below `max_zeta`; deviations are those of a jackknife over the segments with
    the bells held."""
    length = 2 * (signals.y.shape[1] // (N_AVERAGES + 1))
    freq, Y = segment_spectra(signals.y, length, signals.dt)
    inside = np.flatnonzero(within_band(freq, signals.band) & (freq > 0))
    Y = Y[:, inside]
    vectors, values = _decomposed(Y)
    peaks = _peaks(vectors, values, Y.shape[0])
    groups = np.array_split(np.arange(Y.shape[0]), min(N_GROUPS, Y.shape[0]))
    parts = [_updated(np.delete(Y, group, axis=0), vectors) for group in groups]
    decay = _Decay(freq[inside], length, signals.dt)
    poles, shapes, deviations = [], [], []
    for peak in peaks:
        mu = decay.pole(peak, vectors, values)
        if mu is None or not 0 < -mu.real / abs(mu) < max_zeta:
            continue
        again = [decay.pole(peak, *part) for part in parts]
        if any(one is None for one in again):
            continue
        replicas = np.array(again, dtype=np.complex128)[:, None]
        shape = unit_shapes(signals.to_shapes(peak.shape[:, None], np.array([mu])))
        same = [_same_vector(peak, part[0]) for part in parts]
        turned = [signals.to_shapes(one[:, None], np.array([mu])) for one in same]
        top = int(np.argmax(np.abs(shape[:, 0])))
        deviations.append((*pole_sd(replicas), shape_sd(np.stack([one / one[top] for one in turned]))))
        poles.append(mu)
        shapes.append(shape[:, 0])
    n = len(poles)
    return ModeEstimates(
        np.array(poles, dtype=np.complex128),
        np.array(shapes, dtype=np.complex128).reshape(n, signals.n_ch).T,
        np.array([d[0][0] for d in deviations]),
        np.array([d[1][0] for d in deviations]),
        np.array([d[2][:, 0] for d in deviations]).reshape(n, signals.n_ch).T,
        np.ones(n),
        None,
    )


def _decomposed(Y: NDArray[np.complex128]) -> tuple[NDArray[np.complex128], NDArray[np.float64]]:
    """The two leading singular vectors (n_freq, n_ch, 2) and values (n_freq, 2) of the spectral matrices of segments
    `Y` (n_seg, n_freq, n_ch)."""
    vectors, singular, _ = np.linalg.svd(Y.transpose(1, 2, 0), full_matrices=False)
    return vectors[:, :, :2], np.maximum(singular[:, :2] ** 2 / Y.shape[0], np.finfo(float).tiny)


def _updated(
    Y: NDArray[np.complex128], vectors: NDArray[np.complex128]
) -> tuple[NDArray[np.complex128], NDArray[np.float64]]:
    """As `_decomposed` for slightly fewer segments, by three subspace iterations from the `vectors` of all."""
    X = Y.transpose(1, 2, 0)
    X_h = np.ascontiguousarray(X.conj().transpose(0, 2, 1))
    for _ in range(3):
        vectors = np.linalg.qr(X @ (X_h @ vectors))[0]
    Z = X_h @ vectors
    values, turn = np.linalg.eigh(Z.conj().transpose(0, 2, 1) @ Z / Y.shape[0])
    return vectors @ turn[:, :, ::-1], np.maximum(values[:, ::-1], np.finfo(float).tiny)


def _peaks(vectors: NDArray[np.complex128], values: NDArray[np.float64], n_segments: int) -> list[_Peak]:
    """Bells of the peaks of the first and second singular value that stand out of their scatter; where two
    bells cross, the second has a peak too, with the shape of one of them, so it counts only with a shape of its own."""
    prominence = PEAK_SIGMAS * np.sqrt(2.0 / n_segments)
    found: list[_Peak] = []
    for rank in range(min(2, values.shape[1])):
        lines, _ = signal.find_peaks(np.log(values[:, rank]), prominence=prominence)
        for line in lines:
            peak = _bell(int(line), rank, vectors)
            known = [p for p in found if rank or line in p.rows]
            if any(mac(p.shape[:, None], peak.shape[:, None])[0, 0] >= BELL_MAC for p in known):
                continue
            found.append(peak)
    return sorted((p for p in found if p.rows.size >= 3), key=lambda p: p.line)


def _bell(line: int, rank: int, vectors: NDArray[np.complex128]) -> _Peak:
    """Lines around `line` on which some singular vector has a MAC of at least BELL_MAC with that at the peak."""
    shape = vectors[line, :, rank]
    similar = np.abs(np.einsum("c,fck->fk", shape.conj(), vectors[:, :, :2])) ** 2
    best, rows = np.argmax(similar, axis=1), similar.max(axis=1) >= BELL_MAC
    low = high = line
    while low > 0 and rows[low - 1]:
        low -= 1
    while high < rows.size - 1 and rows[high + 1]:
        high += 1
    lines = np.arange(low, high + 1)
    return _Peak(line, lines, best[lines], shape)


def _same_vector(peak: _Peak, vectors: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """The singular vector at the peak's line in another decomposition that is most like the peak's."""
    there = vectors[peak.line]
    return there[:, int(np.argmax(np.abs(peak.shape.conj() @ there)))]


class _Decay:
    """Poles from bells: inverse transform of the one-sided bell, fit of its logarithm over the lags."""

    def __init__(self, freq: NDArray[np.float64], length: int, dt: float) -> None:
        window = signal.get_window("hann", length)
        lags = signal.correlate(window, window)[length - 1 :]
        self._lag_window = lags / lags[0]
        self._freq, self._length, self._dt = freq, length, dt

    def pole(self, peak: _Peak, vectors: NDArray[np.complex128], values: NDArray[np.float64]) -> complex | None:
        """Pole in rad/s, or None where the bell holds no decay of three lags."""
        similar = np.abs(np.einsum("c,fck->fk", peak.shape.conj(), vectors[peak.rows][:, :, :2])) ** 2
        bell = values[peak.rows, np.argmax(similar, axis=1)]
        width = self._freq[peak.rows[-1]] - self._freq[peak.rows[0]]
        # Lags finer than the inverse of the bell's width carry nothing new.
        step = 1.0 / (2.0 * max(width, 2.0 / (self._length * self._dt)))
        tau = np.arange(0.0, 0.5 * self._length * self._dt, step)
        r = np.exp(2j * np.pi * np.outer(tau, self._freq[peak.rows])) @ bell
        r = r / np.interp(tau, self._dt * np.arange(self._length), self._lag_window)
        size = np.abs(r) / np.abs(r[0])
        below = np.flatnonzero(size < DECAY_TO)
        end = int(below[0]) if below.size else tau.size
        start = int(np.flatnonzero(size <= DECAY_FROM)[0]) if (size <= DECAY_FROM).any() else 0
        if end - start < 3:
            return None
        part = slice(start, end)
        # A decay's log amplitude scatters as the inverse of its size: weights are the size.
        decay = np.polyfit(tau[part], np.log(size[part]), 1, w=size[part])[0]
        phase = np.unwrap(np.angle(r[part] * np.exp(-2j * np.pi * self._freq[peak.line] * tau[part])))
        turn = np.polyfit(tau[part], phase, 1, w=size[part])[0] + 2 * np.pi * self._freq[peak.line]
        return complex(decay, turn)
