"""From the poles of all orders to modes, without a person and without thresholds of one case.

1. A pole takes part when it is determined: its standard deviations are below its own half bandwidth
   (`Stabilisation.determined`), it lies in the band and its damping is in (0, max_zeta).
2. Two poles may be the same mode when their difference is within what their own uncertainties allow: in frequency and
   damping 1.96 standard deviations of a difference of independent estimates, in shape 1 - MAC up to three times the
   sum of their relative shape variances (its expectation for independent estimates is that sum). Where the
   uncertainties are smaller than what the model order shifts the pole (long records), a tenth of the half bandwidth
   and MAC 0.98 stand in; where they are not known (a recording that is not stationary), a quarter of it and MAC 0.95.
3. Poles are joined by average linkage of these distances; two poles of one order are never joined, so two close
   modes stay two.
4. A cluster is a mode when it holds poles of five orders one after the other (what a person asks of a column of the
   stabilisation diagram), or of a third of all orders: at orders far above the true one a strong mode splits in two
   uncertain poles, a weak one only shows there.
5. Of two clusters of one frequency and shape, again by their uncertainties, the better known one is kept.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.cluster import hierarchy
from scipy.spatial.distance import squareform

from femend.data.bands import within_band
from femend.modal.output_only.stabilisation import Stabilisation, mac

__all__ = ["cluster_poles", "consensus", "representatives"]

QUANTILE = 1.96
BANDWIDTH_SHARE, MAC_FLOOR = 0.1, 0.02
BANDWIDTH_SHARE_UNKNOWN, MAC_FLOOR_UNKNOWN = 0.25, 0.05
MAC_CEILING = 0.5
FAR = 1e6
RUN = 5


def cluster_poles(poles: Stabilisation, band: tuple[float, float], max_zeta: float) -> Stabilisation:
    """`poles` with their modes numbered by frequency; `band` in Hz, `max_zeta` the largest damping ratio."""
    inside = within_band(poles.freq, band) & (poles.zeta > 0) & (poles.zeta < max_zeta)
    taking_part = np.flatnonzero(inside & poles.determined)
    labels = np.full(poles.order.size, -1)
    if taking_part.size < 2:
        return poles.with_clusters(labels)
    D = _distances(poles, taking_part)
    tree = hierarchy.linkage(squareform(D, checks=False), method="average")
    raw = hierarchy.fcluster(tree, 1.0, criterion="distance")
    kept = [taking_part[raw == c] for c in np.unique(raw)]
    kept = _without_twins(poles, [members for members in kept if _is_mode(poles, members)])
    kept.sort(key=lambda members: float(np.median(poles.freq[members])))
    for number, members in enumerate(kept):
        labels[members] = number
    return poles.with_clusters(labels)


def _distances(poles: Stabilisation, which: NDArray[np.int64]) -> NDArray[np.float64]:
    """Largest of the differences in frequency, damping and shape, each over what it may be, (n, n)."""
    f, z = poles.freq[which], poles.zeta[which]
    unknown = bool(np.isnan(poles.freq_sd[which]).any())
    bandwidth_share = BANDWIDTH_SHARE_UNKNOWN if unknown else BANDWIDTH_SHARE
    mac_floor = MAC_FLOOR_UNKNOWN if unknown else MAC_FLOOR
    width = bandwidth_share * np.minimum.outer(z * f, z * f)
    f_sd, z_sd = np.nan_to_num(poles.freq_sd[which]), np.nan_to_num(poles.zeta_sd[which])
    f_tol = np.maximum(QUANTILE * np.hypot.outer(f_sd, f_sd), width)
    share = bandwidth_share * np.minimum.outer(z, z)
    z_tol = np.maximum(QUANTILE * np.hypot.outer(z_sd, z_sd), share)
    v = np.nan_to_num(poles.shape_var[which])
    m_tol = np.clip(3 * np.add.outer(v, v), mac_floor, MAC_CEILING)
    shapes = poles.shapes[:, which]
    D = np.maximum(np.abs(np.subtract.outer(f, f)) / f_tol, np.abs(np.subtract.outer(z, z)) / z_tol)
    D = np.maximum(D, (1 - mac(shapes, shapes)) / m_tol)
    D[np.equal.outer(poles.order[which], poles.order[which])] = FAR
    np.fill_diagonal(D, 0.0)
    return np.minimum(D, FAR)


def _is_mode(poles: Stabilisation, members: NDArray[np.int64]) -> bool:
    """True for a cluster in a third of all orders, or in RUN orders one after the other."""
    at = np.isin(poles.orders, poles.order[members])
    run = longest = 0
    for present in at:
        run = run + 1 if present else 0
        longest = max(longest, run)
    return bool(longest >= RUN or 3 * members.size >= poles.orders.size)


def _without_twins(poles: Stabilisation, clusters: list[NDArray[np.int64]]) -> list[NDArray[np.int64]]:
    """The clusters without those that repeat the frequency and shape of a better known one: a mode that the model
    gives two poles. Distinct modes of one frequency differ in shape, where there are two sensors to see it."""
    if poles.shapes.shape[0] < 2:
        return clusters
    kept: list[NDArray[np.int64]] = []
    for members in sorted(clusters, key=lambda c: float(np.median(np.nan_to_num(poles.freq_sd[c])))):
        if not any(_same(poles, members, other) for other in kept):
            kept.append(members)
    return kept


def _same(poles: Stabilisation, a: NDArray[np.int64], b: NDArray[np.int64]) -> bool:
    pick = [int(m[np.argmin(np.abs(poles.freq[m] - np.median(poles.freq[m])))]) for m in (a, b)]
    f, z, sd = poles.freq[pick], poles.zeta[pick], np.nan_to_num(poles.freq_sd[pick])
    v = float(np.nan_to_num(poles.shape_var[pick]).sum())
    near = abs(f[0] - f[1]) <= max(QUANTILE * float(np.hypot(*sd)), BANDWIDTH_SHARE * float((z * f).min()))
    alike = float(mac(poles.shapes[:, pick[:1]], poles.shapes[:, pick[1:]])[0, 0])
    return bool(near and 1 - alike <= np.clip(3 * v, MAC_FLOOR, MAC_CEILING))


def consensus(poles: Stabilisation, members: NDArray[np.int64]) -> NDArray[np.float64]:
    """Weights (n,) of the `members` (n,) of one cluster of `poles`, their inverse variances in frequency; equal
    ones where these are not known. They add up to 1."""
    sd = poles.freq_sd[members]
    weights = np.ones(members.size) if np.isnan(sd).any() else 1.0 / sd**2
    return weights / weights.sum()


def representatives(poles: Stabilisation) -> NDArray[np.int64]:
    """The pole of each mode (n_modes,) with the least mean square error in frequency and damping, over those of the
    cluster: its own variance and its squared distance from the cluster's mean by inverse variance."""
    chosen = []
    for number in range(int(poles.cluster.max(initial=-1)) + 1):
        members = np.flatnonzero(poles.cluster == number)
        w = consensus(poles, members)
        error = np.zeros(members.size)
        for value, sd in ((poles.freq[members], poles.freq_sd[members]), (poles.zeta[members], poles.zeta_sd[members])):
            square = np.nan_to_num(sd) ** 2 + (value - w @ value) ** 2
            error += square / max(float(np.median(square)), np.finfo(float).tiny)
        chosen.append(int(members[np.argmin(error)]))
    return np.array(chosen, dtype=np.int64)
