"""Where masses and springs to ground may be: at nodes without a sensor, screened before any of them is fitted."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from femend.diagnose.staged.nodes import with_elements
from femend.diagnose.staged.setup import Setup
from femend.dof import Dof
from femend.estimate.joint import Block, Posterior
from femend.model.terms.configured import ConfiguredModel, Part
from femend.model.terms.linear_terms import LinearTerm, point_mass, point_spring
from femend.model.terms.unknowns import Unknowns

__all__ = ["elsewhere", "masses_and_springs", "places_tried", "screened", "untaken"]

FloatArray = NDArray[np.float64]

# value at which terms are screened, as a share of their starting scale: as good as none
TINY = 1e-4
# terms whose derivatives are held at once
AT_ONCE = 100
# a mass or spring is guessed as this share of the structure's mass
SHARE = 0.02


def places_tried(setup: Setup, configuration: str, sensors: Sequence[Dof]) -> tuple[list[int], list[int], int]:
    """Loose nodes of the `sensors`, other loose nodes of the structure, and how many other ones there are.

    Loose is what moves by itself and is not held in the `configuration`. Of more than `most_screened` other nodes those
    are taken that lie farthest from one another.
    """
    free = setup.free
    held = {n for region in setup.regions[configuration] for n in region.nodes}
    own = list(dict.fromkeys(setup.pairing[d].dof.node for d in sensors))[: setup.settings.most_places]
    own = [n for n in own if n not in held]
    T = free.transformation()
    entries = np.diff(T.tocsr().indptr).reshape(-1, 6)[:, :3]
    # nodes that depend on others move as these do; a mass there is one at a rigid body
    used = with_elements(setup)
    others = [
        int(n)
        for n, k in zip(free.node_ids.tolist(), entries, strict=True)
        if (k == 1).all() and n in used and n not in held and n not in own
    ]
    xyz = free.xyz_of
    return own, _spread(others, [xyz[n] for n in own], xyz, setup.settings.most_screened), len(others)


def _spread(nodes: list[int], taken: Sequence[FloatArray], xyz: dict[int, FloatArray], most: int) -> list[int]:
    """At most `most` of the `nodes`, each the farthest from those before it and from the places `taken`."""
    if len(nodes) <= most:
        return nodes
    at = np.array([xyz[n] for n in nodes])
    apart = np.full(len(nodes), np.inf)
    for x in taken:
        apart = np.minimum(apart, np.linalg.norm(at - x, axis=1))
    found = []
    for _ in range(most):
        i = int(np.argmax(apart))
        found.append(nodes[i])
        apart = np.minimum(apart, np.linalg.norm(at - at[i], axis=1))
    return found


def elsewhere(
    setup: Setup, configuration: str, sensors: Sequence[Dof], taken: Sequence[LinearTerm], *, only_here: bool
) -> tuple[LinearTerm, ...]:
    """Masses and springs to ground at nodes without a sensor, without those `taken`; `only_here` as of `rivals`."""
    _, nodes, _ = places_tried(setup, configuration, sensors)
    found = masses_and_springs(setup, nodes)
    return untaken([term.only_in(configuration) if only_here else term for term in found], taken)


def untaken(terms: Sequence[LinearTerm], taken: Sequence[LinearTerm]) -> tuple[LinearTerm, ...]:
    """The terms without those `taken`."""
    names = {t.name for t in taken}
    return tuple(t for t in terms if t.name not in names)


def masses_and_springs(setup: Setup, nodes: Sequence[int]) -> list[LinearTerm]:
    """A mass and a spring to ground along every axis at each of the `nodes`."""
    free, m = setup.free, SHARE * setup.free.total_mass
    found = [point_mass(free, n, m) for n in nodes]
    return found + [point_spring(free, n, c, m * setup.omega**2) for n in nodes for c in (1, 2, 3)]


def screened(
    setup: Setup,
    configuration: str,
    terms: Sequence[LinearTerm],
    base: Posterior,
    blocks: Callable[[ConfiguredModel], Sequence[Block]],
    candidates: Sequence[LinearTerm],
) -> list[LinearTerm]:
    """The `most_fitted` candidates of every physics that promise most, to first order, to lower the squares of `base`.

    A candidate has one positive unknown. With the gradient g and the Gauss-Newton matrix A of all unknowns, one whose
    value may move together with everything else lowers the cost by g'^2 / A', where g' and A' are what is left of its
    own after the others have followed (Schur complement). The terms come into the small model of `base` as they are:
    its basis does without their static response.
    """
    model = setup.model(configuration, base.unknowns, terms)
    gains: list[tuple[float, LinearTerm]] = []
    for i in range(0, len(candidates), AT_ONCE):
        few = candidates[i : i + AT_ONCE]
        gains += zip(_gains(model, base, blocks, few), few, strict=True)
    found: list[LinearTerm] = []
    for physics in dict.fromkeys(t.physics for t in candidates):
        own = sorted((row for row in gains if row[1].physics == physics and row[0] > 0), key=lambda row: -row[0])
        found += [term for _, term in own[: setup.settings.most_fitted]]
    return found


def _gains(
    model: ConfiguredModel,
    base: Posterior,
    blocks: Callable[[ConfiguredModel], Sequence[Block]],
    terms: Sequence[LinearTerm],
) -> FloatArray:
    """By how much the cost falls with each of the `terms` (m,), to first order; 0 where a negative one would do it."""
    n = len(base.unknowns)
    wide = base.unknowns.extended([u for t in terms for u in t.unknowns])
    p = np.concatenate([base.p, wide.mean[n:] + np.log(TINY)])
    grown = _with(model, wide, terms)
    g = np.concatenate([base.unknowns.precision @ (base.p - base.unknowns.mean), np.zeros(len(terms))])
    A = np.zeros((len(p), len(p)))
    A[:n, :n] = base.unknowns.precision
    for block in blocks(grown):
        _, gradient, own = block.gauss_newton(p, True)
        g, A = g + gradient, A + own
    follow = np.linalg.solve(A[:n, :n], np.column_stack([A[:n, n:], g[:n]]))
    left = g[n:] - A[n:, :n] @ follow[:, -1]
    size = np.diag(A)[n:] - np.einsum("ij,ji->i", A[n:, :n], follow[:, :-1])
    gain = left**2 / np.maximum(size, 1e-12 * np.diag(A)[n:] + 1e-300)
    return np.where((left < 0) & (size > 1e-9 * np.diag(A)[n:]), gain, 0.0)


def _with(model: ConfiguredModel, unknowns: Unknowns, terms: Sequence[LinearTerm]) -> ConfiguredModel:
    """The model with terms behind its own, in its own basis."""
    parts = list(model.parts)
    for term in terms:
        at = [unknowns.index(u.name) for u in term.unknowns]
        for part in term.parts:
            matrix = np.asarray(model.V.T @ (part.matrix @ model.V))
            powers = tuple((at[i], float(e)) for i, e in part.powers)
            parts.append(Part(part.kind, matrix, powers, term.structural))
    return replace(model, parts=tuple(parts), unknowns=unknowns)
