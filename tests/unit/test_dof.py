"""DOF text and DOF tables."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from femend import Dof, DofTable


@pytest.mark.parametrize(
    ("text", "dof", "written"),
    [
        ("12:+Z", Dof(12, 3), "12:+Z"),
        ("12:Z", Dof(12, 3), "12:+Z"),
        (" 7 : -rx ", Dof(7, 4, -1), "7:-RX"),
        ("3:6", Dof(3, 6), "3:+RZ"),
    ],
)
def test_dof_text(text: str, dof: Dof, written: str) -> None:
    assert Dof.parse(text) == dof
    assert str(dof) == written


@given(st.integers(0, 10**9), st.integers(1, 6), st.sampled_from([1, -1]))
def test_text_comes_back(node: int, component: int, sign: int) -> None:
    dof = Dof(node, component, sign)
    assert Dof.parse(str(dof)) == dof
    assert Dof.from_uff(node, dof.uff_direction) == dof


@pytest.mark.parametrize("text", ["12", "12:W", "Z:12", "12:+", "1:7", "12:ZZ"])
def test_text_that_is_no_dof_is_quoted(text: str) -> None:
    with pytest.raises(ValueError, match=f"DOF '{text[:2]}"):
        Dof.parse(text)


@pytest.mark.parametrize("wrong", [(1, 0, 1), (1, 7, 1), (1, 1, 0), (-1, 1, 1)])
def test_numbers_out_of_range(wrong: tuple[int, int, int]) -> None:
    with pytest.raises(ValueError, match=r"of node|negative"):
        Dof(*wrong)


def test_scalar_channels_have_no_dof() -> None:
    assert Dof.from_uff(5, 0) is None
    assert Dof.from_uff(5, 7) is None


def test_table() -> None:
    table = DofTable(["2:X", "1:-RZ", Dof(2, 3)])
    assert table.find("1:+RZ") == 1
    assert Dof(2, 3, -1) in table
    assert Dof(2, 2) not in table
    assert table.nodes.tolist() == [2, 1, 2]
    assert table.components.tolist() == [1, 6, 3]
    assert table.signs.tolist() == [1, -1, 1]
    assert DofTable.from_arrays(table.nodes, table.components).find("2:Z") == 2
    with pytest.raises(KeyError, match=r"DOF 9:\+X is not among the 3 DOFs"):
        table.find("9:X")
    with pytest.raises(ValueError, match=r"2:-X stands twice in the table, at 0 and 1"):
        DofTable(["2:X", "2:-X"])
