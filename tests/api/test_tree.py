"""The tree itself: small files, short functions, nothing that is true on one machine only."""

from __future__ import annotations

import ast
import re
import warnings
from collections.abc import Iterator
from pathlib import Path

FILE_LINES_STOP = 800
FILE_LINES_ASK = 500
FUNCTION_LINES_ASK = 60
CODE = {".py", ".pyi", ".rs"}
TEXT = CODE | {".toml", ".md", ".txt", ".html", ".css", ".js", ".json", ".bdf", ".yaml", ".yml", ".cfg", ".j2"}
# Folders that exist on the machine of one person or one job. A system path such as /usr/bin is no such place.
ONE_MACHINE = re.compile(r"(?<![\w.$})/-])/(?:work|tmp|home|root|Users|builds)/\w")


def code_files(tree_files: list[Path]) -> list[Path]:
    return [path for path in tree_files if path.suffix in CODE]


def n_lines(path: Path) -> int:
    return len(path.read_text(encoding="utf-8").splitlines())


def python_functions(path: Path) -> Iterator[tuple[str, int]]:
    """Name and number of lines of each function in a Python file."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            yield node.name, (node.end_lineno or node.lineno) - node.lineno + 1


def rust_functions(text: str) -> Iterator[tuple[str, int]]:
    """Name and number of lines of each function in text formatted by rustfmt (it closes at its own indentation)."""
    lines = text.splitlines()
    for start, line in enumerate(lines):
        found = re.match(r"(\s*)(?:pub(?:\([^)]*\))? )?(?:const |unsafe )*fn (\w+)", line)
        if found:
            closing = found.group(1) + "}"
            end = next((at for at in range(start, len(lines)) if lines[at] == closing), start)
            yield found.group(2), end - start + 1


def test_no_file_is_too_long(tree_files: list[Path], project_root: Path) -> None:
    lengths = {str(path.relative_to(project_root)): n_lines(path) for path in code_files(tree_files)}
    asked = {name: length for name, length in lengths.items() if length > FILE_LINES_ASK}
    if asked:
        warnings.warn(f"files over {FILE_LINES_ASK} lines ask to be looked at: {asked}", stacklevel=1)
    assert {name: length for name, length in asked.items() if length > FILE_LINES_STOP} == {}


def test_long_functions_are_told(tree_files: list[Path], project_root: Path) -> None:
    functions = {}
    for path in code_files(tree_files):
        found = rust_functions(path.read_text(encoding="utf-8")) if path.suffix == ".rs" else python_functions(path)
        functions |= {f"{path.relative_to(project_root)}:{name}": length for name, length in found}
    assert functions, "no function found: the search is broken"
    asked = {name: length for name, length in functions.items() if length > FUNCTION_LINES_ASK}
    if asked:
        warnings.warn(f"functions over {FUNCTION_LINES_ASK} lines ask to be looked at: {asked}", stacklevel=1)


def test_rust_functions_are_measured() -> None:
    text = "impl A {\n    pub(crate) fn b(\n        x: u8,\n    ) {\n        x\n    }\n}\nfn c() {}\n"
    assert dict(rust_functions(text)) == {"b": 5, "c": 1}


def test_no_path_of_one_machine(tree_files: list[Path], project_root: Path) -> None:
    wrong = [
        f"{path.relative_to(project_root)}:{number}: {line.strip()[:80]}"
        for path in tree_files
        if path.suffix in TEXT or path.name in {"Makefile", "run"}
        for number, line in enumerate(path.read_text(encoding="utf-8", errors="replace").splitlines(), 1)
        if ONE_MACHINE.search(line)
    ]
    assert wrong == []


def test_the_path_check_sees_one() -> None:
    assert ONE_MACHINE.search('open("' + "/" + 'tmp/a.txt")')
    assert not ONE_MACHINE.search("python/tmp/a and https://example.org/home/page")
