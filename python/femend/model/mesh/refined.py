"""The user's deck with linear shells and solids, and coarse beams, refined once; all else stands as it is.

Solids of straight edges get nodes in the middle of their edges (CHEXA 20, CPENTA 15, CTETRA 10, CPYRAM 13), shells are
cut in two along every edge. Nodes of the deck keep their ids, so that both models can be compared there. An edge whose
ends are both held is held in its middle, one whose ends hang on the same RBE2 hangs on it. Beams along an edge that is
cut are cut there too, and others that are asked for (`coarse_beams`); the rest, springs, masses, RBE3 and MPCs stand as
they are. Once more refined, the solids too are cut in two along every edge before that.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from femend.errors import ModelError
from femend.io.deck import next_id, read_deck
from femend.model.cards.real_field import real
from femend.model.cards.section_fields import is_tapered
from femend.model.cards.spc_set import spc_set_of
from femend.model.mesh.solid_parts import PARTS
from femend.model.model import Model, model_of
from femend.model.places.places import held_rows

__all__ = ["QUADRATIC", "SHELLS", "is_linear", "only_shells", "refined_model", "refined_size", "twice_refined"]

FloatArray = NDArray[np.float64]
Nodes = tuple[int, ...]

# corners of shells that interpolate linearly
SHELLS = {"CQUAD4": 4, "CTRIA3": 3}
# edges of solids by their corners, in the order in which the quadratic element has its nodes after the corners
QUADRATIC = {
    "CHEXA": (8, ((0, 1), (1, 2), (2, 3), (3, 0), (0, 4), (1, 5), (2, 6), (3, 7), (4, 5), (5, 6), (6, 7), (7, 4))),
    "CPENTA": (6, ((0, 1), (1, 2), (2, 0), (0, 3), (1, 4), (2, 5), (3, 4), (4, 5), (5, 3))),
    "CTETRA": (4, ((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3))),
    "CPYRAM": (5, ((0, 1), (1, 2), (2, 3), (3, 0), (0, 4), (1, 4), (2, 4), (3, 4))),
}


# of a beam of unit length, motion of its middle that is none
STILL = 1e-6
# where cards of beams have, after their name, the first of their two nodes, the pins of the first end and its offset
# (0: none)
_ALONG = {"CBAR": (2, 8, 10), "CBEAM": (2, 8, 10), "CROD": (2, 0, 0), "CONROD": (1, 0, 0)}


def is_linear(card: str, n_nodes: int) -> bool:
    """Whether an element is a shell or solid with nodes at its corners alone."""
    corners = SHELLS[card] if card in SHELLS else QUADRATIC[card][0] if card in QUADRATIC else None
    return corners == n_nodes


def refined_size(model: Model, beams: Collection[int] = ()) -> int:
    """Nodes that the refined model would have with `beams` cut too; 0 where there is nothing to refine."""
    new: set[Nodes] = set()
    centres = 0
    for eid, card, nodes in model.fe.elements():
        if is_linear(card, len(nodes)):
            new.update(_key(*edge) for edge in _edges(card, nodes))
            centres += card == "CQUAD4"
        elif eid in beams:
            new.add(_key(*nodes[:2]))
    return len(model.node_ids) + len(new) + centres if new else 0


def held_inside(model: Model, nodes: Sequence[int], held: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Which components (6,) the middle of a beam between two `nodes`, of the same axes, is held in: those in which both
    ends are (`held` (n_g,)) and none of their free motions moves it. So a frame stays in its plane, and what spans two
    supports sags."""
    at = [model.index(n) for n in nodes]
    x = model.frames[at[0]].T @ (model.xyz[at[1]] - model.xyz[at[0]])
    x /= max(float(np.linalg.norm(x)), 1e-300)
    along, turned = np.outer(x, x), np.cross(np.eye(3), x).T
    # size of what motions of an end do to the middle, of cubic shapes over a unit length
    moves = np.abs(np.block([[np.eye(3) / 2, turned / 8], [1.5 * turned, along / 2 - (np.eye(3) - along) / 4]]))
    both = held.reshape(-1, 6)[at].all(axis=0)
    return np.asarray(both & (moves[:, ~both].max(axis=1, initial=0.0) < STILL))


def only_shells(model: Model) -> bool:
    """Whether no solids would be refined."""
    return not any(card in QUADRATIC and is_linear(card, len(nodes)) for _, card, nodes in model.fe.elements())


