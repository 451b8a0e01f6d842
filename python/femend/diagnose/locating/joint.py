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


@dataclass(frozen=True, eq=False)
class Joint:
    """A place opened for a law: the reduced model without the rigid connection (of a cut), `w` (n_w, r) the coordinates
    d = w q, and the compliance (n_w,) in series with them.

    Modes have damping ratios, and those of a structure that is cut open are not those that were recorded. So a cut may
    be `held` (n_w,) by springs of about the stiffness of its law, which are part of the reduced model; the law acts
    beyond them.
    """

    place: Place
    reduced: ReducedModel
    w: FloatArray
    compliance: FloatArray
    held: FloatArray | None = None

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
        return Joint(self.place, reduced, share[:, None] * self.w, share * self.compliance, np.asarray(k))


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
    for place in places:
        B = place.w(own.V, own.V_a)
        if place.release is None:
            rows.append(B)
            compliances.append(np.zeros(place.n_w))
            continue
        # Cuts of one member end do not couple (axes of the section), so that S is diagonal and so is the compliance.
        inverse = 1 / np.diag(place.release)
        taken = B.T @ (inverse[:, None] * B)
        own = own.minus(taken, place.parameter)
        own = own if own.form is None else own.form.cut(own, place.elements[0], taken)
        rows.append(inverse[:, None] * B)
        compliances.append(inverse)
    joint = Joint(places[0], own, np.vstack(rows), np.concatenate(compliances))
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
