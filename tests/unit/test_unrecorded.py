"""A force nobody recorded: the drive is located, what is missing beside it told, and nothing where nothing is."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.small_study import NOISE, SENSORS, SHAKER, Truth, write_study

from femend import Channel, Dof, TimeData, functions_of, read_recording, write_uff
from femend.diagnose.deciding.one_more import ONE_MORE, moved_more, one_more_force, stands_in
from femend.diagnose.driven import unrecorded
from femend.diagnose.driven.unrecorded import LEAST_SENSORS, locate_drive
from femend.diagnose.settings import Settings
from femend.errors import RecordingError
from femend.estimate import FitRecord, Hypothesis, fit_records, noise_of, pair_test, used_band
from femend.model import read_model
from femend.study import StudyInterrupted, load_study
from femend.study.result.left_out import in_band
from femend.study.result.study_run import StudyRun
from femend.study.run import diagnose
from femend.study.staged.study_run import StagedRun

STIFFER = (7.35e10, 6.8e10)


def without_force(folder: Path, truth: Truth) -> Path:
    """A study of a truth whose fit recordings hold no force, as far as the study says."""
    path = write_study(folder, truth)
    path.write_text(path.read_text().replace('role = "fit"', 'role = "fit"\nexcitation = "unknown"'))
    return path


def diagnosed(folder: Path, truth: Truth, out: Path | None = None) -> StudyRun:
    run = diagnose(without_force(folder, truth), out)
    assert isinstance(run, StudyRun)
    return run


def records_of(path: Path) -> list[FitRecord]:
    study = load_study(path)
    model, test = read_model(study.model_file), study.read_recordings()
    return fit_records([r for r in test if r.role == "fit"], model, pair_test(test, model))


@pytest.fixture(scope="module")
def quiet(tmp_path_factory: pytest.TempPathFactory) -> StudyRun:
    """Nothing is missing."""
    return diagnosed(tmp_path_factory.mktemp("quiet"), Truth(STIFFER))


@pytest.fixture(scope="module")
def sprung(tmp_path_factory: pytest.TempPathFactory) -> StudyRun:
    """A spring is missing at node 7."""
    laws = [(7, "support_stiffness", {"k": 2e4})]
    folder = tmp_path_factory.mktemp("sprung")
    return diagnosed(folder, Truth(STIFFER, laws=laws), folder / "out")


def test_the_drive_is_found_and_nothing_is_said_to_be_missing(quiet: StudyRun) -> None:
    driven = quiet.diagnosis.driven
    assert driven is not None
    assert (driven.place.nodes, driven.place.direction.lstrip("+")) == ((SHAKER,), "Z")
    assert quiet.result["verdict"] == "parameters-only"
    assert any(f"node {SHAKER}, Z" in w and "no force was recorded" in w for w in quiet.result["warnings"])
    for name, true in zip(("E_root", "E_tip"), STIFFER, strict=True):
        told = quiet.result["parameters"][name]
        assert abs(told["factor"] - true / 7e10) < 2 * told["sd"]


def test_sensors_in_a_plane_that_nothing_drives_are_left_out(tmp_path: Path) -> None:
    path = without_force(tmp_path, Truth(STIFFER))
    for i, name in enumerate(("low", "high", "held")):
        data = read_recording(tmp_path / f"{name}.uff").time
        rounding = 1e-12 * np.random.default_rng(i).standard_normal((2, data.n_samples))
        channels = (*data.channels, *(Channel(Dof(node, 1), "acceleration", "m/s^2") for node in (7, 13)))
        more = TimeData(name, data.dt, np.vstack([data.values, rounding]), channels)
        write_uff(tmp_path / f"{name}.uff", functions_of(more))
    run = diagnose(path)
    assert isinstance(run, StudyRun)
    assert run.result["verdict"] == "parameters-only"
    assert any("node 7 X, node 13 X stand still" in w for w in run.result["warnings"])
    assert all(row["final"] < (2.5 if row["role"] == "fit" else 5) * NOISE for row in run.result["fit"])
    shown = {p.name: [c.dof.node for c in p.channels if c.dof is not None] for p in run.predictions}
    assert shown["low"] == list(SENSORS)


def test_what_is_missing_is_named_beside_it(sprung: StudyRun) -> None:
    (finding,) = sprung.result["findings"]
    assert sprung.result["verdict"] == "missing-physics"
    assert finding["physics"] == "support_stiffness"
    assert finding["location"]["nodes"] == [7]
    assert abs(finding["parameters"]["k"]["value"] / 2e4 - 1) < 0.05


def test_one_more_force_shows_what_is_missing_and_nothing_where_nothing_is(quiet: StudyRun, sprung: StudyRun) -> None:
    settings = Settings()
    for run, missing in ((quiet, False), (sprung, True)):
        driven = run.diagnosis.driven
        assert driven is not None
        assert one_more_force(driven, settings) == missing
        assert (moved_more(driven) > ONE_MORE) == missing
        assert moved_more(replace(driven, located=[])) == 0.0
        assert not one_more_force(replace(driven, located=[]), settings)


def test_what_one_more_force_moves_is_a_share_of_the_motion_whatever_the_noise(sprung: StudyRun) -> None:
    driven = sprung.diagnosis.driven
    assert driven is not None
    shares = []
    for factor in (1.0, 3.0):
        problem = driven.start.problem
        problem = problem.on([replace(r, noise=factor * r.noise) for r in problem.records])
        null, first = driven.start.null, driven.located[0]
        hypotheses, starts = [null.hypothesis, first.fit.hypothesis], [(null.p, null.x), (first.fit.p, first.fit.x)]
        there, beside = problem.fit(hypotheses, starts, iterations=0)
        assert there is not None
        assert beside is not None
        louder = replace(driven.start, problem=problem, null=there)
        shares.append(moved_more(replace(driven, start=louder, located=[replace(first, fit=beside)])))
    assert shares[1] == pytest.approx(shares[0], rel=0.35), "the misfits are 9 times less"


def test_a_law_for_which_the_model_bends_stands_in_for_what_is_elsewhere(sprung: StudyRun) -> None:
    found, driven = sprung.diagnosis, sprung.diagnosis.driven
    assert driven is not None
    assert found.best is not None
    assert found.place is not None
    far = replace(found.place, squares=found.place.squares + 10 * found.settings.reach)
    bent = replace(found.best, prior=2 * found.settings.bent * found.settings.gain_cost)
    likeliest = replace(found, verdict="located-not-named", best=bent, place=far)
    assert stands_in(likeliest, driven)
    assert not stands_in(replace(likeliest, best=found.best), driven), "the model does not bend for it"
    assert not stands_in(replace(likeliest, place=driven.located[0]), driven), "it is at the best place"
    assert not stands_in(replace(likeliest, verdict="missing-physics"), driven)


def test_errors_are_those_of_sensors_predicted_from_the_others(sprung: StudyRun) -> None:
    rows = {row["recording"]: row for row in sprung.result["fit"] if row["role"] == "fit"}
    assert set(rows) == {"low", "high"}
    for row in rows.values():
        assert row["final"] < 2.5 * NOISE
        assert row["parameters"] > 2 * row["final"]
    held = next(row for row in sprung.result["fit"] if row["role"] == "validate")
    assert held["final"] < 0.1 < held["parameters"], "predicted from the force that was recorded there"


def test_a_sensor_that_is_left_out_does_not_count(sprung: StudyRun) -> None:
    """What a sensor reads changes nothing of what the others predict for it."""
    from femend.study.result.left_out import predicted_by_others

    record = sprung.records[0]
    changed = record.y.copy()
    changed[1] *= 3.0
    before = predicted_by_others(sprung.diagnosis, record)["final"]
    after = predicted_by_others(sprung.diagnosis, replace(record, y=changed))["final"]
    size = in_band(sprung.diagnosis, record)[1].std()
    assert np.abs(after[1] - before[1]).max() < 1e-3 * size
    assert np.abs(after[0] - before[0]).max() > 0.1 * size


def test_noise_and_band_without_a_force(tmp_path: Path) -> None:
    for record in records_of(without_force(tmp_path, Truth())):
        assert not record.driven
        assert record.u.shape == (0, record.n)
        assert record.level == record.y.std()
        told = record.noise / record.y.std(axis=1)
        # the force reaches up to 150 Hz of 256, and its decays further: hardly one of the 512 lines is noise alone
        assert (told > 0.6 * NOISE).all()
        assert (told < 1.3 * NOISE).all()
        low, high = used_band([record])
        assert low < 20 < 120 < high


def test_white_noise_alone_is_told_by_its_quietest_stretches() -> None:
    y = 0.3 * np.random.default_rng(5).standard_normal((3, 4000))
    assert np.allclose(noise_of(np.zeros((0, 4000)), y, 0), 0.3, rtol=0.15)


def test_free_forces_of_a_problem_are_those_of_a_hypothesis(quiet: StudyRun) -> None:
    """A free force beside a free force is the same as a free force at both places."""
    driven = quiet.diagnosis.driven
    assert driven is not None
    problem, reduced = driven.start.problem, driven.start.reduced
    place = next(p for p in driven.places if p.nodes == (7,) and p.direction.lstrip("+") == "Z")
    w = [p.w(reduced.V, reduced.V_a) for p in (place, driven.place)]
    p = driven.start.null.p
    start = [(p, np.zeros(0))]
    (one,) = problem.fit([Hypothesis(reduced, w[0])], start, iterations=0)
    (both,) = problem.driven_at(None).fit([Hypothesis(reduced, np.vstack(w))], start, iterations=0)
    assert one is not None
    assert both is not None
    assert np.isclose(one.cost, both.cost, rtol=1e-9)


def test_too_few_responses_are_told_and_go_another_way(tmp_path: Path) -> None:
    path = without_force(tmp_path, Truth())
    few = [
        replace(r, y=r.y[:2], out_rows=r.out_rows[:2], out_signs=r.out_signs[:2], noise=r.noise[:2])
        for r in records_of(path)
    ]
    assert LEAST_SENSORS > 2
    with pytest.raises(RecordingError, match="2 response.*at least 3 responses are needed"):
        locate_drive(read_model(tmp_path / "model.bdf"), few, 0.01)


def test_what_one_force_does_not_explain_is_left_to_modes(tmp_path: Path) -> None:
    """Sensors that move by themselves: no force explains them, and they are taken as ambient recordings are."""
    from tests.small_study import RATE, SECONDS, recording

    from femend import functions_of, write_uff

    path = without_force(tmp_path, Truth())
    n = int(RATE * SECONDS)
    rng = np.random.default_rng(3)
    for name in ("low", "high"):
        y = np.cumsum(rng.standard_normal((len(SENSORS), n)), axis=1)
        y = np.fft.irfft(np.where(np.arange(n // 2 + 1) > 40, np.fft.rfft(y - y.mean()), 0), n, axis=1)
        write_uff(tmp_path / f"{name}.uff", functions_of(recording(name, y[0], y)))
    try:
        run = diagnose(path)
    except RecordingError as error:
        assert "no mode could be identified" in str(error)  # noqa: PT017
    else:
        assert isinstance(run, StagedRun)
        assert any("no one force" in warning for warning in run.result["warnings"])


def test_a_run_that_is_stopped_while_places_are_tried_beside_the_drive_keeps_the_drive(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def stopped(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(unrecorded, "_placed", stopped)
    with pytest.raises(StudyInterrupted) as told:
        diagnosed(tmp_path, Truth(STIFFER))
    result, found = told.value.run.result, told.value.run.diagnosis
    assert (result["status"], result["verdict"]) == ("interrupted", "undetermined")
    assert "the parameters are updated, no place was looked at yet" in result["advice"]
    assert found.driven is not None
    assert found.driven.place.nodes == (SHAKER,)
    assert result["fit"][0]["parameters"] < 0.2
