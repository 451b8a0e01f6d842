"""Choice of pairs and bands: noisy, strange and repeated ones go, and the estimate hardly loses anything."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from femend import Dof
from femend.data import ODS, Channel
from femend.errors import LoadError
from femend.estimate.joint import (
    DELAY,
    FrfBlock,
    OdsBlock,
    OdsFrf,
    Unbalance,
    choose_data,
    maximise,
    receptance,
    unbalance_unknowns,
)
from femend.estimate.loads import configured_responses, identify_loads
from femend.model import Parameter
from femend.model.model import read_model
from femend.model.terms.configured import ALPHA, BETA, ConfiguredModel, configure, free_model
from femend.model.terms.unknowns import Unknown, Unknowns

sys.path.insert(0, str(Path(__file__).parents[1]))
from rigs import BEARINGS, Rig, deck

Array = NDArray[np.float64]
FREQ = np.linspace(3.0, 25.0, 220)
PLACES = [Dof(501, 1), Dof(501, 3), Dof(503, 2), Dof(503, 3), Dof(507, 1), Dof(507, 2)]
NAMES = [str(d) for d in PLACES]


@pytest.fixture(scope="module")
def rig(tmp_path_factory: pytest.TempPathFactory) -> ConfiguredModel:
    path = tmp_path_factory.mktemp("rig") / "model.bdf"
    path.write_text(deck(Rig(bends=False)))
    parameters = [Parameter(n, n, "property_id", (11,), 0.1) for n in ("k1", "k2", "k3")]
    free = free_model(read_model(path).deck, units="SI", parameters=parameters)
    unknowns = Unknowns.of(
        [
            *(Unknown(q.name, 1.0, sd=q.prior_sd) for q in parameters),
            Unknown(ALPHA, 0.5),
            Unknown(BETA, 1e-4),
            *unbalance_unknowns(Unbalance(BEARINGS, 0), 1e-3, 1 / 256),
        ]
    )
    rows = [free.row(Dof(n, c)) for n in (*BEARINGS, 501, 505) for c in (1, 2, 3)]
    return configure("clamped", free, unknowns, [], spc=1, f_max=30.0, g_rows=rows)


def frfs(rig: ConfiguredModel, p: Array, noise: float = 0.02) -> FrfBlock:
    """Six outputs to a skew blow, with noise of a share of each FRF's root mean square."""
    out = rig.rows([rig.model.row(d) for d in PLACES])
    into = np.array([[0.5, 0.3, 0.8]]) @ rig.rows([rig.model.row(Dof(505, c)) for c in (1, 2, 3)])
    H = receptance(rig, p, 2j * np.pi * FREQ).between(out, into)
    sd = noise * np.sqrt((np.abs(H) ** 2).mean(axis=0, keepdims=True)) * np.ones(H.shape)
    rng = np.random.default_rng(5)
    H = H + sd / np.sqrt(2) * (rng.standard_normal(H.shape) + 1j * rng.standard_normal(H.shape))
    return FrfBlock("frf", rig, FREQ, H, sd, out, into)


def truth(rig: ConfiguredModel) -> Array:
    p = np.zeros(len(rig.unknowns))
    p[:3] = np.log([1.04, 0.97, 1.03])
    return p


def test_an_estimate_from_the_chosen_parts_is_nearly_as_good(rig: ConfiguredModel) -> None:
    block, start = frfs(rig, truth(rig)), np.zeros(len(rig.unknowns))
    choice = choose_data(block, start, NAMES, ["505"])
    assert 0 < choice.mask.mean() < 0.7
    assert choice.information >= 0.99 * choice.credible
    assert next(part.gain for part in choice.parts if part.used) == max(p.information for p in choice.parts if p.used)
    whole = maximise(rig.unknowns, [block], start)
    few = maximise(rig.unknowns, [block.masked(choice.mask)], start)
    assert (few.sd[:3] < 1.5 * whole.sd[:3]).all()
    assert np.allclose(few.values[:3], [1.04, 0.97, 1.03], rtol=0.005)
    assert few.n_values == pytest.approx(whole.n_values * choice.mask.mean())


def test_noisy_and_strange_pairs_are_left_out_with_the_reason(rig: ConfiguredModel) -> None:
    """One channel of noise, and one that shows a structure the model does not have."""
    block, rng = frfs(rig, truth(rig)), np.random.default_rng(6)
    H, sd = block.H.copy(), block.sd.copy()
    size = float(np.sqrt((np.abs(H[:, 1]) ** 2).mean()))
    sd[:, 1] = 3 * np.sqrt((np.abs(H[:, 1]) ** 2).mean(axis=0))
    H[:, 1] += size * 3 / np.sqrt(2) * (rng.standard_normal(H[:, 1].shape) + 1j * rng.standard_normal(H[:, 1].shape))
    w = FREQ[:, None]
    H[:, 3] = size * sum(1 / (1 - (w / f) ** 2 + 0.02j * w / f) * (-1) ** k for k, f in enumerate((4.1, 14.2, 21.5)))
    wrong = FrfBlock("frf", rig, FREQ, H, sd, block.out, block.into)
    choice = choose_data(wrong, np.zeros(len(rig.unknowns)), NAMES, ["505"])
    reasons = {part.reason for part in choice.parts if part.rows[0] == 1}
    assert reasons == {"noise"}
    strange = [part for part in choice.parts if part.rows[0] == 3]
    assert sum(part.reason == "model" for part in strange) >= len(strange) - 1
    assert not choice.mask[:, 1].any()
    said = choice.report()
    assert any("501:+Z / 505" in text and "noise" in text for text in said)
    assert any("503:+Z / 505" in text and "not credible" in text for text in said)


