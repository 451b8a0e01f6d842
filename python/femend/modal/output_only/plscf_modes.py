"""Modes by pLSCF on half spectra: poles of all degrees with jackknife deviations, clusters, shapes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from femend.data.bands import within_band
from femend.modal.output_only.clustering import cluster_poles
from femend.modal.output_only.correlations import block_correlations, principal_references
from femend.modal.output_only.jackknife import leave_out_means, pole_sd, shape_sd
from femend.modal.output_only.plscf import FractionPoles, HalfSpectrum, fraction_poles, half_spectrum
from femend.modal.output_only.prepare import Signals
from femend.modal.output_only.ssi_modes import ModeEstimates, estimates_of
from femend.modal.output_only.stabilisation import Stabilisation, unit_shapes

__all__ = ["plscf_modes"]

# Correlations reach over this many periods of the lowest mode: at 1 % damping they have then decayed to e^-2.5.
PERIODS = 40.0
N_REF = 4
N_ROWS = 10
N_BLOCKS = 40


def plscf_modes(
    signals: Signals, lowest: float, max_order: int, max_zeta: float, *, stationary: bool = True
) -> ModeEstimates:
    """Modes of `signals`, whose `lowest` mode is at that many Hz, by pLSCF with up to `max_order` poles of damping
    below `max_zeta`. Without `stationary` deviations are nan (see `ssi_modes`)."""
    n_samples = signals.y.shape[1]
    n_lags = int(min(PERIODS / lowest * signals.rate, n_samples / 5))
    n_ref = min(signals.n_ch, N_REF)
    weights = principal_references(signals, n_ref)
    n_blocks = int(np.clip((n_samples - n_lags) // max(1, n_lags // 4), 10, N_BLOCKS))
    R = block_correlations(signals.y, weights @ signals.y, n_lags, n_blocks, signals.dt)
    whole = half_spectrum(R.mean, signals.band, signals.dt)
    parts = [half_spectrum(mean, signals.band, signals.dt) for mean in leave_out_means(R.blocks)]
    degrees = list(range(2, max(3, max_order // n_ref + 1)))
    poles = _all_poles(signals, whole, parts, degrees, max_zeta)
    if not stationary:
        poles = poles.without_deviations()
    poles = cluster_poles(poles, signals.band, max_zeta)
    return estimates_of(poles)


def _all_poles(
    signals: Signals, whole: HalfSpectrum, parts: list[HalfSpectrum], degrees: list[int], max_zeta: float
) -> Stabilisation:
    """Poles of all degrees in the band, their deviations from the parts."""
    found = fraction_poles(whole, degrees, N_ROWS)
    replicas = [fraction_poles(part, degrees, N_ROWS) for part in parts]
    columns = []
    for at, one in enumerate(found):
        freq, zeta = np.abs(one.mu) / (2 * np.pi), -one.mu.real / np.abs(one.mu)
        keep = within_band(freq, signals.band) & (zeta > 0) & (zeta < max_zeta)
        mu, shapes = one.mu[keep], unit_shapes(signals.to_shapes(one.shapes[:, keep], one.mu[keep]))
        matched = [_matched(mu, replica[at]) for replica in replicas]
        again = np.array([m for m, _ in matched]).reshape(len(matched), mu.size)
        again_shapes = np.stack([_aligned(signals.to_shapes(s, m), shapes) for m, s in matched])
        order = np.full(mu.size, one.order)
        columns.append((order, mu, shapes, *pole_sd(again), shape_sd(again_shapes)))
    order, mu, shapes, freq_sd, zeta_sd, sd = (np.concatenate(part, axis=-1) for part in zip(*columns))
    orders = np.array([one.order for one in found])
    return Stabilisation(order, mu, shapes, freq_sd, zeta_sd, sd, np.full(order.size, -1), orders)


def _matched(mu: NDArray[np.complex128], other: FractionPoles) -> tuple[NDArray[np.complex128], NDArray[np.complex128]]:
    """The poles and shapes of `other` that belong to `mu` (p,): the assignment of least total distance. A pole that
    finds no partner gets a far one, and with it a large deviation."""
    if other.mu.size < mu.size:
        far = np.full(mu.size - other.mu.size, 0.0 + 0.0j)
        pool = np.concatenate([other.mu, far - 1.0])
        shapes = np.concatenate([other.shapes, np.ones((other.shapes.shape[0], far.size))], axis=1)
    else:
        pool, shapes = other.mu, other.shapes
    rows, columns = linear_sum_assignment(np.abs(mu[:, None] - pool[None, :]))
    return pool[columns[np.argsort(rows)]], shapes[:, columns[np.argsort(rows)]]


def _aligned(shapes: NDArray[np.complex128], pattern: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """`shapes` (n_ch, p) scaled to 1 where `pattern` (n_ch, p) has its largest component."""
    pivot = shapes[np.argmax(np.abs(pattern), axis=0), np.arange(shapes.shape[1])]
    return shapes / np.where(pivot == 0, 1.0, pivot)
