"""A model cut into a residual structure and a superelement, given by its reduced matrices in an OUTPUT4 file, is the
whole: exactly where static condensation is exact, to 0.1 % with fixed-interface modes (Craig and Bampton, AIAA J. 6
(1968) 1313-1319)."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import pytest
import scipy.linalg
from click.testing import CliRunner
from numpy.typing import NDArray

from femend import _core, diagnose_study
from femend.analysis.model_modes import model_modes
from femend.cli import main
from femend.io.op4 import write_op4
from femend.io.superelement import Superelement, write_superelement
from femend.model import read_model

sys.path.insert(0, str(Path(__file__).parents[1]))
import fe
import small_study

Array = NDArray[np.float64]
N, CUT = 16, 7  # elements; the node where the frame is cut
HEIGHT = 0.4  # the second half of the beam climbs: bending, tension and torsion are coupled


def grids(first: int, last: int) -> list[str]:
    def place(i: int) -> str:
        rise = HEIGHT * max(0, i - CUT) / (N + 1 - CUT)
        return f"GRID,{i},,{0.1 * (i - 1)!r},{rise!r},{0.5 * rise!r}"

    return [place(i) for i in range(first, last + 1)]


def beams(first: int, last: int, material: int) -> list[str]:
    return [f"CBAR,{i},{material},{i},{i + 1},0.,0.3,1." for i in range(first, last)]


def sections(rho: float) -> list[str]:
    """Property and material 1 with mass, 2 with density `rho`."""
    return [
        "PBAR,1,1,6.-4,5.-8,2.-8,3.-8", "PBAR,2,2,6.-4,5.-8,2.-8,3.-8",
        "MAT1,1,2.1+11,,0.3,7850.", f"MAT1,2,2.1+11,,0.3,{rho!r}",
    ]  # fmt: skip


def tip(node: int) -> list[str]:
    """A lump with all its inertias off the beam's axis."""
    return [f"CONM2,{900 + node},{node},,3.,0.02,0.01,0.03,,", "+,.02,,.03,,,.025"]


def matrices_of(model: _core.FeModel, kept: list[int]) -> tuple[Array, Array, NDArray[np.intp]]:
    """K, M and the rows of the nodes `kept`."""
    K, M = fe.matrices(model)
    return K, M, np.flatnonzero(np.isin(model.dof_nodes, kept))


def craig_bampton(K: Array, M: Array, b: NDArray[np.intp], n_modes: int) -> tuple[Array, Array]:
    """Reduced K and M on the boundary rows `b` and `n_modes` fixed-interface modes."""
    i = np.setdiff1d(np.arange(len(K)), b)
    static = -scipy.linalg.solve(K[np.ix_(i, i)], K[np.ix_(i, b)], assume_a="pos")
    V = np.zeros((len(K), len(b) + n_modes))
    V[b, : len(b)], V[i, : len(b)] = np.eye(len(b)), static
    if n_modes:
        V[i, len(b) :] = scipy.linalg.eigh(K[np.ix_(i, i)], M[np.ix_(i, i)], subset_by_index=[0, n_modes - 1])[1]
    return V.T @ K @ V, V.T @ M @ V


def residual(extra: list[str]) -> list[str]:
    cards = [*sections(7850.0), *grids(1, CUT), *beams(1, CUT, 1), "SPC1,1,123456,1", *tip(3), *extra]
    return ["SOL 103", "CEND", "SPC = 1", "K2GG = KPART", "M2GG = MPART", "BEGIN BULK", "PARAM,COUPMASS,1", *cards,
            "INCLUDE 'part.bdf'", "ENDDATA", ""]  # fmt: skip


def convert(folder: Path, K: Array, M: Array, dofs: str, text: bool, layout: str) -> None:
    """Matrices to OUTPUT4, and by the command to cards."""
    write_op4(folder / "part.op4", {"KXX": K, "MXX": M}, text=text, layout=layout)  # type: ignore[arg-type]
    (folder / "part.map").write_text(dofs)
    paths = [str(folder / name) for name in ("part.op4", "part.map", "part.bdf")]
    done = CliRunner().invoke(main, ["op4-to-dmig", paths[0], "--dofs", paths[1], "--out", paths[2]])
    assert done.exit_code == 0, done.output


