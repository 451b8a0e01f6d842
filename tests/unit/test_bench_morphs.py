"""Positions that a study lets `femend update` change: a joint that stands too high is found; what cannot be meant."""

from __future__ import annotations

import csv
import json
import sys
from pathlib import Path

import numpy as np
import pytest

from femend import Dof, correlate_study, model_modes, pretest_study, read_model, update_study
from femend.bench import UpdateRun
from femend.bench.reading.morphs import morphs_on
from femend.errors import GeometryError, ModelError, StudyError
from femend.model import Morph, grown, nodes_moved, offset_along_normal
from femend.study import load_study
from femend.study.file.bench_settings import MorphSettings

sys.path.insert(0, str(Path(__file__).parents[1]))
import small_study
from bench_study import write_modes
from morph_models import frame_deck, rib_deck

DOFS = tuple(Dof(n, c) for n in (3, 12, 21, 32, 42) for c in (1, 2, 3))
APEX, E = 0.035, 0.92
HEAD = """format = "femend-study/1"
title = "portal frame"
[model]
file = "frame.bdf"
[[parameter]]
name = "E"
property = "E"
material = 1
prior_sd = 0.05
bounds = [0.7, 1.4]
[[recording]]
name = "test"
file = "test.uff"
"""
JOINT = """[[updating.morph]]
name = "apex"
move = "joint"
nodes = [21]
direction = [0, 0, 1]
held = [4, 41]
prior_sd = 0.05
bounds = [-0.2, 0.2]
"""


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("frame")
    truth = model_modes(read_model(frame_deck(folder / "truth", apex=APEX)), n_modes=6)
    phi = truth.phi[[truth.dofs.index(d) for d in DOFS]]
    frame_deck(folder)
    write_modes(folder / "test.uff", truth.freq * np.sqrt(E), phi, DOFS)
    path = folder / "study.toml"
    path.write_text(HEAD + "[updating]\nshape_sd = 0.01\n" + JOINT)
    return path


@pytest.fixture(scope="module")
def run(study: Path) -> UpdateRun:
    return update_study(study, study.parent / "out")


def test_a_joint_that_stands_too_high_is_found(run: UpdateRun) -> None:
    assert run.found.status == "converged"
    # frequencies are known to 0.1 %, which is 0.2 % of E; the priors hold back by far less
    assert run.amplitudes == {"apex": pytest.approx(APEX, abs=2e-4)}
    assert run.factors == {"E": pytest.approx(E, abs=5e-4)}
    apex = run.result["parameters"]["apex"]
    assert (apex["unit"], apex["prior_sd"], apex["before"]) == ("m", 0.05, 0.0)
    assert apex["value"] == run.amplitudes["apex"]
    assert apex["determined"]
    # the comparison afterwards is at the moved joint
    after = run.result["recordings"][0]["after"]
    assert after["freq_error"] < 1e-4 < run.result["recordings"][0]["before"]["freq_error"]


def test_the_written_deck_has_the_joint_where_it_was_found(run: UpdateRun, study: Path) -> None:
    out = study.parent / "out"
    # the nodes stand in a file of their own, which changes too
    assert "GRID,21,,1.5,0.," in (out / "model.updated.nodes.bdf").read_text()
    z = float(next(x for x in (out / "model.diff").read_text().splitlines() if x.startswith("+GRID,21,")).split(",")[5])
    assert z == pytest.approx(2.1 + run.amplitudes["apex"], abs=1e-8)
    page = (out / "updating.html").read_text()
    assert "amplitudes of positions (apex), 0 in the deck" in page
    with (out / "updating.parameters.csv").open() as file:
        rows = {r["parameter"]: r for r in csv.DictReader(file)}
    assert float(rows["apex"]["value"]) == pytest.approx(APEX, abs=2e-4)
    assert json.loads((out / "updating.json").read_text())["parameters"]["E"]["factor"] == run.factors["E"]


def test_a_morph_alone_is_enough_and_correlation_takes_the_deck_as_it_stands(study: Path) -> None:
    path = study.parent / "alone.toml"
    start, end = HEAD.index("[[parameter]]"), HEAD.index("[[recording]]")
    path.write_text(HEAD[:start] + HEAD[end:] + "[updating]\nshape_sd = 0.01\n" + JOINT)
    run = update_study(path)
    assert list(run.result["parameters"]) == ["apex"]
    compared = correlate_study(path)
    said = "the deck is compared as it stands, the amplitudes of [[updating.morph]] (apex) being 0 in it"
    assert any(w.startswith(said) for w in compared.result["warnings"])
    assert compared["test"].modes.freq[:6] == pytest.approx(run.before[0].modes.freq[:6], rel=1e-12)


