"""Morphs as they are meant: a plate off its plane, a part that grows, a joint that stands elsewhere."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from femend.errors import ModelError
from femend.model.geometry.morph import Morph
from femend.model.model import Model
from femend.model.surfaces.harmonic import harmonic_weights
from femend.units import unit_system

__all__ = ["grown", "joint_moved", "nodes_moved", "offset_along_normal"]

FloatArray = NDArray[np.float64]
Bounds = tuple[float, float] | None

_SHELLS = {"CQUAD4": 4, "CTRIA3": 3}
# rest of the blend left out: nodes that would move by less than this share stay where they are
LEAST = 1e-9


def offset_along_normal(
    model: Model,
    name: str,
    prior_sd: float,
    *,
    properties: Sequence[int] = (),
    elements: Sequence[int] = (),
    bounds: Bounds = None,
) -> Morph:
    """Shells of `properties` (PSHELL, PCOMP ids) or `elements` off along their normals: the morph `name`, its amplitude
    a length of the deck of `model` along the positive normal (G1 to G2 to G3); `prior_sd` and `bounds` as of `Morph`.

    A node moves along the mean normal of the shells at it, weighted by area, so that each keeps its distance to first
    order: a flat plate moves as a whole, a tube widens. Nodes of the region that others share move too, and strain
    them. Raises ModelError for ids that no shell has, and a node at which the normals cancel (orient them alike).
    """
    wanted, ids = set(properties), set(elements)
    found = [
        (eid, pid, nodes)
        for eid, card, pid, nodes in model.deck.elements()
        if card in _SHELLS and (pid in wanted or eid in ids)
    ]
    _all_met(name, "property", wanted, {pid for _, pid, _ in found})
    _all_met(name, "element", ids, {eid for eid, _, _ in found})
    if not found:
        raise ModelError(f"morph {name!r}: neither properties nor elements are given; name the shells that are off")
    index = _Positions(model)
    sums: dict[int, FloatArray] = {}
    areas: dict[int, float] = {}
    for _, _, nodes in found:
        x = index.xyz(nodes)
        area = 0.5 * np.cross(x[2] - x[0], x[-1] - x[1] if len(nodes) == 4 else x[2] - x[1])
        for node in nodes:
            sums[node] = sums.get(node, np.zeros(3)) + area
            areas[node] = areas.get(node, 0.0) + float(np.linalg.norm(area))
    for node, total in sums.items():
        if np.linalg.norm(total) < 1e-6 * areas[node]:
            raise ModelError(
                f"morph {name!r}: the normals of its shells at node {node} cancel out; turn shells so that all show "
                "the same side, or take fewer"
            )
    vectors = np.array([v / np.linalg.norm(v) for v in sums.values()])
    return Morph(name, np.array(list(sums)), vectors, prior_sd, bounds, _length(model))


def grown(
    model: Model,
    name: str,
    prior_sd: float,
    nodes: Sequence[int],
    point: ArrayLike,
    *,
    axis: ArrayLike | None = None,
    along: bool = False,
    bounds: Bounds = None,
) -> Morph:
    """`nodes` of `model` away from `point` (3,) in proportion to their distance: the morph `name`, its amplitude the
    relative growth; `prior_sd` and `bounds` as of `Morph`.

    Without `axis` in all directions. With `axis` (3,) through the point away from the axis (a diameter), or `along` it
    (a length). All are in basic coordinates. Raises ModelError for a node that is not in the deck or not a place, an
    axis of no length, and where no node moves.
    """
    centre = np.asarray(point, dtype=np.float64)
    if centre.shape != (3,):
        raise ModelError(f"morph {name!r}: its point has shape {centre.shape}; give (3,), basic coordinates")
    field = _Positions(model, name).xyz(nodes) - centre
    if axis is not None:
        a = _direction(name, axis, "axis")
        part = np.outer(field @ a, a)
        field = part if along else field - part
    elif along:
        raise ModelError(f"morph {name!r}: it is to grow along an axis, and none is given")
    return Morph(name, np.asarray(nodes), field, prior_sd, bounds)


def nodes_moved(
    model: Model,
    name: str,
    prior_sd: float,
    nodes: Sequence[int],
    direction: ArrayLike,
    radius: float,
    *,
    held: Sequence[int] = (),
    bounds: Bounds = None,
) -> Morph:
    """`nodes` of `model` along `direction` (3,), basic axes, others after them the less the further they are: the morph
    `name`, its amplitude a length of the deck; `prior_sd` and `bounds` as of `Morph`.

    A node at the distance d from the nearest moved one follows by (1 - s)^4 (4 s + 1), s = d / `radius` (a length),
    which leaves and arrives with slope 0 (Wendland, Adv. Comput. Math. 4 (1995) 389, table for l = 3, k = 1; for
    meshes: de Boer, van der Schoot and Bijl, Comput. Struct. 85 (2007) 784, table 1). Towards `held` nodes, which stay,
    it fades likewise, with s = d / (d + distance to the nearest of them). Distances are straight, through gaps too.
    Raises ModelError for unknown nodes, nodes that are moved and held, and a radius or direction without length.
    """
    from scipy.spatial import cKDTree

    a = _direction(name, direction, "direction")
    if not (radius > 0 and np.isfinite(radius)):
        raise ModelError(f"morph {name!r}: its radius is {radius:g}; give a length above 0")
    index = _Positions(model, name)
    moved, fixed = index.xyz(nodes), index.xyz(held)
    _no_contradiction(name, nodes, held)
    ids, xyz = model.deck.node_ids, model.deck.xyz
    d, _ = cKDTree(moved).query(xyz)
    weight = _wendland(d / radius)
    if len(held):
        away, _ = cKDTree(fixed).query(xyz)
        weight *= _wendland(d / np.maximum(d + away, 1e-300))
    weight[np.isin(ids, nodes)] = 1.0
    weight[np.isin(ids, held)] = 0.0
    there = weight > LEAST
    return Morph(name, ids[there], weight[there, None] * a, prior_sd, bounds, _length(model))


def joint_moved(
    model: Model,
    name: str,
    prior_sd: float,
    nodes: Sequence[int],
    direction: ArrayLike,
    held: Sequence[int],
    *,
    bounds: Bounds = None,
) -> Morph:
    """`nodes` of `model` (a joint) along `direction` (3,), basic axes, the elements between them and the `held` nodes
    (the other joints, supports) after them: the morph `name`, its amplitude a length of the deck; `prior_sd` and
    `bounds` as of `Morph`.

    Between both, weights w from 1 to 0 minimise sum (w_i - w_j)^2 / length_ij over the edges of the elements (the
    discrete Laplace equation): straight members stay straight, meshes fade harmonically. Parts that no element joins
    to a moved node stay. Raises ModelError for unknown nodes, nodes that are moved and held, and where nothing is held
    in a part that moves.
    """
    a = _direction(name, direction, "direction")
    index = _Positions(model, name)
    index.xyz(nodes), index.xyz(held)
    _no_contradiction(name, nodes, held)
    weight = harmonic_weights(model, name, nodes, held)
    there = weight > LEAST
    return Morph(name, model.deck.node_ids[there], weight[there, None] * a, prior_sd, bounds, _length(model))


class _Positions:
    """Positions by node id; raises ModelError for what is no GRID."""

    def __init__(self, model: Model, name: str = "") -> None:
        self.ids, self.all, self.name = model.deck.node_ids, model.deck.xyz, name

    def xyz(self, nodes: Sequence[int]) -> FloatArray:
        wanted = np.asarray(nodes, dtype=np.int64).ravel()
        missing = wanted[~np.isin(wanted, self.ids)]
        if missing.size:
            raise ModelError(f"morph {self.name!r}: node {missing[0]} is no GRID of the deck; correct the id")
        return self.all[np.searchsorted(self.ids, wanted)]


def _wendland(s: ArrayLike) -> FloatArray:
    t = np.clip(np.asarray(s, dtype=np.float64), 0.0, 1.0)
    return np.asarray((1.0 - t) ** 4 * (4.0 * t + 1.0))


def _direction(name: str, vector: ArrayLike, what: str) -> FloatArray:
    v = np.asarray(vector, dtype=np.float64)
    if v.shape != (3,) or not np.isfinite(v).all() or not v.any():
        raise ModelError(f"morph {name!r}: its {what} is {v.tolist()}; give three numbers, not all 0, in basic axes")
    return v / np.linalg.norm(v)


def _no_contradiction(name: str, nodes: Sequence[int], held: Sequence[int]) -> None:
    if not len(nodes):
        raise ModelError(f"morph {name!r}: no node is to move; name at least one")
    both = set(nodes) & set(held)
    if both:
        raise ModelError(f"morph {name!r}: node {min(both)} is to move and is held; take it out of one of them")


def _all_met(name: str, kind: str, wanted: set[int], met: set[int | None] | set[int]) -> None:
    missing = sorted(wanted - {m for m in met if m is not None})
    if missing:
        raise ModelError(f"morph {name!r}: no shell (CQUAD4, CTRIA3) has the {kind} {missing[0]}; correct the id")


def _length(model: Model) -> str:
    return unit_system(model.units).text("length")
