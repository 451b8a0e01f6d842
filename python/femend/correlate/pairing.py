"""Which mode of one set is which of another: one-to-one assignment that survives close, repeated and crossing modes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from femend.correlate._arrays import finite, shape_pair
from femend.correlate.assurance import mac, subspace_mac
from femend.correlate.clusters import close_groups
from femend.errors import CorrelationError

__all__ = ["ModePair", "ModePairing", "best_mates", "pair_modes"]

# Of the longest shape: what is shorter is rounding, and the mode does not move at the DOFs compared. Far below any
# difference in scale, since shapes may be scaled one by one; who knows the whole mode gives `seen_a`, `seen_b`.
_UNSEEN = 1e-14
# Share of a mode's own MAC in what is assigned, so that the likeliest modes meet where agreement says nothing.
_OWN_SHARE = 1e-3
# A rival that agrees by less than this less is not told apart; shapes of a MAC above the other one are one shape.
_NEAR, _ALIKE = 0.1, 0.9
# Modes nearer to each other in frequency, relatively, are one space; what a factor of e in frequency weighs in MAC.
_CLOSENESS, _FREQUENCY_WEIGHT = 0.02, 0.1


@dataclass(frozen=True, slots=True)
class ModePair:
    """Mode `a` of the first set and `b` of the second, by number from 0.

    `mac` is that of the two shapes, `agreement` that with the close modes of either taken as one space (equal to
    `mac` outside clusters, never below it), `rival` the best agreement of `a` with a mode of the second set outside
    the pair's cluster: a rival near `agreement` means that the DOFs compared cannot tell. `cluster` numbers pairs of
    one cluster, None outside.
    """

    a: int
    b: int
    mac: float
    agreement: float
    rival: float
    cluster: int | None = None


@dataclass(frozen=True, slots=True)
class ModePairing:
    """Pairs by `a`, what is left of both sets, modes that do not move at the DOFs compared, and notes in words."""

    pairs: tuple[ModePair, ...]
    unpaired_a: tuple[int, ...]
    unpaired_b: tuple[int, ...]
    unseen_a: tuple[int, ...]
    unseen_b: tuple[int, ...]
    notes: tuple[str, ...]

    @property
    def a(self) -> NDArray[np.int64]:
        """Modes of the first set in the order of the pairs, (n_pairs,)."""
        return np.array([p.a for p in self.pairs], dtype=np.int64)

    @property
    def b(self) -> NDArray[np.int64]:
        """Modes of the second set in the order of the pairs, (n_pairs,)."""
        return np.array([p.b for p in self.pairs], dtype=np.int64)


def pair_modes(
    phi_a: ArrayLike,
    phi_b: ArrayLike,
    freq_a: ArrayLike | None = None,
    freq_b: ArrayLike | None = None,
    *,
    mac_min: float = 0.5,
    closeness: float = _CLOSENESS,
    frequency_weight: float = _FREQUENCY_WEIGHT,
    weight: Any = None,
    seen_a: ArrayLike | None = None,
    seen_b: ArrayLike | None = None,
) -> ModePairing:
    """Pairs modes of `phi_a` (n_dof, n_a) with modes of `phi_b` (n_dof, n_b), each at most once.

    Of all one-to-one pairings with an agreement of at least `mac_min` it is the one with the largest sum of
    agreement - `mac_min` + `frequency_weight` (2 - |ln(f_b / f_a)|), the logarithm counted up to 2 (Kuhn and Munkres'
    assignment, so no early pair takes a mode that a later one needs). Agreement is the MAC, with `weight` as in
    `mac`. With frequencies `freq_a` (n_a,), `freq_b` (n_b,) in Hz, modes closer than `closeness` are a cluster
    (repeated modes, symmetric structures: their shapes are any mixture), and agreement is with its whole space:
    1 - (1 - s)(n - 1)/(n - k), the share s of `subspace_mac` less what chance gives a space of k among n dimensions
    (as an adjusted R^2 does); a crowd of more than n / 2 close modes explains nothing and is not a cluster. Which mode
    of a cluster meets which is then decided by their own MAC, so that close modes that crossed are followed. Two modes
    of one shape in the space of a cluster show one mode of it: the other one meets no mate that it is not like itself.
    The distance in frequency decides where too few DOFs make several shapes look alike. At the default, a factor of two
    in frequency weighs as 0.07 of MAC: modes that changed places are still found by shape. `seen_a`, `seen_b` are
    False for modes that hardly move at the DOFs compared (by default those that are zero but for rounding): they are
    not paired.

    Raises CorrelationError for sizes that do not fit, values that are not finite, or `mac_min` outside [0, 1).

    >>> pairing = pair_modes([[1.0, 0.0], [0.0, 1.0]], [[0.1, 1.0], [1.0, 0.0]])
    >>> [(p.a, p.b, round(p.mac, 3)) for p in pairing.pairs]
    [(0, 1, 1.0), (1, 0, 0.99)]
    """
    a, b = shape_pair(phi_a, phi_b)
    if a.ndim != 2 or b.ndim != 2:
        raise CorrelationError(f"shapes of {a.shape} and {b.shape}: one pairing takes (n_dof, n_modes) of each")
    if not 0 <= mac_min < 1:
        raise CorrelationError(f"mac_min is {mac_min}; a MAC to ask of a pair is in [0, 1)")
    unseen = _unseen(a, seen_a), _unseen(b, seen_b)
    found = _found(a, b, freq_a, freq_b, mac_min, closeness, frequency_weight, weight, unseen)
    pairs = _pairs(found.chosen, found.own, found.agreement, *found.clusters)
    rest_a, rest_b = _rest(a, [p.a for p in pairs], unseen[0]), _rest(b, [p.b for p in pairs], unseen[1])
    notes = _notes(pairs, a, *unseen) + tuple(why for i, why in found.told.items() if i in rest_a)
    return ModePairing(pairs, rest_a, rest_b, *unseen, notes)


def best_mates(
    phi_a: ArrayLike, phi_b: ArrayLike, freq_a: ArrayLike, freq_b: ArrayLike, *, mac_min: float = 0.5
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """The mate (n_a,) of every mode of `phi_a` (n_dof, n_a) among those of `phi_b` (n_dof, n_b >= n_a), and how far
    they agree (n_a,): the pairs of `pair_modes`, and for modes without one the best of what is left over, however poor;
    -1 with 0 for modes that do not move at the DOFs. `freq_a` (n_a,), `freq_b` (n_b,) in Hz.

    What searches ask for thousands of times: it says nothing in words. Raises CorrelationError as `pair_modes` does.

    >>> best_mates([[1.0, 0.2], [0.0, 1.0]], [[0.1, 1.0], [1.0, 0.1]], [1.0, 2.0], [1.0, 2.0])[0]
    array([1, 0])
    """
    a, b = shape_pair(phi_a, phi_b)
    unseen = _unseen(a, None), _unseen(b, None)
    found = _found(a, b, freq_a, freq_b, mac_min, _CLOSENESS, _FREQUENCY_WEIGHT, None, unseen)
    mate, agreement = np.full(a.shape[1], -1), np.zeros(a.shape[1])
    for i, j in found.chosen:
        mate[i], agreement[i] = j, found.agreement[i, j]
    if len(found.chosen) < a.shape[1]:
        rest = np.flatnonzero(mate < 0)
        free = np.ones(b.shape[1], dtype=np.bool_)
        free[mate[mate >= 0]] = False
        at = np.ix_(rest, np.flatnonzero(free))
        left = _assign(found.agreement[at], found.own[at], found.distance[at], 0.0, _FREQUENCY_WEIGHT)
        for i, j in left:
            mate[rest[i]] = at[1][0, j]
            agreement[rest[i]] = found.agreement[rest[i], mate[rest[i]]]
    return mate, agreement


@dataclass(frozen=True, slots=True)
class _Found:
    """The pairs that were `chosen`, what was `told` of modes that lost one, MAC (`own`), `agreement` and `distance` in
    frequency (n_a, n_b), and the `clusters` of both sets."""

    chosen: list[tuple[int, int]]
    told: dict[int, str]
    own: NDArray[np.float64]
    agreement: NDArray[np.float64]
    distance: NDArray[np.float64]
    clusters: tuple[NDArray[np.int64], NDArray[np.int64]]


def _found(
    a: NDArray[Any],
    b: NDArray[Any],
    freq_a: ArrayLike | None,
    freq_b: ArrayLike | None,
    mac_min: float,
    closeness: float,
    frequency_weight: float,
    weight: Any,
    unseen: tuple[tuple[int, ...], tuple[int, ...]],
) -> _Found:
    """The pairs of two sets of shapes, as `pair_modes` says."""
    unseen_a, unseen_b = unseen
    own = _of_seen(np.nan_to_num(mac(a, b, weight)), unseen_a, unseen_b)
    if freq_a is None or freq_b is None:
        frequency_weight = 0.0
        agreement, distance = own, np.zeros_like(own)
        cluster_a, cluster_b = np.full(a.shape[1], -1), np.full(b.shape[1], -1)
    else:
        fa, fb = _frequencies(freq_a, a), _frequencies(freq_b, b)
        cluster_a = _clusters(fa, closeness, unseen_a, a.shape[0])
        cluster_b = _clusters(fb, closeness, unseen_b, a.shape[0])
        agreement = _with_clusters(own, _root(weight, a), _root(weight, b), cluster_a, cluster_b)
        agreement, distance = _of_seen(agreement, unseen_a, unseen_b), _log_distance(fa, fb)
    clusters = cluster_a, cluster_b
    alike = _AlikeModes(a, b, weight)
    chosen, told = _settled(agreement, own, distance, alike, clusters, mac_min, frequency_weight)
    return _Found(chosen, told, own, agreement, distance, clusters)


def _settled(
    agreement: NDArray[np.float64],
    own: NDArray[np.float64],
    distance: NDArray[np.float64],
    alike: _AlikeModes,
    clusters: tuple[NDArray[np.int64], NDArray[np.int64]],
    mac_min: float,
    frequency_weight: float,
) -> tuple[list[tuple[int, int]], dict[int, str]]:
    """The best pairs of which none is contradicted by its shapes, and why modes of the first set lost others. The
    `agreement` of what is contradicted is put to 0."""
    told: dict[int, str] = {}
    while True:
        chosen = _assign(agreement, own, distance, mac_min, frequency_weight)
        chosen = _inside_clusters(chosen, agreement, own - frequency_weight * distance, mac_min, *clusters)
        against = _contradicted(chosen, own, alike, mac_min)
        if not against:
            return chosen, told
        for pair, why in against.items():  # every round takes at least one away, so that it ends
            agreement[pair] = 0.0
            told.setdefault(pair[0], why)


def _of_seen(agreement: NDArray[np.float64], unseen_a: Sequence[int], unseen_b: Sequence[int]) -> NDArray[np.float64]:
    """The agreement (n_a, n_b) with that of modes that do not move at the DOFs compared put to 0."""
    out = agreement.copy()
    out[list(unseen_a), :] = 0.0
    out[:, list(unseen_b)] = 0.0
    return out


def _rest(shapes: NDArray[Any], paired: Sequence[int], unseen: Sequence[int]) -> tuple[int, ...]:
    """Modes that have no partner though they were looked for."""
    return tuple(i for i in range(shapes.shape[1]) if i not in paired and i not in unseen)


def _assign(
    agreement: NDArray[np.float64],
    own: NDArray[np.float64],
    distance: NDArray[np.float64],
    mac_min: float,
    frequency_weight: float,
) -> list[tuple[int, int]]:
    """The one-to-one pairs of the largest total worth; a pair below `mac_min` is worth nothing and is dropped."""
    import scipy.optimize

    # The offset keeps every allowed pair above an unmade one, however far apart in frequency.
    worth = agreement + _OWN_SHARE * own - frequency_weight * np.minimum(distance, 2.0)
    floor = mac_min - 2.0 * frequency_weight - 1e-9
    value = np.where(agreement >= mac_min, worth - floor, 0.0)
    rows, columns = scipy.optimize.linear_sum_assignment(value, maximize=True)
    return [
        (int(i), int(j)) for i, j in zip(rows, columns, strict=True) if agreement[i, j] >= mac_min and value[i, j] > 0
    ]


class _AlikeModes:
    """MACs of the modes of either set among themselves, (n_a, n_a) and (n_b, n_b), once they are asked for."""

    def __init__(self, phi_a: NDArray[Any], phi_b: NDArray[Any], weight: Any) -> None:
        self._phi_a, self._phi_b, self._weight = phi_a, phi_b, weight
        self.n_dof = len(phi_a)

    @cached_property
    def a(self) -> NDArray[np.float64]:
        return mac(self._phi_a, self._phi_a, self._weight)

    @cached_property
    def b(self) -> NDArray[np.float64]:
        return mac(self._phi_b, self._phi_b, self._weight)


def _contradicted(
    chosen: list[tuple[int, int]], own: NDArray[np.float64], alike: _AlikeModes, mac_min: float
) -> dict[tuple[int, int], str]:
    """Pairs that a cluster's space brought together though their own shapes speak against it, and why.

    A mixture of close modes is like each of them to some degree, and other mixtures are unlike it. A shape that is no
    more like its mate than any shape is on average (1 / n_dof), or that is the one of another pair which is like its
    own mate, says nothing of a second mode.
    """
    out = {}
    for i, j in chosen:
        if own[i, j] >= mac_min:
            continue
        better = [(p, q) for p, q in chosen if p != i and own[p, q] > own[i, j]]
        unlike = (
            f"mode {i + 1} has a MAC of {own[i, j]:.2f} with mode {j + 1} of the second set and is not paired with it"
        )
        twin = next((p for p, q in better if max(alike.a[i, p], alike.b[j, q]) > _ALIKE), None)
        if twin is not None and alike.a[i, twin] > _ALIKE:
            seen = f"modes {twin + 1}, {i + 1} are alike at the DOFs compared (MAC {alike.a[i, twin]:.2f})"
            out[i, j] = f"{seen}: one mode seen twice? {unlike}"
        elif twin is not None or own[i, j] <= 1.0 / alike.n_dof:
            out[i, j] = f"{unlike}, though it lies in the space of its close modes"
    return out


def _inside_clusters(
    chosen: list[tuple[int, int]],
    agreement: NDArray[np.float64],
    worth: NDArray[np.float64],
    mac_min: float,
    cluster_a: NDArray[np.int64],
    cluster_b: NDArray[np.int64],
) -> list[tuple[int, int]]:
    """The pairs of each cluster anew by `worth`, their own MAC less the distance in frequency.

    Agreement is with a space and hardly tells its members apart, so that frequencies would undo a crossing of two close
    modes whose shapes are clear; where the shapes are a mixture, the MACs are alike and frequencies decide.
    """
    groups: dict[tuple[str, int], list[tuple[int, int]]] = {}
    out = []
    for i, j in chosen:
        if cluster_b[j] >= 0 or cluster_a[i] >= 0:
            key = ("b", int(cluster_b[j])) if cluster_b[j] >= 0 else ("a", int(cluster_a[i]))
            groups.setdefault(key, []).append((i, j))
        else:
            out.append((i, j))
    # a space agrees with a shape whichever of its modes that is, so that members left over may be the mates
    free_a, free_b = (set(range(n)) - {pair[k] for pair in chosen} for k, n in enumerate(agreement.shape))
    for pairs in groups.values():
        rows, columns = ([pair[k] for pair in pairs] for k in (0, 1))
        rows += _members(free_a, cluster_a, rows)
        columns += _members(free_b, cluster_b, columns)
        found = _best_of(rows, columns, agreement, worth, mac_min)
        free_a = free_a.union(rows) - {i for i, _ in found}
        free_b = free_b.union(columns) - {j for _, j in found}
        out += found
    return out


def _members(free: set[int], cluster: NDArray[np.int64], of: Sequence[int]) -> list[int]:
    """Modes that are `free` and in a cluster with one of the modes `of`."""
    clusters = {int(cluster[i]) for i in of} - {-1}
    return [i for i in sorted(free) if int(cluster[i]) in clusters]


def _best_of(
    rows: Sequence[int],
    columns: Sequence[int],
    agreement: NDArray[np.float64],
    worth: NDArray[np.float64],
    mac_min: float,
) -> list[tuple[int, int]]:
    """The pairs of modes `rows` with modes `columns` by the largest total worth, as many as can be."""
    import scipy.optimize

    at = np.ix_(rows, columns)
    # a forbidden pair costs more than any other choice can win; the pairs as they came are allowed
    value = np.where(agreement[at] >= mac_min, worth[at], worth.min() - 10.0 * len(rows) * (1.0 + np.ptp(worth)))
    r, c = scipy.optimize.linear_sum_assignment(value, maximize=True)
    found = [(rows[int(i)], columns[int(j)]) for i, j in zip(r, c, strict=True)]
    return [pair for pair in found if agreement[pair] >= mac_min]


def _with_clusters(
    own: NDArray[np.float64],
    a: NDArray[Any],
    b: NDArray[Any],
    cluster_a: NDArray[np.int64],
    cluster_b: NDArray[np.int64],
) -> NDArray[np.float64]:
    """MAC, or where it is larger the adjusted share of a mode in the space of the other's cluster."""
    best = own.copy()
    n_dof = a.shape[0]
    for k in range(int(cluster_b.max(initial=-1)) + 1):
        members = np.nonzero(cluster_b == k)[0]
        share = _adjusted(subspace_mac(a, b[:, members]), members.size, n_dof)
        best[:, members] = np.maximum(best[:, members], share[:, None])
    for k in range(int(cluster_a.max(initial=-1)) + 1):
        members = np.nonzero(cluster_a == k)[0]
        share = _adjusted(subspace_mac(b, a[:, members]), members.size, n_dof)
        best[members, :] = np.maximum(best[members, :], share[None, :])
    return best


