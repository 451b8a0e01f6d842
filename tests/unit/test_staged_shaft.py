"""Where the unbalance sits and about which axis it turns, and what is not named since it lowers no error."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from femend import _core
from femend.diagnose.staged import ConfigurationSpec, Flow, Setup, Stage, setup_of
from femend.diagnose.staged.select import Rival, Round, _has_stiffness
from femend.diagnose.staged.shaft import axis_doubt, shaft_nodes, with_shaft
from femend.estimate.joint import Posterior
from femend.model import Pairing
from femend.model.terms.configured import free_model
from femend.model.terms.speed_terms import member_over_speed
from femend.study.staged.doubts import not_held_out, taken_back, without_use


def shaft(folder: Path) -> Setup:
    """A shaft of four elements along X on two legs, and a node beside it."""
    grids = [f"GRID,{10 + i},,{0.1 * i:.1f},0.,0.5" for i in range(5)]
    grids += ["GRID,1,,0.,0.,0.", "GRID,2,,0.4,0.,0.", "GRID,3,,0.2,0.3,0.5"]
    bars = [f"CBAR,{i},1,{9 + i},{10 + i},0.,1.,0." for i in range(1, 5)]
    bars += ["CBAR,5,1,1,10,0.,1.,0.", "CBAR,6,1,2,14,0.,1.,0.", "CBAR,7,1,12,3,0.,0.,1."]
    cards = ["MAT1,1,2.1+11,,0.3,7850.", "PBAR,1,1,4.-4,1.33-8,2.1-8,3.-8", "SPC1,1,123456,1,2"]
    path = folder / "shaft.bdf"
    path.write_text("\n".join(["SOL 103", "CEND", "SPC = 1", "BEGIN BULK", *grids, *bars, *cards, "ENDDATA"]) + "\n")
    free = free_model(_core.Deck.read(str(path)), units="SI", parameters=[])
    return setup_of(free, [ConfigurationSpec("bench", 1)], cast(Pairing, {}), band=(3.0, 100.0), zeta=0.01, g_rows=[])


def test_nodes_of_the_shaft_are_those_on_its_line(tmp_path: Path) -> None:
    setup = shaft(tmp_path)
    assert shaft_nodes(setup, (10, 14), 0) == (10, 11, 12, 13, 14)
    assert shaft_nodes(setup, (10, 14), 2) == (1, 10)
    assert len(with_shaft(setup, (11, 12)).g_rows) == 6


@pytest.mark.parametrize(
    ("likeness", "said"),
    [
        ((0.9, 0.11, 0.2), "CSAC of 0.11 with the model's with axis Y, 0.9 with axis X: check 'axis'"),
        ((0.9, 0.6, 0.2), ""),
        ((0.6, 0.2, 0.3), ""),
    ],
    ids=["wrong", "like enough", "none is right"],
)
def test_a_wrong_axis_is_told_with_the_right_one(likeness: tuple[float, ...], said: str) -> None:
    found = axis_doubt("runup", 1, lambda axis: likeness[axis])
    assert said in found
    assert bool(said) is bool(found)


@pytest.mark.parametrize(("a1", "possible"), [(-0.5, True), (-1.5, False)])
def test_a_stiffness_over_speed_below_nothing_is_none(tmp_path: Path, a1: float, possible: bool) -> None:
    setup = shaft(tmp_path)
    term = member_over_speed(setup.free, 5, 200.0)
    unknowns = setup.unknowns([term])
    p = unknowns.mean.copy()
    p[unknowns.index(term.unknowns[0].name)] = a1
    fitted = Posterior(unknowns, p, unknowns.precision, {"runup": 1.0}, 0.0, True)
    assert _has_stiffness(setup, term, fitted) is possible


def named() -> tuple[Flow, Flow]:
    """A flow that names a term by its run, and the one without."""
    term = cast(Any, SimpleNamespace(label="stiffness of element 8", name="", physics="joint_stiffness"))
    rival = Rival("stiffness of element 8", "joint_stiffness", term, cast(Any, None), 20.0, 1.0)
    decision = Round((rival,), rival, 1.0, 10.0)
    run = cast(Any, SimpleNamespace(other_law=False))
    stage = Stage(
        "operating shapes and loads", "as modelled", ("runup",), cast(Any, None), 0.03, 0.01, (), (decision,), run=run
    )
    plain = Stage("operating shapes and loads", "as modelled", ("runup",), cast(Any, None), 0.03, 0.01, (), run=run)
    return Flow((term,), cast(Any, None), (stage,), ((term, decision),)), Flow((), cast(Any, None), (plain,))


def predicted(before: float, after: float, role: str = "fit") -> Any:
    """A prediction of the run-up with these errors."""
    errors = {"parameters": before, "final": after}
    return SimpleNamespace(name="runup", role=role, recorded=np.ones(3), error=errors.__getitem__)


TEST = cast(Any, [SimpleNamespace(name="runup", configuration="as modelled")])


def test_what_lowers_no_error_is_not_named() -> None:
    final, plain = named()
    assert without_use(TEST, [predicted(0.12, 0.03)], final) == ""
    why = without_use(TEST, [predicted(0.955, 0.945)], final)
    assert "does not fall with it by 5 % (0.955 without, 0.945 with it)" in why
    back = taken_back(final, plain, why)
    assert back.named == ()
    assert back.beside == why
    assert back.stages[0].rounds[0].refused
    assert back.stages[0].rounds[0].taken is None


def test_what_lowers_the_error_of_fitted_recordings_alone_is_named_and_said() -> None:
    final, _ = named()
    both = [predicted(0.12, 0.03), predicted(0.14, 0.19, "validate")]
    assert without_use(TEST, both, final) == ""
    assert "(0.14 without, 0.19 with it), though that of fitted recordings does" in not_held_out(TEST, both, final)
    assert not_held_out(TEST, [predicted(0.12, 0.03)], final) == ""


def test_nothing_named_is_nothing_to_take_back() -> None:
    _, plain = named()
    assert without_use(TEST, [predicted(0.955, 0.955)], plain) == ""