def refined_model(model: Model, beams: Collection[int] = ()) -> Model:
    """The refined model, with the deck's SPC set, added masses and parameters, without morphs; nodes of the deck come
    first in it, in their order. Of `beams`, which are ids, those along no edge are cut too, but for what `_beam` says.

    Raises ModelError for a model that has nothing to refine, DeckError or ModelError for a deck whose cards cannot be
    put in place of others, and OSError for files that cannot be read again.
    """
    # the files are read when the deck is made and not again
    with tempfile.TemporaryDirectory(prefix="femend-refined-") as folder:
        return _refined(model, Path(folder), beams)


def twice_refined(model: Model, most_nodes: int, beams: Collection[int] = ()) -> Model | None:
    """The model with its linear solids first cut in two along every edge, then refined as by `refined_model`, with
    shells cut in two each time; None where it would have more than `most_nodes` nodes. Raises what `refined_model`
    does."""
    if refined_size(model, beams) > most_nodes:  # so many has the one in between alone
        return None
    with tempfile.TemporaryDirectory(prefix="femend-refined-") as folder:
        halved = _refined(model, Path(folder) / "halved", halve=True)
        whole = set(beams) - set(halved.parts)
        if refined_size(halved, whole) > most_nodes:
            return None
        finer = _refined(halved, Path(folder) / "finer", whole)
    again = finer.parts
    parts = {eid: tuple(p for own in pieces for p in again.get(own, (own,))) for eid, pieces in halved.parts.items()}
    return replace(finer, refines=model, parts=parts)


def _refined(model: Model, folder: Path, beams: Collection[int] = (), *, halve: bool = False) -> Model:
    """The refined model from files in `folder`; with `halve` its solids are cut and stay linear."""
    refined = _Refined(model, halve, frozenset(beams))
    refined.cut()
    if not refined.replaced:
        raise ModelError(
            "the model has no shells or solids with nodes at their corners alone, nor coarse beams that can be cut; "
            "nothing can be refined"
        )
    deck = read_deck(_written(model, refined, folder))
    parameters = [
        replace(p, ids=tuple(part for eid in p.ids for part in refined.parts.get(eid, (eid,))))
        if p.target == "elements"
        else p
        for p in model.parameters
    ]
    made = model_of(deck, units=model.units, parameters=parameters, spc=model.spc, added_mass=model.added_mass)
    if not np.array_equal(made.node_ids[: len(model.node_ids)], model.node_ids):
        raise ModelError("the refined model has other nodes than the deck; its mesh cannot be compared")
    return replace(made, refines=model, parts=refined.parts)


