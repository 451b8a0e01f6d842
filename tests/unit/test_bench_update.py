"""`femend update`: a study's parameters from its modes and FRFs, held-out recordings kept out, the deck patched."""

from __future__ import annotations

import copy
import json
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from femend import Dof, functions_of, model_modes, read_model, update_study, write_uff
from femend.bench import UpdateRun
from femend.cli import main
from femend.errors import StudyError, UpdatingError
from femend.estimate.updating import (
    DampingRatios,
    UpdateResult,
    affine_matrices,
    factor,
    modal_system,
    scatter_of,
    update,
)

sys.path.insert(0, str(Path(__file__).parents[1]))
from bench_study import (
    RECORDINGS,
    SENSORS,
    TABLES,
    TRUE_E,
    Recorded,
    measured_frf,
    study_text,
    write_modes,
    write_study,
)
from small_study import deck

# factors of the deck's 70 GPa
TRUTH = {"E_root": TRUE_E[0] / 7e10, "E_tip": TRUE_E[1] / 7e10}
DOFS = tuple(Dof(n, 3) for n in SENSORS)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("bench")


@pytest.fixture(scope="module")
def run(folder: Path) -> UpdateRun:
    return update_study(write_study(folder), folder / "out")


def within(run: UpdateRun, sds: float = 3.0) -> bool:
    """Are the true factors inside so many deviations of what was found?"""
    return all(abs(run.factors[n] - t) < sds * run.found.sd[n] for n, t in TRUTH.items())


def test_the_true_parameters_are_found_within_their_deviations(run: UpdateRun) -> None:
    assert run.found.status == "converged"
    assert within(run)
    # frequencies are known to 0.1 % (the floor), each by itself says 0.2 % of a modulus
    assert max(run.found.sd.values()) < 0.005
    np.testing.assert_allclose([run.factors[n] for n in TRUTH], list(TRUTH.values()), rtol=2e-3)


def test_what_is_written(run: UpdateRun, folder: Path) -> None:
    out = folder / "out"
    result = json.loads((out / "updating.json").read_text())
    assert result["format"] == "femend-update/1"
    assert (result["status"], result["advice"]) == ("converged", "")
    assert all(p["determined"] for p in result["parameters"].values())
    tip, middle = result["recordings"]
    assert (tip["role"], middle["role"]) == ("fit", "validate")
    for r in (tip, middle):
        assert r["before"]["freq_error"] == pytest.approx(0.0188, abs=2e-4)
        assert r["after"]["freq_error"] < 1e-4
        assert r["after"]["frf_error_db"] < r["before"]["frf_error_db"]
        assert len(r["modes"]) == 3
    assert [c["recordings"] for c in result["counted"]] == [["tip"]]
    assert result["history"][0]["cost"] > result["history"][-1]["cost"]
    page = (out / "updating.html").read_text()
    assert "E_root" in page
    assert "Held out: it had no part" in page
    assert {p.name for p in out.iterdir()} == {
        "updating.json", "updating.html", "updating.run.json", "updating.parameters.csv", "updating.modes.csv",
        "model.updated.bdf", "model.diff",
    }  # fmt: skip


def test_the_deck_is_changed_where_the_values_stand(run: UpdateRun, folder: Path) -> None:
    old, new = ((folder / name).read_text().splitlines() for name in ("model.bdf", "out/model.updated.bdf"))
    changed = [(a, b) for a, b in zip(old, new, strict=True) if a != b]
    assert [a.split(",")[:2] for a, _ in changed] == [["MAT1", "1"], ["MAT1", "2"]]
    for (_, line), name in zip(changed, TRUTH, strict=True):
        assert float(line.split(",")[2]) == pytest.approx(7e10 * run.factors[name], rel=1e-12)
    diff = (folder / "out" / "model.diff").read_text()
    assert diff.count("\n-MAT1") == diff.count("\n+MAT1") == 2
    read_model(folder / "out" / "model.updated.bdf")


def test_held_out_and_predicted_recordings_have_no_part(run: UpdateRun, folder: Path, tmp_path: Path) -> None:
    alone = write_study(tmp_path, RECORDINGS[:1])
    again = update_study(alone)
    assert again.factors == run.factors
    assert again.found.after.cost == run.found.after.cost


