"""Values of another kind, or another number of them, given to the Python API of updating and of FRFs."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import femend as fe
from femend.errors import ArgumentError, FemendError, UpdatingError
from femend.estimate.updating import (
    Configuration,
    Frequencies,
    Problem,
    deck_system,
    multi_start,
    unknowns_of,
    update,
)
from femend.model import Parameter, read_model

sys.path.insert(0, str(Path(__file__).parents[1]))
from small_study import cantilever

SENSORS = ["7:+Z", "13:+Z"]
FREQ = np.array([20.0, 120.0])
COMPARED = Frequencies(FREQ, 0.01 * FREQ)


@pytest.mark.parametrize(
    ("call", "kind", "told"),
    [
        (lambda p, m: read_model(p, parameters=["E:1"]), ArgumentError, "a list of Parameter.* a str was given"),
        (lambda p, m: read_model(p, parameters=m.parameters[0]), ArgumentError, "a list of .* a Parameter was given"),
        (
            lambda p, m: read_model(p, parameters=[Parameter("E", "E", "material", 1)]),
            ArgumentError,
            r"'E' are a tuple, \(1,\); an int was given",
        ),
        (lambda p, m: deck_system(m, [7, 13], 2), ArgumentError, "`deck_system` takes sensors .* an int was given"),
        (
            lambda p, m: deck_system(m, SENSORS, 2).solve(np.ones(9)),
            UpdatingError,
            r"shape \(9,\) .* for the 2 parameters",
        ),
        (lambda p, m: update(m), ArgumentError, "`update` takes a Problem.* a Model was given"),
        (
            lambda p, m: Configuration("free", deck_system(m, SENSORS, 2), COMPARED),
            ArgumentError,
            "free: .* as a tuple.* a Frequencies was given",
        ),
        (
            lambda p, m: Problem(unknowns_of(m), Configuration("free", deck_system(m, SENSORS, 2), (COMPARED,))),
            ArgumentError,
            "configurations as a tuple .* a Configuration was given",
        ),
        (
            lambda p, m: multi_start(
                Problem(unknowns_of(m), (Configuration("free", deck_system(m, SENSORS, 2), (COMPARED,)),)), 0
            ),
            UpdatingError,
            "0 starts are asked for",
        ),
        (lambda p, m: fe.direct_frf(m, [1.0], [fe.Dof(7, 3)], [fe.Dof(7, 3)]), ArgumentError, "channels.* a Dof was"),
        (lambda p, m: fe.model_modes(str(p)), ArgumentError, "`model_modes` takes a model.* a str was given"),
    ],
)
def test_values_of_another_kind_are_told(
    tmp_path: Path, call: Callable[[Path, fe.Model], Any], kind: type[FemendError], told: str
) -> None:
    model, _ = cantilever(tmp_path)
    with pytest.raises(kind, match=told):
        call(tmp_path / "model.bdf", model)
