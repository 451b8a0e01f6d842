"""An elastic layer under a plate is spread over its nodes so that the plate tilts on it as on the layer itself."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from femend.diagnose.staged import StagedSettings
from femend.diagnose.staged.candidates import rivals
from femend.model.model import model_of, read_model
from femend.model.terms.configured import free_model
from femend.model.terms.supports import SupportRegion, held_rows, support_regions
from femend.study.staged.patch import _support

LX, LY = 0.5, 0.4


def region(folder: Path, nx: int, ny: int, *, triangles: bool = False, held: int | None = None) -> tuple:
    """A plate of nx by ny elements, of which the first `held` columns of nodes (None: all) are held: its region, and
    its nodes' places (n, 3)."""
    lines = ["SOL 103", "CEND", "SPC = 1", "BEGIN BULK", "MAT1,1,2.1+11,,0.3,7850.", "PSHELL,1,1,0.02,1,,1"]
    lines += ["GRID,9999,,0.,0.,0.1", "PBAR,2,1,1.-4,1.-9,1.-9,2.-9", "CBAR,9999,2,1,9999,1.,0.,0."]
    for j in range(ny + 1):
        for i in range(nx + 1):
            lines.append(f"GRID,{1 + i + (nx + 1) * j},,{LX * i / nx:.6f},{LY * j / ny:.6f},0.")
            if held is None or i < held:
                lines.append(f"SPC1,1,123456,{1 + i + (nx + 1) * j}")
    for j in range(ny):
        for i in range(nx):
            a = 1 + i + (nx + 1) * j
            b, c, d = a + 1, a + nx + 2, a + nx + 1
            if triangles:
                lines += [f"CTRIA3,{2 * a},1,{a},{b},{c}", f"CTRIA3,{2 * a + 1},1,{a},{c},{d}"]
            else:
                lines.append(f"CQUAD4,{a},1,{a},{b},{c},{d}")
    path = folder / "plate.bdf"
    path.write_text("\n".join([*lines, "ENDDATA", ""]))
    deck = read_model(path).deck
    free = free_model(deck, units="SI", parameters=[])
    (found,) = support_regions(free, held_rows(free, model_of(deck, spc=1)))
    return found, np.array([free.xyz_of[n] for n in found.nodes])


@pytest.mark.parametrize("triangles", [False, True])
@pytest.mark.parametrize(("nx", "ny"), [(2, 2), (5, 4), (9, 3)])
def test_a_plate_tilts_as_on_the_layer(tmp_path: Path, nx: int, ny: int, triangles: bool) -> None:
    """Of a rectangle L long the layer has k A L^2 / 12 against a tilt, whatever its mesh; plain shares of five elements
    have 8 % more."""
    found, xyz = region(tmp_path, nx, ny, triangles=triangles)
    x, y = (xyz[:, i] - side / 2 for i, side in enumerate((LX, LY)))
    assert found.tilting.sum() == pytest.approx(LX * LY, rel=1e-9)
    assert [r.areas is found.tilting for r in found.spread()] == [False, True]
    assert found.tilting.min() > 0
    assert found.tilting @ x**2 == pytest.approx(LX**3 * LY / 12, rel=1e-6)
    assert found.tilting @ y**2 == pytest.approx(LX * LY**3 / 12, rel=1e-6)
    assert [found.tilting @ x, found.tilting @ y, found.tilting @ (x * y)] == pytest.approx(
        [0.0] * 3, abs=1e-7 * LX * LY
    )


@pytest.mark.parametrize(("nx", "ny", "held"), [(1, 1, None), (5, 4, 2)])
def test_shares_stay_where_nodes_or_shells_do_not_allow_it(tmp_path: Path, nx: int, ny: int, held: int | None) -> None:
    """Four corners cannot tilt otherwise; shells that reach beyond what is held count with their nodes' shares."""
    found: SupportRegion = region(tmp_path, nx, ny, held=held)[0]
    assert found.spread() == (found,)
    assert found.tilting == pytest.approx(found.areas)
    quarter = LX * LY / (4 * nx * ny)
    whole = np.unique(np.round(found.areas / quarter, 6))
    assert set(whole.tolist()) <= {1.0, 2.0, 4.0}


def test_both_spreads_are_tried_and_written(tmp_path: Path) -> None:
    """The one that recordings choose is told apart by its label, and its own shares stand in the updated deck."""
    found, _ = region(tmp_path, 5, 4)
    free = free_model(read_model(tmp_path / "plate.bdf").deck, units="SI", parameters=[])
    settings = StagedSettings(most_places=0)
    setup: Any = SimpleNamespace(
        free=free, settings=settings, regions={"": (found,)}, bushes=(), omega=60.0, zeta=0.01, pairing={},
        configurations={"": None},
    )  # fmt: skip
    supports = [t for t in rivals(setup, "", (), (), only_here=False) if t.physics == "compliant_support"]
    assert len({t.label for t in supports}) == 2
    assert len({t.name for t in supports}) == 1  # with one taken the other is no rival any more
    assert [t.shares for t in supports] == [tuple(found.areas.tolist()), tuple(found.tilting.tolist())]
    cards, _ = _support(setup, supports[1], {"k_z": 1e6}, 900)
    springs = [float(card.split(",")[2]) for card in cards if card.startswith("CELAS2")]
    assert springs == pytest.approx(1e6 * found.tilting, rel=1e-6)
