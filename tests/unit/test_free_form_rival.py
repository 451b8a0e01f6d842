"""A law outside the catalogue is flagged with its class and still improves the model; a law of the catalogue stays."""

from __future__ import annotations

import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from femend import _core
from femend.diagnose import Diagnosis
from femend.diagnose.diagnosis import explain
from femend.diagnose.fitting.predict import predict_candidate
from femend.diagnose.locating.dressed import hypothesis_of
from femend.diagnose.locating.locate import Located, squares_of
from femend.diagnose.naming import free_form_rival
from femend.diagnose.settings import Settings
from femend.diagnose.updating.update import update_model
from femend.estimate import FitRecord
from femend.model import find_places, read_model
from femend.physics import PARTS, physics, surrogate_start
from femend.physics.catalogue import selected
from femend.study.shown import tables

sys.path.insert(0, str(Path(__file__).parents[1]))
import small_study

NODE = 7
# those of the catalogue that come near, so that the test is quick
LAWS = ("viscous_damper", "quadratic_damping", "cubic_stiffness", "coulomb_friction")
E = (7.1e10, 6.9e10)


def rows(model: object, nodes: tuple[int, ...]) -> np.ndarray:
    return np.array([6 * model.index(node) + 2 for node in nodes])  # type: ignore[attr-defined]


def diagnosed(folder: Path, law: str, values: dict[str, float]) -> tuple[Diagnosis, FitRecord]:
    """The diagnosis with the place known, and a record that took no part."""
    truth = small_study.Truth(E, laws=[(NODE, law, values)])
    (folder / "model.bdf").write_text(small_study.deck())
    model = read_model(folder / "model.bdf", parameters=small_study.PARAMETERS)
    n = int(small_study.RATE * small_study.SECONDS)
    records = []
    for i, level in enumerate((1.5, 5.0, 3.0, 4.0)):
        u = small_study.force(level, 10 + i, n)
        y = small_study.respond(folder, truth, u)
        noise = small_study.NOISE * y.std(axis=1)
        y = y + np.random.default_rng(50 + i).standard_normal(y.shape) * noise[:, None]
        out, into = rows(model, small_study.SENSORS), rows(model, (small_study.SHAKER,))
        step = 1 / small_study.RATE
        records.append(FitRecord(str(i), u[None], y, step, into, out, np.ones(1), np.ones(len(out)), noise))
    start = update_model(model, records[:3], 0.01)
    places = find_places(model)
    place = next(p for p in places if p.kind == "ground" and p.nodes == (NODE,) and p.direction == "Z")
    (free,) = start.problem.fit([hypothesis_of(place, start.reduced)], [(start.null.p, np.zeros(0))])
    assert free is not None
    located = Located(place, free, squares_of(start.problem, free, 0.0))
    with selected(LAWS):
        return explain(start, [located], [place], Settings()), records[3]


def unseen(found: Diagnosis, record: FitRecord) -> float:
    assert found.best is not None
    y = predict_candidate(found.problem, found.best, found.null.hypothesis, record)
    return float(np.linalg.norm(y - record.y) / np.linalg.norm(record.y))


def test_a_law_outside_the_catalogue_is_flagged(tmp_path: Path) -> None:
    # a dashpot that grows with the square of displacement; only asked for is it in the catalogue
    found, record = diagnosed(tmp_path, "displacement_damping", {"c": 2.0, "beta": 6e6})
    assert found.verdict == "located-not-named"
    assert found.rival is not None
    assert found.rival.labels == ("dissipative growing with displacement",)
    assert "growing with displacement" in found.advice
    # noise alone leaves 0.01
    assert unseen(found, record) < 0.02


def test_a_law_of_the_catalogue_is_named(tmp_path: Path) -> None:
    found, record = diagnosed(tmp_path, "cubic_stiffness", {"k3": 1e9})
    assert found.verdict == "missing-physics"
    assert found.rival is None
    assert found.best is not None
    assert found.best.name == "cubic_stiffness"
    assert unseen(found, record) < 0.02


