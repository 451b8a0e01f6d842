"""A clamp on springs of its own: from held to free, with parameters and laws beside it, and told from end to end."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.linalg import eigh

from femend.diagnose.fitting.soft_clamp import SoftClamp, _least_missed, on_all_springs, soft_clamps
from femend.diagnose.locating.dressed import dressed, hypothesis_of, own_span, own_values, with_own, with_own_unknowns
from femend.diagnose.locating.joint import enlarged
from femend.diagnose.naming import laws_at
from femend.diagnose.updating.update import modelled
from femend.errors import ModelError
from femend.estimate import Fit, fit_records, pair_test
from femend.model import Model, Place, ReducedModel, find_places, form_errors, read_model, reduce_model
from femend.model.places.freed import freed, own_stiffness, reactions
from femend.model.places.held_motion import held_dof
from femend.study.file.load import load_study
from femend.study.result.patch import on_new_supports
from femend.study.result.study_run import StudyRun
from femend.study.run import diagnose

sys.path.insert(0, str(Path(__file__).parents[1]))
import small_study
from small_study import diagnosed

Array = NDArray[np.float64]
F_MAX = 150.0
SPRINGS = {3: 6e4, 5: 2e3}


def model(folder: Path, held: str = "123456", more: tuple[str, ...] = ()) -> Model:
    path = folder / "model.bdf"
    path.write_text(small_study.deck(more=more, held=held))
    return read_model(path, parameters=small_study.PARAMETERS)


def held_but(components: dict[int, float]) -> str:
    return "".join(c for c in "123456" if int(c) not in components)


def clamp(of: Model, springs: dict[int, float]) -> Place:
    first = 6 * of.index(1)
    under = tuple((held_dof(first + component - 1), k) for component, k in springs.items())
    return Place("clamp", (1,), "", "ground", elements=(1,), label="clamp at node 1", springs=under)


def basis(of: Model) -> ReducedModel:
    return reduce_model(of, F_MAX, [6 * of.index(node) + 2 for node in small_study.SENSORS])


def frequencies(reduced: ReducedModel, p: Array) -> Array:
    K, M = reduced.K_fixed.copy(), reduced.M_fixed.copy()
    for term in reduced.terms:
        factor = float(np.exp(sum(exponent * p[i] for i, exponent in term.exponents)))
        K += 0.0 if term.K is None else factor * term.K
        M += 0.0 if term.M is None else factor * term.M
    return np.asarray(np.sqrt(np.maximum(eigh(K, M, eigvals_only=True), 0.0)) / (2 * np.pi))


def exact(of: Model, factors: dict[str, float] | None = None) -> Array:
    K, M = (a.toarray() for a in of.matrices(factors))
    return np.asarray(np.sqrt(np.maximum(eigh(K, M, eigvals_only=True), 0.0)) / (2 * np.pi))


def in_band(found: Array, true: Array) -> tuple[Array, Array]:
    n = int((true < 2 * F_MAX).sum())
    assert n >= 3
    return found[:n], true[:n]


@pytest.mark.parametrize("components", [(5,), (3, 5), (1, 3, 5)])
def test_springs_are_those_of_the_deck_without_the_clamp(tmp_path: Path, components: tuple[int, ...]) -> None:
    springs = {c: {1: 2e6, **SPRINGS}[c] for c in components}
    cards = tuple(f"CELAS2,{900 + c},{k},1,{c}" for c, k in springs.items())
    on_springs = exact(model(tmp_path, held_but(springs), cards))
    of = model(tmp_path)
    # sought around another stiffness, so that the unknowns stand elsewhere than at nothing
    reduced = with_own(clamp(of, {c: 3 * k for c, k in springs.items()}), basis(of))
    p = np.concatenate([np.zeros(2), np.full(len(springs), np.log(1 / 3))])
    np.testing.assert_allclose(*in_band(frequencies(reduced, p), on_springs), rtol=1e-6)
    assert own_values(reduced, p) == pytest.approx({f"k{c}": k for c, k in springs.items()})
    assert own_span(reduced) == slice(2, 2 + len(springs))


def test_stiff_springs_are_the_clamp_and_soft_ones_let_go(tmp_path: Path) -> None:
    of = model(tmp_path)
    reduced, alone = with_own(clamp(of, SPRINGS), basis(of)), with_own(clamp(of, {3: 6e4}), basis(of))
    np.testing.assert_allclose(*in_band(frequencies(reduced, np.array([0, 0, 15.0, 15.0])), exact(of)), rtol=1e-5)
    slides = exact(model(tmp_path, held_but({3: 0.0})))
    turns_too = exact(model(tmp_path, held_but(SPRINGS), ("CELAS2,905,2000.,1,5",)))
    for found, true in (
        (frequencies(alone, np.array([0, 0, -25.0])), slides),
        (frequencies(reduced, np.array([0, 0, -25.0, 0.0])), turns_too),
    ):
        assert found[0] < 0.1
        np.testing.assert_allclose(found[1:4], true[1:4], rtol=1e-6)


def test_parameters_move_the_model_on_springs_as_they_move_the_deck(tmp_path: Path) -> None:
    cards = tuple(f"CELAS2,{900 + c},{k},1,{c}" for c, k in SPRINGS.items())
    factors = {"E_root": 1.2, "E_tip": 0.9}
    p = np.log(list(factors.values()))
    moved = exact(model(tmp_path, held_but(SPRINGS), cards), factors)
    of = model(tmp_path)
    bare = basis(of)
    found, true = in_band(frequencies(with_own(clamp(of, SPRINGS), bare), np.append(p, [0.0, 0.0])), moved)
    n = len(found)
    own = np.abs(frequencies(bare, p)[:n] / exact(of, factors)[:n] - 1).max()
    # a basis at the deck's values is a little stiff elsewhere; on springs it is no stiffer
    assert np.abs(found / true - 1).max() < own < 2e-3


def test_springs_stay_where_a_basis_grows_and_form_errors_and_members_are_kept(tmp_path: Path) -> None:
    of = model(tmp_path)
    bare = basis(of)
    whole = form_errors(bare, F_MAX).on(bare)
    member = next(p for p in find_places(of) if p.kind == "member" and p.n_own)
    reduced = with_own(clamp(of, SPRINGS), with_own(member, whole))
    assert reduced.names[-3:] == ("member", "spring at 1 Z", "spring at 1 RY")
    assert reduced.extra == 3
    p = np.zeros(len(reduced.names))
    p[-2:] = 1.0, -1.0
    ground = next(q for q in find_places(of) if q.kind == "ground" and q.nodes == (8,) and q.direction == "Z")
    grown = enlarged([ground], reduced, F_MAX, [6 * of.index(13) + 2])
    assert grown.names == reduced.names
    np.testing.assert_allclose(frequencies(grown, p)[:3], frequencies(reduced, p)[:3], rtol=1e-6)
    again = dressed(basis(of), reduced)
    np.testing.assert_allclose(frequencies(again, p)[:4], frequencies(reduced, p)[:4], rtol=1e-9)


def test_reactions_are_what_the_clamp_takes(tmp_path: Path) -> None:
    of = model(tmp_path)
    reduced, row = basis(of), 6 * of.index(1) + 2
    K, M = reactions(reduced, [held_dof(row)])
    # a rigid displacement of everything loads no spring: the free model's row times it is nothing
    loose = freed(reduced, [held_dof(row), held_dof(row + 2)])
    assert loose.r > reduced.r
    assert not reduced.V[row].any()
    assert np.abs(loose.V[row]).max() > 0
    assert K.shape == M.shape == (1, reduced.r)
    # EI of the first bar 7e10 * 3.3275e-9, length 0.06: 12 EI / l^3 but for its shear
    assert 0.5 < own_stiffness(of, [held_dof(row)])[0] / (12 * 7e10 * 3.3275e-9 / 0.06**3) <= 1.0 + 1e-9


def test_what_no_spc_set_holds_cannot_be_set_free(tmp_path: Path) -> None:
    path = tmp_path / "model.bdf"
    text = small_study.deck(held="6").replace("GRID,1,,0.000,0.,0.", "GRID,1,,0.000,0.,0.,,12345")
    path.write_text(text)
    of = read_model(path, parameters=small_study.PARAMETERS)
    with pytest.raises(ModelError, match="DOF 1 Z cannot be set free"):
        freed(basis(of), [held_dof(6 * of.index(1) + 2)])


@pytest.fixture(scope="module")
def soft(tmp_path_factory: pytest.TempPathFactory) -> tuple[StudyRun, dict[str, Any], Path]:
    folder = tmp_path_factory.mktemp("soft")
    cards = tuple(f"CELAS2,{900 + c},{k},1,{c}" for c, k in SPRINGS.items())
    truth = small_study.Truth((7.3e10, 6.8e10), cards, held_but(SPRINGS))
    run = diagnose(small_study.write_study(folder, truth), folder / "out")
    return run, json.loads((folder / "out" / "result.json").read_text(encoding="utf-8")), folder


def test_a_clamp_soft_in_two_directions_is_told_with_two_springs(soft: tuple[StudyRun, dict[str, Any], Path]) -> None:
    result = soft[1]
    assert result["verdict"] == "missing-physics"
    (finding,) = result["findings"]
    assert finding["physics"] == "compliant_support"
    assert finding["location"]["nodes"] == [1]
    assert (finding["location"]["to"], finding["location"]["direction"]) == ("ground", "")
    told = finding["parameters"]
    assert {name: entry["unit"] for name, entry in told.items()} == {"k3": "N/m", "k5": "N*m/rad"}
    for component, k in SPRINGS.items():
        entry = told[f"k{component}"]
        assert entry["value"] == pytest.approx(k, rel=0.03)
        assert abs(entry["value"] - k) < 2 * entry["sd"] < k
    held = next(r for r in result["fit"] if r["recording"] == "held")
    assert held["final"] < 0.02 < held["parameters"]


def test_a_clamp_that_is_beaten_with_all_its_springs_is_left_at_once(
    soft: tuple[StudyRun, dict[str, Any], Path],
) -> None:
    found = soft[0].diagnosis
    asked: list[tuple[int, ...]] = []

    def beaten(fit: Fit) -> bool:
        asked.append(tuple(motion.component for motion, _ in fit.hypothesis.reduced.members[-1].springs))
        return True

    given = (found.split, found.reduced, found.located, found.null.p, 10.0)
    assert soft_clamps(*given, beaten) == []
    assert asked == [(2, 4)]  # bending alone moves in the band
    kept = soft_clamps(*given)
    assert {len(one.located.place.springs) for one in kept} == {1, 2}


def test_springs_in_all_directions_leave_less_than_a_force_in_one(soft: tuple[StudyRun, dict[str, Any], Path]) -> None:
    found = soft[0].diagnosis
    (fit,) = on_all_springs(found.problem, found.reduced, found.located, found.null.p)
    assert [motion.component for motion, _ in fit.hypothesis.reduced.members[-1].springs] == [2, 4]
    at_clamp = [one.fit.score for one in found.located if one.place.kind == "clamp"]
    assert fit.score < 1.2 < min(at_clamp)


def test_of_springs_those_go_first_that_are_as_good_as_rigid(tmp_path: Path) -> None:
    """A clamp that turns freely, and gives hardly along Z: how soft its turning is shows less than how stiff it is."""
    given = {3: 3e6, 5: 1e-2}
    cards = tuple(f"CELAS2,{900 + c},{k},1,{c}" for c, k in given.items())
    truth = small_study.Truth((7.3e10, 6.8e10), cards, held_but(given))
    study = load_study(small_study.write_study(tmp_path, truth))
    of, test = read_model(study.model_file, parameters=study.parameters), study.read_recordings()
    records = fit_records([r for r in test if r.role == "fit"], of, pair_test(test, of))
    _, reduced, problem = modelled(of, records, 0.01)
    p = with_own_unknowns(problem.prior(reduced)[0], reduced, np.log([30.0, 1e-5]))
    springs = hypothesis_of(clamp(reduced.model, {3: 1e5, 5: 1e3}), reduced)
    (fit,) = problem.fit([springs], [(p, np.zeros(0))])
    assert fit is not None
    own = own_span(springs.reduced)
    variance = np.linalg.pinv(fit.hessian).diagonal()[own]
    assert variance[1] > variance[0]
    least, rigid = _least_missed(problem, fit)
    assert least == 0
    assert rigid[own][0] > np.log(30.0) > 0 > rigid[own][1]


def test_a_spring_elsewhere_leaves_nothing_to_try_at_the_clamp(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    # the foot of the beam stands among the places, but no spring in it does what one at the middle does
    tried: list[SoftClamp] = []

    def kept(*given: Any) -> list[SoftClamp]:
        tried.extend(found := soft_clamps(*given))
        return found

    monkeypatch.setattr(laws_at, "soft_clamps", kept)
    laws = [(7, "support_stiffness", {"k": 3e4})]
    run = diagnosed(tmp_path, small_study.Truth((7.3e10, 6.8e10), laws=laws))
    assert [f["physics"] for f in run.result["findings"]] == ["support_stiffness"]
    assert any(p.kind == "clamp" for one in run.diagnosis.located for p in (one.place, *one.alike))
    assert tried == []


def test_the_patched_deck_stands_on_the_springs(soft: tuple[StudyRun, dict[str, Any], Path]) -> None:
    path = soft[2] / "out" / "model.updated.bdf"
    text = path.read_text()
    assert sum(line.startswith("CELAS2") for line in text.splitlines()) == 2
    patched = read_model(path)
    cards = tuple(f"CELAS2,{900 + c},{k},1,{c}" for c, k in SPRINGS.items())
    (soft[2] / "truth.bdf").write_text(small_study.deck((7.3e10, 6.8e10), cards, held_but(SPRINGS)))
    true = exact(read_model(soft[2] / "truth.bdf"))
    np.testing.assert_allclose(*in_band(exact(patched), true), rtol=0.01)
    # the deck's own set still holds the clamp
    assert exact(read_model(path, spc=1))[0] > 1.1 * true[0]


@pytest.mark.parametrize(
    ("head", "selects"),
    [
        ("SOL 103\r\nCEND\r\n spc = 1 $ feet\r\nBEGIN BULK\r\n", b" spc = 900001 $ feet\r\n"),
        ("SOL 103\nCEND\nSUBCASE 1\n  SPC=1\nSUBCASE 2\n  SPC=2\nBEGIN BULK\n", None),
        ("", None),
    ],
)
def test_case_control_selects_the_new_supports_where_it_selected_the_old(
    soft: tuple[StudyRun, dict[str, Any], Path], tmp_path: Path, head: str, selects: bytes | None
) -> None:
    bulk = small_study.deck().partition("BEGIN BULK\n")[2]
    (tmp_path / "model.bdf").write_bytes((head + bulk).encode())
    text = (tmp_path / "model.bdf").read_bytes()
    model = read_model(tmp_path / "model.bdf")
    changed = on_new_supports(text, model, soft[1])
    assert changed == text if selects is None else selects in changed
    assert on_new_supports(text, read_model(tmp_path / "model.bdf", spc=1), soft[1]) == text
    assert on_new_supports(text, model, {"findings": []}) == text


def test_a_clamp_soft_in_one_direction_is_told_with_one_spring(tmp_path: Path) -> None:
    truth = small_study.Truth((7.3e10, 6.8e10), ("CELAS2,905,2000.,1,5",), held_but({5: 2e3}))
    result = diagnose(small_study.write_study(tmp_path, truth), tmp_path / "out").result
    assert result["verdict"] == "missing-physics"
    (finding,) = result["findings"]
    assert finding["physics"] == "compliant_support"
    assert finding["location"]["direction"] == "RY"
    assert list(finding["parameters"]) == ["k5"]
    assert finding["parameters"]["k5"]["value"] == pytest.approx(2e3, rel=0.05)


def test_a_soft_clamp_is_one_of_two_effects(tmp_path: Path) -> None:
    laws = [(7, "viscous_damper", {"c": 20.0})]
    truth = small_study.Truth((7.3e10, 6.8e10), ("CELAS2,903,2.+5,1,3",), held_but({3: 2e5}), laws)
    result = diagnose(small_study.write_study(tmp_path, truth), tmp_path / "out").result
    findings = {f["physics"]: f for f in result["findings"]}
    assert set(findings) == {"viscous_damper", "compliant_support"}
    assert findings["viscous_damper"]["parameters"]["c"]["value"] == pytest.approx(20.0, rel=0.05)
    assert findings["compliant_support"]["location"]["nodes"] == [1]
    stiffness = findings["compliant_support"]["parameters"]["k3"]
    assert stiffness["value"] == pytest.approx(2e5, rel=0.05)
    assert 0 < stiffness["sd"] < 0.5 * stiffness["value"]
