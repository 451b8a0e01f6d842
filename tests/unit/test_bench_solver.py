"""`femend update` with a solver of the user's own from the study: what it finds, keeps and writes, and solvers that are
missing, crash, hang or write garbage."""

from __future__ import annotations

import json
import shutil
import sys
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from femend import Dof, correlate_study, model_modes, update_study
from femend.bench import UpdateRun
from femend.cli import main
from femend.errors import ExternalSolverError, FormatError, StudyError
from femend.io.solver_results import read_solver_modes
from femend.model import Parameter, read_model
from femend.study import load_study

sys.path.insert(0, str(Path(__file__).parents[1]))
from bench_study import write_modes

# two masses in a row on two springs, by hand: K = [[k1 + k2, -k2], [-k2, k2]], M = diag(m, m)
SOLVER = """
import math
k1, k2, m = (float(line.split("=")[1]) for line in open("chain.inp") if "=" in line)
a, d = (k1 + 2 * k2) / m, k1 * k2 / m**2
rows = []
for lam in (a / 2 - math.sqrt(a * a / 4 - d), a / 2 + math.sqrt(a * a / 4 - d)):
    rows.append((math.sqrt(lam) / (2 * math.pi), 1.0, 1.0 + (k1 - m * lam) / k2))
MODE
with open("chain.csv", "w") as file:
    print("freq,2:+Z,3:-Z", file=file)
    for freq, x, y in rows:
        print(f"{freq!r},{x!r},{-y!r}", file=file)
"""
INPUT = "** two masses on two springs\nk1 = {{k1}}\nk2 = {{k2:.12g}}\nm = 2.0\n"
NODES = "BEGIN BULK\nGRID,1,,0.,0.,0.\nGRID,2,,1.,0.,0.\nGRID,3,,2.,0.,0.\nENDDATA\n"
K1, K2, M = 3.0e5, 2.0e5, 2.0
TRUTH = {"k1": 1.10, "k2": 0.85}
STUDY = f"""format = "femend-study/1"
title = "chain"
[model]
file = "nodes.bdf"
[[recording]]
name = "test"
file = "test.uff"
[updating]
shape_sd = 0.02
[solver]
command = "{sys.executable} -S solve.py"
files = ["chain.inp"]
result = "{{stem}}.csv"
parallel = 2
time_limit = 20
[[solver.value]]
name = "k1"
value = {K1}
prior_sd = 0.3
[[solver.value]]
name = "k2"
value = {K2}
prior_sd = 0.3
bounds = [0.5, 2.0]
"""


