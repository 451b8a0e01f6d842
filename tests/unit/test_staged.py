"""Stages: which term a stage takes, what it says about modes a test cannot see, what a study needs to be staged."""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from femend import load_study
from femend.diagnose.staged import (
    ConfigurationSpec,
    Setup,
    StagedData,
    StagedSettings,
    run_stages,
    sensor_warnings,
    setup_of,
    staged_data,
)
from femend.diagnose.staged.setup import carried
from femend.estimate import pair_test
from femend.model import Parameter
from femend.model.model import read_model
from femend.model.terms.configured import ALPHA, free_model
from femend.study.staged.run import is_staged

sys.path.insert(0, str(Path(__file__).parents[1]))
from rigs import Rig, write_hammer


def clamped(folder: Path, rig: Rig) -> tuple[Setup, StagedData]:
    """The clamped modal test of a rig, with few places to try."""
    path = write_hammer(folder, rig)
    study = load_study(path)
    parameters = [Parameter(p.name, p.property, p.target, p.ids, p.prior_sd) for p in study.parameters]
    free = free_model(read_model(study.model_file).deck, units="SI", parameters=parameters)
    test = study.read_recordings()
    pairing = pair_test(test, free)
    settings = StagedSettings(most_places=2)
    rows = [free.row(pairing[c.dof].dof) for r in test for c in r.inputs if c.dof is not None]
    specs = [ConfigurationSpec("clamped", 1)]
    return setup_of(free, specs, pairing, band=(3.0, 40.0), zeta=0.01, g_rows=rows, settings=settings), staged_data(
        test
    )


def test_springs_that_bend_are_named_and_the_unseen_mode_is_told(tmp_path: Path) -> None:
    setup, data = clamped(tmp_path, Rig())
    flow = run_stages(setup, data, naming=True)
    assert [term.physics for term, _ in flow.named] == ["spring_bending"]
    values = dict(zip(flow.posterior.unknowns.names, flow.posterior.values, strict=True))
    # bars of 0.1 m clamped at both ends: E I / L = k L^2 / 12 with k 8 % above the deck's
    expected = 1.08 * 12000.0 * 0.1**2 / 12
    assert values["bending of springs 11: k_rot_x"] == pytest.approx(expected, rel=0.2)
    assert values["bending of springs 11: k_rot_y"] == pytest.approx(expected, rel=0.2)
    for stage in flow.stages:
        assert any("cannot see" in remark for remark in stage.remarks), stage.name
    assert flow.stages[-1].unexplained < 1.1 * flow.stages[-1].noise


def test_springs_that_do_not_bend_are_left_alone(tmp_path: Path) -> None:
    setup, data = clamped(tmp_path, Rig(bends=False))
    flow = run_stages(setup, data, naming=True)
    assert flow.named == ()
    values = dict(zip(flow.posterior.unknowns.names, flow.posterior.values, strict=True))
    assert [values[n] for n in ("spring_x", "spring_y", "spring_axial")] == pytest.approx([1.08, 1.08, 0.9], rel=0.01)


def test_a_reversed_blow_and_two_exchanged_ones_are_named(tmp_path: Path) -> None:
    setup, data = clamped(tmp_path, Rig(bends=False))
    (frf,) = data.frfs["clamped"]
    assert sensor_warnings(setup, data, run_stages(setup, data, naming=False)) == ()
    names = [str(d) for d in frf.inputs]
    H, (i, a, b) = frf.H.copy(), (names.index(n) for n in ("503:+Z", "501:+X", "502:+Z"))
    H[:, :, i] *= -1
    H[:, :, [a, b]] = H[:, :, [b, a]]
    wrong = replace(data, frfs={"clamped": [replace(frf, H=H)]}, test_modes={})
    said = sensor_warnings(setup, wrong, run_stages(setup, wrong, naming=False))
    assert len(said) == 2, said
    assert "505:+Z / 503:+Z runs against the model" in said[0]
    assert "505:+Z / 501:+X and 505:+Z / 502:+Z seem to be exchanged" in said[1]


def test_a_reversed_sensor_of_output_only_modes_is_named(tmp_path: Path) -> None:
    """The modes of the test once more, as if found without its force, one sensor upside down: fitted and told."""
    setup, data = clamped(tmp_path, Rig(bends=False))
    (found,) = data.test_modes["clamped"]
    row = [str(d) for d in found.modes.dofs].index("506:+Z")
    shapes = found.modes.shapes.copy()
    shapes[row] *= -1
    alone = replace(found, name="alone", modes=replace(found.modes, shapes=shapes))
    wrong = replace(data, output_only={"clamped": [alone]})
    (said,) = sensor_warnings(setup, wrong, run_stages(setup, wrong, naming=False))
    assert said.startswith("recording 'alone': channel 506:+Z runs against the model")


def test_what_a_stage_settled_is_the_prior_of_the_next_widened_by_the_drift(tmp_path: Path) -> None:
    setup, data = clamped(tmp_path, Rig(bends=False))
    flow = run_stages(setup, data, naming=False)
    unknowns = carried(setup, setup.unknowns(flow.terms), flow.posterior)
    i = unknowns.index("spring_x")
    sd = np.sqrt(np.linalg.inv(unknowns.precision)[i, i])
    assert unknowns.mean[i] == flow.posterior.p[flow.posterior.unknowns.index("spring_x")]
    assert setup.settings.drift < sd < 1.5 * setup.settings.drift
    assert np.linalg.inv(unknowns.precision)[unknowns.index(ALPHA), unknowns.index(ALPHA)] > 0.2**2


def test_studies_that_need_stages(tmp_path: Path) -> None:
    path = write_hammer(tmp_path, Rig())
    assert not is_staged(load_study(path))
    two = path.read_text() + '[[recording]]\nname = "again"\nfile = "hammer.uff"\nconfiguration = "operation"\n'
    path.write_text(two)
    assert is_staged(load_study(path))


@pytest.mark.slow
def test_a_result_is_plain_json(tmp_path: Path) -> None:
    """Two configurations of one clamped test: nothing differs between them, and the study says so from end to end."""
    from femend.study.run import diagnose

    path = write_hammer(tmp_path, Rig(bends=False))
    text = path.read_text() + '[[recording]]\nname = "again"\nfile = "hammer.uff"\nconfiguration = "operation"\n'
    path.write_text(text)
    out = tmp_path / "out"
    run = diagnose(path, out)
    result = json.loads((out / "result.json").read_text())
    assert result == run.result
    assert result["verdict"] == "parameters-only"
    assert result["findings"] == []
    assert {row["recording"] for row in result["fit"]} == {"hammer", "again"}
    assert all(row["final"] < 0.02 for row in result["fit"])
    assert (out / "report.html").stat().st_size > 10_000
    assert read_model(out / "model.updated.bdf").fe.n_a == read_model(tmp_path / "model.bdf").fe.n_a
