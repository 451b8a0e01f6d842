"""Two linear laws at two places: fitted together on lines, and what their simulation makes of them."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from femend.diagnose.fitting import closed_loop
from femend.diagnose.fitting.terms import Term, Terms, fit_terms
from femend.diagnose.naming.ranked import Ranked
from femend.diagnose.several.pairs import Searched
from femend.diagnose.several.together import fitted_together, told_plainly
from femend.diagnose.updating.levels import element_depends_on_level
from femend.physics import physics
from femend.study.result.study_run import StudyRun

sys.path.insert(0, str(Path(__file__).parents[1]))
from small_study import Truth, diagnosed

DASHPOT, SPRING = 20.0, 4.0e4


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> StudyRun:
    laws = [(7, "viscous_damper", {"c": DASHPOT}), (13, "support_stiffness", {"k": SPRING})]
    return diagnosed(tmp_path_factory.mktemp("linear"), Truth((7.3e10, 6.8e10), laws=laws))


def replace_values(term: Term, factor: float) -> Term:
    x = term.candidate.x + np.log(factor)
    return replace(term, candidate=replace(term.candidate, x=x))


def both(run: StudyRun) -> Terms:
    further = run.diagnosis.further
    assert further is not None
    return further.terms


def test_both_are_named_with_their_sizes(run: StudyRun) -> None:
    findings = {f["physics"]: f for f in run.result["findings"]}
    assert set(findings) == {"viscous_damper", "support_stiffness"}
    assert findings["viscous_damper"]["parameters"]["c"]["value"] == pytest.approx(DASHPOT, rel=0.1)
    assert findings["support_stiffness"]["parameters"]["k"]["value"] == pytest.approx(SPRING, rel=0.1)


def test_lines_and_simulation_leave_the_same(run: StudyRun) -> None:
    terms = both(run)
    loop = terms.loop(run.diagnosis.problem)
    assert loop.linear
    (e,), _ = loop.residuals([(terms.p, terms.x)])
    left = float(e @ e) / loop.size()
    (fit,) = loop.problem.fit([loop.hypothesis(terms.x)], [(terms.p, terms.x)], iterations=0)
    assert fit is not None
    assert fit.score == pytest.approx(left, rel=0.1)


def test_each_law_acts_at_its_own_coordinate(run: StudyRun) -> None:
    terms = both(run)
    hypothesis = terms.loop(run.diagnosis.problem).hypothesis(terms.x)
    assert hypothesis.laws is not None
    assert hypothesis.at == ((0,), (1,))
    s = np.array([2j * np.pi * 50.0])
    kappa = terms.loop(run.diagnosis.problem).stiffness(terms.x, s)
    assert kappa.shape == (1, 2)
    (spring,) = (t for t in terms.terms if t.candidate.name == "support_stiffness")
    at = hypothesis.laws.index("support_stiffness")
    assert kappa[0, at] == pytest.approx(spring.candidate.values["k"])


def test_terms_far_off_are_fitted_back(run: StudyRun) -> None:
    terms, d = both(run), run.diagnosis
    moved = [replace_values(t, 3.0) for t in terms.terms]
    found = fit_terms(d.problem, moved, d.reduced, d.g_rows, terms.p)
    assert found is not None
    assert found.fitted == pytest.approx(terms.fitted, rel=0.02)
    np.testing.assert_allclose(found.x, terms.x, atol=0.05)


def test_steps_err_with_their_fourth_power(run: StudyRun, monkeypatch: pytest.MonkeyPatch) -> None:
    """All modes stepped, and a support far softer than the one found, so that nothing has to keep it stable."""
    monkeypatch.setattr(closed_loop, "STATIC", np.inf)
    terms = both(run)
    loop = terms.loop(run.diagnosis.problem)
    x = terms.x + np.log([0.02, 0.02])

    def lines(substeps: int) -> np.ndarray:
        finer = replace(loop, substeps=substeps)
        (histories,) = finer.histories([(terms.p, x)])
        return np.concatenate([finer.spectra(h.y, i).ravel() for i, h in enumerate(histories)])

    exact = lines(128)
    off = {n: float(np.linalg.norm(lines(n) - exact) / np.linalg.norm(exact)) for n in (8, 16)}
    assert off[8] < 2e-3
    assert off[16] < off[8] / 10


def test_a_spring_and_dashpot_fit_all_levels_of_linear_laws_alike(run: StudyRun) -> None:
    d = run.diagnosis
    (spring,) = (t for t in both(run).terms if t.candidate.name == "support_stiffness")
    assert spring.candidate.joint is not None
    p = d.problem.prior(d.reduced)[0]
    assert not element_depends_on_level(d.problem, spring.candidate.joint, p)
    one_level = d.problem.on(d.problem.records[:1])
    assert not element_depends_on_level(one_level, spring.candidate.joint, p)


def test_a_heavy_soft_absorber_is_told_as_a_dashpot(run: StudyRun) -> None:
    """The dashpot of the truth as an absorber of many kilograms on hardly any spring."""
    d = run.diagnosis
    terms = both(run)
    dashpot = next(t for t in terms.terms if t.candidate.name == "viscous_damper")
    absorber = physics("tuned_absorber")
    values = {"m": 50.0, "k": 10.0, "c": DASHPOT}
    x = np.log([values[n] for n in absorber.parameter_names])
    richer = replace(
        dashpot.candidate, physics=absorber, name="tuned_absorber", values=values, x=x, n_law=3, covariance=None
    )
    given = [replace(t, candidate=richer) if t is dashpot else t for t in terms.terms]
    noise = Ranked(terms.terms[0].candidate, terms.terms[0].located, 1e4)
    first = Searched(d.problem, d.reduced, d.g_rows, d.split, [], d.located, [noise], d.settings, d.n_values, 1e4, 0.0)
    found = fitted_together(first, given, terms.p)
    assert found is not None
    assert {t.candidate.name for t in found[1].terms} == {"support_stiffness", "tuned_absorber"}
    plain = told_plainly(first, found)
    assert {t.candidate.name for t in plain[1].terms} == {"support_stiffness", "viscous_damper"}
    told = next(t for t in plain[1].terms if t.candidate.name == "viscous_damper")
    assert told.candidate.values["c"] == pytest.approx(DASHPOT, rel=0.1)
