"""`femend selftest`: its forces and time integration against other ways, its truths, and how a run ends."""

from __future__ import annotations

import contextlib
import json
import shutil
import sys
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import scipy.integrate
import scipy.linalg
from click.testing import CliRunner

from femend.cli import main
from femend.errors import ConvergenceError, StudyError
from femend.model import read_model
from femend.selftest import as_html, as_text, laws, run_selftest
from femend.selftest.case import _here, _patterns, _respond, _with, label_of, make_case, places_of
from femend.selftest.effects import Effect, Unsuitable, _opened, available, draw_effect
from femend.selftest.integrate import ModalTruth, integrate
from femend.selftest.plan import Plan, Replay, read_plan
from femend.selftest.score import false_claims, grouped, judge, wilson
from femend.selftest.truth import Drawn, draw, modes_of, pick
from femend.selftest.update import Update
from femend.study.file.load import load_study

sys.path.insert(0, str(Path(__file__).parents[1]))
import small_study

LAWS: dict[str, laws.Law] = {
    "spring": laws.Spring(2e4),
    "dashpot": laws.Dashpot(30.0),
    "quadratic": laws.Quadratic(200.0),
    "cubic": laws.Cubic(4e10),
    "contact": laws.Contact(5e4, 2e-4, np.inf),
    "two stops": laws.Contact(5e4, 2e-4, 3e-4),
    "bilinear": laws.Bilinear(2e4, 5e3),
    "friction": laws.Friction(4.0, 3e4),
    "bouc-wen": laws.BoucWen(3e4, 0.2, 2000.0, 1500.0, 1.0),
    "bouc-wen 2": laws.BoucWen(3e4, 0.2, 2e6, 1.5e6, 2.0),
    "zener": laws.Maxwell(3e3, ((2e4, 5e-3),)),
    "absorber": laws.Absorber(0.1, 900.0, 1.0),
}


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return small_study.write_study(tmp_path_factory.mktemp("user"), small_study.Truth())


@pytest.fixture(scope="module")
def plan(study: Path) -> Plan:
    return read_plan(load_study(study))


@pytest.mark.parametrize("name", [n for n in LAWS if n != "friction"])
def test_tangents_are_the_derivatives(name: str) -> None:
    law, d, v, h = LAWS[name], 4e-4, 0.03, 1e-7
    z = tuple(1e-4 * (i + 1) for i in range(law.n_states))
    _, a, b = law.force(d, v, z)
    by_d = (law.force(d + h, v, z)[0] - law.force(d - h, v, z)[0]) / (2 * h)
    by_v = (law.force(d, v + h, z)[0] - law.force(d, v - h, z)[0]) / (2 * h)
    assert a == pytest.approx(by_d, rel=1e-5, abs=1e-6 * abs(a) + 1e-6)
    assert b == pytest.approx(by_v, rel=1e-5, abs=1e-6)


def test_constant_loss_is_constant_in_the_band() -> None:
    """Complex stiffness of the branches: eta within 10 % of what was asked, stiffness k in the middle."""
    low, high = 2 * np.pi * 5, 2 * np.pi * 400
    law = laws.Maxwell.loss(1e4, 0.3, low, high)
    w = np.geomspace(3 * low, high / 3, 40)
    K = law.k0 + sum(k * 1j * w * tau / (1 + 1j * w * tau) for k, tau in law.branches)
    assert np.abs(K.imag / 1e4 - 0.3).max() < 0.03
    assert np.interp(np.sqrt(low * high), w, K.real) == pytest.approx(1e4, rel=0.03)


def drive(t: float) -> float:
    """A force that starts smoothly."""
    return float(12.0 * (1 - np.cos(np.pi * min(t, 0.05) / 0.05)) * np.cos(2 * np.pi * 14.0 * t + 0.3))


