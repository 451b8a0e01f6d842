"""Forces from responses by inverting FRFs of a chain of masses, against the forces that were put in."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from femend.data import FRF, ODS, Channel
from femend.dof import Dof
from femend.errors import LoadError
from femend.estimate.loads import (
    UnitResponses,
    contributions,
    credible_lines,
    from_frf,
    identify_loads,
    regularised_lines,
)

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
N, FREQ = 8, np.linspace(2.0, 40.0, 77)


def receptance(freq: Array) -> ComplexArray:
    """(K, N, N) of eight masses of 1 kg between walls, springs of 1e4 N/m, 2 % loss."""
    K = 1e4 * (2 * np.eye(N) - np.eye(N, k=1) - np.eye(N, k=-1)) * (1 + 0.02j)
    return np.linalg.inv(K[None] - (2 * np.pi * freq[:, None, None]) ** 2 * np.eye(N))


def channels(dofs: list[int], quantity: str = "acceleration", unit: str = "m/s^2", sign: int = 1) -> list[Channel]:
    return [Channel(Dof(d, 1, sign), quantity, unit) for d in dofs]


def frf(out: list[int], into: list[int], freq: Array = FREQ, coherence: Array | None = None) -> FRF:
    H = -((2 * np.pi * freq[:, None, None]) ** 2) * receptance(freq)[:, out][:, :, into]
    forces = channels(into, "force", "N")
    return FRF("test", freq, H, tuple(channels(out)), tuple(forces), "accelerance", "(m/s^2)/N", coherence)


def forces(freq: Array = FREQ) -> ComplexArray:
    """Two forces (K, 2) that change with frequency, one with a phase."""
    return np.stack([1 + 0.02 * freq + 0j, 2 * np.exp(0.05j * freq)], axis=1)


def ods(y: ComplexArray, dofs: list[int], sd: float | None = None) -> ODS:
    sigma = None if sd is None else np.full(y.T.shape, sd)
    return ODS("run", FREQ, y.T, tuple(channels(dofs)), "ods", sigma=sigma)


def noise(shape: tuple[int, ...], sd: float, rng: np.random.Generator) -> ComplexArray:
    return sd / np.sqrt(2) * (rng.standard_normal(shape) + 1j * rng.standard_normal(shape))


OUT, INTO = [0, 2, 4, 5, 7], [1, 6]


def test_forces_come_back_exactly_without_noise() -> None:
    given = frf(OUT, INTO)
    y = np.einsum("kmn,kn->km", given.H, forces())
    found = identify_loads(from_frf(given), ods(y, OUT), method="none")
    assert np.allclose(found.values, forces(), rtol=1e-9)
    assert found.counts() == {"reliable": len(FREQ)}
    assert np.allclose(found.resolution, 1.0)


@pytest.mark.parametrize(("method", "choice"), [(m, c) for m in ("tikhonov", "truncation") for c in ("gcv", "l-curve")])
def test_every_regularisation_finds_well_determined_forces(method: str, choice: str) -> None:
    given = frf(OUT, INTO)
    rng = np.random.default_rng(1)
    y = np.einsum("kmn,kn->km", given.H, forces())
    y = y + noise(y.shape, 1e-4 * float(np.abs(y).mean()), rng)
    found = identify_loads(from_frf(given), ods(y, OUT), method=method, choice=choice)
    apart = np.linalg.norm(found.values - forces(), axis=1) / np.linalg.norm(forces(), axis=1)
    assert np.median(apart) < 1e-3
    assert apart[found.reliable].max() < 0.1


def test_regularisation_beats_plain_inversion_where_it_must() -> None:
    """A discretised integral (Shaw's kind): plain inversion multiplies the noise a millionfold."""
    t = (np.arange(20) + 0.5) / 20
    A = np.exp(-(((t[:, None] - t[None]) / 0.25) ** 2))[None].astype(complex)
    x = np.where(t < 0.5, 2.0, 1.0).astype(complex)
    rng = np.random.default_rng(2)
    A, B = np.repeat(A, 60, 0), np.repeat((A[0] @ x)[None], 60, 0)
    B = B + noise(B.shape, 1e-3, rng)
    error = {
        (m, c): float(np.median(np.linalg.norm(regularised_lines(A, B, m, c).x - x, axis=1) / np.linalg.norm(x)))
        for m, c in (("none", "gcv"), ("tikhonov", "gcv"), ("tikhonov", "l-curve"))
    }
    # the best a fixed Tikhonov parameter could do, knowing x
    U, s, Vh = np.linalg.svd(A[0])
    best = min(
        float(np.median(np.linalg.norm((B @ U.conj() * (s / (s**2 + lam))) @ Vh.conj() - x, axis=1)))
        for lam in np.logspace(-12, 1, 60)
    ) / float(np.linalg.norm(x))
    assert error["none", "gcv"] > 100
    assert error["tikhonov", "gcv"] < 2 * best
    assert error["tikhonov", "l-curve"] < 2.5 * best


def test_truncation_drops_what_noise_has_drowned() -> None:
    """A third force in the place of the second: two columns alike, of which only the sum is seen."""
    given = frf(OUT, [1, 6])
    H = np.concatenate([given.H, given.H[:, :, 1:] * (1 + 1e-6)], axis=2)
    unit = UnitResponses(FREQ, H, tuple(channels(OUT)), ("a", "b", "again b"), ("N",) * 3)
    rng = np.random.default_rng(3)
    y = np.einsum("kmn,kn->km", given.H, forces())
    scale = 1e-3 * float(np.abs(y).mean())
    found = identify_loads(unit, ods(y + noise(y.shape, scale, rng), OUT, scale), method="truncation", choice="l-curve")
    assert np.median(found.parameter) == 2
    assert np.median(found.condition) > 1e5
    assert set(found.counts()) <= {"regularised", "uncertain"}
    assert np.allclose(np.median(found.resolution, axis=0), [1.0, 0.5, 0.5], atol=1e-3)
    together = np.median(np.abs(found.values[:, 1] + found.values[:, 2] - forces()[:, 1]))
    assert together < 0.02


def test_deviations_are_those_of_repetition() -> None:
    """Noise on responses and FRFs, drawn 400 times: the forces scatter as every estimate says of itself."""
    given = frf(OUT, INTO)
    y = np.einsum("kmn,kn->km", given.H, forces())
    averages, rng = 50.0, np.random.default_rng(4)
    coherence = np.full(given.H.shape, 0.98)
    sd_H = np.abs(given.H) * np.sqrt(0.02 / (0.98 * averages))
    sd_y = 0.01 * float(np.abs(y).mean())
    drawn, stated = [], []
    for _ in range(400):
        H = given.H + noise(given.H.shape, 1.0, rng) * sd_H
        test = FRF("test", FREQ, H, given.outputs, given.inputs, given.kind, given.unit, coherence)
        unit = from_frf(test, n_averages=averages)
        one = identify_loads(unit, ods(y + noise(y.shape, sd_y, rng), OUT, sd_y), method="none")
        drawn.append(one.values)
        stated.append(one.sd / np.sqrt(np.where(one.excess > 1, one.excess, 1.0))[:, None])
    scatter = np.sqrt((np.abs(np.array(drawn) - np.mean(drawn, axis=0)) ** 2).mean(axis=0))
    ratio = scatter / np.array(stated).mean(axis=0)
    # 400 draws say a deviation to 5 %; what is left is of second order
    assert 0.9 < np.median(ratio) < 1.1
    assert np.quantile(ratio, 0.9) < 1.4


def test_sensors_reversed_and_in_other_quantities_say_the_same() -> None:
    given = frf(OUT, INTO)
    y = np.einsum("kmn,kn->km", given.H, forces())
    other = (
        *channels(OUT[:2]),
        *channels(OUT[2:3], sign=-1),
        *channels(OUT[3:4], "velocity", "mm/s"),
        *channels(OUT[4:], "displacement", "m"),
    )
    s = 2j * np.pi * FREQ
    factor = np.stack([s**0, s**0, -(s**0), 1e3 / s, 1 / s**2], axis=1)
    found = identify_loads(from_frf(given), ODS("run", FREQ, (y * factor).T, other, "ods"), method="none")
    assert np.allclose(found.values, forces(), rtol=1e-6)


def test_a_force_elsewhere_is_not_called_reliable() -> None:
    given = frf(OUT, INTO)
    elsewhere = frf(OUT, [3]).H[:, :, 0]
    found = identify_loads(from_frf(given), ods(elsewhere, OUT))
    assert found.reliable.mean() < 0.25
    assert found.counts()["unexplained"] > 0.5 * len(FREQ)


def test_no_force_is_reliable_where_the_modes_of_the_model_are_wrong() -> None:
    """The fourth of eight modes is 6 % off: its neighbourhood is outside, the exact forces notwithstanding."""
    omega = np.sqrt(np.linalg.eigvalsh(1e4 * (2 * np.eye(N) - np.eye(N, k=1) - np.eye(N, k=-1))))
    true = omega / (2 * np.pi)
    computed = true * np.where(np.arange(N) == 3, 1.06, 1.0)
    fine = credible_lines(FREQ, true, np.full(N, 0.01), computed, np.ones(N))
    x = FREQ / true[3]
    assert not fine[(x > 1.0) & (x < 1.06)].any()
    assert fine[(x < 1.05 * true[2] / true[3]) | ((x > true[4] / true[3]) & (x < true[-1] / true[3]))].all()
    assert not fine[x > 1.2 * true[-1] / true[3]].any()
    given = frf(OUT, INTO)
    y = np.einsum("kmn,kn->km", given.H, forces())
    found = identify_loads(from_frf(given).where(fine), ods(y, OUT), method="none")
    assert (found.reliable == fine).all()
    assert found.counts()["outside"] == int((~fine).sum())
    with pytest.raises(LoadError, match="credible lines beside 77 lines"):
        from_frf(given).where(fine[:5])


def test_contributions_are_the_parts_of_the_target() -> None:
    given, target = frf(OUT, INTO), frf([3], INTO)
    parts = target.H * forces()[:, None, :]
    y = np.einsum("kmn,kn->km", given.H, forces())
    sd, rng = 1e-3 * float(np.abs(y).mean()), np.random.default_rng(5)
    found = identify_loads(from_frf(given), ods(y + noise(y.shape, sd, rng), OUT, sd), method="none")
    made = contributions(found, from_frf(target))
    assert np.allclose(made.shares().sum(axis=2), 1.0)
    z = np.abs(made.parts - parts) / made.sd
    assert 0.5 < np.median(z) < 1.3
    assert np.median(np.abs(made.total[:, 0] - parts.sum(axis=2)[:, 0]) / made.total_sd[:, 0]) < 1.3
    size = np.sqrt((np.abs(parts[:, 0]) ** 2).sum(axis=0))
    assert made.ranked()[0][0] == ("1:+X", "6:+X")[int(np.argmax(size))]


def test_what_cannot_be_inverted_is_refused() -> None:
    given = from_frf(frf(OUT, INTO))
    y = ods(np.ones((len(FREQ), 1), dtype=complex), [0])
    with pytest.raises(LoadError, match="1 responses of 'run' cannot tell 2 loads apart") as error:
        identify_loads(given, y)
    assert (error.value.n_responses, error.value.n_loads) == (1, 2)
    two = ods(np.ones((len(FREQ), 2), dtype=complex), OUT[:2])
    with pytest.raises(LoadError, match="nothing over that could choose a truncation"):
        identify_loads(given, two, method="truncation")
    shifted = ODS("run", FREQ + 0.25, two.shapes, two.channels, "ods")
    with pytest.raises(LoadError, match="line at 2.25 Hz, the FRFs' nearest is 2.5 Hz") as error:
        identify_loads(given, shifted)
    assert error.value.freq == pytest.approx(2.25)
    with pytest.raises(LoadError, match="none of the 2 channels of 'run' is an output"):
        identify_loads(given, ods(two.shapes.T, [1, 3]))
    with pytest.raises(LoadError, match="method 'ridge'"):
        identify_loads(given, ods(np.ones((len(FREQ), 5), dtype=complex), OUT), method="ridge")
    with pytest.raises(LoadError, match="neither displacement, velocity nor acceleration"):
        identify_loads(given, ODS("run", FREQ, two.shapes, tuple(channels(OUT[:2], "strain", "1")), "ods"))
    found = identify_loads(given, ods(np.ones((len(FREQ), 5), dtype=complex), OUT))
    with pytest.raises(LoadError, match="no path leads from load '6:\\+X'"):
        contributions(found, from_frf(frf([3], [1])))


def test_as_many_responses_as_forces_without_deviations_are_uncertain() -> None:
    """Nothing is left over that could tell the noise: the forces are given, no line is called reliable."""
    given = frf(OUT[:2], INTO)
    y = np.einsum("kmn,kn->km", given.H, forces())
    found = identify_loads(from_frf(given), ods(y, OUT[:2]), method="none")
    assert np.allclose(found.values, forces(), rtol=1e-6)
    assert np.isnan(found.sd).all()
    assert set(found.verdict) == {"uncertain"}
