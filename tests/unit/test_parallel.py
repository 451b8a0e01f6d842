"""Two laws that no single one stands for, at one node: what is left of the recovered force starts the second."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from femend.diagnose.fitting.terms import Term
from femend.diagnose.several.parallel import _others, what_is_left
from femend.physics import physics
from femend.study.result.study_run import StudyRun

sys.path.insert(0, str(Path(__file__).parents[1]))
from small_study import Truth, diagnosed, searched

NODE = 13
BILINEAR = {"k_plus": 500.0, "k_minus": 3000.0}
VISCOELASTIC = {"k0": 50.0, "k1": 6000.0, "tau": 0.004}


@pytest.fixture(scope="module")
def both(tmp_path_factory: pytest.TempPathFactory) -> StudyRun:
    laws = [(NODE, "bilinear_stiffness", BILINEAR), (NODE, "viscoelastic", VISCOELASTIC)]
    return diagnosed(tmp_path_factory.mktemp("parallel"), Truth((7.3e10, 6.8e10), laws=laws))


def test_each_is_told_at_the_node(both: StudyRun) -> None:
    findings = {f["physics"]: f for f in both.result["findings"]}
    assert set(findings) == {"bilinear_stiffness", "viscoelastic"}
    assert [f["location"]["nodes"] for f in findings.values()] == [[NODE], [NODE]]
    law = {k: v["value"] for k, v in findings["bilinear_stiffness"]["parameters"].items()}
    # what both directions have in common cannot be told from the elastic part of the other
    assert law["k_minus"] - law["k_plus"] == pytest.approx(2500.0, rel=0.1)
    assert findings["viscoelastic"]["parameters"]["k1"]["value"] == pytest.approx(6000.0, rel=0.1)


def test_the_final_model_holds_both(both: StudyRun) -> None:
    held = next(p for p in both.predictions if p.name == "held")
    assert held.error("final") < 0.03


def test_what_a_law_does_is_taken_off_the_force(both: StudyRun) -> None:
    best = next(r for r in both.diagnosis.ranked if r.name == "viscoelastic" and r.recovered is not None)
    recovered = best.recovered
    assert recovered is not None
    rest = what_is_left(recovered, best.candidate)
    v = best.candidate.values
    for i, x in enumerate(recovered.s):
        k = v["k0"] + v["k1"] * x * v["tau"] / (1 + x * v["tau"])
        np.testing.assert_allclose(recovered.F[i] - rest.F[i], k[:, None] * recovered.D[i], rtol=1e-9, atol=1e-12)
        lines = np.fft.rfft(rest.f[i], axis=1)[:, recovered.index[i]].T
        np.testing.assert_allclose(lines, rest.F[i], rtol=1e-6, atol=1e-9 * np.abs(rest.F[i]).max())


def test_two_laws_of_one_family_or_two_linear_ones_are_no_two_effects(both: StudyRun) -> None:
    d = both.diagnosis
    best = next(r for r in d.ranked if r.name == "viscoelastic" and r.recovered is not None)
    first = searched(d, [best])
    tried = {c.name for c in _others(first, best, best.candidate)}
    assert "bilinear_stiffness" in tried
    assert not tried & {"viscoelastic", "viscous_damper", "structural_damping", "quadratic_damping"}
    assert not tried & {"added_mass", "tuned_absorber", "support_stiffness"}


def test_a_fraction_stays_one_where_a_step_goes_beyond(both: StudyRun) -> None:
    best = both.diagnosis.ranked[0]
    entry = physics("springpot")
    law = replace(best.candidate, physics=entry, name="structural_damping", coordinates=None, x=np.log([50.0, 1.3]))
    values, k, c = Term(law, best.located).values(law.x)
    assert values == {"c": pytest.approx(50.0), "alpha": 1.0}
    assert (k, c) == (0.0, 0.0)
