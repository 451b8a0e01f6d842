"""Superelements: DOF maps as they are punched and typed, cards a deck holds, and what is wrong said plainly."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from femend import _core
from femend.cli import main
from femend.errors import FormatError, ModelError
from femend.io.op4 import write_op4
from femend.io.superelement import (
    Superelement,
    case_control,
    dmig_cards,
    read_dof_map,
    read_superelement,
    superelement_cards,
    write_superelement,
)
from femend.io.superelement.cards import _number

PUNCHED = """\
$ EXTRN DATA
BEGIN SUPER      102
EXTRN          3  123456      11      12      19       3
         2995001       0 2995002       0
GRID*                  3               0 0.600000000E+03 0.000000000E+00
*        0.300000000E+03               0               0               0
ASET           3  123456
"""
THREE = tuple((3, c) for c in range(1, 7))


def write(folder: Path, text: str) -> Path:
    path = folder / "map.txt"
    path.write_text(text)
    return path


@pytest.mark.parametrize(
    ("text", "dofs"),
    [
        (PUNCHED, (*THREE, (11, 1), (11, 2), (19, 3), (2995001, 0), (2995002, 0))),
        ("QSET1,,901,THRU,903\nBSET1   21      7       4\nASET,2,3,1,12\n",
         ((1, 1), (1, 2), (2, 3), (4, 1), (4, 2), (7, 1), (7, 2), (901, 0), (902, 0), (903, 0))),
        (f"ASET1*  {123:16d}{5:16d}\n*       {9:16d}\n",
         ((5, 1), (5, 2), (5, 3), (9, 1), (9, 2), (9, 3))),
        ("node component\n# the ring\n9:RX\n3, 123456\n5 +Z $ up\n70 0\n71\n",
         ((9, 4), *THREE, (5, 3), (70, 0), (71, 0))),
    ],
)  # fmt: skip
def test_maps_as_they_come(tmp_path: Path, text: str, dofs: tuple[tuple[int, int], ...]) -> None:
    assert read_dof_map(write(tmp_path, text)) == dofs


@pytest.mark.parametrize(
    ("text", "word"),
    [
        ("", "no DOF in the map"),
        ("3 123\n3 3\n", "3:3 stands twice"),
        ("3 127\n", ":1: '127' are no components"),
        ("3 123\nx 1\n", ":2: 'x' is no node"),
        ("3 1 2\n", "3 words"),
        ("ASET1,1,1,THRU,99999999\n", "THRU 99999999"),
        ("ASET1,1,THRU,5\n", "THRU without"),
        ("EXTRN,3,123,THRU,7,123\n", "write the nodes out"),
        ("ASET,,123\n", "without a node"),
        ("99999999999 1\n", "no node"),
    ],
)
def test_faults_of_maps_are_told_with_their_line(tmp_path: Path, text: str, word: str) -> None:
    with pytest.raises(FormatError, match=word) as error:
        read_dof_map(write(tmp_path, text))
    assert error.value.file == str(tmp_path / "map.txt")


def test_numbers_fill_sixteen_columns() -> None:
    rng = np.random.default_rng(4)
    for value in rng.choice([-1, 1], 3000) * 10.0 ** rng.uniform(-9, 14, 3000):
        text = _number(float(value))
        assert len(text) <= 16
        number = text[0] + text[1:].replace("+", "e+").replace("-", "e-")
        assert float(number) == pytest.approx(value, rel=1e-11)  # twelve digits
    assert len(_number(-1.23456789012345e-123)) <= 16


def test_cards_are_read_back_by_the_deck_reader(tmp_path: Path) -> None:
    """Stiffness, mass, dashpot and structural damping of nodes and modal coordinates arrive in K, M, C and H."""
    rng = np.random.default_rng(0)
    dofs = ((2, 1), (2, 5), (90, 0), (4, 3), (91, 0))
    matrices = [a @ a.T for a in rng.standard_normal((4, 5, 5)) * [[[1e6]], [[1.0]], [[10.0]], [[100.0]]]]
    part = Superelement(dofs, *matrices)
    write_superelement(tmp_path / "se.bdf", part, "ring")
    control = case_control(part, "ring")
    assert control == ["K2GG = KRING", "M2GG = MRING", "B2GG = BRING", "K42GG = K4RING"]
    deck = ["CEND", *control, "BEGIN BULK", "GRID,2,,1.,0.,0.", "GRID,4,,2.,0.,0.", "INCLUDE 'se.bdf'", "ENDDATA"]
    (tmp_path / "model.bdf").write_text("\n".join(deck))
    fe = _core.FeModel(_core.Deck.read(tmp_path / "model.bdf"))
    indptr, indices, *values = fe.assemble()
    at = {(int(n), int(c)): i for i, (n, c) in enumerate(zip(fe.dof_nodes, fe.dof_components, strict=True))}
    order = [at[n, c or 4] for n, c in dofs]  # a scalar point's DOF is carried as component 4
    from scipy.sparse import csc_array

    for data, matrix in zip(values, matrices, strict=True):
        got = csc_array((data, indices, indptr), shape=(5, 5)).toarray()[np.ix_(order, order)]
        np.testing.assert_allclose(got, matrix, rtol=0, atol=1e-11 * np.abs(matrix).max())
    assert fe.scalar_points.tolist() == [90, 91]


def test_matrices_are_found_by_their_usual_names(tmp_path: Path) -> None:
    K = np.array([[2.0, -1.0], [-1.0, 2.0]])
    path = tmp_path / "SE.op4"
    dofs = ((1, 1), (2, 1))
    write_op4(path, {"KXX": K, "MXX": np.eye(2), "BXX1": np.zeros((1, 1)), "KC": K * (1 + 0.02j), "OTHER": np.triu(K)})
    found = read_superelement(path, dofs)
    assert (found.source, found.B, found.K4) == ("KXX, MXX of SE.op4", None, None)
    lossy = read_superelement(path, dofs, stiffness="KC")
    assert lossy.K4 is not None
    np.testing.assert_allclose(lossy.K4, 0.02 * K)
    np.testing.assert_array_equal(read_superelement(path, dofs, stiffness="other").K, K)  # one triangle for both
    with pytest.raises(FormatError, match="no matrix KYY in the file; it holds KXX, MXX"):
        read_superelement(path, dofs, stiffness="KYY")
    with pytest.raises(ModelError, match="KXX is 2 x 2, the map has 3 DOFs"):
        read_superelement(path, (*dofs, (3, 1)))
    with pytest.raises(ModelError, match="mass matrix is complex"):
        read_superelement(path, dofs, mass="KC")
    write_op4(path, {"A": K})
    with pytest.raises(ModelError, match=r"no matrix with a usual name \(A are there\)"):
        read_superelement(path, dofs)


def test_matrices_that_cannot_be_are_refused() -> None:
    with pytest.raises(ModelError, match="not symmetric: 1 and 2 in rows 1 and 2"):
        Superelement(((1, 1), (2, 1)), np.array([[1.0, 1.0], [2.0, 1.0]]))
    with pytest.raises(ModelError, match="M has terms that are not finite"):
        Superelement(((1, 1),), None, [[np.nan]])  # type: ignore[arg-type]
    with pytest.raises(ModelError, match="without stiffness and mass"):
        Superelement(((1, 1),))
    with pytest.raises(ModelError, match="no name for a superelement"):
        superelement_cards(Superelement(((1, 1),), np.eye(1)), "TOOLONG")


def test_a_matrix_of_zeros_still_has_a_column() -> None:
    assert len(dmig_cards("K", np.zeros((2, 2)), [(1, 1), (2, 1)])) == 3


@pytest.mark.parametrize(("held", "free"), [(1e-7, True), (40.0, False)])
def test_a_free_part_on_one_node_is_told_from_a_held_one(held: float, free: bool) -> None:
    """All that the diagonal has there is rounding; the part's first mode with the node held is at 300 rad/s."""
    part = Superelement(((1, 3), (9, 0)), np.diag([held, 9e4]), np.array([[2.0, 0.9], [0.9, 1.0]]))
    assert bool(part.rigid_check([1], np.zeros((1, 3))).energy.max() < 1e-4) is free
    alone = Superelement(((1, 3),), [[held]], [[2.0]]).rigid_check([1], np.zeros((1, 3)))
    assert np.isnan(alone.energy).all()