PLAN = "[pretest]\nsensors = 8\nmodes = [1, 2, 3, 4]\n"


def test_a_plan_tells_what_the_test_would_tell_of_a_position(study: Path, tmp_path: Path) -> None:
    frame_deck(tmp_path)
    path = tmp_path / "study.toml"
    path.write_text(HEAD[: HEAD.index("[[recording]]")] + PLAN + JOINT)
    run = pretest_study(path, tmp_path / "out")
    forecast = {p["name"]: p for p in run.result["forecast"]["parameters"]}
    assert set(forecast) == {"E", "apex"}
    assert "unit" not in forecast["E"]
    assert (forecast["apex"]["unit"], forecast["apex"]["prior_sd"]) == ("m", 0.05)
    assert forecast["apex"]["determined"]
    # the rehearsal's frame has its apex elsewhere, and the update on its identified modes finds it
    (apex,) = (p for p in run.result["virtual_test"]["parameters"] if p["name"] == "apex")
    assert apex["truth"] != 0.0
    assert apex["within_three_sd"]
    assert f"{forecast['apex']['expected_sd']:.3g} m" in repr(run)
    assert "0.05 m" in (tmp_path / "out" / "pretest.html").read_text()


def test_a_place_on_a_rigid_element_that_moves_leaves_positions_out_of_the_plan(tmp_path: Path) -> None:
    more = ("GRID,20,,0.72,0.,0.1", "RBE2,900,13,123456,20")
    (tmp_path / "model.bdf").write_text(small_study.deck(more=more))
    path = tmp_path / "study.toml"
    morph = (
        '[[updating.morph]]\nname = "tip"\nmove = "vectors"\nprior_sd = 0.01\n'
        "vectors = [{ node = 13, vector = [1, 0, 0] }]\n"
    )
    path.write_text(small_study.study_text({}) + "[pretest]\nsensors = 4\nmodes = [1, 2]\n" + morph)
    run = pretest_study(path)
    assert [p["name"] for p in run.result["forecast"]["parameters"]] == ["E_root", "E_tip"]
    (said,) = [w for w in run.result["warnings"] if "updating.morph" in w]
    assert said.startswith("the plan leaves tip of [[updating.morph]] where the deck has them: sensor 20:")
    # nor does it where a sensor there is not asked for
    path.write_text(path.read_text().replace("modes = [1, 2]", "modes = [1, 2]\nleave_out = [20]"))
    assert [p["name"] for p in pretest_study(path).result["forecast"]["parameters"]] == ["E_root", "E_tip", "tip"]


def test_matrices_at_an_amplitude_are_those_of_the_moved_deck(tmp_path: Path) -> None:
    moved = read_model(frame_deck(tmp_path / "moved", apex=0.02))
    model = read_model(frame_deck(tmp_path / "deck"))
    morph = MorphSettings("apex", "joint", 0.05, None, (21,), (0.0, 0.0, 1.0), (4, 41))
    model = model.with_morphs(morphs_on(model, [morph]))
    for a, b in zip(model.matrices({"apex": 0.02}), moved.matrices(), strict=True):
        # coordinates of the decks have nine digits
        assert abs(a - b).max() < 1e-7 * abs(b).max()
    assert model_modes(model, n_modes=3).freq == pytest.approx(
        model_modes(model, n_modes=3, factors={"apex": 0.0}).freq
    )
    with pytest.raises(ModelError, match="no parameter is called 'knee'"):
        model.matrices({"knee": 0.1})


def same(a: Morph, b: Morph) -> bool:
    return (
        a.nodes.tolist() == b.nodes.tolist() and np.array_equal(a.field, b.field) and (a.prior_sd, a.bounds, a.unit) ==
        (b.prior_sd, b.bounds, b.unit)
    )  # fmt: skip


