"""Decks of several files are written so that they are read again with the new values."""

from pathlib import Path

from femend.io.updated_files import updated_files

MAIN = (
    b"SOL 103\nBEGIN BULK\nINCLUDE 'grids.inc'\nInclude a/mat.inc $ steel\r\n"
    b"INCLUDE 'b/\n  mat.inc'\n$ INCLUDE 'x'\nENDDATA\n"
)


def deck(folder: Path) -> Path:
    """A deck with two materials in files of one name, one of which includes another file, and a file of grids."""
    for name, content in {
        "frame.bdf": MAIN,
        "grids.inc": b"GRID,1\n",
        "a/mat.inc": b"MAT1,1,2.+11,,.3\n",
        "b/mat.inc": b"include 'more.inc'\nINCLUDED is no card\n",
        "b/more.inc": b"MAT1,2,7.+10,,.3\n",
    }.items():
        path = folder / name
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(content)
    return folder / "frame.bdf"


def test_includes_name_the_new_files_and_files_of_one_name_stay_apart(tmp_path: Path) -> None:
    main = deck(tmp_path)
    changed = {tmp_path / "a" / "mat.inc": b"MAT1,1,1.+11,,.3\n", tmp_path / "b" / "more.inc": b"MAT1,2,8.+10,,.3\n"}
    files = updated_files(main, changed)
    assert set(files) == {
        "model.updated.bdf",
        "model.updated.a.mat.inc",
        "model.updated.b.mat.inc",
        "model.updated.more.inc",
    }
    text = files["model.updated.bdf"]
    assert b"INCLUDE 'grids.inc'\n" in text
    assert b"Include model.updated.a.mat.inc $ steel\r\n" in text
    assert b"INCLUDE 'model.updated.b.mat.inc'\n" in text
    assert b"$ INCLUDE 'x'\n" in text
    # on the way to a changed file
    assert files["model.updated.b.mat.inc"] == b"include 'model.updated.more.inc'\nINCLUDED is no card\n"
    assert files["model.updated.more.inc"] == b"MAT1,2,8.+10,,.3\n"


def test_what_a_changed_file_includes_is_found_from_the_folder_of_the_deck(tmp_path: Path) -> None:
    main = deck(tmp_path)
    path = tmp_path / "b" / "mat.inc"
    files = updated_files(main, {path: path.read_bytes() + b"MAT1,3,1.+9,,.3\n"})
    assert set(files) == {"model.updated.bdf", "model.updated.mat.inc"}
    assert files["model.updated.mat.inc"].startswith(b"include 'b/more.inc'\n")
    assert b"INCLUDE 'model.updated.mat.inc'" in files["model.updated.bdf"]
    assert b"Include a/mat.inc $ steel" in files["model.updated.bdf"]


def test_a_deck_without_changed_includes_keeps_its_bytes(tmp_path: Path) -> None:
    main = deck(tmp_path)
    assert updated_files(main, {main: MAIN + b"$ new\n"}) == {"model.updated.bdf": MAIN + b"$ new\n"}
    assert updated_files(main, {}) == {"model.updated.bdf": MAIN}
