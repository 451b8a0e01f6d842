"""`femend update` on orders of a rotor's run: alone, beside a modal test, held out, with an unbalance that is known."""

from __future__ import annotations

import csv
import json
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from femend import correlate_study, update_study
from femend.bench import UpdateRun
from femend.errors import StudyError, UpdatingError
from femend.estimate.updating import FrfDifferences, OrderDifferences

sys.path.insert(0, str(Path(__file__).parents[1]))
from rigs import Rig, write_rig

# the deck's springs and block are off by these factors; the rotor turns against the right hand
RIG = Rig(bends=False, layer=None, seconds=30.0, sense=-1)
TRUTH = {"spring_axial": 0.9, "spring_x": 1.08, "spring_y": 1.08, "block_mass": 0.99}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("orders")
    write_rig(folder, RIG)
    return folder


@pytest.fixture(scope="module")
def study(folder: Path) -> Callable[..., Path]:
    """The study with recordings of these names alone, with `updating`, and other text."""
    head, *recordings = (folder / "study.toml").read_text().split("[[recording]]")

    def make(*names: str, updating: str = "", text: Callable[[str], str] = str) -> Path:
        own = [r for n in names for r in recordings if f'name = "{n}"' in r]
        path = folder / "some.toml"
        path.write_text(text("[[recording]]".join([head, *own])) + f"\n[updating]\n{updating}\n")
        return path

    return make


@pytest.fixture(scope="module")
def alone(study: Callable[..., Path], folder: Path) -> UpdateRun:
    return update_study(study("runup", updating='responses = ["orders"]'), folder / "out")


def test_a_run_alone_finds_springs_mass_and_the_unbalance_that_nobody_measured(alone: UpdateRun) -> None:
    assert alone.found.status == "converged"
    for name, factor in TRUTH.items():
        assert alone.factors[name] == pytest.approx(factor, abs=0.004), name
        assert abs(alone.factors[name] - factor) < 3 * alone.found.sd[name], name
    (run,) = alone.result["runs"]
    assert run["unbalance"] == "estimated"
    assert run["sense"] == RIG.sense
    assert run["against_it"] < 0.02
    assert [b["m_r"] for b in run["bearings"]] == pytest.approx(RIG.unbalance, rel=0.02)
    assert np.radians([b["phase_deg"] for b in run["bearings"]]) == pytest.approx(RIG.phase, abs=0.03)


def test_what_is_written(alone: UpdateRun, folder: Path) -> None:
    out = folder / "out"
    result = json.loads((out / "updating.json").read_text())
    (run,) = result["runs"]
    assert (run["recording"], run["role"], run["order"], len(run["lines"])) == ("runup", "fit", 1.0, 40)
    assert run["left"]["after"] < 0.5 < 2.0 < run["left"]["before"]
    assert run["after"]["csf"] > run["before"]["csf"] + 0.05
    assert result["recordings"] == result["counted"] == []
    # 40 lines at 24 sensors, of which four complex amplitudes are taken up
    assert result["squares"]["values"] == 2 * (40 * 24 - 4)
    assert np.sqrt(result["squares"]["after"] / result["squares"]["values"]) == pytest.approx(run["left"]["after"])
    with (out / "updating.runs.csv").open() as file:
        (row,) = csv.DictReader(file)
    assert float(row["left after"]) == pytest.approx(run["left"]["after"])
    assert float(row["CSF after"]) == pytest.approx(run["after"]["csf"])
    page = (out / "updating.html").read_text()
    assert "Used to fit on 40 lines" in page
    assert "turning against it; what turns the other way is" in page
    assert "measured frequencies are met" not in page
    assert "run       runup: 40 lines used to fit" in repr(alone)


def test_beside_a_modal_test_both_count(study: Callable[..., Path], alone: UpdateRun) -> None:
    asked = 'responses = ["frequencies", "shapes", "orders"]\norder_lines = 20\norder_sd = 0.05'
    run = update_study(study("hammer", "runup", updating=asked))
    assert [c.name for c in run.problem.configurations] == ["hammer", "runup"]
    response = run.problem.configurations[1].responses[0]
    assert isinstance(response, OrderDifferences)
    assert response.shapes.shape == (20, 24)
    largest = np.abs(response.shapes).max(axis=1, keepdims=True)
    assert (response.sd >= 0.05 * largest).all()
    assert (response.sd < 0.1 * largest).any()
    for name, factor in TRUTH.items():
        assert run.factors[name] == pytest.approx(factor, abs=0.004), name
        assert run.found.sd[name] < alone.found.sd[name] * 1.5
    (row,) = run.result["recordings"]
    assert row["after"]["freq_error"] < 0.001