@pytest.mark.parametrize("name", ["none", *(n for n in LAWS if n != "friction")])
def test_integration_against_an_adaptive_method(name: str) -> None:
    """Two modes with each law: displacement and velocity at the law against LSODA at tight tolerance."""
    law = LAWS.get(name)
    w, zeta, at, load = np.array([95.0, 260.0]), np.array([0.01, 0.02]), np.array([0.9, -1.1]), np.array([1.0, 0.6])
    truth = ModalTruth(w, zeta, load[None], np.array([at, at]), np.array([0, 1]), None if law is None else at)
    t = np.arange(128) / 512.0
    y = integrate(truth, np.array([[drive(x) for x in t]]), 1 / 512.0, 16, law)

    def slope(time: float, x: np.ndarray) -> np.ndarray:
        d, v, z = float(at @ x[:2]), float(at @ x[2:4]), tuple(x[4:])
        f, rates = (0.0, ()) if law is None else (law.force(d, v, z)[0], law.rates(d, v, z))
        q = -(w**2) * x[:2] - 2 * zeta * w * x[2:4] + load * drive(time) + at * f
        return np.concatenate([x[2:4], q, rates])

    start = np.zeros(4 + (0 if law is None else law.n_states))
    ref = scipy.integrate.solve_ivp(slope, (0, t[-1]), start, "LSODA", t, rtol=1e-7, atol=1e-10, max_step=1e-3).y
    for row, exact in zip(y, (at @ ref[:2], at @ ref[2:4]), strict=True):
        # kinks cost an order; the force between samples is known to the truth and interpolated here
        assert np.linalg.norm(row - exact) < 3e-3 * np.linalg.norm(exact)


def test_friction_against_small_explicit_steps() -> None:
    """The return map in steps of 8 us, symplectic Euler, against the Gauss stages; the limit is held."""
    law, h, at = LAWS["friction"], 1 / 512.0 / 240, (0.9, -1.1)
    assert isinstance(law, laws.Friction)
    w, zeta, load = (95.0, 260.0), (0.01, 0.02), (1.0, 0.6)
    q, v, f, d, ref = [0.0, 0.0], [0.0, 0.0], 0.0, 0.0, []
    for i in range(128 * 240):
        if i % 240 == 0:
            ref.append(d)
        u = drive(i * h)
        for r in range(2):
            v[r] += h * (load[r] * u - at[r] * f - w[r] ** 2 * q[r] - 2 * zeta[r] * w[r] * v[r])
            q[r] += h * v[r]
        new = at[0] * q[0] + at[1] * q[1]
        f, d = law.slipped(f, new - d), new
    shape = np.array(at)
    truth = ModalTruth(np.array(w), np.array(zeta), np.array([load]), shape[None], np.array([0]), shape)
    samples = np.array([[drive(i / 512.0) for i in range(128)]])
    y = integrate(truth, samples, 1 / 512.0, 16, law)[0]
    assert np.linalg.norm(y - ref) < 5e-3 * np.linalg.norm(ref)
    free = integrate(truth, samples, 1 / 512.0, 16)[0]
    assert np.linalg.norm(free - ref) > 0.1 * np.linalg.norm(ref)


def test_a_runaway_is_told() -> None:
    truth = ModalTruth(np.array([95.0]), np.array([0.01]), np.ones((1, 1)), np.ones((1, 1)), np.array([0]), np.ones(1))
    with pytest.raises(ConvergenceError, match="draw it again"):
        integrate(truth, np.full((1, 400), 50.0), 1 / 512.0, 4, laws.Cubic(-1e9))


def test_exact_truth_has_the_decks_modes_and_static_answers(plan: Plan) -> None:
    """Without errors the frequencies are the deck's, and the modes with static answers give the exact compliance."""
    rng = np.random.default_rng(0)
    drawn = draw(rng, plan, "exact")
    g = pick(plan.model, [6 * plan.model.index(9) + 2], [1.0])
    truth = modes_of(rng, plan, drawn, [g], form=False)
    K, M = (a.toarray() for a in plan.model.matrices())
    exact = np.sqrt(1 / scipy.linalg.eigh(M, K, eigvals_only=True)[::-1][:4])
    assert truth.omega[:4] == pytest.approx(exact, rel=1e-6)
    shift = (0.3 * 2 * np.pi * plan.band[0]) ** 2
    assert 1 / np.sum(truth.shape(g) ** 2 / (truth.omega**2 + shift)) == pytest.approx(truth.stiffness(g), rel=1e-6)
    other = modes_of(rng, plan, draw(rng, plan), [g])
    assert np.abs(other.omega[:4] / exact - 1).max() > 1e-3


