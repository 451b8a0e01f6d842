"""What sensors may pick up of motion across them and be off by of their own, and what is said of them and of a mesh."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from femend.data import Channel
from femend.diagnose.fitting.known_force import forces_beside
from femend.diagnose.locating.dressed import hypothesis_of
from femend.diagnose.locating.locate import locate
from femend.diagnose.locating.split import split_records
from femend.diagnose.naming.judge import Given
from femend.diagnose.naming.laws_at import linear_at, masses_from_afar
from femend.diagnose.recordings import crossing
from femend.diagnose.settings import Settings
from femend.diagnose.updating import update
from femend.diagnose.updating.update import _updated, modelled, update_model
from femend.dof import Dof
from femend.estimate import FitRecord, Hypothesis, Problem, crossed, noise_floor, with_across
from femend.estimate.frf import FrfLines
from femend.estimate.picked_up import ACROSS_SD, GAIN_SD, MOST, Across, PickedUp
from femend.estimate.power import smoothed
from femend.model import MeshError, Place, ReducedModel, affordable_refinement, read_model, reduce_model
from femend.model.mesh.form_errors import basis_modes
from femend.numerals import plain
from femend.study.result.predictions import Prediction
from femend.study.result.result import _mesh_off
from femend.study.result.sensors_off import _deviation, readings, sensors_off

Array = NDArray[np.float64]
BAND, RATE, N = (5.0, 200.0), 1024.0, 2048
Y, Z = 1, 2
AXES = (("Y", Y), ("Z", Z))


@pytest.fixture
def reduced(tmp_path: Path) -> ReducedModel:
    """A cantilever whose tip mass is a little off its axis, so that Y and Z are coupled by little."""
    lines = ["SOL 103", "CEND", "SPC = 1", "BEGIN BULK", "MAT1,1,7.+10,,0.33,2700.", "PBAR,1,1,4.-4,3.-9,1.2-8,8.-9"]
    lines += [f"GRID,{i + 1},,{0.1 * i},0.,0." for i in range(7)]
    lines += [f"CBAR,{i},1,{i},{i + 1},0.,1.,0." for i in range(1, 7)]
    lines += ["SPC1,1,123456,1", "CONM2,90,7,,0.2,0.,0.0002,0.0002", "ENDDATA", ""]
    path = tmp_path / "m.bdf"
    path.write_text("\n".join(lines))
    model = read_model(path)
    return reduce_model(model, BAND[1], [6 * (n - 1) + c for n in range(2, 8) for c in (Y, Z)])


def structure(reduced: ReducedModel) -> ReducedModel:
    """The same cantilever without what its beams leave out of their waves, which no structure has."""
    finer = affordable_refinement(reduced.model, BAND[1])
    assert finer is not None
    return reduce_model(finer, BAND[1], [6 * (n - 1) + c for n in range(2, 8) for c in (Y, Z)])


def recorded(reduced: ReducedModel, sensors: list[tuple[int, int]], force: tuple[int, int]) -> FitRecord:
    """Accelerations at `sensors` (node, axis) under a random force at one, one damping ratio."""
    K, M = reduced.as_drawn()
    rng = np.random.default_rng(0)
    freq = np.fft.rfftfreq(N, 1 / RATE)
    U = np.where((freq > BAND[0]) & (freq < BAND[1]), rng.standard_normal((2, freq.size)).T @ [1, 1j], 0)
    rows, into = (np.array([6 * (n - 1) + c for n, c in at]) for at in (sensors, [force]))
    Y = np.zeros((len(sensors), freq.size), dtype=complex)
    for k in np.flatnonzero(U):
        s = 2j * np.pi * freq[k]
        x = np.linalg.solve(K * (1 + 0.02j) + s**2 * M, reduced.rows(into)[0] * U[k])
        Y[:, k] = s**2 * (reduced.rows(rows) @ x)
    u, y = np.fft.irfft(U, N)[None], np.fft.irfft(Y, N)
    return FitRecord("r", u, y, 1 / RATE, into, rows, np.ones(1), np.ones(len(rows)), 0.01 * y.std(axis=1))


SENSORS = [(7, Y), (5, Y), (4, Z), (3, Y), (7, Z)]


def modal(reduced: ReducedModel) -> tuple[Array, Array, Array]:
    """Modes of the drawn model with the damping that the records have."""
    omega, Q = basis_modes(reduced)
    return omega, np.full(len(omega), 0.01), Q


def heavier(reduced: ReducedModel, sensors: list[tuple[int, int]], force: tuple[int, int]) -> FitRecord:
    """What they record of the same cantilever with a mass at its tip that the model lacks."""
    tip = reduced.rows(np.array([36, 37, 38]))
    K, M = reduced.as_drawn()
    heavy = SimpleNamespace(as_drawn=lambda: (K, M + 0.1 * tip.T @ tip), rows=reduced.rows)
    return recorded(heavy, sensors, force)  # type: ignore[arg-type]


def test_what_moves_across_a_sensor_is_what_one_along_that_axis_records(reduced: ReducedModel) -> None:
    record = recorded(reduced, SENSORS, (7, Y))
    (known,) = with_across([record], reduced, BAND, modal(reduced))
    other = recorded(reduced, [(node, Z if axis == Y else Y) for node, axis in SENSORS], (7, Y))
    assert known.across is not None
    # of the axes after a sensor's own, in turn: of Y these are Z and X, of Z X and Y
    turns = [0 if axis == Y else 1 for _, axis in SENSORS]
    late = slice(N // 4, None)  # the record is a steady state, the prediction begins from rest
    for s, turn in enumerate(turns):
        error = known.across[turn, s, late] - other.y[s, late]
        assert error.std() < 0.15 * other.y[s].std()
        assert known.across[1 - turn, s].std() < 1e-4 * record.y[0].std()


def test_how_much_moves_across_a_sensor_is_the_least_of_all_records(reduced: ReducedModel) -> None:
    strong, weak = recorded(reduced, SENSORS, (7, Y)), recorded(reduced, SENSORS, (7, Z))
    known = with_across([strong, weak], reduced, BAND, modal(reduced))
    told = crossed(known[:1], BAND)
    assert sorted(told) == [13, 20, 25, 37, 38]
    # that many times as much as the Y of the same node moves
    assert told[38] == pytest.approx(strong.y[0].std() / strong.y[4].std(), rel=0.2)
    assert told[37] < 1 < 50 < told[20]
    assert all(ratio < 1 for ratio in crossed(known, BAND).values())
    # where sensors are believed nothing is known of it
    assert crossed([strong], BAND) == crossed([known[0], weak], BAND) == {}


def test_without_a_recorded_force_nothing_is_known_of_motion_across(reduced: ReducedModel) -> None:
    record = recorded(reduced, SENSORS, (7, Y))
    unknown = replace(record, u=record.u[:0], in_rows=record.in_rows[:0], in_signs=record.in_signs[:0])
    assert with_across([unknown], reduced, BAND, modal(reduced))[0].across is None
    assert crossed([unknown], BAND) == {}


def test_of_sensors_that_can_pick_up_hardly_anything_calibration_alone_is_in_doubt(reduced: ReducedModel) -> None:
    record = recorded(reduced, [(7, Y), (5, Y), (3, Y)], (7, Y))
    (known,) = with_across([record], reduced, BAND, modal(reduced))
    assert crossed([known], BAND) == {}
    (line,) = Problem([known], BAND, 0.01, 2).lines(reduced)
    assert line.picked_up is not None
    assert [sensor for sensor, _, _ in line.picked_up.bases] == [0, 1, 2]
    # one column each, of the motion along it, which is what it recorded but for how a record ends
    (believed,) = Problem([record], BAND, 0.01, 2).lines(reduced)
    for s, U, _ in line.picked_up.bases:
        weighted = line.Y[:, s] * line.weight[:, s]
        along = np.concatenate([weighted.real, weighted.imag]) / np.linalg.norm(weighted)
        assert U.shape[1] == 1
        assert abs(U[:, 0] @ along) > 0.99
    # a tenth of it is not believed
    assert (line.weight <= believed.weight).all()
    assert (line.weight < 0.99 * believed.weight).any()
    floor = np.sqrt(noise_floor(record, BAND) ** 2 + GAIN_SD**2)
    assert noise_floor(known, BAND) == pytest.approx(floor, rel=1e-3)


def of_frf(record: FitRecord) -> FitRecord:
    """The same as a column of an FRF."""
    freq = np.fft.rfftfreq(N, 1 / RATE)
    inside = (freq > BAND[0]) & (freq < BAND[1])
    H = (np.fft.rfft(record.y)[:, inside] / np.fft.rfft(record.u)[0, inside]).T
    lines = FrfLines(freq[inside], H, 0.01 * np.abs(H), float(freq[1]))
    size = np.abs(H).T
    return replace(record, u=np.ones((1, len(H))), y=size, dt=0.0, frf=lines, noise=0.01 * size.mean(axis=1))


def test_motion_across_an_frfs_sensors_is_that_of_a_force_of_one(reduced: ReducedModel) -> None:
    frf = of_frf(recorded(reduced, SENSORS, (7, Y)))
    (known,) = with_across([frf], reduced, BAND, modal(reduced))
    other = of_frf(recorded(reduced, [(7, Z), (5, Z), (4, Y), (3, Z), (7, Y)], (7, Y)))
    assert known.across is not None
    assert other.frf is not None
    assert np.abs(known.across[1, 4] - other.frf.H[:, 4]).max() < 0.02 * np.abs(other.frf.H[:, 4]).max()
    assert sorted(row for row, ratio in crossed([known], BAND).items() if ratio > 50) == [20, 38]
    assert noise_floor(known, BAND) > noise_floor(frf, BAND)
    (line,) = Problem([known], BAND, 0.01, 2, limit=40).lines(reduced)
    assert line.picked_up is not None
    assert line.left(line.Y).shape == (len(line.freq), 5)
    assert len(line.freq) < 60


def test_the_best_shares_of_motion_across_are_taken_out_with_their_prior() -> None:
    rng = np.random.default_rng(3)
    k, share = 40, 0.3

    def drawn(*shape: int) -> Any:
        return rng.standard_normal(shape) + 1j * rng.standard_normal(shape)

    sensor, motion, weight = np.array([1, 0, 1]), 60 * drawn(k, 3), 1 + rng.random((k, 2))
    e = drawn(k, 2)
    e[:, 1] += 0.02 * motion[:, 0]
    left = PickedUp.of(Across(sensor, motion), weight, share).taken_out(e * weight)
    columns = np.zeros((k, 2, 3), dtype=complex)
    for c, s in enumerate(sensor):
        columns[:, s, c] = motion[:, c] * weight[:, s]
    C = columns.reshape(-1, 3)
    A = np.vstack([C.real, C.imag])
    b = np.concatenate([(e * weight).real.ravel(), (e * weight).imag.ravel()])
    H = share * A.T @ A + np.eye(3) / ACROSS_SD**2
    shares = np.linalg.solve(H, share * A.T @ b)
    best = share * ((b - A @ shares) ** 2).sum() + (shares**2).sum() / ACROSS_SD**2
    assert share * (np.abs(left) ** 2).sum() == pytest.approx(best, rel=1e-10)
    assert best < 0.9 * share * (b**2).sum()
    # many residuals at once, and twice the residual is twice as much
    both = PickedUp.of(Across(sensor, motion), weight, share).taken_out(np.stack([e * weight, 2 * e * weight], axis=-1))
    np.testing.assert_allclose(both[..., 1], 2 * left, rtol=1e-12)


def test_calibration_takes_nothing_of_what_the_model_does_not_explain(reduced: ReducedModel) -> None:
    # a share of what was recorded would go along with it, and with what is left of it as well
    record = recorded(reduced, [(7, Y), (5, Y), (3, Y)], (7, Y))
    more = 0.5 * record.y.std(axis=1)[:, None] * np.random.default_rng(4).standard_normal(record.y.shape)
    known, plain_one = (
        Problem(with_across([r], reduced, BAND, modal(reduced)), BAND, 0.01, 2).lines(reduced)[0]
        for r in (replace(record, y=record.y + more), record)
    )
    assert known.picked_up is not None
    for s, U, _ in known.picked_up.bases:
        left = (known.Y - plain_one.Y)[:, s] * known.weight[:, s]
        e = np.concatenate([left.real, left.imag])
        whole = known.Y[:, s] * known.weight[:, s]
        share = np.linalg.norm(e) / np.linalg.norm(whole)
        assert share > 0.1
        assert abs(U[:, 0] @ e) < 0.5 * share * np.linalg.norm(e)


def test_what_has_no_column_though_it_shows_counts_as_noise() -> None:
    rng = np.random.default_rng(5)
    n_out, k = MOST, 20
    spectra = 1000 * (rng.standard_normal((3, n_out, k)) + 1j * rng.standard_normal((3, n_out, k)))
    spectra[1] *= 0.2  # the second axis of every sensor is the one that tells less
    own = 0.1 * spectra[2]
    spectra[2] = 0
    variance, index = np.ones((n_out, k)), np.arange(0, k, 2)
    raised, across = Across.of(spectra, variance, index, 0.1)
    assert across is not None
    assert sorted(across.sensor.tolist()) == list(range(MOST))
    np.testing.assert_array_equal(across.motion, spectra[0][across.sensor][:, index].T)
    power = [smoothed(np.abs(one) ** 2) for one in spectra]
    np.testing.assert_allclose(raised, 1 + ACROSS_SD**2 * (0.01 * power[0] + power[1]))
    # of next to nothing there is no column, and next to no noise
    raised, across = Across.of(1e-4 * spectra, variance, index, 0.1)
    assert across is None
    np.testing.assert_allclose(raised, 1.0, atol=1e-4)
    # of its own motion a sensor is off by twice as much
    raised, across = Across.of(np.stack([0 * own, 0 * own, own]), variance, index, 0.1)
    assert across is not None
    np.testing.assert_allclose(across.motion, GAIN_SD / ACROSS_SD * own[across.sensor][:, index].T)
    np.testing.assert_allclose(raised, 1 + 0.01 * GAIN_SD**2 * smoothed(np.abs(own) ** 2))


def test_the_core_takes_out_the_same_shares_as_the_lines(reduced: ReducedModel) -> None:
    record = recorded(reduced, SENSORS, (7, Y))
    (known,) = with_across([record], reduced, BAND, modal(reduced))
    assert known.across is not None
    # a little of what moves across it in every sensor, as if mounted a little off
    off = of_frf(replace(known, y=known.y + 0.01 * known.across[0] - 0.005 * known.across[1]))
    # an FRF's lines have no free decays, so that the best shares are all that is eliminated
    (frf,) = with_across([off], reduced, BAND, modal(reduced))
    hypothesis = Hypothesis(reduced, np.zeros((0, reduced.r)))
    alone = Problem([frf], BAND, 0.01, 2)
    (fit,) = alone.fit([hypothesis], iterations=0)
    (line,) = alone.lines(reduced)
    assert fit is not None
    assert line.picked_up is not None
    omega, zeta, Q, _ = alone.system(reduced).modal(fit.p)
    s = line.s[:, None]
    q = s**2 / (s**2 + 2 * zeta * omega * s + omega**2) * (line.U @ (reduced.rows(frf.in_rows) @ Q))
    e = line.Y - q @ (reduced.rows(frf.out_rows) @ Q).T
    left = line.left(e)
    assert fit.cost - fit.prior == pytest.approx(line.share * (np.abs(left) ** 2).sum(), rel=1e-9)
    assert (np.abs(left) ** 2).sum() < 0.5 * (np.abs(e * line.weight) ** 2).sum()


def mounted_off(reduced: ReducedModel, share: float) -> FitRecord:
    """A record whose sensors hold a share of the motion across them, and noise."""
    record = recorded(reduced, SENSORS, (7, Y))
    other = recorded(reduced, [(node, Z if axis == Y else Y) for node, axis in SENSORS], (7, Y))
    y = record.y + share * other.y
    noise = 0.02 * y.std(axis=1)
    y = y + noise[:, None] * np.random.default_rng(2).standard_normal(y.shape)
    return replace(record, y=y, noise=noise)


def told_of(start: update.UpdatedModel) -> Any:
    """A diagnosis that adds nothing to an updated model, as far as sensors are told of it."""
    return SimpleNamespace(reduced=start.reduced, problem=start.problem, misfit=start.null.score)


def test_sensors_mounted_off_are_met_with_their_shares_and_told(
    reduced: ReducedModel, monkeypatch: pytest.MonkeyPatch
) -> None:
    # those across which it moves fifty times as much would be left out
    monkeypatch.setattr(update, "without_crossed", lambda records, *given: records)
    model, records = reduced.model, [mounted_off(reduced, 0.005)]
    plain_one = _updated(*modelled(model, records, 0.01))
    assert plain_one.null.score > 5
    start = update_model(model, records, 0.01)
    assert start.null.score < 1.2
    (record,) = start.problem.records
    assert record.across is not None
    (said,) = sensors_off(told_of(start))
    found = crossed([record], start.problem.band)
    assert said.startswith("the recordings are explained where sensors may be off by some 2 % (calibration")
    assert "hold some 1 % of the motion across them" in said
    most = sorted(found, key=lambda row: -found[row])[:3]
    assert set(most[:2]) == {20, 38}
    named = [f"node {row // 6 + 1} {'XYZ'[row % 6]} ({plain(found[row], 2)} times what goes along it)" for row in most]
    assert said.endswith("Motion across is largest at " + ", ".join(named))
    # it is as it is: looked into once more it stays so
    assert start.crossing is None


def test_sensors_that_the_model_explains_are_believed(reduced: ReducedModel, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(update, "without_crossed", lambda records, *given: records)
    start = update_model(reduced.model, [mounted_off(reduced, 0.0)], 0.01)
    assert start.null.score < 1.2
    assert all(r.across is None for r in start.problem.records)
    assert sensors_off(told_of(start)) == []


def test_sensors_off_in_calibration_are_met_and_told(reduced: ReducedModel) -> None:
    record = recorded(structure(reduced), [(7, Y), (5, Y), (4, Y), (3, Y)], (7, Y))
    y = record.y * np.array([1.03, 0.98, 1.01, 0.96])[:, None]
    noise = 0.01 * y.std(axis=1)
    y = y + noise[:, None] * np.random.default_rng(2).standard_normal(y.shape)
    records = [replace(record, y=y, noise=noise)]
    believed = _updated(*modelled(reduced.model, records, 0.01))
    assert believed.null.score > 2
    start = update_model(reduced.model, records, 0.01)
    assert start.null.score < 1.2
    (said,) = sensors_off(told_of(start))
    assert said.endswith("noise floors hold as much")


@pytest.mark.parametrize(
    ("left", "prior", "with_shares", "taken"),
    [
        (1.0, 20.0, 0.9, False),
        (6.0, 20.0, 2.9, True),  # less than half
        (1.0, 500.0, 0.4, True),
        (6.0, 20.0, 4.0, False),
        (1.3, 20.0, 1.1, True),  # noise alone, and more without
        (1.0, 500.0, 0.8, False),  # noise alone, as without
    ],
)
def test_sensors_are_believed_where_a_force_explains_or_shares_make_no_great_difference(
    monkeypatch: pytest.MonkeyPatch, left: float, prior: float, with_shares: float, taken: bool
) -> None:
    def at(score: float) -> Any:
        return SimpleNamespace(fit=SimpleNamespace(score=score, prior=prior, cost=1000 * score))

    other = SimpleNamespace(problem=None, reduced=None, null=None)
    start: Any = SimpleNamespace(null=None, crossing=other)
    monkeypatch.setattr(crossing, "locate", lambda *given: [at(with_shares)])
    monkeypatch.setattr(crossing, "_moved_by_the_best", lambda *given: given)
    monkeypatch.setattr(crossing, "_in_all_directions", lambda *given: [])
    monkeypatch.setattr(crossing, "_on_springs", lambda *given: [])
    monkeypatch.setattr(crossing, "_may_come_near", lambda *given: True)
    monkeypatch.setattr(crossing, "_two_explain", lambda *given: False)
    found, located = crossing.as_sensors_are(start, [at(left)], [])
    assert (found is other) == taken
    assert located[0].fit.score == (with_shares if taken else left)


@pytest.mark.parametrize(("on_springs", "taken"), [(1.0, False), (3.0, False), (5.9, True)])
def test_sensors_are_believed_where_springs_in_all_directions_of_a_support_explain_about_as_much(
    monkeypatch: pytest.MonkeyPatch, on_springs: float, taken: bool
) -> None:
    """A foot that is soft in Z, and tilts: of one force in Z shares of 2 % make up for its tilting."""

    def at(score: float) -> Any:
        return SimpleNamespace(fit=SimpleNamespace(score=score, prior=20.0, cost=1000 * score))

    other = SimpleNamespace(problem=None, reduced=None, null=None)
    start: Any = SimpleNamespace(null=None, crossing=other)
    monkeypatch.setattr(crossing, "locate", lambda *given: [at(2.8)])
    monkeypatch.setattr(crossing, "_moved_by_the_best", lambda *given: given)
    monkeypatch.setattr(crossing, "_in_all_directions", lambda *given: [])
    monkeypatch.setattr(crossing, "_on_springs", lambda *given: [at(on_springs).fit])
    monkeypatch.setattr(crossing, "_may_come_near", lambda *given: True)
    monkeypatch.setattr(crossing, "_two_explain", lambda *given: False)
    found, _ = crossing.as_sensors_are(start, [at(6.0)], [])
    assert (found is other) == taken


@pytest.mark.parametrize(
    ("score", "prior", "cost", "taken"),
    [
        (0.8, 20.0, 2300.0, False),
        (0.8, 20.0, 2990.0, True),  # hardly less than with shares
        (1.5, 20.0, 2300.0, True),
        (0.8, 200.0, 2300.0, True),  # of a model that bends for it
    ],
)
def test_sensors_are_believed_where_two_forces_explain_more_than_one_with_shares(
    monkeypatch: pytest.MonkeyPatch, score: float, prior: float, cost: float, taken: bool
) -> None:
    """Joint softness beside friction: of one force there shares of 2 % make up for the other."""
    places = [Place("ground", (node,), "Y", "ground", (np.array([6 * node + 1]),), (np.ones(1),)) for node in (4, 7)]

    def at(place: Place, score: float, prior: float, cost: float) -> Any:
        return SimpleNamespace(place=place, fit=SimpleNamespace(score=score, prior=prior, cost=cost), cost=cost)

    with_shares, alone = at(places[0], 0.9, 300.0, 3000.0), at(places[0], 2.1, 3000.0, 9500.0)
    asked: list[Any] = []

    def located(problem: str, reduced: None, among: list[Place], null: object, beside: tuple[Place, ...] = ()) -> Any:
        if problem == "shares":
            return [with_shares]
        asked.append((among, beside))
        return [at(places[1], score, prior, cost)]

    crossed = SimpleNamespace(problem="shares", reduced=None, null=None)
    start: Any = SimpleNamespace(problem="as they are", reduced=None, null=None, crossing=crossed)
    monkeypatch.setattr(crossing, "locate", located)
    monkeypatch.setattr(crossing, "shortlist", list)
    monkeypatch.setattr(crossing, "_moved_by_the_best", lambda *given: given)
    monkeypatch.setattr(crossing, "_in_all_directions", lambda *given: [])
    monkeypatch.setattr(crossing, "_on_springs", lambda *given: [])
    monkeypatch.setattr(crossing, "_may_come_near", lambda *given: True)
    found, _ = crossing.as_sensors_are(start, [alone], places)
    assert (found is crossed) == taken
    assert asked[0] == ([places[1]], (places[0],))


def test_sensors_are_believed_where_forces_in_all_directions_of_a_node_explain(
    monkeypatch: pytest.MonkeyPatch, reduced: ReducedModel
) -> None:
    """A mass at the tip resists across the sensors' plane too, where a force in one direction leaves what it does."""
    record = heavier(reduced, [(7, Y), (5, Z), (4, Z), (3, Y), (7, Z)], (5, Y))
    (along, across) = (Place("ground", (7,), d, "ground", (np.array([36 + c]),), (np.ones(1),)) for d, c in AXES)
    start = _updated(*modelled(reduced.model, [record], 0.01))
    located = locate(start.problem, start.reduced, [along, across], start.null)
    assert located[0].fit.score > 1.5
    (both,) = crossing._in_all_directions(start, located)
    assert both.score < 1.2
    assert both.prior < 20

    def never(*given: object) -> None:
        raise AssertionError("shares of sensors were tried")

    monkeypatch.setattr(crossing, "locate", never)
    assert crossing.as_sensors_are(start, located, [along, across]) == (start, located)