def _adjusted(share: NDArray[np.float64], n_members: int, n_dof: int) -> NDArray[np.float64]:
    """The share in a space of `n_members` dimensions less what any shape has there on average; 0 for all dimensions."""
    if n_members >= n_dof:
        return np.zeros_like(share)
    return np.clip(1.0 - (1.0 - np.nan_to_num(share)) * (n_dof - 1) / (n_dof - n_members), 0.0, 1.0)


def _pairs(
    chosen: list[tuple[int, int]],
    own: NDArray[np.float64],
    agreement: NDArray[np.float64],
    cluster_a: NDArray[np.int64],
    cluster_b: NDArray[np.int64],
) -> tuple[ModePair, ...]:
    numbers: dict[tuple[str, int], int] = {}
    found = []
    for i, j in sorted(chosen):
        mates = (np.arange(own.shape[1]) == j) | ((cluster_b == cluster_b[j]) & (cluster_b[j] >= 0))
        if cluster_a[i] >= 0:  # what the close modes of the first set are paired with belongs to them
            mates[[q for p, q in chosen if cluster_a[p] == cluster_a[i]]] = True
        rival = float(agreement[i, ~mates].max(initial=0.0))
        key = ("b", int(cluster_b[j])) if cluster_b[j] >= 0 else ("a", int(cluster_a[i]))
        cluster = numbers.setdefault(key, len(numbers)) if key[1] >= 0 else None
        found.append(ModePair(i, j, float(own[i, j]), float(agreement[i, j]), rival, cluster))
    return tuple(found)


