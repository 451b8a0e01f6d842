"""Places of a large model screened by one linear step: the same order as the fits have, twins taken once."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from femend.demo import STUDY
from femend.diagnose.loads import loads
from femend.diagnose.locating import screen
from femend.diagnose.locating.alike import _answers, _not_beyond, look_alikes
from femend.diagnose.locating.classes import distinct, similarity
from femend.diagnose.locating.dressed import hypothesis_of
from femend.diagnose.locating.linear_costs import _closing, _step, directions, linear_costs, pair_costs
from femend.diagnose.locating.locate import Located, squares_of
from femend.diagnose.locating.screen import is_many, screened
from femend.diagnose.updating.update import UpdatedModel, update_model
from femend.errors import ModelError
from femend.estimate import Problem, fit_records, pair_test
from femend.model import Parameter, Place, find_places, read_model
from femend.study import load_study


@pytest.fixture(scope="module")
def start() -> UpdatedModel:
    study = load_study(STUDY)
    given = [Parameter(p.name, p.property, p.target, p.ids, p.prior_sd, p.bounds) for p in study.parameters]
    model = read_model(study.model_file, units=study.units, parameters=given)
    test = study.read_recordings()
    used = [r for r in test if r.name in ("low", "high")]
    return update_model(model, fit_records(used, model, pair_test(test, model)), 0.01)


@pytest.fixture(scope="module")
def places(start: UpdatedModel) -> list[Place]:
    n_out = min(r.y.shape[0] for r in start.problem.records)
    return [p for p in find_places(start.reduced.model) if p.n_w < n_out]


def test_directions_are_those_of_each_place(start: UpdatedModel, places: list[Place]) -> None:
    W = directions(start.reduced, places)
    own = np.vstack([p.w(start.reduced.V, start.reduced.V_a) for p in places if p.n_w])
    np.testing.assert_allclose(W, own, rtol=1e-12, atol=1e-12 * np.abs(own).max())


def test_a_linear_step_costs_what_a_fit_that_hardly_moves_costs(start: UpdatedModel, places: list[Place]) -> None:
    # from a fit's own minimum a linear step gains next to nothing: only what the force itself makes is left out of the
    # derivatives
    lines = start.problem.thinned(60).untuned()
    sigma = 8 * lines.scale()
    chosen = [p for p in places if p.n_w == 1][::7][:3] + [p for p in places if p.n_w > 1][:1]
    for place in chosen:
        h = hypothesis_of(place, start.reduced)
        p = lines.prior(start.reduced)[0]
        (fit,) = lines.fit([h], [(p, np.zeros(0))], sigma=sigma, iterations=40, tolerance=1e-9)
        assert fit is not None
        W = directions(start.reduced, [place])
        (cost,) = linear_costs(lines, start.reduced, [place], W, fit.p, sigma=sigma)
        whole = sum(line.share * line.Y.size * m for line, m in zip(lines.lines(start.reduced, sigma), fit.misfit))
        assert cost == pytest.approx(fit.prior + whole, rel=0.02)


def test_what_decays_at_the_end_of_a_record_does_not_stand_for_a_force(
    start: UpdatedModel, places: list[Place]
) -> None:
    # far above the noise the decays that a model without the force would have are those of another structure
    lines = start.problem.on([replace(r, noise=r.noise / 30) for r in start.problem.records]).thinned(40)
    place = next(p for p in places if 3 in p.nodes and p.kind == "ground" and p.n_w == 1)
    h = hypothesis_of(place, start.reduced)
    (fit,) = lines.fit([h], [(start.null.p, np.zeros(0))], iterations=30)
    assert fit is not None
    (cost,) = linear_costs(lines, start.reduced, [place], directions(start.reduced, [place]), fit.p)
    (closed,) = lines.fit([h], [(fit.p, np.zeros(0))], sigma=_closing(lines), iterations=0)
    assert closed is not None
    assert cost < 1.1 * (closed.prior + squares_of(lines, closed, _closing(lines)))


def test_pairs_cost_what_each_costs_beside_the_other(start: UpdatedModel, places: list[Place]) -> None:
    lines = start.problem.thinned(20).untuned()
    sigma = 8 * lines.scale()
    some = [p for p in places if p.n_w == 1 and p.kind == "ground"][::6][:4]
    W, p = directions(start.reduced, some), lines.prior(start.reduced)[0]
    costs = pair_costs(lines, start.reduced, W, p, sigma=sigma)
    assert np.isinf(np.diag(costs)).all()
    for i, place in enumerate(some):
        beside = linear_costs(lines, start.reduced, some, W, p, sigma=sigma, beside=[place])
        others = np.arange(len(some)) != i
        np.testing.assert_allclose(costs[i, others], beside[others], rtol=1e-9)
    # two free forces are the same two in either order
    np.testing.assert_array_equal(costs, costs.T)


def test_a_members_linear_step_at_its_best_factor_of_one(start: UpdatedModel, places: list[Place]) -> None:
    # the factor's column is the derivative of the response: a small step of it agrees with a model that has it
    lines = start.problem.thinned(60).untuned()
    sigma = 8 * lines.scale()
    member = next(p for p in places if p.kind == "member")
    p = np.append(start.null.p[: len(start.reduced.names)], start.null.p[-1])
    (linear,) = linear_costs(lines, start.reduced, [member], np.zeros((0, start.reduced.r)), p, sigma=sigma)
    h = hypothesis_of(member, start.reduced)
    at = np.insert(p, len(start.reduced.names), 0.0)
    (fit,) = lines.fit([h], [(at, np.zeros(0))], sigma=sigma, iterations=1, tolerance=0.0)
    assert fit is not None
    (here,) = lines.fit([h], [(at, np.zeros(0))], sigma=sigma, iterations=0)
    assert here is not None
    # one step of the fit cannot gain what a linear model promises, but most of it where it moves little
    before = here.prior + squares_of(lines, here, sigma)
    assert linear < before
    assert fit.prior + squares_of(lines, fit, sigma) == pytest.approx(linear, rel=0.2)


def test_distinct_takes_of_twins_the_preferred(start: UpdatedModel, places: list[Place]) -> None:
    single = [p for p in places if p.n_w == 1 and p.kind == "ground"]
    W = directions(start.reduced, single)
    twice = np.vstack([W, -2 * W])
    order = list(range(len(twice)))
    found = distinct(
        start.problem, start.reduced, twice, order, start.null.p, len(order), 0.999, lambda i: -(i >= len(W))
    )
    # every direction stands there twice, so that none of the first half can lead
    assert found.first
    assert min(found.first) >= len(W)
    assert sorted([*found.first, *(i for t in found.twins for i in t)]) == order
    few = start.problem.on(start.problem.records[:1]).thinned(12)
    matrix = similarity(few, start.reduced, [single[i - len(W)] for i in found.first], start.null.p)
    assert (matrix - np.eye(len(matrix))).max() <= 0.9991


def test_a_screen_keeps_the_right_place(start: UpdatedModel, places: list[Place]) -> None:
    kept = screened(start.problem, start.reduced, places, start.null)
    assert any(3 in p.nodes and p.kind == "ground" for p in kept)  # the bundled case conceals its effect at node 3
    assert [p for p in places if p in kept] == kept
    assert {id(p) for p in places if p.kind == "base"} <= {id(p) for p in kept}
    assert not is_many(places)


def test_few_places_are_left_as_they_are(places: list[Place], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(screen, "MANY", 1)
    assert is_many(places)


def test_look_alikes_are_not_lost_beforehand(start: UpdatedModel, places: list[Place]) -> None:
    single = [p for p in places if p.n_w == 1 and p.kind == "ground"]
    place = next(p for p in single if 3 in p.nodes)
    (fit,) = start.problem.thinned(60).fit([hypothesis_of(place, start.reduced)], [(start.null.p, np.zeros(0))])
    assert fit is not None
    found = Located(place, fit, 0.0)
    others = [p for p in places if p.n_w == 1 and p is not place and p.kind != "base"]

    def not_beyond(problem: Problem, margin: float) -> list[Place]:
        answers, Q = _answers(problem, start.reduced, found)
        return _not_beyond(answers, others, directions(start.reduced, others) @ Q, margin)

    for margin in (3.0, 300.0, 30000.0):
        exact = look_alikes(start.problem, start.reduced, found, places, margin)
        left = not_beyond(start.problem.thinned(250), margin)
        assert {id(a.place) for a in exact} <= {id(p) for p in left}
    assert len(not_beyond(start.problem, 3.0)) < len(others)


def test_a_moved_load_is_among_the_likeliest(start: UpdatedModel) -> None:
    few = start.problem.thinned(60).untuned()
    own = int(few.records[0].in_rows[0])
    wrong = int(few.records[0].out_rows[-1])
    moved = few.on([replace(r, in_rows=np.array([wrong])) for r in few.records])
    moving = np.flatnonzero(np.linalg.norm(start.reduced.V, axis=1) > 0)
    rows = [int(r) for r in moving if r % 6 < 3]
    assert own in [row for row, _ in loads._likeliest(moved, start.reduced, start.null, rows)[:3]]


def test_an_unknown_is_stepped_back_where_the_model_ends_and_held_where_it_ends_both_ways() -> None:
    p = np.array([0.0, 1.0])

    def ends(*sides: float) -> Callable[[np.ndarray], list[np.ndarray]]:
        def answers(at: np.ndarray) -> list[np.ndarray]:
            if np.sign(at[1] - p[1]) in sides:
                raise ModelError("matrix is not positive definite")
            return [at.astype(complex)]

        return answers

    for sides, slope in (((), 1.0), ((1.0,), 1.0), ((-1.0,), 1.0), ((1.0, -1.0), 0.0)):
        step, (there,) = _step(ends(*sides), p, 1)
        np.testing.assert_allclose((there - p) / step, [0.0, slope], atol=1e-9)