def test_an_opened_clamp_is_a_hinge(plan: Plan, tmp_path: Path) -> None:
    """Stiff springs in the clamp's rotation leave the deck's stiffness, none at all that of a hinged root."""
    places = places_of(plan)
    here: Any = SimpleNamespace(model=plan.model, drawn=draw(np.random.default_rng(0), plan, "exact"))
    clamp = next(p for p in places["clamp"] if p.direction == "RY")
    K, M = plan.model.matrices()
    assert np.abs(_opened(here, clamp, 1e9).toarray()).max() < 1e-8 * np.abs(K.toarray()).max()
    hinged = tmp_path / "hinged.bdf"
    hinged.write_text(small_study.deck().replace("SPC1,1,123456,1", "SPC1,1,12346,1"))
    first = read_model(hinged).matrices()
    w = [
        scipy.linalg.eigh(m.toarray(), k.toarray() + 1e-3 * m.toarray(), eigvals_only=True)[::-1][1:4]
        for k, m in (first, (K + _opened(here, clamp, 1e-12), M))
    ]
    # the freed rotation at the root has an inertia of its own in the one and none in the other
    assert w[0] == pytest.approx(w[1], rel=2e-2)
    # softer elements are opened as soft as they are: nothing becomes unstable
    here.drawn = draw(np.random.default_rng(1), plan)
    assert np.linalg.eigvalsh((here.drawn.K + _opened(here, clamp, 1e-3)).toarray()).min() > 0


