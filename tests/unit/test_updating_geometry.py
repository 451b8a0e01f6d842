"""Geometry that is wrong by a known amount is found by updating, and the written deck says the same."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from femend.dof import Dof
from femend.estimate.updating import (
    Configuration,
    Frequencies,
    FrfDifferences,
    Frfs,
    ModeTest,
    Problem,
    ShapeDifferences,
    deck_system,
    sensitivities,
    unknowns_of,
    update,
    updated_deck,
)
from femend.model import Morph, Parameter, joint_moved, offset_along_normal, read_model

sys.path.insert(0, str(Path(__file__).parents[1]))
from morph_models import frame_deck, rib_deck

SENSORS = [Dof.parse(f"{n}:{d}") for n in (3, 12, 21, 32, 42) for d in ("+X", "+Y", "+Z")]
STEEL = Parameter("E", "E", "material", (1,), 0.05, (0.7, 1.4))


def test_a_joint_that_stands_too_high_is_found(tmp_path: Path) -> None:
    truth = deck_system(read_model(frame_deck(tmp_path / "truth", apex=0.035)), SENSORS, 8).solve(np.ones(0))
    freq, phi = truth.value("freq")[:6] * np.sqrt(0.92), truth.value("phi")[:, :6]
    model = read_model(frame_deck(tmp_path / "deck"), parameters=[STEEL])
    apex = joint_moved(model, "apex", 0.05, [21], (0, 0, 1), held=[4, 41], bounds=(-0.2, 0.2))
    model = model.with_morphs([apex])
    system = deck_system(model, SENSORS, 8)
    responses = (Frequencies(freq, 1e-3 * freq), ShapeDifferences(phi, 0.01))
    problem = Problem(unknowns_of(model), (Configuration("frame", system, responses, ModeTest(freq, phi)),))
    told = sensitivities(problem)
    assert told.names == ("E", "apex")
    assert not told.insensitive
    assert not told.collinear
    result = update(problem)
    assert result.status == "converged"
    # the priors hold both back by some 1e-4 of their deviations
    assert result.values["apex"] == pytest.approx(0.035, abs=2e-5)
    assert result.values["E"] == pytest.approx(0.92, abs=1e-4)
    new = updated_deck(model, result.values)
    assert sorted(p.name for p in new.files) == ["frame.bdf", "nodes.bdf"]
    new.write(tmp_path / "new", tmp_path / "deck")
    again = deck_system(read_model(tmp_path / "new" / "frame.bdf"), SENSORS, 8).solve(np.ones(0))
    updated = result.after.states[0].value("freq")
    # E and some coordinates have six digits in their columns
    assert again.value("freq") == pytest.approx(updated, rel=2e-6)
    assert np.abs(updated[:6] / freq - 1).max() < 5e-5


def test_the_deck_keeps_its_format(tmp_path: Path) -> None:
    model = read_model(frame_deck(tmp_path))
    model = model.with_morphs([joint_moved(model, "apex", 0.05, [21], (0, 0, 1), held=[4, 41])])
    new = updated_deck(model, {"apex": 0.02})
    ((path, content),) = new.files.items()
    before, after = path.read_text().splitlines(), content.decode().splitlines()
    changed = [i for i, (a, b) in enumerate(zip(before, after, strict=True)) if a != b]
    assert [before[i][:40].split("$")[0].strip() for i in changed] == [
        "*       1.6500000000",
        "*       1.8000000000",
        "*       1.9500000000",
        "GRID,21,,1.5,0.,2.100000,,,",
        "GRID,31,,1.875000000,0.,1.950000000",
        "GRID,32,5,1.950000000,22.619864948,0.",
        "GRID,33,,2.625000000,0.,1.650000000",
    ]
    assert after[changed[3]] == "GRID,21,,1.5,0.,2.12,,,     $ apex"
    assert after[changed[0]].startswith("*       1.655 ")
    # x = 2.25, z = 1.81 about the axis at x = 1.5
    r, turn = (float(text) for text in after[changed[5]].split(",")[3:5])
    assert (r, turn) == pytest.approx((np.hypot(0.75, 1.81), np.degrees(np.arctan2(0.75, 1.81))), abs=1e-9)
    assert updated_deck(model, {"apex": 0.0}).diff == ""
    assert updated_deck(model, {}).files == {}


def test_a_plate_that_is_off_is_found_beside_its_thickness(tmp_path: Path) -> None:
    sensors = [Dof.parse(f"{n}:+{d}") for n in (35, 37, 38, 40, 67, 69, 70, 72) for d in "YZ"]
    truth = deck_system(read_model(rib_deck(tmp_path / "truth", height=0.112, wide=True)), sensors, 8)
    state = truth.solve(np.ones(0))
    freq, phi = state.value("freq")[:6], state.value("phi")[:, :6]
    model = read_model(rib_deck(tmp_path / "deck"), parameters=[Parameter("t", "t", "property_id", (4,), 0.1)])
    lid = offset_along_normal(model, "lid", 0.02, properties=(4,), bounds=(-0.04, 0.04))
    up = float(lid.field[0, 2])
    # the middle row of the flanges stands half way up, as drawn
    rows = np.isin(model.deck.node_ids % 8, (4, 5))
    middle = model.deck.node_ids[rows]
    nodes = np.concatenate([lid.nodes, middle])
    field = np.vstack([lid.field, np.tile([0, 0, 0.5 * up], (middle.size, 1))])
    model = model.with_morphs([Morph("lid", nodes, field, lid.prior_sd, lid.bounds, lid.unit)])
    system = deck_system(model, sensors, 8)
    responses = (Frequencies(freq, 1e-3 * freq), ShapeDifferences(phi, 0.01))
    problem = Problem(unknowns_of(model), (Configuration("channel", system, responses, ModeTest(freq, phi)),))
    result = update(problem)
    assert result.status == "converged"
    assert result.values["lid"] * up == pytest.approx(0.012, abs=2e-5)
    assert result.values["t"] == pytest.approx(1.0, abs=2e-3)
    updated_deck(model, result.values).write(tmp_path / "new")
    again = deck_system(read_model(tmp_path / "new" / "rib.bdf"), sensors, 8).solve(np.ones(0))
    # eight columns hold coordinates of 0.1 to 5e-8
    assert again.value("freq") == pytest.approx(result.after.states[0].value("freq"), rel=2e-5)


def test_sensitivities_of_modes_and_frfs_are_those_of_differences(tmp_path: Path) -> None:
    deck = frame_deck(tmp_path)
    deck.write_text(deck.read_text().replace("MAT1,1,2.1E11,,.3,7850.", "MAT1,1,2.1E11,,.3,7850.,,,.02"))
    model = read_model(deck, parameters=[STEEL])
    model = model.with_morphs([joint_moved(model, "apex", 0.05, [21], (0, 0, 1), held=[4, 41])])
    frfs = Frfs(np.array([9.0, 21.5]), (2, 8), (8,), "receptance")
    system = deck_system(model, SENSORS, 5, frfs=frfs)
    assert system.names == ("E", "apex", "alpha", "beta", "eta")
    at = np.array([0.97, 0.02, 1.0, 1e-5, 0.01])
    state = system.solve(at)
    h = 1e-4
    up, down = (system.solve(at + np.array([0, s, 0, 0, 0])) for s in (h, -h))
    for name in ("freq", "phi", "frf"):
        slope = (up.value(name) - down.value(name)) / (2 * h)
        if name == "phi":
            signs = np.sign((up.value(name) * state.value(name)).sum(axis=0))
            other = np.sign((down.value(name) * state.value(name)).sum(axis=0))
            slope = (up.value(name) * signs - down.value(name) * other) / (2 * h)
        # second order of the step of 1e-4, beside a member of 1.6
        assert np.abs(state.slope(name)[1] - slope).max() <= 2e-5 * np.abs(slope).max(), name


def test_frfs_alone_tell_where_the_joint_is(tmp_path: Path) -> None:
    frfs = Frfs(np.linspace(4.0, 40.0, 25), (2, 8), (8,), "accelerance")
    truth = read_model(frame_deck(tmp_path / "truth", apex=-0.02))
    H = deck_system(truth, SENSORS, 0, frfs=frfs).solve(np.array([1.0, 1e-5, 0.01])).value("frf")
    model = read_model(frame_deck(tmp_path / "deck"))
    model = model.with_morphs([joint_moved(model, "apex", 0.03, [21], (0, 0, 1), held=[4, 41])])
    system = deck_system(model, SENSORS, 0, frfs=frfs)
    system.defaults = {**system.defaults, "alpha": 1.0, "beta": 1e-5, "eta": 0.01}
    problem = Problem(unknowns_of(model), (Configuration("frame", system, (FrfDifferences(H, 0.002, "logarithm"),)),))
    result = update(problem)
    # the prior of 0.03 holds back by (sd / 0.03)^2 of the way: sd is 1.3e-4
    assert result.values["apex"] == pytest.approx(-0.02, abs=2e-6)


def test_a_trial_point_without_shape_shortens_the_step(tmp_path: Path) -> None:
    sensors = [Dof.parse(f"{n}:+{d}") for n in (35, 37, 38, 40, 67, 69, 70, 72) for d in "YZ"]
    model = read_model(rib_deck(tmp_path, wide=True))
    lid = offset_along_normal(model, "lid", 1.0, properties=(4,))
    up = float(lid.field[0, 2])
    model = model.with_morphs([lid])
    system = deck_system(model, sensors, 8)
    # elements fold at 0.05, and the first step from 0 wants to go beyond
    state = system.solve(np.array([-0.045 * up]))
    freq, phi = state.value("freq")[:6], state.value("phi")[:, :6]
    responses = (Frequencies(freq, 1e-3 * freq), ShapeDifferences(phi, 0.01))
    result = update(Problem(unknowns_of(model), (Configuration("channel", system, responses, ModeTest(freq, phi)),)))
    notes = " ".join(note for step in result.history for note in step.notes)
    assert "no result at a trial point: CQUAD4" in notes
    assert result.status == "converged"
    assert result.values["lid"] * up == pytest.approx(-0.045, abs=1e-6)