def test_the_command_says_it(folder: Path, run: UpdateRun, tmp_path: Path) -> None:
    done = CliRunner().invoke(main, ["update", str(folder / "study.toml"), "--out", str(tmp_path / "out")])
    assert done.exit_code == 0, done.output
    assert "converged after 3 steps" in done.output
    assert "middle (held out, as modelled)" in done.output
    assert "update parameters:" in done.stderr
    quiet = CliRunner().invoke(main, ["update", str(folder), "--out", str(tmp_path / "out"), "--quiet"])
    assert (quiet.exit_code, quiet.output) == (0, "")
    text = CliRunner().invoke(main, ["--help"]).output
    assert "correlate" in text
    assert "update" in text


def test_frfs_mac_damping_and_two_configurations_together(tmp_path: Path) -> None:
    tables = TABLES + '[updating]\nresponses = ["frequencies", "mac", "damping", "frfs"]\nfrf_lines = 60\n'
    path = write_study(tmp_path, (Recorded("tip"), Recorded("more", mass=(7, 0.15))), tables)
    run = update_study(path)
    assert run.found.status == "converged"
    names = [[r.name for r in c.responses] for c in run.problem.configurations]
    assert names == [["frequencies", "MAC", "damping", "FRFs"]] * 2
    np.testing.assert_allclose([run.factors[n] for n in TRUTH], list(TRUTH.values()), rtol=5e-3)
    # modal damping of 1 % is a loss factor of 2 % at resonance
    assert run.result["parameters"]["eta"]["value"] == pytest.approx(0.02, abs=0.004)
    assert {c["configuration"] for c in run.result["counted"]} == {"as modelled", "loaded"}


def test_proportional_damping(tmp_path: Path) -> None:
    tables = TABLES + '[updating]\nresponses = ["frequencies", "damping"]\ndamping_model = "proportional"\n'
    run = update_study(write_study(tmp_path, (Recorded("tip"),), tables))
    values, omega = run.found.values, 2 * np.pi * run.counted[0].freq
    zeta = values["alpha"] / (2 * omega) + values["beta"] * omega / 2
    # two terms cannot have one ratio at three frequencies 15 times apart, and are held by 20 %
    assert 0.005 < zeta.min() < 0.01 < zeta.max() < 0.02
    assert run.result["parameters"]["alpha"]["unit"] == "1/s"


def test_recordings_of_one_configuration_are_solved_for_once(tmp_path: Path) -> None:
    """With other sensors too; each by itself, and both as one problem of separate systems, say the same."""
    (tmp_path / "model.bdf").write_text(deck(TRUE_E))
    modes = model_modes(read_model(tmp_path / "model.bdf"), n_modes=3)
    (tmp_path / "model.bdf").write_text(deck())
    for name, dofs, scale in (("one", DOFS[:5], 1.002), ("two", DOFS[2:], 0.998)):
        phi = modes.phi[[modes.dofs.index(d) for d in dofs]]
        write_modes(tmp_path / f"{name}.uff", scale * modes.freq, phi, dofs)
    path = tmp_path / "study.toml"
    path.write_text(study_text((Recorded("one"), Recorded("two"))))
    run = update_study(path)
    first, second = run.problem.configurations
    assert first.system is second.system
    for c, missing in ((first, [5]), (second, [0, 1])):
        assert c.test is not None
        assert c.test.phi is not None
        assert np.flatnonzero(np.isnan(c.test.phi).all(axis=1)).tolist() == missing
    apart = replace(run.problem, configurations=tuple(replace(c, system=copy.copy(c.system)) for c in (first, second)))
    assert apart.configurations[0].system is not apart.configurations[1].system
    alone = update(apart)
    assert list(alone.values.values()) == pytest.approx(list(run.found.values.values()), rel=1e-9)
    assert alone.after.cost == pytest.approx(run.found.after.cost, rel=1e-9)