def _notes(
    pairs: tuple[ModePair, ...], a: NDArray[Any], unseen_a: tuple[int, ...], unseen_b: tuple[int, ...]
) -> tuple[str, ...]:
    notes = [
        f"mode {i + 1} of the {which} set does not move at the DOFs compared: it cannot be paired"
        for which, unseen in (("first", unseen_a), ("second", unseen_b))
        for i in unseen
    ]
    if len(a) == 1 and pairs:
        notes.append("at one DOF every shape is like every other: pairs are told by frequency alone")
    for p in pairs:
        if len(a) > 1 and p.rival > p.agreement - _NEAR:
            notes.append(
                f"mode {p.a + 1} agrees with its mate {p.b + 1} by {p.agreement:.2f} and with another mode by "
                f"{p.rival:.2f}: the DOFs compared hardly tell them apart"
            )
    for k in sorted({p.cluster for p in pairs if p.cluster is not None}):
        mates = [p.a for p in pairs if p.cluster == k]
        alike = mac(a[:, mates], a[:, mates]) - np.eye(len(mates))
        if len(a) > 1 and alike.max(initial=0.0) > _ALIKE:
            listed = ", ".join(str(i + 1) for i in mates)
            notes.append(f"modes {listed} are alike at the DOFs compared (MAC {alike.max():.2f}): one mode seen twice?")
    return tuple(notes)