@dataclass
class _Refined:
    """New cards, the ones they replace as (card, id), and the elements that each one became where they are several
    (`parts`); new nodes in the `middles` of others, and in those of `beams` that are no edges (`insides`). With `halve`
    solids are cut like shells."""

    model: Model
    halve: bool = False
    beams: frozenset[int] = frozenset()
    replaced: list[tuple[str, int]] = field(default_factory=list)
    cards: list[str] = field(default_factory=list)
    middles: dict[Nodes, int] = field(default_factory=dict)
    parts: dict[int, Nodes] = field(default_factory=dict)
    insides: dict[Nodes, int] = field(default_factory=dict)

    def __post_init__(self) -> None:
        deck = self.model.deck
        self._node, self._element = deck.next_id("node"), next_id(deck, "element")
        self._held = held_rows(self.model).reshape(-1, 6)
        self._spc = spc_set_of(deck, self.model.spc)
        loose = np.zeros(self._held.size, dtype=bool)
        loose[self.model.unsupported.g_rows() if self._spc is not None else []] = True
        self._by_set = self._held & loose.reshape(-1, 6)
        self._frames = self.model.frames
        self._cd: dict[int, str] = {}

    def cut(self) -> None:
        """Makes the cards of all elements, and of rigid ones that take new nodes with them."""
        rigid: dict[tuple[int, str], set[int]] = {}
        shells, solids, beams = [], [], []
        for eid, card, _, nodes in self.model.deck.elements():
            if card in QUADRATIC and len(nodes) > QUADRATIC[card][0]:
                corners = nodes[: QUADRATIC[card][0]]
                ends = (_key(corners[i], corners[j]) for i, j in QUADRATIC[card][1])
                self.middles.update({e: n for e, n in zip(ends, nodes[len(corners) :], strict=False) if n})
            elif card in SHELLS:
                shells.append((eid, card, nodes))
            elif card in QUADRATIC:
                solids.append((eid, card, nodes))
            elif card in _ALONG:
                beams.append((eid, card, nodes))
            elif card == "RBE2":
                # an edge may hang on one point by two of them
                components = self.model.deck.field_text("RBE2", eid, 4)
                rigid.setdefault((nodes[0], components), set()).update(nodes[1:])
        known = set(self.middles.values())
        cut = self._pieces if self.halve else self._solid
        for eid, card, nodes in solids:
            cut(eid, card, nodes)
        for eid, card, nodes in shells:
            self._shell(eid, card, nodes)
        for eid, card, nodes in beams:
            self._beam(eid, card, nodes)
        for (first, components), hung in rigid.items():
            self._rigid(first, components, hung, known)

    def _solid(self, eid: int, card: str, nodes: Nodes) -> None:
        pid = self.model.deck.field_text(card, eid, 3)
        middles = [self._at(nodes[i], nodes[j]) for i, j in QUADRATIC[card][1]]
        self.replaced.append((card, eid))
        self._card([card, str(eid), pid, *map(str, nodes), *map(str, middles)])

    def _pieces(self, eid: int, card: str, nodes: Nodes) -> None:
        """Solids of half the size in place of one, the first with its id."""
        pid = self.model.deck.field_text(card, eid, 3)
        pieces = [(own, [self._at(*(nodes[c] for c in corners)) for corners in part]) for own, part in PARTS[card]]
        self.replaced.append((card, eid))
        self.parts[eid] = (eid, *(self._next_element() for _ in pieces[1:]))
        for new, (own, at) in zip(self.parts[eid], pieces, strict=True):
            self._card([own, str(new), pid, *map(str, at)])

    def _shell(self, eid: int, card: str, nodes: Nodes) -> None:
        """Four shells in place of one, first sides along its first side, so that THETA stays what it is; the first has
        its id, on which other cards may stand."""
        n, text = len(nodes), self.model.deck.field_text
        pid = text(card, eid, 3)
        after = [text(card, eid, k) for k in range(4 + n, 10)] + [text(card, eid, k) for k in range(12, 14 + n)]
        middles = [self._at(a, b) for a, b in _edges(card, nodes)]
        self.replaced.append((card, eid))
        if n == 4:
            a, b, c, d = nodes
            ab, bc, cd, da = middles
            m = self._at(*nodes)
            parts: list[Nodes] = [(a, ab, m, da), (ab, b, bc, m), (m, bc, c, cd), (da, m, cd, d)]
        else:
            a, b, c = nodes
            ab, bc, ca = middles
            parts = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (bc, ca, ab)]
        self.parts[eid] = (eid, *(self._next_element() for _ in parts[1:]))
        for own, part in zip(self.parts[eid], parts, strict=True):
            self._card([card, str(own), pid, *map(str, part), *after])

    def _beam(self, eid: int, card: str, nodes: Nodes) -> None:
        """Two beams in place of one that is asked for, or along an edge that was cut, whose new middle would bend away
        from it; the first has its id. Tapered ones stay, and those whose ends have axes of their own, which their
        fields count in."""
        a, b = nodes[:2]
        edge = self.middles.get(_key(a, b))
        if edge is None and eid not in self.beams:
            return
        fields = [self.model.deck.field_text(card, eid, k).strip() for k in (*range(2, 10), *range(12, 24))]
        turned = not np.allclose(*(self._frames[self.model.index(n)] for n in (a, b)))
        if turned or (card == "CBEAM" and (is_tapered(self.model.deck, int(fields[1])) or any(fields[16:]))):
            return
        middle = self._inside(a, b) if edge is None else edge
        first, pins, offsets = _ALONG[card]
        self.parts[eid] = (eid, self._next_element())
        one, other = fields.copy(), fields.copy()
        for half, own, ends in zip((one, other), self.parts[eid], ((a, middle), (middle, b)), strict=True):
            half[0] = str(own)
            half[first : first + 2] = map(str, ends)
        if pins:
            one[pins + 1] = other[pins] = ""
        for k in range(offsets, offsets + 3) if offsets else ():
            one[k + 3] = other[k] = repr(sum(real(fields[at]) for at in (k, k + 3) if fields[at]) / 2)
        self.replaced.append((card, eid))
        self._card([card, *one])
        self._card([card, *other])

    def _rigid(self, first: int, components: str, hung: set[int], known: set[int]) -> None:
        """A further RBE2 with the middles of edges and faces whose corners all hang on the same point."""
        new = sorted(n for corners, n in self.middles.items() if n not in known and hung.issuperset(corners))
        if new:
            self._card(["RBE2", str(self._next_element()), str(first), components, *map(str, new)])

    def _inside(self, a: int, b: int) -> int:
        """The node in the middle of all beams between two others."""
        key = _key(a, b)
        if key not in self.insides:
            held = held_inside(self.model, key, self._held)
            self.insides[key] = self._new(key, held, held & self._all(self._by_set, key))
        return self.insides[key]

    def _at(self, *corners: int) -> int:
        """The node in the middle of `corners`; of one the node itself."""
        key = _key(*corners)
        if len(key) > 1 and key not in self.middles:
            self.middles[key] = self._new(key, self._all(self._held, key), self._all(self._by_set, key))
        return self.middles[key] if len(key) > 1 else key[0]

    def _all(self, which: NDArray[np.bool_], corners: Nodes) -> NDArray[np.bool_]:
        """Components (6,) of which all `corners` are among `which` (n_nodes, 6)."""
        return np.asarray(which[[self.model.index(n) for n in corners]].all(axis=0))

    def _new(self, corners: Nodes, held: NDArray[np.bool_], by_set: NDArray[np.bool_]) -> int:
        """A node in the middle of others, `held` (6,) as they are: by the SPC set where that alone holds them, so that
        it can be set free with them (`by_set` (6,)), else at its GRID."""
        at = [self.model.index(n) for n in corners]
        x, y, z = self.model.xyz[at].mean(axis=0)
        cd = {self._frame(n) for n in corners}
        if len(cd) > 1:  # axes differ: only what is held in all directions is held in any
            held, by_set = (np.repeat([h[:3].all(), h[3:].all()], 3) for h in (held, by_set))
        at_grid, in_set = ("".join(str(c + 1) for c in np.flatnonzero(h)) for h in (held & ~by_set, held & by_set))
        node = self._node
        self._node += 1
        own = cd.pop() if len(cd) == 1 else "0"
        self._card(["GRID", str(node), "0", *(repr(float(v)) for v in (x, y, z)), own, at_grid])
        if in_set:
            self._card(["SPC1", str(self._spc), in_set, str(node)])
        return node

    def _frame(self, node: int) -> str:
        if node not in self._cd:
            self._cd[node] = self.model.deck.field_text("GRID", node, 7).strip()
        return self._cd[node]

    def _next_element(self) -> int:
        self._element += 1
        return self._element - 1

    def _card(self, fields: Sequence[str]) -> None:
        """A card in free field, as many lines as it takes."""
        name, data = fields[0], [f.strip() for f in fields[1:]]
        while data and not data[-1]:
            data.pop()
        lines = [data[i : i + 8] for i in range(0, len(data), 8)]
        self.cards += [",".join([name if i == 0 else "", *line]) for i, line in enumerate(lines)]


