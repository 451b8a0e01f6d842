"""Would the planned test tell explanations apart? Parameters of the study, and physics that its deck lacks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from femend.bench.places import Targets
from femend.dof import Dof
from femend.errors import PretestError
from femend.estimate.updating import factors_of, modal_system
from femend.model import Model
from femend.model.linear_terms import LinearTerm, point_mass, point_spring, weaker_element
from femend.model.unknowns import Unknown, Unknowns
from femend.pretest import Distinction, candidate_matrices, distinguish, planned_test
from femend.pretest.distinguish import TOLD
from femend.study.bench_settings import CandidateSettings, PretestSettings

__all__ = ["Explanations", "told_apart"]


@dataclass(frozen=True, eq=False)
class Explanations:
    """Every ordered pair of explanations at the sensors of the plan (`planned`), and the same pairs with a sensor at
    every place that was allowed (`everywhere`)."""

    planned: tuple[Distinction, ...]
    everywhere: tuple[Distinction, ...]

    def as_list(self) -> list[dict[str, Any]]:
        """What pretest.json holds of them; distances are in deviations of what the test tells."""
        return [
            {
                "truth": d.truth,
                "rival": d.rival,
                "distance": d.distance,
                "detected": d.detected,
                "told": d.told,
                "distance_with_all_places": every.distance,
                "told_with_all_places": every.told,
            }
            for d, every in zip(self.planned, self.everywhere, strict=True)
        ]

    def advice(self) -> list[str]:
        """What the test would not show, and what it would take for something else."""
        said = []
        hidden = {d.truth: d for d in self.planned if d.detected < TOLD}
        for d in hidden.values():
            said.append(
                f"the test would not show {d.truth} at its size ({d.detected:.1f} deviations, {TOLD:g} are asked)"
            )
        for d, every in zip(self.planned, self.everywhere, strict=True):
            if d.told or d.truth in hidden:
                continue
            more = (
                "sensors at more places would tell"
                if every.told
                else "nor would sensors at all places tell, so measure more modes, or better"
            )
            said.append(f"{d.truth} would pass for {d.rival} ({d.distance:.1f} deviations, {TOLD:g} are asked), {more}")
        return said


def told_apart(
    model: Model, settings: PretestSettings, targets: Targets, places: Sequence[Dof], rows: Sequence[int]
) -> Explanations | None:
    """Whether a test with sensors at `rows` of the `places` tells the explanations of `settings` apart; None where the
    study asks for none.

    All parameters that are no explanation stay free inside their priors. Linear about the deck. Raises PretestError for
    a place that the deck does not have, or at which nothing can move.
    """
    if not settings.distinguish:
        return None
    terms = {c: _term(model, c, i) for i, c in enumerate(settings.distinguish) if c.parameter is None}
    matrices = candidate_matrices(model, list(terms.values()))
    T = model.transformation().tocsr()
    signs = np.array([float(d.sign) for d in places])
    seen = T[[model.row(d) for d in places]].multiply(signs[:, None])
    system = modal_system(matrices, seen, targets.modes.n_modes)
    own = [Unknown(t.name, 1.0, False, 0.0, 1.0) for t in terms.values()]
    unknowns = Unknowns.of([*factors_of(model.parameters).items, *own])
    plan = planned_test(
        system, unknowns, modes=targets.at.tolist(), freq_sd=settings.freq_sd, shape_sd=settings.shape_sd
    )
    names = [c.parameter or terms[c].name for c in settings.distinguish]
    sizes = [c.size if c.parameter or c.physics == "joint_stiffness" else 1.0 for c in settings.distinguish]
    planned, everywhere = (distinguish(plan, r, names, sizes=sizes) for r in (rows, range(len(places))))
    return Explanations(planned, everywhere)


def _term(model: Model, c: CandidateSettings, number: int) -> LinearTerm:
    """The physics of an entry, whose `number` in the list is told in errors."""
    where = f"[pretest] distinguish[{number}]"
    if c.physics == "joint_stiffness":
        assert c.element is not None
        known = {int(e) for e, _, _ in model.fe.elements()}
        if c.element not in known:
            raise PretestError(f"{where}: element {c.element} is not among the {len(known)} elements of the model")
        return weaker_element(model, c.element)
    assert c.node is not None
    if c.node not in set(model.node_ids[~model.is_scalar].tolist()):
        raise PretestError(f"{where}: node {c.node} is not among the {len(model.node_ids)} nodes of the model")
    made = (
        point_mass(model, c.node, c.size)
        if c.physics == "added_mass"
        else point_spring(model, c.node, c.component, c.size)
    )
    T = model.transformation()
    if not any(abs(T.T @ part.matrix @ T).sum() for part in made.parts):
        raise PretestError(f"{where}: {made.name} acts on nothing that moves, since the deck holds its DOFs")
    return made
