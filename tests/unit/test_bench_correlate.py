"""`femend correlate`: a small study from its files to tables, and what stands in its way, said."""

from __future__ import annotations

import csv
import json
import re
import sys
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

from femend import Dof, correlate_study, functions_of, model_modes, read_model, update_study, write_uff
from femend.bench import CorrelationRun
from femend.bench.reading.compared import _faults
from femend.bench.reading.placed import Placed, placed_sensors
from femend.cli import main
from femend.data import FRF, Geometry
from femend.errors import FormatError, PairingError, RecordingError, StudyError

sys.path.insert(0, str(Path(__file__).parents[1]))
from bench_study import SENSORS, Recorded, measured_frf, study_text, write_modes, write_study
from small_study import deck

DOFS = tuple(Dof(n, 3) for n in SENSORS)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("bench")


@pytest.fixture(scope="module")
def run(folder: Path) -> CorrelationRun:
    return correlate_study(write_study(folder), folder / "out")


def truth_modes(folder: Path, E: tuple[float, float] = (7.7e10, 6.6e10)) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies (3,) and shapes (6, 3) of the truth at the sensors."""
    path = folder / "truth.bdf"
    path.write_text(deck(E))
    modes = model_modes(read_model(path), n_modes=3)
    rows = [modes.dofs.index(d) for d in DOFS]
    return modes.freq, modes.phi[rows]


def modes_study(folder: Path, tables: str = "") -> Path:
    """A study whose test is a file of modes."""
    (folder / "model.bdf").write_text(deck())
    path = folder / "study.toml"
    path.write_text(study_text((Recorded("modes"),), tables))
    return path


def test_two_channels_of_responses_alone_at_one_dof_are_named(tmp_path: Path) -> None:
    (tmp_path / "model.bdf").write_text(deck())
    noise = np.random.default_rng(0).standard_normal((2000, 3))
    lines = ["t,left,right,top", *(f"{i / 1000:.3f},{a:.5f},{b:.5f},{c:.5f}" for i, (a, b, c) in enumerate(noise))]
    (tmp_path / "wind.csv").write_text("\n".join([*lines, ""]))
    told = '\n[[recording]]\nname = "wind"\nfile = "wind.csv"\nexcitation = "ambient"\n'
    for source, node, sign in (("left", 3, "+"), ("right", 5, "+"), ("top", 3, "-")):
        told += f'[[recording.channel]]\nsource = "{source}"\nnode = {node}\ndirection = "{sign}Z"\n'
        told += 'quantity = "acceleration"\nunit = "m/s^2"\n'
    path = tmp_path / "study.toml"
    path.write_text(study_text((), "") + told)
    said = (
        r"recording 'wind': DOF 3:\+Z stands twice among the 3 responses, as channel 1, acceleration 3:\+Z \(left\), "
        r"and channel 3, acceleration 3:-Z \(top\): correct the node or the direction"
    )
    with pytest.raises(RecordingError, match=said):
        correlate_study(path, tmp_path / "out")


def test_that_mac_at_one_dof_says_nothing_is_told(tmp_path: Path) -> None:
    path = modes_study(tmp_path)
    freq, phi = truth_modes(tmp_path)
    told = []
    for n in (1, 2):
        write_modes(tmp_path / "modes.uff", freq, phi[-n:], DOFS[-n:])
        told += [correlate_study(path, tmp_path / "c").result, update_study(path, tmp_path / "u").result]
    said = "recording 'modes': shapes are compared at one DOF, 13:+Z, where MAC is 1 of any two modes"
    assert [sum(w.startswith(said) for w in result["warnings"]) for result in told] == [1, 1, 0, 0]


def test_modes_are_identified_paired_and_tabulated(run: CorrelationRun, folder: Path) -> None:
    freq, _ = truth_modes(folder)
    one = run["tip"]
    assert one.n_pairs == one.n_test == 3
    np.testing.assert_allclose(one.test.freq, freq, rtol=1e-4)
    rows = one.comparison.table.rows
    # the deck is as soft at the root as it is stiff at the tip: 1 falls by 4 %, 2 and 3 by 0.1 and 1.4 %
    np.testing.assert_allclose([r.freq_difference for r in rows], [-0.0415, -0.001, -0.0139], atol=5e-4)
    assert min(r.mac for r in rows) > 0.998
    np.testing.assert_allclose(one.test.zeta, 0.01, rtol=0.02)


def test_what_is_written(run: CorrelationRun, folder: Path) -> None:
    out = folder / "out"
    result = json.loads((out / "correlation.json").read_text())
    assert result["format"] == "femend-correlation/1"
    assert [(r["recording"], r["role"]) for r in result["recordings"]] == [("tip", "fit"), ("middle", "validate")]
    one = result["recordings"][0]
    assert np.shape(one["mac"]) == (3, len(one["model_freq"]))
    assert len(one["comac"]) == len(one["ecomac"]) == len(one["dofs"]) == 6
    assert min(one["comac"]) > 0.99
    # shapes agree line by line, levels do where no resonance is moved
    assert one["frfs"]["mean_csac"] > 0.98
    assert np.shape(one["frfs"]["frac"]) == (6, 1)
    with (out / "correlation.modes.csv").open() as file:
        table = list(csv.DictReader(file))
    assert len(table) == 6
    assert float(table[0]["MAC"]) == pytest.approx(one["modes"]["rows"][0]["mac"], abs=1e-12)
    page = (out / "correlation.html").read_text()
    assert "6 of 6 measured modes are paired" in page
    assert "data:image/png;base64," in page
    assert not re.search(r'(?:src|href)="https?:', page)
    assert {p.name for p in out.iterdir()} == {
        "correlation.json", "correlation.html", "correlation.run.json", "correlation.modes.csv",
        "correlation.sensors.csv", "correlation.frfs.csv", "correlation.elements.csv", "correlation.parameters.csv",
    }  # fmt: skip


def test_shapes_are_orthogonal_over_the_reduced_mass(run: CorrelationRun, folder: Path) -> None:
    table = run.tams[0]
    assert table is not None
    assert [r.method for r in table.rows] == ["Guyan", "IRS", "SEREP", "hybrid"]
    for row in table.rows:
        # six sensors hold the mass of three modes; the test's shapes are those of a deck that is 10 % off
        assert row.off_model < 0.01
        assert row.off_test < 0.01
        assert row.least_pair > 0.995
        assert row.off_cross < 0.05
    result = json.loads((folder / "out" / "correlation.json").read_text())
    assert [r["reduction"] for r in result["recordings"][0]["orthogonality"]] == ["Guyan", "IRS", "SEREP", "hybrid"]
    assert "NASA-STD-5002" in (folder / "out" / "correlation.html").read_text()


def test_a_sensor_that_is_turned_round_keeps_orthogonality(tmp_path: Path) -> None:
    freq, phi = truth_modes(tmp_path)
    phi[3] *= -1
    dofs = tuple(Dof(d.node, 3, -1 if i == 3 else 1) for i, d in enumerate(DOFS))
    # data set 55 has no signs: the file holds the motion along +Z again, as read
    write_modes(tmp_path / "modes.uff", freq, phi, dofs)
    run = correlate_study(modes_study(tmp_path))
    assert run["modes"].faults == ()
    assert run.tams[0] is not None
    assert run.tams[0]["Guyan"].least_pair > 0.995


def test_the_command_says_the_table_and_keeps_other_files(folder: Path, run: CorrelationRun, tmp_path: Path) -> None:
    (tmp_path / "mine.txt").write_text("kept")
    done = CliRunner().invoke(main, ["correlate", str(folder), "--out", str(tmp_path)])
    assert done.exit_code == 0, done.output
    assert "tip (fit, as modelled): 3 of 3 modes identified from FRFs are paired" in done.output
    assert "−4.15 %" in done.output
    assert "identify modes:" in done.stderr
    assert (tmp_path / "mine.txt").read_text() == "kept"
    assert CliRunner().invoke(main, ["correlate", str(folder), "-o", str(tmp_path), "-q"]).output == ""


def test_modes_are_read_from_data_sets_55(tmp_path: Path) -> None:
    freq, phi = truth_modes(tmp_path)
    write_modes(tmp_path / "modes.uff", freq, phi, DOFS)
    one = correlate_study(modes_study(tmp_path))["modes"]
    assert one.measured.how == "read from data sets 55"
    # five digits stand in the file
    np.testing.assert_allclose(one.test.freq, freq, rtol=1e-5)
    np.testing.assert_allclose(one.test.zeta, 0.01, rtol=1e-4)
    assert one.n_pairs == 3
    assert one.frfs is None
    assert one.dofs == DOFS


def test_a_mode_identified_twice_is_told_as_that(tmp_path: Path) -> None:
    """A second pole of mode 2, 0.4 % above: neither sensors nor supports are to be looked at, nor places planned."""
    freq, phi = truth_modes(tmp_path)
    twice = phi[:, 1] + 0.01 * np.abs(phi[:, 1]).max() * np.random.default_rng(4).standard_normal(len(DOFS))
    path = modes_study(tmp_path)
    write_modes(
        tmp_path / "modes.uff",
        np.insert(freq, 2, 1.004 * freq[1]),
        np.insert(phi, 2, twice, axis=1),
        DOFS,
    )
    result = correlate_study(path, tmp_path / "out").result
    assert result["recordings"][0]["summary"]["paired"] == len(freq)
    told = [w for w in result["warnings"] if "one mode identified twice?" in w]
    assert len(told) == 1
    assert re.search(r"mode [23] at [\d.]+ Hz has the shape of mode [23] at [\d.]+ Hz \(MAC 1.00\)", told[0])
    assert result["advice"] == ""


def test_frfs_beside_modes_are_compared_too(tmp_path: Path) -> None:
    freq, phi = truth_modes(tmp_path)
    write_modes(tmp_path / "modes.uff", freq, phi, DOFS)
    write_uff(tmp_path / "frf.uff", functions_of(measured_frf(tmp_path, Recorded("tip"))))
    text = (tmp_path / "modes.uff").read_bytes()
    (tmp_path / "modes.uff").write_bytes(text + (tmp_path / "frf.uff").read_bytes())
    one = correlate_study(modes_study(tmp_path, "[correlation]\nband = [10.0, 400.0]\n"))["modes"]
    assert one.measured.how == "read from data sets 55"
    assert one.n_test == 3
    assert one.frfs is not None
    assert one.frfs.matched.freq[0] == 10.0
    assert float(np.nanmean(one.frfs.csac)) > 0.98
    said = CliRunner().invoke(main, ["inspect", str(tmp_path / "modes.uff")]).output
    assert "3 mode shapes" in said
    assert "FRFs (accelerance" in said


def test_a_reversed_sensor_is_named(tmp_path: Path) -> None:
    freq, phi = truth_modes(tmp_path)
    phi[2] *= -1
    write_modes(tmp_path / "modes.uff", freq, phi, DOFS)
    run = correlate_study(modes_study(tmp_path))
    (fault,) = run["modes"].faults
    assert (fault.kind, fault.names) == ("reversed", ("7:+Z",))
    assert any("7:+Z looks reversed" in w for w in run.result["warnings"])
    assert "mend the sensors" in run.result["advice"]
    # an update, which would make up for it with its parameters, says it too
    updated = update_study(modes_study(tmp_path)).result
    assert any("7:+Z looks reversed" in w for w in updated["warnings"])
    assert updated["advice"].startswith("mend the sensors")
    assert updated["doubtful"]


def test_a_tip_upside_down_among_five_sensors_is_named_and_no_other(tmp_path: Path) -> None:
    """It makes the first shape look like the second: pairs by shape are of other modes, and told nothing."""
    model = model_modes(read_model(modes_study(tmp_path).parent / "model.bdf"), n_modes=8)
    dofs = tuple(Dof(n, 3) for n in (5, 7, 9, 11, 13))
    seen = [k for k in range(8) if np.abs(model.phi[:, k] @ np.array([d.component == 3 for d in model.dofs])) > 1e-6][
        :5
    ]
    phi = model.phi[np.ix_([model.dofs.index(d) for d in dofs], seen)]
    phi[4] *= -1
    write_modes(tmp_path / "modes.uff", 1.04 * model.freq[seen], phi, dofs)
    run = correlate_study(tmp_path / "study.toml")
    assert [(f.kind, f.names) for f in run["modes"].faults] == [("reversed", ("13:+Z",))]


def branched(folder: Path) -> tuple[Path, dict[int, np.ndarray]]:
    """A study of modes of the cantilever with a branch, so that its nodes are not in line; their coordinates."""
    lines = deck().splitlines()
    for card in ("GRID,20,,0.3,0.2,0.", "CONM2,120,20,,0.01", "CBAR,120,1,6,20,0.,0.,1."):
        lines.insert(-2, card)
    (folder / "model.bdf").write_text("\n".join(lines))
    model = read_model(folder / "model.bdf")
    path = folder / "study.toml"
    path.write_text(study_text((Recorded("modes"),), ""))
    return path, {n: model.xyz[model.index(n)] for n in (*SENSORS, 20)}


def write_branched(folder: Path, places: dict[int, tuple[float, float, float]]) -> None:
    """Its own four modes with test nodes at `places`."""
    modes = model_modes(read_model(folder / "model.bdf"), n_modes=4)
    dofs = (*DOFS, Dof(20, 3))
    phi = modes.phi[[modes.dofs.index(d) for d in dofs]]
    write_modes(folder / "modes.uff", modes.freq, phi, dofs, places=places)


def test_a_turned_geometry_in_millimetres_is_brought_onto_the_model(tmp_path: Path) -> None:
    path, where = branched(tmp_path)
    # the test's X is the model's Y, its Y the model's -X, and it is in mm
    write_branched(tmp_path, {n: (1e3 * x[1], -1e3 * x[0], 1e3 * x[2]) for n, x in where.items()})
    run = correlate_study(path)
    assert run.prepared.placed.applied
    told = " ".join(run.result["warnings"])
    assert "scale 0.001: its coordinates are in mm but were read as m, as the file states no unit" in told
    assert "test Y is model -X" in told
    assert "applied to the sensors' places and directions" in told
    assert run["modes"].n_pairs == 4
    assert min(r.mac for r in run["modes"].comparison.table.rows) > 0.9999
    # an update tells it too, and that it was applied
    updated = update_study(path).result
    assert updated["sensors"]["alignment"]["applied"]
    assert "test Y is model -X" in " ".join(updated["warnings"])
    assert "applied to the sensors' places and directions" in " ".join(updated["warnings"])
    text = path.read_text()
    path.write_text(text + "[correlation]\nalign = false\n")
    left = correlate_study(path).prepared.placed
    assert not left.applied
    assert any("scale 0.001" in w for w in left.warnings)


def test_points_in_each_others_place_are_named(tmp_path: Path) -> None:
    path, where = branched(tmp_path)
    places = {n: tuple(x) for n, x in where.items()}
    places[5], places[11] = places[11], places[5]
    write_branched(tmp_path, places)
    run = correlate_study(path)
    assert "test geometry: test nodes 5 and 11 are exchanged" in run.result["warnings"]
    # each sensor is taken to be where its coordinates are
    assert (
        "sensor 5:+Z is paired with node 11 at its place, since node 5 of the model lies 0.36 away"
        in run.result["warnings"]
    )
    assert {p.dof.node for p in run.prepared.placed.pairing} == {*SENSORS, 20}


def test_a_point_that_is_off_is_named(tmp_path: Path) -> None:
    path, where = branched(tmp_path)
    write_branched(tmp_path, {n: (x[0], 0.1 if n == 9 else x[1], x[2]) for n, x in where.items()})
    run = correlate_study(path)
    (told,) = (w for w in run.result["warnings"] if "node 9" in w)
    assert told.startswith(
        "sensors are paired with the model's nodes of their numbers though the test's coordinates lie"
    )
    assert "node 9 by 0.1 (the tolerance is" in told
    assert "check the units and the frame of the test geometry, and these node numbers" in told
    assert not run.prepared.placed.applied
    assert run["modes"].n_pairs == 4


def test_a_symmetric_geometry_is_told_only_where_a_turn_is_to_be_decided() -> None:
    xyz = np.array([(x, y, 0.0) for x in (0.0, 1.0, 2.0) for y in (0.0, 1.0, 2.0)])
    model = SimpleNamespace(
        is_scalar=np.zeros(9, dtype=bool), node_ids=np.arange(1, 10), xyz=xyz, fe=SimpleNamespace(elements=list)
    )
    dofs = tuple(Dof(900 + n, 3) for n in range(9))

    def placed(at: np.ndarray) -> Placed:
        measured = SimpleNamespace(name="modes", dofs=dofs, geometry=Geometry(900 + np.arange(9), at))
        return placed_sensors([measured], model)

    assert not any("turns" in text for text in placed(xyz).warnings)
    moved = placed(xyz + np.array([0.0, 0.0, 5.0]))
    assert moved.applied
    assert [p.dof.node for p in moved.pairing] == list(range(1, 10))
    assert any("turns or shifts fit as well" in text and "was taken" in text for text in moved.warnings)


def test_what_a_diagnosis_says_of_a_file_of_modes(tmp_path: Path) -> None:
    freq, phi = truth_modes(tmp_path)
    write_modes(tmp_path / "modes.uff", freq, phi, DOFS)
    from femend import diagnose_study

    with pytest.raises(FormatError, match=r"holds 3 mode shapes \(data set 55\) and no time records.*femend correlate"):
        diagnose_study(modes_study(tmp_path))


@pytest.mark.parametrize(("run", "use"), [(correlate_study, "a correlation"), (update_study, "an update")])
def test_a_study_without_recordings_to_fit_says_what_needs_them(
    tmp_path: Path, run: Callable[[Path], object], use: str
) -> None:
    with pytest.raises(StudyError, match=rf"recording: there is no \[\[recording\]\]; {use} needs at least one with"):
        run(write_study(tmp_path, ()))
    held = write_study(tmp_path, (Recorded("middle", "validate", 9),))
    with pytest.raises(StudyError, match=rf"no \[\[recording\]\] has role = \"fit\"; {use} needs at least one"):
        run(held)


def test_a_diagnosis_takes_a_study_with_the_tables_and_refuses_unknown_keys(tmp_path: Path) -> None:
    from femend import load_study

    path = write_study(tmp_path, tables="[correlation]\nband = [5.0, 400.0]\n[updating]\nfreq_sd = 0.01\n[pretest]\n")
    assert load_study(path).updating.freq_sd == 0.01
    path.write_text(path.read_text().replace("freq_sd", "frequency_sd"))
    with pytest.raises(StudyError, match=r"updating\.frequency_sd: .* no key of \[updating\]; did you mean 'freq_sd'"):
        load_study(path)


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ("[correlation]\nband = [400.0, 5.0]", r"correlation\.band: \[400\.0, 5\.0\] is not \[lower, upper\] in Hz"),
        ("[correlation]\nmac_min = 1.5", r"correlation\.mac_min: 1\.5 is not from 0 to below 1"),
        ("[updating]\nresponses = []", r"updating\.responses: the list is empty; compare one of frequencies, shapes"),
        ('[updating]\nresponses = ["shape"]', r"updating\.responses: 'shape' is none of .*did you mean 'shapes'"),
        ('[updating]\nresponses = ["mac", "mac"]', r"updating\.responses: 'mac' stands twice"),
        ("[updating]\nfreq_sd = 0.0", r"updating\.freq_sd: 0 is not above 0"),
        ("[updating]\nfreq_sd = 3", r"updating\.freq_sd: 3 is 300 %, of which nothing can be told; it is a share"),
        ("[updating]\niterations = 0", r"updating\.iterations: 0 is less than one"),
        ("[updating]\nmodes = [0]", r"updating\.modes: \[0\] are not numbers of modes"),
        ("[pretest]\nband = [1.0, 2.0]\nmodes = [1]", r"pretest\.modes: are given beside a band"),
        ('[pretest]\nmethod = "kammer"', r"pretest\.method: 'kammer' is none of parameters, effective independence"),
        ('[pretest]\ndirections = ["RX"]', r"pretest\.directions: 'RX' is a rotation"),
        ('[pretest]\nplaced = ["13"]', r"pretest\.placed\[0\]: DOF '13' is not written as node:direction"),
        ("[pretest]\nnodes = []", r"pretest\.nodes: the list is empty"),
        ("[pretest]\nnoise = -1.0", r"pretest\.noise: -1 is below 0"),
        ('[pretest]\nconfiguration = "free"', r"pretest\.configuration: 'free' is none of as modelled"),
    ],
)
def test_broken_tables_are_named(folder: Path, run: CorrelationRun, table: str, message: str) -> None:
    path = folder / "broken.toml"
    path.write_text(study_text((Recorded("tip"),), table + "\n"))
    with pytest.raises(StudyError, match=message):
        correlate_study(path)


def test_nothing_is_written_where_no_recording_shows_a_mode(folder: Path, run: CorrelationRun, tmp_path: Path) -> None:
    path = folder / "empty.toml"
    path.write_text(study_text((Recorded("tip"),), "[correlation]\nband = [30.0, 60.0]\n"))
    with pytest.raises(
        RecordingError, match=r"no recording to fit shows a mode: recording 'tip': .*no mode was found from 30 to 60 Hz"
    ):
        correlate_study(path, tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_a_sensor_that_is_nowhere(tmp_path: Path) -> None:
    freq, phi = truth_modes(tmp_path)
    write_modes(tmp_path / "modes.uff", freq, phi, (*DOFS[:5], Dof(99, 3)))
    with pytest.raises(PairingError, match="sensor 99:\\+Z: node 99 is not among the 13 nodes of the model"):
        correlate_study(modes_study(tmp_path))


def test_a_damaged_recording_says_which_study_wanted_it(tmp_path: Path) -> None:
    path = write_study(tmp_path, (Recorded("tip"),))
    data = (tmp_path / "tip.uff").read_bytes()
    (tmp_path / "tip.uff").write_bytes(data[: len(data) * 3 // 5])
    with pytest.raises(FormatError) as caught:
        correlate_study(path)
    assert any("[[recording]] 'tip'" in note for note in caught.value.__notes__)


def test_a_mode_the_model_does_not_have_stays_without_a_mate(tmp_path: Path) -> None:
    freq, phi = truth_modes(tmp_path)
    strange = np.array([1.0, -1.0, 1.0, -1.0, 1.0, -1.0])
    write_modes(tmp_path / "modes.uff", [*freq, 200.0], np.column_stack([phi, strange]), DOFS)
    run = correlate_study(modes_study(tmp_path))
    assert run["modes"].comparison.table.alone_a == ((2, pytest.approx(200.0, rel=1e-5)),)
    assert "1 of 4 measured modes have no mate" in run.result["advice"]


def test_frfs_of_a_free_structure_hold_its_rigid_body_modes(tmp_path: Path) -> None:
    text = deck().replace("SPC1,1,123456,1", "SPC1,1,246,1")
    (tmp_path / "model.bdf").write_text(text)
    from femend import Channel
    from femend.analysis.frf import modal_frf

    modes = model_modes(read_model(tmp_path / "model.bdf"), f_max=2500.0, zeta=0.01)
    assert modes.freq[2] < 1e-2 < modes.freq[3]
    outputs = [Channel(d, "acceleration", "m/s^2") for d in DOFS]
    frf = modal_frf(modes, np.arange(20.0, 400.0, 0.25), outputs, [Channel(Dof(13, 3), "force", "N")])
    rng = np.random.default_rng(1)
    H = frf.H * (1 + 1e-3 * rng.standard_normal(frf.H.shape))
    write_uff(
        tmp_path / "tip.uff",
        functions_of(FRF("tip", frf.freq, H, frf.outputs, frf.inputs, frf.kind, frf.unit)),
    )
    (tmp_path / "study.toml").write_text(study_text((Recorded("tip"),), ""))
    one = correlate_study(tmp_path)["tip"]
    assert one.frfs is not None
    assert float(np.nanmean(one.frfs.csac)) > 0.999
    assert one.modes.freq[0] > 10.0


def test_measured_frfs_of_the_helper_are_those_of_the_truth(tmp_path: Path) -> None:
    frf = measured_frf(tmp_path, Recorded("x"), noise=0.0)
    freq, _ = truth_modes(tmp_path)
    peak = frf.freq[np.argmax(np.abs(frf.H[(frf.freq > 50) & (frf.freq < 150), 0, 0])) + int((frf.freq <= 50).sum())]
    assert abs(peak - freq[1]) < 0.25


def test_a_pair_at_another_frequency_accuses_no_sensor() -> None:
    """Of a mode that the model has not the likest one at three times its frequency made two sensors look exchanged."""
    x = np.array(
        [[1.0, 0.0, 0.3], [0.5, 0.0, 1.0], [0.0, 0.7, 0.0], [0.0, 1.0, 0.0], [0.2, 0.1, 0.4], [0.4, 0.2, -0.3]]
    )
    phi = np.column_stack([x, [0.9, -0.1, 0.0, 0.0, 0.1, 0.0]])
    test_phi = phi.copy()
    test_phi[[0, 1], 3] = test_phi[[1, 0], 3]
    test_phi[[0, 1], :3] = [[0.75, 0.0, 0.65], [0.75, 0.0, 0.65]]
    phi[[0, 1], :3] = test_phi[[0, 1], :3]
    pairs = [SimpleNamespace(a=i, b=i) for i in range(4)]
    match = SimpleNamespace(dofs=tuple(Dof(n, 3) for n in range(1, 7)))
    comparison: Any = SimpleNamespace(pairing=SimpleNamespace(pairs=pairs), phi_a=test_phi, phi_b=phi, match=match)
    modes: Any = SimpleNamespace(freq=np.array([10.0, 20.0, 30.0, 120.0]))
    for freq, named in ((118.0, [("1:+Z", "2:+Z")]), (40.0, [])):
        measured: Any = SimpleNamespace(freq=np.array([10.0, 20.0, 30.0, freq]))
        assert [f.names for f in _faults(comparison, measured, modes)] == named


@pytest.mark.parametrize(
    ("zeta", "responses", "said"),
    [
        (0.5, '["frequencies", "shapes"]', "in per cent it would be 0.005: divide them by 100"),
        (0.0, '["frequencies", "damping"]', 'leave "damping" out of responses'),
        (0.0, '["frequencies", "shapes"]', None),
        (0.01, '["frequencies", "damping"]', None),
    ],
)
def test_damping_ratios_in_per_cent_or_left_out_are_told(
    tmp_path: Path, zeta: float, responses: str, said: str | None
) -> None:
    freq, phi = truth_modes(tmp_path)
    write_modes(tmp_path / "modes.uff", freq, phi, DOFS, zeta)
    warnings = correlate_study(modes_study(tmp_path, f"[updating]\nresponses = {responses}\n")).result["warnings"]
    told = [w for w in warnings if "damping ratio" in w]
    assert [said in w for w in told if said] == [True] * bool(said)
    assert bool(told) is (said is not None)


def test_shapes_of_a_file_that_are_complex_are_told(tmp_path: Path) -> None:
    freq, phi = truth_modes(tmp_path)
    shapes = phi.astype(complex)
    shapes[:, 1] *= np.exp(1j * np.linspace(0.0, 2.0, len(DOFS)))
    write_modes(tmp_path / "modes.uff", freq, shapes, DOFS)
    (told,) = (w for w in correlate_study(modes_study(tmp_path)).result["warnings"] if "complex" in w)
    assert told.startswith(f"recording 'modes': the shape at {freq[1]:.4g}")
    write_modes(tmp_path / "modes.uff", freq, phi, DOFS)
    assert not any("complex" in w for w in correlate_study(modes_study(tmp_path)).result["warnings"])


def test_mass_and_centre_of_gravity_are_told(tmp_path: Path) -> None:
    """Those of the whole deck, what it holds too, with the mass that the configuration adds."""
    recorded = (Recorded("tip", mass=(7, 0.2)),)
    run = correlate_study(write_study(tmp_path, recorded), tmp_path / "out")
    told = run.result["model"]
    # two halves of 0.36 m, the lump at node 9 and what is added at node 7
    masses = np.array([2700 * 3.3e-4 * 0.36, 2700 * 2.85e-4 * 0.36, 0.1, 0.2])
    assert told["mass"] == pytest.approx(masses.sum())
    assert told["centre"] == pytest.approx([masses @ [0.18, 0.54, 0.48, 0.36] / masses.sum(), 0.0, 0.0])
    assert "its centre of gravity is at (" in (tmp_path / "out" / "correlation.html").read_text()
