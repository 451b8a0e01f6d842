"""Modes by covariance-driven SSI: choices made from the recording, poles of all orders, clusters, uncertainties."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from femend.data.bands import within_band
from femend.data.time_data import pick_channel
from femend.modal.output_only.clustering import cluster_poles, consensus, representatives
from femend.modal.output_only.correlations import block_correlations, principal_references
from femend.modal.output_only.perturbation import block_effects, influences, long_run_variance
from femend.modal.output_only.prepare import Signals
from femend.modal.output_only.ssi import Subspace, order_poles, subspace
from femend.modal.output_only.stabilisation import Stabilisation

__all__ = ["ModeEstimates", "SsiSettings", "estimates_of", "reference_weights", "ssi_modes", "ssi_settings"]

# One period of the lowest mode on either side of the Hankel matrix; longer windows were tried and scatter more.
MIN_ROWS = 12
# Limits of cost, not of accuracy: columns of the Hankel matrix, and rows where channels are many.
MAX_COLUMNS = 300
MAX_BLOCK_ROWS = 80
N_BLOCKS = 50


@dataclass(frozen=True, slots=True)
class SsiSettings:
    """`n_rows` block columns of the Hankel matrix (lags up to 2 n_rows), `n_ref` references, model orders 2, 4, ...,
    `max_order`, `n_blocks` blocks of the recording for the uncertainties, `max_zeta` the largest damping of a mode,
    `stationary` whether blocks are repetitions of each other."""

    n_rows: int
    n_ref: int
    max_order: int
    n_blocks: int = N_BLOCKS
    max_zeta: float = 0.2
    stationary: bool = True


@dataclass(frozen=True, slots=True, eq=False)
class ModeEstimates:
    """`poles` (n,) in rad/s, `shapes` (n_ch, n) with largest component 1, their `freq_sd` (Hz), `zeta_sd` (n,) and
    `shape_sd` (n_ch, n), `support` (n,) the share of orders, and all poles as `stabilisation` (None where there are no
    orders)."""

    poles: NDArray[np.complex128]
    shapes: NDArray[np.complex128]
    freq_sd: NDArray[np.float64]
    zeta_sd: NDArray[np.float64]
    shape_sd: NDArray[np.float64]
    support: NDArray[np.float64]
    stabilisation: Stabilisation | None

    def without_deviations(self) -> ModeEstimates:
        """The same modes, their deviations not known (nan)."""
        nan = np.full(self.poles.size, np.nan)
        return replace(self, freq_sd=nan, zeta_sd=nan, shape_sd=np.full(self.shapes.shape, np.nan))


def ssi_settings(
    signals: Signals, lowest: float, max_order: int = 60, max_zeta: float = 0.2, *, stationary: bool = True
) -> SsiSettings:
    """Window, references and blocks for `signals` whose `lowest` mode is at that many Hz, orders to `max_order` and
    damping to `max_zeta`: half the window is a period of the lowest mode, references as many as the channels but for
    the cost. Correlations of a sweep do not scatter with their lag as those of noise do: without `stationary` the
    window is twice as long."""
    periods = 1.0 if stationary else 2.0
    n_rows = int(np.clip(np.ceil(periods * signals.rate / lowest), MIN_ROWS, MAX_BLOCK_ROWS))
    n_ref = min(signals.n_ch, max(2, MAX_COLUMNS // n_rows))
    n_rows = max(n_rows, int(np.ceil((max_order + 1) / n_ref))) if n_ref < 4 else n_rows
    n_blocks = int(np.clip((signals.y.shape[1] - 2 * n_rows) // (2 * n_rows), 2, N_BLOCKS))
    return SsiSettings(n_rows, n_ref, min(max_order, n_rows * n_ref - 1), n_blocks, max_zeta, stationary)


def reference_weights(signals: Signals, names: tuple[str, ...] | None) -> NDArray[np.float64] | None:
    """Weights (n_ref, n_ch) that pick the channels called `names` as references; None without names. Raises
    RecordingError for a name that no channel or several answer to."""
    if names is None:
        return None
    weights = np.zeros((len(names), signals.n_ch))
    for row, name in enumerate(names):
        weights[row, pick_channel(signals.channels, name, signals.name)] = 1.0
    return weights


def ssi_modes(signals: Signals, settings: SsiSettings, references: NDArray[np.float64] | None = None) -> ModeEstimates:
    """Modes of `signals` by SSI-cov with `settings`; `references` (n_ref, n_ch) weights of the reference signals, the
    principal ones without. Blocks of a recording that is not stationary are no repetitions of each other: its
    deviations are nan, and poles of different orders are compared by their bandwidth alone."""
    weights = principal_references(signals, settings.n_ref) if references is None else references
    if weights.shape[0] != settings.n_ref:
        most = settings.n_rows * weights.shape[0] - 1
        settings = replace(settings, n_ref=weights.shape[0], max_order=min(settings.max_order, most))
    R = block_correlations(signals.y, weights @ signals.y, 2 * settings.n_rows, settings.n_blocks, signals.dt)
    space = subspace(R.mean, settings.n_rows, settings.max_order, signals.dt)
    poles = _all_poles(signals, settings, space, R.blocks)
    if not settings.stationary:
        poles = poles.without_deviations()
    poles = cluster_poles(poles, signals.band, settings.max_zeta)
    return estimates_of(poles)


def _all_poles(signals: Signals, settings: SsiSettings, space: Subspace, blocks: NDArray[np.float64]) -> Stabilisation:
    """Poles of all orders inside the band with their deviations; shapes are those of motion, largest component 1."""
    effects = block_effects(space, blocks)
    orders = np.arange(2, space.max_order + 1, 2)
    columns: list[tuple[NDArray, ...]] = []
    for order in orders:
        found = order_poles(space, int(order))
        freq, zeta = np.abs(found.mu) / (2 * np.pi), -found.mu.real / np.abs(found.mu)
        inside = within_band(freq, signals.band) & (zeta < settings.max_zeta)
        which = np.flatnonzero(inside)
        if which.size:
            one = influences(space, effects, found, which)
            mu = found.mu[which]
            observed = space.U[: space.n_ch, :order] @ found.psi[:, which]
            shapes, shape_sd = _normalised(signals, observed, one.shape, mu)
            columns.append((np.full(which.size, order), mu, shapes, *_deviations(mu, one.mu), shape_sd))
    if not columns:
        none = np.empty(0)
        shapes = np.empty((signals.n_ch, 0), dtype=np.complex128)
        return Stabilisation(
            none.astype(int), none.astype(complex), shapes, none, none, shapes.real, none.astype(int), orders
        )
    order_, mu, shapes, freq_sd, zeta_sd, shape_sd = (np.concatenate(part, axis=-1) for part in zip(*columns))
    return Stabilisation(order_, mu, shapes, freq_sd, zeta_sd, shape_sd, np.full(order_.size, -1), orders)


def _deviations(
    mu: NDArray[np.complex128], influence: NDArray[np.complex128]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Standard deviations of frequency (Hz) and damping of poles `mu` (p,) from block influences (n_b, p)."""
    size = np.abs(mu)
    along = (np.conj(mu) * influence).real / size  # change of |mu|
    d_zeta = -influence.real / size + mu.real * along / size**2
    return np.sqrt(long_run_variance(along)) / (2 * np.pi), np.sqrt(long_run_variance(d_zeta))