def _key(*corners: int) -> Nodes:
    return tuple(sorted(corners))


def _edges(card: str, nodes: Sequence[int]) -> Iterator[tuple[int, int]]:
    """Pairs of nodes at the ends of an element's edges."""
    if card in SHELLS:
        return zip(nodes, [*nodes[1:], nodes[0]], strict=True)
    return ((nodes[i], nodes[j]) for i, j in QUADRATIC[card][1])


def _written(model: Model, refined: _Refined, folder: Path) -> Path:
    """The files of the deck with refined elements in `folder`; the main one's path."""
    main = Path(model.deck.path).absolute()
    files = {Path(f).absolute(): Path(f).read_bytes() for f in model.deck.files}
    for changed, content in model.deck.patched([], refined.cards).items():
        files[Path(changed).absolute()] = content
    gone: dict[Path, set[int]] = {}
    for card, id_ in refined.replaced:
        file, line = model.deck.find(card, id_)
        gone.setdefault(Path(file).absolute(), set()).add(line)
    root = Path(os.path.commonpath([p.parent for p in files]))
    for path, content in files.items():
        to = folder / path.relative_to(root)
        to.parent.mkdir(parents=True, exist_ok=True)
        to.write_bytes(b"\n".join(_without(content.splitlines(), gone.get(path, set()))) + b"\n")
    return folder / main.relative_to(root)


def _without(lines: Iterable[bytes], first: set[int]) -> Iterator[bytes]:
    """Lines of a file without the cards that begin at the line numbers `first` (from 1)."""
    inside = False
    for number, line in enumerate(lines, 1):
        continues = line[:1] in (b" ", b"\t", b"+", b"*", b",")
        if number in first:
            inside = True
        elif line.strip() and not line.startswith(b"$") and not continues:
            inside = False
        if not (inside and (number in first or (continues and line.strip()))):
            yield line
