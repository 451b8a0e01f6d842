"""Forces at one place: what their amplitudes do to the cost is known without a search."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import small_study
from femend import _core
from femend.diagnose.loads.loads import with_force
from femend.errors import ModelError
from femend.estimate import FitRecord, Hypothesis, Problem
from femend.model import reduce_model

N, DT, BAND = 1024, 1 / 512, (8.0, 150.0)


@pytest.fixture
def case(tmp_path: Path) -> tuple[Problem, Hypothesis, int]:
    """Recordings of noise at the small cantilever, the model alone, and a row where forces act."""
    model, out = small_study.cantilever(tmp_path)
    rng = np.random.default_rng(5)
    u, y = rng.standard_normal((1, N)), 3 * rng.standard_normal((len(out), N))
    record = FitRecord("r", u, y, DT, out[-1:], out, np.ones(1), np.ones(len(out)), 0.01 * y.std(axis=1))
    reduced = reduce_model(model, BAND[1], out.tolist())
    nothing = Hypothesis(reduced, np.zeros((0, reduced.r)))
    return Problem([record], BAND, small_study.ZETA, 2), nothing, 6 * model.index(8) + 2


@pytest.mark.parametrize("sigma", [0.0, 8.0])
def test_products_are_those_of_the_cost(case: tuple[Problem, Hypothesis, int], sigma: float) -> None:
    """With decays eliminated (sigma 0), which small forces do not make looser, and in a window that has closed, where
    there are none."""
    problem, nothing, row = case
    reduced, p = nothing.reduced, problem.prior(nothing.reduced)[0]
    (record,), (line,) = problem.records, problem.lines(nothing.reduced, sigma)
    t = DT * np.arange(N)
    waves = np.column_stack([np.cos(2 * np.pi * f * t) for f in (31.0, 77.0)])
    window = np.exp(-sigma * t)[:, None]
    spectra = np.ascontiguousarray(np.fft.rfft(waves * window, axis=0)[line.index])
    products = _core.force_products(problem.system(reduced), line.core, reduced.rows([row])[0], spectra, p)
    assert products is not None

    def cost(amplitudes: np.ndarray) -> float:
        loaded = problem.on([with_force(record, row, waves @ amplitudes)])
        (fit,) = loaded.fit([nothing], [(p, np.zeros(0))], sigma=sigma, iterations=0)
        assert fit is not None
        return fit.cost - fit.prior

    e, b, A = products[0, 0], products[1:, 0], products[1:, 1:]
    assert e == pytest.approx(cost(np.zeros(2)), rel=1e-9)
    for amplitudes in (np.array([0.02, 0.0]), np.array([0.01, -0.02])):
        told = -2 * b @ amplitudes + amplitudes @ A @ amplitudes
        assert told == pytest.approx(cost(amplitudes) - e, rel=1e-6 if sigma else 2e-2)


def test_arrays_that_do_not_fit_are_refused(case: tuple[Problem, Hypothesis, int]) -> None:
    problem, nothing, _ = case
    reduced, (line,) = nothing.reduced, problem.lines(nothing.reduced)
    p, spectra = problem.prior(reduced)[0], np.ones((len(line.freq), 1), dtype=complex)
    with pytest.raises(ModelError, match="basis row of the forces has 1 entries"):
        _core.force_products(problem.system(reduced), line.core, np.ones(1), spectra, p)
    with pytest.raises(ModelError, match="spectra of the forces"):
        _core.force_products(problem.system(reduced), line.core, np.ones(reduced.r), spectra[1:], p)
