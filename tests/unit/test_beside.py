"""A spring beside a nonlinear law at the same node: told as an effect of its own, and only where it is there."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import femend
from femend.diagnose.locating.dressed import own_values, with_own
from femend.diagnose.several.beside import companions
from femend.model import Place, read_model
from femend.study.result.study_run import StudyRun

sys.path.insert(0, str(Path(__file__).parents[1]))
from small_study import Truth, deck, diagnosed, searched

K3, K = 5.0e7, 2.0e3
NODE = 13
MODULI = (7.3e10, 6.8e10)


@pytest.fixture(scope="module")
def both(tmp_path_factory: pytest.TempPathFactory) -> StudyRun:
    laws = [(NODE, "cubic_stiffness", {"k3": K3}), (NODE, "support_stiffness", {"k": K})]
    return diagnosed(tmp_path_factory.mktemp("both"), Truth(MODULI, laws=laws))


@pytest.fixture(scope="module")
def law_alone(tmp_path_factory: pytest.TempPathFactory) -> StudyRun:
    laws = [(NODE, "cubic_stiffness", {"k3": 0.2 * K3})]
    return diagnosed(tmp_path_factory.mktemp("alone"), Truth(MODULI, laws=laws))


def test_both_are_told_at_the_node(both: StudyRun) -> None:
    findings = {f["physics"]: f for f in both.result["findings"]}
    assert set(findings) == {"cubic_stiffness", "support_stiffness"}
    assert [f["location"]["nodes"] for f in findings.values()] == [[NODE], [NODE]]
    assert findings["support_stiffness"]["parameters"]["k"]["value"] == pytest.approx(K, rel=0.1)
    assert findings["cubic_stiffness"]["parameters"]["k3"]["value"] == pytest.approx(K3, rel=0.1)


def test_the_final_model_and_deck_hold_both(both: StudyRun) -> None:
    held = next(p for p in both.predictions if p.name == "held")
    assert held.error("final") < 0.03
    further = both.diagnosis.further
    assert further is not None
    law, spring = further.terms.terms
    assert law.bare
    assert further.terms.loop(both.diagnosis.problem).acting == [(0, 1)]
    assert law.candidate.k == 0.0
    assert len(further.terms.joint.w) == 1
    assert spring.values(spring.x)[0]["k"] == pytest.approx(K, rel=0.1)


def test_a_law_alone_has_nothing_beside_it(law_alone: StudyRun) -> None:
    assert [f["physics"] for f in law_alone.result["findings"]] == ["cubic_stiffness"]


def test_a_companion_that_brings_nothing_is_not_told(law_alone: StudyRun) -> None:
    d = law_alone.diagnosis
    best = d.ranked[0]
    assert companions(searched(d), best) is None
    # as if it had come out surely positive
    c = best.candidate
    x = np.concatenate([c.x[:-2], [1e-3, 1e-3]])
    sure = replace(c, k=1e-3 * c.extra["k_scale"], c=1e-3 * c.extra["c_scale"], x=x, covariance=None)
    assert companions(searched(d), replace(best, candidate=sure)) is None


def test_a_spring_is_part_of_the_model(both: StudyRun, tmp_path: Path) -> None:
    d = both.diagnosis
    place = next(f.place for f in d.located if f.place.kind == "ground" and f.place.nodes == (NODE,))
    sprung = with_own(replace(place, spring=500.0), d.reduced)
    assert sprung.extra == 1
    p = d.problem.prior(sprung)[0]
    p[len(d.reduced.names)] = np.log(K / 500.0)
    assert own_values(sprung, p) == pytest.approx({"k": K})
    assert sprung.members[-1].logarithms({"k": K})[0] == pytest.approx(np.log(K / 500.0))
    model = read_model(write_deck(tmp_path, place, K))
    found = d.problem.system(sprung).modal(p)[0][:2] / (2 * np.pi)
    np.testing.assert_allclose(found, femend.model_modes(model, f_max=200.0).freq[:2], rtol=1e-3)


def write_deck(folder: Path, place: Place, k: float) -> Path:
    """The deck with a spring at a place of one direction."""
    component = {"X": 1, "Y": 2, "Z": 3}[place.direction]
    path = folder / "sprung.bdf"
    path.write_text(deck(more=(f"CELAS2,900,{k:.6e},{place.nodes[0]},{component}",)))
    return path
