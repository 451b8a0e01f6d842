"""Universal files: the layouts and habits of the field, and one clear message for each kind of damage."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest

from femend.errors import FormatError
from femend.io import read_uff

N = 16
WAVE = np.sin(0.7 * np.arange(N)) + 0.1


def header(
    *,
    func_type: int = 1,
    kind: int = 2,
    n: int = N,
    even: int = 1,
    dx: str = "1.00000e-02",
    node: int = 5,
    direction: int = 3,
    ident: str = "acceleration node 5",
    unit: str = "m/s^2",
) -> str:
    lines = [
        ident,
        "NONE",
        "20-Nov-26 00:00:00",
        "NONE",
        "NONE",
        f"{func_type:5d}{0:10d}{0:5d}{0:10d} {'NONE':10s}{node:10d}{direction:4d} {'NONE':10s}{0:10d}{0:4d}",
        f"{kind:10d}{n:10d}{even:10d}  0.00000e+00{dx:>13s}  0.00000e+00",
        f"{17:10d}{0:5d}{0:5d}{0:5d} {'NONE':20s} {'s':20s}",
        f"{12:10d}{0:5d}{0:5d}{0:5d} {'NONE':20s} {unit:20s}",
        f"{0:10d}{0:5d}{0:5d}{0:5d} {'NONE':20s} {'NONE':20s}",
        f"{0:10d}{0:5d}{0:5d}{0:5d} {'NONE':20s} {'NONE':20s}",
    ]
    return "\n".join(lines) + "\n"


def text_set(body: str, **form: object) -> bytes:
    return ("    -1\n    58\n" + header(**form) + body + "    -1\n").encode()  # type: ignore[arg-type]


def binary_set(samples: bytes, *, order: int = 1, n_bytes: int | None = None, end: str = "\n", **form: object) -> bytes:
    count = len(samples) if n_bytes is None else n_bytes
    start = f"    -1\n    58b{order:6d}{2:6d}{11:12d}{count:12d}{0:6d}{0:6d}{0:12d}{0:12d}\n"
    return (start + header(**form)).encode() + samples + f"{end}    -1\n".encode()  # type: ignore[arg-type]


def columns(values: np.ndarray, form: str, per_line: int) -> str:
    texts = [form % v for v in values]
    return "".join("".join(texts[i : i + per_line]) + "\n" for i in range(0, len(texts), per_line))


@pytest.fixture
def put(tmp_path: Path):  # type: ignore[no-untyped-def]
    def write(data: bytes, name: str = "a.uff") -> Path:
        path = tmp_path / name
        path.write_bytes(data)
        return path

    return write


# ---------------------------------------------------------------- layouts


@pytest.mark.parametrize(
    ("kind", "form", "per_line", "digits"), [(2, "%13.5E", 6, 1e-5), (4, "%20.12E", 4, 1e-12)], ids=["single", "double"]
)
def test_real_even_text(put, kind: int, form: str, per_line: int, digits: float) -> None:  # type: ignore[no-untyped-def]
    (function,) = read_uff(put(text_set(columns(WAVE, form, per_line), kind=kind))).functions
    np.testing.assert_allclose(function.y, WAVE, rtol=digits)
    np.testing.assert_allclose(function.x, 0.01 * np.arange(N), rtol=1e-12)
    assert (function.header.rsp_node, function.header.rsp_dir, function.header.func_type) == (5, 3, 1)


def test_complex_uneven_text(put) -> None:  # type: ignore[no-untyped-def]
    x = np.cumsum(np.linspace(1, 2, N))
    table = np.column_stack([x, WAVE, -WAVE])
    body = "".join(f"{a:13.5E}{b:20.12E}{c:20.12E}\n" for a, b, c in table)
    (function,) = read_uff(put(text_set(body, kind=6, even=0, func_type=4))).functions
    np.testing.assert_allclose(function.x, x, rtol=1e-5)
    np.testing.assert_allclose(function.y, WAVE - 1j * WAVE, rtol=1e-12)


@pytest.mark.parametrize("order", [1, 2], ids=["little", "big"])
@pytest.mark.parametrize(("kind", "dtype"), [(2, "f4"), (4, "f8"), (5, "f4"), (6, "f8")])
@pytest.mark.parametrize("even", [1, 0])
def test_binary(put, order: int, kind: int, dtype: str, even: int) -> None:  # type: ignore[no-untyped-def]
    x = 3.0 + np.cumsum(np.linspace(1, 2, N))
    parts = ([] if even else [x]) + ([WAVE, 2 * WAVE] if kind in (5, 6) else [WAVE])
    samples = np.column_stack(parts).astype(("<" if order == 1 else ">") + dtype).tobytes()
    (function,) = read_uff(put(binary_set(samples, order=order, kind=kind, even=even))).functions
    expected = WAVE + 2j * WAVE if kind in (5, 6) else WAVE
    digits = 1e-6 if dtype == "f4" else 0.0
    np.testing.assert_allclose(function.y, expected, rtol=digits)
    np.testing.assert_allclose(function.x, 0.01 * np.arange(N) if even else x, rtol=digits or 1e-15)


def test_separators_inside_binary_samples_end_nothing(put) -> None:  # type: ignore[no-untyped-def]
    samples = b"\n    -1\n    -1\n    58\n    -1\n\n\n\n\n"
    samples += b"\n" * (-len(samples) % 4)
    values = np.frombuffer(samples, "<f4")
    data = binary_set(samples, n=values.size) + text_set(columns(WAVE, "%13.5E", 6))
    first, second = read_uff(put(data)).functions
    np.testing.assert_array_equal(first.y, values.astype(float))
    assert (first.record, second.record) == (1, 2)


# ---------------------------------------------------------------- habits


def test_exponents_with_d(put) -> None:  # type: ignore[no-untyped-def]
    body = columns(WAVE, "%20.12E", 4).replace("E", "D")
    (function,) = read_uff(put(text_set(body, kind=4, dx="1.00000D-02"))).functions
    np.testing.assert_allclose(function.y, WAVE, rtol=1e-12)
    assert function.header.dx == 0.01


def test_numbers_that_touch_are_cut_at_their_columns(put) -> None:  # type: ignore[no-untyped-def]
    values = -np.abs(WAVE) - 1
    body = columns(values, "%13.6E", 6)
    assert "E+00-" in body
    (function,) = read_uff(put(text_set(body))).functions
    np.testing.assert_allclose(function.y, values, rtol=1e-6)


@pytest.mark.parametrize("end", ["", "\n", "\r\n"])
def test_line_end_after_binary_samples(put, end: str) -> None:  # type: ignore[no-untyped-def]
    data = binary_set(WAVE.astype("<f4").tobytes(), end=end)
    assert len(read_uff(put(data + data)).functions) == 2


def test_windows_line_ends(put) -> None:  # type: ignore[no-untyped-def]
    text = text_set(columns(WAVE, "%13.5E", 6)).replace(b"\n", b"\r\n")
    np.testing.assert_allclose(read_uff(put(text)).functions[0].y, WAVE, rtol=1e-5)


@pytest.mark.parametrize("encoding", ["utf-8", "latin-1"])
def test_header_that_is_not_ascii(put, encoding: str) -> None:  # type: ignore[no-untyped-def]
    data = text_set(columns(WAVE, "%13.5E", 6), ident="Träger ä", unit="m/s²").decode().encode(encoding)
    found = read_uff(put(data)).functions[0].header
    assert (found.ids[0], found.ordinate.unit) == ("Träger ä", "m/s²")


def test_negative_directions_and_large_nodes(put) -> None:  # type: ignore[no-untyped-def]
    found = read_uff(put(text_set(columns(WAVE, "%13.5E", 6), node=1234567890, direction=-6))).functions[0].header
    assert (found.rsp_node, found.rsp_dir) == (1234567890, -6)


@pytest.mark.parametrize("kind", [5, 6])
@pytest.mark.parametrize("even", [1, 0])
def test_known_wrong_byte_count_is_tolerated_with_a_note(put, kind: int, even: int) -> None:  # type: ignore[no-untyped-def]
    """Points times 8, whatever the layout, is what a common writer puts there."""
    parts = ([] if even else [np.arange(N) + 1.0]) + [WAVE, 2 * WAVE]
    samples = np.column_stack(parts).astype("<f8" if kind == 6 else "<f4").tobytes()
    file = read_uff(put(binary_set(samples, kind=kind, even=even, n_bytes=8 * N)))
    np.testing.assert_allclose(file.functions[0].y, WAVE + 2j * WAVE, rtol=1e-6)
    assert any("declares 128 bytes" in note for note in file.notes) == (len(samples) != 8 * N)


def test_unknown_data_sets_are_listed(put) -> None:  # type: ignore[no-untyped-def]
    other = b"    -1\n   151\nsomething\n    -1\n"
    file = read_uff(put(other + text_set(columns(WAVE, "%13.5E", 6)) + other.replace(b"151", b"999")))
    assert file.unknown == ((151, 1), (999, 3))
    assert len(file.functions) == 1


# ---------------------------------------------------------------- geometry and units


def test_nodes_in_any_order_and_units(put) -> None:  # type: ignore[no-untyped-def]
    text = (
        "    -1\n   164\n         9USER_DEFINED               2\n"
        "  1.00000000000000000D+03  1.00000000000000000D+00  1.00000000000000000D+00\n"
        " -2.73150000000000000D+02\n    -1\n"
        "    -1\n    15\n"
        "         7         0         0         8  1.00000e+03 -2.50000e+02  0.00000e+00\n"
        "         3         0         0         8  0.00000e+00  0.00000e+00  5.00000e+02\n    -1\n"
        "    -1\n  2411\n"
        "         2         0         0        11\n"
        "   1.0000000000000000D+02   2.0000000000000000D+02   3.0000000000000000D+02\n    -1\n"
    )
    file = read_uff(put(text.encode()))
    ids, xyz = file.node_table()
    assert ids.tolist() == [7, 3, 2]
    np.testing.assert_allclose(xyz, [[1.0, -0.25, 0.0], [0.0, 0.0, 0.5], [0.1, 0.2, 0.3]], rtol=1e-12)
    assert file.node_unit() == 1e-3
    # the third column of data set 15, as of 2411, is the displacement system
    assert read_uff(
        put(text.replace("3         0         0", "3         0         7").encode())
    ).displacement_systems().tolist() == [0, 7, 0]
    assert read_uff(put(text[text.index("    15") - 7 :].encode())).node_unit() is None


def test_trace_lines_and_elements(put) -> None:  # type: ignore[no-untyped-def]
    text = (
        "    -1\n    82\n         1         5         0\nouter frame\n"
        "         1         2         0         3         4\n    -1\n"
        "    -1\n  2412\n"
        "         1        21         1         1         7         2\n         0         1         1\n"
        "         1         2\n"
        "         2        94         4         6         7         4\n"
        "         1         2         3         4\n    -1\n"
    )
    file = read_uff(put(text.encode()))
    assert (file.lines[0].name, file.lines[0].nodes) == ("outer frame", (1, 2, 0, 3, 4))
    assert [(e.label, e.descriptor, e.physical, e.material, e.nodes) for e in file.elements] == [
        (1, 21, 1, 1, (1, 2)),
        (2, 94, 4, 6, (1, 2, 3, 4)),
    ]


# ---------------------------------------------------------------- damage


def refused(path: Path, *parts: str, record: int | None = 1) -> None:
    with pytest.raises(FormatError) as caught:
        read_uff(path)
    message = str(caught.value)
    assert str(path) in message
    assert caught.value.file == str(path)
    assert caught.value.record == record
    missing = [part for part in parts if part not in message]
    assert not missing, message


def test_truncated_binary_record(put) -> None:  # type: ignore[no-untyped-def]
    whole = binary_set(WAVE.astype("<f4").tobytes())
    refused(put(whole + whole[:-40]), "64 bytes", "truncated", "export", record=2)


def test_truncated_text_record(put) -> None:  # type: ignore[no-untyped-def]
    refused(put(text_set(columns(WAVE[:-1], "%13.5E", 6))), "16 numbers", "15 are there", "truncated")


@pytest.mark.parametrize("n", [8, 13])
def test_more_numbers_than_announced(put, n: int) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(FormatError, match=f"announces {n} numbers .* but 16 are there"):
        read_uff(put(text_set(columns(WAVE, "%13.5E", 6), n=n)))


def test_zeros_that_fill_a_line_are_no_complex_samples(put) -> None:  # type: ignore[no-untyped-def]
    """Two points and two zeros are as many numbers as two complex points."""
    line = np.array([1.5, -2.5, 0.0, 0.0])
    (function,) = read_uff(put(text_set(columns(line, "%20.12E", 4), kind=4, n=2))).functions
    assert function.y.tolist() == [1.5, -2.5]
    for last in ([0.0, 3.0], [3.0, 0.0]):
        with pytest.raises(FormatError, match="as of type 5"):
            read_uff(put(text_set(columns(np.array([1.5, -2.5, *last]), "%20.12E", 4), kind=4, n=2)))


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("dtype", ["f4", "f8"])
def test_wrong_byte_order(put, order: int, dtype: str) -> None:  # type: ignore[no-untyped-def]
    wave = np.random.default_rng(1).standard_normal(64)
    samples = wave.astype((">" if order == 1 else "<") + dtype).tobytes()
    data = binary_set(samples, order=order, kind=2 if dtype == "f4" else 4, n=64)
    refused(put(data), f"byte order {order}", f"to {3 - order}", "endian")


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("said", [4, 5])
def test_types_whose_points_take_as_many_bytes(put, said: int, order: int) -> None:  # type: ignore[no-untyped-def]
    """Complex single read as real double gave numbers, and the other way round."""
    end = "<" if order == 1 else ">"
    x = np.linspace(0.5, 1.5, 4 * N)
    H = 1e-3 / (1 - x**2 + 0.04j * x)
    if said == 4:
        samples = np.column_stack([H.real, H.imag]).astype(f"{end}f4").tobytes()
    else:
        samples = H.real.astype(f"{end}f8").tobytes()
    names = ("real double", "complex single") if said == 4 else ("complex single", "real double")
    told = rf"ordinate data type {said} \({names[0]}\), but .* only as type {9 - said} \({names[1]}\)"
    with pytest.raises(FormatError, match=told):
        read_uff(put(binary_set(samples, order=order, kind=said, n=4 * N, func_type=4)))
    right = binary_set(samples, order=order, kind=9 - said, n=4 * N, func_type=4)
    np.testing.assert_allclose(read_uff(put(right)).functions[0].y, H if said == 4 else H.real, rtol=1e-6)


@pytest.mark.parametrize("kind", [4, 5])
@pytest.mark.parametrize(
    "values",
    [
        np.arange(1.0, 4 * N + 1),  # counts, whose doubles end in zero bytes
        5.0 * (np.arange(4 * N) % 4 == 0),
        np.ones(4 * N),
        10.0 ** np.linspace(-9, 3, 4 * N),
        np.float32(1e-4 * np.sin(np.arange(4 * N))).astype(float),
    ],
    ids=["counts", "pulses", "constant", "decades", "singles"],
)
def test_the_right_type_is_believed_for_odd_values(put, kind: int, values: np.ndarray) -> None:  # type: ignore[no-untyped-def]
    samples = values.astype("<f8") if kind == 4 else np.column_stack([values, np.zeros(4 * N)]).astype("<f4")
    (function,) = read_uff(put(binary_set(samples.tobytes(), kind=kind, n=4 * N))).functions
    np.testing.assert_allclose(function.y, values, rtol=1e-7)


@pytest.mark.parametrize(
    ("binary", "said", "there"),
    [(True, 2, 5), (True, 5, 2), (True, 6, 5), (True, 4, 6), (False, 2, 5), (False, 5, 2), (False, 4, 6)],
)
def test_another_type_is_told_by_the_number_of_values(put, binary: bool, said: int, there: int) -> None:  # type: ignore[no-untyped-def]
    values = np.repeat(WAVE, 2) if there in (5, 6) else WAVE
    if binary:
        data = binary_set(values.astype("<f8" if there in (4, 6) else "<f4").tobytes(), kind=said)
    else:
        data = text_set(columns(values, "%13.5E", 6), kind=said)
    with pytest.raises(FormatError, match=rf"type {said}\W.*(as|those) of (type )?.*{there} \("):
        read_uff(put(data))


def test_right_byte_order_is_believed_for_odd_values(put) -> None:  # type: ignore[no-untyped-def]
    for values in (np.zeros(N), np.full(N, 1e-30), np.full(N, 2.0**-60), np.arange(N) * 1e20):
        (function,) = read_uff(put(binary_set(values.astype("<f8").tobytes(), kind=4))).functions
        np.testing.assert_array_equal(function.y, values)


def test_byte_count_that_fits_nothing(put) -> None:  # type: ignore[no-untyped-def]
    samples = np.zeros(2 * N, "<f4").tobytes()
    refused(put(binary_set(samples, n_bytes=len(samples))), "declares 128 bytes", "take 64")


def test_missing_closing_separator(put) -> None:  # type: ignore[no-untyped-def]
    refused(put(text_set(columns(WAVE, "%13.5E", 6))[: -len("    -1\n")]), "not closed", "-1")


def test_missing_opening_separator(put) -> None:  # type: ignore[no-untyped-def]
    one = text_set(columns(WAVE, "%13.5E", 6))
    refused(put(one + one[len("    -1\n") :]), "'58'", "separator '-1'", "missing")


@pytest.mark.parametrize("data", [b"", b" \n\n"])
def test_empty_file(put, data: bytes) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(FormatError, match=rf"a\.uff is empty \({len(data)} bytes\)"):
        read_uff(put(data))


def test_file_that_is_no_universal_file(put) -> None:  # type: ignore[no-untyped-def]
    refused(put(b"time;force\n0;1\n"), "not a universal file", record=None)


def test_text_among_the_samples(put) -> None:  # type: ignore[no-untyped-def]
    body = columns(WAVE, "%13.5E", 6)
    refused(put(text_set(body[:13] + "*************" + body[26:])), "sample 2 of 16", "'*************'")


@pytest.mark.parametrize(
    ("old", "new", "part"),
    [
        ("         2        16", "         3        16", "ordinate data type 3"),
        ("         2        16", "         2       -16", "negative"),
        ("1.00000e-02", "1.0x000e-02", "abscissa increment"),
        ("    1         0    0", "  one         0    0", "record 6"),
    ],
)
def test_damaged_header(put, old: str, new: str, part: str) -> None:  # type: ignore[no-untyped-def]
    data = text_set(columns(WAVE, "%13.5E", 6))
    assert old.encode() in data
    refused(put(data.replace(old.encode(), new.encode())), part)


@pytest.mark.parametrize(
    ("line", "part"),
    [
        ("    58b     3     2          11          64", "byte order 3"),
        ("    58b     1     1          11          64", "DEC VMS"),
        ("    58b     1", "byte count"),
        ("    55b     1     2          11          64", "data set 55"),
    ],
)
def test_damaged_binary_type_line(put, line: str, part: str) -> None:  # type: ignore[no-untyped-def]
    data = ("    -1\n" + line + "\n" + header()).encode() + struct.pack("<16f", *WAVE) + b"\n    -1\n"
    refused(put(data), part)


@pytest.mark.parametrize(
    ("text", "part"),
    [
        ("    15\n         1         0         0         8  0.0  0.0\n", "6 of 7 fields"),
        ("  2411\n         1         0         0        11\n", "takes two"),
        ("   164\n         1SI                           2\n  1.0D+00\n", "1 of 4 factors"),
        (
            "   164\n         1SI                           2\n  0.0D+00  1.0D+00  1.0D+00\n  0.0D+00\n",
            "must be positive",
        ),
        ("    82\n         1         9         0\nframe\n         1         2\n", "announces 9 nodes"),
        ("  2412\n         1        94         1         1         7         4\n         1         2\n", "lists 2"),
    ],
)
def test_damaged_geometry(put, text: str, part: str) -> None:  # type: ignore[no-untyped-def]
    refused(put(("    -1\n" + text + "    -1\n").encode()), part)