def test_a_channel_that_is_there_twice_adds_little(rig: ConfiguredModel) -> None:
    """The same sensor ten times: information grows like the logarithm, and most copies are left out."""
    block = frfs(rig, truth(rig))
    many = [0] * 10 + [1, 2, 3, 4, 5]
    again = FrfBlock("frf", rig, FREQ, block.H[:, many], block.sd[:, many], block.out[many], block.into)
    names = [f"copy {i}" for i in range(10)] + NAMES[1:]
    choice = choose_data(again, np.zeros(len(rig.unknowns)), names, ["505"], enough=0.95)
    copies = [part for part in choice.parts if part.rows[0] < 10]
    assert sum(part.used for part in copies) < 0.4 * len(copies)
    assert {part.reason for part in copies if not part.used} == {"adds nothing"}
    with pytest.raises(LoadError, match="3 outputs and 1 inputs are named, the block has 15 and 1"):
        choose_data(again, np.zeros(len(rig.unknowns)), names[:3], ["505"])


def operating(rig: ConfiguredModel, p: Array) -> OdsBlock:
    out = rig.rows([rig.model.row(d) for d in PLACES])
    bearings = np.array([rig.rows([rig.model.row(Dof(b, c)) for c in (1, 2, 3)]) for b in BEARINGS])
    empty = OdsFrf(FREQ, np.zeros((len(FREQ), len(out)), dtype=complex), np.ones((len(FREQ), len(out))))
    unbalance = Unbalance(BEARINGS, 0)
    Y = OdsBlock("run", rig, empty, out, bearings, unbalance).linearised(p).predicted[:, :, 0]
    sd = 0.02 * np.sqrt((np.abs(Y) ** 2).mean(axis=0)) * np.ones(Y.shape)
    return OdsBlock("run", rig, OdsFrf(FREQ, Y, sd), out, bearings, unbalance)


def loaded(rig: ConfiguredModel) -> Array:
    p = truth(rig)
    for name, value in zip(Unbalance(BEARINGS, 0).names, (2.0, 0.7, -0.5, 1.1), strict=True):
        p[rig.unknowns.index(name)] = value
    p[rig.unknowns.index(DELAY)] = 0.3
    return p


def test_operating_shapes_have_exact_gradients_and_give_structure_and_load(rig: ConfiguredModel) -> None:
    real = loaded(rig)
    block, p, step = operating(rig, real), real + 0.02 * np.random.default_rng(1).standard_normal(len(real)), 1e-6
    gradient = block.gauss_newton(p, True)[1]
    by_hand = [
        (block.gauss_newton(p + step * e, False)[0] - block.gauss_newton(p - step * e, False)[0]) / (4 * step)
        for e in np.eye(len(p))
    ]
    assert np.allclose(gradient, by_hand, rtol=1e-5, atol=1e-6 * np.abs(gradient).max())
    choice = choose_data(block, p, NAMES)
    found = maximise(rig.unknowns, [block.masked(choice.mask)], p)
    # the prior draws a little
    assert np.allclose(found.values[:3], [1.04, 0.97, 1.03], rtol=2e-3)
    assert np.allclose(found.p[5:9], real[5:9], atol=0.02)


def test_operating_shapes_are_those_of_forces_by_hand(rig: ConfiguredModel) -> None:
    """w = H f with f_u = Omega^2 U, f_v = -j Omega^2 U at each bearing, over the course, and late as the tacho."""
    real = loaded(rig)
    block = operating(rig, real)
    rows = rig.rows([rig.model.row(Dof(b, c)) for b in BEARINGS for c in (2, 3)])
    H = receptance(rig, real, 2j * np.pi * FREQ).between(block.out, rows)
    U = 1e-3 * np.array([2.0 + 0.7j, -0.5 + 1.1j])
    f = np.array([U[0], -1j * U[0], U[1], -1j * U[1]])
    expected = (H @ f) * np.exp(-2j * np.pi * FREQ * 0.3 / 256)[:, None]
    assert np.allclose(block.shapes.Y, expected, rtol=1e-9)


def test_forces_through_a_configuration_are_those_that_made_the_shapes(rig: ConfiguredModel) -> None:
    """Through the structure with its terms: the bearings' forces of the run, divided by the course."""
    real = loaded(rig)
    real[rig.unknowns.index(DELAY)] = 0.0
    block = operating(rig, real)
    rows = rig.rows([rig.model.row(Dof(b, c)) for b in BEARINGS for c in (2, 3)])
    here = [Channel(d, "acceleration", "m/s^2") for d in PLACES]
    unit = configured_responses(rig, real, FREQ, here, block.out, rows, ["1y", "1z", "2y", "2z"], ["N"] * 4)
    shapes = ODS("run", FREQ, block.shapes.Y.T, tuple(here), "ods", sigma=block.shapes.sd.T)
    found = identify_loads(unit, shapes, method="none")
    U = 1e-3 * np.array([2.0 + 0.7j, -0.5 + 1.1j])
    assert np.allclose(found.values, [U[0], -1j * U[0], U[1], -1j * U[1]], rtol=1e-6, atol=1e-9)
    with pytest.raises(LoadError, match="measures no acceleration"):
        configured_responses(rig, real, FREQ, [Channel(PLACES[0], "force", "N")], block.out, rows, ["a"], ["N"])
