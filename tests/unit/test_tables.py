"""Tables of columns: CSV and its dialects, MAT, HDF5, WAV, TDMS, mapped to channels."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from femend import ChannelMap, TimeData, read_recording
from femend.errors import FormatError, RecordingError, UnitError
from femend.io.tables import read_table

N = 20
T = 0.01 * np.arange(N)
FORCE, TOP = np.cos(T), np.sin(3 * T) + 0.1
MAP = (ChannelMap("force", 1, "+Z", "force", "N"), ChannelMap("top", 12, "-X", "acceleration", "g"))
FRF_MAP = (ChannelMap("top", 12, "-X", "acceleration", "m/s^2/N"), ChannelMap(None, 1, "+Z", "force", "N"))


def rows(separator: str, *columns: np.ndarray, comma: bool = False, form: str = "{:.9g}") -> str:
    lines = [separator.join(form.format(v) for v in row) for row in zip(*columns)]
    text = "\n".join(lines) + "\n"
    return text.replace(".", ",") if comma else text


def check(data: TimeData) -> None:
    assert data.dt == pytest.approx(0.01, rel=1e-7)
    np.testing.assert_allclose(data.values, [FORCE, 9.80665 * TOP], rtol=1e-8)
    assert [str(c.dof) for c in data.channels] == ["1:+Z", "12:-X"]
    assert [c.unit for c in data.channels] == ["N", "m/s^2"]


@pytest.fixture
def put(tmp_path: Path) -> Callable[..., Path]:
    def write(text: str, name: str = "run.csv", encoding: str = "utf-8") -> Path:
        path = tmp_path / name
        path.write_bytes(text.encode(encoding))
        return path

    return write


# ---------------------------------------------------------------- dialects of text


@pytest.mark.parametrize(
    ("separator", "comma"),
    [(";", False), (";", True), (",", False), ("\t", False), ("\t", True), ("  ", False), (" ", True), ("; ", True)],
)
def test_separators_and_decimal_comma(put: Callable[..., Path], separator: str, comma: bool) -> None:
    names = separator.join(["time", "force", "top"])
    check(read_recording(put(names + "\n" + rows(separator, T, FORCE, TOP, comma=comma)), MAP).time)


@pytest.mark.parametrize(
    "head",
    [
        "time;force;top\ns;N;g\n",
        "Messung 12\nKanäle: 3\n\ntime;force;top\n",
        '"time";"force";"top"\n',
        "# made by a logger\n# time;force;top\n",
        "\ufefftime;force;top\r\n",
    ],
    ids=["units", "title", "quotes", "comments", "byte-order mark"],
)
def test_header_lines(put: Callable[..., Path], head: str) -> None:
    check(read_recording(put(head + rows(";", T, FORCE, TOP)), MAP).time)


def test_encoding_of_the_header(put: Callable[..., Path]) -> None:
    path = put("time;Träger;top\n" + rows(";", T, FORCE, TOP), encoding="latin-1")
    check(read_recording(path, (ChannelMap("Träger", 1, "+Z", "force", "N"), MAP[1])).time)


def test_columns_by_number_without_header(put: Callable[..., Path]) -> None:
    maps = (ChannelMap(1, 1, "+Z", "force", "N"), ChannelMap(2, 12, "-X", "acceleration", "g"))
    recording = read_recording(put(rows("\t", T, FORCE, TOP), "run.txt"), maps)
    check(recording.time)
    assert any("increases evenly" in note for note in recording.notes)


def test_scale_and_quotients_of_units(put: Callable[..., Path]) -> None:
    maps = (ChannelMap("force", 1, "+Z", "force", "V", 25.0), MAP[1])
    path = put("time;force;top\n" + rows(";", T, FORCE, TOP))
    with pytest.raises(UnitError, match="channel 'force': unit 'V' does not measure force"):
        read_recording(path, maps)
    data = read_recording(path, (ChannelMap("force", 1, "+Z", "force", "kN", 0.25), MAP[1])).time
    np.testing.assert_allclose(data.values[0], 250 * FORCE, rtol=1e-8)


# ---------------------------------------------------------------- the time axis


@pytest.mark.parametrize(("name", "factor"), [("t", 1.0), ("Time (s)", 1.0), ("time [ms]", 1e3), ("Zeit", 1.0)])
def test_names_of_time(put: Callable[..., Path], name: str, factor: float) -> None:
    check(read_recording(put(f"count;{name};force;top\n" + rows(";", np.arange(N), factor * T, FORCE, TOP)), MAP).time)


@pytest.mark.parametrize("head", ["dt;0.01\n", "Sample Rate: 100\n", "fs = 100\n"])
def test_step_in_the_header(put: Callable[..., Path], head: str) -> None:
    check(read_recording(put(head + "force;top\n" + rows(";", FORCE, TOP)), MAP).time)


def test_rate_in_a_column(put: Callable[..., Path]) -> None:
    body = rows(",", FORCE, TOP).splitlines()
    text = "\n".join(["force,top,Fs", body[0] + ",100", *(line + "," for line in body[1:])])
    check(read_recording(put(text), MAP).time)


def test_a_counter_is_no_time(put: Callable[..., Path]) -> None:
    path = put("sample;force;top\n" + rows(";", np.arange(N), FORCE, TOP))
    with pytest.raises(RecordingError, match=r"has no time axis: no column is called time or t.*add a time column"):
        read_recording(path, MAP)


def test_uneven_time(put: Callable[..., Path]) -> None:
    uneven = T.copy()
    uneven[8:] += 0.004
    with pytest.raises(RecordingError, match=r"'time' is not even: its step is 0.014 s after row 7"):
        read_recording(put("time;force;top\n" + rows(";", uneven, FORCE, TOP)), MAP)


# ---------------------------------------------------------------- FRFs


H = (FORCE + 1j * TOP)[1:]
F = np.linspace(0.5, 60.0, N - 1)


def as_complex(values: np.ndarray, unit: str = "j") -> list[str]:
    return [f"{v.real:.9g}{v.imag:+.9g}{unit}" for v in values]


@pytest.mark.parametrize("unit", ["j", "i"])
def test_complex_columns_are_frfs(put: Callable[..., Path], unit: str) -> None:
    text = "freq;top\n" + "\n".join(f"{f:.9g};{h}" for f, h in zip(F, as_complex(H, unit)))
    frf = read_recording(put(text), FRF_MAP).frf
    np.testing.assert_allclose(frf.H[:, 0, 0], H, rtol=1e-8)
    np.testing.assert_allclose(frf.freq, F, rtol=1e-8)
    assert (frf.kind, str(frf.outputs[0].dof), str(frf.inputs[0].dof)) == ("accelerance", "12:-X", "1:+Z")


@pytest.mark.parametrize(
    ("names", "columns"),
    [
        (("top_re", "top_im"), (H.real, H.imag)),
        (("real(top)", "imag(top)"), (H.real, H.imag)),
        (("top mag", "top phase"), (np.abs(H), np.degrees(np.angle(H)))),
        (("top magnitude [dB]", "top phase [rad]"), (20 * np.log10(np.abs(H)), np.angle(H))),
    ],
)
def test_pairs_of_columns_are_frfs(
    put: Callable[..., Path], names: tuple[str, ...], columns: tuple[np.ndarray]
) -> None:
    text = ";".join(("Frequency (Hz)", *names)) + "\n" + rows(";", F, *columns, form="{:.12g}")
    np.testing.assert_allclose(read_recording(put(text), FRF_MAP).frf.H[:, 0, 0], H, rtol=1e-9)


def test_force_column_divides(put: Callable[..., Path]) -> None:
    force = 2.0 + 0.5j
    text = "f;top;ref\n" + "\n".join(f"{f};{h};{force.real}+{force.imag}j" for f, h in zip(F, as_complex(H * force)))
    maps = (
        ChannelMap("top", 12, "-X", "acceleration", "g"),
        ChannelMap("ref", 1, "+Z", "force", "kN"),
    )
    frf = read_recording(put(text), maps).frf
    np.testing.assert_allclose(frf.H[:, 0, 0], 9.80665e-3 * H, rtol=1e-7)


@pytest.mark.parametrize(
    ("maps", "part"),
    [
        (FRF_MAP[:1], "there are 0 forces and 1 responses"),
        ((FRF_MAP[0], FRF_MAP[1], FRF_MAP[1]), "there are 2 forces"),
        ((FRF_MAP[0], ChannelMap("top2", 13, "X", "velocity", "m/s"), FRF_MAP[1]), "not accelerance and mobility"),
    ],
)
def test_frf_tables_need_one_force_and_one_kind(
    put: Callable[..., Path], maps: tuple[ChannelMap, ...], part: str
) -> None:
    lines = [f"{f:.9g};{h};{h}" for f, h in zip(F, as_complex(H))]
    with pytest.raises(RecordingError, match=part):
        read_recording(put("freq;top;top2\n" + "\n".join(lines)), maps)


def test_real_column_is_no_frf(put: Callable[..., Path]) -> None:
    with pytest.raises(RecordingError, match="column 'top' of an FRF is real"):
        read_recording(put("freq;top\n" + rows(";", F, H.real)), FRF_MAP)


def test_three_storey_frame(shared: Callable[[str], Path]) -> None:
    path = shared("data/three_storey/Experimental_drive_floor1.csv")
    maps = [ChannelMap(i, i, "+X", "acceleration", "m/s^2/N") for i in (1, 2, 3)]
    frf = read_recording(path, [*maps, ChannelMap(None, 1, "+X", "force", "N")]).frf
    assert frf.H.shape == (4096, 3, 1)
    assert (frf.freq[0], frf.freq[-1]) == (1 / 32, 128.0)
    assert frf.H[1, 0, 0] == -0.0721427574753761 - 0.0235904511064291j


# ---------------------------------------------------------------- other formats


def test_mat_v5(tmp_path: Path) -> None:
    from scipy.io import savemat

    savemat(tmp_path / "run.mat", {"force": FORCE, "s": {"top": TOP[:, None]}, "fs": 100.0, "note": "hello"})
    check(read_recording(tmp_path / "run.mat", (MAP[0], ChannelMap("s.top", 12, "-X", "acceleration", "g"))).time)
    savemat(tmp_path / "both.mat", {"data": np.column_stack([T, FORCE, TOP])})
    maps = (ChannelMap("data[1]", 1, "+Z", "force", "N"), ChannelMap(2, 12, "-X", "acceleration", "g"))
    check(read_recording(tmp_path / "both.mat", maps).time)


@pytest.mark.parametrize("name", ["run.mat", "run.h5"])
def test_hdf5_and_mat_v73(tmp_path: Path, name: str) -> None:
    import h5py

    with h5py.File(tmp_path / name, "w", userblock_size=512) as file:
        file["force"] = FORCE[None, :]
        file["deep/top"] = TOP
        file.attrs["dt"] = 0.01
    check(read_recording(tmp_path / name, (MAP[0], ChannelMap("deep/top", 12, "-X", "acceleration", "g"))).time)
    with h5py.File(tmp_path / "frf.h5", "w") as file:
        file["freq"] = F
        pairs = np.zeros(F.size, dtype=[("real", "f8"), ("imag", "f8")])
        pairs["real"], pairs["imag"] = H.real, H.imag
        file["top"] = pairs
    np.testing.assert_array_equal(read_recording(tmp_path / "frf.h5", FRF_MAP).frf.H[:, 0, 0], H)


@pytest.mark.parametrize(("dtype", "full"), [("int16", 2**15), ("int32", 2**31), ("float32", 1.0), ("uint8", 2**7)])
def test_wav(tmp_path: Path, dtype: str, full: float) -> None:
    from scipy.io import wavfile

    wave = np.column_stack([0.5 * FORCE, TOP / 4])
    samples = wave * full + (128 if dtype == "uint8" else 0)
    wavfile.write(tmp_path / "run.wav", 51200, np.round(samples).astype(dtype) if full > 1 else samples.astype(dtype))
    maps = (ChannelMap(0, 1, "+Z", "force", "N", 2.0), ChannelMap("1", 12, "-X", "acceleration", "g", 4.0))
    data = read_recording(tmp_path / "run.wav", maps).time
    assert data.dt == 1 / 51200
    np.testing.assert_allclose(data.values[0], FORCE, atol=2.0 / min(full, 2**20))


def test_tdms(tmp_path: Path, optional_module: Callable[[str], object]) -> None:
    nptdms = optional_module("nptdms")
    channels = [
        nptdms.ChannelObject("run", name, values, properties={"wf_increment": 0.01})  # type: ignore[attr-defined]
        for name, values in (("force", FORCE), ("top", TOP))
    ]
    with nptdms.TdmsWriter(tmp_path / "run.tdms") as writer:  # type: ignore[attr-defined]
        writer.write_segment(channels)
    maps = (ChannelMap("run/force", 1, "+Z", "force", "N"), ChannelMap("run/top", 12, "-X", "acceleration", "g"))
    check(read_recording(tmp_path / "run.tdms", maps).time)


def test_tdms_without_its_package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "run.tdms").write_bytes(b"TDSm")
    monkeypatch.setitem(sys.modules, "nptdms", None)
    with pytest.raises(FormatError, match="needs the optional package npTDMS; install it"):
        read_recording(tmp_path / "run.tdms", MAP)


# ---------------------------------------------------------------- what is wrong with a file


def test_text_among_numbers_and_cut_lines(put: Callable[..., Path]) -> None:
    lines = ("time;force;top\n" + rows(";", T, FORCE, TOP)).splitlines()
    broken = [*lines[:9], "0.08;over;0.3", *lines[10:]]
    with pytest.raises(FormatError, match=r"run\.csv:10: field 1 reads 'over', which is not a number") as caught:
        read_recording(put("\n".join(broken)), MAP)
    assert caught.value.record == 10
    with pytest.raises(FormatError, match=r"run\.csv:21: the line has 1 fields where the table has 3"):
        read_recording(put("\n".join([*lines[:20], "0.2"])), MAP)
    with pytest.raises(FormatError, match="no line of the file is a row of numbers"):
        read_recording(put("hello\nworld\n"), MAP)


@pytest.mark.parametrize("gap", ["", "NaN", "#N/A"])
def test_gaps_are_told_with_channel_and_time(put: Callable[..., Path], gap: str) -> None:
    lines = ("time;force;top\n" + rows(";", T, FORCE, TOP)).splitlines()
    lines[6] = f"0.05;0.9;{gap}"
    with pytest.raises(RecordingError, match=r"acceleration 12:-X \(top\) is nan at 0.05 s"):
        read_recording(put("\n".join(lines)), MAP)


def test_dead_channel(put: Callable[..., Path]) -> None:
    with pytest.raises(RecordingError, match=r"acceleration 12:-X \(top\) is 0 in all 20 samples"):
        read_recording(put("time;force;top\n" + rows(";", T, FORCE, 0 * TOP)), MAP)


def test_unequal_lengths(tmp_path: Path) -> None:
    from scipy.io import savemat

    savemat(tmp_path / "run.mat", {"force": FORCE, "top": TOP[:15], "fs": 100.0})
    with pytest.raises(RecordingError, match=r"unequal lengths \('force' 20, 'top' 15\)"):
        read_recording(tmp_path / "run.mat", MAP)


def test_columns_that_are_not_there(put: Callable[..., Path]) -> None:
    path = put("time;force;top\n" + rows(";", T, FORCE, TOP))
    with pytest.raises(RecordingError, match="no column is named 'bottom'; the columns are 'time', 'force', 'top'"):
        read_recording(path, (ChannelMap("bottom", 1, "X", "force", "N"),))
    with pytest.raises(RecordingError, match="column 3 is asked for but there are 3, counted from 0"):
        read_recording(path, (ChannelMap(3, 1, "X", "force", "N"),))
    with pytest.raises(RecordingError, match=r"map them with \[\[recording.channel\]\].*'time', 'force', 'top'"):
        read_recording(path)


@pytest.mark.parametrize("name", ["run.mat", "run.h5", "run.wav"])
def test_damaged_files(put: Callable[..., Path], name: str) -> None:
    with pytest.raises(FormatError, match=rf"{name}: is no .* file that can be read"):
        read_recording(put("this is not it, and long enough to be looked at" * 20, name), MAP)


def test_a_table_says_what_it_passes_over(tmp_path: Path) -> None:
    from scipy.io import savemat

    savemat(tmp_path / "a.mat", {"cube": np.ones((2, 3, 4)), "x": TOP})
    table = read_table(tmp_path / "a.mat")
    assert table.names == ("x",)
    assert "cube of shape (2, 3, 4) passed over" in table.notes[0]


def test_separator_at_the_end_of_every_line(put: Callable[..., Path]) -> None:
    body = rows(";", T, FORCE, TOP).replace("\n", ";\n")
    check(read_recording(put("time;force;top;\n" + body), MAP).time)


# ---------------------------------------------------------------- mistakes that would go through in silence


def test_a_column_mapped_twice_is_refused(put: Callable[..., Path]) -> None:
    path = put("time,force,top\n" + rows(",", T, FORCE, TOP))
    twice = (*MAP, ChannelMap("top", 7, "+Z", "acceleration", "g"))
    said = r"column 2 \('top'\) is mapped twice, as acceleration 12:-X and acceleration 7:\+Z"
    with pytest.raises(RecordingError, match=said):
        read_recording(path, twice)


def test_two_time_columns_of_different_steps_are_refused(put: Callable[..., Path]) -> None:
    path = put("time,time,force,top\n" + rows(",", 2 * T, T, FORCE, TOP))
    said = r"two time axes: column 0 \('time'\) has a step of 0.02 s and column 1 \('time'\) one of 0.01 s"
    with pytest.raises(RecordingError, match=said):
        read_recording(path, MAP)


def test_of_two_time_columns_that_agree_or_that_are_not_even_the_good_one_counts(put: Callable[..., Path]) -> None:
    head = "t [us],time,force,top\n"
    check(read_recording(put(head + rows(",", 1e6 * T, T, FORCE, TOP)), MAP).time)
    check(read_recording(put("time,t,force,top\n" + rows(",", np.floor(5 * T), T, FORCE, TOP)), MAP).time)


def test_a_time_column_that_stands_still_is_told(put: Callable[..., Path]) -> None:
    path = put("time,force,top\n" + rows(",", 0 * T + 1e9, FORCE, TOP))
    with pytest.raises(RecordingError, match=r"'time' does not increase: it goes from 1e\+09 to 1e\+09 s in 20 rows"):
        read_recording(path, MAP)


def test_time_that_is_mapped_as_a_channel_is_named(put: Callable[..., Path]) -> None:
    path = put("time,force,top\n" + rows(",", T, FORCE, TOP))
    wrong = (MAP[0], ChannelMap("time", 12, "-X", "acceleration", "g"))
    with pytest.raises(RecordingError, match=r"column 'time' is mapped as a channel .* take it out of the channels"):
        read_recording(path, wrong)


def test_a_name_that_is_nearly_right_is_proposed(put: Callable[..., Path]) -> None:
    path = put("time,force,top\n" + rows(",", T, FORCE, TOP))
    with pytest.raises(RecordingError, match=r"no column is named 'topp'; did you mean 'top'\?"):
        read_recording(path, (MAP[0], ChannelMap("topp", 12, "-X", "acceleration", "g")))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", r"run\.csv is empty; export it again"),
        ("\n \n", r"run\.csv is empty; export it again"),
        ("time,force\n", "one reads 'time,force'"),
        (
            "time,force\n12:00:00.25,1.5\n12:00:00.50,2.5\n",
            r"'12:00:00.25' is a time of day; export the time in seconds",
        ),
        ("time,force\n2026-01-01T12:00:00,1.5\n", "'2026-01-01T12:00:00' is a time of day"),
    ],
)
def test_a_table_without_numbers_says_what_stands_in_the_way(put: Callable[..., Path], text: str, said: str) -> None:
    with pytest.raises(FormatError, match=said):
        read_recording(put(text), MAP)


def test_binary_data_called_text(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    path.write_bytes(bytes(range(256)) * 8)
    with pytest.raises(FormatError, match=r"run\.csv: holds binary data, and a name that ends in '\.csv'"):
        read_recording(path, MAP)


def test_the_unicode_text_of_a_spreadsheet(put: Callable[..., Path]) -> None:
    text = "time\tforce\ttop\n" + rows("\t", T, FORCE, TOP)
    check(read_recording(put(text, "run.txt", "utf-16"), MAP).time)


@pytest.mark.parametrize("names", ["time,force,top\n", "time,force,top\ns,N,g\n"])
@pytest.mark.parametrize("first", ["", "0,1,0\n"], ids=["all with decimals", "the first row without"])
def test_decimal_commas_between_commas_are_told(put: Callable[..., Path], names: str, first: str) -> None:
    said = "3 columns are named, and the rows have 6 fields without a decimal point.*export it with ';' between columns"
    with pytest.raises(FormatError, match=said):
        read_recording(put(names + first + rows(",", T, FORCE, TOP, comma=True, form="{:.6f}")), MAP)


def test_a_comment_of_fewer_fields_is_no_line_of_names(put: Callable[..., Path]) -> None:
    whole = rows(",", np.arange(N), np.arange(N) % 3, np.arange(N) % 5, np.arange(N) % 7, form="{:.0f}")
    channels = (ChannelMap(1, 1, "+Z", "force", "N"), ChannelMap(2, 12, "-X", "acceleration", "g"))
    assert read_recording(put("run 7\n" + whole.replace("\n", ".\n")), channels).time.n_samples == N
    assert read_recording(put("run 7\nof the rig\n" + whole), channels).time.n_samples == N


def test_a_single_row_is_told_as_that(put: Callable[..., Path]) -> None:
    with pytest.raises(RecordingError, match=r"has 1 row of numbers, a recording at least 2; export it again"):
        read_recording(put("time,force,top\n0.0,1.5,2.5\n"), MAP)


def test_notes_after_the_last_row_are_passed_over(put: Callable[..., Path]) -> None:
    text = "# logger 7\ntime,force,top\n" + rows(",", T, FORCE, TOP) + "# 20 rows\n\n# end\n"
    check(read_recording(put(text), MAP).time)


def test_a_force_that_no_channel_is_made_of_is_no_frequency_axis(tmp_path: Path) -> None:
    """Left out of the channels, a column F beside a stated rate made the file one of FRFs."""
    from scipy.io import savemat

    savemat(tmp_path / "run.mat", {"fs": 100.0, "F": FORCE - 0.99, "top": TOP})
    data = read_recording(tmp_path / "run.mat", MAP[1:]).time
    assert data.dt == pytest.approx(0.01)


def test_arrays_that_give_no_column_are_told(tmp_path: Path) -> None:
    """Of an array of 3 x 4 x 5 it was said that there is none of more than one number."""
    import h5py
    from scipy.io import savemat

    with h5py.File(tmp_path / "nested.h5", "w") as file:
        file["g/x"], file["fs"], file["text"] = np.ones((3, 4, 5)), 100.0, "channel 1"
    there = r"there is fs \(one number\), g/x \(of shape \(3, 4, 5\)\), text \(not of numbers\)\. Save the channels as"
    with pytest.raises(FormatError, match=f"holds no column of numbers; {there} vectors, or as matrices"):
        read_table(tmp_path / "nested.h5")
    savemat(tmp_path / "cell.mat", {"c": np.array([1, "x"], dtype=object)})
    with pytest.raises(FormatError, match=r"there is c \(not of numbers\)"):
        read_table(tmp_path / "cell.mat")
    with h5py.File(tmp_path / "empty.h5", "w"):
        pass
    with pytest.raises(FormatError, match="there is nothing"):
        read_table(tmp_path / "empty.h5")
