"""What the terminal says of modes without a mate."""

from __future__ import annotations

from femend.bench.correlation.correlation_words import _alone


def modes(alone: list[tuple[int, float]]) -> dict[str, list[object]]:
    return {"rows": [{"freq_a": 157.0}, {"freq_a": 433.0}], "alone_a": [], "alone_b": [list(a) for a in alone]}


def test_modes_that_the_test_did_not_show_are_named() -> None:
    (said,) = _alone(modes([(0, 25.52), (4, 900.0)]))
    assert said == "modes of the model up to there without a mate: 1 (25.52 Hz)"


def test_modes_beyond_the_test_are_not() -> None:
    assert _alone(modes([(4, 900.0)])) == []
    assert _alone({"rows": [], "alone_a": [], "alone_b": [[0, 25.0]]}) == []


def test_of_many_the_first_are_named() -> None:
    (said,) = _alone(modes([(k, 20.0 + k) for k in range(9)]))
    assert said.endswith("6 (25 Hz) and 3 more")
