"""What a reader copies from the pages runs: every block of Python, in the order of its page, on files made here."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from femend import FRF, Channel, Dof, TimeData, functions_of, write_uff

# four masses of 2 kg in a row, the first one on a spring to ground
M = 2.0 * np.eye(4)
K = 1e4 * np.array([[2.0, -1, 0, 0], [-1, 2, -1, 0], [0, -1, 2, -1], [0, 0, -1, 1]])
C = 2e-4 * K + 0.3 * M
FREQ = np.sqrt(np.linalg.eigvalsh(K / 2.0)) / (2 * np.pi)  # 3.9, 11.3, 17.2, 21.2 Hz


def acceleration(node: int) -> Channel:
    return Channel(Dof(node, 1), "acceleration", "m/s^2")


def receptances(freq: np.ndarray) -> np.ndarray:
    s = (2j * np.pi * freq)[:, None, None]
    return np.linalg.inv(s**2 * M + s * C + K)


def hammer(folder: Path) -> None:
    freq = np.arange(1.0, 70.0, 0.1)
    H = -((2 * np.pi * freq[:, None, None]) ** 2) * receptances(freq)[:, :, 3:]
    ends = [acceleration(n) for n in (1, 2, 3, 4)], [Channel(Dof(4, 1), "force", "N")]
    write_uff(folder / "hammer.uff", functions_of(FRF("hammer", freq, H, *ends, "accelerance", "m/s^2/N")))


def ambient(path: Path, nodes: list[int], seed: int) -> None:
    rate, n = 64.0, 64 * 120
    noise = np.random.default_rng(seed).standard_normal((4, n))
    s = 2j * np.pi * np.fft.rfftfreq(n, 1 / rate)
    H = s[:, None, None] ** 2 * receptances(s.imag / (2 * np.pi))
    motion = np.fft.irfft(np.einsum("fij,jf->if", H, np.fft.rfft(noise)), n)
    rows = motion[[node - 1 for node in nodes]]
    rows = rows + 0.01 * rows.std() * np.random.default_rng(seed + 100).standard_normal(rows.shape)
    write_uff(path, functions_of(TimeData(path.stem, 1 / rate, rows, [acceleration(node) for node in nodes])))


def run_up(folder: Path) -> None:
    """Orders 1 and 2 of 3 and 1 m/s² from 5 to 25 rev/s, and a pulse of a twentieth of a turn."""
    t = np.arange(40 * 1024) / 1024
    angle = 2 * np.pi * (5 * t + 0.25 * t**2)
    pulse = np.where(np.mod(angle, 2 * np.pi) < 0.1 * np.pi, 5.0, 0.0)
    channels = [acceleration(1), Channel(None, "tacho", "V", "tacho", "tacho")]
    values = np.array([3 * np.cos(angle) + np.cos(2 * angle), pulse])
    write_uff(folder / "runup.uff", functions_of(TimeData("runup", 1 / 1024, values, channels)))


def tower(path: Path, lower: int, upper: int) -> None:
    """Three bricks on one another, nodes 1 to 16 from the ground up, of the materials `lower` and `upper`."""
    grids = [
        f"GRID,{4 * z + k + 1},,{0.05 * x},{0.05 * y},{0.03 * z}"
        for z in range(4)
        for k, (x, y) in enumerate(((0, 0), (1, 0), (1, 1), (0, 1)))
    ]
    bricks = [
        f"CHEXA,{z + 1},{lower if z < 2 else upper}," + ",".join(str(4 * z + k) for k in range(1, 7)) + ",+\n"
        f"+,{4 * z + 7},{4 * z + 8}"
        for z in range(3)
    ]
    sections = [
        f"PSOLID,{lower},{lower}\nMAT1,{lower},5.0+6,,0.45,1200.",
        f"PSOLID,{upper},{upper}\nMAT1,{upper},7.0+10,,0.3,2700.",
    ]
    body = [*grids, *bricks, *sections, "SPC1,1,123,1,2,3,4"]
    path.write_text("\n".join(["SOL 103", "CEND", "SPC=1", "BEGIN BULK", *body, "ENDDATA", ""]))


def rotor(folder: Path) -> None:
    grids = [f"GRID,{n},,{0.25 * (n - 1)},0.,0." for n in range(1, 6)]
    beams = [f"CBAR,{n},1,{n},{n + 1},0.,1.,0." for n in range(1, 5)]
    discs = [
        f"CONM2,{e},{n},,{m},,,,,+\n+,{2 * i},,{i},,,{i}" for e, n, m, i in ((101, 2, 5.0, 0.02), (102, 4, 3.0, 0.01))
    ]
    bearings = [
        f"CELAS2,{20 + 10 * g + c},1.0+7,{g},{c}\nCDAMP2,{120 + 10 * g + c},200.,{g},{c}"
        for g in (1, 5)
        for c in (2, 3)
    ]
    shaft = ["MAT1,1,2.1+11,,0.3,7800.", "PBAR,1,1,7.0686-4,3.976-8,3.976-8,7.952-8", "SPC1,1,14,1"]
    body = [*grids, *beams, *discs, *bearings, *shaft]
    text = "\n".join(["SOL 107", "CEND", "SPC=1", "BEGIN BULK", *body, "ENDDATA", ""])
    (folder / "rotor.bdf").write_text(text)


def executed(project_root: Path, page: str) -> dict[str, Any]:
    """The names that the blocks of a page leave."""
    text = (project_root / "python" / "docs" / f"{page}.md").read_text(encoding="utf-8")
    blocks = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    assert blocks
    names: dict[str, Any] = {}
    for number, block in enumerate(blocks, start=1):
        exec(compile(block, f"{page}.md, block {number}", "exec"), names)
    return names


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_modal(project_root: Path, folder: Path) -> None:
    hammer(folder)
    names = executed(project_root, "modal")
    assert names["test"].status == "ok"
    np.testing.assert_allclose(names["modes"].freq, FREQ, rtol=1e-5)


def test_output_only(project_root: Path, folder: Path) -> None:
    ambient(folder / "ambient.uff", [1, 2, 3, 4], 1)
    for k, nodes in enumerate(([1, 2, 4], [1, 3, 4], [4, 2, 1]), start=1):
        ambient(folder / f"setup{k}.uff", nodes, k + 1)
    names = executed(project_root, "output_only")
    for modes in (names["found"].modes, names["merged"].modes):
        np.testing.assert_allclose(modes.freq, FREQ[:2], rtol=0.01)


def test_signals(project_root: Path, folder: Path) -> None:
    run_up(folder)
    names = executed(project_root, "signals")
    inner = slice(4000, -4000)
    np.testing.assert_allclose(np.abs(names["track"].order(1)[0][inner]), 3.0, rtol=0.01)
    np.testing.assert_allclose(np.abs(names["track"].order(2)[0][inner]), 1.0, rtol=0.02)
    assert names["steady"].kind == "order"


def test_pretest(project_root: Path, folder: Path) -> None:
    tower(folder / "frame.bdf", 1, 2)
    assert len(executed(project_root, "pretest")["best"].rows) == 8


def test_elements(project_root: Path, folder: Path) -> None:
    tower(folder / "bar.bdf", 1, 2)
    executed(project_root, "elements")


def test_complex_modes(project_root: Path, folder: Path) -> None:
    rotor(folder)
    tower(folder / "mount.bdf", 7, 1)
    names = executed(project_root, "complex_modes")
    assert names["found"].converged
    K = names["K"].toarray() * (1 + 0.02j)
    s, pad = names["s"], names["pad"].toarray()
    Z = K + pad * names["rubber"](names["freq"])[:, None, None] + names["M"].toarray() * s[:, None, None] ** 2
    exact = s**2 * np.linalg.inv(Z)[:, 2, 3]
    np.testing.assert_allclose(names["found"].frf.H[:, 0, 0], exact, rtol=1e-5)
