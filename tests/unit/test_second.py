"""Two effects at once: both found and fitted together; forces known from one of them as inputs."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from femend.diagnose.deciding import more_effects
from femend.diagnose.deciding.more_effects import with_further
from femend.diagnose.deciding.outcome import Diagnosis
from femend.diagnose.deciding.plain_error import most_of_noise
from femend.diagnose.fitting.known_force import Known
from femend.diagnose.fitting.terms import relaxing
from femend.diagnose.loads.loads import LoadFinding
from femend.diagnose.locating.joint import open_joint
from femend.diagnose.locating.locate import refitted
from femend.diagnose.locating.pair_screen import best_pairs
from femend.diagnose.naming.advice import FAR_FROM_NOISE
from femend.diagnose.naming.judge import compared_in
from femend.diagnose.naming.ranked import Ranked
from femend.diagnose.settings import Settings
from femend.diagnose.several import second
from femend.diagnose.several.paired import of_those_found
from femend.diagnose.several.pairs import Searched, others
from femend.diagnose.several.second import _carried, _of_law, _search
from femend.diagnose.several.together import at_other_places, shows, unbends
from femend.diagnose.updating.levels import element_depends_on_level
from femend.diagnose.updating.noise import UNDERRATED, louder
from femend.diagnose.updating.update import UpdatedModel
from femend.study.result.study_run import StudyRun

sys.path.insert(0, str(Path(__file__).parents[1]))
from small_study import searched

DASHPOT, CUBIC = 20.0, 2.0e9


@pytest.fixture
def run(dashpot_and_cubic: StudyRun) -> StudyRun:
    return dashpot_and_cubic


def test_two_effects_have_a_finding_each(run: StudyRun) -> None:
    findings = {f["physics"]: f for f in run.result["findings"]}
    assert set(findings) == {"viscous_damper", "cubic_stiffness"}
    assert findings["viscous_damper"]["location"]["nodes"] == [7]
    assert findings["viscous_damper"]["parameters"]["c"]["value"] == pytest.approx(DASHPOT, rel=0.25)
    assert findings["cubic_stiffness"]["location"]["nodes"] == [13]


def test_the_final_model_holds_both(run: StudyRun) -> None:
    held = next(p for p in run.predictions if p.name == "held")
    # noise is one per cent; either law alone leaves several times as much
    assert held.error("final") < 0.03
    assert held.error("final") < 0.3 * held.error("parameters")


def test_what_no_force_explains_is_noise_to_a_single_law(run: StudyRun) -> None:
    d = run.diagnosis
    quiet = [replace(r, noise=r.noise / 3.3) for r in d.problem.records]
    problem = d.problem.on(quiet)
    loud = louder(UpdatedModel(problem, d.reduced, d.null, d.g_rows), refitted(problem, d.located))
    assert loud is not None
    assert set(loud.factor) == {"low", "high"}
    assert max(loud.factor.values()) > UNDERRATED
    for before, after in zip(quiet, loud.start.problem.records, strict=True):
        np.testing.assert_allclose(after.noise, before.noise * np.sqrt(loud.factor[before.name]))
    assert loud.located[0].fit.score == pytest.approx(1.0, abs=0.25)
    assert louder(loud.start, loud.located) is None


def test_laws_are_tried_beside_the_first_where_a_force_explains_what_a_law_has_to(run: StudyRun) -> None:
    d = run.diagnosis
    first = searched(d)
    best, nothing = d.ranked[0], Known((), {r.name: () for r in d.problem.records})
    aside, places = _of_law(first, best, nothing), others(first, best.located.place)
    found = _search(first, aside, places)
    assert found is not None
    assert {found.ranked[0].name, best.name} == {"viscous_damper", "cubic_stiffness"}
    too_much = replace(d.settings, gain_cost=1e6)
    assert _search(replace(first, settings=too_much), aside, places) is None


def test_both_places_are_found_without_a_first_one(run: StudyRun) -> None:
    """The places of both effects come first of all pairs, or nodes next to them that the sensors do not tell apart."""
    d = run.diagnosis
    first = searched(run.diagnosis)
    (other, at), *_ = best_pairs(d.problem, d.reduced, first.places, (), d.null)
    nodes = sorted(n for place in (other, at.place) for n in place.nodes)
    assert len(nodes) == 2
    assert abs(nodes[0] - 7) <= 1
    assert abs(nodes[1] - 13) <= 1
    assert at.fit.score < d.settings.adequate < d.null.score


def test_laws_compared_in_a_window_are_judged_anew_on_whole_records(run: StudyRun) -> None:
    first = searched(run.diagnosis)
    linear = [r for r in first.ranked if r.candidate.joint is not None and not r.candidate.nonlinear][:2]

    def law(r: Ranked) -> tuple[int, str]:
        return id(r.located), r.candidate.name

    given = run.diagnosis.given
    whole = {law(r): r.candidate.chosen for r in compared_in(given, linear, 0.0)}
    windowed = compared_in(given, linear, 3.0 * first.problem.scale())
    again = compared_in(given, windowed, 0.0)
    for before, after in zip(sorted(windowed, key=law), sorted(again, key=law)):
        assert after.candidate.chosen == pytest.approx(whole[law(after)], rel=1e-4)
        assert before.candidate.chosen != pytest.approx(after.candidate.chosen, rel=1e-3)


def test_a_load_that_lost_is_not_what_is_told(run: StudyRun) -> None:
    """It keeps no second effect from being looked for, and the status is that of what is told."""
    lost = cast(LoadFinding, SimpleNamespace(score=1e9))
    found = replace(run.diagnosis, load=lost)
    assert found.best is not None
    assert not found.by_load
    assert replace(found, best=None, verdict="missing-physics").by_load
    assert not replace(found, best=None, verdict="located-not-named").by_load


def test_laws_go_with_a_law_that_was_moved(run: StudyRun) -> None:
    """They stay its alternatives in the order they had; what was tried where it is now does not come before it."""
    first = searched(run.diagnosis)
    at, to = first.ranked[0].located, next(f for f in first.located if f.place is not first.ranked[0].located.place)
    there = replace(first.ranked[0], located=to, name="other")
    carried = _carried([there, *first.ranked], at, to)
    before = [r.name for r in first.ranked if r.located.place is at.place]
    assert [r.name for r in carried if r.located.place is to.place] == before
    assert _carried(first.ranked, at, at) is first.ranked


@pytest.mark.parametrize(("prior", "told"), [(300.0, "anew"), (5.0, "again")])
def test_the_second_law_is_found_anew_where_both_strain_the_model(
    monkeypatch: pytest.MonkeyPatch, prior: float, told: str
) -> None:
    """It was found beside a first law that was not what it is now."""
    place = SimpleNamespace(place="here")

    def law(name: str) -> Ranked:
        return cast(Ranked, SimpleNamespace(name=name, located=place))

    beside = {"two": "again", "again": "anew"}

    def next_to(first: Searched, one: Ranked, given: Known) -> tuple[None, Any]:
        return None, SimpleNamespace(ranked=[law(beside[one.name])], sigma=0.0)

    def together(first: Searched, laws: Sequence[Sequence[Ranked]]) -> Any:
        names = {r.name for every in laws for r in every}
        if "again" not in names:
            return None
        better = 0.0 if "anew" in names else 100.0
        terms = SimpleNamespace(prior=prior if better else 5.0, chosen=1.0)
        return SimpleNamespace(terms=terms, score=better, names=names)

    monkeypatch.setattr(second, "_next_to", next_to)
    monkeypatch.setattr(second, "_together", together)
    first = cast(
        Searched,
        SimpleNamespace(settings=Settings(), sigma=0.0, at=lambda sigma: first, problem=SimpleNamespace(records=[])),
    )
    two = cast(Any, SimpleNamespace(ranked=[law("two")], sigma=0.0))
    aside = cast(Any, SimpleNamespace(known=None))
    found = second._in_turns(first, law("one"), [law("one")], aside, two)
    assert found is not None
    assert ("anew" in cast(Any, found).names) is (told == "anew")


@pytest.mark.parametrize(
    ("chosen", "reached", "explained", "told"),
    [(1.0, 0.0, False, "both"), (9.0, 0.0, False, None), (1.0, 5.0, False, None), (1.0, 0.0, True, None)],
)
def test_a_law_of_the_beginning_may_be_one_of_two_that_explain_more(
    monkeypatch: pytest.MonkeyPatch, chosen: float, reached: float, explained: bool, told: str | None
) -> None:
    """They count where they explain, and more of the records than the law by itself; where one force explains whole
    records, `explained`, nothing acts beside the law."""
    law = SimpleNamespace(candidate=SimpleNamespace(nonlinear=True))
    whole = cast(Searched, SimpleNamespace(name="whole"))
    first = cast(
        Searched,
        SimpleNamespace(
            sigma=5.0, ranked=[law], at=lambda sigma: whole, settings=Settings(), name="window",
            one_force_explains=explained,
        ),
    )  # fmt: skip
    both = SimpleNamespace(terms=SimpleNamespace(chosen=chosen, sigma=reached), name="both")
    monkeypatch.setattr(second, "chosen_where_it_shows", lambda searched: None)
    monkeypatch.setattr(second, "_worth_looking", lambda searched: searched is whole)
    monkeypatch.setattr(second, "_looked_for", lambda searched: both if searched is whole else None)
    found = cast(Any, second.look_further(first))
    assert (None if found is None else found.name) == told


@pytest.mark.parametrize(
    ("one", "two", "laws", "told"),
    [(5.0, 1.0, 1.0, True), (1.2, 1.0, 1.0, False), (5.0, 3.0, 1.0, False), (5.0, 1.0, 3.0, False)],
)
def test_two_effects_hidden_by_each_other_explain_all_where_no_force_at_one_place_does(
    one: float, two: float, laws: float, told: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Free forces at one place leave `one`, at two places `two`, and the laws there `laws`."""
    located = SimpleNamespace(fit=SimpleNamespace(score=one))
    explained = one <= Settings().adequate
    first = cast(Searched, SimpleNamespace(settings=Settings(), located=[located], one_force_explains=explained))
    second_place = SimpleNamespace(fit=SimpleNamespace(score=two))
    both = SimpleNamespace(terms=SimpleNamespace(chosen=laws))
    monkeypatch.setattr(second, "_worth_looking", lambda searched: True)
    monkeypatch.setattr(second, "pair", lambda searched, *, thorough: None if thorough else (second_place, "at"))
    monkeypatch.setattr(second, "_one_of_them_linear", lambda searched, found, at: both)
    assert (second.hidden_by_each_other(first) is both) is told


