"""Masses of a configuration in another unit than the deck's."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from femend.model import read_model
from femend.study import load_study
from femend.study.doubts.added_masses import added_mass_doubts, planned_mass_doubts

sys.path.insert(0, str(Path(__file__).parents[1]))
from bench_study import Recorded, study_text
from small_study import deck


@pytest.mark.parametrize(("added", "told"), [(0.05, False), (50.0, True)])
def test_an_addition_that_outweighs_the_structure_is_told(tmp_path: Path, added: float, told: bool) -> None:
    (tmp_path / "model.bdf").write_text(deck())
    (tmp_path / "modes.uff").touch()
    table = f'[[configuration]]\nname = "heavier"\nadded_mass = [{{ node = 13, m = {added} }}]\n'
    (tmp_path / "study.toml").write_text(study_text((Recorded("modes"),), table))
    study = load_study(tmp_path / "study.toml", recordings=False)
    for with_it in ((), ((13, added),)):
        found = added_mass_doubts(study, read_model(tmp_path / "model.bdf", added_mass=with_it))
        assert bool(found) is told
        if told:
            assert found[0].startswith("configuration 'heavier' adds 50 kg, ")
            assert "added_mass is in the deck's unit of mass, which is kg for 'SI'" in found[0]


@pytest.mark.parametrize(("sensor", "mass", "told"), [(0.005, 0.3, []), (5.0, 0.3, ["sensor"]), (0.0, 20.0, ["dist"])])
def test_planned_masses_that_outweigh_the_structure_are_told(
    tmp_path: Path, sensor: float, mass: float, told: list[str]
) -> None:
    """Sensors in grams, a mass in grams beside kg."""
    (tmp_path / "model.bdf").write_text(deck())
    table = f"""[pretest]
sensors = 4
sensor_mass = {sensor}
distinguish = [{{ parameter = "E_root" }}, {{ physics = "added_mass", node = 9, m = {mass} }}]
"""
    (tmp_path / "study.toml").write_text(study_text((), table))
    study = load_study(tmp_path / "study.toml", recordings=False)
    found = planned_mass_doubts(study, read_model(tmp_path / "model.bdf"))
    begins = {
        "sensor": "[pretest] sensor_mass: 4 sensors of 5 kg each weigh ",
        "dist": "[pretest] distinguish[1]: 20 kg",
    }
    assert [f.startswith(begins[w]) for f, w in zip(found, told, strict=True)] == [True] * len(told)
    assert all("times the mass of the deck (0.698 kg): masses are in the deck's unit, which is kg" in f for f in found)


def test_masses_are_in_the_unit_of_the_system_where_the_deck_scales_those_on_its_cards(tmp_path: Path) -> None:
    """Cards in g, PARAM,WTMASS of 1e-3: an added mass of 0.3 is 0.3 kg, as without both."""
    text = deck()
    (tmp_path / "plain.bdf").write_text(text)
    grams = (
        text.replace(",2700.", ",2.7+6")
        .replace("9,,0.1\n", "9,,100.\n")
        .replace("BEGIN BULK\n", "BEGIN BULK\nPARAM,WTMASS,1.-3\n")
    )
    (tmp_path / "grams.bdf").write_text(grams)
    plain, scaled = (read_model(tmp_path / f"{n}.bdf", added_mass=[(13, 0.3)]) for n in ("plain", "grams"))
    assert scaled.total_mass == pytest.approx(plain.total_mass, rel=1e-12)
    assert abs(scaled.matrices()[1] - plain.matrices()[1]).max() < 1e-12
