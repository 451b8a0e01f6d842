"""The laws against another integration of theirs, and those outside the catalogue against all that are in it."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
import scipy.integrate as si
from blindgen import effects, excite, laws, outside
from blindgen.integrate import Law, Modal, simulate

REFERENCE = {  # states and force on the structure, written here a second time
    "cubic": (Law(laws.CUBIC, laws.pack(4e9)), 0, lambda d, v, z: (-4e9 * d**3, [])),
    "quadratic": (Law(laws.QUADRATIC, laws.pack(60.0, 0.0001)), 0, lambda d, v, z: (-60.0 * v * np.hypot(v, 1e-4), [])),
    "contact": (
        Law(laws.CONTACT, laws.pack(5e4, 2e-4, 1e9, 0.5)),
        0,
        lambda d, v, z: (-max(5e4 * (d - 2e-4) * (1 + 0.5 * v), 0.0) if d > 2e-4 else 0.0, []),
    ),
    "zener": (
        Law(laws.MAXWELL, laws.pack(3e3, 1, 2e4, 5e-3)),
        1,
        lambda d, v, z: (-3e3 * d - z[0], [2e4 * v - z[0] / 5e-3]),
    ),
    "absorber": (
        Law(laws.ABSORBER, laws.pack(0.1, 900.0, 1.0)),
        2,
        lambda d, v, z: (900.0 * (z[0] - d) + z[1] - v, [z[1], (900.0 * (d - z[0]) + v - z[1]) / 0.1]),
    ),
    "bouc_wen": (
        Law(laws.BOUC_WEN, laws.pack(3e4, 0.2, 2000.0, 1500.0, 1.0)),
        1,
        lambda d, v, z: (-6e3 * d - 2.4e4 * z[0], [v - 2000.0 * abs(v) * z[0] - 1500.0 * v * abs(z[0])]),
    ),
    "tanh_loop": (
        Law(laws.TANH_LOOP, laws.pack(3e4, 2e-4, 2e4, 1e-4)),
        1,
        lambda d, v, z: (-6.0 * np.tanh(d / 2e-4) - z[0], [2e4 * v - 1e4 * (abs(v) * z[0] + v * abs(z[0])) / 2.0]),
    ),
    "odd_damping": (
        Law(laws.ODD_DAMPING, laws.pack(40.0, 3e-4, 3.0, 1e-6)),
        0,
        lambda d, v, z: (-40.0 * (np.hypot(d, 1e-6) / 3e-4) ** 3 * v, []),
    ),
    "quintic": (Law(laws.QUINTIC, laws.pack(4e9, 1e16)), 0, lambda d, v, z: (4e9 * d**3 - 1e16 * d**5, [])),
    "power_damping": (
        Law(laws.POWER_DAMPING, laws.pack(60.0, 1e-4, 2e-4)),
        0,
        lambda d, v, z: (-60.0 * v * np.hypot(v, 1e-4) ** 0.5 * (1 + np.hypot(d, 2e-6) / 2e-4), []),
    ),
    "exponential": (
        Law(laws.EXPONENTIAL, laws.pack(2e4, 3e-4)),
        0,
        lambda d, v, z: (-6.0 * np.expm1(d / 3e-4), []),
    ),
    "wedge": (
        Law(laws.WEDGE, laws.pack(2e4, 2e-3, 3e-6)),
        0,
        lambda d, v, z: (-2e4 * np.hypot(d, 3e-6) * np.tanh(v / 2e-3), []),
    ),
}


@pytest.mark.parametrize("name", REFERENCE)
def test_law_against_adaptive_integration(name: str) -> None:
    """Two modes with each law: our stepping against LSODA at tight tolerance."""
    law, n_state, form = REFERENCE[name]
    w, zeta, shape, load = np.array([95.0, 260.0]), np.array([0.01, 0.02]), np.array([0.9, -1.1]), np.array([1.0, 0.6])
    m = Modal(w, zeta, load[None], np.array([[1.0, 0.5]]), shape[None], np.zeros((1, 1)))
    u = excite.sine(14.0, 0.3, 0.25)
    u.amplitude = 12.0
    _, trace = simulate(m, [law], [u], 512.0, 128, 16)

    def slope(t: float, x: np.ndarray) -> np.ndarray:
        ramp = 0.5 * (1 - np.cos(np.pi * min(t, excite.RAMP) / excite.RAMP))
        f, dz = form(shape @ x[:2], shape @ x[2:4], x[4:])
        drive = 2 * 12.0 * ramp * np.cos(2 * np.pi * 14.0 * t + 0.3)
        return np.concatenate([x[2:4], -(w**2) * x[:2] - 2 * zeta * w * x[2:4] + load * drive + shape * f, dz])

    t = np.arange(128) / 512.0
    ref = si.solve_ivp(slope, (0, t[-1]), np.zeros(4 + n_state), "LSODA", t, rtol=1e-9, atol=1e-12, max_step=5e-4).y
    d = shape @ ref[:2]
    assert np.linalg.norm(trace[0, 2]) > 0.1
    assert np.linalg.norm(trace[0, 0] - d) < 1e-3 * np.linalg.norm(d)


def test_friction_stays_below_its_limit_and_dissipates() -> None:
    """Jenkins: never above the slip force, work done on it positive, same answer with half the step."""
    m = Modal(
        np.array([95.0, 260.0]),
        np.array([0.01, 0.02]),
        np.ones((1, 2)),
        np.ones((1, 2)),
        np.array([[0.9, -1.1]]),
        np.zeros((1, 1)),
    )
    law, u = Law(laws.JENKINS, laws.pack(3e4, 4.0)), excite.sine(14.0, 0.3, 0.25)
    u.amplitude = 12.0
    _, coarse = simulate(m, [law], [u], 512.0, 128, 16)
    _, fine = simulate(m, [law], [u], 512.0, 128, 32)
    assert np.abs(coarse[0, 2]).max() == pytest.approx(4.0)
    assert np.trapezoid(-coarse[0, 2] * coarse[0, 1]) > 0
    assert np.linalg.norm(coarse[0, 0] - fine[0, 0]) < 2e-3 * np.linalg.norm(fine[0, 0])


def catalogue_forces(d: np.ndarray, v: np.ndarray, a: np.ndarray, dt: float) -> Iterator[np.ndarray]:
    """Columns (samples, k), linear in k parameters, of every law the package knows, on a grid of their shapes, each
    beside a spring and a dashpot. Written from the catalogue's formulas, not from its code.
    """
    base = [d, v]
    s, sv = d.std(), v.std()
    free = [[a], [v * abs(v)], [v**3], [d**3], [d**2], [d**2 * v], [np.maximum(d, 0), np.minimum(d, 0)]]
    free += [[d / (1 + abs(d) / q)] for q in s * np.geomspace(0.05, 5, 25)]
    for g in s * np.linspace(0, 3, 25):
        above, below = np.maximum(d - g, 0), np.minimum(d + g, 0)
        free += [[above], [below], [above + below], [above**1.5], [below * abs(below) ** 0.5]]
        free += [[np.maximum(d + g, 0)], [np.minimum(d - g, 0)]]
    for tau in np.geomspace(0.1, 10, 15) * s / sv:
        z, out = 0.0, np.zeros_like(d)
        for i in range(1, len(d)):
            z = (z + d[i] - d[i - 1]) * np.exp(-dt / tau)
            out[i] = z
        free.append([out])
    for g in s * np.geomspace(0.02, 3, 15):
        z, loop = 0.0, np.zeros_like(d)
        y = {n: np.zeros_like(d) for n in (1.0, 1.5, 2.0)}
        for i in range(1, len(d)):
            z = min(max(z + d[i] - d[i - 1], -g), g)
            loop[i] = z
            for n, q in y.items():
                r, step = q[i - 1], d[i] - d[i - 1]
                r += step - 0.5 * (abs(step) * r * abs(r / g) ** (n - 1) / g + step * abs(r / g) ** n)
                q[i] = min(max(r, -g), g)
        free += [[loop], *([q] for q in y.values())]
    for columns in free:
        yield np.column_stack(base + columns)


@pytest.mark.parametrize("name", outside.OUTSIDE)
def test_outside_laws_are_not_in_the_catalogue(name: str) -> None:
    """Whatever law of the catalogue is fitted to a prescribed motion leaves 4 % of the nonlinear force or more."""
    rng, dt, n = np.random.default_rng(4), 5e-4, 6000
    spectrum = np.zeros(n // 2 + 1, complex)
    spectrum[15:120] = np.exp(2j * np.pi * rng.random(105)) / np.arange(15, 120)
    omega = 2j * np.pi * np.arange(n // 2 + 1) / (n * dt)
    d, v, a = (np.fft.irfft(spectrum * omega**q) for q in range(3))
    scale = 1e-3 / d.std()
    d, v, a = d * scale, v * scale, a * scale
    code, _, par = outside.OUTSIDE[name].shape(rng, effects.Place([1], 3, d.std(), v.std(), 1e4))
    p, z, f = laws.pack(*par(1.0)), np.zeros(laws.N_STATE), np.zeros(n)
    for i in range(n):
        g = np.zeros(laws.N_STATE)
        laws.rate(code, p, d[i], v[i], z, g)
        z += dt * g
        f[i] = laws.force(code, p, d[i], v[i], z, 0.0)[0]
    straight = np.column_stack([d, v])
    beyond = np.linalg.norm(f - straight @ np.linalg.lstsq(straight, f, rcond=None)[0])
    left = min(np.linalg.norm(f - A @ np.linalg.lstsq(A, f, rcond=None)[0]) for A in catalogue_forces(d, v, a, dt))
    assert beyond > 0.1 * np.linalg.norm(f)
    assert left > 0.04 * beyond, left / beyond
