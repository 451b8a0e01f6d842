"""The universal files of others, read as pyuff reads them; and ours, read by pyuff."""

from __future__ import annotations

import contextlib
import io
import warnings
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from femend import functions_of, read_recording, read_uff, write_uff
from femend.errors import FormatError

# Cut off by its publisher after 42 of 2,508,876 samples; pyuff returns what is there, femend says that it is cut off.
CUT_OFF = "dataset_milestone_in_header.uff"
KNOWN = {58, 15, 82, 164, 2411, 2412}


@pytest.fixture(scope="module")
def pyuff(optional_module: Callable[[str], ModuleType]) -> ModuleType:
    return optional_module("pyuff")


def sets_of(pyuff: ModuleType, path: Path) -> list[dict[str, Any]]:
    with contextlib.redirect_stdout(io.StringIO()), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        file = pyuff.UFF(str(path))
        wanted = [i for i, number in enumerate(file.get_set_types()) if int(number) in KNOWN]
        found = [file.read_sets(i) for i in wanted]
    return [s[0] if isinstance(s, list) else s for s in found]


def compare_functions(path: Path, sets: list[dict[str, Any]]) -> int:
    theirs = [s for s in sets if s["type"] == 58]
    ours = read_uff(path).functions
    assert len(ours) == len(theirs)
    for a, b in zip(ours, theirs):
        np.testing.assert_array_equal(a.y, b["data"])
        np.testing.assert_allclose(a.x, b["x"], rtol=1e-13, atol=1e-15)
        h = a.header
        assert (h.func_type, h.rsp_node, h.rsp_dir) == (b["func_type"], b["rsp_node"], b["rsp_dir"])
        assert (h.ref_node, h.ref_dir) == (b["ref_node"], b["ref_dir"])
        assert (h.ordinate.type, h.abscissa.type) == (b["ordinate_spec_data_type"], b["abscissa_spec_data_type"])
        assert h.ids[0].strip() == b["id1"].strip() or not b["id1"].isascii()
    return len(ours)


def compare_geometry(path: Path, sets: list[dict[str, Any]]) -> int:
    file = read_uff(path)
    theirs = [s for s in sets if s["type"] in (15, 2411)]
    assert len(file.nodes) == len(theirs)
    for block, b in zip(file.nodes, theirs):
        names = "node_nums" if "node_nums" in b else "grid_global"
        np.testing.assert_array_equal(block.ids, np.asarray(b[names], dtype=int))
        np.testing.assert_allclose(block.xyz, np.column_stack([b["x"], b["y"], b["z"]]), rtol=1e-12)
    traces = [s for s in sets if s["type"] == 82]
    assert [line.nodes for line in file.lines] == [tuple(int(n) for n in s["nodes"][: s["n_nodes"]]) for s in traces]
    units = [s for s in sets if s["type"] == 164]
    assert [(u.length, u.force) for u in file.units] == [(s["length"], s["force"]) for s in units]
    return len(theirs)


def test_sample_files(pyuff: ModuleType, shared: Callable[[str], Path]) -> None:
    folder = shared("data/formats/uff")
    functions = nodes = 0
    for path in sorted(folder.glob("*.uff")):
        if path.name == CUT_OFF:
            with pytest.raises(FormatError, match=r"2508876 numbers .* but 42 are there"):
                read_uff(path)
            continue
        sets = sets_of(pyuff, path)
        functions += compare_functions(path, sets)
        nodes += compare_geometry(path, sets)
    assert (functions, nodes) == (6, 8)


def test_recordings_of_the_cases(pyuff: ModuleType, shared: Callable[[str], Path]) -> None:
    paths = sorted(shared("cases").glob("*/public/*.uff"))
    assert paths
    for path in paths:
        assert compare_functions(path, sets_of(pyuff, path)) > 0
        notes = read_uff(path).notes
        assert notes == ()


@pytest.mark.parametrize("binary", [True, False])
@pytest.mark.parametrize("name", ["c01/public/high.uff", "rig/public/ema_hammer.uff"])
def test_pyuff_reads_what_we_write(
    pyuff: ModuleType, shared: Callable[[str], Path], tmp_path: Path, name: str, binary: bool
) -> None:
    recording = read_recording(shared(f"cases/{name}"))
    data = recording.time if recording.is_time else recording.frf
    write_uff(tmp_path / "ours.uff", functions_of(data), binary=binary)
    compare_functions(tmp_path / "ours.uff", sets_of(pyuff, tmp_path / "ours.uff"))


def test_files_written_by_pyuff(pyuff: ModuleType, tmp_path: Path) -> None:
    """Its binary byte count ignores complex and uneven data: tolerated where the samples are all there."""
    rng = np.random.default_rng(2)
    n = 33
    for is_complex in (False, True):
        for even in (0, 1):
            for binary in (0, 1):
                path = tmp_path / f"{is_complex}{even}{binary}.uff"
                y = rng.standard_normal(n) + (1j * rng.standard_normal(n) if is_complex else 0)
                x = 0.5 * np.arange(n) if even else np.cumsum(rng.uniform(0.5, 1.5, n))
                content = pyuff.prepare_58(
                    binary=binary, func_type=4 if is_complex else 1, rsp_node=3, rsp_dir=-2, ref_node=1, ref_dir=1,
                    data=y, x=x, id1="id", abscissa_spacing=even, abscissa_min=0.0, abscissa_inc=0.5,
                    ord_data_type=6 if is_complex else 4, num_pts=n, ordinate_spec_data_type=12,
                    abscissa_spec_data_type=18, orddenom_spec_data_type=13, load_case_id=0, ver_num=0, z_axis_value=0.0,
                    rsp_ent_name="NONE", ref_ent_name="NONE", id2="NONE", id3="NONE", id4="NONE", id5="NONE",
                )  # fmt: skip
                pyuff.UFF(str(path)).write_sets(content, mode="add")
                (function,) = read_uff(path).functions
                np.testing.assert_allclose(function.y, y, rtol=1e-11)
                np.testing.assert_allclose(function.x, x, rtol=1e-4, atol=1e-4)
