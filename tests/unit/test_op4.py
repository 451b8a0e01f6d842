"""OUTPUT4 files of Nastran and of pyYeti: read as their companions read them; what is wrong is said with its place."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import loadmat

from femend.errors import FormatError
from femend.io.op4 import Op4Matrix, read_op4, write_op4

FORMATS = "data/formats/nastran"


def test_every_file_of_the_collection_is_read(shared: Callable[[str], Path]) -> None:
    files = sorted(shared(FORMATS).rglob("*.op4"))
    assert len(files) >= 14
    for file in files:
        found = read_op4(file)
        assert found, file
        assert all(isinstance(m, Op4Matrix) for m in found)


@pytest.mark.parametrize(
    ("name", "tolerance"),
    [  # relative: the digits of the ASCII files, nothing for the binary ones
        ("double_dense_le", 0.0),
        ("double_dense_be", 0.0),
        ("double_bigmat_le", 0.0),
        ("r_c_rc", 0.0),
        ("double_nonbigmat_ascii", 1e-14),
        ("double_bigmat_ascii", 1e-9),
        ("double_dense_ascii", 1e-9),
        ("single_dense_ascii", 2e-7),
    ],
)
def test_real_and_complex_matrices_of_every_layout(shared: Callable[[str], Path], name: str, tolerance: float) -> None:
    folder = shared(f"{FORMATS}/pyyeti/op4")
    truth = loadmat(folder / "r_c_rc.mat")
    found = read_op4(folder / f"{name}.op4")
    assert [m.name.removesuffix("S") for m in found] == ["RMAT", "CMAT", "RCMAT"]
    for m in found:
        expected = truth[m.name.removesuffix("S").lower()]
        assert np.abs(m.toarray() - expected).max() <= tolerance * np.abs(expected).max()
        assert m.type == (3 if m.name[0] in "CR" and np.iscomplexobj(expected) else 1) + (name[0] != "s")


def test_one_stiffness_in_both_kinds_of_file(shared: Callable[[str], Path]) -> None:
    (binary,) = read_op4(shared(f"{FORMATS}/pynastran/op4/testplate_kgg.op4"))
    (text,) = read_op4(shared(f"{FORMATS}/pynastran/op4/testplate_kgg_ascii.op4"))
    assert binary.form == text.form == 6
    assert binary.shape == (726, 726)
    assert abs(binary.data - text.data).max() < 1e-9 * abs(binary.data).max()  # ten digits in the ASCII file
    assert (binary.data != binary.data.T).nnz == 0


def test_matrices_are_found_by_name(shared: Callable[[str], Path]) -> None:
    file = shared(f"{FORMATS}/pyyeti/nas2cam_extseout/inboard.op4")
    (M,) = read_op4(file, ["mxx"])
    assert (M.name, M.shape, M.type) == ("MXX", (32, 32), 2)
    with pytest.raises(FormatError, match="no matrix KAA in the file; it holds KXX, MXX"):
        read_op4(file, ["KAA"])


def words(*records: bytes) -> bytes:
    return b"".join(np.int32(len(r)).tobytes() + r + np.int32(len(r)).tobytes() for r in records)


def test_words_of_eight_bytes(tmp_path: Path) -> None:
    """64-bit Nastran: integers and reals of 8 bytes, the lengths of the records of 4."""
    head = np.array([2, -3, 2, 1], dtype="<i8").tobytes() + b"KAA             "
    column = np.array([2, 0, 4, 3, 2], dtype="<i8").tobytes() + np.array([0.1, 0.2]).tobytes()
    end = np.array([3, 1, 1], dtype="<i8").tobytes() + np.ones(1).tobytes()
    path = tmp_path / "wide.op4"
    path.write_bytes(words(head, column, end))
    (m,) = read_op4(path)
    assert (m.name, m.type) == ("KAA", 2)
    np.testing.assert_array_equal(m.toarray(), [[0, 0], [0, 0.1], [0, 0.2]])


def test_what_ascii_writers_differ_in(tmp_path: Path) -> None:
    """Words instead of numbers in a dense column, no E before three digits, D for double, an identity without terms."""
    path = tmp_path / "m.op4"
    path.write_text(
        "       2       2       2       2K       1P,3E23.16\n       1       1       4\n"
        " 1.0000000000000000-101 2.5000000000000000D+00\n       3       1       1\n 1.0000000000000000E+00\n"
        "\n       3       3       8       2EYE     1P,3E23.16\n       4       1       1\n 1.0000000000000000E+00\n"
    )
    K, eye = read_op4(path)
    np.testing.assert_array_equal(K.toarray(), [[1e-101, 0], [2.5, 0]])
    np.testing.assert_array_equal(eye.toarray(), np.eye(3))


def test_long_strings_are_cut_for_the_packed_header(tmp_path: Path) -> None:
    a = np.arange(1.0, 40001.0)[:, None]
    path = tmp_path / "long.op4"
    write_op4(path, {"A": a})
    np.testing.assert_array_equal(read_op4(path)[0].toarray(), a)
    tall = np.ones((70000, 1))
    with pytest.raises(FormatError, match="70000 rows; more than 65535 need layout='bigmat'"):
        write_op4(path, {"A": tall})
    write_op4(path, {"A": tall}, layout="bigmat")
    np.testing.assert_array_equal(read_op4(path)[0].toarray(), tall)


@pytest.mark.parametrize(
    ("matrices", "word"),
    [
        ({"TOOLONGNAME": np.eye(2)}, "no matrix name"),
        ({"K": np.array([[np.nan]])}, "not finite"),
        ({"K": np.ones(3)}, r"shape \(3,\)"),
        ({"K": np.array([["a"]])}, "real or complex"),
        ({}, "no matrix to write"),
    ],
)
def test_what_cannot_be_written_leaves_the_old_file(tmp_path: Path, matrices: Any, word: str) -> None:
    path = tmp_path / "k.op4"
    path.write_bytes(b"old")
    with pytest.raises(FormatError, match=word):
        write_op4(path, matrices)
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]


def test_the_form_follows_the_values(tmp_path: Path) -> None:
    path = tmp_path / "f.op4"
    write_op4(path, {"S": np.eye(2), "Q": np.array([[1.0, 2], [3, 4]]), "R": np.ones((2, 3), dtype=int)})
    assert [m.form for m in read_op4(path)] == [6, 1, 2]


HEAD = "       3       3       6       2KXX     1P,3E23.16\n"


@pytest.mark.parametrize(
    ("text", "words_"),
    [
        ("", ["empty"]),
        ("GRID,1\n", ["line 1", "no header"]),
        (HEAD, ["matrix KXX", "ends within"]),
        (HEAD + "       1       2       3\n 1.0000000000000000E+00\n", ["line 3", "1 numbers", "says 3"]),
        (HEAD + "       1       3       2\n 1.0000000000000000E+00 1.0000000000000000E+00\n", ["rows 3 to 4"]),
        (HEAD + "       1       1       1\n                    NaN.\n", ["line 2", "0 numbers"]),
        (HEAD + "       2       1       1\n 1.0000000000000000E+00\n       1       1       1\n", ["column 1 after"]),
        (HEAD.replace("1P,3E23.16", "        "), ["names no format"]),
        (HEAD.replace("       2K", "       9K"), ["type 9"]),
    ],
)
def test_faults_are_told_with_file_matrix_and_line(tmp_path: Path, text: str, words_: list[str]) -> None:
    path = tmp_path / "bad.op4"
    path.write_text(text)
    with pytest.raises(FormatError) as error:
        read_op4(path)
    assert error.value.file == str(path)
    assert all(word in str(error.value) for word in [str(path), "write it anew", *words_])


def test_faults_of_binary_files_are_told_with_the_byte(tmp_path: Path) -> None:
    path = tmp_path / "k.op4"
    write_op4(path, {"KXX": np.eye(3)})
    data = path.read_bytes()
    path.write_bytes(data[:-30])
    with pytest.raises(
        FormatError, match=r"matrix KXX, byte \d+ \(record 4\): a record of 24 bytes where 22 are left"
    ) as error:
        read_op4(path)
    assert error.value.record == 4
    path.write_bytes(data[:40] + b"\x09" + data[41:])
    with pytest.raises(FormatError, match="matrix KXX"):
        read_op4(path)


def test_inspect_lists_the_matrices(tmp_path: Path) -> None:
    from click.testing import CliRunner

    from femend.cli import main

    path = tmp_path / "se.op4"
    write_op4(path, {"KXX": np.eye(3), "PHI": np.ones((3, 2), dtype=np.complex64)})
    shown = CliRunner().invoke(main, ["inspect", str(path)])
    assert shown.exit_code == 0
    assert "OUTPUT4, 2 matrices" in shown.output
    assert shown.output.splitlines()[-1].split() == ["PHI", "3", "2", "rectangular", "complex", "single", "6"]
