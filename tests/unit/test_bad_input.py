"""Broken input reaches the terminal as one message with the subject, the value and what to do; nothing is written."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from femend import Channel, Dof, TimeData, functions_of, write_uff
from femend.cli import main

sys.path.insert(0, str(Path(__file__).parents[1]))
import small_study

N = 512
U = small_study.force(2.0, 1, N)
Y = np.random.default_rng(2).standard_normal((4, N))


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A study that can be read; each test breaks one thing of it."""
    (tmp_path / "model.bdf").write_text(small_study.deck())
    write_uff(tmp_path / "low.uff", functions_of(small_study.recording("low", U, Y)))
    (tmp_path / "study.toml").write_text(small_study.study_text({"low": "fit"}))
    return tmp_path


def refused(folder: Path, *words: str, command: str = "diagnose", study: str = "study.toml") -> None:
    """The command ends with code 2, says all the words in one message, and leaves no output behind."""
    done = CliRunner().invoke(main, [command, str(folder / study), "--out", str(folder / "out"), "--quiet"])
    assert done.exit_code == 2, done.output
    assert done.stderr.startswith("error: ")
    assert "Traceback" not in done.output
    missing = [word for word in words if word not in done.stderr]
    assert missing == [], done.stderr
    assert not (folder / "out").exists()


def replace_in(path: Path, old: str, new: str) -> None:
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))


def write(folder: Path, channels: list[Channel], values: np.ndarray, rate: float = small_study.RATE) -> None:
    write_uff(folder / "low.uff", functions_of(TimeData("low", 1 / rate, values, tuple(channels))))


FORCE = Channel(Dof(13, 3), "force", "N")
SENSOR = Channel(Dof(7, 3), "acceleration", "m/s^2")


def test_missing_deck_and_recording(folder: Path) -> None:
    (folder / "low.uff").rename(folder / "lower.uff")
    refused(folder, "low.uff does not exist", "did you mean 'lower.uff'", "recording[0].file")
    (folder / "lower.uff").rename(folder / "low.uff")
    (folder / "model.bdf").unlink()
    refused(folder, "model.bdf does not exist", "model.file")


def test_unknown_key(folder: Path) -> None:
    replace_in(folder / "study.toml", "ratio =", "ratoi =")
    refused(folder, "'ratoi' is no key of [damping]", "did you mean 'ratio'")


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("GRID,8,,0.420,0.,0.", "GRID,8,,0.42x,0.,0.", ("model.bdf:1", "0.42x")),
        ("CONM2,100,9,,0.1", "CFOO,100,9,,0.1", ("model.bdf", "CFOO")),
        ("GRID,8,", "GRID,7,,0.41,0.,0.\nGRID,8,", ("model.bdf", "GRID", "7")),
        ("GRID,8,,0.420,0.,0.", "GRID,8,,0.360,0.,0.", ("CBAR 7", "length")),
    ],
    ids=["syntax error", "unknown card", "duplicate id", "zero-length beam"],
)
def test_deck(folder: Path, old: str, new: str, words: tuple[str, ...]) -> None:
    replace_in(folder / "model.bdf", old, new)
    refused(folder, *words)


def test_sensor_without_a_node(folder: Path) -> None:
    write(folder, [FORCE, Channel(Dof(99, 3), "acceleration", "m/s^2")], np.array([U, Y[0]]))
    refused(folder, "sensor 99:+Z", "the 13 nodes of the model", "correct the node number")


def test_sensor_far_from_every_node(folder: Path) -> None:
    write(folder, [FORCE, Channel(Dof(99, 3), "acceleration", "m/s^2")], np.array([U, Y[0]]))
    geometry = "    -1\n    15\n" + f"{99:10d}{0:10d}{0:10d}{8:10d}{0.3:13.5e}{2.5:13.5e}{0.0:13.5e}\n" + "    -1\n"
    with (folder / "low.uff").open("ab") as file:
        file.write(geometry.encode())
    refused(folder, "99", "2.5", "node")


def test_not_a_number(folder: Path) -> None:
    values = np.array([U, Y[0]])
    values[1, 256] = mark = 12345.678
    write(folder, [FORCE, SENSOR], values)
    file = folder / "low.uff"
    raw, told = file.read_bytes(), np.float64(mark).tobytes()
    assert raw.count(told) == 1
    file.write_bytes(raw.replace(told, np.float64(np.nan).tobytes()))
    refused(folder, "low", "7:+Z", "0.5 s")


