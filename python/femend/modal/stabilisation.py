"""The stabilisation diagram as data, and the poles that stand in it over many orders."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from femend.modal.plscf import PoleTable
from femend.numerals import plain

__all__ = ["LEVELS", "PoleCluster", "Stabilisation", "stabilise"]

LEVELS = ("new", "frequency", "frequency and damping", "stable")


@dataclass(frozen=True, slots=True, eq=False)
class PoleCluster:
    """One pole seen over several orders.

    `rows` are its rows in the table, `pole` (rad/s) the median of them, `participation` (n_ref,) the mean direction;
    `presence` is the share of the orders, from the first in which it stands to the last of the diagram, that have it;
    `freq_sd` (Hz) and `zeta_sd` are the scatter over the orders (1.4826 times the median deviation). `chosen` says
    whether it goes on to the fit of the modes, `reason` why not.
    """

    rows: NDArray[np.int64]
    pole: complex
    participation: NDArray[np.complex128]
    presence: float
    freq_sd: float
    zeta_sd: float
    chosen: bool
    reason: str = ""

    @property
    def freq(self) -> float:
        """Natural frequency in Hz."""
        return abs(self.pole) / (2.0 * np.pi)

    @property
    def zeta(self) -> float:
        """Damping ratio."""
        return -self.pole.real / abs(self.pole)


@dataclass(frozen=True, slots=True, eq=False)
class Stabilisation:
    """Poles over orders: `table` of them all, `level` (n,) 0..3 (see LEVELS) against the next lower order, `clusters`
    by frequency, `max_order` and the `settings` used."""

    table: PoleTable
    level: NDArray[np.int64]
    clusters: tuple[PoleCluster, ...]
    max_order: int
    settings: dict[str, float]

    @property
    def chosen(self) -> tuple[PoleCluster, ...]:
        """The clusters that count as modes before the fit."""
        return tuple(c for c in self.clusters if c.chosen)

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON and for drawing: order, freq, zeta and level of every pole, and the clusters."""
        return {
            "order": self.table.order.tolist(),
            "freq": self.table.freq.tolist(),
            "zeta": self.table.zeta.tolist(),
            "level": [LEVELS[i] for i in self.level],
            "clusters": [
                {"freq": c.freq, "zeta": c.zeta, "presence": c.presence, "chosen": c.chosen, "reason": c.reason}
                for c in self.clusters
            ],
            "settings": dict(self.settings),
        }


def stabilise(
    table: PoleTable,
    *,
    freq_tol: float = 0.01,
    zeta_tol: float = 0.05,
    mac_tol: float = 0.02,
    max_zeta: float = 0.2,
    min_presence: float = 0.5,
    min_orders: int = 5,
) -> Stabilisation:
    """Compares the poles of `table` over its orders and clusters them.

    Levels: a pole whose nearest of the next lower order differs by less than `freq_tol` in frequency, `zeta_tol`
    in damping (both relative) and `mac_tol` in 1 - MAC of the participation is stable. Clusters: from the highest
    order down, each order's poles are assigned one to one to the clusters so far (least distance |p - q| / |q|, not
    above `freq_tol`, and 1 - MAC not above 0.5 where there are several references), the others begin new ones. A
    cluster is chosen when its damping is at most `max_zeta`, it stands in at least `min_orders` orders and in the
    share `min_presence` of the orders from its first, and its orders scatter by less than `freq_tol` in frequency.
    Raises nothing; an empty table gives no clusters.
    """
    orders = np.unique(table.order)
    by_order = {int(n): np.nonzero(table.order == n)[0] for n in orders}
    level = np.zeros(table.order.size, dtype=np.int64)
    for low, high in pairwise(orders):
        level[by_order[int(high)]] = _levels(
            table, by_order[int(high)], by_order[int(low)], freq_tol, zeta_tol, mac_tol
        )
    settings = {
        "freq_tol": freq_tol,
        "zeta_tol": zeta_tol,
        "mac_tol": mac_tol,
        "max_zeta": max_zeta,
        "min_presence": min_presence,
        "min_orders": float(min_orders),
    }
    tracks = _tracks(table, [by_order[int(n)] for n in orders[::-1]], freq_tol)
    last = int(orders[-1]) if orders.size else 0
    clusters = [_cluster(table, np.array(rows), orders, settings) for rows in tracks]
    return Stabilisation(table, level, tuple(sorted(clusters, key=lambda c: c.freq)), last, settings)