@pytest.mark.parametrize(
    ("beside", "more", "explained", "chosen", "prior", "told", "asked"),
    [
        (1.0, True, False, 1.4, 200.0, "beside", ["beside"]),
        # beside the force that was read off nothing explains the rest: the model was bent
        (None, True, False, 1.4, 20.0, "pair", ["beside", "pair"]),
        (4.0, True, False, 1.4, 20.0, "pair", ["beside", "pair"]),
        (None, True, True, 1.4, 200.0, "pair", ["beside", "pair"]),
        (None, True, True, 1.0, 220.0, "pair", ["beside", "pair"]),
        # there is no second, or one force explains everything, the model near its priors, or its law does to the noise
        (None, False, False, 1.4, 200.0, None, ["beside"]),
        (None, True, True, 1.4, 20.0, None, ["beside"]),
        (None, True, True, 1.0, 190.0, None, ["beside"]),
    ],
)
def test_two_places_are_looked_for_where_nothing_explains_the_rest_beside_the_best_law(
    monkeypatch: pytest.MonkeyPatch,
    beside: float | None,
    more: bool,
    explained: bool,
    chosen: float,
    prior: float,
    told: str | None,
    asked: list[str],
) -> None:
    """The best law takes most away and leaves little, so that it is one of the two."""
    ranked = [SimpleNamespace(candidate=SimpleNamespace(chosen=chosen, prior=prior))]
    first = cast(Searched, SimpleNamespace(settings=Settings(), one_force_explains=explained, ranked=ranked))
    called: list[str] = []

    def found(name: str, chosen: float | None) -> Any:
        return None if chosen is None else SimpleNamespace(terms=SimpleNamespace(chosen=chosen), name=name)

    def beside_it(searched: Searched) -> tuple[Any, bool]:
        called.append("beside")
        return found("beside", beside), more

    def linear(searched: Searched, scored: object, laws: object) -> Any:
        called.append("pair")
        return found("pair", 1.0)

    monkeypatch.setattr(second, "_one_of_two", lambda searched: True)
    monkeypatch.setattr(second, "_beside_the_best", beside_it)
    monkeypatch.setattr(second, "likely_pairs", lambda searched: [("one", "two")])
    monkeypatch.setattr(second, "_one_of_them_linear", linear)
    monkeypatch.setattr(second, "beyond_two_forces", lambda searched, at: searched)
    out = cast(Any, second._at_two_places(first)[0])
    assert (None if out is None else out.name) == told
    assert called == asked
    # where two places explain no more, what was found stays
    monkeypatch.setattr(second, "likely_pairs", lambda searched: [])
    out = cast(Any, second._at_two_places(first)[0])
    assert (None if out is None else out.name) == (None if beside is None else "beside")
    # nor where they leave so much that one law leaves hardly more
    louder = cast(Searched, SimpleNamespace())
    monkeypatch.setattr(second, "likely_pairs", lambda searched: [("one", "two")])
    monkeypatch.setattr(second, "beyond_two_forces", lambda searched, at: louder)
    monkeypatch.setattr(second, "_worth_looking", lambda searched: searched is not louder)
    out = cast(Any, second._at_two_places(first)[0])
    assert (None if out is None else out.name) == (None if beside is None else "beside")


