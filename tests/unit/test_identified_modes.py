"""Modes as a test identifies them: order, labels, deviations, real shapes, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest

from femend.data import IdentifiedModes
from femend.data.identified import real_shapes
from femend.dof import Dof
from femend.errors import RecordingError

DOFS = (Dof(1, 3), Dof(2, 3, -1))
POLES = 2 * np.pi * np.array([5.0, 3.0]) * (-0.01 + 1j * np.sqrt(1 - 0.01**2))


def test_modes_are_sorted_with_all_they_carry() -> None:
    modes = IdentifiedModes(
        DOFS, POLES, np.array([[1, 2], [3, 4]]) + 0j, np.array([[1], [3]]) + 0j, (Dof(1, 3),), np.array([0.5, 0.3])
    )
    assert modes.freq == pytest.approx([3.0, 5.0])
    assert modes.zeta == pytest.approx([0.01, 0.01])
    assert modes.shapes.real.tolist() == [[2, 1], [4, 3]]
    assert modes.participation is not None
    assert modes.participation.real.tolist() == [[3], [1]]
    assert modes.freq_sd is not None
    assert modes.freq_sd.tolist() == [0.3, 0.5]
    assert modes.zeta_sd is not None
    assert np.isnan(modes.zeta_sd).all()
    assert modes.to_dict()["zeta_sd"] == [None, None]
    assert modes.select([1]).freq == pytest.approx([5.0])
    assert not modes.poles.flags.writeable


def test_real_shapes_do_not_depend_on_phase() -> None:
    rng = np.random.default_rng(0)
    shape = rng.standard_normal((6, 1))
    turned = real_shapes(shape * np.exp(1j * 0.7))
    assert turned == pytest.approx(shape * np.sign(shape[np.argmax(np.abs(shape))]))


def test_mode_set_of_a_scaled_mode_is_mass_normalised() -> None:
    phi = np.array([[0.2], [-0.5]])
    pole = POLES[:1]
    modes = IdentifiedModes(DOFS, pole, phi / np.sqrt(2j * pole.imag), scaling="modal A")
    assert np.abs(modes.to_mode_set().phi) == pytest.approx(np.abs(phi))
    assert modes.to_mode_set().scaling == "mass"
    free = IdentifiedModes(DOFS, pole, 7j * phi)
    assert free.to_mode_set().phi.ravel() == pytest.approx([-0.4, 1.0])
    assert free.to_mode_set().scaling == "max"


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"poles": POLES.conj()}, "positive frequency"),
        ({"shapes": np.ones((3, 2)) + 0j}, "shapes has shape"),
        ({"shapes": np.full((2, 2), np.nan) + 0j}, "not a number"),
        ({"freq_sd": np.ones(3)}, "freq_sd has shape"),
        ({"scaling": "mass"}, "is none of modal A, unscaled"),
        ({"participation": np.ones((2, 1)) + 0j}, "participation has shape"),
    ],
)
def test_what_does_not_fit_is_refused(change: dict[str, object], told: str) -> None:
    given: dict[str, object] = {"dofs": DOFS, "poles": POLES, "shapes": np.ones((2, 2)) + 0j, **change}
    with pytest.raises(RecordingError, match=told):
        IdentifiedModes(**given)  # type: ignore[arg-type]
