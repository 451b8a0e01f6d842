"""What is written as OUTPUT4 is read back exactly; however a file is damaged, it is read or refused by FormatError."""

from __future__ import annotations

import tracemalloc
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.typing import NDArray

from femend.errors import FormatError
from femend.io.op4 import Op4Matrix, read_op4, write_op4

TYPES = {1: np.float32, 2: np.float64, 3: np.complex64, 4: np.complex128}
WRITTEN = [(text, layout, order) for text in (True, False) for layout in ("dense", "sparse", "bigmat")
           for order in ("little", "big") if not (text and order == "big")]  # fmt: skip


@st.composite
def matrices(draw: st.DrawFn) -> NDArray[Any]:
    """Matrices with zeros and null columns of every type."""
    dtype = np.dtype(draw(st.sampled_from(list(TYPES.values()))))
    shape = (draw(st.integers(1, 9)), draw(st.integers(0, 7)))
    width = 32 if dtype.name in ("float32", "complex64") else 64
    reals = st.floats(allow_nan=False, allow_infinity=False, width=width)
    size = arrays(np.dtype(f"f{width // 8}"), shape, elements=st.one_of(st.just(0.0), reals))
    real = draw(size)
    return (real + 1j * draw(size) if dtype.kind == "c" else real).astype(dtype)


@pytest.mark.parametrize(("text", "layout", "order"), WRITTEN)
@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.lists(matrices(), min_size=1, max_size=3))
def test_what_is_written_is_read(
    tmp_path: Path, text: bool, layout: Any, order: Any, given_: list[NDArray[Any]]
) -> None:
    path = tmp_path / "m.op4"
    named = {f"M{i}": a for i, a in enumerate(given_)}
    write_op4(path, named, text=text, layout=layout, byte_order=order)
    found = read_op4(path)
    assert [m.name for m in found] == list(named)
    for m, a in zip(found, given_, strict=True):
        assert (m.shape, TYPES[m.type]) == (a.shape, a.dtype)
        np.testing.assert_array_equal(m.toarray(), a)
    write_op4(path, found, text=text, layout=layout, byte_order=order)  # and as it was read
    for m, a in zip(read_op4(path), given_, strict=True):
        np.testing.assert_array_equal(m.toarray(), a)


def whole(folder: Path, text: bool, layout: Any) -> bytes:
    rng = np.random.default_rng(3)
    K = np.where(rng.random((6, 6)) < 0.5, rng.standard_normal((6, 6)), 0.0)
    path = folder / "whole.op4"
    write_op4(path, {"KXX": K + K.T, "PHI": rng.standard_normal((4, 2)) * 1j}, text=text, layout=layout)
    return path.read_bytes()


def refusal(path: Path, data: bytes) -> FormatError | tuple[Op4Matrix, ...]:
    """The error that reading `data` ends with, or what is read. Any other exception fails the test."""
    path.write_bytes(data)
    try:
        return read_op4(path)
    except FormatError as error:
        refused = error
    assert refused.file == str(path)
    assert str(path) in str(refused)
    return refused


@pytest.mark.parametrize("text", [True, False])
@pytest.mark.parametrize("layout", ["dense", "sparse", "bigmat"])
def test_cut_off_anywhere(tmp_path: Path, text: bool, layout: str) -> None:
    data = whole(tmp_path, text, layout)
    full = refusal(tmp_path / "cut.op4", data)
    assert isinstance(full, tuple)
    assert len(full) == 2
    found = [refusal(tmp_path / "cut.op4", data[:n]) for n in range(0, len(data), 5)]
    read = [f for f in found if isinstance(f, tuple)]
    # between two matrices, and within the last line of an ASCII file, a cut leaves whole matrices
    assert len(read) <= (20 if text else 1)


@pytest.mark.parametrize("text", [True, False])
@pytest.mark.parametrize("layout", ["dense", "sparse", "bigmat"])
@settings(max_examples=80, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.data())
def test_bytes_that_were_overwritten(tmp_path: Path, text: bool, layout: str, data: st.DataObject) -> None:
    damaged = bytearray(whole(tmp_path, text, layout))
    for _ in range(data.draw(st.integers(1, 4))):
        damaged[data.draw(st.integers(0, len(damaged) - 1))] = data.draw(st.integers(0, 255))
    refusal(tmp_path / "damaged.op4", bytes(damaged))


@settings(max_examples=80, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.binary(max_size=200))
def test_anything_at_all(tmp_path: Path, content: bytes) -> None:
    refusal(tmp_path / "any.op4", content)
    refusal(tmp_path / "any.op4", b"\x18\x00\x00\x00" + content)
    refusal(tmp_path / "any.op4", b"       3       3       6       2K       1P,5E16.9\n" + content)


@pytest.mark.parametrize("numbers", [(2**31 - 1, 2**31 - 1), (2**31 - 1, 4), (4, -(2**31) + 1), (10**6, 10**6)])
def test_claimed_sizes_take_no_memory(tmp_path: Path, numbers: tuple[int, int]) -> None:
    n_cols, n_rows = numbers
    head = np.array([24, n_cols, n_rows, 2, 2], dtype="<i4").tobytes() + b"K       " + np.int32(24).tobytes()
    column = np.array([20, 1, 1, 2, 0, 0, 20], dtype="<i4").tobytes()
    end = np.array([20, min(n_cols + 1, 2**31 - 1), 1, 2, 0, 0, 20], dtype="<i4").tobytes()
    tracemalloc.start()
    refusal(tmp_path / "huge.op4", head + column + end)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 100e6
