"""`femend correlate` where the unbalance is known: levels and phases of the run are compared beside its shape."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from femend import Channel, Dof, TimeData, correlate_study, functions_of, write_uff
from femend.bench import CorrelationRun
from femend.errors import StudyError

sys.path.insert(0, str(Path(__file__).parents[1]))
from rigs import RATE, Rig, write_rig

# the deck's structure but for its mesh: what is compared is what was simulated
RIG = Rig(bends=False, layer=None, factors=(1.0, 1.0, 1.0), mass_factor=1.0, seconds=40.0, sense=-1)


def unbalance(scale: float = 1.0, turned: float = 0.0) -> str:
    entries = ", ".join(
        f"{{ node = {n}, m_r = {scale * u}, phase_deg = {np.degrees(p) + turned} }}"
        for n, u, p in zip((511, 512), RIG.unbalance, RIG.phase, strict=True)
    )
    return f"unbalance = [{entries}]\n"


@pytest.fixture(scope="module")
def rig(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("unbalance")
    study = write_rig(folder, RIG)
    head, *recordings = study.read_text().split("[[recording]]")
    (own,) = (r for r in recordings if 'name = "runup"' in r)
    study.write_text(f"{head.replace('ratio = 0.01', 'ratio = 0.008')}[[recording]]{own}")
    return study


@pytest.fixture
def given(rig: Path, tmp_path: Path) -> Callable[..., Path]:
    """The study with more keys of [recording.rotating], and other text."""

    def make(keys: str, text: Callable[[str], str] = str) -> Path:
        for name in ("model.bdf", "runup.uff"):
            (tmp_path / name).write_bytes((rig.parent / name).read_bytes())
        (tmp_path / "study.toml").write_text(text(rig.read_text() + keys))
        return tmp_path / "study.toml"

    return make


@pytest.fixture(scope="module")
def run(rig: Path) -> CorrelationRun:
    path = rig.parent / "known.toml"
    path.write_text(rig.read_text() + unbalance())
    return correlate_study(path, rig.parent / "out")


def test_levels_and_phases_are_the_models_own(run: CorrelationRun) -> None:
    found = run.run("runup")
    response, peaks = found.response, found.measured.peaks
    assert response.known
    assert response.sense == RIG.sense
    np.testing.assert_allclose(np.abs(response.unbalance), RIG.unbalance)
    # the study's damping is 0.8 % everywhere, the truth's from 0.71 % at 12 Hz to 0.81 %
    np.testing.assert_allclose(response.level[peaks], 0.95, atol=0.1)
    assert np.abs(np.degrees(response.phase[peaks])).max() < 3.0
    quiet = found.measured.noise < 0.05
    assert np.median(np.abs(response.level[quiet] - 1.0)) < 0.02
    assert np.median(np.abs(np.degrees(response.phase[quiet]))) < 2.0


def test_twice_the_unbalance_is_twice_the_level(given: Callable[..., Path], run: CorrelationRun) -> None:
    twice, once = correlate_study(given(unbalance(2.0))).run("runup").response, run.run("runup").response
    np.testing.assert_allclose(twice.level, 2 * once.level, rtol=1e-9)
    np.testing.assert_allclose(twice.csac, once.csac, rtol=1e-9)
    assert np.mean(twice.csf) < 0.9 < np.mean(once.csf)


def test_a_phase_turns_the_response_with_it(given: Callable[..., Path], run: CorrelationRun) -> None:
    other = correlate_study(given(unbalance(turned=30.0)))
    turned, plain = other.run("runup").response, run.run("runup").response
    off = np.angle(np.exp(1j * (turned.phase - plain.phase)))
    np.testing.assert_allclose(np.degrees(off), 30.0, atol=1e-6)
    mean = other.result["runs"][0]["response"]["mean_phase_deg"]
    assert mean == pytest.approx(30.0, abs=2.0)
    assert f"of the test's level and {mean:.0f}° ahead of it" in repr(other)


def test_a_sense_that_is_told_is_taken(given: Callable[..., Path], run: CorrelationRun) -> None:
    against = correlate_study(given(unbalance() + "sense = 1\n")).run("runup").response
    assert against.sense == 1
    assert np.mean(against.csac) < np.mean(run.run("runup").response.csac) - 0.05
    alone = correlate_study(given("sense = 1\n")).run("runup").response
    assert alone.sense == 1
    assert not alone.known


def test_what_is_written_of_levels(run: CorrelationRun, rig: Path) -> None:
    (one,) = json.loads((rig.parent / "out" / "correlation.json").read_text())["runs"]
    response = one["response"]
    assert response["unbalance"] == "as the study gives it"
    assert response["bearings"][0]["m_r"] == pytest.approx(3e-3)
    assert response["mean_level"] == pytest.approx(1.0, abs=0.05)
    assert len(response["amplitudes"]) == len(one["peaks"])
    first = response["amplitudes"][0]
    measured = run.run("runup").measured
    k = measured.peaks[0]
    largest = np.abs(measured.shapes[k]).max() * (2 * np.pi * measured.freq[k]) ** 2
    assert first["test"] == pytest.approx(largest)
    assert first["model"] / first["test"] == pytest.approx(first["level"], abs=0.03)
    assert first["level_likest"] == pytest.approx(1.0, abs=0.1)
    page = (rig.parent / "out" / "correlation.html").read_text()
    for header in ("m r, kg·m", "test, m/s²", "model, m/s²"):
        assert f">{header}</th>" in page
    assert "Accelerations at the sensor that moves most" in page
    assert "response to the unbalance given:" in repr(run)


def test_one_sensor_at_a_held_speed_is_enough_for_a_known_unbalance(rig: Path, tmp_path: Path) -> None:
    (tmp_path / "model.bdf").write_bytes((rig.parent / "model.bdf").read_bytes())
    angle = 2 * np.pi * 9.0 * np.arange(int(20 * RATE)) / RATE
    values = np.vstack([np.cos(angle), 0.5 * np.cos(angle - 0.3)])
    write_uff(tmp_path / "runup.uff", functions_of(_held(angle, values, 501)))
    (tmp_path / "study.toml").write_text(rig.read_text() + unbalance())
    found = correlate_study(tmp_path / "study.toml")
    (row,) = found.result["runs"][0]["response"]["amplitudes"]
    assert row["sensor"] == "501:+Y"
    assert row["test"] == pytest.approx(1.0, abs=0.01)
    assert "level_likest" not in row


def _held(angle: np.ndarray, values: np.ndarray, node: int = 5) -> TimeData:
    """A recording at a held speed: a tacho's pulses at `angle` (n,), accelerations (2, n) in Y and Z of a node."""
    turn = np.mod(angle / (2 * np.pi) + 0.5, 1.0) - 0.5
    tacho = 5 * np.clip(np.minimum(turn / 0.01 + 0.5, (0.125 - turn) / 0.01 + 0.5), 0.0, 1.0)
    channels = (Channel(None, "tacho", "V", "tacho"), *(Channel(Dof(node, c), "acceleration", "m/s^2") for c in (2, 3)))
    return TimeData("held", 1 / RATE, np.vstack([tacho, values]), channels)


