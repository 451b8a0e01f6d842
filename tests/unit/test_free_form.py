"""The free-form force: what it recovers, and the class it gives to laws it does not know."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from femend import _core
from femend.physics import CLASSES, classify, fit_free_form, physics, roughness, simpler

Array = NDArray[np.float64]
DT, N, AMPLITUDE = 1 / 2000, 2500, 1e-3

# law, parameters, stiffness and damping beside it: class
LAWS = {
    "nothing but a spring and a dashpot": ("linear", [1e4, 10.0, 0.0], set()),
    "cubic": ("cubic_stiffness", [3e10], {"hardening"}),
    "softening cubic": ("cubic_stiffness", [-1.5e9], {"softening"}),
    "saturating": ("saturating_stiffness", [3e4, 2e-4], {"saturating"}),
    "two-sided gap": ("clearance", [5e4, 5e-4, 2], {"hardening", "contact-like"}),
    "one-sided gap": ("clearance", [5e4, 3e-4, 1], {"hardening", "contact-like", "asymmetric"}),
    "bilinear": ("bilinear_stiffness", [3e4, 1e4], {"contact-like", "asymmetric"}),
    "Hertz": ("hertz_contact", [2e6, 3e-4, 1], {"hardening", "contact-like", "asymmetric"}),
    "quadratic": ("quadratic_stiffness", [1.5e7], {"asymmetric"}),
    "fluid damping": ("quadratic_damping", [1500.0], {"dissipative growing with level"}),
    "cubic damping": ("cubic_damping", [2e4], {"dissipative growing with level"}),
    "damping with displacement": ("displacement_damping", [20.0, 1e7], {"dissipative growing with displacement"}),
    "stiff friction": ("coulomb_friction", [5.0, 3e5], {"friction-like"}),
    "soft friction": ("coulomb_friction", [5.0, 2e4], {"hysteretic"}),
    "Bouc-Wen": ("bouc_wen", [3e4, 0.1, 1.5, 1e5, 5e4], {"hysteretic"}),
    "friction with play": ("play_friction", [5.0, 5e4, 2e-4], {"hysteretic"}),
    "Zener": ("viscoelastic", [1e4, 2e4, 0.01], {"relaxing"}),
}


def motion(seed: int, amplitude: float = AMPLITUDE) -> tuple[Array, Array]:
    """Displacement and velocity of eight harmonics between 3 and 30 Hz."""
    rng = np.random.default_rng(seed)
    omega, phase = 2 * np.pi * rng.uniform(3, 30, 8), rng.uniform(0, 2 * np.pi, 8)
    size = rng.uniform(0.2, 1, 8) / np.sqrt(omega)
    t = np.arange(N) * DT
    d = size @ np.sin(omega[:, None] * t + phase[:, None])
    v = (size * omega) @ np.cos(omega[:, None] * t + phase[:, None])
    scale = amplitude / np.abs(d).max()
    return d * scale, v * scale


@pytest.mark.parametrize("name", LAWS)
def test_the_class_of_a_force_with_noise(name: str) -> None:
    law, p, expected = LAWS[name]
    for seed in range(2):
        d, v = motion(100 + seed)
        f = _core.law_force(law, p, d, v, np.zeros_like(d), DT)
        if law not in ("saturating_stiffness", "linear"):
            f = f + 3e3 * d + 4.0 * v
        f = f + 0.03 * f.std() * np.random.default_rng(seed).normal(size=N)
        found = classify([d], [v], [f], DT)
        assert set(found.labels) == expected, found.figures
        assert set(found.labels) <= set(CLASSES)


def test_records_of_several_levels_are_one_curve() -> None:
    records = [motion(seed, amplitude) for seed, amplitude in enumerate((2e-4, 1e-3, 5e-4))]
    d, v = [r[0] for r in records], [r[1] for r in records]
    f = [_core.law_force("cubic_stiffness", [3e10], a, b, np.zeros_like(a), DT) + 3e3 * a for a, b in records]
    fit = fit_free_form(d, v, f, DT)
    assert fit.values["d_span"] == pytest.approx(1e-3)
    # a cubic through nine knots: the natural end costs the most
    assert fit.left < 5e-3
    power = sum(float(x @ x) for x in f)
    left = sum(float(((x - fit.force(a, b, DT)) ** 2).sum()) for x, a, b in zip(f, d, v, strict=True))
    assert left < 5e-3 * power


def test_a_surface_of_its_own_kind_comes_back() -> None:
    names = physics("free_form").parameter_names
    values = dict(zip(names, [-9.0, -6, -4, -1.5, 1.5, 5, 9, 15, -4, -2, -0.5, 0.5, 2, 4, 1e-3, 0.1], strict=True))
    d, v = motion(5)
    values["d_span"], values["v_span"] = float(np.abs(d).max()), float(np.abs(v).max())
    f = _core.law_force("free_form", values, d, v, np.zeros_like(d), DT)
    fit = fit_free_form([d], [v], [f], DT, hysteresis=False)
    # the smallest penalty, 1e-7 of the squares, bends it by less than that
    assert fit.left < 1e-6
    assert all(fit.values[name] == pytest.approx(values[name], abs=0.05) for name in names)


def test_noise_makes_the_curve_straighter_not_rougher() -> None:
    d, v = motion(6)
    rng = np.random.default_rng(0)
    R, names = roughness(physics("free_form")), physics("free_form").parameter_names
    line = 1e4 * d
    bends = []
    for noise in (0.0, 1.0):
        fit = fit_free_form([d], [v], [line + noise * line.std() * rng.normal(size=N)], DT, hysteresis=False)
        x = np.array([fit.values[name] for name in names])
        bends.append(float(x @ R @ x))
    # noise as large as the force; unpenalised, the bend of 7 knots would be of the order of the force squared per knot
    assert bends[0] < 1e-6
    assert bends[1] < 0.02 * float(line.max()) ** 2


def test_hysteresis_is_given_to_its_elements() -> None:
    d, v = motion(7)
    f = _core.law_force("coulomb_friction", [5.0, 2e4], d, v, np.zeros_like(d), DT)
    fit = fit_free_form([d], [v], [f], DT)
    assert fit.left < 0.02
    assert fit.parts["hysteresis"] > 0.1
    assert all(fit.hysteresis[f"k{i}"] >= 0 for i in range(1, 7))
    # slip force 5 N at kt 20 kN/m yields at 0.25 mm, a quarter of the motion: the fourth element
    assert fit.hysteresis["k4"] > 0.9 * 2e4
    assert simpler(physics("iwan"), {**fit.hysteresis, **{f"k{i}": 0.0 for i in (1, 2, 3, 5, 6)}}, amplitude=AMPLITUDE,
                   band=(20.0, 200.0)) == (
        "coulomb_friction",
        {"f": pytest.approx(5.0, rel=0.1), "kt": pytest.approx(2e4, rel=0.1)},
    )  # fmt: skip


def test_no_motion_is_refused() -> None:
    still = np.zeros(10)
    with pytest.raises(ValueError, match="no motion"):
        fit_free_form([still], [still], [still], DT)
    with pytest.raises(ValueError, match="no motion"):
        classify([], [], [], DT)
