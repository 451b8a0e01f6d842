"""Which law is taken: the simplest that a richer one does not clearly beat, and none for a model at the noise."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from femend.diagnose.deciding.accepted import accepted, as_drawn, bends, stands_out
from femend.diagnose.fitting.candidates import Candidate
from femend.diagnose.naming.calibration import CALIBRATION
from femend.diagnose.naming.ranked import Ranked, tempered
from femend.diagnose.naming.simple_first import simple_first, simplest_linear
from femend.diagnose.settings import Settings
from femend.model import Place
from femend.model.places.held_motion import held_dof
from femend.physics import physics

N_VALUES = 1000.0
HERE, THERE = Place("end", (1,), "RY", ""), Place("end", (2,), "RY", "")


class _At:
    def __init__(self, place: Place) -> None:
        self.place = place


def ranked(name: str, chosen: float, prior: float, place: Place = HERE) -> Ranked:
    entry = physics(name)
    n = len(entry.parameters)
    empty = np.zeros(0)
    candidate = Candidate(entry, name, None, {}, empty, empty, n, prior, chosen, chosen)
    value = N_VALUES * np.log(chosen) + prior + n * np.log(N_VALUES)
    located: Any = _At(place)
    return Ranked(candidate, located, float(value))


def diagnosed(without: Ranked, *laws: Ranked) -> Any:
    """What the verdict is made from: `laws` in order of score, and the updated model `without` any."""
    null = without.candidate
    return SimpleNamespace(
        settings=Settings(), ranked=list(laws), n_values=N_VALUES, null_score=without.score,
        null=SimpleNamespace(score=null.fitted), null_chosen=null,
    )  # fmt: skip


def first(*laws: Ranked) -> list[Ranked]:
    return simplest_linear(sorted(laws, key=lambda r: r.score), Settings())


def names(laws: list[Ranked]) -> list[str]:
    return [r.candidate.name for r in laws]


def test_a_richer_law_has_to_win_clearly() -> None:
    # three per cent less misfit: more than the price of two parameters, not what a law has to bring
    found = first(ranked("viscoelastic", 1.00, 10.0), ranked("viscous_damper", 1.03, 20.0))
    assert names(found) == ["viscous_damper", "viscoelastic"]
    assert found[0].score < found[1].score
    assert tempered(found)[0] > 0.5


def test_a_loss_factor_is_no_simpler_relaxation() -> None:
    # two per cent less misfit and twenty less prior cost, as of a plate at 4 % noise: the score tells them apart
    relaxes, loses = ranked("viscoelastic", 0.98, 10.0), ranked("structural_damping", 1.0, 30.0)
    found = first(relaxes, loses)
    assert names(found) == ["viscoelastic", "structural_damping"]
    assert [r.score for r in found] == [relaxes.score, loses.score]
    assert names(first(ranked("viscoelastic", 0.98, 10.0), ranked("support_stiffness", 1.0, 30.0)))[0] == (
        "support_stiffness"
    )


def test_no_name_is_surer_than_names_have_been() -> None:
    alone, beside = tempered([ranked("clearance", 0.1, 0.0), ranked("cubic_stiffness", 50.0, 0.0)], null_score=1e4)
    assert alone == CALIBRATION.surest < 1.0
    assert beside == pytest.approx(0.0, abs=1e-6)


def test_a_richer_law_that_wins_clearly_is_named() -> None:
    assert names(first(ranked("viscoelastic", 1.0, 10.0), ranked("viscous_damper", 1.2, 10.0)))[0] == "viscoelastic"
    # the same misfit, but the model's unknowns come back to what is known of them
    assert names(first(ranked("viscoelastic", 1.0, 10.0), ranked("viscous_damper", 1.0, 90.0)))[0] == "viscoelastic"


@pytest.mark.parametrize(("null", "prior", "told"), [(1.5, 10.0, True), (1.1, 10.0, False), (1.1, 90.0, True)])
def test_a_model_at_the_noise_lacks_what_its_priors_tell_alone(null: float, prior: float, told: bool) -> None:
    best, without = ranked("viscous_damper", 0.9, 10.0), ranked("viscous_damper", null, prior)
    found = diagnosed(without, best)
    assert accepted(found, best) is told


@pytest.mark.parametrize(
    ("null", "prior", "chosen", "told"),
    [(1.7, 40.0, 1.15, False), (1.7, 40.0, 1.02, True), (4.0, 40.0, 1.6, True), (1.7, 90.0, 1.15, False)],
)
def test_what_is_hardly_above_the_noise_has_to_be_explained_nearly_wholly(
    null: float, prior: float, chosen: float, told: bool
) -> None:
    """Where the model's unknowns left their priors too: a solid without anything missing was told an absorber that
    brought them back."""
    best, without = ranked("viscous_damper", chosen, 10.0), ranked("viscous_damper", null, prior)
    floor = ranked("springpot", 1.0, 10.0)
    known = replace(floor.candidate, reference=1.0)
    found = diagnosed(without, best, replace(floor, candidate=known))
    assert accepted(found, best) is told


@pytest.mark.parametrize(("prior", "no_name"), [(56.0, False), (190.0, False), (1143.0, True)])
def test_a_law_beside_which_the_model_leaves_its_priors_is_no_name(prior: float, no_name: bool) -> None:
    best, without = ranked("added_mass", 1.26, prior), ranked("viscous_damper", 2.4, 3735.0)
    found = diagnosed(without, best)
    assert accepted(found, best)
    assert bends(found, best) is no_name


@pytest.mark.parametrize(
    ("null", "chosen", "told"), [(11.0, 3.4, True), (11.0, 7.0, False), (3.0, 1.4, False), (1000.0, 20.0, True)]
)
def test_a_law_that_takes_most_of_a_large_misfit_is_told_as_the_likeliest(
    null: float, chosen: float, told: bool
) -> None:
    best, without = ranked("tuned_absorber", chosen, 20.0), ranked("viscous_damper", null, 80.0)
    found = diagnosed(without, best)
    assert stands_out(found, best) is told


def test_a_nonlinear_law_that_is_better_stays_first() -> None:
    best = ranked("cubic_stiffness", 0.7, 10.0)
    found = first(best, ranked("viscoelastic", 1.00, 10.0), ranked("viscous_damper", 1.03, 20.0))
    assert names(found) == ["cubic_stiffness", "viscous_damper", "viscoelastic"]


@pytest.mark.parametrize("other", [("viscous_damper", THERE), ("quadratic_damping", HERE)])
def test_only_linear_laws_at_the_same_place_are_simpler(other: tuple[str, Place]) -> None:
    name, place = other
    assert names(first(ranked("viscoelastic", 1.0, 10.0), ranked(name, 1.03, 10.0, place)))[0] == "viscoelastic"


def test_springs_under_a_clamp_have_to_win_clearly_against_one_spring_there() -> None:
    cut = Place("clamp", (1,), "RY", "ground", release=np.ones((1, 1)))
    both = Place("clamp", (1,), "", "ground", springs=((held_dof(2), 1.0), (held_dof(4), 1.0)))
    one, other = ranked("compliant_support", 1.03, 10.0, cut), ranked("tuned_absorber", 1.0, 5.0, both)
    assert names(first(one, other))[0] == "compliant_support"
    assert names(first(replace(one, score=one.score + 200.0), ranked("tuned_absorber", 0.8, 5.0, both)))[0] != one.name
    elsewhere = Place("clamp", (2,), "", "ground", springs=both.springs)
    assert names(first(one, ranked("tuned_absorber", 0.97, 5.0, elsewhere)))[0] == "tuned_absorber"


@pytest.mark.parametrize(
    ("n", "left", "told"),
    [(5.0, 1.10, "coulomb_friction"), (5.0, 1.30, "bouc_wen"), (1.5, 1.10, "bouc_wen")],
)
def test_a_loop_with_a_knee_nearly_sharp_is_friction_where_that_leaves_hardly_more(
    n: float, left: float, told: str
) -> None:
    loop, friction = ranked("bouc_wen", 1.0, 10.0), ranked("coulomb_friction", left, 10.0)
    loop = replace(loop, candidate=replace(loop.candidate, values={"n": n}), score=friction.score - 100.0)
    assert names(simple_first([loop, friction], Settings()))[0] == told


@pytest.mark.parametrize(
    ("factor", "sd", "fitted", "drawn"),
    [
        (0.986, 0.3, 1.0, True),
        (0.8, 0.05, 1.0, False),
        (0.8, 0.06, 9.0, True),
        # a broken rod, and one grown rigid: how little is left of what it was the recordings do not tell, nor have to
        (0.0008, 5.0, 1.0, False),
        (1250.0, 5.0, 1.0, False),
    ],
)
def test_a_part_whose_interval_holds_the_deck_s_value_is_as_drawn(
    factor: float, sd: float, fitted: float, drawn: bool
) -> None:
    """A control whose recordings follow their force in part was told a joint of 0.986 +- 0.30 times its stiffness."""
    law = ranked("viscous_damper", 1.0, 10.0).candidate
    part = replace(
        law,
        physics=None,
        name="joint_stiffness",
        values={"factor": factor},
        covariance=np.array([[sd**2]]),
        fitted=fitted,
    )
    assert as_drawn(part) is drawn
    assert not as_drawn(replace(part, physics=physics("viscous_damper")))


def test_a_spring_goes_before_a_bedding_about_it_that_hardly_leaves_less() -> None:
    at, elsewhere = (Place("ground", (node,), "Z", "ground") for node in (9, 3))
    bed = Place("bed", (8, 10), "Z", "ground", bed=tuple((n, np.array([6 * n + 2]), np.ones(1)) for n in (8, 9, 10)))
    spring, beside = (ranked("support_stiffness", 1.02, 20.0, place) for place in (at, elsewhere))
    hardly, clearly = (ranked("support_stiffness", chosen, 20.0, bed) for chosen in (1.0, 0.9))
    assert first(hardly, spring)[0] is not hardly
    assert first(hardly, beside)[0] is hardly
    assert first(clearly, spring)[0] is clearly
