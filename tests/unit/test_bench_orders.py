"""`femend correlate` on other orders than 1, and on recordings at held speeds: what was simulated is what is found."""

from __future__ import annotations

import csv
import json
import sys
from pathlib import Path

import numpy as np
import pytest

from femend import Channel, Dof, TimeData, correlate_study, functions_of, read_recording, update_study, write_uff
from femend.bench import CorrelationRun
from femend.errors import RecordingError, StudyError

sys.path.insert(0, str(Path(__file__).parents[1]))
import rigs

RIG = rigs.Rig(
    bends=False, layer=None, factors=(1.0, 1.0, 1.0), mass_factor=1.0, seconds=60.0, sense=-1, top_speed=13.0
)
SENSORS = [Dof(n, c) for n in rigs.SENSORS for c in (1, 2, 3)]
HEAD = """format = "femend-study/1"
title = "rig"
[model]
file = "model.bdf"
units = "SI"
[damping]
ratio = 0.008
[correlation]
{correlation}
"""
ROTATING = """[[recording]]
name = "{name}"
file = "{name}.uff"
excitation = "rotating"
[recording.rotating]
tacho = "tacho"
nodes = [511, 512]
axis = "X"
"""
# forces of order 2 at the bearings in Y and Z, N at 1 rev/s, growing linearly with the speed
SECOND = np.array([[0.9, 0.3j], [0.2 - 0.1j, 0.5]])
SPEEDS = {"slow": 4.2, "middle": 6.6, "fast": 11.4}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("orders")
    (folder / "model.bdf").write_text(rigs.deck(RIG))
    truth = rigs.Truth(RIG, folder, clamped=True)
    rng = np.random.default_rng(3)

    def record(name: str, speed: np.ndarray, lead: int) -> None:
        """A run at `speed` (n,) in rev/s, of which `lead` samples come before the record."""
        angle = 2 * np.pi * np.cumsum(speed) / rigs.RATE
        angle -= angle[lead]
        omega = 2 * np.pi * speed
        forces, patterns = [], []
        for node, u, phase, second in zip(rigs.BEARINGS, RIG.unbalance, RIG.phase, SECOND, strict=True):
            turning = u * omega**2 * np.exp(1j * (angle + phase))
            twice = speed * np.exp(2j * angle)
            forces += [turning.real + (second[0] * twice).real, RIG.sense * turning.imag + (second[1] * twice).real]
            patterns += [truth.row(node, 2), truth.row(node, 3)]
        outputs = np.array([truth.row(d.node, d.component) for d in SENSORS])
        y = truth.respond(np.array(forces), np.array(patterns), outputs, lead)
        y = y + 0.01 * y.std(axis=1, keepdims=True) * rng.standard_normal(y.shape)
        channels = (Channel(None, "tacho", "V", "tacho"), *(Channel(d, "acceleration", "m/s^2") for d in SENSORS))
        values = np.vstack([rigs._tacho(angle[lead:])[None], y])
        write_uff(folder / f"{name}.uff", functions_of(TimeData(name, 1 / rigs.RATE, values, channels)))

    lead = int(10 * rigs.RATE)
    n = int(RIG.seconds * rigs.RATE)
    record("runup", np.concatenate([np.full(lead, 2.5), np.linspace(2.5, RIG.top_speed, n)]), lead)
    for name, speed in SPEEDS.items():
        record(name, np.full(lead + int(20 * rigs.RATE), speed), lead)
    return folder


def study(folder: Path, *recordings: str, correlation: str = "") -> Path:
    path = folder / "study.toml"
    path.write_text(HEAD.format(correlation=correlation) + "".join(ROTATING.format(name=name) for name in recordings))
    return path


@pytest.fixture(scope="module")
def orders(folder: Path) -> CorrelationRun:
    return correlate_study(study(folder, "runup", correlation="orders = [1, 2]"), folder / "out")


def test_the_second_order_shows_the_modes_it_goes_through(orders: CorrelationRun) -> None:
    first, second = orders.run("runup"), orders.run("runup", 2.0)
    # mode 2 is along the shaft, where neither order acts; beyond 13 Hz order 2 is alone
    assert [r.b for r in first.comparison.table.rows] == [0, 2]
    assert [r.b for r in second.comparison.table.rows] == [0, 2, 3, 4, 5]
    assert max(abs(r.freq_difference) for r in second.comparison.table.rows) < 0.004
    assert second.measured.freq[-1] == pytest.approx(2 * first.measured.freq[-1], rel=0.01)


