"""A solver of the user's own: what is right is used, what is missing, crashes, hangs or writes nonsense is told."""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from femend.errors import ExternalSolverError, FormatError, UpdatingError
from femend.estimate.updating import (
    Command,
    Configuration,
    ExternalSystem,
    Problem,
    Unknowns,
    Values,
    factor,
    response_surface,
    update,
)
from femend.io.calculix import read_calculix_modes

# reads E and t, answers by what they are
SOLVER = """
import json, subprocess, sys, time
E, t = (float(line) for line in open("in.txt"))
MODE
json.dump([E * t ** 3, E * t], open("out.json", "w"))
"""
NOMINAL = {"E": 2.0, "t": 3.0}


def read(folder: Path) -> dict[str, np.ndarray]:
    return {"y": np.array(json.loads((folder / "out.json").read_text()))}


def system(folder: Path, mode: str = "", limit: float = 20.0, workers: int = 2) -> ExternalSystem:
    templates = {"in.txt": "{{E}}\n{{t:.12g}}\n", "solve.py": SOLVER.replace("MODE", mode)}
    command = Command((sys.executable, "-S", "solve.py"), templates, read, time_limit=limit)
    return ExternalSystem(command, NOMINAL, folder, workers=workers)


def problem(own: ExternalSystem) -> Problem:
    truth = np.array([2.0 * 1.1 * (3.0 * 0.9) ** 3, 2.0 * 1.1 * 3.0 * 0.9])
    unknowns = Unknowns.of([factor("E", np.inf, (0.5, 1.5)), factor("t", np.inf, (0.5, 1.5))])
    return Problem(unknowns, (Configuration("c", own, (Values("y", truth, 0.01 * truth),)),))


def test_a_solver_is_updated_and_nothing_is_run_twice(tmp_path: Path) -> None:
    own = system(tmp_path / "runs")
    found = update(problem(own), tolerance=1e-4, history=tmp_path / "h.json")
    np.testing.assert_allclose(found.p, [1.1, 0.9], rtol=1e-4)
    again = system(tmp_path / "runs")
    np.testing.assert_array_equal(update(problem(again), tolerance=1e-4).p, found.p)
    assert own.n_runs > 5
    assert again.n_runs == 0


def test_a_missing_solver(tmp_path: Path) -> None:
    command = Command(("no-such-solver",), {"a": "{{E}} {{t}}"}, read)
    with pytest.raises(ExternalSolverError, match="no program 'no-such-solver'") as told:
        update(problem(ExternalSystem(command, NOMINAL, tmp_path)))
    assert told.value.reason == "missing"


@pytest.mark.parametrize(
    ("mode", "reason", "words"),
    [
        ("print('no licence'); sys.exit(7)", "crashed", "ended with code 7.*\n.*no licence"),
        ("print(' *ERROR in e_c3d: nonpositive jacobian')", "crashed", r"wrote '\*ERROR in e_c3d"),
        ("open('out.json', 'w').write('garbage'); sys.exit(0)", "unreadable", "cannot be read"),
        ("json.dump([float('nan'), 1], open('out.json', 'w')); sys.exit(0)", "unreadable", "not a number"),
        ("sys.exit(0)", "unreadable", "cannot be read"),
    ],
)
def test_a_solver_that_fails(tmp_path: Path, mode: str, reason: str, words: str) -> None:
    own = system(tmp_path, mode)
    with pytest.raises(ExternalSolverError, match=words) as told:
        own.solve(np.ones(2))
    assert told.value.reason == reason
    assert told.value.folder is not None
    assert (Path(told.value.folder) / "in.txt").exists(), "the run stays for a look"


def test_a_solver_that_hangs_is_ended_with_its_children(tmp_path: Path) -> None:
    child = tmp_path / "child"
    script = f"import time; time.sleep(4); open({str(child)!r}, 'w')"
    own = system(tmp_path / "runs", f"subprocess.run([sys.executable, '-S', '-c', {script!r}]); time.sleep(60)", 1.0)
    begin = time.perf_counter()
    with pytest.raises(ExternalSolverError, match="longer than 1 s") as told:
        own.solve(np.ones(2))
    assert told.value.reason == "time limit"
    assert time.perf_counter() - begin < 3.5
    time.sleep(max(0.0, 4.8 - (time.perf_counter() - begin)))
    assert not child.exists(), "a child went on after the solver was ended"


