"""The electronic Duffing oscillator: a cubic spring is named and the arrow predicted."""

from __future__ import annotations

import runpy
from collections.abc import Callable
from pathlib import Path


def test_silverbox(project_root: Path, shared: Callable[[str], Path]) -> None:
    file = shared("data/silverbox/SNLS80mV.mat")
    example = runpy.run_path(str(project_root / "python" / "examples" / "silverbox.py"))
    found = example["run"](file)
    named = found.named
    assert named.best.name == "cubic_stiffness"
    assert named.accepted
    # far ahead of the next law, and it leaves a tenth of what the linear model leaves at most
    assert named.ranked[1].score - named.best.score > 100
    assert named.best.candidate.chosen < 0.1 * named.null_misfit
    # of the second laws the weak quadratic one that the circuit is known to have
    assert [law.name for law, _ in found.final.laws[0]] == ["cubic_stiffness", "quadratic_stiffness"]
    assert found.final.n_parameters <= 6
    (_, linear), (_, one), (unseen, arrow) = (found.errors(f) for f in (found.linear, found.one, found.final))
    # mV on the whole arrow, which ends at amplitudes no fit has seen; an NRMSE of 0.8 % where linear has 26 %
    assert arrow <= 0.45
    assert unseen <= 0.31
    assert one <= 0.50
    assert linear > 13
