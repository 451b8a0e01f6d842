"""Scalar points: one DOF each in springs, dashpots, masses, SPC, MPC and DMIG, and no place in space for anybody."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from femend import Channel, Dof, TimeData
from femend.analysis.model_modes import model_modes
from femend.cli import main
from femend.data import Geometry, Recording, Test
from femend.errors import DeckError, ModelError, PairingError
from femend.estimate.prepare import pair_test
from femend.io.deck import read_deck
from femend.model import Model, read_model
from femend.study.shown.picture import mesh_picture

# a mass on a spring at node 1, with a chain of two scalar oscillators on it
CHAIN = """\
GRID,1,,0.,0.,0.,,23456
GRID,2,,2.,0.,0.,,23456
CONM2,1,1,,2.
CONM2,2,2,,1.
CELAS2,1,900.,1,1
CELAS2,2,500.,1,1,2,1
CELAS2,3,400.,1,1,11
CELAS4,4,300.,11,12
PELAS,7,200.,0.02
CELAS3,5,7,12
CMASS4,21,3.,11
CMASS2,22,1.5,12
CDAMP4,31,4.,11,12
"""


def write(folder: Path, bulk: str, control: str = "") -> Path:
    path = folder / "model.bdf"
    path.write_text(f"CEND\n{control}\nBEGIN BULK\n{bulk}ENDDATA\n" if control else bulk)
    return path


def dense(model: Model, which: int) -> np.ndarray:
    from scipy.sparse import csc_array

    indptr, indices, *values = model.fe.assemble()
    return np.asarray(csc_array((values[which], indices, indptr), shape=(model.fe.n_a,) * 2).toarray())


def test_a_mass_between_two_dofs_moves_with_their_difference(tmp_path: Path) -> None:
    """In displacement frames (node 2 has one turned by 30 degrees), and scaled by WTMASS as other masses are."""
    more = "CORD2R,5,,0.,0.,0.,0.,0.,1.,\n,.8660254037844387,.5,0.\nGRID,3,,4.,0.,0.,5,3456\n"
    more += "CELAS2,9,100.,3,1,,,\nCELAS2,10,100.,3,2\nCMASS2,30,0.5,1,1,3,2\nCMASS4,31,0.25,11,12\n"
    more += "PMASS,8,2.\nCMASS1,32,8,3,1,2,1\n"
    model = read_model(write(tmp_path, CHAIN + more))
    order = {dof: i for i, dof in enumerate(zip(model.fe.dof_nodes, model.fe.dof_components, strict=True))}
    expected = np.zeros((6, 6))
    for dof, m in {(1, 1): 2.0, (2, 1): 1.0, (11, 4): 3.0, (12, 4): 1.5}.items():
        expected[order[dof], order[dof]] = m
    for a, b, m in (((1, 1), (3, 2), 0.5), ((11, 4), (12, 4), 0.25), ((3, 1), (2, 1), 2.0)):
        i, j = order[a], order[b]
        expected[[i, j, i, j], [i, j, j, i]] += [m, m, -m, -m]
    np.testing.assert_allclose(dense(model, 1), expected)
    scaled = read_model(write(tmp_path, CHAIN + more + "PARAM,WTMASS,0.5\n"))
    np.testing.assert_allclose(dense(scaled, 1), 0.5 * expected)


def test_a_chain_of_grids_and_scalar_points(tmp_path: Path) -> None:
    model = read_model(write(tmp_path, CHAIN))
    assert model.fe.scalar_points.tolist() == [11, 12]  # named by CELAS4: no SPOINT needed
    assert (model.fe.dof_nodes.tolist(), model.fe.dof_components.tolist()) == ([1, 2, 11, 12], [1, 1, 4, 4])
    K = [[1800, -500, -400, 0], [-500, 500, 0, 0], [-400, 0, 700, -300], [0, 0, -300, 500]]
    np.testing.assert_array_equal(dense(model, 0), K)
    np.testing.assert_array_equal(dense(model, 1), np.diag([2.0, 1.0, 3.0, 1.5]))
    np.testing.assert_array_equal(dense(model, 2)[2:, 2:], [[4, -4], [-4, 4]])
    assert dense(model, 3)[3, 3] == pytest.approx(4.0)
    assert model.fe.total_mass() == 3.0  # what has no direction does not weigh
    assert [card for _, card, _, _ in model.deck.elements()].count("CELAS4") == 1


def test_spc_mpc_and_dmig_take_scalar_points(tmp_path: Path) -> None:
    bulk = (
        "SPOINT,11,THRU,14\nSPOINT,20\nGRID,1,,0.,0.,0.,,23456\nCELAS2,1,900.,1,1\nCONM2,1,1,,2.\n"
        "CELAS2,2,50.,11,0,1,1\nCELAS2,3,60.,12,1,1,1\nCELAS2,4,70.,13,,1,1\nCELAS2,5,80.,14,0,1,1\n"
        "SPC,1,11,0,0.\nSPC1,1,,12\nMPC,2,13,0,1.,1,1,-2.\n"
        "DMIG,M,0,6,2,0\nDMIG,M,14,0,,14,0,5.\n+,20,0,1.\nDMIG,M,20,0,,20,0,7.\n"
    )
    model = read_model(write(tmp_path, bulk, "SPC = 1\nMPC = 2\nM2GG = M"))
    assert model.fe.dof_nodes.tolist() == [1, 14, 20]
    np.testing.assert_array_equal(dense(model, 0), [[900 + 50 + 60 + 70 + 80, -80, 0], [-80, 80, 0], [0, 0, 0]])
    np.testing.assert_array_equal(dense(model, 1), [[2, 0, 0], [0, 5, 1], [0, 1, 7]])


@pytest.mark.parametrize(
    ("bulk", "word"),
    [
        ("CONM2,9,11,,2.\nSPOINT,11\n", "11 is a scalar point, which has no place"),
        ("SPOINT,1\n", "SPOINT 1: id already used .* GRID 1"),
        ("SPOINT,1000001,THRU,2000000000\n", "more than 1000000 scalar points"),
        ("SPOINT,9,THRU,7\n", "runs backwards"),
        ("SPOINT,11\nCELAS2,3,1.,11,3\n", "scalar point 11 has no component 3"),
        ("CELAS4,3,1.,1,11\n", "1 is a GRID; CELAS4 connects scalar points"),
        ("CELAS2,3,1.,12,0\n", "GRID or SPOINT 12"),
        ("SPOINT,11\nSPC1,1,35,11\n", "component 0 alone"),
        ("SPOINT,11\nRBE2,5,1,123,11\n", "no place"),
    ],
)
def test_what_scalar_points_cannot_do(tmp_path: Path, bulk: str, word: str) -> None:
    with pytest.raises(DeckError, match=word):
        read_model(write(tmp_path, CHAIN.split("CELAS2,3")[0] + bulk), spc=1 if "SPC1" in bulk else None)


def test_ranges_of_rigid_elements_pass_over_scalar_points(tmp_path: Path) -> None:
    bulk = "GRID,1\nGRID,2\nGRID,5,,1.,0.,0.\nSPOINT,3\nCELAS4,1,10.,3\nCONM2,9,1,,2.\nRBE2,5,1,123456,2,THRU,5\n"
    model = read_model(write(tmp_path, bulk))
    assert 3 in model.fe.dof_nodes


def test_no_sensor_meets_a_scalar_point(tmp_path: Path) -> None:
    model = read_model(write(tmp_path, CHAIN))
    np.testing.assert_array_equal(model.is_scalar, [False, False, True, True])
    np.testing.assert_allclose(model.xyz[2:], [[1.0, 0, 0]] * 2)  # the size of the model stays

    def pair(node: int, x: float) -> str:
        channels = (Channel(Dof(1, 1), "force", "N"), Channel(Dof(node, 1), "acceleration", "m/s^2"))
        data = TimeData("r", 1 / 512, np.random.default_rng(1).standard_normal((2, 8)), channels)
        geometry = Geometry(np.array([1, node]), np.array([[0.0, 0, 0], [x, 0, 0]]))
        return str(pair_test(Test((Recording("r", data, geometry=geometry),)), model)[Dof(node, 1)].dof)

    assert pair(77, 2.01) == "2:+X"
    with pytest.raises(PairingError, match="from the nearest node"):
        pair(77, 1.01)  # where the scalar points stand in
    with pytest.raises(PairingError, match="from the nearest node"):
        pair(11, 1.0)  # not by its id either
    with pytest.raises(PairingError, match="11 is a scalar point"):
        model.row(Dof(11, 1))
    with pytest.raises(ModelError, match="scalar point"):
        read_model(tmp_path / "model.bdf", added_mass=[(11, 1.0)])


def test_pictures_modes_and_tables_are_of_places_alone(tmp_path: Path) -> None:
    path = write(tmp_path, CHAIN)
    model = read_model(path)
    assert mesh_picture(model).node_ids.tolist() == [1, 2]
    modes = model_modes(model)
    K, M = dense(model, 0), dense(model, 1)
    np.testing.assert_allclose(modes.freq, np.sqrt(np.sort(np.linalg.eigvals(np.linalg.solve(M, K)))) / (2 * np.pi))
    assert {dof.node for dof in modes.dofs} == {1, 2}
    deck = read_deck(path)
    assert (deck.node_ids.tolist(), deck.scalar_points.tolist(), deck.xyz.shape) == ([1, 2], [11, 12], (2, 3))
    for command in ("inspect", "modes"):
        assert "2 nodes, 2 scalar points" in CliRunner().invoke(main, [command, str(path)]).output


def test_a_point_nothing_is_on_is_held(tmp_path: Path) -> None:
    model = read_model(write(tmp_path, CHAIN + "SPOINT,500\n"))
    assert model.fe.auto_constrained == ["500:0"]
