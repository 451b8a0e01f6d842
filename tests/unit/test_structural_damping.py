"""Constant structural damping with all that causality asks for with it."""

from __future__ import annotations

import sys
from math import exp, log
from pathlib import Path

import numpy as np
import pytest

from femend import _core
from femend.physics.causal import box_spectrum, springpot, structural, structural_jacobian

sys.path.insert(0, str(Path(__file__).parents[1]))
from small_study import BAND, Truth, diagnosed

OMEGA = 300.0


@pytest.mark.parametrize("values", [springpot(3e4, 0.3, OMEGA), box_spectrum(3e4, 0.3, OMEGA)])
def test_stiffness_and_loss_are_those_of_the_law(values: dict[str, float]) -> None:
    law = "springpot" if "alpha" in values else "box_spectrum"
    kappa, _ = _core.law_dynamic_stiffness(law, values, np.array([1j * OMEGA]))
    assert kappa[0] == pytest.approx(3e4 * (1 + 0.3j))
    assert structural(values, OMEGA) == {"k": pytest.approx(3e4), "eta": pytest.approx(0.3)}
    slopes = structural_jacobian(values, OMEGA)
    for j, name in enumerate(values):
        moved = [structural({**values, name: exp(log(values[name]) + h)}, OMEGA) for h in (-1e-5, 1e-5)]
        expected = [(moved[1][q] - moved[0][q]) / 2e-5 for q in ("k", "eta")]
        assert slopes[:, j] == pytest.approx(expected, rel=1e-5, abs=1e-9)


def test_with_little_loss_both_laws_are_one() -> None:
    s = 2j * np.pi * np.geomspace(20.0, 120.0, 9)
    a, b = (
        _core.law_dynamic_stiffness(law, make(3e4, 0.05, OMEGA), s)[0]
        for law, make in (("springpot", springpot), ("box_spectrum", box_spectrum))
    )
    np.testing.assert_allclose(a, b, rtol=2e-3)


def test_a_strong_constant_loss_over_a_wide_band_is_named(tmp_path: Path) -> None:
    k, eta = 2e4, 0.6
    # branches from a third of the band to three times its end, each with the same share of the loss
    omega = 2 * np.pi * np.geomspace(BAND[0] / 3, 3 * BAND[1], 6)
    middle, own = 2 * np.pi * np.sqrt(BAND[0] * BAND[1]), 2 / np.pi * k * eta * np.log(omega[1] / omega[0])
    k0 = k - float(np.sum(own / (1 + (omega / middle) ** 2)))
    halves = [
        {"k0": k0 / 2, **{f"k{i + 1}": own for i in range(3)}, **{f"tau{i + 1}": 1 / w for i, w in enumerate(part)}}
        for part in (omega[:3], omega[3:])
    ]
    truth = Truth((7.3e10, 6.8e10), laws=[(10, "generalised_maxwell_3", half) for half in halves])
    run = diagnosed(tmp_path, truth)
    (finding,) = run.result["findings"]
    assert (finding["physics"], finding["location"]["nodes"]) == ("structural_damping", [10])
    found = {name: q["value"] for name, q in finding["parameters"].items()}
    assert found == {"k": pytest.approx(k, rel=0.1), "eta": pytest.approx(eta, rel=0.1)}
    assert "those at 33.8 Hz" in run.result["advice"]
    assert next(p for p in run.predictions if p.name == "held").error("final") < 0.02
