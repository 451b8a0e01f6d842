"""Where the linear model is wrong: the energy of the dynamic residual per element, region and joint."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from femend.errors import ModelError
from femend.model import Model

__all__ = ["ResidualEnergy", "residual_energy"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False, repr=False)
class ResidualEnergy:
    """Shares of the energy d^T K d of a residual displacement d, modes summed at equal weight (`per_mode`: apart).

    `elements` ids, `element` (n_elements,) shares that add up to 1, `density` (n_elements,) share of residual over
    share of strain energy: an element that is wrong by a factor has a high density whatever it carries. `per_mode`
    (n_elements, n_modes) are energies over each mode's strain energy: squares of relative errors. `regions` and
    `joints` are shares by name and by node id.
    """

    elements: NDArray[np.int64]
    element: FloatArray
    density: FloatArray
    per_mode: FloatArray
    regions: dict[str, float]
    joints: dict[int, float]

    def worst(self, n: int = 5, by: str = "share") -> list[tuple[int, float]]:
        """The `n` elements with most residual energy, or the highest density (`by` "density"), with the value."""
        value = self.density if by == "density" else self.element
        order = np.argsort(-value, kind="stable")[:n]
        return [(int(self.elements[i]), float(value[i])) for i in order]

    def __repr__(self) -> str:
        lines = ["element        share [%]    density"]
        for eid, share in self.worst(8):
            at = int(np.flatnonzero(self.elements == eid)[0])
            lines.append(f"{eid:8d} {100 * share:14.1f} {self.density[at]:10.2f}")
        for name, share in sorted(self.regions.items(), key=lambda x: -x[1]):
            lines.append(f"{name:20} {100 * share:8.1f} %")
        top = sorted(self.joints.items(), key=lambda x: -x[1])[:5]
        lines += [f"joint {node:8d} {100 * share:14.1f} %" for node, share in top]
        return "\n".join(lines)


def residual_energy(
    model: Model,
    residual: ArrayLike,
    phi: ArrayLike,
    *,
    regions: Mapping[str, Sequence[int]] | None = None,
    factors: Mapping[str, float] | None = None,
) -> ResidualEnergy:
    """Energy of `residual` (n_a, n_modes) over the strain energy of `phi` (n_a, n_modes), element by element.

    Both are those of `femend.expansion.expand_residual` with the model's matrices. An element has
    e = d_e^T K_e d_e (the error in the constitutive relation, Ladeveze and Chouaki 1999, Inverse Problems 15, 41-58),
    at `factors` of the parameters by name. `regions` are element ids by name; where none are given, the materials or
    properties of the model's parameters are regions. A joint is a node at which three or more elements meet, or the
    directions or properties of two differ; it gets an equal part of each of its elements. Raises ModelError for sizes
    that do not fit, an element that the model does not have, or a residual without energy.
    """
    d, u = np.asarray(residual, dtype=np.float64), np.asarray(phi, dtype=np.float64)
    n = int(model.fe.n_a)
    if d.shape != u.shape or d.ndim != 2 or d.shape[0] != n:
        raise ModelError(f"residual {d.shape} and shapes {u.shape}; both are (n_a, n_modes) with {n} independent DOFs")
    d_g, u_g = model.fe.recover(np.ascontiguousarray(d)), model.fe.recover(np.ascontiguousarray(u))
    given = model.factors(factors)
    ids, nodes, lost, strain = [], [], [], []
    for eid, _, own in model.fe.elements():
        if eid == 0:
            continue
        try:
            rows, K, _ = model.fe.element_matrices(eid, given)
        except (KeyError, ValueError):
            continue  # rigid: it has no stiffness of its own
        if not np.any(K):
            continue
        ids.append(eid)
        nodes.append(tuple(int(x) for x in own))
        lost.append(np.einsum("im,ij,jm->m", d_g[rows], K, d_g[rows]))
        strain.append(np.einsum("im,ij,jm->m", u_g[rows], K, u_g[rows]))
    e, s = np.maximum(np.array(lost), 0.0), np.maximum(np.array(strain), 0.0)
    if not ids or not (s.sum(axis=0) > 0).all():
        raise ModelError("a shape has no strain energy in the elements; leave rigid-body modes out")
    per_mode = e / s.sum(axis=0)
    total = per_mode.sum()
    if not total > 0:
        raise ModelError("the residual has no energy: model and test agree, there is nothing to locate")
    share = per_mode.sum(axis=1) / total
    carried = (s / s.sum(axis=0)).mean(axis=1)
    # elements that carry next to nothing have no density worth a name
    floor = 1e-3 * carried.max()
    density = share / np.maximum(carried, floor)
    index = {eid: i for i, eid in enumerate(ids)}
    own_regions = dict(regions) if regions is not None else _regions(model, index)
    by_region = {}
    for name, members in own_regions.items():
        missing = [x for x in members if x not in index]
        if missing:
            raise ModelError(f"region {name!r}: the model has no element {missing[0]} with stiffness")
        by_region[name] = float(share[[index[x] for x in members]].sum())
    return ResidualEnergy(
        np.array(ids, dtype=np.int64), share, density, per_mode, by_region, _joints(model, nodes, ids, share)
    )


def _regions(model: Model, index: Mapping[int, int]) -> dict[str, list[int]]:
    """Elements of each property of the deck."""
    out: dict[str, list[int]] = {}
    for eid, _, pid, _ in model.deck.elements():
        if eid in index and pid is not None:
            out.setdefault(f"property {pid}", []).append(eid)
    return out


def _joints(model: Model, nodes: Sequence[tuple[int, ...]], ids: Sequence[int], share: FloatArray) -> dict[int, float]:
    at: dict[int, list[int]] = {}
    for k, own in enumerate(nodes):
        for node in own:
            at.setdefault(node, []).append(k)
    pid = {e: p for e, _, p, _ in model.deck.elements()}
    row = {int(n): i for i, n in enumerate(model.node_ids)}
    out = {}
    for node, elements in at.items():
        if len(elements) == 2 and all(len(nodes[k]) == 2 for k in elements):
            ends = [next((n for n in nodes[k] if n != node), node) for k in elements]
            a, b = (model.xyz[row[n]] - model.xyz[row[node]] for n in ends)
            size = float(np.linalg.norm(a) * np.linalg.norm(b))
            straight = size > 0 and float(a @ b) < -0.99 * size
            if straight and pid.get(ids[elements[0]]) == pid.get(ids[elements[1]]):
                continue
        elif len(elements) < 3:
            continue
        out[node] = float(sum(share[k] / len(nodes[k]) for k in elements))
    return out
