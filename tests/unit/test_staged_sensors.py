"""Sensors that run against the model, told by shapes of identified modes."""

from __future__ import annotations

import numpy as np

from femend.data import IdentifiedModes
from femend.diagnose.staged.prepare import ModesData
from femend.diagnose.staged.sensors import _of_modes
from femend.dof import Dof

DOFS = tuple(Dof(n, 3) for n in range(1, 9))
X = np.linspace(0.2, 1.0, 8)
SHAPES = np.column_stack([X, np.sin(5 * X), np.cos(7 * X)]).astype(complex)


def modes(shapes: np.ndarray, sd: np.ndarray | None = None) -> ModesData:
    """Identified modes with these shapes (8, m)."""
    freq = np.arange(1.0, shapes.shape[1] + 1)
    poles = 2 * np.pi * freq * (-0.01 + 1j)
    return ModesData("ambient", IdentifiedModes(DOFS, poles, shapes), sd)


def test_a_reversed_sensor_is_named_and_sound_ones_are_not() -> None:
    assert _of_modes(modes(SHAPES), SHAPES) == []
    turned = SHAPES.copy()
    turned[3] *= -1
    (said,) = _of_modes(modes(turned), SHAPES)
    assert "channel 4:+Z runs against the model" in said


def test_a_mode_that_is_none_of_the_models_turns_no_sensor() -> None:
    """A pole beside a mode, whose shape is another one: it is paired with what is left, MAC 0, and its largest
    component is one sensor's that hardly moves elsewhere."""
    shapes, computed = SHAPES.copy(), SHAPES.copy()
    shapes[5, :2] = computed[5, :2] = 1e-6
    computed[:, 2] = np.linalg.qr(np.column_stack([shapes[:, 2], np.arange(8.0)]))[0][:, 1]
    computed[5, 2] = -shapes[5, 2]
    assert _of_modes(modes(shapes), computed) == []


def test_a_component_below_its_deviation_has_no_sign() -> None:
    turned = SHAPES.copy()
    turned[3] *= -1
    sd = np.full(SHAPES.shape, 1e-3)
    sd[3] = 5.0
    assert _of_modes(modes(turned, sd), SHAPES) == []
