"""What holds for all shapes and FRFs: bounds, and what the criteria do not mind."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from femend import correlate as co

SIZES = st.tuples(st.integers(1, 12), st.integers(1, 5), st.integers(0, 2**32 - 1))


def shapes(n_dof: int, n_modes: int, rng: np.random.Generator) -> NDArray:
    return rng.standard_normal((n_dof, n_modes)) + 1j * rng.standard_normal((n_dof, n_modes))


def test_mac_stays_in_its_bounds_for_100_000_complex_pairs() -> None:
    rng = np.random.default_rng(1)
    n = 100_000
    size = rng.choice([1, 2, 3, 8, 30], n)
    for n_dof in (1, 2, 3, 8, 30):
        count = int((size == n_dof).sum())
        a = rng.standard_normal((count, n_dof, 1)) + 1j * rng.standard_normal((count, n_dof, 1))
        b = rng.standard_normal((count, n_dof, 1)) + 1j * rng.standard_normal((count, n_dof, 1))
        # a third of the pairs are the same shape but for a factor: there rounding would show above 1
        same = np.arange(count) % 3 == 0
        b[same] = a[same] * (rng.standard_normal((same.sum(), 1, 1)) + 1j)
        # and sizes over 300 decades, where squares leave the range of the numbers
        a *= 10.0 ** rng.integers(-150, 150, (count, 1, 1))
        b *= 10.0 ** rng.integers(-150, 150, (count, 1, 1))
        value = co.mac(a, b)[:, 0, 0]
        assert np.isfinite(value).all()
        assert value.min() >= 0.0
        assert value.max() <= 1.0
        assert value[same].min() > 1 - 1e-13


@given(SIZES)
@settings(max_examples=60, deadline=None)
def test_all_criteria_stay_in_their_bounds(size: tuple[int, int, int]) -> None:
    n_dof, n_modes, seed = size
    rng = np.random.default_rng(seed)
    a, b = shapes(n_dof, n_modes, rng), shapes(n_dof, n_modes, rng)
    H_a, H_b = (rng.standard_normal((3, n_dof, n_modes)) * np.exp(1j * rng.random((3, n_dof, n_modes))) for _ in "ab")
    values = [co.mac(a, b), co.macx(a, b), co.comac(a, b), co.mpc(a), co.mcf(a), co.mcf_area(a), co.mpd(a) / 90]
    values += [co.subspace_mac(a, b), co.principal_cosines(a, b), co.fdac(H_a, H_b), co.coherence_criterion(H_a, H_b)]
    values += [f(H_a, H_b) for f in (co.frac, co.faac, co.csac, co.csf, co.rvac, co.lac)]
    for value in values:
        assert (value >= 0).all()
        assert (value <= 1).all()


@given(SIZES)
@settings(max_examples=60, deadline=None)
def test_what_the_criteria_do_not_mind(size: tuple[int, int, int]) -> None:
    n_dof, n_modes, seed = size
    rng = np.random.default_rng(seed)
    a, b = shapes(n_dof, n_modes, rng), shapes(n_dof, n_modes, rng)
    factor = 10.0 ** rng.uniform(-6, 6, n_modes) * np.exp(2j * np.pi * rng.random(n_modes))
    order = rng.permutation(n_dof)
    near = {"rtol": 0, "atol": 1e-11}
    np.testing.assert_allclose(co.mac(a, b * factor), co.mac(a, b), **near)
    np.testing.assert_allclose(co.mac(b, a), co.mac(a, b).T, **near)
    np.testing.assert_allclose(co.mac(a[order], b[order]), co.mac(a, b), **near)
    np.testing.assert_allclose(co.macx(a, b.conj() * np.abs(factor)), co.macx(a, b), **near)
    np.testing.assert_allclose(co.comac(a, b * factor), co.comac(a, b), **near)
    np.testing.assert_allclose(co.comac(a[order], b[order]), co.comac(a, b)[order], **near)
    np.testing.assert_allclose(co.ecomac(a, b * factor), co.ecomac(a, b), **near)
    np.testing.assert_allclose(co.mpc(a * factor), co.mpc(a), **near)
    np.testing.assert_allclose(co.mcf_area(a * factor), co.mcf_area(a), **near)
    np.testing.assert_allclose(co.subspace_mac(a * factor, b * factor), co.subspace_mac(a, b), atol=1e-7)
    if n_dof > 1:  # one number has no deviation, and rounding no direction
        np.testing.assert_allclose(co.mpd(a * factor), co.mpd(a), atol=1e-6)
    np.testing.assert_allclose(b * co.msf(a, b), b * factor * co.msf(a, b * factor), rtol=1e-9)


@given(SIZES)
@settings(max_examples=40, deadline=None)
def test_scale_and_phase_of_frfs(size: tuple[int, int, int]) -> None:
    n_out, n_in, seed = size
    rng = np.random.default_rng(seed)
    H_a, H_b = (shapes(6 * n_out, n_in, rng).reshape(6, n_out, n_in) for _ in "ab")
    turn, factor = np.exp(1j * rng.uniform(0, 6)), 10.0 ** rng.uniform(-6, 6)
    for shape_only in (co.frac, co.csac, co.rvac):
        np.testing.assert_allclose(shape_only(H_a, factor * turn * H_b), shape_only(H_a, H_b), atol=1e-11)
    for scale_too in (co.faac, co.csf):
        np.testing.assert_allclose(scale_too(factor * H_a, factor * turn * H_b), scale_too(H_a, H_b), atol=1e-11)
        assert (scale_too(H_a, 3.0 * H_a) < 0.61).all()  # 2 * 3 / (1 + 9) = 0.6
    assert (co.csf(H_a, H_b) <= np.sqrt(co.csac(H_a, H_b)) + 1e-12).all()  # 2xy <= x^2 + y^2
