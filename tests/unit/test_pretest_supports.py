"""Supports that give way as explanations: the modes are those of a deck with that support, whatever its stiffness."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from femend import Dof, model_modes, pretest_study, read_model
from femend.analysis.frf import shapes_at
from femend.correlate import mac
from femend.errors import PretestError
from femend.estimate.updating import deck_system, factors_of
from femend.model import Model
from femend.pretest import GivingSupport, PlannedTest, planned_test, support_modes, with_state

sys.path.insert(0, str(Path(__file__).parents[1]))
import small_study

PLACES = [*(Dof(n, 3) for n in range(2, 13)), Dof(13, 3, -1)]
SD = {"freq_sd": 0.002, "shape_sd": 0.05}


@pytest.fixture(scope="module")
def model(tmp_path_factory: pytest.TempPathFactory) -> Model:
    return small_study.cantilever(tmp_path_factory.mktemp("supports"))[0]


def plan_of(model: Model) -> PlannedTest:
    return planned_test(deck_system(model, PLACES, 4), factors_of(model.parameters), modes=range(3), **SD)


@pytest.mark.parametrize(
    ("k", "held", "cards"),
    [
        ((2e4, 500.0), "1246", ("CELAS2,901,2.+4,1,3", "CELAS2,902,500.,1,5")),
        (None, "1246", ()),  # a body that is free to move and to turn in the plane
    ],
)
def test_modes_are_those_of_the_deck_with_that_support(
    model: Model, tmp_path: Path, k: tuple[float, ...] | None, held: str, cards: tuple[str, ...]
) -> None:
    freq, phi = support_modes(model, GivingSupport((1,), (3, 5), k), PLACES, 3)
    path = tmp_path / "other.bdf"
    path.write_text(small_study.deck(more=cards, held=held))
    other = model_modes(read_model(path), n_modes=5)
    assert len(freq) == 5
    np.testing.assert_allclose(freq, other.freq, rtol=1e-6, atol=1e-3)
    elastic = freq > 1.0
    assert (~elastic).sum() == (0 if k else 2)
    same = np.diag(mac(phi[:, elastic], shapes_at(other, PLACES)[:, elastic]))
    np.testing.assert_allclose(same, 1.0, atol=1e-8)


def test_the_step_is_the_change_of_frequencies_and_shapes(model: Model) -> None:
    plan = plan_of(model)
    freq, phi = support_modes(model, GivingSupport((1,), (5,), (2e3,)), PLACES, 3)
    more = with_state(plan, "soft clamp", freq, phi, **SD)
    assert more.names == (*plan.names, "soft clamp")
    np.testing.assert_allclose(more.frequencies[:, -1], (freq[:3] / plan.freq - 1) / 0.002, rtol=1e-12)
    np.testing.assert_array_equal(more.shapes[..., :-1], plan.shapes)
    for r in range(3):
        there = plan.motion[:, r] + more.shapes[:, r, -1]
        assert mac(there, phi[:, r]) == pytest.approx(1.0, abs=1e-12)
        assert np.linalg.norm(there) == pytest.approx(np.linalg.norm(plan.motion[:, r]))
        assert there @ plan.motion[:, r] > 0


def test_a_stiff_support_gives_way_in_proportion_to_its_compliance(model: Model) -> None:
    plan = plan_of(model)
    found = []
    for k in (1e7, 2e7):
        freq, phi = support_modes(model, GivingSupport((1,), (5,), (k,)), PLACES, 3)
        more = with_state(plan, "soft clamp", freq, phi, **SD)
        found.append(np.concatenate([more.frequencies[:, -1], more.shapes[..., -1].ravel()]))
    np.testing.assert_allclose(found[0], 2 * found[1], atol=2e-3 * np.abs(found[0]).max())


def test_what_the_deck_does_not_hold_cannot_give_way(model: Model) -> None:
    with pytest.raises(PretestError, match=r"holds Z at node 9 \(there it holds Y, RX, RZ\)"):
        support_modes(model, GivingSupport((9,), (3,)), PLACES, 3)
    with pytest.raises(PretestError, match=r"soft clamp: of the plan's 3 modes 2 have a successor"):
        with_state(plan_of(model), "soft clamp", [1.0, 2.0], np.eye(12)[:, :2], **SD)


PLAN = """[pretest]
band = [5.0, 600.0]
sensors = 5
directions = ["Z"]
virtual_test = false
"""


def test_a_study_tells_supports_from_members(tmp_path: Path) -> None:
    asked = """distinguish = [
  { physics = "compliant_support", nodes = [1], directions = ["RY"] },
  { physics = "compliant_support", nodes = [1], directions = ["RY", "Z"], k = [3000.0, 1e6] },
  { physics = "joint_stiffness", element = 1, change = -0.3 },
]
"""
    run = pretest_study(small_study.write_unrecorded(tmp_path, PLAN + asked))
    found = {(d["truth"], d["rival"]): d for d in run.result["distinguish"]}
    released, soft = "support at 1 released in RY", "support at 1 on springs in Z, RY"
    assert len(found) == 6
    # a hinge is a clamp that turns as far as it can, and the member that follows bends the same way
    member = "stiffness of element 1"
    assert found[released, member]["distance"] > found[soft, member]["distance"] > 3.0
    for d in found.values():
        assert d["distance"] < 0.9 * d["detected"]
        assert d["distance"] <= d["distance_with_all_places"] * (1 + 1e-9)
    assert soft in repr(run)


def test_supports_and_dashpots_need_no_parameter(tmp_path: Path) -> None:
    asked = """distinguish = [
  { physics = "compliant_support", nodes = [1], directions = ["RY"], k = [3000.0] },
  { physics = "viscous_damper", node = 13, direction = "Z", c = 5.0 },
]
"""
    run = pretest_study(small_study.write_unrecorded(tmp_path, PLAN + asked, ()))
    for d in run.result["distinguish"]:
        assert d["distance"] == pytest.approx(d["detected"], rel=1e-9)
        assert d["detected"] > 3