def test_zero_channel(folder: Path) -> None:
    write(folder, [FORCE, SENSOR], np.array([U, 0 * U]))
    refused(folder, "low", "7:+Z", "is 0 in all 512 samples")


def test_unequal_lengths(folder: Path) -> None:
    a, b = (functions_of(TimeData("low", 1 / 512, x[None], (c,))) for x, c in ((U, FORCE), (Y[0, :400], SENSOR)))
    write_uff(folder / "low.uff", [*a, *b])
    refused(folder, "'low'", "400", "512", "equal length")


def test_no_force_channel(folder: Path) -> None:
    write(folder, [SENSOR], Y[:1])
    refused(folder, "'low'", 'excitation = "measured"', "force")


@pytest.mark.parametrize("command", ["correlate", "update", "diagnose"])
def test_no_response_channel(folder: Path, command: str) -> None:
    write(folder, [FORCE], U[None])
    said = "has no response channel" if command == "diagnose" else "has no response with a DOF"
    refused(folder, f"'low' {said}", "node and direction", command=command)


@pytest.mark.parametrize("command", ["correlate", "update"])
def test_a_band_beyond_the_lines(folder: Path, command: str) -> None:
    replace_in(folder / "study.toml", "[damping]", "[correlation]\nband = [500, 800]\n[damping]")
    refused(folder, "0 lines lie in the band 500 to 800 Hz", "widen the band or take finer lines", command=command)


def test_a_force_where_the_deck_holds(folder: Path) -> None:
    write(folder, [Channel(Dof(1, 3), "force", "N"), SENSOR], np.array([U, Y[0]]))
    refused(folder, "'low'", "the force 1:+Z acts where the model cannot move", "correct its node or direction")


def test_a_force_that_is_its_mean(folder: Path) -> None:
    write(folder, [FORCE, SENSOR], np.array([U + 1000.0, Y[0]]))
    refused(
        folder, "'low'", "all but 1 % of the force's power is its mean", "has a mean of 1000 N", "take it off before"
    )


@pytest.mark.parametrize("node", [0, -3])
def test_a_number_that_no_node_has(folder: Path, node: int) -> None:
    channel = f'[[recording.channel]]\nsource = 0\nnode = {node}\ndirection = "Z"\nquantity = "force"\nunit = "N"\n'
    (folder / "study.toml").write_text((folder / "study.toml").read_text() + channel)
    refused(folder, "recording[0].channel[0].node", f"{node} is no number of a node")


def test_truncated_binary_record(folder: Path) -> None:
    file = folder / "low.uff"
    file.write_bytes(file.read_bytes()[:-2000])
    refused(folder, "low.uff", "record")


def test_binary_records_copied_as_text(folder: Path) -> None:
    file = folder / "low.uff"
    file.write_bytes(file.read_bytes().replace(b"\n", b"\r\n"))
    refused(folder, "low.uff", "are not followed by a separator", "copy it in binary mode")


def test_wrong_byte_order(folder: Path) -> None:
    file = folder / "low.uff"
    raw = file.read_bytes()
    said, told = b"    58b     1     2", b"    58b     2     2"
    assert said in raw
    file.write_bytes(raw.replace(said, told))
    refused(folder, "low.uff", "byte order")


def test_singular_model(folder: Path) -> None:
    """Two nodes without mass that hold each other and nothing else: neither stiffness nor inertia resists."""
    more = "GRID,20,,0.,0.,1.\nGRID,21,,0.,0.,1.1\nCELAS2,900,1.0E5,20,3,21,3\nENDDATA"
    replace_in(folder / "model.bdf", "ENDDATA", more)
    refused(folder, "singular", "move without stiffness and without mass: 21:+Z")


def test_a_record_too_slow_for_the_model(folder: Path) -> None:
    """The lowest mode lies above half of the rate: nothing in the recording can be compared with the model."""
    write(folder, [FORCE, SENSOR], np.array([U, Y[0]]), rate=16.0)
    refused(folder, "'low' is sampled at 16 Hz", "too slow for the model, whose lowest mode is at", "Hz or more")


