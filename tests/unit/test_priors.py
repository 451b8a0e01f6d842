"""Priors that can hardly be meant are told with what they say and what is usual."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from femend.study.doubts.priors import bounds_told, far_told, prior_doubts
from femend.study.file.study import Parameter
from femend.study.run import diagnose

sys.path.insert(0, str(Path(__file__).parents[1]))
from small_study import LEVELS, PARAMETERS, Truth, study_text, write_study


@pytest.mark.parametrize("sd", [0.005, 0.02, 0.1, 0.5])
def test_usual_priors_are_not_told(sd: float) -> None:
    assert (
        prior_doubts([Parameter("E", "E", "material", (1,), sd), Parameter("k", "k1", "property_id", (1,), 2 * sd)])
        == []
    )


@pytest.mark.parametrize(
    ("sd", "said"),
    [
        (5.0, ("500 %", "a factor of 150", "5 % is 0.05", "0.1, which is 10 %")),
        (7e9, ("not at all",)),
        (1e-5, ("0.001 %", "not a value in its unit", "can hardly move")),
    ],
)
def test_others_are_told_by_name(sd: float, said: tuple[str, ...]) -> None:
    (text,) = prior_doubts([Parameter("E_beam", "E", "material", (1,), sd)])
    assert text.startswith("parameter 'E_beam'")
    for part in said:
        assert part in text, text


def test_a_joint_may_be_known_to_its_order_of_magnitude() -> None:
    assert prior_doubts([Parameter("joint", "k4", "property_id", (1,), 2.3)]) == []
    (text,) = prior_doubts([Parameter("joint", "k4", "property_id", (1,), 10.0)])
    assert "springs and joints" in text


def test_bounds_that_a_diagnosis_does_not_hold_are_told_with_where_values_came_to() -> None:
    free = Parameter("nu", "nu", "material", (1,), 0.1)
    E = Parameter("E_base", "E", "material", (1,), 0.1, (0.98, 1.02))
    k = Parameter("k", "k1", "property_id", (1,), 0.3, (0.5, 2.0))
    assert bounds_told([free], {"nu": 3.0}) == []
    (begun,) = bounds_told([free, E])
    assert begun.startswith("bounds of parameter 'E_base' hold in `femend update`; a diagnosis keeps to prior_sd")
    assert "outside" not in begun
    (done,) = bounds_told([free, E, k], {"E_base": 1.064, "k": 1.9, "nu": 3.0})
    assert "bounds of parameters 'E_base', 'k' hold" in done
    assert done.endswith("'E_base' came to 1.064 times the deck's value, outside of its 0.98 to 1.02")


def test_values_far_outside_of_their_priors_are_told() -> None:
    E, rho = Parameter("E1", "E", "material", (1,), 0.05), Parameter("rho1", "rho", "material", (1,), 0.02)
    assert far_told([E, rho], {"E1": 1.15, "rho1": 0.95}) == []
    assert far_told([E, rho], {"E1": None}) == []
    (one,) = far_told([E, rho], {"E1": 1.594, "rho1": 1.005})
    assert one.startswith("parameter 'E1' came to 1.594 times the deck's value, 9.3 of its prior standard deviations")
    assert "prior_sd = 0.05" in one
    assert "it has taken up something else" in one
    assert "widen prior_sd" in one
    (both,) = far_told([E, rho], {"E1": 0.8, "rho1": 1.826})
    assert both.index("'rho1'") < both.index("'E1'")
    assert "4.5 of its prior" in both
    assert "they have taken up" in both


@pytest.mark.parametrize(("sd", "told"), [(0.02, True), (0.1, False)])
def test_a_diagnosis_tells_them_by_their_priors(tmp_path: Path, sd: float, told: bool) -> None:
    """The root is 17 % stiffer than in the deck: 7.9 deviations of one prior, 1.6 of another."""
    path = write_study(tmp_path, Truth((8.2e10, 7e10)))
    text = study_text({name: role for name, (role, _) in LEVELS.items()}, PARAMETERS)
    path.write_text(text.replace("material = 1", f"material = 1\nprior_sd = {sd}"))
    warnings = diagnose(path).result["warnings"]
    assert any(text.startswith("parameter 'E_root' came to") for text in warnings) is told