def test_every_move_is_that_of_python(tmp_path: Path) -> None:
    model = read_model(rib_deck(tmp_path))
    tables = """
[[updating.morph]]
name = "lid"
move = "offset"
properties = [4]
prior_sd = 0.002
bounds = [-0.004, 0.004]
[[updating.morph]]
name = "tip"
move = "nodes"
nodes = [70]
direction = [0, 0, 2]
radius = 0.2
held = [1]
prior_sd = 0.001
[[updating.morph]]
name = "length"
move = "growth"
nodes = [65, 66, 67, 68, 69, 70, 71, 72]
point = [0, 0, 0]
axis = [1, 0, 0]
along = true
prior_sd = 0.01
[[updating.morph]]
name = "corner"
move = "vectors"
vectors = [{ node = 72, vector = [0, 0, 1] }, { node = 64, vector = [0, 0, 0.5] }]
prior_sd = 0.001
"""
    path = tmp_path / "study.toml"
    (tmp_path / "test.uff").write_text("")
    path.write_text(HEAD.replace("frame.bdf", "rib.bdf") + tables)
    found = morphs_on(model, load_study(path).updating.morph)
    nodes = list(range(65, 73))
    wanted = (
        offset_along_normal(model, "lid", 0.002, properties=(4,), bounds=(-0.004, 0.004)),
        nodes_moved(model, "tip", 0.001, [70], (0, 0, 2), 0.2, held=[1]),
        grown(model, "length", 0.01, nodes, (0, 0, 0), axis=(1, 0, 0), along=True),
        Morph.of("corner", {72: (0, 0, 1), 64: (0, 0, 0.5)}, 0.001),
    )
    assert [m.name for m in found] == ["lid", "tip", "length", "corner"]
    assert all(same(a, b) for a, b in zip(found, wanted, strict=True))


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('name = "apex"', 'name = "E"', r"updating\.morph\[0\]\.name: 'E' is the name of a \[\[parameter\]\] too"),
        ('name = "apex"', 'name = "eta"', r"morph\[0\]\.name: 'eta' is the name of the damping too"),
        ('name = "apex"', 'name = " "', r"morph\[0\]\.name: is empty"),
        (JOINT, JOINT + JOINT, r"morph\[1\]\.name: 'apex' is the name of another too"),
        ('"joint"', '"joints"', r"morph\[0\]\.move: 'joints' is none of joint, nodes, .*did you mean 'joint'"),
        ("held = [4, 41]", "", r"morph\[0\]\.held: morph 'apex': is missing; move = 'joint' needs nodes, direction"),
        ("held = [4, 41]", "held = []", r"morph\[0\]\.held: morph 'apex': the list is empty"),
        ("held", "radius = 1.0\nheld", r"morph\[0\]\.radius: morph 'apex': move = 'joint' does not take it; it takes"),
        ("prior_sd = 0.05\nbounds = [-", "prior_sd = 0.0\nbounds = [-", r"prior_sd: morph 'apex': 0 is not above 0"),
        ("[-0.2, 0.2]", "[0.8, 1.2]", r"bounds: morph 'apex': \[0\.8, 1\.2\] is not \[lower, upper\] about 0"),
        ("[0, 0, 1]", "[0, 1]", r"direction: morph 'apex': \[0\.0, 1\.0\] are not three numbers"),
        ("[0, 0, 1]", "[0, 0, 0]", r"direction: morph 'apex': .* has no length"),
        ("move =", "mvoe =", r"updating\.morph\[0\]\.mvoe: 'mvoe' is no key of .*did you mean 'move'"),
        (JOINT, '[[updating.morph]]\nname = "a"\nmove = "offset"\nprior_sd = 0.1\n', r"name the shells by properties"),
    ],
)
def test_tables_that_are_refused(study: Path, old: str, new: str, message: str) -> None:
    text = study.read_text()
    assert old in text
    path = study.parent / "refused.toml"
    path.write_text(text.replace(old, new, 1))
    with pytest.raises(StudyError, match=message):
        load_study(path)


def test_what_the_deck_does_not_have_is_named(study: Path) -> None:
    path = study.parent / "lacking.toml"
    path.write_text(study.read_text().replace("nodes = [21]", "nodes = [999]"))
    with pytest.raises(ModelError, match="morph 'apex': node 999 is no GRID of the deck") as caught:
        update_study(path)
    notes = " ".join(caught.value.__notes__)
    assert "in [[updating.morph]] 'apex'" in notes
    assert "configuration 'as modelled'" in notes
    path.write_text(study.read_text().replace("[-0.2, 0.2]", "[-9.0, 0.2]").replace("[0, 0, 1]", "[1, 0, 0]"))
    with pytest.raises((GeometryError, ModelError), match="'apex'"):
        update_study(path)
