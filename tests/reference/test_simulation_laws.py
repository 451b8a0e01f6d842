"""Closed-loop simulation of one mass with a law beyond the contract's names, against scipy's integrators."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from femend import _core
from femend.physics.nested_extended import IWAN_GRID

sys.path.insert(0, str(Path(__file__).parents[1]))
from slopes import simulate_with_slopes

Array = NDArray[np.float64]

OMEGA, ZETA = 2 * np.pi * 15.0, 0.01
DT, N, REFINE = 1e-3, 300, 16

MAXWELL = {"k0": 1e3, "k1": 3e3, "tau1": 0.004, "k2": 2e3, "tau2": 0.03}
IWAN = {"k1": 2e3, "k2": 2e3, "k3": 1e3, "k4": 2e3, "k5": 1e3, "k6": 2e3, "span": 2e-3}
FREE = dict(zip(
    [*(f"fd{i}" for i in range(1, 9)), *(f"fv{i}" for i in range(1, 7)), "d_span", "v_span"],
    [-9.0, -6.0, -4.0, -1.5, 1.5, 5.0, 9.0, 15.0, -4.0, -2.0, -0.5, 0.5, 2.0, 4.0, 3e-3, 0.25], strict=True,
))  # fmt: skip


def load(t: float | Array) -> float | Array:
    ramp = np.minimum(1.0, 20 * t)
    return (6.0 * np.sin(95.0 * t) + 9.0 * np.sin(41.0 * t + 1)) * ramp


def slips(limit: float, k: float = 1.0) -> Callable[[float, float], float]:
    """Rate of a stretch that follows the motion until it reaches its limit."""
    return lambda z, v: 0.0 if (abs(z) >= limit and z * v > 0) else k * v


def maxwell(n: int, p: dict[str, float]) -> tuple:
    k, tau = [p[f"k{i + 1}"] for i in range(n)], [p[f"tau{i + 1}"] for i in range(n)]
    return (
        lambda d, v, z: p["k0"] * d + z.sum(),
        n,
        lambda d, v, z: np.array([k[i] * v - z[i] / tau[i] for i in range(n)]),
    )


def spline(p: dict[str, float]) -> Callable[[float, float, Array], float]:
    from scipy.interpolate import CubicSpline

    knots = ((-1, -0.7, -0.4, -0.15, 0, 0.15, 0.4, 0.7, 1), (-1, -0.5, -0.2, 0, 0.2, 0.5, 1))
    curves = []
    for name, x in zip(("fd", "fv"), knots, strict=True):
        forces = [p[f"{name}{i + 1}"] for i in range(len(x) - 1)]
        forces.insert(len(x) // 2, 0.0)
        curves.append(CubicSpline(x, forces, bc_type="natural"))

    def value(curve: CubicSpline, u: float) -> float:
        end = min(max(u, -1.0), 1.0)
        return float(curve(end) + curve(end, 1) * (u - end))

    return lambda d, v, z: value(curves[0], d / p["d_span"]) + value(curves[1], v / p["v_span"])


# law: (parameters, force, number of states, their rates)
CASES = {
    "generalised_maxwell": (MAXWELL, *maxwell(2, MAXWELL)),
    "generalised_maxwell_3": ({**MAXWELL, "k3": 1e3, "tau3": 0.01}, *maxwell(3, {**MAXWELL, "k3": 1e3, "tau3": 0.01})),
    "saturating_stiffness": ({"k": 8e3, "d0": 5e-4}, lambda d, v, z: 8e3 * d / (1 + abs(d) / 5e-4), 0, None),
    "preloaded_contact": (
        {"k": 6e3, "preload": 3.0, "side": -1.0}, lambda d, v, z: min(6e3 * d, 3.0), 0, None,
    ),
    "hertz_contact": (
        {"k": 3e5, "gap": 3e-4, "sides": 1.0}, lambda d, v, z: 3e5 * max(d - 3e-4, 0.0) ** 1.5, 0, None,
    ),
    "play_friction": (
        {"f": 2.0, "kt": 8e3, "gap": 3e-4},
        lambda d, v, z: 8e3 * (max(z[0] - 3e-4, 0.0) + min(z[0] + 3e-4, 0.0)),
        1,
        lambda d, v, z: np.array([slips(3e-4 + 2.0 / 8e3)(z[0], v)]),
    ),
    "sliding_friction": ({"f": 0.5, "v0": 0.01}, lambda d, v, z: 0.5 * np.tanh(v / 0.01), 0, None),
    "cubic_damping": ({"c": 400.0}, lambda d, v, z: 400.0 * v**3, 0, None),
    "displacement_damping": ({"c": 3.0, "beta": 2e6}, lambda d, v, z: 3.0 * (1 + 2e6 * d * d) * v, 0, None),
    "iwan": (
        IWAN,
        lambda d, v, z: float(np.dot([IWAN[f"k{i}"] for i in range(1, 7)], z)),
        6,
        lambda d, v, z: np.array([slips(share * IWAN["span"])(x, v) for share, x in zip(IWAN_GRID, z)]),
    ),
    "free_form": (FREE, spline(FREE), 0, None),
}  # fmt: skip


def simulate(law: str, p: dict[str, float], refine: int = REFINE) -> Array:
    u = np.asarray(load(np.arange((N - 1) * refine + 1) * DT / refine))[None]
    one = np.ones((1, 1))
    y, _, _, _, status = _core.simulate(
        np.array([OMEGA]), np.array([ZETA]), one, one, one, [[(law, p)]], u, DT / refine, stride=refine,
        output="displacement",
    )  # fmt: skip
    assert status["converged"], status["advice"]
    return np.asarray(y[0])


def integrate(force: Callable, n_z: int = 0, rates: Callable | None = None) -> Array:
    def slope(t: float, x: Array) -> Array:
        f = load(t) - force(x[0], x[1], x[2:]) - 2 * ZETA * OMEGA * x[1] - OMEGA**2 * x[0]
        return np.concatenate([[x[1], f], rates(x[0], x[1], x[2:]) if rates else []])

    t = np.arange(N) * DT
    out = solve_ivp(slope, (0, t[-1]), np.zeros(2 + n_z), t_eval=t, rtol=1e-7, atol=1e-10, max_step=DT / 3)
    return np.asarray(out.y[0])


BARE = integrate(lambda d, v, z: 0.0)


@pytest.mark.parametrize("law", CASES)
def test_one_mass_with_a_law_moves_as_scipy_says(law: str) -> None:
    p, force, n_z, rates = CASES[law]
    exact = integrate(force, n_z, rates)
    # the law matters, or the comparison would not
    assert np.linalg.norm(exact - BARE) > 0.1 * np.linalg.norm(BARE)
    error = np.linalg.norm(simulate(law, p) - exact) / np.linalg.norm(exact)
    # second order in omega h = 0.006: 1e-5; a kink between samples adds some times that
    assert error < 5e-4, error


def test_one_mass_on_a_springpot_moves_as_its_transfer_function_says() -> None:
    p = {"k": 2e3, "c": 900.0, "alpha": 0.4}
    n = 1 << 17
    t = np.arange(n) * DT
    u = np.where(t < N * DT, load(t), 0.0)
    # an exponential window keeps the response of one period out of the next
    sigma = 8 / (n * DT)
    s = sigma + 2j * np.pi * np.fft.rfftfreq(n, DT)
    # the sampled load is linear between samples
    hold = (np.exp(s * DT) + np.exp(-s * DT) - 2) / (s * DT) ** 2
    transfer = hold / (s**2 + 2 * ZETA * OMEGA * s + OMEGA**2 + p["k"] + p["c"] * s ** p["alpha"])
    exact = (np.fft.irfft(transfer * np.fft.rfft(u * np.exp(-sigma * t)), n) * np.exp(sigma * t))[:N]
    y = simulate("fractional", p, refine=8)
    # 0.5 % of the springpot's stiffness by its sum of exponentials
    assert np.linalg.norm(y - exact) < 5e-3 * np.linalg.norm(exact)
    assert np.linalg.norm(BARE - exact) > 0.1 * np.linalg.norm(exact)


@pytest.mark.parametrize("law", ["fractional", "iwan", "free_form", "play_friction", "generalised_maxwell_3"])
def test_sensitivities_of_a_simulation_are_its_differences(law: str) -> None:
    p = {"k": 2e3, "c": 900.0, "alpha": 0.4} if law == "fractional" else CASES[law][0]
    one, u = np.ones((1, 1)), np.asarray(load(np.arange(N) * DT))[None]

    def run(values: Array) -> Array:
        laws = [[(law, values)]]
        y, *_ = _core.simulate(np.array([OMEGA]), np.array([ZETA]), one, one, one, laws, u, DT, output="displacement")
        return np.asarray(y[0])

    values = np.array(list(p.values()))
    _, dy, _ = simulate_with_slopes(
        np.array([OMEGA]), np.array([ZETA]), one, one, one, [[(law, values)]], u, DT, output="displacement"
    )
    for j, value in enumerate(values):
        step = np.zeros_like(values)
        step[j] = 1e-6 * abs(value)
        difference = (run(values + step) - run(values - step)) / (2 * step[j])
        # the response converges to 1e-11; a kink that falls between the two runs costs one sample
        assert np.linalg.norm(dy[j, 0] - difference) < 2e-4 * np.linalg.norm(difference), (law, j)


def test_tangents_of_a_simulation_with_two_coordinates_are_its_differences() -> None:
    rng = np.random.default_rng(4)
    r, n_out = 11, 3
    omega, zeta = np.sort(rng.uniform(60.0, 900.0, r)), np.full(r, 0.01)
    modal = [omega, zeta, rng.normal(size=(1, r)), rng.normal(size=(n_out, r)), rng.normal(size=(2, r))]
    laws = [
        [("cubic_stiffness", {"k3": 4e9}), ("linear", {"k": 1e3, "c": 1.0, "m": 0.0})],
        [("bouc_wen", {"k": 2e3, "alpha": 0.2, "n": 1.5, "beta": 5e4, "gamma": 2e4})],
    ]
    u = np.asarray(load(np.arange(N) * DT))[None]
    options = {"stride": 3, "residual_compliance": np.diag([1e-6, 2e-6])}

    def run(modal: list[Array], laws: list) -> tuple[Array, Array]:
        y, _, _, f, status = _core.simulate(*modal, laws, u, DT / 2, substeps=2, **options)
        assert status["converged"]
        return y, f

    step = 1e-6
    sets = [modal]
    for i in (0, 4):  # a frequency, and a shape at the coordinates
        moved = [m.copy() for m in modal]
        moved[i] = moved[i] * (1 + step) if i == 0 else moved[i] + step
        sets.append(moved)
    # not the dashpot, nor alpha
    wanted = [True, True, False, False, True, False, True, True, True]
    stacked = [np.array([s[i] for s in sets]) for i in range(5)]
    ((y, _, _, f, _), dy, df, moved_y, moved_f) = _core.simulate_tangents(
        *stacked, laws, wanted, [u], DT / 2, substeps=2, **options
    )[0]
    assert np.array_equal(y, run(modal, laws)[0])
    for k in (1, 2):
        exact_y, exact_f = run(sets[k], laws)
        assert np.linalg.norm(moved_y[k - 1] - exact_y) < 1e-4 * np.linalg.norm(exact_y - y)
        assert np.linalg.norm(moved_f[k - 1] - exact_f) < 1e-4 * np.linalg.norm(exact_f - f)
    flat = [(i, j, name) for i, at in enumerate(laws) for j, (_, p) in enumerate(at) for name in p]
    for column, (i, j, name) in enumerate(one for one, want in zip(flat, wanted, strict=True) if want):
        ends = []
        for sign in (1.0, -1.0):
            changed = [[(law, dict(p)) for law, p in at] for at in laws]
            changed[i][j][1][name] *= 1 + sign * step
            ends.append(run(modal, changed))
        size = 2 * step * laws[i][j][1][name]
        for exact, own in zip(zip(*ends, strict=True), (dy[column], df[column]), strict=True):
            difference = (exact[0] - exact[1]) / size
            assert np.linalg.norm(own - difference) < 2e-4 * np.linalg.norm(difference), name


def test_tangents_of_models_that_do_not_fit_are_refused() -> None:
    one = np.ones((1, 1))
    arguments = ([[("cubic_stiffness", {"k3": 1.0})]], [True], [np.ones((1, 8))], DT)
    with pytest.raises(ValueError, match="omega has 1 dimensions; a row for the model"):
        _core.simulate_tangents(np.ones(1), np.ones(1), one, one, one, *arguments)
    laws, _, u, dt = arguments
    modal = (np.ones((1, 1)), np.ones((1, 1)), one, one, one)
    with pytest.raises(ValueError, match="wanted has 2 values, 1 are needed"):
        _core.simulate_tangents(*modal, laws, [True, False], u, dt)