@pytest.mark.parametrize(
    ("null", "again", "near"),
    [
        (80.0, (6.4, 8.3), False),  # hardly less than without shares
        (80.0, (6.4, 3.9), True),
        (4.0, (6.4, 8.3), True),  # no force is needed with them
    ],
)
def test_places_are_sorted_out_anew_where_shares_may_make_a_difference(
    monkeypatch: pytest.MonkeyPatch, null: float, again: tuple[float, float], near: bool
) -> None:
    def fit(score: float) -> Any:
        return SimpleNamespace(score=score, prior=2000.0, cost=1000 * score, p=np.zeros(3), hypothesis=None)

    few = SimpleNamespace(fit=lambda hypotheses, starts: [fit(score) for score in (*again, 9.0, 9.0)])
    few.sparing = lambda limit: few
    shares = SimpleNamespace(null=fit(null), problem=None, reduced=SimpleNamespace(names=["E"]))
    start: Any = SimpleNamespace(null=fit(90.0), crossing=shares, problem=None)
    located: Any = [SimpleNamespace(fit=fit(7.9)), SimpleNamespace(fit=fit(10.2))]
    sorted_out: list[object] = []
    monkeypatch.setattr(crossing, "sensors_in_doubt", lambda *given: few)
    monkeypatch.setattr(crossing, "forces_beside", lambda *given: None)
    monkeypatch.setattr(crossing, "locate", lambda *given: sorted_out.append(given) or located)
    monkeypatch.setattr(crossing, "_moved_by_the_best", lambda *given: given)
    monkeypatch.setattr(crossing, "_in_all_directions", lambda *given: [])
    monkeypatch.setattr(crossing, "_on_springs", lambda *given: [])
    crossing.as_sensors_are(start, located, [])
    assert bool(sorted_out) == near