@pytest.mark.parametrize(("chosen", "prior", "asked"), [(1.0, 230.0, ["two places"]), (1.0, 150.0, []),
                                                        (1.4, 230.0, ["parallel", "two places"])])  # fmt: skip
def test_a_second_effect_is_looked_for_where_the_model_bends_for_a_law_that_leaves_noise(
    monkeypatch: pytest.MonkeyPatch, chosen: float, prior: float, asked: list[str]
) -> None:
    """What makes the model as wrong as no mesh is acts elsewhere: at the law's own place nothing is left to explain."""
    records = [SimpleNamespace(y=np.zeros((4, 8)), frf=None)]
    law = SimpleNamespace(candidate=SimpleNamespace(chosen=chosen, prior=prior))
    first = cast(
        Searched,
        SimpleNamespace(
            settings=Settings(), ranked=[law], n_values=1000.0, floor=0.0, problem=SimpleNamespace(records=records)
        ),
    )
    called: list[str] = []
    for name in ("_both_linear", "_beside"):
        monkeypatch.setattr(second, name, lambda searched: None)
    monkeypatch.setattr(second, "_in_parallel", lambda searched: called.append("parallel"))
    monkeypatch.setattr(second, "_at_two_places", lambda searched: (called.append("two places"), searched))
    monkeypatch.setattr(second, "_one_of_two", lambda searched: True)
    assert second._looked_for(first) is None
    assert called == asked