def _unseen(x: NDArray[Any], seen: ArrayLike | None) -> tuple[int, ...]:
    length = np.max(np.abs(x), axis=0)
    given = np.ones(x.shape[1], dtype=np.bool_) if seen is None else np.asarray(seen, dtype=np.bool_)
    if given.shape != length.shape:
        raise CorrelationError(f"{given.size} marks of modes that are seen for {length.size} modes; one per mode")
    return tuple(int(i) for i in np.nonzero(~given | (length <= _UNSEEN * length.max()))[0])


def _frequencies(freq: ArrayLike, x: NDArray[Any]) -> NDArray[np.float64]:
    f = np.asarray(finite(freq, "the frequencies"), dtype=np.float64)
    if f.shape != (x.shape[1],):
        raise CorrelationError(f"frequencies of shape {f.shape} for {x.shape[1]} modes; one per mode, in Hz")
    return f


def _clusters(freq: NDArray[np.float64], closeness: float, unseen: tuple[int, ...], n_dof: int) -> NDArray[np.int64]:
    """Number of the cluster of each mode, -1 outside; modes that do not move here join none.

    More modes than half the DOFs (but for a pair) are no cluster: their space holds much of any shape.
    """
    number = np.full(freq.size, -1)
    seen = np.array([i for i in range(freq.size) if i not in unseen], dtype=np.int64)
    if seen.size:
        groups = [g for g in close_groups(freq[seen], closeness) if len(g) <= max(2, n_dof // 2)]
        for k, group in enumerate(groups):
            number[seen[list(group)]] = k
    return number


def _log_distance(fa: NDArray[np.float64], fb: NDArray[np.float64]) -> NDArray[np.float64]:
    """|ln(f_b / f_a)|; between rigid-body modes, at 0 Hz or nearly, there is none."""
    least = 1e-3 * max(float(fa.max()), float(fb.max()), 1e-300)
    return np.abs(np.log(np.maximum(fb, least))[None, :] - np.log(np.maximum(fa, least))[:, None])


def _root(weight: Any, x: NDArray[Any]) -> NDArray[Any]:
    """Shapes whose plain products are those over the weight: W = L L^T, and L^T x takes the place of x."""
    if weight is None:
        return x
    dense = np.asarray(weight.toarray() if hasattr(weight, "toarray") else weight, dtype=np.float64)
    if dense.ndim == 1:
        return np.sqrt(dense)[:, None] * x
    values, vectors = np.linalg.eigh(dense)
    return np.sqrt(np.maximum(values, 0.0))[:, None] * (vectors.T @ x)
