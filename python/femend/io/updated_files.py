"""Names and contents of the files of a deck that was changed, so that they belong together wherever they are put."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Mapping
from pathlib import Path

__all__ = ["updated_files"]

# an INCLUDE with its name in quotes, which may go on in the next line, or without them
_QUOTED = re.compile(rb"(?im)^([ \t]*INCLUDE[ \t=\r\n]*)(['\"])([^'\"]*)\2")
_BARE = re.compile(rb"(?im)^([ \t]*INCLUDE[ \t=]+)([^'\"$\r\n\t =][^$\r\n]*?)(?=[ \t]*(?:\$[^\r\n]*)?\r?$)")
# how often includes may be nested, as the reader has it
_DEEPEST = 200


def updated_files(main: Path, changed: Mapping[Path, bytes], *, anywhere: bool = False) -> dict[str, bytes]:
    """File names, each with its content: `model.updated.bdf` for the deck `main`, with its new content where it is
    among the `changed`, and `model.updated.NAME` for every included file that is, or includes one that is.

    Their INCLUDE statements name the new files; other includes stay, so that beside the original deck everything is
    found, or have their whole path, so that it is found from `anywhere`. Everything else keeps its bytes.
    """
    main = main.resolve()
    files = {path.resolve(): content for path, content in changed.items()}
    if main not in files:
        files[main] = main.read_bytes()
    written = _with_those_that_include(files, main)
    names = _names(written, main)
    return {names[path]: _renamed(content, path, main, names, anywhere) for path, content in written.items()}


def _with_those_that_include(files: dict[Path, bytes], main: Path) -> dict[Path, bytes]:
    """The changed files, and those on the way to them."""
    known, todo = dict(files), [main]
    order: list[Path] = []
    while todo and len(order) < _DEEPEST**2:
        path = todo.pop()
        order.append(path)
        content = known[path] if path in known else known.setdefault(path, path.read_bytes())
        todo += [p for p in _included(content, path, main) if p not in order and p not in todo]
    written = dict(files)
    for _ in range(_DEEPEST):
        more = [p for p in order if p not in written and any(i in written for i in _included(known[p], p, main))]
        if not more:
            break
        written.update({p: known[p] for p in more})
    return written


def _included(content: bytes, path: Path, main: Path) -> list[Path]:
    """Files that a file includes, as the reader finds them; those that are there."""
    names = [m[3] for m in _QUOTED.finditer(content)] + [m[2] for m in _BARE.finditer(content)]
    found = (_found(name, path, main) for name in names)
    return [p for p in found if p is not None]


def _found(name: bytes, path: Path, main: Path) -> Path | None:
    """The file of an INCLUDE in the file `path`, beside that or beside the deck; None where there is none."""
    text = "".join(part.strip() for part in name.decode("utf-8", errors="replace").split("\n"))
    for folder in (path.parent, main.parent):
        for spelt in (text, text.replace("\\", "/")):
            if (folder / spelt).is_file():
                return (folder / spelt).resolve()
    return None


def _names(paths: Iterable[Path], main: Path) -> dict[Path, str]:
    """A name of its own for every file: files of one name are told apart by their folders."""
    names = {main: "model.updated.bdf"}
    included = sorted(path for path in paths if path != main)
    for path in included:
        alone = sum(other.name == path.name for other in included) == 1
        parts = [path.name] if alone else [p for p in Path(os.path.relpath(path, main.parent)).parts if p != ".."]
        name = f"model.updated.{'.'.join(parts)}"
        while name in names.values():
            name += ".inc"
        names[path] = name
    return names


def _renamed(content: bytes, path: Path, main: Path, names: Mapping[Path, str], anywhere: bool) -> bytes:
    """A file whose INCLUDE statements name the new files, and others from the folder of the deck or by their whole
    path."""

    def other(name: bytes) -> bytes | None:
        found = _found(name, path, main)
        if found is None or (found not in names and path.parent == main.parent and not anywhere):
            return None
        if found in names:
            return names[found].encode()
        return (found if anywhere else Path(os.path.relpath(found, main.parent))).as_posix().encode()

    def bare(match: re.Match[bytes]) -> bytes:
        new = other(match[2])
        if new is None:
            return match[0]
        # a whole path may have blanks and dollars in it
        return match[1] + (b"'" + new + b"'" if anywhere else new)

    content = _QUOTED.sub(lambda m: m[1] + m[2] + (other(m[3]) or m[3]) + m[2], content)
    return _BARE.sub(bare, content)
