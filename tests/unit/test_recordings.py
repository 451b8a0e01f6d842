"""Universal files as recordings: units applied, channels labelled, broken records refused by name."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from femend import FRF, Channel, ChannelMap, Dof, TimeData, functions_of, read_recording, read_recordings, write_uff
from femend.errors import FormatError, RecordingError, UnitError
from femend.io.uff import Function58, UniversalFile
from femend.io.uff.geometry import Nodes, Units164
from femend.io.uff.header58 import Axis
from femend.io.uff.times import printed_step

FORCE = Channel(Dof(1, 3), "force", "N", "", "hammer")
TOP = Channel(Dof(12, 1, -1), "acceleration", "m/s^2", "top", "top plate")


def functions(n: int = 10) -> list[Function58]:
    values = np.vstack([np.ones(n), np.arange(n)])
    return functions_of(TimeData("run", 0.01, values, (FORCE, TOP)))


def with_header(function: Function58, **fields: object) -> Function58:
    return replace(function, header=replace(function.header, **fields))


def labelled(function: Function58, unit: str, kind: int | None = None) -> Function58:
    axis = function.header.ordinate
    return with_header(function, ordinate=Axis(axis.type if kind is None else kind, axis.exponents, "NONE", unit))


def write(tmp_path: Path, content: list[Function58] | UniversalFile, name: str = "run.uff", **how: bool) -> Path:
    write_uff(tmp_path / name, content, **how)
    return tmp_path / name


# ---------------------------------------------------------------- units


@pytest.mark.parametrize(
    ("label", "factor"), [("m/s^2", 1.0), ("g", 9.80665), ("mm/s2", 1e-3), ("in/s**2", 0.0254), ("NONE", 1.0)]
)
def test_the_unit_label_is_applied(tmp_path: Path, label: str, factor: float) -> None:
    force, top = functions()
    data = read_recording(write(tmp_path, [force, labelled(top, label)])).time
    np.testing.assert_allclose(data.values[1], factor * np.arange(10), rtol=1e-14)
    assert data.channels[1] == TOP


def test_recordings_come_in_the_wanted_system(tmp_path: Path) -> None:
    path = write(tmp_path, functions())
    data = read_recording(path, units="in-lbf-s").time
    assert [c.unit for c in data.channels] == ["lbf", "in/s^2"]
    np.testing.assert_allclose(data.values[:, 1], [1 / 4.4482216152605, 1 / 0.0254], rtol=1e-14)
    with pytest.raises(UnitError, match="units 'imperial' are unknown"):
        read_recording(path, units="imperial")


def test_set_164_serves_channels_without_label(tmp_path: Path) -> None:
    """Millimetres: a length factor of 1000 file units per metre."""
    unlabelled = [labelled(f, "NONE") for f in functions()]
    file = UniversalFile(
        "", tuple(unlabelled), (Nodes(np.array([1]), np.array([[500.0, 0, 0]]), np.zeros((1, 2), int)),),
        units=(Units164(9, "mm", 1000.0, 1.0, 1.0, 0.0),),
    )  # fmt: skip
    recording = read_recording(write(tmp_path, file))
    np.testing.assert_allclose(recording.time.values[1], 1e-3 * np.arange(10), rtol=1e-14)
    np.testing.assert_allclose(recording.time.values[0], 1.0)
    assert recording.geometry is not None
    np.testing.assert_allclose(recording.geometry.xyz, [[0.5, 0, 0]])
    assert any("data set 164 (mm) applied" in note for note in recording.notes)


def test_label_and_set_164_that_disagree_are_told(tmp_path: Path) -> None:
    file = UniversalFile("", tuple(functions()), units=(Units164(9, "mm", 1000.0, 1.0, 1.0, 0.0),))
    recording = read_recording(write(tmp_path, file))
    np.testing.assert_allclose(recording.time.values[1], np.arange(10))
    assert any("disagree; the label counts" in note for note in recording.notes)


@pytest.mark.parametrize(("label", "part"), [("mV", "does not measure acceleration"), ("abc", "'abc' is unknown")])
def test_label_that_does_not_fit(tmp_path: Path, label: str, part: str) -> None:
    force, top = functions()
    with pytest.raises(UnitError, match=f"data set 2 \\(top plate\\): .*{part}"):
        read_recording(write(tmp_path, [force, labelled(top, label)]))


def test_the_unit_tells_the_quantity_where_the_type_does_not(tmp_path: Path) -> None:
    force, top = functions()
    data = read_recording(write(tmp_path, [labelled(force, "kN", 0), labelled(top, "mm", 1)])).time
    assert [c.quantity for c in data.channels] == ["force", "displacement"]
    np.testing.assert_allclose(data.values[:, 1], [1000.0, 1e-3])


def test_tacho_is_known_by_its_name(tmp_path: Path) -> None:
    force, top = functions()
    tacho = with_header(labelled(force, "V", 0), rsp_node=0, rsp_dir=0, ids=("tacho node 0 dir 0", *["NONE"] * 4))
    recording = read_recording(write(tmp_path, [tacho, top]))
    assert recording.excitation == "unknown"
    assert recording.time.channels[0].quantity == "tacho"
    np.testing.assert_array_equal(recording.tacho, np.ones(10))


# ---------------------------------------------------------------- axes


@pytest.mark.parametrize(
    ("printed", "meant"),
    [
        (9.76562e-04, 1 / 1024),
        (1.52588e-05, 1 / 65536),
        (1.95312e-05, 1 / 51200),
        (2.26757e-05, 1 / 44100),
        (3.90625e-03, 1 / 256),
        (0.01, 0.01),
        (1.00001e-03, 1.00001e-03),  # no integer rate within half a digit
        (0.3, 0.3),
        (1.23457e-09, 1.23457e-09),  # many integer rates print like this
    ],
)
def test_six_digits_of_a_step(printed: float, meant: float) -> None:
    assert printed_step(printed) == meant


def test_uneven_time_axis(tmp_path: Path) -> None:
    x = np.arange(10) * 0.01
    x[6:] += 0.005
    uneven = [replace(with_header(f, even=False), x=x) for f in functions()]
    with pytest.raises(RecordingError, match=r"not even: step 5 is 0.015 s, the mean .* resample"):
        read_recording(write(tmp_path, uneven))


def test_unequal_lengths_and_steps(tmp_path: Path) -> None:
    force, top = functions()
    short = replace(with_header(top, n_points=8), x=top.x[:8], y=top.y[:8])
    with pytest.raises(RecordingError, match=r"data set 2 \(top plate\) has 8 samples, data set 1 \(hammer\) has 10"):
        read_recording(write(tmp_path, [force, short]))
    slow = replace(with_header(top, dx=0.02), x=2 * top.x)
    with pytest.raises(RecordingError, match=r"with step 0.02 s, data set 1 at 0 s with 0.01 s"):
        read_recording(write(tmp_path, [force, slow]))


# ---------------------------------------------------------------- what cannot be used


def test_nan_zero_and_missing_force(tmp_path: Path) -> None:
    force, top = functions()
    y = top.y.copy()
    y[3] = np.nan
    with pytest.raises(RecordingError, match=r"'run': channel acceleration 12:-X \(top\) is nan at 0.03 s"):
        read_recording(write(tmp_path, [force, replace(top, y=y)], allow_nan=True))
    with pytest.raises(RecordingError, match=r"'run': channel acceleration .* is 0 in all 10 samples"):
        read_recording(write(tmp_path, [force, replace(top, y=np.zeros(10))]))
    path = write(tmp_path, [top])
    with pytest.raises(RecordingError, match='excitation = "measured" but none of its 1 channels is a force'):
        read_recording(path, excitation="measured")
    assert read_recording(path).excitation == "unknown"


def test_missing_file_and_file_without_functions(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match=r"recording 'gone': there is no file .*gone\.uff"):
        read_recording(tmp_path / "gone.uff")
    with pytest.raises(FormatError, match="holds no time records, FRFs or spectra"):
        read_recording(write(tmp_path, UniversalFile("", units=(Units164(1, "SI", 1.0, 1.0, 1.0, 0.0),))))
    (tmp_path / "a.xyz").write_text("1 2 3")
    with pytest.raises(FormatError, match=r"the extension '\.xyz' is unknown; recordings are read from \.uff"):
        read_recording(tmp_path / "a.xyz")


# ---------------------------------------------------------------- FRFs


def ema(n_out: int = 2, n_in: int = 2) -> FRF:
    rng = np.random.default_rng(5)
    freq = np.linspace(0.0, 100.0, 21)
    H = rng.standard_normal((21, n_out, n_in)) + 1j * rng.standard_normal((21, n_out, n_in))
    outputs = tuple(Channel(Dof(10 + i, 3), "acceleration", "m/s^2") for i in range(n_out))
    inputs = tuple(Channel(Dof(20 + i, 1), "force", "N") for i in range(n_in))
    return FRF("ema", freq, H, outputs, inputs, "accelerance", "m/s^2/N")


def test_frfs_in_any_order_make_one_grid(tmp_path: Path) -> None:
    data = ema()
    back = read_recording(write(tmp_path, functions_of(data)[::-1])).frf
    rows = [list(back.output_dofs).index(c.dof) for c in data.outputs]
    columns = [list(back.input_dofs).index(c.dof) for c in data.inputs]
    np.testing.assert_array_equal(back.H[:, rows][:, :, columns], data.H)
    assert back.kind == "accelerance"


@pytest.mark.parametrize(
    ("label", "denominator", "factor"),
    [
        ("m/s^2/N", "N", 1.0),
        ("m/s^2", "N", 1.0),
        ("g", "N", 9.80665),
        ("g", "kN", 9.80665e-3),
        ("g/lbf", "lbf", 2.2046226),
    ],
)
def test_units_of_frfs(tmp_path: Path, label: str, denominator: str, factor: float) -> None:
    data = ema(1, 1)
    (function,) = functions_of(data)
    changed = with_header(labelled(function, label), denominator=Axis(13, (0, 0, 0), "NONE", denominator))
    np.testing.assert_allclose(read_recording(write(tmp_path, [changed])).frf.H, factor * data.H, rtol=1e-7)


@pytest.mark.parametrize(
    ("label", "kind"), [("m/N", "receptance"), ("(m/s)/N", "mobility"), ("(1/N)*(m/s^2)", "accelerance")]
)
def test_the_unit_tells_the_kind_where_the_type_does_not(tmp_path: Path, label: str, kind: str) -> None:
    (function,) = functions_of(ema(1, 1))
    assert read_recording(write(tmp_path, [labelled(function, label, 0)])).frf.kind == kind


def test_frfs_without_place_or_sense(tmp_path: Path) -> None:
    (function,) = functions_of(ema(1, 1))
    with pytest.raises(RecordingError, match="the reference of the FRF has no direction"):
        read_recording(write(tmp_path, [with_header(function, ref_dir=0)]))
    with pytest.raises(RecordingError, match=r"10:\+Z / 20:\+X stands twice, in data sets 1 and 2"):
        read_recording(write(tmp_path, [function, function]))
    ratio = with_header(function, denominator=Axis(12, (0, 0, 0), "NONE", "m/s^2"))
    with pytest.raises(RecordingError, match=r"denominator type 12 .* is no receptance"):
        read_recording(write(tmp_path, [ratio]))


def test_frfs_that_form_no_grid_become_several_recordings(tmp_path: Path) -> None:
    path = write(tmp_path, functions_of(ema())[:3])  # 10/20, 11/20, 10/21
    told = r"2 groups of FRFs that form no full grid of .*: \w+ of 2 outputs by .*; \w+ of 1 output by .*, without 11:"
    with pytest.raises(RecordingError, match=told):
        read_recording(path)
    test = read_recordings(path)
    assert [r.name for r in test] == ["run [1]", "run [2]"]
    assert [r.frf.H.shape for r in test] == [(21, 2, 1), (21, 1, 1)]


def test_coherence_is_attached(tmp_path: Path) -> None:
    frfs = functions_of(ema(1, 1))
    gamma = replace(with_header(frfs[0], func_type=6, ord_data_type=4), y=np.linspace(0, 1, 21))
    coherence = read_recording(write(tmp_path, [*frfs, gamma])).frf.coherence
    assert coherence is not None
    np.testing.assert_allclose(coherence[:, 0, 0], np.linspace(0, 1, 21))


@pytest.mark.parametrize(
    ("value", "told"),
    [
        (85.0, "is 85 at 5 Hz (20 such values), and one is between 0 and 1; export it as a share"),
        (1.02, "is 1.02 at 5 Hz (20 such values)"),
        (-0.2, "is -0.2 at 5 Hz"),
        (np.nan, "is not a number at 5 Hz (20 such values); leave the line or the coherence out"),
    ],
)
def test_a_coherence_that_is_none(tmp_path: Path, value: float, told: str) -> None:
    (function,) = functions_of(ema(1, 1))
    gamma = replace(with_header(function, func_type=6, ord_data_type=4), y=np.r_[0.5, np.full(20, value)])
    path = tmp_path / "run.uff"
    write_uff(path, [function, gamma], allow_nan=True)
    with pytest.raises(RecordingError) as caught:
        read_recording(path)
    assert "the coherence of acceleration 10:+Z" in str(caught.value)
    assert told in str(caught.value)


def test_a_coherence_beyond_1_by_rounding_is_1(tmp_path: Path) -> None:
    (function,) = functions_of(ema(1, 1))
    gamma = replace(with_header(function, func_type=6, ord_data_type=4), y=np.full(21, 1 + 1e-6))
    coherence = read_recording(write(tmp_path, [function, gamma])).frf.coherence
    assert coherence is not None
    assert (coherence == 1).all()


@pytest.mark.parametrize("direction", [7, -7, 30])
def test_a_direction_that_the_format_does_not_know(tmp_path: Path, direction: int) -> None:
    """It was taken as none, so that the sensor had no place in the model, without a word."""
    force, top = functions()
    path = write(tmp_path, [force, with_header(top, rsp_dir=direction)])
    with pytest.raises(
        RecordingError, match=rf"data set 2 \(top plate\): its response at node \d+ has the direction {direction},"
    ):
        read_recording(path)
    said = read_recording(path, [ChannelMap(1, 7, "-Y", "acceleration", "g")]).time  # the study says it better
    assert str(said.channels[1].dof) == "7:-Y"
    frf = with_header(functions_of(ema(1, 1))[0], ref_dir=direction)
    with pytest.raises(RecordingError, match=rf"its reference at node 20 has the direction {direction},"):
        read_recording(write(tmp_path, [frf]))


def test_spectra(tmp_path: Path) -> None:
    (function,) = functions_of(ema(1, 1))
    cross = with_header(function, func_type=3)
    data = read_recording(write(tmp_path, [cross])).data
    assert data.kind == "cross-spectrum"  # type: ignore[union-attr]


def test_several_files_make_one_test(tmp_path: Path) -> None:
    paths = [write(tmp_path, functions(), name) for name in ("low.uff", "high.uff")]
    assert [r.name for r in read_recordings(paths)] == ["low", "high"]


def test_the_study_overrules_the_header(tmp_path: Path) -> None:
    """A logger that knows neither node nor unit: the study says them, for the channels it names."""
    force, top = functions()
    bare = with_header(labelled(top, "V", 0), rsp_node=0, rsp_dir=0)
    path = write(tmp_path, [force, bare])
    for source in (1, "top", "top pl"):
        channel = ChannelMap(source, 7, "-Y", "acceleration", "g", 0.5)
        data = read_recording(path, [channel]).time
        np.testing.assert_allclose(data.values, [np.ones(10), 0.5 * 9.80665 * np.arange(10)], rtol=1e-14)
        assert [str(c.dof) for c in data.channels] == ["1:+Z", "7:-Y"]
        assert data.channels[1].label == "top plate"
    with pytest.raises(RecordingError, match=r"no column is named 'side'"):
        read_recording(path, [ChannelMap("side", 7, "Y", "force", "N")])
    with pytest.raises(RecordingError, match=r"applies to time records and tables"):
        read_recording(write(tmp_path, functions_of(ema(1, 1))), [ChannelMap(0, 7, "Y", "force", "N")])


def test_a_unit_that_does_not_matter_stops_nothing(tmp_path: Path) -> None:
    """A microphone in an odd unit beside force and acceleration is kept as it is, and told."""
    recording = read_recording(write(tmp_path, [*functions(), labelled(functions()[1], "dBA", 15)]))
    assert (recording.time.channels[2].quantity, recording.time.channels[2].unit) == ("pressure", "dBA")
    np.testing.assert_array_equal(recording.time.values[2], np.arange(10))
    assert any("'dBA'" in note for note in recording.notes)
