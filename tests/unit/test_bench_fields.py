"""Fields of factors and links that a study lets `femend update` keep: a soft stretch found, parts of a kind held equal,
what a configuration has of its own, and what cannot be meant."""

from __future__ import annotations

import csv
import json
import sys
from pathlib import Path

import numpy as np
import pytest

from femend import Dof, model_modes, pretest_study, update_study
from femend.bench import UpdateRun
from femend.bench.reading.fields import neighbours
from femend.errors import ModelError, StudyError
from femend.model import Parameter, read_model
from femend.study import load_study
from femend.study.file.bench_settings import FieldSettings

sys.path.insert(0, str(Path(__file__).parents[1]))
import small_study
from bench_study import write_modes

DOFS = tuple(Dof(n, 3) for n in (3, 5, 7, 9, 11, 13))
HEAD = """format = "femend-study/1"
title = "cantilever"
[model]
file = "model.bdf"
"""
RECORDING = """[[recording]]
name = "test"
file = "test.uff"
"""
# a stretch that is soft in its middle, as one with cracks
SOFT = 1.0 - 0.3 * np.exp(-(((np.arange(1, 13) - 8.0) / 2.0) ** 2))
FIELD = """[updating]
shape_sd = 0.01
[[updating.field]]
name = "E"
property = "E"
elements_of = [1, 2]
prior_sd = 0.3
neighbour_sd = 0.05
bounds = [0.3, 2.0]
"""


def measure(
    folder: Path,
    name: str,
    parameters: list[Parameter],
    factors: dict[str, float],
    mass: float = 0.0,
    noise: float = 0.0,
) -> None:
    """Modes of the deck in `folder` at `factors`, with a mass at its tip; `noise` is a share of each shape's largest
    component."""
    added = [(13, mass)] if mass else []
    model = read_model(folder / "model.bdf", parameters=parameters, added_mass=added)
    modes = model_modes(model, n_modes=5, factors=factors)
    phi = modes.phi[[modes.dofs.index(d) for d in DOFS]]
    phi = phi + noise * np.abs(phi).max(axis=0) * np.random.default_rng(2).standard_normal(phi.shape)
    write_modes(folder / f"{name}.uff", modes.freq, phi, DOFS)


