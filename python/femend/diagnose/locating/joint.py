"""A place opened for a law: the model without the rigid connection there, in a basis that holds its static response."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from femend.diagnose.locating.dressed import dressed
from femend.estimate import Hypothesis
from femend.model import Place, ReducedModel, reduce_model
from femend.model.reduced.reduction import extend_model
from femend.model.reduced.static_basis import LARGE

__all__ = ["Joint", "enlarged", "open_joint", "open_joints", "with_loads"]

FloatArray = NDArray[np.float64]

# share of an element's stiffness that is left of it at least
SOFTEST = 0.05


@dataclass(frozen=True, eq=False)
class LooseEnd:
    """An element with an end that is cut: its mass `M` (n, n), its rows of the basis `V` (n, r), the motions `U` (n, m)
    of the end that are let go, and how far they open at rest under no moment `D` (m, r), at coordinates `at` of its
    joint.

    The element is a small part of the structure, and heavy enough for its end all the same: left to turn with the node,
    it puts modes of a hinged frame, a quarter of a member long, half a per cent off, and more than that their shapes.
    """

    M: FloatArray
    V: FloatArray
    U: FloatArray
    D: FloatArray
    at: slice

    def mass(self, share: FloatArray) -> FloatArray:
        """What its mass (r, r) is more where the cut opens by a `share` (n_w,) of what it does under no moment."""
        loose = self.V - self.U @ (share[self.at][:, None] * self.D)
        return np.asarray(loose.T @ self.M @ loose - self.V.T @ self.M @ self.V)


@dataclass(frozen=True, eq=False)
class Joint:
    """A place opened for a law: the reduced model without the rigid connection (of a cut), `w` (n_w, r) the coordinates
    d = w q, and the compliance (n_w,) in series with them.

    Modes have damping ratios, and those of a structure that is cut open are not those that were recorded. So a cut may
    be `held` (n_w,) by springs of about the stiffness of its law, which are part of the reduced model; the law acts
    beyond them. `cuts` has the place that is cut of every coordinate, None of one that is attached, `loose` the masses
    of the elements that are cut; `opened` is the joint as it was opened, at the deck's values, of one that was changed
    since.
    """

    place: Place
    reduced: ReducedModel
    w: FloatArray
    compliance: FloatArray
    held: FloatArray | None = None
    cuts: tuple[Place | None, ...] = ()
    loose: tuple[LooseEnd, ...] = ()
    opened: Joint | None = None

    def hypothesis(
        self, laws: tuple[str, ...] | None, mean: FloatArray | None = None, sd: FloatArray | None = None
    ) -> Hypothesis:
        """The joint with linear laws (`mean`, `sd`: prior of the logarithms of their parameters), or with a free
        force."""
        return Hypothesis(self.reduced, self.w, laws, self.compliance, mean, sd, held=self.held)

    def held_by(self, k: FloatArray) -> Joint:
        """The same joint, open so far, held by springs `k` (n_w,) across its coordinates.

        A spring k behind a compliance c is one of g = k / (1 + k c) to the model. A law Z there acts on the model as
        Z / (1 + Z c): as g and, beside it, as Z - k behind the compliance c (1 - g c) at the coordinates (1 - g c) w.
        """
        g = k / (1 + k * self.compliance)
        share = 1 - g * self.compliance
        reduced = replace(self.reduced, K_fixed=self.reduced.K_fixed + self.w.T @ (g[:, None] * self.w))
        for end in self.loose:
            # a cut opens by so much less of what it does under no moment
            held = end.mass(share) - end.mass(np.ones(len(share)))
            reduced = replace(reduced, M_fixed=reduced.M_fixed + held)
        reduced = _cut_open(reduced) if self.is_cut else reduced
        opened = self if self.opened is None else self.opened
        w, compliance = share[:, None] * self.w, share * self.compliance
        return Joint(self.place, reduced, w, compliance, np.asarray(k), self.cuts, self.loose, opened)

    @property
    def is_cut(self) -> bool:
        """Whether a connection of the deck is cut at any of its coordinates."""
        return any(cut is not None for cut in self.cuts)

    def softness(self, p: FloatArray) -> FloatArray:
        """Factors on the compliance in series (n_w,) where cut elements are as stiff as unknowns `p` (n_p,) make
        them."""
        return np.array([1.0 if cut is None else 1 / _stiffer(self.reduced, cut, p) for cut in self.cuts])

    def at(self, p: FloatArray) -> Joint:
        """The same joint with the compliance in series that its elements have at unknowns `p` (n_p,) of the model.

        What is left between the two sides of a cut at the deck's values, (1/f - 1)/S where the element is f times as
        stiff as drawn, is told as the law's otherwise, and is as much as all of a stiff joint.
        """
        if not self.is_cut:
            return self
        opened = self if self.opened is None else self.opened
        there = replace(opened, compliance=opened.compliance * self.softness(p), opened=opened)
        return there if self.held is None else there.held_by(self.held)


def _loose_end(place: Place, reduced: ReducedModel, D: FloatArray, first: int) -> LooseEnd:
    """The element of a cut, which opens by `D` (n_w, r) at rest, at coordinates from the `first` one on."""
    model = reduced.model
    rows, _, M = model.fe.element_matrices(place.elements[0], np.ones(len(model.parameters)))
    return LooseEnd(M, np.asarray(reduced.V[rows]), np.array(place.lets_go).T, D, slice(first, first + place.n_w))


def _cut_open(reduced: ReducedModel) -> ReducedModel:
    """A model that was cut open, or is held there by springs, without what its beams add to the modes it has then."""
    return reduced if reduced.form is None else reduced.form.opened(reduced)


def _stiffer(reduced: ReducedModel, cut: Place, p: FloatArray) -> float:
    """How many times as stiff as drawn the element of a cut is at unknowns `p` (n_p,) of the model."""
    factor = 1.0 if cut.parameter is None else float(np.exp(p[cut.parameter]))
    own = 0.0 if reduced.form is None else reduced.form.stiffer(reduced, cut.elements[0], p)
    return max(factor + own, SOFTEST)


def open_joint(place: Place, reduced: ReducedModel, f_max: float, g_rows: list[int]) -> Joint:
    """Opens a place in a basis that holds its own static response; `f_max` in Hz, `g_rows` as for `reduce_model`."""
    return open_joints([place], reduced, f_max, g_rows)


def open_joints(
    places: Sequence[Place],
    reduced: ReducedModel,
    f_max: float,
    g_rows: list[int],
    held: Sequence[FloatArray | None] = (),
) -> Joint:
    """Opens several places at once: their coordinates after each other, named by the first of them, each `held` as it
    says.

    Cuts must not be of one element: its ends would couple.
    """
    own = enlarged(places, reduced, f_max, g_rows)
    rows, compliances = [np.zeros((0, own.r))], [np.zeros(0)]
    cuts: list[tuple[Place, FloatArray]] = []
    loose: list[LooseEnd] = []
    for place in places:
        B = place.w(own.V, own.V_a)
        if place.release is None:
            rows.append(B)
            compliances.append(np.zeros(place.n_w))
            continue
        # Cuts of one member end do not couple (axes of the section), so that S is diagonal and so is the compliance.
        inverse = 1 / np.diag(place.release)
        cuts.append((place, B.T @ (inverse[:, None] * B)))
        loose.append(_loose_end(place, own, inverse[:, None] * B, sum(len(row) for row in rows)))
        rows.append(inverse[:, None] * B)
        compliances.append(inverse)
    # what members lack is known by the modes of the structure as it stands
    if cuts and own.form is not None and len(own.form.weights):
        own = own.form.in_all_shapes(own, [e for place, _ in cuts for e in place.elements])
    for place, taken in cuts:
        own = own if own.form is None else own.form.cut(own, place.elements[0], taken)
    for place, taken in cuts:
        own = own.minus(taken, place.parameter)
    for end in loose:
        own = replace(own, M_fixed=own.M_fixed + end.mass(np.ones(sum(place.n_w for place in places))))
    own = _cut_open(own) if cuts else own
    each_cut = [None if place.release is None else place for place in places for _ in range(place.n_w)]
    joint = Joint(places[0], own, np.vstack(rows), np.concatenate(compliances), None, tuple(each_cut), tuple(loose))
    if all(k is None for k in held):
        return joint
    each = zip(places, held, strict=True)
    return joint.held_by(np.concatenate([np.zeros(place.n_w) if k is None else k for place, k in each]))


def enlarged(places: Sequence[Place], reduced: ReducedModel, f_max: float, g_rows: list[int]) -> ReducedModel:
    """The model in a basis that holds the static response to forces at `places` too."""
    return with_loads(reduced, _patterns(places, reduced), f_max, g_rows)


def _patterns(places: Sequence[Place], reduced: ReducedModel) -> FloatArray:
    """Forces of one (n_a, n_w) along the coordinates of `places`, one after the other."""
    model = reduced.model
    T = model.transformation()
    loads = [np.zeros((model.fe.n_a, 0))]
    for place in places:
        pattern = np.zeros((model.fe.n_a if place.independent else model.fe.n_g, place.n_w))
        for j, (rows, values) in enumerate(zip(place.g_rows, place.g_values, strict=True)):
            pattern[rows, j] = values
        loads.append(pattern if place.independent else np.asarray(T.T @ pattern))
    return np.hstack(loads)


def with_loads(reduced: ReducedModel, loads: FloatArray, f_max: float, g_rows: list[int]) -> ReducedModel:
    """The model in a basis that holds the static responses to `loads` (n_a, m) too."""
    if reduced.model.fe.n_a >= LARGE and not (reduced.extra or reduced.attached):
        wider = extend_model(reduced.bare(), loads)
        return wider if reduced.form is None else reduced.form.on(wider, reduced)
    return dressed(reduce_model(reduced.model, f_max, g_rows, loads), reduced)