def test_a_run_that_is_held_out_is_compared_and_has_no_part(study: Callable[..., Path]) -> None:
    def held(text: str) -> str:
        return text.replace('file = "runup.uff"', 'file = "runup.uff"\nrole = "validate"')

    asked = 'responses = ["frequencies", "shapes", "orders"]'
    with pytest.raises(UpdatingError, match="no rotor's recording to fit .*: there is none with role fit"):
        update_study(study("hammer", "runup", updating=asked, text=held))

    def again(text: str) -> str:
        own = text[text.index("[[recording]]") :].replace('name = "runup"', 'name = "again"')
        return text + own.replace('file = "runup.uff"', 'file = "runup.uff"\nrole = "validate"')

    run = update_study(study("runup", updating='responses = ["orders"]', text=again))
    assert [c.name for c in run.problem.configurations] == ["runup"]
    fitted, other = run.result["runs"]
    assert (other["recording"], other["role"]) == ("again", "validate")
    assert "lines" in fitted
    assert "lines" not in other
    assert (other["before"], other["after"]) == (fitted["before"], fitted["after"])
    assert "run       again: held out, CSF" in repr(run)


def test_a_known_unbalance_is_taken_as_it_is(study: Callable[..., Path]) -> None:
    def known(scale: float) -> Callable[[str], str]:
        entries = ", ".join(
            f"{{ node = {n}, m_r = {scale * u}, phase_deg = {np.degrees(p)} }}"
            for n, u, p in zip((511, 512), RIG.unbalance, RIG.phase, strict=True)
        )
        return lambda text: f"{text}unbalance = [{entries}]\nsense = -1\n"

    right, wrong = (
        update_study(study("runup", updating='responses = ["orders"]', text=known(scale))) for scale in (1.0, 1.5)
    )
    assert right.result["runs"][0]["unbalance"] == "as the study gives it"
    for name, factor in TRUTH.items():
        assert right.factors[name] == pytest.approx(factor, abs=0.004), name
    # masses and springs cannot make a rotor's response half again as large
    assert wrong.result["runs"][0]["left"]["after"] > 5 * right.result["runs"][0]["left"]["after"]


def test_what_does_not_fit_is_told(study: Callable[..., Path]) -> None:
    with pytest.raises(UpdatingError, match="responses has 'orders', and no rotor's recording to fit"):
        update_study(study("hammer", updating='responses = ["frequencies", "orders"]'))
    with pytest.raises(UpdatingError, match="bearing node 999 of .recording.rotating. is not among"):
        update_study(
            study(
                "hammer",
                "runup",
                updating='responses = ["frequencies", "orders"]',
                text=lambda t: t.replace("512]", "999]"),
            )
        )
    with pytest.raises(StudyError, match=r"updating.order_sd.*0 is not above 0"):
        update_study(study("runup", updating='responses = ["orders"]\norder_sd = 0'))
    with pytest.raises(StudyError, match=r"updating.order_lines.*0 is less than one"):
        update_study(study("runup", updating='responses = ["orders"]\norder_lines = 0'))
    run = update_study(study("hammer", "runup"))
    (told,) = [w for w in run.result["warnings"] if "'runup'" in w]
    assert "'orders' in [updating] responses takes them" in told
    assert run.result["runs"] == []
    assert not any(isinstance(r, FrfDifferences) for c in run.problem.configurations for r in c.responses)


def test_rotors_of_the_deck_turn_in_a_run(tmp_path: Path) -> None:
    """A rotor in the bearings whose gyroscopic moments the deck has (ROTORG): with it springs and unbalance are found,
    without the card one spring is 36 % off."""
    ip = 0.06
    rig = Rig(bends=False, layer=None, seconds=30.0, sense=-1, ip=ip)
    write_rig(tmp_path, rig)
    head, *recordings = (tmp_path / "study.toml").read_text().split("[[recording]]")
    own = [r for r in recordings if 'name = "runup"' in r]
    study = tmp_path / "run.toml"
    study.write_text("[[recording]]".join([head, *own]) + '\n[updating]\nresponses = ["orders"]\n')
    deck = tmp_path / "model.bdf"
    # its inertia about the shaft is part of the block's
    block = f"+,{rig.mass * 0.0061:.6f},"
    disc = f"CONM2,9002,511,,1.-6\n+,{ip}\n"
    assert deck.read_text().count(block) == 1
    still = deck.read_text().replace(block, f"+,{rig.mass * 0.0061 - ip:.6f},").replace("ENDDATA", f"{disc}ENDDATA")
    found = {}
    for name, cards in (("at rest", ""), ("turning", "ROTORG,3,511,512\nRSPINR,3,511,512,RPM,1.\n")):
        deck.write_text(still.replace("ENDDATA", f"{cards}ENDDATA"))
        found[name] = update_study(study)
    for name in ("spring_x", "spring_y", "spring_axial"):
        assert found["turning"].factors[name] == pytest.approx(TRUTH[name], abs=0.02), name
    assert abs(found["at rest"].factors["spring_x"] - TRUTH["spring_x"]) > 0.3
    (run,), (other,) = found["turning"].result["runs"], found["at rest"].result["runs"]
    assert run["sense"] == -1
    assert [b["m_r"] for b in run["bearings"]] == pytest.approx(rig.unbalance, rel=0.02)
    assert run["left"]["after"] < 0.2 * other["left"]["after"]
    study.write_text(study.read_text().replace('axis = "X"', 'axis = "Y"'))
    told = " ".join(correlate_study(study).result["warnings"])
    assert "no rotor of the deck lies along Y, the axis in [recording.rotating] of runup" in told