@pytest.fixture(scope="module")
def soft(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("soft")
    (folder / "model.bdf").write_text(small_study.deck())
    parts = [Parameter(f"e{i}", "E", "elements", (i,)) for i in range(1, 13)]
    measure(folder, "test", parts, dict(zip([p.name for p in parts], SOFT.tolist(), strict=True)), noise=0.01)
    (folder / "study.toml").write_text(HEAD + RECORDING + FIELD)
    return folder


@pytest.fixture(scope="module")
def run(soft: Path) -> UpdateRun:
    return update_study(soft, soft / "out")


def test_a_soft_stretch_is_found_where_it_is(run: UpdateRun, soft: Path) -> None:
    found = np.array([run.factors[f"E {i}"] for i in range(1, 13)])
    np.testing.assert_allclose(found[2:10], SOFT[2:10], atol=0.05)
    assert int(np.argmin(found[:11])) == 7
    # without neighbours the same data leave each part to itself
    (soft / "rough.toml").write_text(
        (soft / "study.toml").read_text().replace("neighbour_sd = 0.05", "neighbour_sd = 9")
    )
    rough = update_study(soft / "rough.toml")
    apart = np.array([rough.factors[f"E {i}"] for i in range(1, 13)])
    assert np.linalg.norm(found - SOFT) == pytest.approx(0.11, abs=0.02)
    assert np.linalg.norm(apart - SOFT) == pytest.approx(0.19, abs=0.03)


def test_what_is_said_of_a_field(run: UpdateRun, soft: Path) -> None:
    out = soft / "out"
    (told,) = json.loads((out / "updating.json").read_text())["fields"]
    assert len(told["parts"]) == 12
    assert told["neighbours"] == [[f"E {i}", f"E {i + 1}"] for i in range(1, 12)]
    assert told["least"]["part"] == "E 8"
    steps = np.diff(list(told["parts"].values()))
    assert told["neighbours_differ"] == pytest.approx(np.sqrt(np.mean(steps**2)))
    page = (out / "updating.html").read_text()
    assert "Field: E" in page
    assert "12 parts with a factor each, 11 pairs of neighbours held alike" in page
    assert "field     E: 12 parts from 0.7" in repr(run)
    with (out / "updating.fields.csv").open() as file:
        assert [row["part"] for row in csv.DictReader(file)] == [f"E {i}" for i in range(1, 13)]
    # a part is told by the data where they, not its neighbours, take its prior variance away
    prior = np.sqrt(np.diag(np.linalg.inv(run.problem.unknowns.precision)))
    learned = 1 - (run.found.sd["E 1"] / prior[0]) ** 2
    assert run.result["parameters"]["E 1"]["learned"] == pytest.approx(learned)
    assert prior[0] < 0.2


def test_neighbours_of_shells_have_an_edge_in_common(tmp_path: Path) -> None:
    lines = ["SOL 103", "CEND", "SPC = 1", "BEGIN BULK", "MAT1,1,7.+10,,0.3,2700.", "SPC1,1,123456,1,2,3"]
    lines += [f"PSHELL,{p},1,0.01,1,,1" for p in (1, 2, 3, 4)]
    lines += [f"GRID,{1 + i + 3 * j},,{i:.1f},{j:.1f},0." for j in range(3) for i in range(3)]
    corners = [(1 + i + 3 * j, 2 + i + 3 * j, 5 + i + 3 * j, 4 + i + 3 * j) for j in range(2) for i in range(2)]
    lines += [f"CQUAD4,{k},{k}," + ",".join(map(str, c)) for k, c in enumerate(corners, 1)]
    path = tmp_path / "plate.bdf"
    path.write_text("\n".join([*lines, "ENDDATA", ""]))
    model = read_model(path, parameters=[Parameter(f"t {p}", "t", "property_id", (p,)) for p in (1, 2, 3, 4)])
    settings = FieldSettings("t", 0.1, "t", "property_ids", (1, 2, 3, 4))
    assert neighbours(model, settings) == [("t 1", "t 2"), ("t 1", "t 3"), ("t 2", "t 4"), ("t 3", "t 4")]
    with pytest.raises(ModelError, match="field 't': t 1 touches no other part of it"):
        neighbours(model, FieldSettings("t", 0.1, "t", "property_ids", (1, 4)))
    assert neighbours(model, FieldSettings("t", 0.1, "t", "property_ids", (1, 4), in_order=True)) == [("t 1", "t 4")]


TWO = """[[parameter]]
name = "E_root"
property = "E"
material = 1
[[parameter]]
name = "E_tip"
property = "E"
material = 2
[[configuration]]
name = "loaded"
added_mass = [{ node = 13, m = 0.15 }]
[[recording]]
name = "test"
file = "test.uff"
[[recording]]
name = "more"
file = "more.uff"
configuration = "loaded"
"""


@pytest.fixture(scope="module")
def two(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The root is at 1.1 and the tip at its square in the one configuration, the root softer in the other."""
    folder = tmp_path_factory.mktemp("two")
    (folder / "model.bdf").write_text(small_study.deck())
    parameters = list(small_study.PARAMETERS)
    measure(folder, "test", parameters, {"E_root": 1.1, "E_tip": 1.21})
    measure(folder, "more", parameters, {"E_root": 0.9, "E_tip": 1.21}, 0.15)
    return folder


def study(folder: Path, tables: str, name: str = "study") -> Path:
    (folder / f"{name}.toml").write_text(HEAD + TWO + tables)
    return folder / f"{name}.toml"


OWN = '[[updating.link]]\nparameter = "E_root"\nown = true\nconfigurations = ["loaded"]\n'
LINKED = '[[updating.link]]\nparameter = "E_tip"\nto = ["E_root"]\npowers = [2]\n'


def test_a_configuration_has_a_value_of_its_own(two: Path) -> None:
    run = update_study(study(two, OWN), two / "own")
    assert run.factors == pytest.approx({"E_root": 1.1, "E_tip": 1.21}, rel=2e-3)
    result = json.loads((two / "own" / "updating.json").read_text())
    own = result["parameters"]["E_root (loaded)"]
    assert own["factor"] == pytest.approx(0.9, rel=2e-3)
    assert own["prior_sd"] == 0.1
    assert result["links"][0]["value"] == own["factor"]
    # each recording is compared afterwards with what its configuration has
    assert max(r["after"]["freq_error"] for r in result["recordings"]) < 5e-4
    assert "E_root is a value of its own in loaded: 0.9" in repr(run)
    assert "a value of its own" in (two / "own" / "updating.html").read_text()
    one = update_study(study(two, "", "one"))
    assert max(r["after"]["freq_error"] for r in one.result["recordings"]) > 5e-3


def test_a_parameter_follows_another(two: Path) -> None:
    # in the first configuration alone, in which the tip is the square of the root
    text = LINKED + 'configurations = ["as modelled"]\n' + OWN.replace('"E_root"', '"E_tip"', 1)
    text = text + OWN
    run = update_study(study(two, text, "linked"), two / "linked")
    assert run.problem.unknowns.names == ("E_root", "E_tip (loaded)", "E_root (loaded)")
    assert run.factors == pytest.approx({"E_root": 1.1, "E_tip": 1.21}, rel=2e-3)
    deck = (two / "linked" / "model.updated.bdf").read_text()
    modulus = float(next(x for x in deck.splitlines() if x.startswith("MAT1,2,")).split(",")[2].replace("+", "e+", 1))
    assert modulus == pytest.approx(7e10 * run.factors["E_tip"], rel=1e-6)
    assert "E_tip is E_root^2 in as modelled" in repr(run)


def test_a_value_that_only_others_tell_is_left_as_drawn(two: Path) -> None:
    both = OWN + OWN.replace('"loaded"', '"as modelled"')
    run = update_study(study(two, both, "both"))
    assert run.problem.unknowns.names == ("E_tip", "E_root (loaded)", "E_root (as modelled)")
    assert run.factors["E_root"] == pytest.approx(1.1, rel=2e-3)
    text = HEAD + TWO.replace('[[recording]]\nname = "test"\nfile = "test.uff"\n', "") + OWN
    (two / "lost.toml").write_text(text)
    lost = update_study(two / "lost.toml")
    assert lost.factors["E_root"] == 1.0
    (said,) = [w for w in lost.result["warnings"] if "[[updating.link]]" in w]
    assert said.startswith("E_root: what was found is of other configurations")


FIELDS = '[[updating.field]]\nname = "E"\nneighbour_sd = 0.1\n'


@pytest.mark.parametrize(
    ("tables", "message"),
    [
        (FIELDS, r"field\[0\]: field 'E' has no parts; give exactly one of elements, elements_of, property_ids"),
        (FIELDS + "elements = [1, 2]\n", r"field\[0\].property: field 'E': is missing; say what the factors are on"),
        (FIELDS + 'elements = [1, 1]\nproperty = "E"\n', r"field 'E': 1 stands twice"),
        (FIELDS + 'elements = [1]\nproperty = "E"\n', r"field 'E': 1 given; give 2 or more"),
        (FIELDS + 'materials = [1, 2]\nproperty = "t"\n', r"'t' is no property of materials; give property_ids in"),
        (FIELDS + 'parameters = ["E_root", "E_tp"]\n', r"'E_tp' is none of .*did you mean 'E_tip'"),
        (
            FIELDS + 'parameters = ["E_root", "E_tip"]\nprior_sd = 0.2\n',
            r"prior_sd: field 'E': the parameters have theirs",
        ),
        (FIELDS.replace("0.1", "0") + "elements = [1, 2]\n", r"neighbour_sd: field 'E': 0 is not above 0"),
        (FIELDS + "elements = [1, 2]\nsmooth = 1\n", r"'smooth' is no key of \[updating.field\[0\]\]"),
        ('[updating]\nposterior = "sampled"\n' + FIELDS + 'parameters = ["E_root", "E_tip"]\n', r"draws start from"),
        (
            LINKED.replace("E_tip", "E_tp"),
            r"link\[0\].parameter: 'E_tp' is none of E_root, E_tip; did you mean 'E_tip'",
        ),
        (LINKED.replace('to = ["E_root"]\n', ""), r"link\[0\].to: link of 'E_tip': is missing; name what it follows"),
        (LINKED.replace("[2]", "[2, 1]"), r"powers: link of 'E_tip': \[2.0, 1.0\] are not 1 numbers other than 0"),
        (LINKED + "scale = -1\n", r"scale: link of 'E_tip': -1 is not above 0"),
        (LINKED + LINKED, r"'E_tip' is linked twice in configuration 'as modelled'"),
        (LINKED + OWN, r"'E_tip' is linked to 'E_root', which is linked itself in configuration 'loaded'"),
        (OWN.replace('configurations = ["loaded"]\n', ""), r"configurations: link of 'E_root': is missing"),
        (LINKED + FIELDS + 'parameters = ["E_root", "E_tip"]\n', r"'E_tip' is a part of field 'E' too"),
    ],
)
def test_tables_that_cannot_be_meant(two: Path, tables: str, message: str) -> None:
    with pytest.raises(StudyError, match=message):
        load_study(study(two, tables, "broken"))


def test_elements_and_properties_that_are_not_there(soft: Path) -> None:
    for given, message in (
        ("elements_of = [3]", "field 'E': no element has property 3; correct elements_of"),
        ("elements = [1, 99]", "parameter 'E 99': the deck has no element 99"),
    ):
        (soft / "missing.toml").write_text((soft / "study.toml").read_text().replace("elements_of = [1, 2]", given))
        with pytest.raises(ModelError, match=message):
            update_study(soft / "missing.toml")


def test_a_plan_is_made_without_them(two: Path) -> None:
    run = pretest_study(study(two, LINKED + "[pretest]\nmodes = [1, 2]\nsensors = 3\nvirtual_test = false\n", "plan"))
    assert any("the plan leaves [[updating.link]] out" in w for w in run.result["warnings"])
