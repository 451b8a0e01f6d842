"""Laws of one's own: recorded and called ones against the library's, and what registration refuses."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from femend import _core
from femend.diagnose.fitting.candidates import laws_for
from femend.errors import LawParameterError
from femend.physics import CATALOGUE, FitCoordinates, catalogue, physics, register, selected, shapes, simpler
from femend.physics.tracing import NotRecordable, record

sys.path.insert(0, str(Path(__file__).parents[1]))
from slopes import simulate_with_slopes

Array = NDArray[np.float64]
BOUC_WEN = {"k": 2e4, "n": 1.5, "beta": 3e4, "gamma": 1e4}


@pytest.fixture(autouse=True)
def _forget() -> Iterator[None]:
    before = dict(CATALOGUE)
    yield
    for name in set(CATALOGUE) - set(before):
        _core.forget_law(name)
        del CATALOGUE[name]


def saturating(d, v, k, d0):
    return k * d / (1 + abs(d) / d0)


def gap_with_if(d, v, k, gap):
    if d > gap:
        return k * (d - gap)
    return 0.0 * d


def bouc_wen_rate(d, v, z, k, n, beta, gamma):
    return v - np.abs(z) ** n * (beta * np.abs(v) * np.sign(z) + gamma * v)


def simulated(law: str, p: Any, function: Callable = _core.simulate) -> Any:
    one, t = np.ones((1, 1)), np.arange(400) / 1000
    u = (20 * np.sin(90 * t) * np.minimum(1, 20 * t))[None]
    omega, zeta = np.array([2 * np.pi * 15]), np.array([0.01])
    return function(omega, zeta, one, one, one, [[(law, p), ("linear", [100.0, 1.0, 0.0])]], u, 1e-3)


def test_a_recorded_law_is_the_librarys_with_its_derivatives() -> None:
    register("mine", saturating, {"k": ("N/m", 1e4), "d0": ("m", 1e-3)})
    p = [2e4, 4e-4]
    y, dy, _ = simulated("saturating_stiffness", p, simulate_with_slopes)[0:3]
    mine, d_mine, _ = simulated("mine", p, simulate_with_slopes)[0:3]
    # the same formula in another order of operations, through Newton to 1e-11
    assert mine[0] == pytest.approx(y[0], rel=1e-8, abs=1e-8 * np.abs(y[0]).max())
    assert d_mine == pytest.approx(dy, rel=1e-6, abs=1e-8 * np.abs(dy).max())


def test_a_called_law_is_the_librarys_and_recording_it_is_refused() -> None:
    with pytest.raises(NotRecordable, match=r"branches .* numpy\.where"):
        record(lambda d, v, k, gap: [gap_with_if(d, v, k, gap)], 4)
    register("mine", gap_with_if, {"k": ("N/m", 1e4), "gap": ("m", 3e-4)})
    expected, found = (simulated(name, p)[0] for name, p in (("clearance", [3e4, 4e-4, 1]), ("mine", [3e4, 4e-4])))
    # tangents by differences change the path of Newton's method, not where it ends
    assert found == pytest.approx(expected, rel=1e-7, abs=1e-7 * np.abs(expected).max())


def test_where_records_what_an_if_cannot() -> None:
    register(
        "mine", lambda d, v, k, gap: np.where(d > gap, k * (d - gap), 0.0), {"k": ("N/m", 1e4), "gap": ("m", 3e-4)}
    )
    expected, found = (simulated(name, p)[0] for name, p in (("clearance", [3e4, 4e-4, 1]), ("mine", [3e4, 4e-4])))
    assert found == pytest.approx(expected, rel=1e-9, abs=1e-9 * np.abs(expected).max())


def test_derivatives_that_come_with_a_called_law_are_used() -> None:
    calls = []

    def slopes(d, v, k, gap):
        calls.append(d)
        inside = d > gap
        return {"d": k if inside else 0.0, "v": 0.0, "k": max(d - gap, 0.0), "gap": -k if inside else 0.0}

    register("mine", gap_with_if, {"k": ("N/m", 1e4), "gap": ("m", 3e-4)}, derivatives=slopes)
    n_checked = len(calls)
    (y, *_), dy, _ = simulated("mine", [3e4, 4e-4], simulate_with_slopes)
    (y_library, *_), dy_library, _ = simulated("clearance", [3e4, 4e-4, 1], simulate_with_slopes)
    assert len(calls) > n_checked
    assert y == pytest.approx(y_library, rel=1e-8, abs=1e-8 * np.abs(y).max())
    assert dy[:2] == pytest.approx(dy_library[:2], rel=1e-6, abs=1e-7 * np.abs(dy_library).max())


def test_internal_state_follows_its_rate() -> None:
    units = {"k": ("N/m", 1e4), "n": ("-", 1.6), "beta": ("1/m", 3e4), "gamma": ("1/m", 1e4)}
    law = register(
        "mine", lambda d, v, z, k, n, beta, gamma: k * z, units, family="hysteretic", state=["z"], rate=bouc_wen_rate
    )
    expected, found = simulated("bouc_wen", {**BOUC_WEN, "alpha": 0.0})[0], simulated("mine", BOUC_WEN)[0]
    # both integrate z by Runge-Kutta over a step, in other parts
    assert np.linalg.norm(found - expected) < 1e-4 * np.linalg.norm(expected)
    assert [p.name for p in law.parameters if not p.shape] == ["k"]


def test_scales_and_starts_follow_from_units_and_force() -> None:
    law = register("mine", saturating, {"k": ("N/m", 1e4), "d0": ("m", 1e-3)})
    assert [(p.name, p.shape, p.domain) for p in law.parameters] == [("k", False, "positive"), ("d0", True, "positive")]
    grid = shapes(law, amplitude=2e-3, band=(20.0, 200.0))
    assert sorted(shape.terms[0]["d0"] for shape in grid) == pytest.approx([2e-4, 6e-4, 2e-3])

    def jenkins_like(d, v, f, kt):
        return np.clip(kt * d, -f, f)

    both = register("mine", jenkins_like, {"f": ("N", 3.0), "kt": ("N/m", 1e4)})
    assert both.scales_together
    assert shapes(both, amplitude=2e-3, band=(20.0, 200.0))[0].values([2.0]) == {"f": 6.0, "kt": 2e4}
    apart = register("mine", lambda d, v, a, b: a * d + b * d**3, {"a": ("N/m", 1e4), "b": ("N/m^3", -1e9)})
    assert not apart.scales_together
    assert [p.domain for p in apart.parameters] == ["positive", "real"]
    assert shapes(apart, amplitude=1.0, band=(1.0, 2.0))[0].scaled == (("a",), ("b",))


def test_a_registered_law_is_a_law_of_the_catalogue() -> None:
    law = register("mine", saturating, {"k": ("N/m", 1e4), "d0": ("m", 1e-3)})
    assert physics("mine") is law
    assert law not in catalogue()
    assert law in catalogue(extended=True)
    with selected([law]):
        names = [name for name, _ in laws_for("ground")]
    assert names == ["support_stiffness", "mine"]
    fit = FitCoordinates(law, {"k": 2e4, "d0": 4e-4})
    assert fit.parameters(fit.start() + np.log(2)) == pytest.approx({"k": 4e4, "d0": 8e-4})
    assert simpler(law, {"k": 2e4, "d0": 4e-4}, amplitude=1.0, band=(1.0, 2.0)) is None


def test_registering_again_replaces_the_law() -> None:
    register("mine", saturating, {"k": ("N/m", 1e4), "d0": ("m", 1e-3)})
    register("mine", lambda d, v, k: k * d, {"k": ("N/m", 1e4)})
    d = np.linspace(0, 1e-3, 5)
    assert _core.law_force("mine", [3.0], d, d, d, 1e-3) == pytest.approx(3 * d)


UNITS = {"k": ("N/m", 1e4), "d0": ("m", 1e-3)}
WRONG: dict[str, tuple[dict[str, Any], str]] = {
    "a library name": ({"name": "clearance"}, "is a law of the library"),
    "a missing argument": ({"parameters": {**UNITS, "c": ("N*s/m", 1.0)}}, "does not take 'c'"),
    "one too many": ({"parameters": {"k": ("N/m", 1e4)}}, "takes 'd0', which is no parameter"),
    "no such family": ({"family": "elastic"}, "families are stiffness"),
    "no such domain": ({"parameters": {**UNITS, "d0": ("m", 1e-3, "odd")}}, "domains are real"),
    "a size outside its domain": ({"parameters": {**UNITS, "d0": ("m", 0.0, "positive")}}, "no ordinary size"),
    "no rate": ({"state": ["z"]}, "give both or neither"),
    "no force": ({"force": lambda d, v, k, d0: 0.0 * d}, "gives no force"),
    "not finite": ({"force": lambda d, v, k, d0: k * np.log(d / d0)}, "is not finite at d = -"),
    "a wrong derivative": (
        {
            "force": lambda d, v, k, d0: k * d if d > 0 else k * d / (1 - d / d0),
            "derivatives": lambda d, v, k, d0: {"d": 1.1 * k, "v": 0.0, "k": d, "d0": 0.0},
        },
        r"derivative of its force over d is .* the difference of the function is",
    ),
    "a derivative left out": (
        {"force": lambda d, v, k, d0: k * d if d > 0.1 * d0 else 0.0 * d, "derivatives": lambda d, v, k, d0: {"d": k}},
        "gives none over v",
    ),
    "nothing that scales": ({"parameters": {"k": ("1/m", 1e4), "d0": ("m", 1e-3)}}, "does not double"),
}


@pytest.mark.filterwarnings("ignore:invalid value encountered")
@pytest.mark.parametrize("case", WRONG)
def test_what_cannot_be_used_is_refused_with_the_reason(case: str) -> None:
    more, message = WRONG[case]
    arguments = {"name": "mine", "force": saturating, "parameters": UNITS, **more}
    with pytest.raises(LawParameterError, match=message):
        register(**arguments)
    # nothing half-made stays behind
    assert "mine" not in CATALOGUE
    with pytest.raises(LawParameterError, match="no law is called"):
        _core.law_force("mine", [1.0], np.zeros(2), np.zeros(2), np.zeros(2), 1.0)


def test_a_formula_that_depends_on_more_than_its_arguments_is_refused() -> None:
    rng = np.random.default_rng(3)
    with pytest.raises(LawParameterError, match="has to depend on its arguments alone"):
        register("mine", lambda d, v, k: k * d * rng.uniform(1, 2), {"k": ("N/m", 1e4)})


def test_an_error_in_a_called_law_comes_out_of_the_simulation() -> None:
    def fragile(d, v, k):
        if abs(d) > 2e-3:
            raise ZeroDivisionError(f"too far: {d:.3g}")
        return k * d

    register("mine", fragile, {"k": ("N/m", 1e4)})
    with pytest.raises(ZeroDivisionError, match="too far"):
        simulated("mine", [1.0])
    # and does not haunt the next one
    assert simulated("support_stiffness", [1e4])[-1]["converged"]


def test_called_laws_run_in_a_batch_on_all_cores() -> None:
    register("mine", gap_with_if, {"k": ("N/m", 1e4), "gap": ("m", 3e-4)})
    one, u = np.ones((1, 1)), 20 * np.sin(90 * np.arange(100) / 1000)[None]
    modal = (np.array([94.0]), np.array([0.01]), one, one, one)
    sets = [[[("mine", [k, 4e-4])]] for k in (1e4, 2e4, 3e4)]
    batch = _core.simulate_batch(*modal, sets, [u, 2 * u], 1e-3)
    for i, k in enumerate((1e4, 2e4, 3e4)):
        for j in range(2):
            alone = _core.simulate(*modal, [[("clearance", [k, 4e-4, 1])]], (j + 1) * u, 1e-3)[0]
            assert batch[i][j][0] == pytest.approx(alone, rel=1e-7, abs=1e-7 * np.abs(alone).max())


@pytest.mark.parametrize(
    "formula",
    [
        lambda x, y: x + 2 * y - y / x + (-x) ** 2 + abs(y) ** 1.5,
        lambda x, y: np.tanh(x) * np.sin(y) + np.cos(x) / np.exp(y) + np.arctan(x * y),
        lambda x, y: np.minimum(x, y) + np.maximum(x, 1.0) + np.clip(y, -0.2, 0.2) + np.sign(x),
        lambda x, y: np.where((x > 0) & ~(y >= 0.5) | (x < -1), x * y, np.hypot(x, y)),
        lambda x, y: np.sqrt(np.square(x) + 1) + np.log1p(np.abs(y)) + np.copysign(x, y) + 2.0**x + x**-2,
        lambda x, y: np.sinh(x) + np.cosh(y) + np.tan(0.1 * x) + np.reciprocal(1 + y * y) + np.expm1(0.1 * y),
    ],
)
def test_what_is_recorded_is_what_numpy_does(formula: Callable) -> None:
    ops, out = record(lambda x, y, p: [formula(x, y)], 3)
    _core.register_law("recorded", [("p", "-", "real")], 0, recorded=(ops, out))
    try:
        for x, y in np.array([(0.3, -0.7), (-1.4, 0.9), (2.0, 0.4), (-0.2, -0.1)]):
            found = _core.law_slopes("recorded", np.array([x, y, 1.0]))
            assert found[0] == pytest.approx(float(formula(x, y)), rel=1e-13)
            h = 1e-6
            for j, (dx, dy) in enumerate([(h, 0.0), (0.0, h)]):
                difference = (formula(x + dx, y + dy) - formula(x - dx, y - dy)) / (2 * h)
                # truncation 1e-12, rounding 1e-10
                assert found[1 + j] == pytest.approx(float(difference), rel=1e-7, abs=1e-8)
    finally:
        _core.forget_law("recorded")