def test_two_laws_show_by_the_model_that_no_longer_bends() -> None:
    settings = Settings()
    assert unbends(settings, 230.0, 10.0)
    assert not unbends(settings, 230.0, 120.0)
    assert not unbends(settings, 150.0, 10.0)


def test_a_known_force_is_one_more_input(run: StudyRun) -> None:
    place = run.diagnosis.located[0].place
    record = run.records[0]
    force = np.arange(record.n, dtype=float)[None, :]
    known = Known((place,), {record.name: (force,)}).on(record)
    more = len(place.g_rows[0])
    assert known.u.shape == (record.u.shape[0] + more, record.n)
    assert known.in_rows.tolist() == [*record.in_rows, *place.g_rows[0]]
    np.testing.assert_array_equal(known.u[-1], place.g_values[0][-1] * force[0])


def test_a_maxwell_chain_has_the_loss_of_structural_damping() -> None:
    values = relaxing({"k": 3.0, "eta": 0.1}, (10.0, 1000.0))
    omega = np.geomspace(20.0, 500.0, 9)
    kappa = values["k0"] + sum(
        values[f"k{i}"] * 1j * omega * values[f"tau{i}"] / (1 + 1j * omega * values[f"tau{i}"]) for i in (1, 2, 3)
    )
    np.testing.assert_allclose(kappa.imag, 0.3, rtol=0.25)
    assert kappa.real[4] == pytest.approx(3.0, rel=0.01)