def of_second(truth: rigs.Truth, freq: np.ndarray) -> np.ndarray:
    """Accelerations (K, n_out) of order 2 per unit course at lines `freq` (K,) in Hz."""
    rows = np.array([truth.row(d.node, d.component) for d in SENSORS])
    into = np.array([truth.row(n, c) for n in rigs.BEARINGS for c in (2, 3)])
    modal = np.einsum("krs,s->kr", truth.receptance(freq), into.T @ SECOND.ravel())
    # twice the angle of the shaft: the force is that of half of `freq`
    return -(0.5 * freq)[:, None] * (modal @ rows.T)


def test_orders_of_one_record_are_told_apart(orders: CorrelationRun, folder: Path) -> None:
    truth = rigs.Truth(RIG, folder, clamped=True)
    alone = correlate_study(study(folder, "runup", correlation="orders = [2]")).run("runup", 2.0).measured
    off = []
    for found in (orders.run("runup", 2.0).measured, alone):
        wanted = of_second(truth, found.freq)
        error = np.linalg.norm(found.shapes - wanted, axis=1) / np.linalg.norm(wanted, axis=1)
        off.append((np.median(error), np.quantile(error, 0.9)))
    assert off[0][0] < off[1][0] < 0.05
    assert off[0][1] < 0.5 * off[1][1]


def test_forces_of_the_second_order_are_found(orders: CorrelationRun) -> None:
    response = orders.run("runup", 2.0).response
    assert response.forces is not None
    assert (response.sense, response.unbalance.size) == (0, 0)
    assert response.power == 1.0
    speed = orders.run("runup", 2.0).measured.freq[-1] / 2
    np.testing.assert_allclose(response.forces, speed * SECOND, atol=0.05 * speed * np.abs(SECOND).max())
    assert float(np.mean(response.csac)) > 0.95


def test_order_1_is_what_it_is_without_the_second(orders: CorrelationRun) -> None:
    response = orders.run("runup").response
    assert response.sense == RIG.sense
    assert response.forces is None
    np.testing.assert_allclose(np.abs(response.unbalance), RIG.unbalance, rtol=0.05)


