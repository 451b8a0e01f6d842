"""`[pretest] distinguish`: which explanations the planned test would tell apart, and what cannot be asked."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import pytest

from femend import pretest_study
from femend.bench import PretestRun
from femend.errors import PretestError, StudyError
from femend.estimate.updating import Unknowns, factors_of, modal_system
from femend.model.terms.linear_terms import point_mass, point_spring, weaker_element
from femend.model.terms.unknowns import Unknown
from femend.pretest import candidate_matrices, distinguish, planned_test

sys.path.insert(0, str(Path(__file__).parents[1]))
import small_study

PLAN = """[pretest]
band = [5.0, 600.0]
sensors = 5
directions = ["Z"]
placed = ["13:-Z"]
virtual_test = false
"""
ASKED = """distinguish = [
  { parameter = "E_root" },
  { physics = "added_mass", node = 9, m = 0.05 },
  { physics = "support_stiffness", node = 9, direction = "Z", k = 300.0 },
  { physics = "joint_stiffness", element = 6, change = -0.3 },
]
"""
NAMES = ["E_root", "mass at 9", "spring at 9 Z to ground", "stiffness of element 6"]


def only(entry: str, other: str = '{ parameter = "E_tip" }') -> str:
    return f"{PLAN}distinguish = [{entry}, {other}]\n"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("explanations")


@pytest.fixture(scope="module")
def run(folder: Path) -> PretestRun:
    return pretest_study(small_study.write_unrecorded(folder, PLAN + ASKED), folder / "out")


def test_distances_are_those_of_the_functions(run: PretestRun) -> None:
    model, plan = run.model, run.plan
    terms = [point_mass(model, 9, 0.05), point_spring(model, 9, 3, 300.0), weaker_element(model, 6)]
    T = model.transformation().tocsr()
    rows = T[[model.row(d) for d in plan.places]]
    rows = rows.multiply(np.array([[d.sign] for d in plan.places]))
    system = modal_system(candidate_matrices(model, terms), rows, plan.targets.modes.n_modes)
    unknowns = Unknowns.of(
        [*factors_of(model.parameters).items, *(Unknown(t.name, 1.0, False, 0.0, 1.0) for t in terms)]
    )
    test = planned_test(system, unknowns, modes=plan.targets.at.tolist(), freq_sd=0.002, shape_sd=0.05)
    again = distinguish(test, plan.placement.rows, NAMES, sizes=[0.1, 1.0, 1.0, 0.3])
    told = run.result["distinguish"]
    assert [(d["truth"], d["rival"]) for d in told] == [(d.truth, d.rival) for d in again]
    np.testing.assert_allclose([d["distance"] for d in told], [d.distance for d in again], rtol=1e-9)
    np.testing.assert_allclose([d["detected"] for d in told], [d.detected for d in again], rtol=1e-9)


def test_no_sensor_takes_away_what_a_test_tells(run: PretestRun) -> None:
    for d in run.result["distinguish"]:
        assert d["distance"] <= d["detected"] * (1 + 1e-9)
        assert d["distance"] <= d["distance_with_all_places"] * (1 + 1e-9)
        assert d["told"] == (d["distance"] >= 3.0)


def test_what_is_written_and_said(run: PretestRun, folder: Path) -> None:
    result = json.loads((folder / "out" / "pretest.json").read_text())
    assert len(result["distinguish"]) == 12
    page = (folder / "out" / "pretest.html").read_text()
    assert "Which explanations it would tell apart" in page
    assert "spring at 9 Z to ground" in repr(run)
    lost = [d for d in result["distinguish"] if not d["told"]]
    assert lost
    for d in lost:
        assert f"{d['truth']} would pass for {d['rival']}" in run.result["advice"]


def test_a_term_too_small_to_be_seen_is_told_once(tmp_path: Path) -> None:
    mass = '{ physics = "added_mass", node = 9, m = 1e-4 }'
    run = pretest_study(small_study.write_unrecorded(tmp_path, only(mass)))
    assert "the test would not show mass at 9 at its size (0.0 deviations, 3 are asked)" in run.result["advice"]
    assert "mass at 9 would pass" not in run.result["advice"]


def test_a_larger_size_is_further_away_in_proportion(tmp_path: Path) -> None:
    found = []
    for k in (100.0, 200.0):
        entry = f'{{ physics = "support_stiffness", node = 7, direction = "Z", k = {k} }}'
        run = pretest_study(small_study.write_unrecorded(tmp_path, only(entry)))
        found.append(run.result["distinguish"][0]["distance"])
    assert found[1] == pytest.approx(2 * found[0], rel=1e-6)


def test_nothing_is_told_where_nothing_was_asked(tmp_path: Path) -> None:
    run = pretest_study(small_study.write_unrecorded(tmp_path, PLAN))
    assert "distinguish" not in run.result
    assert run.plan.explanations is None


@pytest.mark.parametrize(
    ("entry", "message"),
    [
        ('{ physics = "added_mass", node = 99, m = 0.1 }', r"distinguish\[0\]: node 99 is not among the 13 nodes"),
        ('{ physics = "joint_stiffness", element = 99, change = 0.1 }', r"distinguish\[0\]: element 99 is not among"),
        (
            '{ physics = "support_stiffness", node = 1, direction = "Z", k = 1e3 }',
            r"distinguish\[0\]: spring at 1 Z to ground acts on nothing that moves",
        ),
        (
            '{ physics = "viscous_damper", node = 1, direction = "Z", c = 1.0 }',
            r"distinguish\[0\]: dashpot at 1 Z to ground acts on nothing that moves",
        ),
        (
            '{ physics = "compliant_support", nodes = [1, 99], directions = ["Z"] }',
            r"distinguish\[0\]: node 99 is not among the 13 nodes",
        ),
        (
            '{ physics = "compliant_support", nodes = [9], directions = ["Z"] }',
            r"distinguish\[0\]: no SPC set of the deck holds Z at node 9 \(there it holds Y, RX, RZ\)",
        ),
    ],
)
def test_places_that_are_none(tmp_path: Path, entry: str, message: str) -> None:
    with pytest.raises(PretestError, match=message):
        pretest_study(small_study.write_unrecorded(tmp_path, only(entry)))


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ('distinguish = [{ parameter = "E_root" }]', r"pretest\.distinguish: has one explanation; two at least"),
        ('distinguish = [{ parameter = "E_root" }, { parameter = "E_root" }]', r"distinguish\[1\]: stands twice"),
        (
            'distinguish = [{ parameter = "E" }, { parameter = "E_tip" }]',
            r"distinguish\[0\]\.parameter: 'E' is none of",
        ),
        ('distinguish = [{}, { parameter = "E_tip" }]', r"distinguish\[0\]: takes either a parameter .* or physics"),
        (
            'distinguish = [{ physics = "cubic_stiffness", node = 3 }, { parameter = "E_tip" }]',
            r"distinguish\[0\]\.physics: 'cubic_stiffness' is none of added_mass, support_stiffness, viscous_damper",
        ),
        (
            'distinguish = [{ physics = "added_mass", node = 3 }, { parameter = "E_tip" }]',
            r"distinguish\[0\]\.m: is missing; physics 'added_mass' takes node, m",
        ),
        (
            'distinguish = [{ physics = "added_mass", node = 3, m = 0.1, k = 2.0 }, { parameter = "E_tip" }]',
            r"distinguish\[0\]\.k: physics 'added_mass' does not take it; it takes node, m",
        ),
        (
            'distinguish = [{ physics = "added_mass", node = 3, m = -0.1 }, { parameter = "E_tip" }]',
            r"distinguish\[0\]\.m: -0\.1 is not above 0",
        ),
        (
            'distinguish = [{ physics = "support_stiffness", node = 3, direction = "RX", k = 1.0 }, '
            '{ parameter = "E_tip" }]',
            r"distinguish\[0\]\.direction: 'RX' is a rotation",
        ),
        (
            'distinguish = [{ physics = "viscous_damper", node = 3, direction = "Z" }, { parameter = "E_tip" }]',
            r"distinguish\[0\]\.c: is missing; physics 'viscous_damper' takes node, direction, c",
        ),
        (
            'distinguish = [{ physics = "added_mass", node = 3, m = 0.1, k = [2.0] }, { parameter = "E_tip" }]',
            r"distinguish\[0\]\.k: physics 'added_mass' does not take it",
        ),
        (
            'distinguish = [{ physics = "support_stiffness", node = 3, direction = "Z", k = [2.0] }, '
            '{ parameter = "E_tip" }]',
            r"distinguish\[0\]\.k: physics 'support_stiffness' takes one number, not a list",
        ),
        (
            'distinguish = [{ physics = "compliant_support", nodes = [1] }, { parameter = "E_tip" }]',
            r"distinguish\[0\]\.directions: is missing; physics 'compliant_support' takes nodes, directions",
        ),
        (
            'distinguish = [{ physics = "compliant_support", nodes = [1, 1], directions = ["Z"] }, '
            '{ parameter = "E_tip" }]',
            r"distinguish\[0\]\.nodes: \[1, 1\] is not a list of one at least, each once",
        ),
        (
            'distinguish = [{ physics = "compliant_support", nodes = [1], directions = ["Z", "+Z"] }, '
            '{ parameter = "E_tip" }]',
            r"distinguish\[0\]\.directions: .* has a direction twice",
        ),
        (
            'distinguish = [{ physics = "compliant_support", nodes = [1], directions = ["Z", "RY"], k = [1e5] }, '
            '{ parameter = "E_tip" }]',
            r"distinguish\[0\]\.k: \[100000\.0\] is not a list of 2, one for each of `directions`",
        ),
        (
            'distinguish = [{ physics = "compliant_support", nodes = [1], directions = ["Z"], k = [0.0] }, '
            '{ parameter = "E_tip" }]',
            r"distinguish\[0\]\.k: 0 is not above 0",
        ),
        ("damping_sd = 0.0", r"pretest\.damping_sd: 0 is not above 0"),
        (
            'distinguish = [{ parameter = "E_root", change = 0.0 }, { parameter = "E_tip" }]',
            r"distinguish\[0\]\.change: 0 is not a number other than 0",
        ),
        (
            'distinguish = [{ parameter = "E_root", mass = 1.0 }, { parameter = "E_tip" }]',
            r"pretest\.distinguish\[0\]\.mass: .*no key",
        ),
    ],
)
def test_broken_entries_are_named(tmp_path: Path, table: str, message: str) -> None:
    with pytest.raises(StudyError, match=message):
        pretest_study(small_study.write_unrecorded(tmp_path, PLAN + table + "\n"))