def test_laws_found_one_by_one_are_tried_together(run: StudyRun) -> None:
    d = run.diagnosis
    assert d.further is not None
    laws = [next(r for r in tried if r.name == t.candidate.name) for tried, t in zip(
        d.further.laws, d.further.terms.terms, strict=True)]  # fmt: skip
    first = searched(d, laws)
    found = of_those_found(first)
    assert found is not None
    window, (score, terms) = found
    assert window is first  # there is no other
    assert score < min(r.score for r in laws)
    assert {t.candidate.name for t in terms.terms} == {"viscous_damper", "cubic_stiffness"}
    # twice the same place is no pair
    assert of_those_found(replace(first, ranked=[laws[0], laws[0]])) is None


def test_a_cubic_spring_is_another_spring_at_every_level(run: StudyRun) -> None:
    d = run.diagnosis
    (cubic,) = (f for f in d.located if f.place.nodes == (13,) and f.place.text.endswith("Z"))
    joint = open_joint(cubic.place, d.reduced, d.problem.band[1], d.g_rows)
    assert element_depends_on_level(d.problem, joint, cubic.fit.p)


def test_two_laws_have_to_show_in_unseen_data() -> None:
    settings = Settings()
    assert shows(settings, 9.6, 0.96)
    assert not shows(settings, 0.85, 0.83)
    assert not shows(settings, 1.0, 1.2)


def test_a_second_law_is_not_told_where_both_leave_far_more_than_noise(run: StudyRun) -> None:
    both = run.diagnosis
    assert both.further is not None
    one = replace(both, further=None)
    assert one.verdict == "missing-physics"
    start = UpdatedModel(both.problem, both.reduced, both.null, both.g_rows)

    def told(fitted: float, verdict: str = "missing-physics") -> bool:
        assert both.further is not None
        terms = replace(both.further.terms, fitted=fitted)
        found = replace(both.further, terms=terms)
        at = replace(one, verdict=verdict)
        return with_further(at, start, both.located, (), None, lambda first: found).further is not None

    limit = both.settings.second
    assert told(0.9 * limit)
    assert not told(1.1 * limit)
    # where no law is told by itself, two that leave as much may still be located
    assert told(1.1 * limit, "located-not-named")


def test_two_laws_of_which_neither_is_told_alone_have_to_come_near_the_noise(
    run: StudyRun, monkeypatch: pytest.MonkeyPatch
) -> None:
    both = run.diagnosis
    one = replace(both, further=None, verdict="located-not-named")
    start = UpdatedModel(both.problem, both.reduced, both.null, both.g_rows)

    def told(times: float) -> Diagnosis:
        monkeypatch.setattr(more_effects, "most_of_noise", lambda found: times)
        return with_further(one, start, both.located, (), None, lambda first: both.further)

    limit = both.settings.together
    assert told(0.9 * limit).verdict == "missing-physics"
    far = told(1.1 * limit)
    assert far.verdict == "located-not-named"
    assert far.further is both.further
    assert far.advice == FAR_FROM_NOISE
    assert most_of_noise(both) < 1.5


