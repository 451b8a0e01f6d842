"""What stands beside a nonlinear law as the whole law, and linear laws held against nonlinear ones by simulation."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from femend.diagnose.fitting.candidates import Start
from femend.diagnose.fitting.linear import companions_alone
from femend.diagnose.fitting.nonlinear import fit_nonlinear
from femend.diagnose.fitting.terms import Term
from femend.diagnose.locating.joint import open_joint
from femend.diagnose.locating.recovered import recover
from femend.diagnose.several.together import fitted_together
from femend.model import find_places
from femend.physics import physics
from femend.study.result.study_run import StudyRun

sys.path.insert(0, str(Path(__file__).parents[1]))
import small_study


@pytest.fixture(scope="module")
def dashpot(tmp_path_factory: pytest.TempPathFactory) -> StudyRun:
    """A dashpot of 20 N s/m at node 7."""
    laws = [(7, "viscous_damper", {"c": 20.0})]
    return small_study.diagnosed(tmp_path_factory.mktemp("dashpot"), small_study.Truth((7.3e10, 6.8e10), laws=laws))


def test_a_dashpot_beside_a_law_that_does_nothing_is_the_whole_law(tmp_path: Path) -> None:
    laws = [(7, "viscous_damper", {"c": 20.0})]
    start = small_study.updated(tmp_path, small_study.Truth((7.3e10, 6.8e10), laws=laws))
    place = next(p for p in find_places(start.reduced.model) if (p.kind, p.nodes, p.direction) == ("ground", (7,), "Z"))
    joint = open_joint(place, start.reduced, start.problem.band[1], start.g_rows)
    recovered = recover(start.problem, joint, start.null.p)
    assert recovered is not None
    faint = Start(physics("cubic_stiffness"), {"k3": 1e3}, 0.0, 10.0, 0.5)
    (cubic,) = fit_nonlinear(start.problem, start.problem, joint, recovered, [("cubic_stiffness", faint)])
    alone = {c.name: c for c in companions_alone(start.problem, start.problem, cubic)}
    assert alone["viscous_damper"].values["c"] == pytest.approx(20.0, rel=0.03)
    assert alone["viscous_damper"].chosen < 1.05 * cubic.chosen
    if "support_stiffness" in alone:  # a faint spring beside it explains nothing by itself
        assert alone["support_stiffness"].chosen > 2 * cubic.chosen


def test_a_linear_law_leaves_as_much_by_simulation_as_on_lines(dashpot: StudyRun) -> None:
    d = dashpot.diagnosis
    best = d.ranked[0]
    assert best.name == "viscous_damper"
    first, term = small_study.searched(d), Term(best.candidate, best.located)
    found = [fitted_together(first, [term], best.candidate.p, simulated=how) for how in (False, True)]
    by_lines, by_steps = (f for f in found if f is not None)
    assert (by_lines[1].simulated, by_steps[1].simulated) == (False, True)
    assert by_steps[1].chosen == pytest.approx(by_lines[1].chosen, rel=0.05)
    values = [f[1].terms[0].candidate.values["c"] for f in (by_lines, by_steps)]
    np.testing.assert_allclose(values, 20.0, rtol=0.03)
