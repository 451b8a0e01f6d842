"""The hammer test of the motor rig: five modes, and what mass, geometry and the nominal model say about them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from femend import read_recording
from femend.analysis.modes import solve_modes
from femend.data import FRF, Geometry, ModeSet, Recording
from femend.dof import Dof
from femend.modal import ModalTest, identify_modes, unseen_modes
from femend.modal.checks import rigid_body_rows
from femend.model import Model, read_model

CENTRE = 500  # the node of the rigid block's mass


@pytest.fixture(scope="module")
def public(shared_root: Path) -> Path:
    folder = shared_root / "cases" / "rig" / "public"
    if not folder.is_dir():
        pytest.skip("no cases/rig in the shared data")
    return folder


@pytest.fixture(scope="module")
def hammer(public: Path) -> Recording:
    return read_recording(public / "ema_hammer.uff")


@pytest.fixture(scope="module")
def model(public: Path) -> Model:
    return read_model(public / "model.bdf", spc=1)


@pytest.fixture(scope="module")
def geometry(model: Model) -> Geometry:
    centre = model.xyz[model.index(CENTRE)]
    return Geometry(model.node_ids, model.xyz - centre)


@pytest.fixture(scope="module")
def test_of_rig(hammer: Recording, geometry: Geometry) -> ModalTest:
    return identify_modes(hammer, geometry=geometry)


def test_five_modes_and_nothing_left_but_noise(test_of_rig: ModalTest) -> None:
    test = test_of_rig
    assert test.modes.n_modes == 5
    assert test.roved == "inputs"
    assert (test.status, test.advice) == ("ok", ())
    assert test.error == pytest.approx(test.noise_share, rel=0.05)
    assert test.mpc.min() > 0.99
    assert np.all(test.modes.freq_sd < 1e-3 * test.modes.freq)
    assert np.all(test.modes.zeta_sd < 0.05 * test.modes.zeta)


def test_the_modes_carry_the_mass_of_the_block(test_of_rig: ModalTest, geometry: Geometry) -> None:
    # Shapes are mass-normalised by the driving point alone; the rigid block's mass and inertias (card CONM2 9001, known
    # to 3 %) must give modal mass 1 again. Springs and plate weigh next to nothing.
    M = np.diag([18.0, 18.0, 18.0, 0.11, 0.19, 0.17])
    modes = test_of_rig.modes.to_mode_set()
    rows = rigid_body_rows(modes.dofs, geometry)
    q = np.linalg.lstsq(rows, modes.phi, rcond=None)[0]
    assert np.diag(q.T @ M @ q) == pytest.approx(1.0, abs=0.1)
    off = q.T @ M @ q - np.diag(np.diag(q.T @ M @ q))
    assert np.abs(off).max() < 0.1


def model_shapes(model: Model, dofs: tuple[Dof, ...]) -> tuple[NDArray, NDArray]:
    K, M = model.matrices()
    a_set = tuple(Dof(i + 1, 1) for i in range(K.shape[0]))  # the labels do not matter here
    modes = solve_modes(K.indptr, K.indices, K.data, M.data, a_set, n_modes=6).modes
    return modes.freq, (model.transformation() @ modes.phi)[[model.row(dof) for dof in dofs]]


def test_the_nominal_model_has_their_neighbours_and_one_more(test_of_rig: ModalTest, model: Model) -> None:
    modes = test_of_rig.modes.to_mode_set()
    freq, phi = model_shapes(model, modes.dofs)
    mac = (modes.phi.T @ phi) ** 2 / np.outer(np.sum(modes.phi**2, axis=0), np.sum(phi**2, axis=0))
    partner = np.argmax(mac, axis=1)
    assert sorted(set(partner)) == [0, 1, 2, 4, 5]
    assert mac.max(axis=1).min() > 0.8
    # springs are known to 20 %, which is 10 % in frequency
    assert np.abs(modes.freq / freq[partner] - 1).max() < 0.1
    # what no partner has is yaw near 15 Hz, which a vertical reference cannot see
    nominal = ModeSet(freq, np.zeros(6), phi, modes.dofs)
    (yaw,) = unseen_modes(nominal, test_of_rig.modes.reference_dofs, (0.0, 60.0))
    assert (yaw.number, yaw.freq) == (4, pytest.approx(15.2, abs=0.1))
    assert unseen_modes(nominal, [Dof(505, c) for c in (1, 2, 3)]) == ()


def altered(hammer: Recording, change: Callable[[NDArray], None]) -> FRF:
    frf = hammer.frf
    H = frf.H.copy()
    change(H)
    return FRF(frf.name, frf.freq, H, frf.outputs, frf.inputs, frf.kind, frf.unit)


def test_a_reversed_blow_is_named(hammer: Recording, geometry: Geometry) -> None:
    dofs = hammer.frf.input_dofs
    row = dofs.index(Dof(502, 2))

    def turn(H: NDArray) -> None:
        H[:, :, row] *= -1

    test = identify_modes(altered(hammer, turn), geometry=geometry)
    assert test.status == "doubtful"
    assert [(c.verdict, c.subject) for c in test.checks if c.kind == "rigid body"] == [("reversed", "502:+Y")]
    assert any("502:+Y" in line for line in test.advice)


def test_exchanged_blows_are_named(hammer: Recording, geometry: Geometry) -> None:
    dofs = hammer.frf.input_dofs
    a, b = dofs.index(Dof(501, 3)), dofs.index(Dof(507, 1))

    def exchange(H: NDArray) -> None:
        H[:, :, [a, b]] = H[:, :, [b, a]]

    test = identify_modes(altered(hammer, exchange), geometry=geometry)
    assert [(c.verdict, c.subject) for c in test.checks if c.kind == "rigid body"] == [("swapped", "501:+Z and 507:+X")]


def test_a_reversed_driving_point_is_named(hammer: Recording) -> None:
    def turn(H: NDArray) -> None:
        H[:] *= -1  # the one reference sensor is upside down

    test = identify_modes(altered(hammer, turn))
    assert [(c.kind, c.subject, c.verdict) for c in test.checks] == [("driving point", "505:+Z", "reversed")]
    assert test.status == "doubtful"