def test_rigid_motion_finds_exchanged_dofs() -> None:
    """A spring along a line at 45 degrees; node 2 has axes of its own."""
    xyz, s = np.array([[0.0, 0, 0], [1.0, 1.0, 0]]), np.sqrt(0.5)
    frames = np.stack([np.eye(3), np.array([[s, s, 0], [-s, s, 0], [0, 0, 1]])])
    w = np.array([s, s, -1.0, 0.0])
    dofs = ((1, 1), (1, 2), (2, 1), (2, 2))
    right = Superelement(dofs, 1e6 * np.outer(w, w), np.eye(4)).rigid_check([1, 2], xyz, frames)
    assert right.energy.max() < 1e-14
    np.testing.assert_allclose(right.mass, [2.0, 2.0, 0.0])
    wrong = Superelement((dofs[0], dofs[1], dofs[3], dofs[2]), 1e6 * np.outer(w, w)).rigid_check([1, 2], xyz, frames)
    assert wrong.energy.max() > 0.1
    with pytest.raises(ModelError, match="no node 2"):
        Superelement(dofs, np.eye(4)).rigid_check([1], xyz[:1])


def test_the_order_of_external_superelements_is_that_of_the_punched_cards(shared: Callable[[str], Path]) -> None:
    """Free parts reduced by NX Nastran store nothing in rigid motion, and weigh the same in all directions."""
    folder = shared("data/formats/nastran/pyyeti/nas2cam_extseout")
    xyz = [[600.0, 0, 300], [600, 300, 300], [600, 300, 0], [600, 0, 0]]
    frames = np.stack([np.eye(3)] * 4)
    frames[1] = [[0, 1, 0], [0, 0, 1], [1, 0, 0]]  # CORD2R 10
    for name, n_modes in (("inboard", 8), ("outboard", 22)):
        dofs = read_dof_map(folder / f"{name}.pch")
        assert len(dofs) == 24 + n_modes
        found = read_superelement(folder / f"{name}.op4", dofs).rigid_check([3, 11, 19, 27], xyz, frames)
        assert found.energy.max() < 1e-11
        assert np.ptp(found.mass) < 1e-9 * found.mass[0]