@pytest.mark.parametrize("part", PARTS)
def test_coordinates_of_the_free_form_go_back_and_forth(part: str) -> None:
    t = 1e-3 * np.arange(3000)
    d, v = np.sin(7 * t) + 0.5 * np.sin(23 * t), 7 * np.cos(7 * t) + 11.5 * np.cos(23 * t)
    surrogate = surrogate_start([d], [v], [3 * d + d**3 + 0.1 * v], [1e-3], part)
    assert surrogate is not None
    values = surrogate.parameters(surrogate.start())
    for name in surrogate.free:
        assert values[name] == pytest.approx(surrogate.values[name], rel=1e-9, abs=1e-9)


def test_damping_over_displacement_needs_the_products() -> None:
    t = 1e-3 * np.arange(3000)
    d, v = np.sin(7 * t) + 0.5 * np.sin(23 * t), 7 * np.cos(7 * t) + 11.5 * np.cos(23 * t)
    f = np.abs(d) * v

    def left(part: str) -> float:
        surrogate = surrogate_start([d], [v], [f], [1e-3], part)
        assert surrogate is not None
        told = sum(_core.law_force(n, p, d, v, 0 * d, 1e-3) for n, p in surrogate.composite(surrogate.values))
        return float(np.std(f - told) / np.std(f))

    assert left("cross") < 0.01  # |d| v is one of the products
    assert left("") > 0.3  # a sum of curves has only the mean of |d| for it


def test_the_free_form_has_no_name_in_the_contract() -> None:
    assert physics("free_form").reported == ""


@pytest.mark.parametrize(("few", "further", "steps"), [(1700.0, 0.0, [3]), (1500.0, 450.0, [3, 10])])
def test_a_free_form_far_behind_the_law_it_rivals_is_given_up(
    monkeypatch: pytest.MonkeyPatch, few: float, further: float, steps: list[int]
) -> None:
    """The law leaves a misfit of 0.9; the free form 17 after its first steps, or 15 and after its further ones 4.5."""
    taken: list[int] = []

    class Run:
        loop = SimpleNamespace(substeps=4, size=lambda: 100.0)

        def at(self, z: Any) -> Any:
            return [SimpleNamespace(z=z, e=np.array([40.0]), cost=1600.0)]

        def on(self, loop: Any, everything: bool) -> Any:
            return self

        def run(self, z: Any, iterations: int) -> Any:
            taken.append(iterations)
            left = few if len(taken) == 1 else further
            return SimpleNamespace(z=z, e=np.array([left**0.5]), cost=left)

    start = SimpleNamespace(start=lambda: np.zeros(1))
    monkeypatch.setattr(free_form_rival, "_starts", lambda problem, base: [(np.zeros(1), start)])
    monkeypatch.setattr(free_form_rival, "_loop", lambda *a: None)
    monkeypatch.setattr(free_form_rival, "replace", lambda loop, **changes: loop)
    monkeypatch.setattr(free_form_rival, "_descent", lambda loop, everything: Run())
    law = SimpleNamespace(joint=0, sigma=0.0, fitted=0.9)
    base, split = SimpleNamespace(candidate=law, recovered=0), SimpleNamespace(fitting=None)
    assert free_form_rival._fitted(cast(Any, split), cast(Any, base), Settings(), 1000.0, 0.0) is None
    assert taken == steps


def test_the_checks_call_a_smooth_force_what_it_is(monkeypatch: pytest.MonkeyPatch) -> None:
    smooth = SimpleNamespace(candidate=SimpleNamespace(name="", chosen=0.9, reference=1.4), score=100.0)
    null = SimpleNamespace(chosen=5.6)
    found = SimpleNamespace(ranked=[smooth], settings=Settings(), split=None, null_chosen=null, null_score=900.0)
    monkeypatch.setattr(tables, "accepted", lambda diagnosis: smooth)
    monkeypatch.setattr(tables, "_finite", lambda ranked: True)
    monkeypatch.setattr(tables, "_chosen_on", lambda split: "recording mid")
    _, near = tables._gain_checks(cast(Any, found))
    assert near.question == "Does the smooth force without a law explain about as much as a free force there?"
    assert near.figure.startswith("smooth force 0.9")


@pytest.mark.parametrize(("sigma", "told"), [(6.0, True), (0.0, False)])
def test_a_smooth_force_of_the_beginning_alone_says_so(sigma: float, told: bool) -> None:
    ranked = SimpleNamespace(candidate=SimpleNamespace(sigma=sigma))
    advice = free_form_rival.Rival(cast(Any, ranked), ("softening", "asymmetric")).advice
    assert ("fitted to about the first 0.5 s of the recordings" in advice) is told
