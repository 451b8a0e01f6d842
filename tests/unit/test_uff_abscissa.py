"""What a universal file's abscissas are in: four bytes or eight, s or ms, Hz or rad/s, alike or not from function to
function. Every file is written here, byte by byte."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from femend.errors import FormatError, RecordingError
from femend.io import read_recording, read_recordings, read_uff

N = 400
T = np.arange(N) / 1024
WAVE = np.sin(40 * T) + 0.3
FREQ = np.geomspace(1.0, 50.0, N)


def receptance(freq: np.ndarray) -> np.ndarray:
    """Of 2 kg on 40 kN/m and 3 Ns/m, in m/N."""
    s = 2j * np.pi * freq
    return 1 / (2 * s**2 + 3 * s + 4e4)


def function(
    y: np.ndarray,
    *,
    x: np.ndarray | None = None,
    form: str = "<f8",
    x_form: str = "",
    start: float = 0.0,
    step: float | str = 1 / 1024,
    unit: str = "s",
    kind: int = 1,
    node: int = 5,
    order: int = 0,
) -> bytes:
    """A binary data set 58: an acceleration over time (`kind` 1), a receptance (4) by a force at node 2, or its
    coherence (6)."""
    parts = [y.real, y.imag] if np.iscomplexobj(y) else [y]
    table = np.empty(y.size, dtype=[("x", x_form or form), ("y", form, (len(parts),))])
    table["x"], table["y"] = 0.0 if x is None else x, np.column_stack(parts)
    samples = table["y"].tobytes() if x is None else table.tobytes()
    number = {(1, "f4"): 2, (1, "f8"): 4, (2, "f4"): 5, (2, "f8"): 6}[len(parts), form[1:]]
    first = f"{start:13.5e}{step if isinstance(step, str) else f'{step:.5e}':>13s}"
    ordinate = {1: (12, "m/s^2"), 4: (8, "m"), 6: (0, "NONE")}[kind]
    axes = ((17 if kind == 1 else 18, unit), ordinate, (13, "N") if kind == 4 else (0, "NONE"), (0, "NONE"))
    lines = [
        f"    58b{order or (1 if form[0] == '<' else 2):6d}{2:6d}{11:12d}{len(samples):12d}{0:6d}{0:6d}{0:12d}{0:12d}",
        *["wave", "NONE", "NONE", "NONE", "NONE"],
        f"{kind:5d}{0:10d}{0:5d}{0:10d} {'NONE':10s}{node:10d}{3:4d} {'NONE':10s}{2:10d}{3 if kind > 1 else 0:4d}",
        f"{number:10d}{y.size:10d}{0 if x is not None else 1:10d}{first}{0.0:13.5e}",
        *[f"{t:10d}{0:5d}{0:5d}{0:5d} {'NONE':20s} {text:20s}" for t, text in axes],
    ]
    return ("    -1\n" + "\n".join(lines) + "\n").encode() + samples + b"    -1\n"


@pytest.fixture
def put(tmp_path: Path):  # type: ignore[no-untyped-def]
    def write(data: bytes) -> Path:
        path = tmp_path / "a.uff"
        path.write_bytes(data)
        return path

    return write


@pytest.mark.parametrize("order", ["<", ">"], ids=["little", "big"])
def test_abscissas_of_four_bytes_beside_ordinates_of_eight(put, order: str) -> None:  # type: ignore[no-untyped-def]
    path = put(function(WAVE, x=T, form=f"{order}f8", x_form=f"{order}f4"))
    (read,) = read_uff(path).functions
    np.testing.assert_array_equal(read.y, WAVE)
    np.testing.assert_allclose(read.x, T, rtol=1e-7)
    complex_set = function(receptance(FREQ), x=FREQ, form=f"{order}f8", x_form=f"{order}f4", unit="Hz", kind=4)
    frf = read_recording(put(complex_set)).frf
    assert frf is not None
    np.testing.assert_array_equal(frf.H[:, 0, 0], receptance(FREQ))
    np.testing.assert_allclose(frf.freq, FREQ, rtol=1e-7)


def test_even_times_of_four_bytes_are_even(put) -> None:  # type: ignore[no-untyped-def]
    t = np.arange(60_000) / 1000.0  # at a minute the last bit of four bytes is 4e-6 s
    read = read_recording(put(function(np.cos(t), x=t, form="<f4")))
    assert read.time is not None
    assert read.time.dt == 1e-3
    assert any("last digits" in note for note in read.notes)
    uneven = t + 0.3e-3 * np.sin(t)
    with pytest.raises(RecordingError, match="not even"):
        read_recording(put(function(np.cos(t), x=uneven + 0.2e-3 * (np.arange(t.size) % 2), form="<f4")))


@pytest.mark.parametrize(("unit", "per_second"), [("ms", 1e3), ("us", 1e6), ("s", 1.0), ("NONE", 1.0), ("sec", 1.0)])
@pytest.mark.parametrize("even", [True, False])
def test_unit_of_time(put, unit: str, per_second: float, even: bool) -> None:  # type: ignore[no-untyped-def]
    axis = {"step": per_second / 1024, "start": 0.5 * per_second} if even else {"x": (T + 0.5) * per_second}
    read = read_recording(put(function(WAVE, unit=unit, **axis))).time
    assert read is not None
    assert read.rate == pytest.approx(1024.0, rel=1e-9)
    assert read.t0 == pytest.approx(0.5)


@pytest.mark.parametrize(("unit", "per_hertz"), [("Hz", 1.0), ("rad/s", 2 * np.pi), ("rpm", 60.0), ("kHz", 1e-3)])
def test_unit_of_frequency(put, unit: str, per_hertz: float) -> None:  # type: ignore[no-untyped-def]
    frf = read_recording(put(function(receptance(FREQ), x=FREQ * per_hertz, unit=unit, kind=4))).frf
    assert frf is not None
    np.testing.assert_allclose(frf.freq, FREQ, rtol=1e-12)


@pytest.mark.parametrize(("unit", "kind", "told"), [("Hz", 1, "must be a time"), ("s", 4, "must be a frequency")])
def test_abscissa_of_another_quantity_is_refused(put, unit: str, kind: int, told: str) -> None:  # type: ignore[no-untyped-def]
    values = WAVE if kind == 1 else receptance(FREQ)
    with pytest.raises(RecordingError, match=told):
        read_recording(put(function(values, x=T if kind == 1 else FREQ, unit=unit, kind=kind)))


def test_unknown_unit_of_the_abscissa_is_noted(put) -> None:  # type: ignore[no-untyped-def]
    read = read_recording(put(function(WAVE, x=T, unit="blink")))
    assert any("'blink'" in note and "taken as s" in note for note in read.notes)


def test_frfs_on_other_lines_are_not_put_together(put) -> None:  # type: ignore[no-untyped-def]
    even = np.linspace(1.0, 50.0, N)  # as many lines, the same first and the same last one
    sets = function(receptance(FREQ), x=FREQ, unit="Hz", kind=4)
    sets += function(receptance(even), x=even, unit="Hz", kind=4, node=6)
    found = read_recordings(put(sets)).recordings
    assert [r.frf.output_dofs[0].node for r in found if r.frf is not None] == [5, 6]
    for read, freq in zip(found, (FREQ, even), strict=True):
        assert read.frf is not None
        np.testing.assert_array_equal(read.frf.freq, freq)
        np.testing.assert_array_equal(read.frf.H[:, 0, 0], receptance(freq))


def test_coherence_on_other_lines_is_not_of_the_frf(put) -> None:  # type: ignore[no-untyped-def]
    even = np.linspace(1.0, 50.0, N)
    sets = function(receptance(FREQ), x=FREQ, unit="Hz", kind=4)
    other = read_recording(put(sets + function(np.full(N, 0.9), x=even, unit="Hz", kind=6))).frf
    own = read_recording(put(sets + function(np.full(N, 0.9), x=FREQ, unit="Hz", kind=6))).frf
    assert other is not None
    assert other.coherence is None
    assert own is not None
    assert own.coherence is not None


def test_frf_without_imaginary_part_is_noted(put) -> None:  # type: ignore[no-untyped-def]
    read = read_recording(put(function(np.abs(receptance(FREQ)), x=FREQ, unit="Hz", kind=4)))
    assert any("without imaginary part" in note for note in read.notes)


@pytest.mark.parametrize("form", ["<f4", "<f8", ">f4", ">f8"])
def test_counts_in_the_wrong_byte_order_are_told(put, form: str) -> None:  # type: ignore[no-untyped-def]
    said = 2 if form[0] == "<" else 1
    with pytest.raises(FormatError, match="make sense only as"):
        read_uff(put(function(np.round(200 * WAVE), form=form, order=said)))


@pytest.mark.parametrize("step", ["nan", "inf"])
def test_step_that_is_no_number(put, step: str) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(FormatError, match="abscissa increment"):
        read_uff(put(function(WAVE, step=step)))


def test_time_that_is_no_number(put) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(RecordingError, match="time of sample 7 is nan"):
        read_recording(put(function(WAVE, x=np.where(np.arange(N) == 7, np.nan, T))))


def test_negative_node(put) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(RecordingError, match="at node -5"):
        read_recording(put(function(WAVE, node=-5)))
