"""Priors that can hardly be meant are told with what they say and what is usual."""

from __future__ import annotations

import pytest

from femend.study.doubts.priors import bounds_told, prior_doubts
from femend.study.file.study import Parameter


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