def test_the_command_writes_checks_and_tells_what_to_do(tmp_path: Path) -> None:
    s = 1e6 * np.array([[1.0, -1.0], [-1.0, 1.0]])
    write_op4(tmp_path / "bracket 7.op4", {"KAA": s, "MAA": np.eye(2)}, text=True)
    (tmp_path / "map.txt").write_text("1 3\n2 3\n")
    grids = "GRID,1\nGRID,2,,1.,0.,0.\nCELAS2,1,1.,1,1,2,1\n"
    (tmp_path / "model.bdf").write_text(grids)
    arguments = ["op4-to-dmig", "bracket 7.op4", "--dofs", "map.txt", "--out", "se.bdf", "--deck", "model.bdf"]
    paths = [str(tmp_path / a) if "." in a else a for a in arguments]
    shown = CliRunner().invoke(main, paths)
    assert shown.exit_code == 0, shown.output
    assert "KAA, MAA of bracket 7.op4; 2 DOFs of 2 nodes, 0 scalar points" in shown.output
    assert "K2GG = KBRACKE" in shown.output
    assert "INCLUDE 'se.bdf'" in shown.output
    assert "warning: it resists rigid motion" in shown.output  # a spring along Z, turned about Y
    (tmp_path / "map.txt").write_text("1 3\n")
    shown = CliRunner().invoke(main, paths)
    assert shown.exit_code == 2
    assert "KAA is 2 x 2, the map has 1 DOFs" in shown.output


def test_mass_along_x_is_told_where_nodes_have_axes_of_their_own(tmp_path: Path) -> None:
    """Local x is basic Y, local y basic -X: what moves along X is the mass of component 2."""
    part = Superelement(((1, 1), (1, 2), (1, 3)), np.eye(3), np.diag([2.0, 3.0, 5.0]))
    write_superelement(tmp_path / "se.bdf", part, "S")
    deck = ["CEND", *case_control(part, "S"), "BEGIN BULK", "CORD2R,4,,0.,0.,0.,0.,0.,1.", "+,0.,1.,0."]
    (tmp_path / "model.bdf").write_text("\n".join([*deck, "GRID,1,,0.,0.,0.,4", "INCLUDE 'se.bdf'", "ENDDATA"]))
    assert _core.FeModel(_core.Deck.read(tmp_path / "model.bdf")).total_mass() == pytest.approx(3.0)
