"""The generator of cases: plans, files that are repeated to the byte, readable, and without the answer."""

from __future__ import annotations

import pathlib

import numpy as np
import one_record
import pytest
from blindgen import case, plan, uff58


def test_blocks_hold_every_effect_once() -> None:
    """A third controls by default, fourteen effects and two rare ones in every block; other shares and kinds."""
    labels = plan.block(3, 2)
    assert sum(q.startswith("none") for q in labels) == 8
    assert len(labels) == 24
    assert all(labels.count(q) == 1 for q in plan.EFFECTS)
    assert sum(q in plan.RARE for q in labels) == 2
    assert all(q.startswith("none") for q in plan.block(3, 2, controls=1.0))
    assert sum(q.startswith("outside:") for q in plan.block(1, 0, 0.2, "outside")) == 16
    for q in plan.block(1, 0, 0.0, "two"):
        for family in case.FAMILIES:
            a, b = plan.suited(q, family).removeprefix("two:").split("+")
            assert a != b
            assert not {a, b} & set(plan.LONE.get(family, ()))
    families = [plan.family(1, i, list(case.FAMILIES)) for i in range(10)]
    assert all(families.count(f) == 2 for f in case.FAMILIES)


def test_same_seed_same_bytes(written: tuple[pathlib.Path, dict], tmp_path: pathlib.Path) -> None:
    """Every file of a case is repeated bit by bit, and another number gives another case."""
    folder, _ = written
    again = tmp_path / "b0001"
    case.write_case(again, 7, 0, "cantilever", "none:parameters")
    files = sorted(p.relative_to(folder) for p in folder.rglob("*.*") if p.is_file())
    assert len(files) == 7 + 3
    assert all((folder / f).read_bytes() == (again / f).read_bytes() for f in files)
    other = tmp_path / "b0002"
    case.write_case(other, 7, 1, "cantilever", "none:parameters")
    assert (other / "public/high.uff").read_bytes() != (folder / "public/high.uff").read_bytes()


def test_files_are_readable_and_hide_the_answer(written: tuple[pathlib.Path, dict]) -> None:
    """pyuff reads what we wrote; predict recordings hold the force alone; noise is where it should be."""
    pyuff = pytest.importorskip("pyuff")
    folder, told = written
    sets = pyuff.UFF(str(folder / "public/high.uff")).read_sets()
    mine = uff58.read(folder / "public/high.uff")
    assert [(s["rsp_node"], s["rsp_dir"], s["ordinate_spec_data_type"]) for s in sets] == [
        (c.node, c.direction, c.kind) for c in mine
    ]
    assert all(
        np.array_equal(np.asarray(s["data"], np.float32), c.data.astype(np.float32))
        for s, c in zip(sets, mine, strict=True)
    )
    assert abs(1 / sets[0]["abscissa_inc"] / told["rate"] - 1) < 1e-5
    assert [c.kind for c in uff58.read(folder / "public/sweep.uff")] == [uff58.FORCE]
    assert len(uff58.read(folder / "sealed/sweep.uff")) == len(mine)
    assert not (folder / "public/truth.json").exists()
    assert 9.8 < mine[0].data.std() < 10.2
    deck = (folder / "public/model.bdf").read_text()
    assert deck.count("CBAR") == 18
    assert deck.count("CONM2") == 1
    assert "ENDDATA" in deck


def test_one_recording_is_left_to_fit() -> None:
    block = '[[recording]]\nname = "{}"\nrole = "{}"\n\n'
    head = 'title = "c"\n\n'
    study = head + "".join(block.format(*r) for r in (("low", "fit"), ("high", "fit"), ("sweep", "predict")))
    left = head + block.format("high", "fit") + block.format("sweep", "predict")
    assert one_record.kept_alone(study, "high") == left
    with pytest.raises(ValueError, match="no recording 'sweep' with role"):
        one_record.kept_alone(study, "sweep")