def test_a_record_too_slow_for_the_others(folder: Path) -> None:
    for name in ("high", "more"):
        write_uff(folder / f"{name}.uff", functions_of(small_study.recording(name, U, Y)))
    write(folder, [FORCE, SENSOR], np.array([U, Y[0]]), rate=128.0)
    (folder / "study.toml").write_text(small_study.study_text(dict.fromkeys(("low", "high", "more"), "fit")))
    refused(folder, "'low' is sampled at 128 Hz", "the band of the fit recordings is", "too slow for its end")


def test_nothing_to_fit(folder: Path) -> None:
    replace_in(folder / "study.toml", 'role = "fit"', 'role = "validate"')
    refused(folder, 'role = "fit"')


def test_excitation_the_fit_cannot_use(folder: Path) -> None:
    replace_in(folder / "study.toml", 'role = "fit"', 'role = "fit"\nexcitation = "ambient"')
    refused(folder, "'low'", 'excitation = "ambient"', "another")


def test_users_files_are_left_alone(folder: Path) -> None:
    before: Callable[[], dict[str, bytes]] = lambda: {p.name: p.read_bytes() for p in folder.iterdir()}  # noqa: E731
    kept = before()
    write(folder, [FORCE], U[None])
    kept["low.uff"] = (folder / "low.uff").read_bytes()
    refused(folder)
    assert before() == kept


@pytest.mark.parametrize("command", ["diagnose", "update", "correlate", "pretest"])
def test_a_file_where_results_belong_is_told_before_anything_is_read(folder: Path, command: str) -> None:
    out = folder / "notes.txt"
    out.write_text("mine")
    (folder / "model.bdf").unlink()  # would be told first if the study were read
    done = CliRunner().invoke(main, [command, str(folder), "--out", str(out), "--quiet"])
    assert done.exit_code == 2
    assert done.stderr == f"error: {out} is a file; give a folder for the results\n"
    assert out.read_text() == "mine"


def test_a_record_of_a_few_samples(folder: Path) -> None:
    n = 20
    write_uff(folder / "low.uff", functions_of(small_study.recording("low", U[:n], Y[:, :n])))
    refused(folder, "recording 'low': 20 samples, 0.0391 s, are too few to be fitted, which takes 34 at least")


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('units = "SI"', "units = SI", ("line 5", "'units = SI'", "text stands in quotes")),
        ('file = "low.uff"', 'file = "data\\low.uff"', ("line", "write paths with / or in single quotes")),
        ("ratio = 0.01", "ratio = 0,01", ("'ratio = 0,01'", "decimals have a point")),
        ("ratio = 0.01", "ratio = .01", ("'ratio = .01'", "a decimal point stands between digits")),
        ("ratio = 0.01", "ratio = 1.", ("'ratio = 1.'", "5.0, not 5. or .5")),
        ("[damping]", "[correlation]\nband = [5., 400.0]\n[damping]", ("'band = [5., 400.0]'", "between digits")),
        ("ratio = 0.01", "ratio = 1 %", ("shares are numbers, 1 % is 0.01",)),
    ],
    ids=["no quotes", "backslash", "decimal comma", "point first", "point last", "in an array", "percent"],
)
def test_toml_that_is_none_shows_the_line(folder: Path, old: str, new: str, words: tuple[str, ...]) -> None:
    replace_in(folder / "study.toml", old, new)
    refused(folder, "is not valid TOML", *words)


def test_a_deck_or_a_recording_in_place_of_a_study(folder: Path) -> None:
    refused(folder, "model.bdf: is not valid TOML", "a study is a .toml file", study="model.bdf")


def test_a_folder_in_place_of_a_file(folder: Path) -> None:
    (folder / "deck").mkdir()
    replace_in(folder / "study.toml", "model.bdf", "deck")
    refused(folder, "deck is a folder, not a file; correct the name")
    done = CliRunner().invoke(main, ["inspect", str(folder)])
    assert done.exit_code == 2
    assert "is a folder; name a file in it" in done.stderr


def test_time_in_milliseconds_is_thought_of(folder: Path) -> None:
    write(folder, [FORCE, SENSOR], np.array([U, Y[0]]), rate=small_study.RATE / 1000)
    refused(folder, "is sampled at 0.512 Hz", "'time [ms]'")
