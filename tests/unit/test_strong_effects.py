"""Effects of a hundred times the noise: a law's misfit has minima everywhere, and the right one has to be come to."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[1]))
from small_study import Truth, diagnosed

MODULI = (7.2e10, 6.9e10)


@pytest.mark.parametrize(
    ("node", "law", "values"),
    [
        # between stiff and soft beside the beam: no few sizes of a spring begin near it
        (9, "support_stiffness", {"k": 3.0e4}),
        # with 10 % more mass a fit ends elsewhere, but not in a window on the beginning
        (9, "tuned_absorber", {"m": 0.3, "k": 1.71e5, "c": 13.6}),
        # a dashpot comes nearest to it, and no spring
        (13, "quadratic_damping", {"c": 30.0}),
    ],
)
def test_it_is_named_where_it_is(tmp_path: Path, node: int, law: str, values: dict[str, float]) -> None:
    run = diagnosed(tmp_path, Truth(MODULI, laws=[(node, law, values)]))
    (finding,) = run.result["findings"]
    assert run.result["verdict"] == "missing-physics"
    assert (finding["physics"], finding["location"]["nodes"]) == (law, [node])
    for name, value in values.items():
        assert finding["parameters"][name]["value"] == pytest.approx(value, rel=0.03)
    assert all(fit["final"] < 0.011 for fit in run.result["fit"] if fit["role"] != "predict")
