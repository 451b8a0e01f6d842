"""The parts by which places are sorted out: how alike they are, starts on the recovered force, noise that is none, and
free decays of modes above the band."""

from __future__ import annotations

import sys
import tracemalloc
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from numpy.typing import NDArray

from femend import _core
from femend.diagnose.fitting.closed_loop import upsampled
from femend.diagnose.fitting.followed import followed
from femend.diagnose.locating.classes import similarity, similarity_to
from femend.diagnose.locating.free_force import FreeForce
from femend.diagnose.updating.noise import quieter_records
from femend.estimate import FitRecord, Hypothesis, Problem
from femend.model import Place, ReducedModel, reduce_model
from femend.physics import physics

sys.path.insert(0, str(Path(__file__).parents[1]))
import small_study

DT, N = 1 / 1024, 2048


def random_force(seed: int, high: int) -> NDArray[np.float64]:
    rng = np.random.default_rng(seed)
    spectrum = np.zeros(N // 2 + 1, dtype=complex)
    spectrum[8:high] = rng.standard_normal(high - 8) + 1j * rng.standard_normal(high - 8)
    ramp = np.sin(0.5 * np.pi * np.clip(np.arange(N) / 100, 0, 1)) ** 2  # from rest
    return np.asarray(np.fft.irfft(spectrum, N)[None] * 100 * ramp)


def reduced_with_sensors(tmp_path: Path) -> tuple[ReducedModel, NDArray[np.int64]]:
    model, out = small_study.cantilever(tmp_path)
    return reduce_model(model, 150.0, out.tolist()), out


def simulated(reduced: ReducedModel, problem: Problem, record: FitRecord) -> NDArray[np.float64]:
    """Accelerations (n_out, n) from rest at the prior means."""
    omega, zeta, Q, _ = problem.system(reduced).modal(problem.prior(reduced)[0])
    n = int((omega < 16 / DT).sum())
    out = (reduced.rows(record.out_rows) @ Q)[None, :, :n]
    into = (reduced.rows(record.in_rows) @ Q)[None, :, :n]
    fine = np.ascontiguousarray(upsampled(record.u, 8))
    done = _core.simulate_batch(
        omega[None, :n], zeta[None, :n], np.ascontiguousarray(into), np.ascontiguousarray(out),
        np.zeros((1, 0, n)), [[]], [fine], DT / 8, stride=8, residual_compliance=np.zeros((0, 0)),
    )  # fmt: skip
    return np.asarray(done[0][0][0])


@pytest.mark.parametrize("share", [0.93, 0.8])
def test_modes_just_above_the_band_leave_nothing_at_its_end(tmp_path: Path, share: float) -> None:
    """A record cut off in full motion: every mode goes on, those above the band too, whose skirts reach into it."""
    reduced, out = reduced_with_sensors(tmp_path)
    above = float(reduced.freq[2])
    band = (8.0, share * above)
    u = random_force(1, int(band[1] * N * DT))
    record = FitRecord("r", u, np.ones((len(out), N)), DT, out[-1:], out, np.ones(1), np.ones(len(out)), np.ones(1))
    problem = Problem([record], band, small_study.ZETA, 2)
    y = simulated(reduced, problem, record)
    noise = 1e-3 * y.std(axis=1)
    record = FitRecord("r", u, y, DT, out[-1:], out, np.ones(1), np.ones(len(out)), noise)
    problem = Problem([record], band, small_study.ZETA, 2)
    nothing = Hypothesis(reduced, np.zeros((0, reduced.r)))
    (fit,) = problem.fit([nothing], [(problem.prior(reduced)[0], np.zeros(0))], iterations=0)
    assert fit is not None
    # about one, by how the force is interpolated; 6 and 15 where only modes in the band have free decays
    assert fit.score < 2.0


def on_few_lines(reduced: ReducedModel, out: NDArray[np.int64]) -> Problem:
    u = random_force(2, 150)
    y = np.random.default_rng(0).standard_normal((len(out), N))
    record = FitRecord("r", u, y, DT, out[-1:], out, np.ones(1), np.ones(len(out)), np.full(len(out), 0.01))
    return Problem([record], (8.0, 150.0), small_study.ZETA, 2).thinned(40)


def upright(reduced: ReducedModel, node: int, factor: float = 1.0) -> Place:
    row = np.array([6 * reduced.model.index(node) + 2])
    return Place("ground", (node,), "Z", "ground", (row,), (np.array([factor]),))


def test_likeness_of_places(tmp_path: Path) -> None:
    reduced, out = reduced_with_sensors(tmp_path)
    problem = on_few_lines(reduced, out)
    places = [upright(reduced, 13), upright(reduced, 13, -3.0), upright(reduced, 12), upright(reduced, 5)]
    like = similarity(problem, reduced, places, problem.prior(reduced)[0])
    np.testing.assert_allclose(like, like.T, atol=1e-12)
    np.testing.assert_allclose(np.diag(like), 1.0)
    assert like[0, 1] == pytest.approx(1.0)
    assert 1.0 > like[0, 2] > like[0, 3]
    row = similarity_to(problem, reduced, places[2], places, problem.prior(reduced)[0])
    np.testing.assert_allclose(row, like[2], atol=1e-12)


def test_one_place_is_compared_with_very_many(tmp_path: Path) -> None:
    """All pairs of 10 000 places would take 800 MB, of the 60 000 of a deck of 100 000 DOFs 29 GB."""
    reduced, out = reduced_with_sensors(tmp_path)
    problem = on_few_lines(reduced, out)
    many = [upright(reduced, node) for node in (12, 5)] * 5000
    tracemalloc.start()
    row = similarity_to(problem, reduced, upright(reduced, 13), many, problem.prior(reduced)[0])
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert row.shape == (10_000,)
    assert peak < 50e6


def test_a_law_follows_the_free_force() -> None:
    """The motion is that under the law: where the law is stiff beside the model, it is far from that without it."""
    rng = np.random.default_rng(5)
    entry = physics("viscoelastic")
    truth = {"k0": 2e3, "k1": 9e3, "tau": 4e-3}
    n_lines, C = 300, 4e-4
    s = np.asarray(2j * np.pi * np.arange(10, 10 + n_lines) / (N * DT), dtype=np.complex128)
    without = rng.standard_normal(n_lines) + 1j * rng.standard_normal(n_lines)
    kappa = _core.law_dynamic_stiffness("viscoelastic", truth, s)[0]
    D = without / (1 + kappa * C)
    ones = np.ones((n_lines, 1, 1), dtype=np.complex128)
    free = FreeForce(s, D[:, None], (-kappa * D)[:, None], C * ones, 3.0 * ones)
    np.testing.assert_allclose(free.without[:, 0], without, rtol=1e-10)
    far = [{"k0": 2e2, "k1": 1e3, "tau": 2e-2}, {"k0": 2e5, "k1": 2e5, "tau": 1e-4}]
    found = followed([free], entry, far, 1)
    assert len(found) == 1
    for name, value in truth.items():
        assert found[0][name] == pytest.approx(value, rel=1e-3)


def test_what_a_law_leaves_of_a_free_force_is_what_sensors_see() -> None:
    rng = np.random.default_rng(6)

    def some(*shape: int) -> NDArray[np.complex128]:
        return np.asarray(rng.standard_normal(shape) + 1j * rng.standard_normal(shape))

    C, H = some(7, 2, 2), some(7, 5, 2)
    free = FreeForce(some(7), some(7, 2), some(7, 2), C, np.einsum("ksv,ksw->kvw", H.conj(), H))
    kappa = some(7)
    D = np.array([np.linalg.solve(np.eye(2) + k * c, d) for k, c, d in zip(kappa, C, free.without, strict=True)])
    seen = np.einsum("ksw,kw->ks", H, free.F + kappa[:, None] * D)
    assert free.left(kappa[None])[0] == pytest.approx((np.abs(seen) ** 2).sum(), rel=1e-9)


@pytest.mark.parametrize(("misfit", "overrated"), [(0.01, True), (0.7, False)])
def test_noise_that_one_force_explains_is_none(misfit: float, overrated: bool) -> None:
    y = np.random.default_rng(1).standard_normal((4, 500))
    record = FitRecord("r", np.zeros((1, 500)), y, DT, *[np.zeros(1, dtype=np.int64)] * 2, np.ones(1), np.ones(4),
                       np.full(4, 0.5))  # fmt: skip
    fit = SimpleNamespace(score=misfit, misfit=np.array([misfit]))
    located = [SimpleNamespace(place=SimpleNamespace(n_w=1), fit=fit)]
    found = quieter_records(cast(Any, SimpleNamespace(records=[record])), cast(Any, located))
    assert (found is not None) == overrated
    if found is not None:
        np.testing.assert_allclose(found[0].noise, 0.05)
