"""However a universal file is damaged, it is read or refused with a FormatError that names the file."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from femend import Channel, Dof, TimeData, functions_of, read_uff, write_uff
from femend.errors import FormatError
from femend.io.uff import UniversalFile
from femend.io.uff.geometry import Element2412, Lines82, Nodes, Units164


def whole(folder: Path, binary: bool) -> bytes:
    values = np.random.default_rng(8).standard_normal((2, 12))
    channels = (Channel(Dof(1, 1), "force", "N"), Channel(Dof(2, 3), "acceleration", "g"))
    path = folder / "whole.uff"
    content = UniversalFile(
        "",
        tuple(functions_of(TimeData("r", 1 / 512, values, channels))),
        (Nodes(np.array([1, 2]), np.eye(2, 3), np.zeros((2, 2), int)),),
        (Lines82(1, "frame", (1, 2, 0)),),
        (Element2412(1, 21, 1, 1, (1, 2)),),
        (Units164(1, "SI", 1.0, 1.0, 1.0, 0.0),),
    )
    write_uff(path, content, binary=binary)
    return path.read_bytes()


def refusal(path: Path, data: bytes) -> FormatError | None:
    """The error that reading `data` ends with; None where it is read. Any other exception fails the test."""
    path.write_bytes(data)
    try:
        read_uff(path)
    except FormatError as error:
        return error
    return None


@pytest.mark.parametrize("binary", [True, False])
def test_cut_off_anywhere(tmp_path: Path, binary: bool) -> None:
    data = whole(tmp_path, binary)
    path = tmp_path / "cut.uff"
    errors = [refusal(path, data[:n]) for n in range(0, len(data), 7)]
    refused = [e for e in errors if e is not None]
    assert all(e.file == str(path) and str(path) in str(e) for e in refused)
    assert len(refused) > 0.95 * len(errors)  # all but the cuts between two sets


@pytest.mark.parametrize("binary", [True, False])
@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.data())
def test_bytes_that_were_overwritten(tmp_path: Path, binary: bool, data: st.DataObject) -> None:
    text = bytearray(whole(tmp_path, binary))
    for _ in range(data.draw(st.integers(1, 4))):
        at = data.draw(st.integers(0, len(text) - 1))
        new = data.draw(
            st.one_of(st.binary(min_size=1, max_size=6), st.sampled_from([b"-1", b"\n", b"    -1\n", b"9999"]))
        )
        text[at : at + data.draw(st.sampled_from([0, len(new)]))] = new
    path = tmp_path / "damaged.uff"
    error = refusal(path, bytes(text))
    assert error is None or (error.file == str(path) and str(path) in str(error))