@pytest.mark.parametrize(("text", "layout"), [(False, "sparse"), (False, "bigmat"), (True, "dense"), (True, "sparse")])
def test_static_condensation_of_a_massless_part_is_exact(tmp_path: Path, text: bool, layout: str) -> None:
    whole = fe.model(
        tmp_path,
        [
            *sections(0.0),
            *grids(1, N + 1),
            *beams(1, CUT, 1),
            *beams(CUT, N + 1, 2),
            *tip(3),
            *tip(N + 1),
            "SPC1,1,123456,1",
        ],
    )
    part = fe.model(tmp_path, [*sections(0.0), *grids(CUT, N + 1), *beams(CUT, N + 1, 2), *tip(N + 1)])
    K, M, b = matrices_of(part, [CUT, N + 1])
    convert(tmp_path, *craig_bampton(K, M, b, 0), f"{CUT} 123456\n{N + 1} 123456\n", text, layout)
    (tmp_path / "split.bdf").write_text("\n".join(residual(grids(N + 1, N + 1))))
    split = _core.FeModel(_core.Deck.read(tmp_path / "split.bdf"))
    np.testing.assert_allclose(
        fe.low_omega(*fe.matrices(split))[:20], fe.low_omega(*fe.matrices(whole))[:20], rtol=1e-8
    )
    assert split.total_mass() == pytest.approx(whole.total_mass(), rel=1e-12)


def test_fixed_interface_modes_on_scalar_points(tmp_path: Path) -> None:
    n_modes = 10
    everything = [*grids(1, N + 1), *beams(1, N + 1, 1), *tip(3), *tip(N + 1), "SPC1,1,123456,1"]
    whole = fe.model(tmp_path, [*sections(7850.0), *everything])
    part = fe.model(tmp_path, [*sections(7850.0), *grids(CUT, N + 1), *beams(CUT, N + 1, 1), *tip(N + 1)])
    K, M, b = matrices_of(part, [CUT])
    punched = f"EXTRN   {CUT:8d}  123456" + "".join(f"{5000 + i:8d}{0:8d}" for i in range(3)) + "\n"
    punched += "".join(f"{'':8s}{5003 + i:8d}{0:8d}\n" for i in range(n_modes - 3))
    convert(tmp_path, *craig_bampton(K, M, b, n_modes), punched, False, "bigmat")
    (tmp_path / "split.bdf").write_text("\n".join(residual([])))
    model = read_model(tmp_path / "split.bdf")
    assert int(model.is_scalar.sum()) == n_modes
    expected = fe.low_omega(*fe.matrices(whole)) / (2 * np.pi)
    modes = model_modes(model, n_modes=9)
    np.testing.assert_allclose(modes.freq, expected[:9], rtol=1e-3)
    assert {dof.node for dof in modes.dofs} == set(range(1, CUT + 1))
    assert model.fe.total_mass() == pytest.approx(whole.total_mass(), rel=1e-9)
    shown = CliRunner().invoke(main, ["modes", str(tmp_path / "split.bdf"), "--n", "4"])
    assert f"{CUT} nodes, {n_modes} scalar points" in shown.output


def test_a_study_goes_on_with_a_superelement_in_its_deck(tmp_path: Path) -> None:
    """The root of a cantilever as a superelement with modes: the spring that the deck leaves out is found as ever, and
    the patched deck has it beside the superelement."""
    study = small_study.write_study(tmp_path, small_study.Truth(more=("CELAS2,900,2.5+4,10,3",)))
    whole = (tmp_path / "model.bdf").read_text().splitlines()
    root = ("GRID,1,", "GRID,2,", "GRID,3,", "CBAR,1,", "CBAR,2,", "CBAR,3,", "SPC1,1,123456")
    cards = [line for line in whole if line.startswith((*root, "GRID,4,", "MAT1,1,", "PBAR,1,"))]
    (tmp_path / "root").mkdir()
    part = fe.model(tmp_path / "root", [*cards, "SPC1,1,246,2,THRU,4"])
    K, M, b = matrices_of(part, [4])
    dofs = [*((4, int(c)) for c in part.dof_components[b]), *((800 + i, 0) for i in range(4))]
    write_superelement(tmp_path / "se.bdf", Superelement(tuple(dofs), *craig_bampton(K, M, b, 4)), "root")
    lines = [line.replace("SPC1,1,246,2,", "SPC1,1,246,4,") for line in whole if not line.startswith(root)]
    at = lines.index("BEGIN BULK")
    lines[at : at + 1] = ["K2GG = KROOT", "M2GG = MROOT", "BEGIN BULK", "INCLUDE 'se.bdf'"]
    (tmp_path / "model.bdf").write_text("\n".join(lines))
    diagnose_study(study, tmp_path / "out")
    result = json.loads((tmp_path / "out" / "result.json").read_text())
    (finding,) = result["findings"]
    assert (finding["physics"], finding["location"]["nodes"]) == ("support_stiffness", [10])
    assert finding["parameters"]["k"]["value"] == pytest.approx(2.5e4, rel=0.02)  # as with the whole deck
    patched = (tmp_path / "out" / "model.updated.bdf").read_text().splitlines()
    assert {"K2GG = KROOT", "INCLUDE 'se.bdf'"} <= set(patched)
    assert any(line.startswith("CELAS2") for line in patched)
