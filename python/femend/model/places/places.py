"""Where something may be left out: every joint, support, member, region, connection and facing pair of a model.

A place is a set of direction vectors `w`: forces F along them are what the model lacks, and their work is done on
d = wᵀu. There are two kinds. *Attached* places (to ground, between two joints, the moving base) take w as a unit
direction. *Released* places sit inside the structure (the end of a member, a clamp): the connection is cut open, so
that a law can carry what the rigid connection carried. With the element's stiffness K_e and the cut DOFs s, the
released structure has K - B S⁻¹ Bᵀ, B = K_e[:, s], S = K_e[s, s]; the opening of the cut under a moment m is
d = S⁻¹ Bᵀ u - S⁻¹ m, so that w = B S⁻¹ with the compliance S⁻¹ in series. The element's mass goes with its own end,
which moves by d less than the node.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from femend.model.model import Model
from femend.model.places.body_places import body_places
from femend.model.places.connection_places import connection_places
from femend.model.places.gap_places import gap_places
from femend.model.places.pair_places import joint_pairs
from femend.model.places.place import AXES, Place
from femend.model.places.region_places import region_places
from femend.model.places.rod_places import struts
from femend.model.places.support_places import support_places

__all__ = ["Place", "Topology", "find_places", "inner_joints", "stretches", "topology"]

FloatArray = NDArray[np.float64]
# element cards that connect two nodes and carry bending
_BEAMS = ("CBAR", "CBEAM")
# elements from which on a member is also taken in parts
PARTED = 4


@dataclass(eq=False)
class Topology:
    """Members and joints of the beams of a model, and its rods, which are a member each, by their element ids."""

    joints: list[int] = field(default_factory=list)
    ends: dict[int, list[tuple[int, int]]] = field(default_factory=dict)
    members: list[tuple[int, int, tuple[int, ...]]] = field(default_factory=list)
    beams: dict[int, tuple[int, int]] = field(default_factory=dict)
    rods: dict[int, tuple[int, int]] = field(default_factory=dict)
    held: NDArray[np.bool_] = field(default_factory=lambda: np.zeros(0, dtype=bool))


def held_rows(model: Model) -> NDArray[np.bool_]:
    """DOFs of the g-set that cannot move (n_g,)."""
    T = model.transformation().tocsr()
    return np.asarray(np.diff(T.indptr) == 0)


def topology(model: Model) -> Topology:
    """Joints (where members meet, end, turn, change section, carry a mass or a support), and members between them."""
    top = Topology(held=held_rows(model), rods=struts(model))
    other: set[int] = set()
    for eid, card, nodes in model.fe.elements():
        if card in _BEAMS:
            top.beams[eid] = (nodes[0], nodes[1])
            top.ends.setdefault(nodes[0], []).append((eid, 0))
            top.ends.setdefault(nodes[1], []).append((eid, 1))
        else:
            other.update(nodes)
    section = {eid: pid for eid, _, pid, _ in model.deck.elements()}
    n_drawn = len(model.as_drawn.node_ids)
    for node in sorted(top.ends):
        here = top.ends[node]
        # the middle of a beam that was cut with a refined mesh
        straight = len(here) == 2 and model.index(node) >= n_drawn
        if len(here) == 2 and node not in other and not top.held[_rows(model, node)[:3]].all():
            (a, _), (b, _) = here
            axis_a, axis_b = model.fe.element_frame(a)[0][0], model.fe.element_frame(b)[0][0]
            straight = abs(float(axis_a @ axis_b)) > 0.99 and section.get(a) == section.get(b)
        if not straight:
            top.joints.append(node)
    _chain_members(top)
    return top


def _chain_members(top: Topology) -> None:
    joints, seen = set(top.joints), set()
    for start in top.joints:
        for eid, end in top.ends[start]:
            if eid in seen:
                continue
            chain, node = [eid], top.beams[eid][1 - end]
            seen.add(eid)
            while node not in joints:
                follow = next(e for e, _ in top.ends[node] if e != chain[-1])
                chain.append(follow)
                seen.add(follow)
                a, b = top.beams[follow]
                node = b if a == node else a
            top.members.append((start, node, tuple(chain)))


def stretches(top: Topology, nodes: Sequence[int]) -> list[tuple[int, ...]]:
    """Nodes in their order, but for those inside one member: of these only the first and the last along it, together.

    A force may act anywhere on a stretch of a member whose nodes cannot be told apart.
    """
    inside: dict[int, tuple[int, int]] = {}
    for m, (start, _, chain) in enumerate(top.members):
        node = start
        for position, eid in enumerate(chain):
            a, b = top.beams[eid]
            node = b if a == node else a
            if position < len(chain) - 1:
                inside[node] = (m, position)
    groups: dict[object, list[int]] = {}
    for node in nodes:
        groups.setdefault(inside[node][0] if node in inside else (node,), []).append(node)
    ordered = [sorted(g, key=lambda n: inside[n][1] if n in inside else 0) for g in groups.values()]
    return [(g[0],) if len(g) == 1 else (g[0], g[-1]) for g in ordered]


def _rows(model: Model, node: int) -> NDArray[np.int64]:
    return 6 * model.index(node) + np.arange(6)


def find_places(model: Model, top: Topology | None = None) -> list[Place]:
    """Every place of a model where something may be missing, in a fixed order."""
    top = topology(model) if top is None else top
    places = _grounds(model, top)
    for joint in top.joints:
        for eid, end in top.ends[joint]:
            places += _end_places(model, top, joint, eid, end)
    for a, b, chain in top.members:
        parameter = _scaled_by(model, chain[0])
        for start, end, part in [(a, b, chain), *_parts(model, top, a, chain)]:
            label = f"member between nodes {start} and {end}"
            places.append(
                Place("member", (start, end), "", label, elements=part, label=label, parameter=parameter,
                      unlikely=part is not chain)
            )  # fmt: skip
    for eid, ends in top.rods.items():
        label = f"rod {eid} between nodes {ends[0]} and {ends[1]}"
        places.append(Place("member", ends, "", label, elements=(eid,), label=label, parameter=_scaled_by(model, eid)))
    places += support_places(model, top.held, list(top.ends))
    places += region_places(model)
    joints = list(dict.fromkeys([*top.joints, *(node for ends in top.rods.values() for node in ends)]))
    joined = [*((a, b) for a, b, _ in top.members), *top.rods.values()]
    pairs = joint_pairs(model, top.held, joints, map(frozenset, joined))
    places += pairs
    places += gap_places(model, top.held, pairs)
    chains = [sorted({n for eid in chain for n in top.beams[eid]}) for _, _, chain in top.members]
    places += body_places(model, top.held, chains, places)
    places += connection_places(model, top.held, places)
    places += _bases(model, top)
    return places


def inner_joints(model: Model, member: Place) -> list[Place]:
    """Cuts at the nodes inside a member or a stretch of one, where the deck has no joint."""
    top = topology(model)
    found: list[Place] = []
    for eid, follow in pairwise(member.elements):
        for node in model.drawn(set(top.beams[eid]) & set(top.beams[follow])):
            found += _end_places(model, top, node, follow, top.beams[follow].index(node))
    return found


def _parts(model: Model, top: Topology, first: int, chain: tuple[int, ...]) -> list[tuple[int, int, tuple[int, ...]]]:
    """Stretches of a long member with their end nodes, which the deck has: what is weak need not be so from joint to
    joint.

    A half of it, a third and so on down to a twelfth, each moved by a third of itself; of a member of few elements
    of the deck there are none.
    """
    nodes = [first]
    for eid in chain:
        a, b = top.beams[eid]
        nodes.append(b if a == nodes[-1] else a)
    drawn = set(model.drawn(nodes))
    cuts = [k for k, node in enumerate(nodes) if node in drawn]
    n = len(cuts) - 1
    if n < PARTED:
        return []
    lengths = sorted({max(1, round(n / parts)) for parts in (2, 3, 4, 6, 8, 12)}, reverse=True)
    pairs = ((cuts[i], cuts[i + length]) for length in lengths for i in range(0, n - length + 1, max(1, length // 3)))
    return [(nodes[i], nodes[j], chain[i:j]) for i, j in pairs]


def _grounds(model: Model, top: Topology) -> list[Place]:
    # Things are attached rather where members meet, end or carry something than at nodes that are there for the mesh.
    inside = set(top.ends) - set(top.joints)
    places = []
    for index, node in enumerate(model.as_drawn.node_ids.tolist()):
        for c in range(3):
            row = 6 * index + c
            if not top.held[row]:
                label = f"node {node} to ground, {AXES[c]}"
                places.append(
                    Place(
                        "ground",
                        (node,),
                        AXES[c],
                        "ground",
                        (np.array([row]),),
                        (np.array([1.0]),),
                        label=label,
                        unlikely=node in inside,
                    )
                )
    return places


def mass_place(model: Model, node: int) -> Place:
    """A node with all its free translations: where a mass resists in every direction alike."""
    held = held_rows(model)
    rows = [row for row in _rows(model, node)[:3] if not held[row]]
    ones = tuple(np.array([1.0]) for _ in rows)
    return Place(
        "mass", (node,), "", "", tuple(np.array([r]) for r in rows), ones, label=f"node {node}, all translations"
    )


def _scaled_by(model: Model, eid: int) -> int | None:
    """The parameter whose factor multiplies the element's whole stiffness."""
    ones = np.ones(len(model.parameters))
    K = model.fe.element_matrices(eid, ones)[1]
    for i in range(len(ones)):
        factors = ones.copy()
        factors[i] = 2.0
        if np.allclose(model.fe.element_matrices(eid, factors)[1], 2 * K, rtol=1e-9, atol=1e-12 * np.abs(K).max()):
            return i
    return None


