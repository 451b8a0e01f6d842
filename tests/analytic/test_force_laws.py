"""Laws of bearing forces: what was put into a simulated run is the law that comes out."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from femend import Dof
from femend.errors import LoadError
from femend.estimate.joint import OdsFrf, Unbalance, compare_force_laws
from femend.model.model import read_model
from femend.model.terms.configured import ALPHA, BETA, ConfiguredModel, configure, free_model
from femend.model.terms.unknowns import Unknown, Unknowns

sys.path.insert(0, str(Path(__file__).parents[1]))
from rigs import BEARINGS, Rig, Truth, deck

Array = NDArray[np.float64]
RIG = Rig(bends=False, factors=(1.0, 1.0, 1.0), mass_factor=1.0)
SENSORS, FREQ = (501, 503, 505, 507), np.arange(5.0, 25.0, 0.4)
U = np.array([3e-3 * np.exp(0.3j), 1.2e-3 * np.exp(2.1j)])


@pytest.fixture(scope="module")
def rig(tmp_path_factory: pytest.TempPathFactory) -> tuple[ConfiguredModel, Truth]:
    """The nominal model of a clamped rig, and its truth of twice as many elements."""
    folder = tmp_path_factory.mktemp("rig")
    path = folder / "model.bdf"
    path.write_text(deck(RIG))
    free = free_model(read_model(path).deck, units="SI", parameters=[])
    # damping of the truth: 0.8 % at 7 and 19 Hz
    a, b = 2 * np.pi * 7.0, 2 * np.pi * 19.0
    beta = 2 * 0.008 / (a + b)
    unknowns = Unknowns.of([Unknown(ALPHA, a * b * beta), Unknown(BETA, beta)])
    rows = [free.row(Dof(n, c)) for n in BEARINGS for c in (1, 2, 3)]
    return configure("clamped", free, unknowns, [], spc=1, f_max=30.0, g_rows=rows), Truth(RIG, folder, clamped=True)


def shapes(truth: Truth, force: NDArray[np.complex128], sense: int, noise: float = 0.02) -> OdsFrf:
    """Accelerations per Omega^2 at all sensors to turning forces (K, 2) about X, of the true structure."""
    out = np.array([truth.row(n, c) for n in SENSORS for c in (1, 2, 3)])
    turning = np.array([truth.row(n, 2) - 1j * sense * truth.row(n, 3) for n in BEARINGS])
    s2 = -((2 * np.pi * FREQ) ** 2)
    q = np.einsum("krs,bs,kb->kr", truth.receptance(FREQ), turning, force)
    Y = s2[:, None] * (q @ out.T)
    rng = np.random.default_rng(7)
    sd = noise * np.sqrt((np.abs(Y) ** 2).mean(axis=1, keepdims=True)) * np.ones(Y.shape)
    Y = Y + sd / np.sqrt(2) * (rng.standard_normal(Y.shape) + 1j * rng.standard_normal(Y.shape))
    return OdsFrf(FREQ, Y, sd)


def seen(model: ConfiguredModel) -> tuple[Array, Array]:
    out = model.rows([model.model.row(Dof(n, c)) for n in SENSORS for c in (1, 2, 3)])
    bearings = np.array([model.rows([model.model.row(Dof(b, c)) for c in (1, 2, 3)]) for b in BEARINGS])
    return out, bearings


@pytest.mark.parametrize("sense", [1, -1])
def test_unbalance_is_named_with_size_and_phase(rig: tuple[ConfiguredModel, Truth], sense: int) -> None:
    model, truth = rig
    force = np.repeat(U[None], len(FREQ), 0)
    found = compare_force_laws(
        model, np.zeros(2), shapes(truth, force, sense), Unbalance(BEARINGS, 0, sense), *seen(model)
    )
    assert found.best == "unbalance", found.reason
    assert np.abs(found["unbalance"].force) == pytest.approx(np.abs(U), rel=0.03)
    assert np.angle(found["unbalance"].force / U) == pytest.approx(0.0, abs=np.radians(3))
    power = found["power"]
    assert abs(power.exponent - 2.0) < max(3 * power.sd, 0.02)
    assert found["unbalance"].unseen < 1.1 * min(law.unseen for law in found.laws)
    assert np.isnan(found["free"].unseen_lines)


@pytest.mark.parametrize("exponent", [1.0, 3.0])
def test_another_power_is_named(rig: tuple[ConfiguredModel, Truth], exponent: float) -> None:
    model, truth = rig
    force = U[None] * (FREQ[:, None] / FREQ[-1]) ** (exponent - 2.0)
    found = compare_force_laws(model, np.zeros(2), shapes(truth, force, 1), Unbalance(BEARINGS, 0), *seen(model))
    assert found.best == "power", found.reason
    assert found["power"].exponent == pytest.approx(exponent, abs=max(4 * found["power"].sd, 0.02))
    assert np.abs(found["power"].force) == pytest.approx(np.abs(U), rel=0.05)
    assert found["unbalance"].unseen_lines > 2 * found["power"].unseen_lines


def test_forces_without_a_law_are_free(rig: tuple[ConfiguredModel, Truth]) -> None:
    """Forces that go up and down over the speed, as a coupling or a grid makes them."""
    model, truth = rig
    force = U[None] * (1 + 0.9 * np.sin(1.7 * FREQ[:, None] + np.array([0.0, 1.0])) * np.exp(0.5j * FREQ[:, None]))
    found = compare_force_laws(model, np.zeros(2), shapes(truth, force, 1), Unbalance(BEARINGS, 0), *seen(model))
    assert found.best == "free", found.reason
    assert found["free"].unseen < 0.5 * found["power"].unseen


def test_too_few_sensors_are_refused(rig: tuple[ConfiguredModel, Truth]) -> None:
    model, truth = rig
    all_shapes = shapes(truth, np.repeat(U[None], len(FREQ), 0), 1)
    few = OdsFrf(FREQ, all_shapes.Y[:, :5], all_shapes.sd[:, :5])
    out, bearings = seen(model)
    with pytest.raises(LoadError, match="5 sensors and 50 lines for 4 forces"):
        compare_force_laws(model, np.zeros(2), few, Unbalance(BEARINGS, 0), out[:5], bearings)


@pytest.mark.parametrize(("factor", "named"), [(1.0005, "unbalance"), (1.15, None)])
def test_a_wrong_structure_is_not_taken_for_another_law(
    rig: tuple[ConfiguredModel, Truth], factor: float, named: str | None
) -> None:
    """Frequencies that are slightly off and a fifth less damping: free forces fit far better, by their evidence, and
    the law stands, since it predicts what it has not seen. Where the structure is far off there is no law with it, and
    the reason says that it may be the structure."""
    model, truth = rig
    right = shapes(truth, np.repeat(U[None], len(FREQ), 0), 1)
    shifted, p = OdsFrf(FREQ * factor, right.Y, right.sd), np.log([0.8, 0.8])
    found = compare_force_laws(model, p, shifted, Unbalance(BEARINGS, 0), *seen(model))
    assert found["free"].log_evidence > found["unbalance"].log_evidence + 100
    if named:
        assert found.best == named, found.reason
    else:
        assert found.best is None or "the structure is another" in found.reason
        assert found.best not in ("unbalance", "power")