def test_a_stopped_search_goes_on_from_its_history(folder: Path, run: UpdateRun, tmp_path: Path) -> None:
    path = folder / "short.toml"
    path.write_text(study_text(RECORDINGS, TABLES + "[updating]\niterations = 1\n"))
    kept = tmp_path / "history.json"
    first = update_study(path, history=kept)
    assert first.found.status == "limit"
    assert "allow more iterations" in first.result["advice"]
    done = CliRunner().invoke(
        main, ["update", str(folder / "study.toml"), "-o", str(tmp_path / "out"), "--history", str(kept)]
    )
    assert done.exit_code == 0, done.output
    result = json.loads((tmp_path / "out" / "updating.json").read_text())
    assert result["cost"]["after"] == pytest.approx(run.found.after.cost, rel=1e-6)
    assert result["history"][0]["cost"] == pytest.approx(run.found.before.cost)
    path.write_text(study_text(RECORDINGS, TABLES + "[updating]\nshape_sd = 0.2\n"))
    with pytest.raises(
        UpdatingError,
        match=r"shapes of tip: sd was 18 values from 0\.0500\d to 0.0\d+, is 18 values from 0.2 to 0.20\d+\): put",
    ):
        update_study(path, history=kept)


def test_a_history_is_kept_in_the_folder_of_the_results_before_that_is_there(folder: Path, tmp_path: Path) -> None:
    path, out = folder / "short.toml", tmp_path / "deep" / "out"
    path.write_text(study_text(RECORDINGS, TABLES + "[updating]\niterations = 1\n"))
    update_study(path, out, history=out / "history.json")
    assert {"history.json", "updating.json"} <= {f.name for f in out.iterdir()}


def test_a_history_that_cannot_be_written_is_refused_before_the_work(tmp_path: Path) -> None:
    file = tmp_path / "file"
    file.write_text("")
    # no study is there to be read: the history is looked at first
    with pytest.raises(OSError, match=r"history.json cannot be written: .*file does not take new files"):
        update_study(tmp_path / "study.toml", history=file / "history.json")
    with pytest.raises(IsADirectoryError, match="is a folder; give the name of a file in it"):
        update_study(tmp_path / "study.toml", history=tmp_path)


def test_chosen_modes_alone_count(folder: Path, run: UpdateRun, tmp_path: Path) -> None:
    path = folder / "chosen.toml"
    path.write_text(study_text(RECORDINGS, TABLES + "[updating]\nmodes = [1, 3]\n"))
    assert update_study(path).counted[0].numbers == (1, 3)
    path.write_text(study_text(RECORDINGS, TABLES + "[updating]\nmodes = [1, 9]\n"))
    with pytest.raises(StudyError, match=r"updating\.modes: mode 9 is wanted and recording 'tip' shows 3 \(up to 261"):
        update_study(path)


def test_repeated_tests_are_weighed_by_their_scatter(tmp_path: Path) -> None:
    (tmp_path / "model.bdf").write_text(deck(TRUE_E))
    modes = model_modes(read_model(tmp_path / "model.bdf"), n_modes=3)
    phi = modes.phi[[modes.dofs.index(d) for d in DOFS]]
    (tmp_path / "model.bdf").write_text(deck())
    rng = np.random.default_rng(4)
    tests = tuple(Recorded(f"test{i}") for i in range(4))
    freq = np.array([modes.freq * (1 + 0.01 * rng.standard_normal(3) * [1, 0.2, 0.2]) for _ in tests])
    for t, f, sign in zip(tests, freq, (1, -1, 1, -1), strict=True):
        write_modes(tmp_path / f"{t.name}.uff", f, sign * phi, DOFS)
    path = tmp_path / "study.toml"
    path.write_text(study_text(tests, "[updating]\nrepeated = true\nfreq_sd = 1e-6\n"))
    run = update_study(path)
    (counted,) = run.counted
    assert counted.sources == ("test0", "test1", "test2", "test3")
    np.testing.assert_allclose(counted.freq, freq.mean(axis=0), rtol=1e-5)
    np.testing.assert_allclose(counted.freq_sd, freq.std(axis=0, ddof=1) / 2, rtol=1e-3)
    assert within(run)
    path.write_text(study_text(tests[:1], "[updating]\nrepeated = true\n"))
    with pytest.raises(UpdatingError, match="repeated = true, but none of the 1 recordings to fit repeats another"):
        update_study(path)


