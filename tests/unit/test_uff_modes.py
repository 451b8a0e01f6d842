"""Data set 55: mode shapes to a universal file and back, by hand, and what is wrong with one."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from femend import Dof, read_recording, read_uff, write_uff
from femend.cli import main
from femend.data import IdentifiedModes
from femend.errors import FormatError
from femend.io import UniversalFile, read_modes
from femend.io.uff import Mode55, modes_55

sys.path.insert(0, str(Path(__file__).parents[1]))
from bench_study import write_modes

# a real mode of 12.5 Hz with 2 % damping at two nodes, as programs write it; numbers touch each other
REAL = """    -1
    55
Mode 1
NONE
NONE
NONE
NONE
         1         2         2         8         2         3
         2         4         1         1
  1.25000E+01  1.00000E+00  2.00000E-02  0.00000E+00
         7
  0.00000E+00  0.00000E+00  1.00000E+00
        12
  0.00000E+00  0.00000E+00 -5.00000E-01
    -1
"""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "modes.unv"
    path.write_text(REAL)
    return path


def test_a_mode_by_hand(file: Path) -> None:
    found = read_modes(file)
    assert found is not None
    modes, geometry, notes = found
    assert modes.freq.tolist() == pytest.approx([12.5])
    assert modes.zeta.tolist() == pytest.approx([0.02])
    # X and Y are 0 in all modes: not measured
    assert modes.dofs == (Dof(7, 3), Dof(12, 3))
    np.testing.assert_allclose(modes.shapes[:, 0], [1.0, -0.5])
    assert (geometry, notes) == (None, ())


def shapes_along(path: Path, moving: dict[int, str]) -> tuple[str, ...]:
    """Notes on a mode of nodes 1 to 6 that move in the directions (of "XYZ") by node, and in no other."""
    values = np.array([[0.5 * (axis in moving.get(n, "")) for axis in "XYZ"] for n in range(1, 7)])
    one = Mode55(1, complex(-1.0, 40.0), np.arange(1, 7), values)
    write_uff(path, UniversalFile(str(path), modes=(one,)))
    found = read_modes(path)
    assert found is not None
    return found[2]


def test_a_sensor_that_is_0_in_all_modes_is_told(tmp_path: Path) -> None:
    """It may be dead, and a model would be compared without it."""
    path = tmp_path / "modes.unv"
    assert shapes_along(path, dict.fromkeys(range(1, 7), "Z")) == ()
    (said,) = shapes_along(path, dict.fromkeys((1, 2, 3, 4, 6), "Z"))
    assert said.startswith("5:+Z is 0 in all modes and taken as not measured, though other nodes move in that")
    (said,) = shapes_along(path, {**dict.fromkeys(range(1, 6), "XYZ"), 6: "XZ"})
    assert said.startswith("6:+Y is 0 in all modes")
    # a direction that a few have is one that the others were not measured in
    assert shapes_along(path, {**dict.fromkeys(range(1, 6), "Z"), 6: "XYZ"}) == ()
    (said,) = shapes_along(path, {1: "Z", 2: "XZ"})
    assert said.startswith("3:+X, 3:+Z, 4:+X, 4:+Z, 5:+X, 5:+Z and 2 more are 0 in all modes")


def test_hysteretic_damping_and_modes_of_a_free_body(file: Path) -> None:
    rigid = REAL.replace("1.25000E+01", "0.00000E+00").replace("Mode 1", "Mode 0")
    file.write_text(rigid + REAL.replace("  2.00000E-02  0.00000E+00", "  0.00000E+00  3.00000E-02"))
    found = read_modes(file)
    assert found is not None
    assert found[0].zeta.tolist() == pytest.approx([0.015])
    assert found[2] == ("left out: 1 at 0 Hz, of a free body",)


def test_complex_shapes_with_rotations_there_and_back(tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    dofs = tuple(Dof(n, c, s) for n in (3, 5, 900000) for c, s in ((1, 1), (3, -1), (5, 1)))
    omega, zeta = 2 * np.pi * np.array([4.0, 9.0, 31.0]), np.array([0.01, 0.05, 0.002])
    shapes = rng.standard_normal((9, 3)) + 1j * rng.standard_normal((9, 3))
    modes = IdentifiedModes(dofs, -zeta * omega + 1j * omega * np.sqrt(1 - zeta**2), shapes)
    path = tmp_path / "modes.uff"
    write_uff(path, UniversalFile(str(path), modes=tuple(modes_55(modes))))
    found = read_modes(path)
    assert found is not None
    back = found[0]
    # five decimals stand in the file
    np.testing.assert_allclose(back.poles, modes.poles, rtol=2e-5, atol=1e-4)
    assert back.dofs == tuple(d.unsigned for d in dofs)
    np.testing.assert_allclose(back.shapes, shapes * np.array([d.sign for d in dofs])[:, None], rtol=1e-5, atol=1e-5)


def test_real_shapes_there_and_back(tmp_path: Path) -> None:
    mode = Mode55(4, complex(-1.0, 40.0), np.array([1, 2]), np.array([[1.0, 0.0, 2.0], [0.0, -1.0, 0.5]]), "bending")
    write_uff(tmp_path / "m.uff", UniversalFile("m", modes=(mode,)))
    (back,) = read_uff(tmp_path / "m.uff").modes
    assert (back.number, back.title) == (4, "bending")
    assert back.freq == pytest.approx(mode.freq, rel=1e-5)
    np.testing.assert_allclose(back.values, mode.values)


def test_dofs_that_a_mode_lacks_are_left_out(file: Path) -> None:
    second = REAL.replace("1.25000E+01", "2.00000E+01").replace("        12\n", "        13\n")
    file.write_text(REAL + second)
    found = read_modes(file)
    assert found is not None
    assert found[0].dofs == (Dof(7, 3),)
    assert found[2] == ("6 DOFs that not every mode has are left out",)


def test_other_data_at_nodes_is_passed_over(file: Path) -> None:
    # static displacements (analysis type 1), temperatures (one value per node)
    file.write_text(REAL.replace("         1         2         2", "         1         1         2"))
    assert read_modes(file) is None
    assert read_uff(file).unknown == ((55, 1),)
    assert read_modes(Path(__file__)) is None


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("  0.00000E+00  0.00000E+00 -5.00000E-01\n", "", "has 3 lines of data, 2 belong to each node"),
        ("  0.00000E+00  0.00000E+00 -5.00000E-01", "  0.00000E+00 -5.00000E-01", "node 12 has 2 values, 3 were"),
        ("-5.00000E-01", "-5.0000xE-01", "does not hold numbers only"),
        ("        12\n", "       1 x\n", "does not hold whole numbers"),
        ("  1.25000E+01", " -1.25000E+01", r"frequency -12\.5 Hz with damping 0\.02 is no mode"),
        ("  2.00000E-02", "  2.00000E+00", "with damping 2 is no mode"),
    ],
)
def test_damage_is_told_with_file_and_record(file: Path, old: str, new: str, message: str) -> None:
    file.write_text(REAL.replace(old, new))
    with pytest.raises(FormatError, match=r"modes\.unv: data set 1 \(type 55\): .*" + message):
        read_modes(file)


def test_shapes_that_share_nothing(file: Path) -> None:
    file.write_text(
        REAL.replace("1.00000E+00\n        12", "0.00000E+00\n        12").replace("-5.00000E-01", " 0.00000E+00")
    )
    with pytest.raises(FormatError, match="its 1 data sets 55 share no DOF that moves"):
        read_modes(file)
    with pytest.raises(FileNotFoundError, match="there is no file"):
        read_modes(file.with_name("gone.uff"))


def test_pyuff_reads_what_is_written(tmp_path: Path) -> None:
    pyuff = pytest.importorskip("pyuff")
    dofs = (Dof(1, 3), Dof(2, 3))
    write_modes(tmp_path / "m.uff", np.array([5.0, 8.0]), np.array([[1.0, 0.5], [2.0, -1.0]]), dofs)
    first = pyuff.UFF(str(tmp_path / "m.uff")).read_sets(0)
    assert (first["analysis_type"], first["mode_n"]) == (3, 1)
    assert abs(first["eig"]) == pytest.approx(2 * np.pi * 5.0, rel=1e-5)
    np.testing.assert_allclose(first["r3"], [1.0, 2.0])


def test_inspect_lists_modes(tmp_path: Path) -> None:
    places = {1: (0.0, 0.0, 0.0), 2: (1.0, 0.0, 0.0)}
    dofs = (Dof(1, 3), Dof(2, 3))
    write_modes(tmp_path / "m.uff", np.array([5.0, 8.0]), np.array([[1.0, 0.5], [2.0, -1.0]]), dofs, places=places)
    done = CliRunner().invoke(main, ["inspect", str(tmp_path / "m.uff")])
    assert done.exit_code == 0, done.output
    assert "2 mode shapes (data sets 55) at 2 DOFs of 2 nodes, coordinates of 2 nodes" in done.output
    assert "\n   2   8          1" in done.output


def test_modes_that_stand_twice_or_as_conjugates_count_once(tmp_path: Path) -> None:
    shapes = np.array([[1.0 + 0.1j, 0.3], [0.5, -0.2 + 0.3j]])
    poles = np.array([-1.0 + 60.0j, -2.0 + 150.0j])
    given = modes_55(IdentifiedModes((Dof(7, 3), Dof(12, 3)), poles, shapes))
    below = [Mode55(m.number, m.pole.conjugate(), m.nodes, m.values.conj(), m.title) for m in given]
    path = tmp_path / "pairs.unv"
    write_uff(path, UniversalFile("pairs.unv", modes=(*given, *below, given[1])))
    found = read_modes(path)
    assert found is not None
    np.testing.assert_allclose(found[0].shapes, shapes, rtol=1e-5)
    assert found[2] == ("3 modes that stand twice, or as conjugates of others, are left out",)


def test_a_mode_that_moves_nowhere_is_named(tmp_path: Path) -> None:
    poles = np.array([-1.0 + 60.0j, -2.0 + 2j * np.pi * 25.0])
    still = modes_55(IdentifiedModes((Dof(7, 3), Dof(12, 3)), poles, np.array([[1.0, 0.0], [0.5, 0.0]])))
    write_uff(tmp_path / "still.unv", UniversalFile("still.unv", modes=tuple(still)))
    with pytest.raises(FormatError, match=r"data set 2 \(type 55\): the mode at 25\.\d* Hz is 0 at all of the 6 DOFs"):
        read_modes(tmp_path / "still.unv")


def test_shapes_that_are_no_numbers_and_operating_shapes_are_told(file: Path) -> None:
    file.write_text(REAL.replace("-5.00000E-01", "         NaN"))
    with pytest.raises(FormatError, match=r"the mode at 12\.5 Hz is not a number at 12:\+Z \(1 in all\)"):
        read_modes(file)
    file.write_text(
        REAL.replace("         1         2         2         8", "         1         5         2         8")
    )
    with pytest.raises(FormatError, match="and 1 data set 55 without modes"):
        read_recording(file)
