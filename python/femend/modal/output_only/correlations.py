"""Correlation functions of responses with references, block by block of the recording."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from femend.data.bands import within_band
from femend.modal.output_only.prepare import Signals

__all__ = ["BlockCorrelations", "block_correlations", "principal_references"]

# Beyond so many lags a transform is cheaper than a product per lag.
FEW_LAGS = 200


@dataclass(frozen=True, slots=True, eq=False)
class BlockCorrelations:
    """`blocks` (n_blocks, n_lags, n_ch, n_ref): R(k) = E[y(t + k) y_ref(t)^T], k = 1 .. n_lags, of each block of the
    recording; `dt` in s. The estimate of the whole recording is their mean."""

    blocks: NDArray[np.float64]
    dt: float

    @property
    def mean(self) -> NDArray[np.float64]:
        """Correlations (n_lags, n_ch, n_ref) of the whole recording."""
        return self.blocks.mean(axis=0)


def block_correlations(
    y: NDArray[np.float64], reference: NDArray[np.float64], n_lags: int, n_blocks: int, dt: float
) -> BlockCorrelations:
    """Unbiased correlations of `y` (n_ch, n_samples) with `reference` (n_ref, n_samples) at `n_lags` lags of `dt` s
    in each of `n_blocks` blocks.

    A block holds the products that start in it (they may end in the next), so that the mean over blocks is the
    estimate from the whole recording; the blocks of Reynders, Pintelon and De Roeck (2008). Raises
    nothing; the caller sees to it that blocks have samples.
    """
    n_ch, n_ref = y.shape[0], reference.shape[0]
    length = (y.shape[1] - n_lags) // n_blocks
    used = length * n_blocks
    right = reference[:, :used].reshape(n_ref, n_blocks, length).transpose(1, 2, 0) / length
    blocks = np.empty((n_blocks, n_lags, n_ch, n_ref))
    if n_lags > FEW_LAGS:
        return BlockCorrelations(_by_fft(y, right, n_lags, blocks), dt)
    for k in range(1, n_lags + 1):
        left = y[:, k : k + used].reshape(n_ch, n_blocks, length).transpose(1, 0, 2)
        np.matmul(left, right, out=blocks[:, k - 1])
    return BlockCorrelations(blocks, dt)


def _by_fft(
    y: NDArray[np.float64], right: NDArray[np.float64], n_lags: int, blocks: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Fills `blocks` (n_blocks, n_lags, n_ch, n_ref) from `y` (n_ch, n_samples) and the references `right` (n_blocks,
    length, n_ref), already over the length of a block."""
    length = right.shape[1]
    size = int(fft.next_fast_len(length + n_lags, real=True))
    for b, reference in enumerate(right):
        left = fft.rfft(y[:, b * length : (b + 1) * length + n_lags], size)
        cross = left[:, None, :] * fft.rfft(reference.T, size).conj()[None]
        blocks[b] = fft.irfft(cross, size)[..., 1 : n_lags + 1].transpose(2, 0, 1)
    return blocks


def principal_references(signals: Signals, n_ref: int) -> NDArray[np.float64]:
    """Weights (n_ref, n_ch) of linear combinations of the channels that serve as references.

    They are the leading eigenvectors of the spectral matrices summed over the lines of the band, each divided by its
    trace: a line of a weak mode counts as much as one of a strong mode, so no mode is missed for lying at a node of
    all chosen sensors. With `n_ref` >= n_ch they are the channels themselves.
    """
    if n_ref >= signals.n_ch:
        return np.eye(signals.n_ch)
    y = signals.y
    length = min(y.shape[1], max(256, y.shape[1] // 40))
    n_seg = y.shape[1] // length
    segments = y[:, : n_seg * length].reshape(signals.n_ch, n_seg, length) * np.hanning(length)
    Y = np.fft.rfft(segments, axis=2)
    freq = np.fft.rfftfreq(length, signals.dt)
    Y = Y[:, :, within_band(freq, signals.band)].transpose(2, 0, 1)
    trace = (np.abs(Y) ** 2).sum(axis=(1, 2))
    weighted = np.concatenate(list(Y / np.sqrt(trace)[:, None, None]), axis=1)
    S = (weighted @ weighted.conj().T).real
    return np.linalg.eigh(S)[1][:, ::-1][:, :n_ref].T