def test_what_cannot_be_posed(folder: Path, run: UpdateRun, tmp_path: Path) -> None:
    path = folder / "none.toml"
    text = study_text(RECORDINGS, TABLES)
    start, end = text.index("[[parameter]]"), text.index("[[recording]]")
    path.write_text(text[:start] + text[end:])
    with pytest.raises(StudyError, match=r"there is no \[\[parameter\]\]; an update needs at least one"):
        update_study(path, tmp_path / "out")
    (tmp_path / "model.bdf").write_text(deck())
    shape = np.array([[1.0], [-1.0], [1.0], [-1.0], [1.0], [-1.0]])
    write_modes(tmp_path / "tip.uff", np.array([50.0]), shape, DOFS)
    own = tmp_path / "study.toml"
    own.write_text(study_text(RECORDINGS[:1], ""))
    with pytest.raises(
        UpdatingError, match=r"no measured mode counts: recording 'tip': mode 1 at 50 Hz .* no mate of MAC 0\.5"
    ):
        update_study(own, tmp_path / "out")
    own.write_text(study_text(RECORDINGS[:1], "[updating]\nmodes = [1]\n"))
    with pytest.raises(UpdatingError, match=r"no measured mode has a mate in the model: tip: best MAC 0\.\d+ \(asked"):
        update_study(own, tmp_path / "out")
    own.write_text(study_text(RECORDINGS[:1], '[updating]\nresponses = ["frfs"]\n'))
    with pytest.raises(UpdatingError, match="responses has 'frfs', and no recording to fit holds FRFs"):
        update_study(own, tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_a_refused_update_says_what_of_the_test_looks_mistaken(tmp_path: Path) -> None:
    """Frequencies four times the model's at its shapes: none counts, and that is why."""
    (tmp_path / "model.bdf").write_text(deck())
    own = tmp_path / "study.toml"
    own.write_text(study_text(RECORDINGS[:1], ""))
    modes = model_modes(read_model(tmp_path / "model.bdf"), n_modes=5)
    phi = modes.phi[[modes.dofs.index(d) for d in DOFS]]
    write_modes(tmp_path / "tip.uff", modes.freq * 4, phi, DOFS)
    with pytest.raises(UpdatingError) as refused:
        update_study(own)
    said = str(refused.value)
    assert "check units, modulus, density and thickness of the deck" in said.partition("does not count")[0]
    # three modes say why they do not count, and not all of them
    assert said.count("does not count") == 3
    assert said.endswith("and 2 more")


def test_modes_without_a_near_mate_do_not_count_and_are_told(tmp_path: Path) -> None:
    """A second pole of a resonance, and a mode the model lacks, must not pull the parameters."""
    (tmp_path / "model.bdf").write_text(deck(TRUE_E))
    modes = model_modes(read_model(tmp_path / "model.bdf"), n_modes=3)
    phi = modes.phi[[modes.dofs.index(d) for d in DOFS]]
    (tmp_path / "model.bdf").write_text(deck())
    freq = [*modes.freq, 99.5, 180.0]
    twice = phi[:, 1] + 0.02 * np.abs(phi).max() * np.array([1, -1, 1, 1, -1, 1])
    other = np.array([1.0, -1.0, 1.0, -1.0, 1.0, -1.0])
    write_modes(tmp_path / "tip.uff", np.array(freq), np.column_stack([phi, twice, other]), DOFS)
    path = tmp_path / "study.toml"
    path.write_text(study_text(RECORDINGS[:1], ""))
    run = update_study(path)
    assert run.counted[0].numbers == (1, 2, 5)
    assert within(run)
    told = [w for w in run.result["warnings"] if "does not count" in w]
    assert len(told) == 2
    assert "mode 3 at 99.5 Hz does not count: it looks like the model's mode 2 (MAC 1.00)" in told[0]
    assert "whose mate is mode 2; a second pole of one resonance?" in told[0]
    assert "mode 4 at 180 Hz does not count: it has no mate of MAC 0.5" in told[1]
    assert run.result["fit"]["freq_error"]["after"] < 1e-4
    path.write_text(study_text(RECORDINGS[:1], "[updating]\nfreq_far = 0.02\n"))
    run = update_study(path)
    assert run.counted[0].numbers == (2, 5)
    assert any("its mate is at 16.78 Hz, -4 % off ([updating] freq_far is 2 %)" in w for w in run.result["warnings"])


def test_frfs_alone(tmp_path: Path) -> None:
    tables = TABLES + '[updating]\nresponses = ["frfs"]\nfrf_lines = 200\nfrf_sd = 0.1\n'
    run = update_study(write_study(tmp_path, (Recorded("tip"),), tables))
    np.testing.assert_allclose([run.factors[n] for n in TRUTH], list(TRUTH.values()), rtol=5e-3)


def test_frfs_of_noise_alone_take_no_part(tmp_path: Path) -> None:
    """A sensor beside the clamp shows noise where the model hardly moves; its lines would soften the root."""
    path = write_study(tmp_path, RECORDINGS[:1], TABLES + '[updating]\nresponses = ["frfs"]\n')
    seen = measured_frf(tmp_path, RECORDINGS[0], 0.2, sensors=(2, 13), even=True)
    write_uff(tmp_path / "tip.uff", functions_of(seen))
    run = update_study(path, tmp_path / "out")
    assert run.result["status"] == "converged"
    assert within(run, 1.5)


def test_a_parameter_nothing_sees_and_two_alike_are_said(tmp_path: Path) -> None:
    path = write_study(tmp_path, (Recorded("tip"),))
    (tmp_path / "model.bdf").write_text(deck(more=("CONM2,101,5,,1.-6",)))
    more = '[[parameter]]\nname = "speck"\nproperty = "m"\nmass = 101\n'
    more += '[[parameter]]\nname = "I_root"\nproperty = "I1"\nproperty_id = 1\n'
    path.write_text(path.read_text().replace("[[recording]]", more + "[[recording]]", 1))
    run = update_study(path)
    assert run.result["hardly_seen"] == ["speck"]
    assert "the data hardly see speck" in run.result["advice"]
    assert not run.result["parameters"]["speck"]["determined"]
    (group,) = run.result["not_told_apart"]
    assert set(group["parameters"]) == {"E_root", "I_root"}
    assert "the data tell only combinations of E_root and I_root" in run.result["advice"]
    # together they are told, each by itself half of it stays open
    assert run.factors["E_root"] * run.factors["I_root"] == pytest.approx(TRUTH["E_root"], rel=2e-3)
    assert run.found.sd["E_root"] == pytest.approx(0.1 / np.sqrt(2), rel=0.1)


@pytest.mark.parametrize("own", [True, False])
def test_damping_ratios_and_their_derivatives(tmp_path: Path, own: bool) -> None:
    """Against the complex eigenvalues of the damped chain, and differences of themselves."""
    rng = np.random.default_rng(0)
    K = np.diag([2.0, 2.0, 1.0]) - np.diag([1.0, 1.0], 1) - np.diag([1.0, 1.0], -1)
    M = np.diag(1 + rng.random(3))
    parts = {"a": 1e3 * np.diag([1.0, 0, 0]), "b": 1e3 * (K - np.diag([1.0, 0, 0]))}
    system = modal_system(affine_matrices(parts, M), [0, 1, 2], 3, damping=True)
    x = np.array([1.2, 0.9, *((0.3, 2e-4, 0.01) if own else (0.0, 0.0, 0.02))])
    state = system.solve(x)
    omega = 2 * np.pi * state.value("freq")
    np.testing.assert_allclose(state.value("zeta"), x[2] / (2 * omega) + x[3] * omega / 2 + x[4] / 2, rtol=1e-10)
    slope = state.slope("zeta")
    for i in range(5):
        h = 1e-6 * max(abs(x[i]), 1.0)
        e = h * (np.arange(5) == i)
        difference = (system.solve(x + e).value("zeta") - system.solve(x - e).value("zeta")) / (2 * h)
        np.testing.assert_allclose(slope[i], difference, rtol=1e-5, atol=1e-9)


def test_a_dashpot_of_the_deck_is_in_the_damping_ratios(tmp_path: Path) -> None:
    from femend.estimate.updating import deck_system
    from femend.model import Parameter
    from femend.model import read_model as read

    lines = deck().splitlines()
    lines.insert(-2, "PDAMP,50,3.0")
    lines.insert(-2, "CDAMP1,501,50,13,3")
    (tmp_path / "model.bdf").write_text("\n".join(lines))
    parameters = [Parameter("c", "c1", "property_id", (50,)), Parameter("E", "E", "material", (1, 2))]
    model = read(tmp_path / "model.bdf", parameters=parameters)
    system = deck_system(model, DOFS, 3, damping=True)
    x = np.array([1.0, 1.1, 0.0, 0.0, 0.0])
    state = system.solve(x)
    # c phi^2 / (2 omega), the motion of the tip being that of the last sensor
    expected = 3.0 * state.value("phi")[-1] ** 2 / (2 * 2 * np.pi * state.value("freq"))
    np.testing.assert_allclose(state.value("zeta"), expected, rtol=1e-9)
    slope = state.slope("zeta")
    np.testing.assert_allclose(slope[0], expected, rtol=1e-9)
    e = np.array([0, 1e-5, 0, 0, 0])
    difference = (system.solve(x + e).value("zeta") - system.solve(x - e).value("zeta")) / 2e-5
    np.testing.assert_allclose(slope[1], difference, rtol=1e-5)


def test_damping_as_a_response_needs_deviations() -> None:
    with pytest.raises(UpdatingError, match="the deviation of damping is 0"):
        DampingRatios(np.array([0.01]), np.array([0.0]))


def test_scatter_of_tests_pairs_signs_and_leaves_out_what_one_lacks() -> None:
    from femend import ModeSet

    rng = np.random.default_rng(5)
    phi = np.linalg.qr(rng.standard_normal((6, 3)))[0]
    dofs = tuple(Dof(i, 3) for i in range(1, 7))
    noise = 0.01 * rng.standard_normal((5, 6, 3))
    tests = []
    for k in range(5):
        shapes = (phi + noise[k]) * rng.choice([-1, 1], 3) * rng.uniform(0.5, 2.0, 3)
        freq = np.array([10.0, 20.0, 30.0]) * (1 + 0.001 * k)
        keep = [0, 1, 2] if k else [0, 2]
        flip = np.where(np.arange(6) == k, -1.0, 1.0)  # one sensor is mounted the other way round, and says so
        labels = tuple(Dof(d.node, 3, int(f)) for d, f in zip(dofs, flip, strict=True))
        tests.append(ModeSet(freq[keep], np.full(len(keep), 0.01), (shapes * flip[:, None])[:, keep], labels, "max"))
    found = scatter_of(tests)
    assert found.count.tolist() == [5, 4, 5]
    steps = 0.001 * np.std([0, 1, 2, 3, 4], ddof=1)
    np.testing.assert_allclose(found.freq_sd[[0, 2]], steps * np.array([10.0, 30.0]), rtol=1e-12)
    np.testing.assert_allclose(found.of_mean().freq_sd[0], steps * 10.0 / np.sqrt(5), rtol=1e-12)
    # noise of 0.01 on shapes of length 1, relative to the largest component
    size = np.abs(phi).max(axis=0)
    np.testing.assert_allclose(np.sqrt(np.mean((found.phi_sd * size) ** 2, axis=0)), 0.01, rtol=0.4)
    with pytest.raises(UpdatingError, match="takes two tests or more, there is 1"):
        scatter_of(tests[:1])
    short = ModeSet(tests[1].freq, tests[1].zeta, tests[1].phi[:5], tests[1].dofs[:5], "max")
    with pytest.raises(UpdatingError, match="the tests have other sensors"):
        scatter_of([tests[2], short])


def test_the_problem_is_that_of_the_functions(run: UpdateRun) -> None:
    """The study is a way in; the numbers are those of `femend.estimate.updating`."""
    from femend.estimate.updating import update

    again = update(run.problem)
    assert isinstance(again, UpdateResult)
    np.testing.assert_array_equal(again.p, run.found.p)
    assert run.problem.unknowns.items[0] == factor("E_root", 0.1)