def _normalised(
    signals: Signals, observed: NDArray[np.complex128], influence: NDArray[np.complex128], mu: NDArray[np.complex128]
) -> tuple[NDArray[np.complex128], NDArray[np.float64]]:
    """Shapes (n_ch, p) with largest component 1 and the deviations of their components (n_ch, p)."""
    shapes = signals.to_shapes(observed, mu)
    change = np.stack([signals.to_shapes(one, mu) for one in influence])
    top = np.argmax(np.abs(shapes), axis=0)
    own = np.arange(mu.size)
    pivot = shapes[top, own]
    unit = shapes / pivot
    change = (change - unit * change[:, top, own][:, None, :]) / pivot
    return unit, np.sqrt(long_run_variance(change.real) + long_run_variance(change.imag))


def estimates_of(poles: Stabilisation) -> ModeEstimates:
    """The modes of clustered `poles`: the representative pole of each; to its own variance comes the scatter over the
    orders of its cluster, since the order is a choice."""
    chosen = representatives(poles)
    freq_sd, zeta_sd = poles.freq_sd[chosen], poles.zeta_sd[chosen]
    members = [np.flatnonzero(poles.cluster == i) for i in range(chosen.size)]
    f_scatter = np.array([_scatter(poles.freq[m], consensus(poles, m)) for m in members])
    z_scatter = np.array([_scatter(poles.zeta[m], consensus(poles, m)) for m in members])
    support = np.array([m.size / poles.orders.size for m in members])
    return ModeEstimates(
        poles.poles[chosen],
        poles.shapes[:, chosen],
        np.hypot(freq_sd, f_scatter),
        np.hypot(zeta_sd, z_scatter),
        poles.shape_sd[:, chosen],
        support,
        poles,
    )


def _scatter(values: NDArray[np.float64], weights: NDArray[np.float64]) -> float:
    """Weighted standard deviation of `values` (n,) with `weights` (n,) that add up to 1."""
    return float(np.sqrt(weights @ (values - weights @ values) ** 2))