@pytest.mark.parametrize(
    ("n_w", "misfit", "prior", "explains"),
    [
        (1, [1.0, 1.0], 10.0, True),
        (0, [1.4, 1.4], 190.0, True),  # a member's factor
        (1, [2.0, 2.0], 10.0, False),
        # what another effect does at the highest level alone
        (1, [0.8, 2.0], 10.0, False),
        # three rotations of a clamp explain what two effects near it do, a force elsewhere with a model that is bent
        (3, [0.7, 0.7], 1.0, False),
        (1, [1.3, 1.3], 640.0, False),
    ],
)
def test_one_force_explains_where_it_is_one_and_does_not_bend_the_model(
    n_w: int, misfit: list[float], prior: float, explains: bool
) -> None:
    one = SimpleNamespace(place=SimpleNamespace(n_w=n_w), fit=SimpleNamespace(misfit=np.array(misfit), prior=prior))
    several = SimpleNamespace(place=SimpleNamespace(n_w=3), fit=SimpleNamespace(misfit=np.array([0.6]), prior=1.0))
    first = SimpleNamespace(located=[several, one], settings=Settings())
    explained = cast(Any, Searched.one_force_explains)
    assert explained.fget(first) is explains


def test_a_law_is_tried_at_places_that_a_free_force_does_not_tell_from_its_own(
    run: StudyRun, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Another place, as likely and the right one, takes the law over where both laws leave less there."""
    d = run.diagnosis
    first = searched(d)
    costs = {"own": 100.0, "next": 105.0, "far": 100.0 + 2 * d.settings.margin, "third": 101.0, "fourth": 102.0}
    at = {name: SimpleNamespace(place=name, cost=cost) for name, cost in costs.items()}
    ranked = [cast(Ranked, SimpleNamespace(name="clearance", located=one)) for one in at.values()]
    ranked.insert(1, cast(Ranked, SimpleNamespace(name="cubic_stiffness", located=at["next"])))
    own = cast(Any, SimpleNamespace(located=at["own"], candidate=SimpleNamespace(name="clearance")))
    assert [r.located.place for r in at_other_places(first, own, ranked)] == ["next", "third"]

    other = SimpleNamespace(located=SimpleNamespace(place="other", cost=0.0), candidate=SimpleNamespace(name="mass"))
    left = {"own": 50.0, "next": 10.0, "third": 30.0}

    def fitted(searched: Searched, terms: Sequence[Any], p: object) -> Any:
        return left[terms[1].located.place], SimpleNamespace(terms=terms, p=p, n_law=2)

    monkeypatch.setattr(second, "term_of", lambda searched, r: SimpleNamespace(located=r.located, candidate=None))
    monkeypatch.setattr(second, "fitted_together", fitted)
    found = second._at_other_places(first, fitted(first, [other, own], None), [[], ranked])
    assert [t.located.place for t in found[1].terms] == ["other", "next"]


def test_two_linear_laws_are_looked_for_at_further_pairs(monkeypatch: pytest.MonkeyPatch) -> None:
    """A pair that bends the model may leave less than the right one, with no laws behind its forces."""
    first = cast(Searched, SimpleNamespace(settings=Settings(), one_force_explains=False, ranked=[]))
    tried: list[object] = []

    def two_linear(searched: Searched, one: object, at: object) -> object:
        tried.append(one)
        return None if one == "third" else f"laws at {one}"

    def told(searched: Searched, both: object, laws: object) -> Any:
        return SimpleNamespace(terms=SimpleNamespace(chosen=4.0 if both == "laws at second" else 1.0), name=both)

    monkeypatch.setattr(second, "two_linear", two_linear)
    monkeypatch.setattr(second, "_told", told)
    pairs: Any = [("second", "a"), ("third", "b"), ("fourth", "c"), ("fifth", "d")]
    out = cast(Any, second._linear_at_another_pair(first, pairs))
    assert out.name == "laws at fourth"
    assert tried == ["second", "third", "fourth"]
    assert second._linear_at_another_pair(first, []) is None
