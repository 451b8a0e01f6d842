"""Dashpots of the deck in a diagnosis: they are no missing physics, and what is missing is found beside them."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.sparse import csc_array

from femend.diagnose.locating.receptances import answers, receptances
from femend.model import Model, Parameter, read_model
from femend.model.reduced import dashpots
from femend.model.reduced.dashpots import MOST, dashpot_forces, dashpot_rows
from femend.model.reduced.reduction import reduce_model
from femend.study.damping_told import at_dashpots, damping_told
from femend.study.free_dashpots import with_free_dashpots
from femend.study.result.study_run import StudyRun
from femend.study.run import diagnose

sys.path.insert(0, str(Path(__file__).parents[1]))
import small_study

C = 12.0
DASHPOT = f"CDAMP2,900,{C},6,3"


def model_with(folder: Path, *cards: str, parameters: tuple[Parameter, ...] = ()) -> Model:
    path = folder / "model.bdf"
    path.write_text(small_study.deck(more=cards))
    return read_model(path, parameters=parameters)


def study_with(folder: Path, truth: small_study.Truth, *cards: str, out: Path | None = None) -> StudyRun:
    path = small_study.write_study(folder, truth)
    (folder / "model.bdf").write_text(small_study.deck(more=cards))
    found = diagnose(path, out)
    assert isinstance(found, StudyRun)
    return found


def damped(*laws: tuple[int, str, dict[str, float]], c: float = C) -> small_study.Truth:
    return small_study.Truth((7.3e10, 6.8e10), laws=[(6, "linear", {"k": 0.0, "c": c, "m": 0.0}), *laws])


def test_rows_make_the_damping_matrix_in_any_basis(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    bush = ("PBUSH,70,B,3.,4.,5.", "CBUSH,901,70,4,8,,,,0")
    model = model_with(tmp_path, DASHPOT, *bush)
    reduced = reduce_model(model, 150.0, [6 * model.index(13) + 2])
    indptr, indices, _, _, c, _ = model.fe.assemble()
    full = reduced.V_a.T @ (csc_array((c, indices, indptr), shape=(model.fe.n_a,) * 2) @ np.asarray(reduced.V_a))
    rows, of = reduced.dashpots
    assert set(of) == {None}
    # of the bush only Z moves the bars sideways, its X is an axial one
    assert 2 <= len(rows) <= MOST
    np.testing.assert_allclose(rows.T @ rows, full, atol=2e-4 * np.abs(full).max())
    # the dashpot and the three axes of the bush, one of which the supports hold
    assert dashpot_forces(model).shape == (model.fe.n_a, 4)
    monkeypatch.setattr(dashpots, "DENSE", 2)
    again = model_with(tmp_path, DASHPOT, *bush)
    small = reduce_model(again, 150.0, [6 * again.index(13) + 2])
    assert dashpot_forces(again).shape == (again.fe.n_a, 0)
    whole = small.V_a.T @ (csc_array((c, indices, indptr), shape=(model.fe.n_a,) * 2) @ np.asarray(small.V_a))
    np.testing.assert_allclose(small.dashpots.rows.T @ small.dashpots.rows, whole, atol=2e-4 * np.abs(whole).max())
    none = model_with(tmp_path)
    assert dashpot_rows(none, reduced.V, reduced.freq).rows.shape == (0, reduced.r)
    assert dashpot_forces(none).shape == (none.fe.n_a, 0)


def test_answers_are_those_of_the_whole_matrix() -> None:
    rng = np.random.default_rng(1)
    omega, zeta = np.array([10.0, 25.0, 60.0]), np.array([0.01, 0.02, 0.03])
    s = 1j * np.array([9.0, 26.0])
    left, right, own = rng.normal(size=(2, 3)), rng.normal(size=(1, 3)), rng.normal(size=(2, 3))
    found = answers(left, receptances(omega, zeta, s), right, s, own)
    for k, line in enumerate(s):
        Z = np.diag(omega**2 + line**2 + 2 * zeta * omega * line) + line * own.T @ own
        np.testing.assert_allclose(found[k], left @ np.linalg.solve(Z, right.T), rtol=1e-10)


def test_a_dashpot_that_the_deck_has_is_not_missing(tmp_path: Path) -> None:
    """Nor is it where it is not there: then a damper is."""
    found = study_with(tmp_path / "drawn", damped(), DASHPOT).result
    assert found["verdict"] == "parameters-only"
    assert max(row["final"] for row in found["fit"]) < 0.013
    assert [found["parameters"][n]["factor"] for n in ("E_root", "E_tip")] == pytest.approx(
        [7.3 / 7, 6.8 / 7], abs=0.01
    )
    lacking = study_with(tmp_path / "not drawn", damped()).result
    assert [f["physics"] for f in lacking["findings"]] == ["viscous_damper"]


@pytest.mark.parametrize(
    ("law", "physics", "parameter"),
    [
        ((9, "linear", {"k": 4e4, "c": 0.0, "m": 0.0}), "support_stiffness", ("k", 4e4)),
        ((7, "cubic_stiffness", {"k3": 5e9}), "cubic_stiffness", ("k3", 5e9)),
    ],
    ids=["spring", "cubic"],
)
def test_what_is_missing_beside_a_dashpot_is_named(
    tmp_path: Path, law: tuple[int, str, dict[str, float]], physics: str, parameter: tuple[str, float]
) -> None:
    run = study_with(tmp_path, damped(law), DASHPOT)
    (finding,) = run.result["findings"]
    assert (finding["physics"], finding["location"]["nodes"]) == (physics, [law[0]])
    assert finding["parameters"][parameter[0]]["value"] == pytest.approx(parameter[1], rel=0.1)
    assert max(row["final"] for row in run.result["fit"]) < 0.015


def test_loss_factors_and_free_dashpots_are_told(tmp_path: Path) -> None:
    eta = Parameter("loss", "eta", "elements", (901,))
    spring = "CELAS2,901,1.+4,6,3,,,0.2"
    model = model_with(tmp_path, spring, parameters=(*small_study.PARAMETERS, eta))
    told, local = damping_told(model, model.parameters)
    assert told.startswith("'loss' is a loss factor: `femend diagnose` takes damping, but that of dashpots, as damping")
    assert local.startswith("the deck has loss factors (GE) that are not those of the whole structure")
    reduced = reduce_model(model, 150.0, [6 * model.index(13) + 2])
    assert reduced.names == ("E_root", "E_tip", "loss")
    bush = ("PBUSH,70,B,3.,,5.", "CBUSH,902,70,4,8,,,,0")
    free = with_free_dashpots(model_with(tmp_path, DASHPOT, *bush, parameters=small_study.PARAMETERS))
    (told,) = damping_told(free, small_study.PARAMETERS)
    assert told.startswith(
        "dashpots of the deck are free within 50 %, since no [[parameter]] is of them: CDAMP2 900, c1 of PBUSH 70, "
        "c3 of PBUSH 70; give one"
    )
    # the bars hold node 4 along X as stiffly as node 8, but what is drawn there may be wrong all the same
    assert [p.ids for p in free.parameters[2:]] == [(900,), (902,), (902,)]


def test_a_dashpot_is_free_once_at_most(tmp_path: Path) -> None:
    own = (*small_study.PARAMETERS, Parameter("c tip", "c1", "elements", (900,), 0.2))
    model = model_with(tmp_path, DASHPOT, parameters=own)
    assert with_free_dashpots(model) is model
    rows, of = reduce_model(model, 150.0, [6 * model.index(13) + 2]).dashpots
    assert (len(rows), of) == (1, (2,))
    bare = model_with(tmp_path)
    assert with_free_dashpots(bare) is bare
    many = [f"CDAMP2,{900 + i},{C},{4 + i},3" for i in range(5)]
    held = model_with(tmp_path, *many)
    assert with_free_dashpots(held) is held


@pytest.mark.parametrize("drawn", [C / 2, 1.7 * C], ids=["too weak", "too strong"])
def test_the_strength_of_a_dashpot_is_found(tmp_path: Path, drawn: float) -> None:
    """Nothing is missing where a dashpot is weaker or stronger than drawn, and the deck is written with what it is."""
    run = study_with(tmp_path, damped(), DASHPOT.replace(str(C), str(drawn)), out=tmp_path / "out")
    assert run.result["verdict"] == "parameters-only", run.result["findings"]
    found = run.result["parameters"]["CDAMP2 900"]
    assert drawn * found["factor"] == pytest.approx(C, rel=0.05)
    assert found["sd"] < 0.05 * found["factor"]
    assert read_model(tmp_path / "out" / "model.updated.bdf").fe.assemble()[4].max() == pytest.approx(C, rel=0.05)
    assert max(row["final"] for row in run.result["fit"]) < 0.013


def test_what_is_missing_beside_a_dashpot_that_is_drawn_too_strong_is_named(tmp_path: Path) -> None:
    law = (7, "cubic_stiffness", {"k3": 5e9})
    run = study_with(tmp_path, damped(law), DASHPOT.replace(str(C), "20.0"))
    (finding,) = run.result["findings"]
    assert (finding["physics"], finding["location"]["nodes"]) == ("cubic_stiffness", [7])
    assert finding["parameters"]["k3"]["value"] == pytest.approx(5e9, rel=0.1)
    assert 20 * run.result["parameters"]["CDAMP2 900"]["factor"] == pytest.approx(C, rel=0.1)
    assert max(row["final"] for row in run.result["fit"]) < 0.015


def test_a_finding_at_a_dashpot_that_is_held_says_so(tmp_path: Path) -> None:
    model = model_with(tmp_path, DASHPOT)
    (told,) = at_dashpots(model, [{"physics": "viscous_damper", "location": {"nodes": [6]}}])
    assert told.startswith("the deck has a dashpot at 6 Z, where viscous_damper is told: a diagnosis held its value")
    assert not at_dashpots(model, [{"physics": "added_mass", "location": {"nodes": [7]}}])
    assert not at_dashpots(with_free_dashpots(model), [{"physics": "viscous_damper", "location": {"nodes": [6]}}])