def _mac(a: NDArray[np.complex128], b: NDArray[np.complex128]) -> NDArray[np.float64]:
    """MAC of unit rows a (n, n_ref) and b (m, n_ref): (n, m)."""
    return np.abs(a.conj() @ b.T) ** 2


def _levels(
    table: PoleTable, high: NDArray, low: NDArray, freq_tol: float, zeta_tol: float, mac_tol: float
) -> NDArray[np.int64]:
    if not low.size or not high.size:
        return np.zeros(high.size, dtype=np.int64)
    near = np.argmin(np.abs(table.poles[high][:, None] - table.poles[low][None, :]), axis=1)
    partner = low[near]
    freq = np.abs(table.freq[high] / table.freq[partner] - 1.0) < freq_tol
    zeta = np.abs(table.zeta[high] / table.zeta[partner] - 1.0) < zeta_tol
    mac = np.abs(np.sum(table.participation[high].conj() * table.participation[partner], axis=1)) ** 2 > 1.0 - mac_tol
    return np.where(freq & zeta & mac, 3, np.where(freq & zeta, 2, np.where(freq, 1, 0))).astype(np.int64)


def _tracks(table: PoleTable, downwards: list[NDArray], tol: float) -> list[list[int]]:
    """Rows of the table that belong together, one per order at most."""
    tracks: list[list[int]] = []
    for rows in downwards:
        taken: set[int] = set()
        if tracks and rows.size:
            heads = [t[-5:] for t in tracks]
            centre = np.array([np.median(table.poles[h].real) + 1j * np.median(table.poles[h].imag) for h in heads])
            shape = table.participation[[t[-1] for t in tracks]]
            cost = np.abs(table.poles[rows][:, None] - centre[None, :]) / np.abs(centre)[None, :] / tol
            cost = np.where(_mac(table.participation[rows], shape) < 0.5, np.inf, cost)
            # what is too far apart costs more than any pairing, so that the assignment never prefers it
            for i, j in zip(*linear_sum_assignment(np.where(cost <= 1.0, cost, 1e6))):
                if cost[i, j] <= 1.0:
                    tracks[j].append(int(rows[i]))
                    taken.add(int(rows[i]))
        tracks += [[int(row)] for row in rows if int(row) not in taken]
    return tracks


def _cluster(table: PoleTable, rows: NDArray, orders: NDArray, settings: dict[str, float]) -> PoleCluster:
    poles, freq, zeta = table.poles[rows], table.freq[rows], table.zeta[rows]
    # Low orders are coarse: the upper half of the orders tells where the pole settles.
    upper = rows[: max(settings["min_orders"].__trunc__(), (rows.size + 1) // 2)]
    pole = complex(np.median(table.poles[upper].real), np.median(table.poles[upper].imag))
    direction = np.linalg.eigh(table.participation[upper].T @ table.participation[upper].conj())[1][:, -1]
    presence = rows.size / max(1, int(np.sum(orders >= table.order[rows].min())))
    freq_sd = 1.4826 * float(np.median(np.abs(table.freq[upper] - np.median(table.freq[upper]))))
    zeta_sd = 1.4826 * float(np.median(np.abs(table.zeta[upper] - np.median(table.zeta[upper]))))
    reason = ""
    if rows.size < settings["min_orders"]:
        reason = f"in {rows.size} of {orders.size} orders only"
    elif presence < settings["min_presence"]:
        reason = f"in {100 * presence:.0f} % of the orders from its first only"
    elif np.median(zeta) > settings["max_zeta"]:
        reason = f"damping {np.median(zeta):.2f} above {settings['max_zeta']:.2f}"
    elif freq_sd > settings["freq_tol"] * np.median(freq):
        reason = f"scatters by {plain(freq_sd, 3)} Hz over the orders"
    assert poles.size
    return PoleCluster(rows, pole, direction, presence, freq_sd, zeta_sd, not reason, reason)