def chain(folder: Path, mode: str = "", text: str = STUDY) -> Path:
    """The study in `folder`; `mode` is what its solver does before it writes."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "nodes.bdf").write_text(NODES)
    (folder / "chain.inp").write_text(INPUT)
    (folder / "solve.py").write_text(SOLVER.replace("MODE", mode))
    k1, k2 = K1 * TRUTH["k1"], K2 * TRUTH["k2"]
    lam, phi = np.linalg.eigh(np.array([[k1 + k2, -k2], [-k2, k2]]) / M)
    write_modes(folder / "test.uff", np.sqrt(lam) / (2 * np.pi), phi, (Dof(2, 3), Dof(3, 3)))
    (folder / "study.toml").write_text(text)
    return folder / "study.toml"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("solver")


@pytest.fixture(scope="module")
def run(folder: Path) -> UpdateRun:
    return update_study(chain(folder), folder / "out")


def test_values_are_found_by_runs_of_the_solver(run: UpdateRun) -> None:
    assert run.factors == pytest.approx(TRUTH, rel=2e-3)
    (told,) = run.result["recordings"]
    assert told["before"]["freq_error"] > 0.015
    assert told["after"]["freq_error"] < 5e-4
    assert run.result["parameters"]["k1"]["prior_sd"] == 0.3
    assert run.result["warnings"] == []


def test_input_files_are_written_with_the_values_found(run: UpdateRun, folder: Path) -> None:
    out = folder / "out"
    lines = (out / "solver.updated.chain.inp").read_text().splitlines()
    assert float(lines[1].split("=")[1]) == pytest.approx(K1 * run.factors["k1"], rel=1e-9)
    assert lines[0] == "** two masses on two springs"
    assert not (out / "model.updated.bdf").exists()
    assert "-k2 = 200000\n" in (out / "model.diff").read_text()
    solver = json.loads((out / "updating.json").read_text())["solver"]
    assert solver["values"] == {"k1": K1, "k2": K2}
    assert (solver["failed"], solver["folder"]) == (0, "solver_runs")
    assert solver["runs"] > 5
    page = (out / "updating.html").read_text()
    assert f"{solver['runs']} runs, 0 of them without a result" in page
    assert "Factors of the values in the solver&#39;s input files" in page


def test_no_run_is_made_twice(run: UpdateRun, folder: Path) -> None:
    again = update_study(folder)
    assert again.result["solver"]["runs"] == 0
    assert again.factors == run.factors
    # another script is another solver
    (folder / "solve.py").write_text((folder / "solve.py").read_text() + "# mended\n")
    assert update_study(folder).result["solver"]["runs"] > 0


@pytest.mark.parametrize(
    ("mode", "reason", "words"),
    [
        ("raise SystemExit('no licence')", "crashed", "ended with code 1.*\n.*no licence"),
        ("open('chain.csv', 'w').write('garbage'); raise SystemExit(0)", "unreadable", "no line of a mode"),
        ("rows[0] = (float('nan'), 1.0, 1.0)", "unreadable", "not a number"),
        ("import time; time.sleep(30)", "time limit", "took longer than 0.5 s .*raise the time limit"),
    ],
)
def test_a_solver_that_fails(tmp_path: Path, mode: str, reason: str, words: str) -> None:
    study = chain(tmp_path, mode, STUDY.replace("time_limit = 20", "time_limit = 0.5"))
    with pytest.raises(ExternalSolverError, match=words) as told:
        update_study(study, tmp_path / "out")
    assert told.value.reason == reason
    assert not (tmp_path / "out").exists()
    assert (next((tmp_path / "solver_runs").iterdir()) / "chain.inp").exists(), "the run stays for a look"


def test_a_test_is_compared_with_the_solver(tmp_path: Path) -> None:
    done = correlate_study(chain(tmp_path), tmp_path / "out")
    (told,) = done.result["recordings"]
    assert told["summary"]["paired"] == 2
    assert [m["freq_b"] for m in told["modes"]["rows"]] == pytest.approx([35.589, 87.168], rel=1e-4)
    assert told["where_wrong"] is None
    assert done.result["model"] is None
    assert "solve.py computes." in (tmp_path / "out" / "correlation.html").read_text()


def test_a_missing_solver_is_told_on_the_terminal(tmp_path: Path) -> None:
    study = chain(tmp_path, "", STUDY.replace(sys.executable, "no-such-solver"))
    done = CliRunner().invoke(main, ["update", str(study), "--out", str(tmp_path / "out"), "-q"])
    assert done.exit_code == 2
    assert "there is no program 'no-such-solver' on this machine; install it or give its path" in done.output


def test_a_mode_that_it_does_not_give_is_left_out(tmp_path: Path) -> None:
    run = update_study(chain(tmp_path, "rows = rows[:1]"))
    assert run.result["modes"] == {"measured": 2, "counted": 1}
    assert run.result["recordings"][0]["modes"][0]["error_after"] == pytest.approx(0.0, abs=1e-3)
    for result in (run.result, correlate_study(tmp_path / "study.toml").result):
        (told,) = [w for w in result["warnings"] if "ask the solver for more modes" in w]
        assert "ends with its mode 1 at 35.59 Hz, below 1 of the measured modes (mode 2 at " in told


def test_parameters_of_a_deck_of_nodes_alone_have_no_part_and_that_is_told(tmp_path: Path) -> None:
    """Left over from the study of a deck: "no element uses material 1 (there are none)" was no help."""
    left_over = '[[parameter]]\nname = "E"\nproperty = "E"\nmaterial = 1\n[[recording]]'
    run = update_study(chain(tmp_path, text=STUDY.replace("[[recording]]", left_over)))
    assert run.factors == pytest.approx(TRUTH, rel=2e-3)
    assert (
        "E: a [[parameter]] of the deck has no part beside [solver], which has its own values" in run.result["warnings"]
    )


def test_points_at_which_it_fails_are_gone_round(tmp_path: Path) -> None:
    run = update_study(chain(tmp_path, "if k1 > 3.31e5: raise SystemExit('no convergence')"))
    assert run.factors == pytest.approx(TRUTH, rel=2e-3)
    assert run.result["solver"]["failed"] > 0


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            'files = ["chain.inp"]',
            'files = ["chan.inp"]',
            r"solver\.files\[0\]: .*chan.inp does not exist; did you mean 'chain.inp'",
        ),
        ('"{stem}.csv"', '"{case}.csv"', r"solver\.result: '\{case\}.csv' has something other in braces than \{deck\}"),
        ('"{stem}.csv"', '"chain.out"', r"solver\.format: is missing, and the ending of 'chain.out' does not tell it"),
        ("time_limit = 20", "time_limit = 0", r"solver\.time_limit: 0 is not above 0"),
        ("time_limit = 20", "timelimit = 20", r"'timelimit' is no key of \[solver\]; did you mean 'time_limit'"),
        ('name = "k2"', 'name = "k1"', r"solver\.value\.name: 2 \[\[solver\.value\]\] are named 'k1'"),
        ('name = "k2"', 'name = "k3"', r"'k3' has no field \{\{k3\}\} in chain.inp \(there: \{\{k1\}\}, \{\{k2\}\}\)"),
        ("bounds = [0.5, 2.0]", "bounds = [1.5, 2.0]", r"value 'k2': \[1.5, 2.0\] leaves out the deck's own value"),
        ("value = 200000.0", "value = 0.0", r"value 'k2': 0 has no factor that changes it"),
        ("shape_sd = 0.02", 'responses = ["frfs"]', r"\[solver\] gives frequencies and shapes, not 'frfs'"),
    ],
)
def test_what_cannot_be_meant(folder: Path, run: UpdateRun, old: str, new: str, message: str) -> None:
    assert old in STUDY
    (folder / "broken.toml").write_text(STUDY.replace(old, new))
    with pytest.raises(StudyError, match=message):
        update_study(folder / "broken.toml")


@pytest.mark.skipif(sys.platform == "win32", reason="links need rights there")
def test_an_interpreter_is_called_by_its_own_name(tmp_path: Path) -> None:
    """The interpreter of a virtual environment is a link to one that has none of its packages."""
    study = chain(tmp_path)
    (tmp_path / "env").mkdir()
    link = tmp_path / "env" / "python"
    link.symlink_to(sys.executable)
    study.write_text(STUDY.replace(sys.executable, "env/python"))
    solver = load_study(study).solver
    assert solver is not None
    assert solver.arguments[0] == str(link)
    assert solver.arguments[2] == str(tmp_path / "solve.py")


def test_a_field_without_a_value(tmp_path: Path) -> None:
    study = chain(tmp_path)
    (tmp_path / "chain.inp").write_text(INPUT.replace("2.0", "{{m}}"))
    with pytest.raises(StudyError, match=r"chain.inp has a field \{\{m\}\}, and no \[\[solver.value\]\] is called so"):
        update_study(study)


def test_another_configuration_is_refused(folder: Path, run: UpdateRun) -> None:
    more = '[[recording]]\nname = "more"\nfile = "test.uff"\nconfiguration = "loaded"\n'
    more = f'[[configuration]]\nname = "loaded"\n{more}'
    (folder / "more.toml").write_text(STUDY.replace("[updating]", more + "[updating]"))
    # a diagnosis does not read the table
    assert len(load_study(folder / "more.toml").recordings) == 2
    with pytest.raises(
        StudyError, match="solver: computes one structure, and recording 'more' is of configuration 'loaded'"
    ):
        correlate_study(folder / "more.toml")


def test_results_as_universal_file_and_table(tmp_path: Path) -> None:
    freq, phi = np.array([20.0, 50.0]), np.array([[1.0, 0.5], [-0.4, 1.0]])
    write_modes(tmp_path / "a.unv", freq, phi, (Dof(2, 3), Dof(3, 1)))
    found = read_solver_modes(tmp_path / "a.unv", "universal", (Dof(3, 1, -1), Dof(2, 3)))
    np.testing.assert_allclose(found[0], freq, rtol=1e-5)
    np.testing.assert_allclose(found[1], [-phi[1], phi[0]], rtol=1e-5)
    # the table may be in any order, its columns with a sign
    (tmp_path / "a.csv").write_text("3:-X,freq,2:+Z\n-1.0,50,0.5\n0.4,20,1\n")
    found = read_solver_modes(tmp_path / "a.csv", "table", (Dof(3, 1, -1), Dof(2, 3)))
    np.testing.assert_array_equal(found[0], freq)
    np.testing.assert_array_equal(found[1], [-phi[1], phi[0]])
    with pytest.raises(FormatError, match="no column for sensor 5:"):
        read_solver_modes(tmp_path / "a.csv", "table", (Dof(5, 1),))
    with pytest.raises(FormatError, match="no displacement of 9:.*Y in mode 1"):
        read_solver_modes(tmp_path / "a.unv", "universal", (Dof(9, 2),))


def test_calculix_from_a_study(tmp_path: Path, project_root: Path) -> None:
    """The beam of the example: moduli of two segments that a deck of CalculiX alone has."""
    if shutil.which("ccx") is None:
        pytest.skip("CalculiX (ccx) is not installed")
    sys.path.insert(0, str(project_root / "python" / "examples" / "external_solver"))
    import beam

    places = {n: beam.xyz(place) for place, n in beam.mesh()[0].items()}
    nodes = [f"GRID,{n},,{x:.6f},{y:.6f},{z:.6f}" for n, (x, y, z) in places.items() if n in beam.sensors()]
    (tmp_path / "nodes.bdf").write_text("\n".join(["BEGIN BULK", *nodes, "ENDDATA", ""]))
    (tmp_path / "beam.inp").write_text(beam.calculix(6))
    sys.path.remove(str(project_root / "python" / "examples" / "external_solver"))
    (tmp_path / "beam.bdf").write_text(beam.nastran())
    parameters = [Parameter(f"E{s}", "E", "material", (s,)) for s in (1, 2, 3)]
    truth = {"E1": 0.9, "E2": 1.1, "E3": 1.0}
    modes = model_modes(read_model(tmp_path / "beam.bdf", parameters=parameters), n_modes=4, factors=truth)
    dofs = tuple(Dof(n, c) for n in beam.sensors() for c in (2, 3))
    write_modes(tmp_path / "test.uff", modes.freq, modes.phi[[modes.dofs.index(d) for d in dofs]], dofs)
    text = STUDY[: STUDY.index("[solver]")].replace("shape_sd = 0.02", "shape_sd = 0.01\niterations = 2")
    text += '[solver]\ncommand = "ccx -i {stem}"\nfiles = ["beam.inp"]\nresult = "{stem}.dat"\nparallel = 2\n'
    for name, sd in (("E1", 0.2), ("E2", 0.2), ("E3", 0.2), ("rho", 0.001)):
        text += f'[[solver.value]]\nname = "{name}"\nvalue = {beam.RHO if name == "rho" else beam.E}\nprior_sd = {sd}\n'
    (tmp_path / "study.toml").write_text(text)
    run = update_study(tmp_path)
    assert run.factors == pytest.approx({**truth, "rho": 1.0}, rel=5e-3)
