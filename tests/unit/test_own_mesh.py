"""Recordings that were simulated with the deck as it is drawn, and those of what it stands for."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from numpy.typing import NDArray

from femend import _core
from femend.diagnose.updating import update
from femend.diagnose.updating.update import UpdatedModel, update_model
from femend.estimate import FitRecord
from femend.model import Model, Parameter, affordable_refinement, read_model, reduce_model
from femend.model.known_mesh import Unresolved

sys.path.insert(0, str(Path(__file__).parents[1]))
sys.path.insert(0, str(Path(__file__).parent))
from test_refined import bricks

import small_study

Array = NDArray[np.float64]
RATE, SECONDS, F_MAX, UPSAMPLING = 2048.0, 1.0, 600.0, 8
NOISE = 0.01
E = (Parameter("E", "E", "material", (1,)),)


def recorded(truth: Model, deck: Model, nodes: tuple[int, ...]) -> FitRecord:
    """A random force at the last of the `nodes`, and accelerations in Z at all of them, with noise."""
    rows = np.array([6 * deck.index(node) + 2 for node in nodes])
    omega, phi = small_study.dense_modes(truth)
    keep = omega < 2 * np.pi * 4 * F_MAX
    seen = phi[[6 * truth.index(node) + 2 for node in nodes]][:, keep]
    n = int(RATE * SECONDS)
    rng = np.random.default_rng(1)
    freq = np.fft.rfftfreq(n, 1 / RATE)
    line = rng.standard_normal((2, freq.size))
    u = np.fft.irfft(np.where((freq > 20) & (freq < F_MAX), line[0] + 1j * line[1], 0), n)
    u *= np.minimum(1, np.minimum(np.arange(n), np.arange(n)[::-1]) / 50) / u.std()
    fine = np.fft.irfft(np.fft.rfft(u, 2 * n), 2 * n * UPSAMPLING)[: (n + 16) * UPSAMPLING] * UPSAMPLING
    y = _core.simulate(
        omega[keep], np.full(int(keep.sum()), 0.01), seen[-1:], seen, np.zeros((0, int(keep.sum()))), [],
        fine[None], 1 / RATE / UPSAMPLING, decimate=UPSAMPLING,
    )[0][:, :n]  # fmt: skip
    noise = NOISE * np.asarray(y).std(axis=1)
    y = np.asarray(y) + noise[:, None] * rng.standard_normal(y.shape)
    return FitRecord("r", u[None], y, 1 / RATE, rows[-1:], rows, np.ones(1), np.ones(len(rows)), noise)


@pytest.mark.parametrize("own", [True, False])
def test_what_was_simulated_with_the_deck_is_met_with_its_own_mesh(tmp_path: Path, own: bool) -> None:
    deck = read_model(bricks(tmp_path / "m.bdf"), parameters=E)
    finer = affordable_refinement(deck, F_MAX)
    assert finer is not None
    tip = deck.node_ids[np.argsort(deck.xyz[:, 0])]
    nodes = tuple(int(n) for n in (tip[len(tip) // 3], tip[len(tip) // 2], tip[2 * len(tip) // 3], tip[-1]))
    start = update_model(deck, [recorded(deck if own else finer, deck, nodes)], 0.01)
    model = start.reduced.model
    assert model.simulated == own
    assert (model.refines is None) == own
    assert start.null.score < (1.2 if own else 2.0)


@pytest.mark.parametrize(
    ("prior", "as_given", "taken"), [(3.0, False, True), (985.0, False, False), (985.0, True, True)]
)
def test_the_decks_own_mesh_is_not_taken_where_it_has_to_leave_its_priors(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, prior: float, as_given: bool, taken: bool
) -> None:
    """But it is where the deck as it is leaves far less than the refined one updated."""
    # a solid whose support the deck lacks: its linear bricks with 1.7 times the stiffness met the recordings
    deck = read_model(bricks(tmp_path / "m.bdf"), parameters=E)
    reduced = reduce_model(deck, F_MAX, [])
    finer = replace(reduced, model=replace(deck, refines=deck))
    own = UpdatedModel(cast(Any, None), reduced, cast(Any, SimpleNamespace(score=1.1, prior=prior, cost=5000.0)), [])
    beaten = cast(Any, SimpleNamespace(score=13.6, prior=8577.0, cost=58635.0))
    monkeypatch.setattr(update, "modelled", lambda *given, as_built_in: given)
    monkeypatch.setattr(update, "_updated", lambda *given: own)
    monkeypatch.setattr(update, "_better_as_given", lambda start: as_given)
    monkeypatch.setattr(update, "_excited", lambda records: ((20.0, F_MAX), (20.0, F_MAX)))
    problem = cast(Any, SimpleNamespace(band=(20.0, F_MAX)))
    found = update._on_its_own_mesh(UpdatedModel(problem, finer, beaten, []), [], 0.01)
    assert (found is not None) == taken
    assert found is None or found.reduced.model.simulated


def test_the_decks_own_mesh_is_held_against_the_refined_one_in_its_band(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # it follows the modes of a part of the band alone, and explained that with 8 % of the power of the recordings
    deck = read_model(bricks(tmp_path / "m.bdf"), parameters=E)
    record = recorded(deck, deck, tuple(int(n) for n in deck.node_ids[-4:]))
    monkeypatch.setattr(update, "affordable_refinement", lambda *given: None)
    limited = Unresolved(freq=400.0, error=0.02, points=2.9, pid=1, limit=0.5 * F_MAX)
    monkeypatch.setattr(update, "unresolved", lambda *given: limited)
    assert update.modelled(deck, [record], 0.01)[2].band[1] == 0.5 * F_MAX
    model, _, problem = update.modelled(deck, [record], 0.01, as_built_in=(20.0, F_MAX))
    assert problem.band == (20.0, F_MAX)
    assert model.unresolved is None


def test_no_update_is_worth_more_than_a_deck_that_explains_the_recordings(tmp_path: Path) -> None:
    deck = read_model(bricks(tmp_path / "m.bdf"), parameters=E)
    tip = deck.node_ids[np.argsort(deck.xyz[:, 0])]
    nodes = tuple(int(n) for n in (tip[len(tip) // 3], tip[len(tip) // 2], tip[2 * len(tip) // 3], tip[-1]))
    start = update._updated(*update.modelled(deck, [recorded(deck, deck, nodes)], 0.01))
    assert start.drawn is not None
    assert update._better_as_given(start)
    # at the deck's values the refined model is far off, since its mesh is another
    assert not update._better_as_given(replace(start, drawn=replace(start.drawn, reduced=start.reduced)))
