"""Priors that can hardly be meant are told with what they say and what is usual."""

from __future__ import annotations

import pytest

from femend.study.priors import prior_doubts
from femend.study.study import Parameter


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