def test_cases_depend_on_seed_and_number_alone(plan: Plan) -> None:
    places = places_of(plan)
    names = available(places)
    block = [label_of(places, 3, i) for i in range(len(names) + len(names) // 2)]
    assert sorted(x for x in block if not x.startswith("none")) == sorted(names)
    assert sum(x.startswith("none") for x in block) == len(names) // 2
    one, two = (make_case(plan, places, 3, 4) for _ in range(2))
    assert one.truth == two.truth
    assert all(np.array_equal(one.responses[k], two.responses[k]) for k in one.responses)
    other = make_case(plan, places, 4, 4)
    assert not np.array_equal(one.responses["low"], other.responses["low"])


def beside_dead(plan: Plan, sign: float, noise: float) -> Plan:
    """The plan with four sensors more that hardly move: by `sign` of what the first one does, in noise of theirs."""

    def more(r: Replay) -> Replay:
        rows, signs, order = np.repeat(r.out_rows[:1], 4), np.full(4, sign), np.repeat(r.order[:1], 4)
        return replace(
            r,
            sensors=(*r.sensors, *r.sensors[:1] * 4),
            out_rows=np.concatenate([r.out_rows, rows]),
            out_signs=np.concatenate([r.out_signs, signs]),
            order=np.concatenate([r.order, order]),
            noise=np.concatenate([r.noise, noise * r.noise[:1].repeat(4)]),
        )

    return replace(plan, replays=tuple(map(more, plan.replays)))


@pytest.mark.parametrize(("sign", "noise"), [(0.0, 1.0), (1e-15, 1e-14)])
def test_sensors_that_hardly_move_do_not_change_what_is_drawn(plan: Plan, sign: float, noise: float) -> None:
    """With sensors across the plane of a frame no case was made: their noise is endless times their motion, and
    rounding that is larger than theirs was an effect."""
    places = places_of(plan)
    index = next(i for i in range(40) if label_of(places, 3, i) == "added_mass")
    first, second = (make_case(p, places, 3, index) for p in (plan, beside_dead(plan, sign, noise)))
    assert 3.0 * 0.4 < first.truth["visibility"] < 40.0 * 2.5
    assert second.truth["nodes"] == first.truth["nodes"]
    assert second.truth["parameters"] == pytest.approx(first.truth["parameters"], rel=1e-6)
    for key in ("visibility", "visibility_beyond_update"):
        assert second.truth[key] == pytest.approx(first.truth[key], rel=1e-6)


@pytest.mark.parametrize(
    "name", ["support_stiffness", "bouc_wen", "added_mass", "compliant_support", "unmeasured_force"]
)
def test_an_effect_of_no_strength_leaves_the_truth(plan: Plan, name: str) -> None:
    """The same structure, frequencies and dampings with and without the effect: what is seen is the effect alone."""
    rng = np.random.default_rng(5)
    drawn, places = draw(rng, plan), places_of(plan)
    state = rng.bit_generator.state
    plain = modes_of(rng, plan, drawn, _patterns(plan))
    base = _respond(plan, plain, plan.loudest, None)
    here = _here(plan, plain, drawn, places, plan.loudest)
    effect = next(e for e in attempts(rng, here, name))
    for x, least, most in ((1e-9, 0.0, 1e-4), (effect.span[1], 1e-2, np.inf)):
        change = np.linalg.norm(_with(plan, plain, drawn, effect, x, plan.loudest, state) - base)
        assert least < change / np.linalg.norm(base) < most


def test_an_update_absorbs_what_it_may_and_nothing_else(plan: Plan) -> None:
    """Derivatives against differences; moduli 4 % off are fitted away, a motion that no unknown makes stays."""
    rng, loud = np.random.default_rng(2), plan.loudest
    drawn = draw(rng, plan, "exact")
    state = rng.bit_generator.state
    truth = modes_of(rng, plan, drawn, _patterns(plan))
    fit = Update(plan, drawn, truth, loud, 6)
    theta = 0.02 * rng.standard_normal(len(fit.sd))
    J, h = fit._derivatives(theta, fit._response(theta)[1]), 1e-5
    for i in range(len(theta)):
        up, down = (fit._response(theta + s * h * np.eye(len(theta))[i])[0] for s in (1, -1))
        assert np.linalg.norm(J[:, i] - (up - down) / (2 * h)) < 0.03 * np.linalg.norm(J[:, i])
    K, M = plan.model.matrices({"E_root": 1.04, "E_tip": 0.97})
    rng.bit_generator.state = state
    stiffer = modes_of(rng, plan, Drawn(K, M, {}, {}), _patterns(plan))
    change = _respond(plan, stiffer, loud, None) - _respond(plan, truth, loud, None)
    seen = float(np.sqrt(np.mean((change / loud.noise[:, None]) ** 2)))
    assert fit.left(change) < 0.1 * seen
    other = rng.standard_normal(change.shape) * loud.noise[:, None]
    assert 0.9 < fit.left(other) < 1.1


def attempts(rng: np.random.Generator, here: Any, name: str) -> Iterator[Effect]:
    for _ in range(20):
        with contextlib.suppress(Unsuitable):
            yield draw_effect(rng, here, name)


def fake(verdict: str, stop_at: int | None = None) -> Callable[..., Any]:
    """A diagnosis that says the same of everything, and is interrupted at a case."""

    def diagnose(study: Path, out: Path, seed: int = 0) -> Any:
        if stop_at is not None and study.parent.name == f"s{stop_at:04d}":
            raise KeyboardInterrupt
        text = study.read_text()
        assert "truth" not in text
        assert "predict" not in text
        load_study(study).read_recordings()
        return SimpleNamespace(result={"verdict": verdict, "findings": []})

    return diagnose


def test_interrupted_runs_are_reported_and_continued(
    study: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "out"
    monkeypatch.setattr("femend.study.run.diagnose", fake("consistent", stop_at=2))
    first = run_selftest(study, out, cases=3, seed=3)
    assert first.interrupted
    assert [o.case for o in first.outcomes] == [1]
    told = json.loads((out / "selftest.json").read_text())
    assert told["interrupted"]
    assert told["cases"]["finished"] == 1
    stamp = (out / "cases/s0001/outcome.json").stat().st_mtime_ns
    monkeypatch.setattr("femend.study.run.diagnose", fake("consistent"))
    second = run_selftest(study, out, cases=3, seed=3)
    assert not second.interrupted
    assert [o.case for o in second.outcomes] == [1, 2, 3]
    assert second.outcomes[:1] == first.outcomes
    assert (out / "cases/s0001/outcome.json").stat().st_mtime_ns == stamp
    assert "3 of 3 cases finished" in as_text(second)
    assert "<table>" in as_html(second)
    with pytest.raises(StudyError, match="with seed 3, not of"):
        run_selftest(study, out, cases=4, seed=5)


def test_outcomes_are_judged_by_place_name_and_silence() -> None:
    xyz = {n: np.array([0.1 * n, 0.0, 0.0]) for n in range(11)}
    truth = {"effect": "clearance", "control": "", "nodes": [5], "visibility": 8.0, "visibility_beyond_update": 4.0}

    def said(truth: dict[str, Any], physics: str | None, node: int = 5, verdict: str = "missing-physics") -> Any:
        found = [] if physics is None else [{"physics": physics, "location": {"nodes": [node], "also_possible": []}}]
        return judge(1, truth, {"verdict": verdict, "findings": found}, xyz, 0.0)

    right, elsewhere = said(truth, "clearance", 6), said(truth, "clearance", 8)
    other, class_only = said(truth, "bouc_wen"), said(truth, "", verdict="located-not-named")
    silent = said(truth, None, verdict="parameters-only")
    assert (right.located, right.named, right.wrong, right.missed) == (True, True, False, False)
    assert (elsewhere.located, elsewhere.named, elsewhere.wrong) == (False, False, True)
    assert (other.located, other.named, other.wrong) == (True, False, True)
    assert (class_only.located, class_only.named, class_only.wrong) == (True, False, False)
    assert silent.missed
    control = {"effect": "none", "control": "exact", "nodes": [], "visibility": 0.0, "visibility_beyond_update": 0.0}
    false, quiet = said(control, "clearance"), said(control, None, verdict="undetermined")
    assert false.false
    assert not quiet.false
    table = grouped([right, elsewhere, other, class_only, silent, false], lambda o: o.effect)
    assert (table["all"]["located"].k, table["all"]["located"].n) == (3, 5)
    assert (false_claims([false, quiet])["all"].k, false_claims([false, quiet])["all"].n) == (1, 2)
    assert wilson(0, 0) == (0.0, 1.0)


def test_a_study_without_measured_force_is_refused(study: Path, tmp_path: Path) -> None:
    """The error names the study, its recordings and what to add."""
    folder = tmp_path / "ambient"
    shutil.copytree(study.parent, folder)
    text = (folder / "study.toml").read_text().replace('role = "fit"', 'role = "fit"\nexcitation = "unknown"')
    (folder / "study.toml").write_text(text)
    result = CliRunner().invoke(main, ["selftest", str(folder), "--out", str(tmp_path / "out"), "-q"])
    assert result.exit_code == 2
    assert "'low' (excitation = \"unknown\")" in result.output
    assert "add a recording with its force channel" in result.output
    assert not (tmp_path / "out").exists()


def test_a_deck_with_dashpots_is_refused(study: Path, tmp_path: Path) -> None:
    """The structures that are drawn would lack them, and a diagnosis find that."""
    folder = tmp_path / "damped"
    shutil.copytree(study.parent, folder)
    (folder / "model.bdf").write_text(small_study.deck(more=("CDAMP2,900,12.,6,3",)))
    with pytest.raises(StudyError, match=r"model\.bdf has dashpots \(at nodes 6\).*take them out of a copy"):
        read_plan(load_study(folder / "study.toml"))


def test_command_line(study: Path, tmp_path: Path) -> None:
    """Two cases from end to end, diagnosed as `femend diagnose` would."""
    out = tmp_path / "out"
    result = CliRunner().invoke(main, ["selftest", str(study), "--out", str(out), "--cases", "2", "--seed", "3", "-q"])
    assert result.exit_code == 0, result.output
    assert "2 of 2 cases finished" in result.output
    told = json.loads((out / "selftest.json").read_text())
    assert [o["case"] for o in told["outcomes"]] == [1, 2]
    for case in (1, 2):
        folder = out / "cases" / f"s{case:04d}"
        outcome = json.loads((folder / "outcome.json").read_text())
        told_there = json.loads((folder / "diagnosis/result.json").read_text())
        assert outcome["verdict"] == told_there["verdict"]
        assert {f["recording"] for f in told_there["fit"]} == {"low", "high"}
        assert (folder / "truth.json").is_file()
    assert "Self-test: cantilever" in (out / "selftest.html").read_text()
