"""External superelements that NX Nastran reduced, assembled here: frequencies against Nastran's own assembly.

The files are those of pyYeti's tests: a truss in two parts, each with fixed-interface modes to 50 Hz as SPOINTs,
punched by EXTSEOUT; `nas2cam.op4` holds the eigenvalues of the assembly.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from femend import _core
from femend.cli import main
from femend.io.op4 import read_op4

RIGID = 6


@pytest.fixture
def folder(shared: Callable[[str], Path]) -> Path:
    return shared("data/formats/nastran/pyyeti/nas2cam_extseout")


def assembly(folder: Path, out: Path) -> _core.FeModel:
    """The two superelements on their boundary nodes and modal coordinates."""
    for name in ("inboard", "outboard"):
        arguments = [
            str(folder / f"{name}.op4"),
            "--dofs",
            str(folder / f"{name}.pch"),
            "--out",
            str(out / f"{name}.bdf"),
        ]
        done = CliRunner().invoke(main, ["op4-to-dmig", *arguments, "--name", name[:6].upper()])
        assert done.exit_code == 0, done.output
    deck = [
        "CEND", "K2GG = KINBOAR, KOUTBOA", "M2GG = MINBOAR, MOUTBOA", "BEGIN BULK",
        "CORD2R,10,0,0.,0.,0.,1.,0.,0.", "+,0.,1.,0.", "GRID,3,,600.,0.,300.", "GRID,11,,600.,300.,300.,10",
        "GRID,19,,600.,300.,0.", "GRID,27,,600.,0.,0.", "INCLUDE 'inboard.bdf'", "INCLUDE 'outboard.bdf'",
        "ENDDATA", "",
    ]  # fmt: skip
    (out / "model.bdf").write_text("\n".join(deck))
    return _core.FeModel(_core.Deck.read(out / "model.bdf"))


def test_all_frequencies_of_the_assembly_are_nastrans(folder: Path, tmp_path: Path) -> None:
    fe = assembly(folder, tmp_path)
    assert (fe.n_a, len(fe.scalar_points)) == (54, 30)
    indptr, indices, K, M, _, _ = fe.assemble()
    freq, _, _, info = _core.modes(indptr, indices, K, M, n_modes=54, f_max=None)
    (eigenvalues,) = read_op4(folder / "nas2cam.op4", ["LAMBDA"])
    expected = np.sqrt(np.maximum(eigenvalues.toarray().ravel().real, 0.0)) / (2 * np.pi)
    assert info["n_rigid"] == RIGID
    # the matrices agree to 5e-11 of their largest eigenvalue; Nastran keeps LAMBDA in single precision
    np.testing.assert_allclose(freq[RIGID:], expected[RIGID:], rtol=2e-7)


def test_the_truss_in_one_piece_has_the_same_low_frequencies(folder: Path, tmp_path: Path) -> None:
    """Both decks of elements as one model, without superelements: Craig-Bampton to 50 Hz is good for low modes."""
    lines: dict[str, None] = {}
    for name in ("inboard", "outboard"):
        lines |= dict.fromkeys((folder / f"{name}.blk").read_text().splitlines())  # the interface stands in both
    (tmp_path / "truss.bdf").write_text("\n".join(["BEGIN BULK", *lines, "ENDDATA", ""]))
    whole = _core.FeModel(_core.Deck.read(tmp_path / "truss.bdf"))
    split = assembly(folder, tmp_path)
    freq = []
    for fe in (whole, split):
        indptr, indices, K, M, _, _ = fe.assemble()
        freq.append(_core.modes(indptr, indices, K, M, n_modes=16, f_max=None)[0])
    assert whole.total_mass() == pytest.approx(split.total_mass(), rel=1e-6)
    np.testing.assert_allclose(freq[1][RIGID:], freq[0][RIGID:], rtol=1e-3)
