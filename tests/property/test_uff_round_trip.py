"""Whatever is written to a universal file is read back."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from femend import read_uff, write_uff
from femend.io.uff import Function58
from femend.io.uff.header58 import Axis, Header58
from femend.io.uff.writer import short_number

finite = st.floats(-1e30, 1e30, allow_subnormal=False)
steps = st.floats(1e-7, 1e3)
words = st.text(st.characters(max_codepoint=255, categories=("L", "N", "P", "S")), max_size=9)
labels = st.lists(words, max_size=4).map(" ".join).map(lambda text: text.strip())


@st.composite
def functions(draw: st.DrawFn) -> Function58:
    n = draw(st.integers(1, 40))
    is_complex = draw(st.booleans())
    y = draw(arrays(np.float64, n, elements=finite))
    if is_complex:
        y = y + 1j * draw(arrays(np.float64, n, elements=finite))
    even = draw(st.booleans())
    dx = draw(steps)
    x = dx * np.arange(n) if even else np.cumsum(draw(arrays(np.float64, n, elements=steps)))
    header = Header58(
        tuple(draw(labels) or "NONE" for _ in range(5)),  # type: ignore[arg-type]
        draw(st.sampled_from([1, 2, 3, 4, 6, 9, 12])),
        draw(st.integers(0, 9999)),
        draw(st.integers(0, 9999)),
        draw(words) or "NONE",
        draw(st.integers(0, 10**10 - 1)),
        draw(st.integers(-6, 6)),
        draw(words) or "NONE",
        draw(st.integers(0, 10**10 - 1)),
        draw(st.integers(-6, 6)),
        6 if is_complex else 4,
        n,
        even,
        float(x[0]) if even else 0.0,
        dx if even else 0.0,
        0.0,
        *(Axis(draw(st.integers(0, 21)), (1, -2, 3), draw(words) or "NONE", draw(words) or "NONE") for _ in range(4)),
    )
    return Function58(header, x, y)


@pytest.mark.parametrize("binary", [True, False])
@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.lists(functions(), min_size=1, max_size=4))
def test_functions_come_back(tmp_path: Path, binary: bool, written: list[Function58]) -> None:
    path = tmp_path / "a.uff"
    write_uff(path, written, binary=binary)
    back = read_uff(path)
    assert not back.notes
    assert len(back.functions) == len(written)
    for a, b in zip(written, back.functions):
        # Text has 13 digits; the text of an uneven abscissa has 13 columns, of which 8 digits remain at least.
        np.testing.assert_allclose(b.y, a.y, rtol=0 if binary else 1e-12)
        part = 0.0 if binary and not b.header.even else 1e-6 if not binary else 1e-3 * abs(b.header.dx)
        np.testing.assert_allclose(b.x, a.x, rtol=1e-7 if not binary else 1e-15, atol=max(part, 1e-3 * b.header.dx))
        for field in ("ids", "func_type", "func_id", "load_case", "rsp_name", "rsp_node", "rsp_dir"):
            assert getattr(a.header, field) == getattr(b.header, field)
        for field in ("ref_name", "ref_node", "ref_dir", "abscissa", "ordinate", "denominator", "z_axis"):
            assert getattr(a.header, field) == getattr(b.header, field)


@given(st.floats(allow_nan=False, allow_infinity=False, min_value=-1e99, max_value=1e99))
def test_short_numbers_fit_and_are_close(value: float) -> None:
    text = short_number(value)
    assert len(text) <= 12
    # -1.2345e-123 leaves five digits in twelve characters; eight are there for numbers of everyday size.
    assert float(text) == pytest.approx(value, rel=5e-7 if 1e-9 < abs(value) < 1e9 else 1e-3, abs=1e-300)