def beam(length: float, mass: float) -> str:
    """A cantilever of four bars, 0.8 m of steel, in units of `length` m and `mass` kg; the second is the same."""
    E, rho = 2.1e11 * length / mass, 7850.0 * length**3 / mass
    A, I, J = 4e-4 / length**2, 1.33e-8 / length**4, 2.2e-8 / length**4
    lines = ["SOL 103", "CEND", "SPC = 1", "BEGIN BULK", f"MAT1,1,{E:.7e},,0.3,{rho:.7e}"]
    lines += [f"PBAR,1,1,{A:.7e},{I:.7e},{I:.7e},{J:.7e}", "SPC1,1,123456,1"]
    lines += [f"GRID,{n},,{0.2 * (n - 1) / length:.7g},0.,0." for n in range(1, 6)]
    lines += [f"CBAR,{n},1,{n},{n + 1},0.,0.,1." for n in range(1, 5)]
    return "\n".join([*lines, "ENDDATA", ""])


def test_levels_do_not_depend_on_the_unit_system(tmp_path: Path) -> None:
    levels = []
    for units, length, mass in (("SI", 1.0, 1.0), ("mm-t-s", 1e-3, 1e3)):
        folder = tmp_path / units
        folder.mkdir()
        (folder / "model.bdf").write_text(beam(length, mass))
        t = np.arange(int(20 * RATE)) / RATE
        angle = 2 * np.pi * 9.0 * t
        # recorded in m/s^2 whatever the deck's units are
        write_uff(folder / "held.uff", functions_of(_held(angle, np.vstack([np.cos(angle), np.sin(angle - 0.2)]))))
        (folder / "study.toml").write_text(
            f'format = "femend-study/1"\n[model]\nfile = "model.bdf"\nunits = "{units}"\n'
            '[[recording]]\nname = "held"\nfile = "held.uff"\nexcitation = "rotating"\n[recording.rotating]\n'
            'tacho = "tacho"\nnodes = [3]\naxis = "X"\n'
            f"unbalance = [{{ node = 3, m_r = {2e-4 / (mass * length)}, phase_deg = 40.0 }}]\n"
        )
        (row,) = correlate_study(folder / "study.toml").result["runs"][0]["response"]["amplitudes"]
        levels.append([row["level"], row["phase_deg"], row["test"] * length, row["model"] * length])
    np.testing.assert_allclose(levels[0], levels[1], rtol=1e-5)
    assert levels[0][2] == pytest.approx(1.0, abs=0.01)


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ("sense = 2\n", r"recording\[0\]\.rotating\.sense: 2 is neither 1"),
        ("unbalance = [{ node = 511, m_r = 0.0, phase_deg = 0 }]\n", r"unbalance\[0\]\.m_r: 0 is not above 0"),
        ("unbalance = [{ node = 511, m_r = 0.1, phase_deg = inf }]\n", r"unbalance\[0\]\.phase_deg: inf is no angle"),
        (
            "unbalance = [{ node = 511, m_r = 0.1, phase_deg = 0 }, { node = 511, m_r = 0.1, phase_deg = 9 }]\n",
            r"unbalance\[1\]\.node: node 511 has an unbalance already",
        ),
        (
            "pulses_per_revolution = 2\nunbalance = [{ node = 511, m_r = 0.1, phase_deg = 0 }]\n",
            r"rotating\.unbalance: its phases are against one pulse of a revolution, and the tacho gives 2",
        ),
        ("unbalance = [{ node = 511, m_r = 0.1 }]\n", r"the key 'phase_deg' is missing"),
    ],
)
def test_unbalances_that_are_none(given: Callable[..., Path], keys: str, message: str) -> None:
    with pytest.raises(StudyError, match=message):
        correlate_study(given(keys))


def test_an_unbalance_may_sit_away_from_the_bearings_but_at_a_node(given: Callable[..., Path]) -> None:
    at = "unbalance = [{{ node = {}, m_r = 0.003, phase_deg = 0 }}]\n"
    found = correlate_study(given(at.format(500))).run("runup")
    assert found.response.nodes == (500,)
    lost = correlate_study(given(at.format(9999)))
    assert lost.run("runup").response is None
    assert any("unbalance node 9999 of [recording.rotating] is not among" in w for w in lost.result["warnings"])