def test_shares_are_of_the_motion_that_the_best_free_force_makes(reduced: ReducedModel) -> None:
    """Across and along the sensors a structure with a mass moves otherwise than the model without it."""
    force, sensors = (5, Y), [(7, Y), (5, Y), (4, Y), (3, Y), (2, Y)]
    record = heavier(reduced, sensors, force)
    other = heavier(reduced, [(node, Z) for node, _ in sensors], force)
    place = Place("ground", (7,), "Y", "ground", (np.array([36 + Y]),), (np.ones(1),))
    problem = Problem([record], BAND, 0.01, 4)
    mean = problem.prior(reduced)[0]
    (fit,) = problem.fit([hypothesis_of(place, reduced)], [(mean, np.zeros(0))])
    assert fit is not None
    with_force = update.sensors_in_doubt(problem, fit, forces_beside(problem, fit)).records[0].across
    without = update.sensors_in_doubt(problem, fit).records[0].across
    assert with_force is not None
    assert without is not None
    late = slice(N // 4, None)

    def off(made: Array, shown: Array) -> float:
        return float((made[:, late] - shown[:, late]).std() / shown[:, late].std())

    assert off(with_force[2], record.y) < 0.1 < 0.5 < off(without[2], record.y)
    assert off(with_force[0], other.y) < 0.5 * off(without[0], other.y)


def shown_by(
    reduced: ReducedModel, factors: list[float], misfit: float = 1.0, frf: bool = False
) -> tuple[str, dict[str, float]]:
    """What is said of five sensors that read the final model, of a `misfit`, times `factors`, and what they read, in
    time or of an `frf`, which shows other motion outside the band."""
    rng = np.random.default_rng(8)
    dofs = [Dof.parse(text) for text in ("7:+Y", "5:-Y", "4:+Y", "3:+Y", "7:+Z")]
    channels = tuple(Channel(dof, "acceleration", "m/s^2") for dof in dofs)
    model = rng.standard_normal((5, 400))
    shown = model * np.array(factors)[:, None] + 0.01 * rng.standard_normal(model.shape)
    fit = Prediction("a", "fit", 0.01, channels, {"final": model}, shown)
    if frf:
        freq = np.linspace(1.0, 2 * BAND[1], 400)
        within = (freq >= BAND[0]) & (freq <= BAND[1])
        made = (model * np.exp(1j * freq)).T[:, :, None]
        seen = np.where(within, (shown * np.exp(1j * freq)), -1.0).T[:, :, None]
        fit = Prediction("a", "fit", 0.0, channels, {"final": made}, seen, SimpleNamespace(freq=freq), BAND)  # type: ignore[arg-type]
    # recordings that were held back say nothing of it
    held = Prediction("b", "validate", 0.01, channels, {"final": model}, 2 * model)
    (known,) = with_across([recorded(reduced, [(7, Y), (5, Y), (4, Y), (3, Y)], (7, Y))], reduced, BAND, modal(reduced))
    problem = Problem([known], BAND, 0.01, 2)
    found: Any = SimpleNamespace(reduced=reduced, problem=problem, misfit=misfit)
    (said,) = sensors_off(found, [fit, held])
    return said, readings([fit, held])


def test_sensors_that_read_too_much_or_too_little_are_named(reduced: ReducedModel) -> None:
    said, read = shown_by(reduced, [1.031, 0.96, 1.01, 0.97, 1.025])
    assert sorted(read, key=lambda name: -abs(read[name]))[:3] == ["node 5 -Y", "node 7 +Y", "node 3 +Y"]
    assert said.endswith("Against the final model they read: node 5 -Y -4 %, node 7 +Y +3.2 %, node 3 +Y -3 %")


def test_one_sensor_far_off_among_sound_ones_may_have_a_wrong_gain(reduced: ReducedModel) -> None:
    said, _ = shown_by(reduced, [1.0, 1.01, 0.8, 0.99, 1.02])
    assert "sensors may be off by some 2 %" in said
    assert "node 4 +Y alone reads -20 %" in said
    assert "its gain may be wrong; check the scale of its channel" in said


@pytest.mark.parametrize("factors", [[1.2, 0.9, 1.1, 1.0, 1.0], [1.0, 1.06, 0.8, 0.99, 1.02]])
def test_sensors_off_by_more_than_they_can_be_speak_for_the_model(reduced: ReducedModel, factors: list[float]) -> None:
    said, read = shown_by(reduced, factors)
    worst = max(read, key=lambda name: abs(read[name]))
    assert said.startswith(f"against the final model {worst} ")
    assert "may be off by" not in said
    assert "the model that is off near these nodes: check how parts are idealised" in said


def test_lines_of_frfs_in_the_band_tell_too_what_sensors_read(reduced: ReducedModel) -> None:
    factors = [1.2, 0.9, 1.1, 1.0, 1.0]
    said, read = shown_by(reduced, factors, frf=True)
    assert [read[f"node {name}"] for name in ("7 +Y", "5 -Y", "4 +Y")] == pytest.approx([0.2, -0.1, 0.1], abs=0.005)
    assert said.startswith("against the final model node 7 +Y +20 %")


def test_sensors_that_were_left_out_read_nothing() -> None:
    channels = tuple(Channel(Dof.parse(text), "acceleration", "m/s^2") for text in ("7:+Y", "5:+Y"))
    model = np.random.default_rng(8).standard_normal((2, 400))
    fit = Prediction("a", "fit", 0.01, channels, {"final": model}, 0.0 * model, left_out=frozenset({0}))
    assert readings([fit]) == {"node 5 +Y": -1.0}


@pytest.mark.parametrize("frf", [False, True])
def test_recordings_far_from_the_noise_are_not_said_to_be_explained_by_sensors(
    reduced: ReducedModel, frf: bool
) -> None:
    """Of a gearbox on a soft foot, 93 % off with a misfit of 81, it was said that its recordings "are explained"."""
    said, _ = shown_by(reduced, [1.2, 0.9, 1.1, 1.0, 1.0], 81.5, frf)
    assert "explained where" not in said
    assert said.startswith("that sensors may be off by some 2 % (")
    assert " % of a stays all the same, a misfit of 81.5 times what noise explains: what stays is no matter of" in said
    # one that stands alone is what stays
    said, _ = shown_by(reduced, [1.0, 1.01, 0.8, 0.99, 1.02], 2.0, frf)
    assert "no matter of sensors" not in said
    assert "explained where" not in said
    assert "its gain may be wrong" in said


def test_what_moves_across_a_sensor_may_put_it_farther_off(reduced: ReducedModel) -> None:
    name, across = "node 7 +Y", {"node 7 Y": 21.0}
    assert _deviation(name, across) == pytest.approx(np.hypot(GAIN_SD, 21 * ACROSS_SD))
    assert _deviation("node 6 +Y", across) == GAIN_SD


def test_a_mesh_that_is_far_off_is_told() -> None:
    freq = np.array([30.0, 86.405, 90.0])
    far = MeshError(freq, freq, np.array([29.9, 26.201, np.nan]), np.ones(3))
    (said,) = _mesh_off(far)
    assert said.startswith("the deck's mesh puts frequencies up to +230 % off (mode 2: 86.41 Hz, 26.2 Hz refined)")
    assert _mesh_off(None) == []
    assert _mesh_off(replace(far, converged=0.97 * freq)) == []


@pytest.mark.parametrize("missing", [True, False])
def test_masses_are_sought_from_afar_where_no_force_in_one_direction_explains(
    reduced: ReducedModel, missing: bool
) -> None:
    make = heavier if missing else recorded
    record = make(structure(reduced), [(7, Y), (5, Z), (4, Z), (3, Y), (7, Z)], (5, Y))
    places = [Place("ground", (7,), d, "ground", (np.array([36 + c]),), (np.ones(1),)) for d, c in AXES]
    start = _updated(*modelled(reduced.model, [record], 0.01))
    located = locate(start.problem, start.reduced, places, start.null)
    split = split_records(start.problem, start.null, located)
    given = Given(split, start.reduced, start.g_rows, start.null.p, Settings())
    opened = [at for one in located for at in [linear_at(given, one, False)[1]] if at is not None]
    # both directions are of one node
    masses = [t.candidate for t in masses_from_afar(given, located, opened)]
    assert [c.values["m"] for c in masses] == pytest.approx([0.1] if missing else [], rel=0.02)
    assert all(c.chosen < 1.2 and c.prior < 20 for c in masses)