def test_one_failure_leaves_the_others_alone(tmp_path: Path) -> None:
    own = system(tmp_path, "if E > 2.5: sys.exit(3)")
    points = [np.array([1.0, 1.0]), np.array([1.4, 1.0]), np.array([0.9, 1.1])]
    good, bad, fine = own.solve_many(points)
    assert isinstance(bad, ExternalSolverError)
    assert not isinstance(good, ExternalSolverError)
    assert not isinstance(fine, ExternalSolverError)
    np.testing.assert_allclose(fine["y"], [1.8 * 3.3**3, 1.8 * 3.3])


def test_a_point_that_is_asked_for_twice_at_once_is_run_once(tmp_path: Path) -> None:
    """Both would work in one folder, which the first to end clears."""
    own = system(tmp_path, "time.sleep(0.3)", workers=3)
    found = own.solve_many([np.ones(2)] * 3)
    assert own.n_runs == 1
    for one in found:
        assert not isinstance(one, ExternalSolverError)
        np.testing.assert_allclose(one["y"], [2.0 * 3.0**3, 6.0])


def test_what_a_failed_run_left_is_not_read_as_the_next_one_s(tmp_path: Path) -> None:
    """The second run ends without an error and writes nothing, as solvers without a licence do."""
    second = tmp_path / "second"
    mode = f"import os\nif os.path.exists({str(second)!r}): sys.exit(0)\n"
    mode += "json.dump([1.0, 1.0], open('out.json', 'w')); sys.exit(7)"
    own = system(tmp_path / "runs", mode)
    for reason in ("crashed", "unreadable"):
        with pytest.raises(ExternalSolverError) as told:
            own.solve(np.ones(2))
        assert told.value.reason == reason
        second.touch()


def test_a_failure_on_one_side_leaves_a_derivative(tmp_path: Path) -> None:
    own = system(tmp_path, "if E > 2.0: sys.exit(3)")
    slopes = own.solve(np.ones(2)).slopes["y"]
    np.testing.assert_allclose(slopes[0], [54.0, 6.0], rtol=1e-6)
    both = system(tmp_path / "both", "if E != 2.0: sys.exit(3)")
    with pytest.raises(ExternalSolverError, match="no derivative by 'E'"):
        both.solve(np.ones(2)).slopes  # noqa: B018


def test_a_surface_tells_of_runs_that_fail(tmp_path: Path) -> None:
    own = system(tmp_path, "if E > 2.6: sys.exit(3)")
    surface = response_surface(problem(own), 16)
    assert 0 < len(surface.failures) < 10
    assert len(surface.points) + len(surface.failures) == 16


def test_templates_and_values_have_to_fit(tmp_path: Path) -> None:
    command = Command(("x",), {"a": "{{E}}"}, read)
    with pytest.raises(UpdatingError, match="'t' of the external solver has no field"):
        ExternalSystem(command, NOMINAL, tmp_path)
    with pytest.raises(UpdatingError, match="has no value"):
        ExternalSystem(command, {}, tmp_path)
    with pytest.raises(UpdatingError, match="time limit"):
        Command(("x",), {"a": ""}, read, time_limit=0)
    with pytest.raises(UpdatingError, match="between 0 and 1"):
        ExternalSystem(command, {"E": 1.0}, tmp_path, step=0.0)


def test_calculix_files_that_are_cut_short(tmp_path: Path) -> None:
    (tmp_path / "a.dat").write_text("\n")
    with pytest.raises(FormatError, match="no table of eigenvalues"):
        read_calculix_modes(tmp_path / "a.dat", [])
    table = "     E I G E N V A L U E   O U T P U T\n\n MODE NO\n\n      1   0.19E+06   0.43E+03   0.69E+02   0.0E+00\n"
    (tmp_path / "a.dat").write_text(table)
    with pytest.raises(FormatError, match="0 blocks of displacements"):
        read_calculix_modes(tmp_path / "a.dat", [])
