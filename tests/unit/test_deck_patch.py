"""Writing new values into a deck: only the field changes, to the last digit its columns hold."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from femend.errors import DeckError
from femend.io.deck import FieldChange, next_id, patch_deck, read_deck

DECK = """\
$ a comment, kept
SOL 103
CEND
BEGIN BULK
MAT1    1       2.1+11          .3      7850.   $ steel
MAT1*                  2     2.10000E+11                           .3000
*                 7850.0
MAT1,3,2.1e11, ,.3,7850.
MAT1\t4\t2.1+11\t\t.3\t7850.
PELAS,7,100.,,,8,200.
CONM2   9       1                2.5000       0.      0.      0.              +C
+C           1.0             3.0
GRID,1
ENDDATA
"""


def patch(
    folder: Path, changes: list[tuple[str, int, int, float]], additions: tuple[str, ...] = (), text: str = DECK
) -> str:
    path = folder / "model.bdf"
    path.write_bytes(text.encode())
    return patch_deck(read_deck(path), changes, additions)[path].decode()


def only_change(old: str, new: str) -> list[tuple[str, str]]:
    pairs = zip(old.split("\n"), new.split("\n"), strict=True)
    return [(a, b) for a, b in pairs if a != b]


@pytest.mark.parametrize(
    ("change", "line"),
    [
        (("MAT1", 1, 3, 2.2345678e11), "MAT1    1       2.235+11        .3      7850.   $ steel"),
        (("MAT1", 1, 6, 7849.123), "MAT1    1       2.1+11          .3      7849.123$ steel"),
        (
            ("MAT1", 2, 3, 2.23456789012e11),
            "MAT1*                  2   223456789012.                           .3000",
        ),
        (("MAT1", 2, 6, 7000.25), "*                7000.25"),
        (("MAT1", 3, 3, 1 / 3), "MAT1,3,.3333333333333333, ,.3,7850."),
        (("MAT1", 3, 4, 8e10), "MAT1,3,2.1e11,8.+10 ,.3,7850."),
        (("MAT1", 4, 3, 1.23456789e11), "MAT1\t4\t1.23+11\t\t.3\t7850."),
        (("MAT1", 4, 5, 0.25), "MAT1\t4\t2.1+11\t\t.25\t7850."),
        (("PELAS", 8, 3, 250.0), "PELAS,7,100.,,,8,250."),
        (("CONM2", 9, 5, 2.25), "CONM2   9       1                2.25         0.      0.      0.              +C"),
        (("CONM2", 9, 12, 1.125), "+C         1.125             3.0"),
    ],
)
def test_only_the_field_changes(tmp_path: Path, change: tuple[str, int, int, float], line: str) -> None:
    changed = only_change(DECK, patch(tmp_path, [change]))
    assert [new for _, new in changed] == [line]
    again = tmp_path / "again.bdf"
    again.write_text(patch(tmp_path, [change]))
    card, id_, field, value = change
    reread = read_deck(again).field_text(card, id_, field)
    assert reread
    assert abs(_real(reread) - value) <= 6e-3 * abs(value)


def _real(text: str) -> float:
    for sign in "+-":
        head, mark, tail = text[1:].rpartition(sign)
        if mark and not head.endswith(("e", "E")):
            return float(f"{text[0]}{head}e{sign}{tail}")
    return float(text)


def test_line_ends_and_bytes_that_are_no_text_stay(tmp_path: Path) -> None:
    path = tmp_path / "model.bdf"
    path.write_bytes(b"$ \xff\xfe\r\nMAT1,1,1.,,.3\r\nGRID,1\r\nENDDATA\r\ntrailing rubbish")
    new = patch_deck(read_deck(path), [FieldChange("MAT1", 1, 3, 2.0)], ["CONM2,5,1,,1.5"])[path]
    assert new == b"$ \xff\xfe\r\nMAT1,1,2.,,.3\r\nGRID,1\r\nCONM2,5,1,,1.5\r\nENDDATA\r\ntrailing rubbish"


def test_additions_go_to_the_end_of_a_deck_without_enddata(tmp_path: Path) -> None:
    assert patch(tmp_path, [], ("GRID,2",), "GRID,1") == "GRID,1\nGRID,2\n"


def test_a_value_in_an_included_file_is_changed_there(tmp_path: Path) -> None:
    (tmp_path / "part.blk").write_text("MAT1,1,1.,,.3\n")
    (tmp_path / "model.bdf").write_text("BEGIN BULK\nINCLUDE 'part.blk'\nGRID,1\n")
    deck = read_deck(tmp_path / "model.bdf")
    files = patch_deck(deck, [("MAT1", 1, 3, 2.0)])
    assert files == {tmp_path / "part.blk": b"MAT1,1,2.,,.3\n"}
    assert (tmp_path / "part.blk").read_text() == "MAT1,1,1.,,.3\n"


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("MAT1", 77, 3, 1.0), "no MAT1 77"),
        (("MAT1", 3, 9, 1.0), "not written on the card"),
        (("MAT1", 3, 3, float("nan")), "does not fit"),
    ],
)
def test_what_cannot_be_written(tmp_path: Path, change: tuple[str, int, int, float], words: str) -> None:
    with pytest.raises(DeckError, match=words) as caught:
        patch(tmp_path, [change])
    assert caught.value.file == str(tmp_path / "model.bdf")
    with pytest.raises(DeckError, match="changed twice"):
        patch(tmp_path, [("MAT1", 1, 3, 1.0), ("MAT1", 1, 3, 2.0)])


def test_free_ids(tmp_path: Path) -> None:
    path = tmp_path / "model.bdf"
    path.write_text(DECK)
    deck = read_deck(path)
    assert [next_id(deck, kind) for kind in ("node", "element", "property", "material", "coord")] == [2, 10, 9, 5, 1]


@given(st.floats(min_value=1e-12, max_value=1e15), st.sampled_from([1, 2, 3, 4]))
def test_any_value_is_read_back(tmp_path_factory: pytest.TempPathFactory, value: float, material: int) -> None:
    folder = tmp_path_factory.mktemp("patch")
    new = patch(folder, [("MAT1", material, 3, value)])
    assert len(only_change(DECK, new)) <= 1
    (folder / "model.bdf").write_text(new)
    read = _real(read_deck(folder / "model.bdf").field_text("MAT1", material, 3))
    digits = {1: 5e-4, 2: 1e-10, 3: 0.0, 4: 5e-3}[material]
    assert abs(read - value) <= digits * value


@pytest.mark.parametrize(
    ("line", "fields", "wanted"),
    [
        ("GRID,2,,1.   $ tip", {6: 0.25}, "GRID,2,,1.,,.25$ tip"),
        ("GRID,2,,1.", {5: 0.5, 6: 0.25}, "GRID,2,,1.,.5,.25"),
        ("GRID,2", {4: 2.0, 6: 0.25}, "GRID,2,,2.,,.25"),
        ("GRID,2,,1.,.1", {4: 2.0, 6: 0.25}, "GRID,2,,2.,.1,.25"),
        (
            "GRID    2               1.                 $ tip",
            {6: 0.25},
            "GRID    2               1.              .25$ tip",
        ),
        ("GRID    2               1.0", {5: -0.5, 6: 0.25}, "GRID    2               1.0     -.5     .25"),
        ("GRID    2", {6: 1 / 3}, "GRID    2                               .3333333"),
        ("GRID           2              1.", {5: 0.5}, "GRID           2              1..5"),
    ],
)
def test_a_coordinate_left_off_is_put_behind(tmp_path: Path, line: str, fields: dict[int, float], wanted: str) -> None:
    text = f"BEGIN BULK\nGRID,1,,9.,9.,9.\n{line}\nENDDATA\n"
    new = patch(tmp_path, [("GRID", 2, f, v) for f, v in fields.items()], text=text)
    assert only_change(text, new) == [(line, wanted)]
    again = tmp_path / "again.bdf"
    again.write_text(new)
    deck = read_deck(again)
    for field, value in fields.items():
        assert float(deck.field_text("GRID", 2, field)) == pytest.approx(value, abs=5e-8)


@pytest.mark.parametrize("line", ["GRID*                  2                              1.", "GRID\t2\t\t1."])
def test_a_coordinate_without_a_place_is_refused(tmp_path: Path, line: str) -> None:
    text = f"BEGIN BULK\nGRID,1,,9.,9.,9.\n{line}\nENDDATA\n"
    with pytest.raises(DeckError, match="GRID 2 field 6: is not written on the card, .*write its value there first"):
        patch(tmp_path, [("GRID", 2, 6, 1.0)], text=text)
