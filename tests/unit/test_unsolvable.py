"""Decks without a solution are told by card and DOF; a body that is free is diagnosed as it is."""

from __future__ import annotations

import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from femend.analysis.model_modes import model_modes
from femend.diagnose.updating.update import update_model
from femend.errors import ModelError
from femend.estimate import fit_records, pair_test
from femend.model import Model, read_model
from femend.model.cards.negative import negative_values
from femend.model.reduced.reduction import reduce_model
from femend.model.terms.configured import configure, free_model
from femend.model.terms.unknowns import Unknown, Unknowns
from femend.study import load_study
from femend.study.doubts.plausible import _free
from femend.study.staged.result import _verdict

sys.path.insert(0, str(Path(__file__).parents[1]))
import small_study


def model_of(folder: Path, text: str) -> Model:
    path = folder / "model.bdf"
    path.write_text(text)
    return read_model(path, parameters=small_study.PARAMETERS)


def test_a_negative_spring_is_named(tmp_path: Path) -> None:
    model = model_of(tmp_path, small_study.deck(more=("CELAS2,300,-1+6,13,3",)))
    for solve in (lambda: model_modes(model), lambda: reduce_model(model, 200.0, [0])):
        with pytest.raises(ModelError, match=r"stiffness of the model is negative in 1 way.*CELAS2 300 at node 13"):
            solve()


def test_values_of_properties_below_nothing_are_told(tmp_path: Path) -> None:
    more = ("GRID,99,,0.72,0.,0.1", "PBUSH,7,K,1.,-2.,3.", "CBUSH,300,7,13,99,,,,0", "CBUSH,301,7,13,99,,,,0")
    (told,) = negative_values(model_of(tmp_path, small_study.deck(more=more)).deck)
    assert "PBUSH 7 (CBUSH 300 and its like) has a stiffness of -2." in told


@pytest.mark.parametrize(
    ("change", "said"), [((",,0.33,2700.", ",,0.33,0."), "density"), (("9,,0.1", "9,,-10."), "CONM2 100 at node 9")]
)
def test_a_mass_that_is_not_positive_is_told(tmp_path: Path, change: tuple[str, str], said: str) -> None:
    text = small_study.deck().replace(*change)
    model = model_of(tmp_path, text if "CONM2" in said else text.replace("9,,0.1", "9,,0."))
    unknowns = Unknowns.of([Unknown(p.name, 1.0, sd=0.1) for p in model.parameters])
    free = free_model(model.deck, units="SI", parameters=model.parameters)
    with pytest.raises(ModelError, match=f"mass is not above 0.*{said}"):
        configure("as modelled", free, unknowns, (), spc=None, f_max=200.0, g_rows=[0])


@pytest.mark.parametrize("cut", ["SPC = 1\n", "CBAR,7,2,7,8,0.,0.,1.\n"])
def test_what_is_free_can_be_updated(tmp_path: Path, cut: str) -> None:
    study = load_study(small_study.write_study(tmp_path, small_study.Truth()))
    model = model_of(tmp_path, small_study.deck().replace(cut, ""))
    test = [r for r in study.read_recordings() if r.name == "low"]
    records = fit_records(test, model, pair_test(study.read_recordings(), model))
    assert np.isfinite(update_model(model, records, 0.01).null.cost)


def test_who_moves_freely_is_told_by_node(tmp_path: Path) -> None:
    model = model_of(tmp_path, small_study.deck().replace("CBAR,7,2,7,8,0.,0.,1.\n", ""))
    (told,) = _free(model, model_modes(model))
    assert "3 ways" in told
    assert "nodes 8, 9, 10, 11, 12, 13 that move (elements 8, 9, 10, 11, 12" in told


def test_modes_that_are_not_the_models_leave_it_open() -> None:
    class Stage:
        name, configuration, recordings, unexplained, noise = "output-only modes", "as modelled", ("a",), 0.1, 0.001
        remarks, run, rounds, table = (
            (),
            None,
            (),
            ((10.0, 0.01, 25.0, 0.01, 0.2, 0.01), (20.0, 0.01, 40.0, 0.01, 0.1, 0.02)),
        )

    class Flow:
        stages, unseen, runs, beside = (Stage(),), (), (), ""

    verdict, advice = _verdict(SimpleNamespace(settings=None), SimpleNamespace(runs={}), Flow(), [])  # type: ignore[arg-type]
    assert verdict == "undetermined"
    assert "none of the 2 identified modes has a counterpart" in advice
    assert "check supports" in advice