def test_what_is_written_of_orders(orders: CorrelationRun, folder: Path) -> None:
    result = json.loads((folder / "out" / "correlation.json").read_text())
    first, second = result["runs"]
    assert (first["order"], second["order"]) == (1.0, 2.0)
    assert second["peaks"][0]["rpm"] == pytest.approx(30 * second["peaks"][0]["freq"])
    assert second["response"]["power_of_speed"] == 1.0
    assert np.shape([b["force"] for b in second["response"]["bearings"]]) == (2, 2)
    with (folder / "out" / "correlation.runs.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert {r["order"] for r in rows} == {"1.0", "2.0"}
    page = (folder / "out" / "correlation.html").read_text()
    assert "Forces at the highest speed, growing with its power 1" in page
    assert "peaks of the run's operating shapes in order 2 look like a mode" in repr(orders)
    with pytest.raises(KeyError, match="no run 'runup' in order 3; there are runup, runup in order 2"):
        orders.run("runup", 3.0)


@pytest.fixture(scope="module")
def held(folder: Path) -> CorrelationRun:
    return correlate_study(study(folder, "fast", "slow", "middle", correlation="orders = [1, 2]"), folder / "held")


def test_held_speeds_are_one_rotor_in_the_order_of_speed(held: CorrelationRun) -> None:
    found = held.run("middle")
    assert found is held.run("slow")
    assert found.measured.held == ("slow", "middle", "fast")
    np.testing.assert_allclose(found.measured.freq, sorted(SPEEDS.values()), rtol=1e-4)
    assert found.comparison is None
    response = found.response
    assert response.sense == RIG.sense
    np.testing.assert_allclose(np.abs(response.unbalance), RIG.unbalance, rtol=0.05)
    np.testing.assert_allclose(np.angle(response.unbalance * np.exp(-1j * np.array(RIG.phase))), 0.0, atol=0.06)
    assert response.csac.min() > 0.99
    assert response.csf.min() > 0.95


def test_the_shape_at_a_held_speed_is_that_of_the_structure(held: CorrelationRun, folder: Path) -> None:
    truth = rigs.Truth(RIG, folder, clamped=True)
    found = held.run("fast", 2.0)
    k = found.measured.held.index("fast")
    wanted = of_second(truth, np.array([2 * SPEEDS["fast"]]))[0]
    off = np.abs(found.measured.shapes[k] - wanted)
    # within what its own deviation says: four of them cover 48 values, and the tacho's angle
    assert (off < 5 * found.measured.sd[k] + 0.01 * np.abs(wanted).max()).all()
    assert found.measured.noise[k] < 0.02


def test_what_is_written_of_held_speeds(held: CorrelationRun, folder: Path) -> None:
    result = json.loads((folder / "held" / "correlation.json").read_text())
    assert [r["order"] for r in result["runs"]] == [1.0, 2.0]
    assert [h["recording"] for h in result["runs"][0]["held"]] == ["slow", "middle", "fast"]
    assert result["runs"][1]["held"][0]["rpm"] == pytest.approx(60 * SPEEDS["slow"], rel=1e-4)
    with (folder / "held" / "correlation.held.csv").open() as file:
        assert len(list(csv.DictReader(file))) == 6
    assert "operating shapes at 6 held speeds have a CSAC of" in (folder / "held" / "correlation.html").read_text()
    assert "operating shapes at 3 held speeds in order 2" in repr(held)


def test_pulses_of_several_teeth_have_no_common_angle(folder: Path) -> None:
    path = study(folder, "slow", "fast", correlation="orders = [2]")  # of a shaft that turns half as fast
    path.write_text(path.read_text().replace('axis = "X"', 'axis = "X"\npulses_per_revolution = 2'))
    found = correlate_study(path)
    assert [r.measured.held for r in found.runs] == [("slow",), ("fast",)]


def test_a_wrong_number_of_pulses_is_told_where_nothing_is_left_of_order_1(folder: Path) -> None:
    path = study(folder, "fast")
    path.write_text(path.read_text().replace('axis = "X"', 'axis = "X"\npulses_per_revolution = 2'))
    with pytest.raises(RecordingError, match=r"% of its shape is noise") as caught:
        correlate_study(path)
    assert "is pulses_per_revolution = 1 instead of 2?" in str(caught.value)


@pytest.mark.parametrize(
    ("correlation", "message"),
    [
        ("orders = [40]", r"'slow' is not compared in order 40: 168 Hz is too near to half its sampling rate"),
        (
            "band = [20.0, 30.0]",
            r"'slow' is not compared in order 1: its speed is held at 4\.2 rev/s, 4\.2 Hz, out",
        ),
    ],
)
def test_held_speeds_that_cannot_be_compared(folder: Path, correlation: str, message: str) -> None:
    with pytest.raises(RecordingError, match=message):
        correlate_study(study(folder, "slow", correlation=correlation))


def test_a_short_recording_at_a_held_speed_is_refused(folder: Path, tmp_path: Path) -> None:
    data = read_recording(folder / "slow.uff", excitation="unknown").time
    (tmp_path / "model.bdf").write_bytes((folder / "model.bdf").read_bytes())
    short = TimeData("slow", data.dt, data.values[:, : int(5 * rigs.RATE)], data.channels)
    write_uff(tmp_path / "slow.uff", functions_of(short))
    with pytest.raises(RecordingError, match=r"rev/s it holds 12 whole revolutions clear of its ends, fewer"):
        correlate_study(study(tmp_path, "slow"))


def test_held_speeds_that_are_noise_are_told_and_left_out(folder: Path, tmp_path: Path) -> None:
    """Nothing acts in order 3, and one recording is loud with something else: both were compared like the others."""
    data = read_recording(folder / "slow.uff", excitation="unknown").time
    values = data.values.copy()
    values[1:] += 25.0 * values[1:].std() * np.random.default_rng(4).standard_normal(values[1:].shape)
    for name in ("middle", "fast"):
        (tmp_path / f"{name}.uff").write_bytes((folder / f"{name}.uff").read_bytes())
    (tmp_path / "model.bdf").write_bytes((folder / "model.bdf").read_bytes())
    write_uff(tmp_path / "slow.uff", functions_of(TimeData("slow", data.dt, values, data.channels)))
    run = correlate_study(study(tmp_path, "slow", "middle", "fast", correlation="orders = [1, 3]"))
    assert [r.measured.held for r in run.runs] == [("middle", "fast")]
    assert run.runs[0].measured.noise.max() < 0.1
    told = [w for w in run.result["warnings"] if "of its shape is noise" in w]
    assert [w.split(":")[0] for w in told] == [
        "recording 'slow' is not compared",
        "recording 'slow' is not compared in order 3",
        "recording 'middle' is not compared in order 3",
        "recording 'fast' is not compared in order 3",
    ]
    assert "at 4.2 rev/s " in told[0]
    assert all("times as long, or run nearer" in w or "shows next to nothing of this order" in w for w in told)
    with pytest.raises(RecordingError, match=r"'slow' is not compared: at 4\.2 rev/s \d+ % of its shape is noise"):
        correlate_study(study(tmp_path, "slow"))


def test_few_amplitudes_are_followed_by_any_model(folder: Path, tmp_path: Path) -> None:
    data = read_recording(folder / "slow.uff", excitation="unknown").time
    (tmp_path / "model.bdf").write_bytes((folder / "model.bdf").read_bytes())
    write_uff(tmp_path / "slow.uff", functions_of(data.select([0, 2, 3])))
    found = correlate_study(study(tmp_path, "slow"), tmp_path / "out")
    assert found.run("slow").response is None
    assert any("2 measured amplitudes are followed by the 2 of the forces" in w for w in found.result["warnings"])
    assert found.result["runs"][0]["held"][0]["csac"] is None


def test_an_order_is_compared_as_far_as_it_is_sampled(folder: Path) -> None:
    found = correlate_study(study(folder, "runup", correlation="orders = [12]"))
    assert found.run("runup", 12.0).measured.freq[-1] < 0.34 * rigs.RATE
    assert any("order 12 is compared up to 86" in w for w in found.result["warnings"])
    with pytest.raises(
        RecordingError, match=r"in order 60: its order goes through .* sampling up to 87\.04 Hz holds 0"
    ):
        correlate_study(study(folder, "runup", correlation="orders = [60]"))


@pytest.mark.parametrize(
    ("correlation", "message"),
    [
        ("orders = []", r"correlation\.orders: the list is empty"),
        ("orders = [1, 0]", r"correlation\.orders: 0 is no order of rotation"),
        ("orders = [2, 2]", r"correlation\.orders: 2 stands twice"),
    ],
)
def test_orders_that_are_none(folder: Path, correlation: str, message: str) -> None:
    with pytest.raises(StudyError, match=message):
        correlate_study(study(folder, "slow", correlation=correlation))


def stiff_springs(folder: Path, tmp_path: Path, correlation: str, *recordings: str) -> Path:
    """The study on a deck whose springs are too stiff by a tenth across the shaft and by a fifth upright."""
    deck = rigs.deck(RIG)
    (line,) = [row for row in deck.splitlines() if row.startswith("PBUSH,11,K,12000,12000,30000")]
    changed = line.replace("12000,12000,30000", "12000,13200,36000")
    (tmp_path / "model.bdf").write_text(deck.replace(line, changed))
    for name in recordings:
        (tmp_path / f"{name}.uff").write_bytes((folder / f"{name}.uff").read_bytes())
    path = study(tmp_path, *recordings, correlation=correlation)
    parameters = "".join(
        f'[[parameter]]\nname = "{k}"\nproperty = "{k}"\nproperty_id = 11\nprior_sd = 0.2\n' for k in ("k2", "k3")
    )
    path.write_text(f'{path.read_text()}{parameters}[updating]\nresponses = ["orders"]\n')
    return path


def test_an_update_takes_both_orders_of_one_record(folder: Path, tmp_path: Path) -> None:
    run = update_study(stiff_springs(folder, tmp_path, "orders = [1, 2]", "runup"), tmp_path / "out")
    assert [c.name for c in run.problem.configurations] == ["runup", "runup in order 2"]
    assert run.factors["k2"] == pytest.approx(1 / 1.1, rel=3e-3)
    assert run.factors["k3"] == pytest.approx(1 / 1.2, rel=3e-3)
    first, second = run.result["runs"]
    assert first["sense"] == RIG.sense
    assert second["forces"] == "estimated"
    found = np.array([b["force"] for b in second["bearings"]])
    # with the springs of the deck another growth suits better; the updated model tells the true one
    assert run.runs_before[1].response.power == 0.75
    assert second["power_of_speed"] == 1.0
    assert any("runup in order 2: forces grow as the speed^1" in n for i in run.found.history for n in i.notes)
    highest = second["lines"][-1] / 2
    np.testing.assert_allclose(found, highest * np.abs(SECOND), rtol=0.05)
    page = (tmp_path / "out" / "updating.html").read_text()
    assert "growing as the speed^" in page


def test_an_update_takes_held_speeds_together(folder: Path, tmp_path: Path) -> None:
    run = update_study(stiff_springs(folder, tmp_path, "", *SPEEDS))
    (told,) = run.result["runs"]
    assert told["lines"] == pytest.approx(list(SPEEDS.values()), rel=1e-3)
    assert run.factors["k2"] == pytest.approx(1 / 1.1, rel=0.02)
    assert run.factors["k3"] == pytest.approx(1 / 1.2, rel=0.05)
    assert [b["m_r"] for b in told["bearings"]] == pytest.approx(RIG.unbalance, rel=0.1)