def _end_places(model: Model, top: Topology, joint: int, eid: int, end: int) -> list[Place]:
    rows, K, _ = model.fe.element_matrices(eid, np.ones(len(model.parameters)))
    axes, length = model.fe.element_frame(eid)
    node_frame = model.frames[model.index(joint)]
    own = _rows(model, joint)
    position = [int(np.flatnonzero(rows == r)[0]) for r in own]
    clamped = bool(top.held[own].any()) and bool(top.held[own[:3]].all())
    parameter = _scaled_by(model, eid)
    far = next((b if a == joint else a for a, b, chain in top.members if eid in chain), top.beams[eid][1 - end])
    free = ~top.held[rows]
    cuts = []
    for c in range(6) if clamped else range(3, 6):
        unit = np.zeros(len(rows))
        unit[position[3 * (c // 3) : 3 * (c // 3) + 3]] = node_frame @ axes[c % 3]
        pattern = K @ unit
        # Where the other constraints hold the whole pattern (out of plane of a plane frame) there is nothing to open.
        if np.abs(pattern[free]).max(initial=0.0) * length > 1e-9 * np.abs(K).max() * length:
            stiffness = float(unit @ pattern)
            resisted = np.linalg.norm(pattern[free]) > 1e-6 * np.linalg.norm(pattern)
            if stiffness > 0 and resisted:
                cuts.append((c, pattern, stiffness, unit))
    kind, name = ("clamp", "clamp at node") if clamped else ("end", "joint at node")
    to = "ground" if clamped else f"member to node {far}"
    base = f"{name} {joint}" + ("" if clamped else f", {to}")
    places = []
    for c, pattern, stiffness, unit in cuts:
        direction = _nearest_axis(unit[position[3 * (c // 3) : 3 * (c // 3) + 3]], c // 3)
        keep = np.flatnonzero(pattern)
        places.append(
            Place(kind, (joint,), direction, to, (rows[keep],), (pattern[keep],), np.array([[stiffness]]), parameter,
                  (eid,), f"{base}, {direction}", lets_go=(unit,))
        )  # fmt: skip
    turns = [cut for cut in cuts if cut[0] >= 3]
    if len(turns) > 1:
        S = np.array([[float(u @ (K @ v)) for *_, v in turns] for *_, u in turns])
        patterns = [pattern for _, pattern, _, _ in turns]
        places.append(
            Place(kind, (joint,), "R", to, tuple(rows for _ in turns), tuple(patterns), S, parameter, (eid,),
                  f"{base}, all rotations", lets_go=tuple(unit for *_, unit in turns))
        )  # fmt: skip
    return places


def _nearest_axis(vector: FloatArray, turn: int) -> str:
    """Name of the axis of the node's frame that a vector follows best, with R for a rotation."""
    return AXES[3 * turn + int(np.argmax(np.abs(vector)))]


def _moved_supports(model: Model, held: Sequence[int]) -> list[Place]:
    """Uniform displacement of the nodes `held` along each axis: the forces with which it drives the rest.

    Responses are then the structure's own (absolute) motion, as accelerometers show it. The little mass that elements
    next to a support share with it is left out.
    """
    nodes = set(held)
    frames = model.frames
    driving = [eid for eid, _, own in model.fe.elements() if nodes.intersection(own)]
    ones = np.ones(len(model.parameters))
    places = []
    for c in range(3):
        pattern = np.zeros(model.fe.n_g)
        shift = np.zeros(model.fe.n_g)
        for node in held:
            index = model.index(node)
            shift[6 * index : 6 * index + 3] = frames[index, :, c]
        for eid in driving:
            rows, K, _ = model.fe.element_matrices(eid, ones)
            pattern[rows] -= K @ shift[rows]
        pattern[held_rows(model)] = 0.0
        keep = np.flatnonzero(pattern)
        if len(keep):
            label = f"base motion, {AXES[c]}"
            places.append(Place("base", model.drawn(held), AXES[c], "moved", (keep,), (pattern[keep],), label=label))
    return places


def _bases(model: Model, top: Topology) -> list[Place]:
    """Uniform motion of everything that is held, for responses against it (the inertia forces it makes) and for
    absolute ones."""
    T = model.transformation()
    _, M = model.matrices()
    frames = model.frames
    grids = model.node_ids[~model.is_scalar].tolist()
    held = [n for n in grids if top.held[_rows(model, n)[:3]].all()]
    places = []
    for c in range(3):
        shift = np.zeros(model.fe.n_g)
        shift.reshape(-1, 6)[:, :3] = frames[:, :, c]
        shift[top.held] = 0.0
        # T^+ of the rigid shift: independent DOFs carry it as they are
        a = np.asarray(T.T @ shift)
        counts = np.asarray(T.T.multiply(T.T).sum(axis=1)).ravel()
        pattern = M @ np.divide(a, counts, out=np.zeros_like(a), where=counts > 0)
        if held and np.abs(pattern).max(initial=0.0) > 0:
            places.append(
                Place("base", model.drawn(held), AXES[c], "inertia", (np.arange(model.fe.n_a),), (pattern,),
                      label=f"base motion, {AXES[c]}", independent=True)
            )  # fmt: skip
    return places + _moved_supports(model, held)
