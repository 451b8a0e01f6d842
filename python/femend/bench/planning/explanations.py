"""Would the planned test tell explanations apart? Parameters of the study, and physics that its deck lacks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from femend.bench.planning.candidates import support_of, term_of
from femend.bench.planning.places import Targets
from femend.dof import Dof
from femend.errors import PretestError
from femend.estimate.updating import factors_of, modal_system
from femend.model import Model
from femend.model.terms.linear_terms import LinearTerm
from femend.model.terms.unknowns import Unknown, Unknowns
from femend.pretest import (
    Distinction,
    GivingSupport,
    JointTest,
    Plan,
    PlannedTest,
    candidate_matrices,
    dashpot_test,
    distinguish,
    planned_test,
    support_modes,
    with_state,
)
from femend.pretest.distinguish import TOLD
from femend.study.file.bench_settings import PretestSettings

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
    model: Model,
    settings: PretestSettings,
    targets: Targets,
    places: Sequence[Dof],
    rows: Sequence[int],
    *,
    zeta: float = 0.01,
) -> Explanations | None:
    """Whether a test with sensors at `rows` of the `places` tells the explanations of `settings` apart; None where the
    study asks for none.

    All parameters that are no explanation stay free inside their priors, and so does the structure's own damping, about
    `zeta`, where dashpots are told. Linear about the deck, but for supports, which are solved as they would be. Raises
    PretestError for a place that the deck does not have, at which nothing can move, or which it does not hold.
    """
    if not settings.distinguish:
        return None
    names, sizes = [], []
    terms: list[LinearTerm] = []
    dashpots: list[LinearTerm] = []
    supports: list[tuple[GivingSupport, str]] = []
    for i, c in enumerate(settings.distinguish):
        where, size = f"[pretest] distinguish[{i}]", 1.0
        if c.parameter is not None:
            name, size = c.parameter, c.size
        elif c.physics == "compliant_support":
            support = support_of(model, c, where)
            supports.append((support, where))
            name = support.name
        else:
            term = term_of(model, c, where)
            (dashpots if c.physics == "viscous_damper" else terms).append(term)
            name, size = term.name, c.size if c.physics == "joint_stiffness" else 1.0
        names.append(name)
        sizes.append(size)
    still = _of_deck(model, terms, settings, targets, places)
    for support, where in supports:
        still = _with_support(still, model, support, where, settings, targets, places)
    plan: Plan = still
    if dashpots:
        seen = _seen(model, places)
        damped = dashpot_test(
            model, dashpots, seen, targets.modes.n_modes, modes=targets.at.tolist(), zeta=zeta,
            damping_sd=settings.damping_sd, shape_sd=settings.shape_sd,
        )  # fmt: skip
        plan = JointTest(still, damped)
    planned, everywhere = (distinguish(plan, r, names, sizes=sizes) for r in (rows, range(len(places))))
    return Explanations(planned, everywhere)


def _seen(model: Model, places: Sequence[Dof]) -> Any:
    """Motion (n_places, n) of the places in their signed directions over the model's DOFs."""
    signs = np.array([float(d.sign) for d in places])
    return model.transformation().tocsr()[[model.row(d) for d in places]].multiply(signs[:, None])


def _of_deck(
    model: Model, terms: Sequence[LinearTerm], settings: PretestSettings, targets: Targets, places: Sequence[Dof]
) -> PlannedTest:
    """The test of the deck with its parameters and `terms`, each with a factor that is 0 in the deck."""
    if not (terms or model.parameters):
        phi = targets.shapes(places)
        sd, m = settings.shape_sd * np.abs(phi).max(axis=0), targets.at.size
        nothing = np.zeros((0, 0))
        return PlannedTest(
            (), nothing, np.zeros(0), targets.freq, np.zeros((m, 0)), np.zeros((*phi.shape, 0)), phi / sd
        )
    system = modal_system(candidate_matrices(model, terms), _seen(model, places), targets.modes.n_modes)
    own = [Unknown(t.name, 1.0, False, 0.0, 1.0) for t in terms]
    unknowns = Unknowns.of([*factors_of(model.parameters).items, *own])
    return planned_test(
        system, unknowns, modes=targets.at.tolist(), freq_sd=settings.freq_sd, shape_sd=settings.shape_sd
    )


def _with_support(
    plan: PlannedTest,
    model: Model,
    support: GivingSupport,
    where: str,
    settings: PretestSettings,
    targets: Targets,
    places: Sequence[Dof],
) -> PlannedTest:
    """The `plan` with the structure whose `support` gives way as one more unknown."""
    try:
        freq, phi = support_modes(model, support, places, int(targets.at.max()) + 1)
        return with_state(plan, support.name, freq, phi, freq_sd=settings.freq_sd, shape_sd=settings.shape_sd)
    except PretestError as error:
        raise PretestError(f"{where}: {error}") from None
