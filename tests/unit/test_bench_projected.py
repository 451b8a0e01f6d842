"""Decks whose matrices are no affine sums, in a basis of their modes: values, derivatives, and what has none."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from femend import Dof
from femend.bench.reading.projected import ProjectedSystem, projected_problem
from femend.bench.reading.small_problem import small_problem
from femend.errors import ModelError
from femend.estimate.updating import (
    Configuration,
    DeckMatrices,
    Frequencies,
    ModalSystem,
    ModeTest,
    Problem,
    ShapeDifferences,
    unknowns_of,
    update,
)
from femend.model import Model, Morph, Parameter, read_model

sys.path.insert(0, str(Path(__file__).parents[1]))
import small_study

DOFS = [Dof(n, 3) for n in (3, 5, 7, 9, 11, 13)]
TRUTH = np.array([1.12, 0.9])


def sheared(folder: Path) -> Model:
    """The cantilever with shear areas: G stays when E changes, so that K is no multiple of E."""
    deck = small_study.deck()
    for pid in (1, 2):
        own = next(x for x in deck.splitlines() if x.startswith(f"PBAR,{pid},"))
        deck = deck.replace(own, f"{own}\n+,0.,0.,0.,0.,0.,0.,0.,0.\n+,0.0003,0.0003")
    path = folder / "model.bdf"
    path.write_text(deck)
    parameters = [Parameter(f"E{i}", "E", "material", (i,), 0.1, (0.7, 1.4)) for i in (1, 2)]
    return read_model(path, parameters=parameters)


def problem_of(model: Model, n_modes: int = 4) -> Problem:
    T = model.transformation().tocsr()
    system = ModalSystem(DeckMatrices(model), T[[model.row(d) for d in DOFS]], n_modes)
    state = system.solve(TRUTH)
    freq, phi = state.value("freq")[:3], state.value("phi")[:, :3]
    responses = (Frequencies(freq, 0.001 * freq), ShapeDifferences(phi, 0.05))
    return Problem(unknowns_of(model), (Configuration("c", system, responses, ModeTest(freq, phi)),))


@pytest.fixture(scope="module")
def problem(tmp_path_factory: pytest.TempPathFactory) -> Problem:
    return problem_of(sheared(tmp_path_factory.mktemp("sheared")))


def test_bars_with_shear_areas_are_reduced(problem: Problem) -> None:
    system = problem.configurations[0].system
    assert isinstance(system, ModalSystem)
    assert not system.matrices.affine
    small = small_problem(problem, 0.001)
    assert small is not None
    assert small.error < 0.2 * 0.001
    assert isinstance(small.problem.configurations[0].system, ProjectedSystem)
    assert small_problem(problem, 1e-16) is None
    # a search there ends where one in the full model does
    there, full = update(small.problem), update(problem)
    np.testing.assert_allclose(there.p, full.p, rtol=1e-5)
    np.testing.assert_allclose(full.p, TRUTH, rtol=1e-2)  # the priors hold back a little
    # noise-free data: the costs are those of the priors alone
    assert there.after.cost == pytest.approx(full.after.cost, rel=1e-3)


def test_values_and_derivatives_are_those_of_the_deck(problem: Problem) -> None:
    small = projected_problem(problem, 20).problem
    little, full = small.configurations[0].system, problem.configurations[0].system
    at = np.array([1.05, 0.93])
    a, b = little.solve(at), full.solve(at)
    np.testing.assert_allclose(a.value("freq"), b.value("freq"), rtol=1e-6)
    # Rayleigh: what a basis holds is stiffer
    assert (a.value("freq") >= b.value("freq") * (1 - 1e-10)).all()
    np.testing.assert_allclose(a.slope("freq"), b.slope("freq"), rtol=1e-4)
    largest = np.abs(b.slope("phi")).max()
    sign = np.sign((a.value("phi") * b.value("phi")).sum(axis=0))
    np.testing.assert_allclose(sign * a.slope("phi"), b.slope("phi"), atol=1e-3 * largest)


def test_derivatives_are_those_of_differences(problem: Problem) -> None:
    little = projected_problem(problem, 20).problem.configurations[0].system
    at, h = np.array([1.05, 0.93]), 1e-5
    state = little.solve(at)
    for i in range(2):
        step = h * np.eye(2)[i]
        ahead, behind = little.solve(at + step), little.solve(at - step)
        difference = (ahead.value("freq") - behind.value("freq")) / (2 * h)
        np.testing.assert_allclose(state.slope("freq")[i], difference, rtol=1e-6)


def test_configurations_of_one_deck_share_its_basis(problem: Problem) -> None:
    (c,) = problem.configurations
    twice = Problem(problem.unknowns, (c, c))
    a, b = projected_problem(twice, 8).problem.configurations
    assert a.system is b.system


def test_positions_have_no_basis(tmp_path: Path) -> None:
    from femend.estimate.updating import deck_system

    model = sheared(tmp_path).with_morphs([Morph.of("tip", {13: (1.0, 0.0, 0.0)}, 0.01)])
    system = deck_system(model, DOFS, 4)
    state = system.solve(np.array([*TRUTH, 0.0]))
    freq, phi = state.value("freq")[:3], state.value("phi")[:, :3]
    c = Configuration("c", system, (Frequencies(freq, 0.001 * freq),), ModeTest(freq, phi))
    assert small_problem(Problem(unknowns_of(model), (c,)), 0.001) is None


def test_a_mass_that_is_none_is_refused(problem: Problem) -> None:
    little = projected_problem(problem, 8).problem.configurations[0].system
    broken = ProjectedSystem(little.model, 0.0 * little.basis, little.sensors, little.n_modes)  # type: ignore[attr-defined]
    with pytest.raises(ModelError, match="mass matrix is not positive definite"):
        broken.solve(np.ones(2))
